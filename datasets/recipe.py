"""A recipe: everything that decides a dataset's content, from one TOML file, strictly typed."""

from __future__ import annotations

import difflib
import hashlib
import json
import tomllib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, is_dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from datasets.errors import UserError
from datasets.quality import QUALITIES, QualityName, quality_text
from datasets.trajectory import Trajectory
from eposit import Camera
from eposit.lens import LENS_NAMES
from render.develop import SensorModel
from render.light import Light
from render.target import CIRCLE, Target

RECIPES = resources.files("datasets") / "recipes"
SUFFIX = ".toml"
MAX_PIXELS = 100_000_000
LEAST_FOCAL_PX, MOST_FOCAL_PX = 1.0, 1e6
UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")  # Pydantic's types of fault


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSpec:
    """One camera of a recipe: the true one, which renders, and what a user without calibration would assume."""

    name: Annotated[str, "name in tables and on pictures"]
    lens: Annotated[str, "lens law: " + ", ".join(LENS_NAMES)]
    fx: Annotated[float, "true focal length along x, px"]
    fy: Annotated[float, "true focal length along y, px"]
    cx: Annotated[float, "true principal point, px"]
    cy: Annotated[float, "true principal point, px"]
    width: Annotated[int, "image width, px"] = 1600
    height: Annotated[int, "image height, px"] = 1200
    coefficients: Annotated[tuple[float, ...], "k1 to k4 of kannala_brandt; empty for the other lenses"] = ()
    nominal_f: Annotated[float | None, "nominal focal length, px; the mean of fx and fy if left out"] = None

    def __post_init__(self) -> None:
        if not (LEAST_FOCAL_PX <= self.fx <= MOST_FOCAL_PX and LEAST_FOCAL_PX <= self.fy <= MOST_FOCAL_PX):
            allowed = f"{LEAST_FOCAL_PX:g} to {MOST_FOCAL_PX:g} px"
            raise ValueError(f"camera {self.name!r} has fx {self.fx} and fy {self.fy}; both must lie in {allowed}")
        if self.width * self.height > MAX_PIXELS:
            raise ValueError(f"camera {self.name!r} has {self.width} x {self.height} pixels; at most {MAX_PIXELS} work")
        if self.nominal_f is not None and not self.nominal_f > 0.0:
            raise ValueError(f"camera {self.name!r} has nominal_f {self.nominal_f}; it must be above 0 px")
        self.true_camera()

    def true_camera(self) -> Camera:
        """The camera that renders."""
        return Camera(
            lens=self.lens, fx=self.fx, fy=self.fy, cx=self.cx, cy=self.cy,
            width=self.width, height=self.height, coefficients=self.coefficients,
        )  # fmt: skip

    def nominal_camera(self) -> Camera:
        """Nominal focal length on both axes and the image centre as the principal point."""
        f = 0.5 * (self.fx + self.fy) if self.nominal_f is None else self.nominal_f
        return assumed_camera(self.true_camera(), f)


def assumed_camera(true: Camera, nominal_f: float) -> Camera:
    """What a user without calibration assumes: the nominal focal length, px, and the image centre."""
    return true.replace(fx=nominal_f, fy=nominal_f, cx=true.width / 2.0, cy=true.height / 2.0)


class Recipe(BaseModel):
    """What a recipe file holds."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,64}$", description="name of the dataset")]
    description: Annotated[str, Field(description="what it is for, one line")] = ""
    seed: Annotated[int, Field(ge=0, lt=2**63, description="seed of everything random; 0 is a seed")] = 0
    quality: Annotated[QualityName, Field(description=f"how finely edges are rendered: {quality_text()}")] = "standard"
    samples: Annotated[
        int | None,
        Field(
            ge=1, le=65536, description="cells of a pixel where edges meet, a square number; the quality's if left out"
        ),
    ] = None
    shard_frames: Annotated[int, Field(ge=1, le=10000, description="frames in one shard")] = 10
    allow_cropped: Annotated[bool, Field(description="whether target points may lie outside the image")] = False
    four: Annotated[
        tuple[tuple[int, int] | str, ...] | None,
        Field(
            description='points of `--use four`, M0 first: inner corners [column, row] from 0, or "circle"; '
            "the outermost corners of the first row and column and the circle if left out"
        ),
    ] = None
    target: Annotated[Target, Field(description="the board and its circle")] = Target()
    light: Annotated[Light, Field(description="lamp, surrounding, background")] = Light()
    sensor: Annotated[SensorModel, Field(description="linear light to 8 bits")] = SensorModel()
    trajectory: Annotated[Trajectory, Field(description="the target's path")] = Trajectory()
    cameras: Annotated[tuple[CameraSpec, ...], Field(min_length=1, description="the cameras; each sees every pose")]

    @field_validator("samples")
    @classmethod
    def _square(cls, samples: int | None) -> int | None:
        if samples is not None and round(samples**0.5) ** 2 != samples:
            raise ValueError(f"samples is {samples}; it must be a square number such as 16, 64 or 256")
        return samples

    @model_validator(mode="after")
    def _fits_together(self) -> Recipe:
        names = [camera.name for camera in self.cameras]
        if len(set(names)) < len(names):
            raise ValueError(f"cameras are named {', '.join(names)}; give each its own name")
        indices = self.four_indices()
        if len(indices) != 4 or len(set(indices)) != 4:
            raise ValueError(
                f"four has {len(indices)} points, {len(set(indices))} of them different; give four different ones"
            )
        return self

    def sample_count(self) -> int:
        """`samples`, or the quality's."""
        return QUALITIES[self.quality].samples if self.samples is None else self.samples

    def four_indices(self) -> list[int]:
        """Rows in `Target.points` of the four points, M0 first."""
        across, down = self.target.inner
        four = ((0, 0), (across - 1, 0), (0, down - 1), CIRCLE) if self.four is None else self.four
        return [self.target.index(point) for point in four]

    def __hash__(self) -> int:
        return hash(self.digest())

    def digest(self) -> str:
        """Hash of everything that decides the content; name and description do not, nor how samples are chosen."""
        content = self.model_dump(mode="json", exclude={"name", "description", "quality"})
        content["samples"] = self.sample_count()
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def parse_recipe(text: str, source: str) -> Recipe:
    """The recipe in a TOML text. `source` names it in messages.

    Raises:
        UserError: not TOML, an unknown key (with the nearest known one), a wrong type or a value out of range.
    """
    try:
        return Recipe.model_validate_json(json.dumps(tomllib.loads(text)))
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{source} is not valid TOML: {error}; mend that line") from None
    except (TypeError, ValueError) as error:
        if isinstance(error, ValidationError):
            raise UserError(f"{source}: {_sentence(error)}") from None
        raise UserError(
            f"{source} holds a value that a recipe cannot take: {error}; use numbers, texts and lists"
        ) from None


def load_recipe(name: str) -> tuple[Recipe, str]:
    """A recipe and its text, by path or by the name of one that comes with the package.

    Raises:
        UserError: no such file or name, or a wrong recipe.
    """
    if name.endswith(SUFFIX) or "/" in name:
        try:
            text = Path(name).read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
            raise UserError(f"cannot read recipe {name}: {reason}; give a .toml file, or one of {_known()}") from None
        return parse_recipe(text, name), text
    if name not in recipe_names():
        close = difflib.get_close_matches(name, recipe_names(), n=1)
        hint = f"did you mean {close[0]}? " if close else ""
        raise UserError(f"unknown recipe {name!r}; {hint}known ones are {_known()}, or give a path to a .toml file")
    text = (RECIPES / f"{name}{SUFFIX}").read_text(encoding="utf-8")
    return parse_recipe(text, f"recipe {name}"), text


def recipe_names() -> list[str]:
    """Names of the recipes that come with the package."""
    return sorted(path.name.removesuffix(SUFFIX) for path in RECIPES.iterdir() if path.name.endswith(SUFFIX))


def describe(model: type[Any] = Recipe, prefix: str = "") -> Iterator[tuple[str, str, str]]:
    """Key, default and meaning of every key of a recipe, from the same fields that validate it."""
    if issubclass(model, BaseModel):
        for name, info in model.model_fields.items():
            nested = next((kind for kind in (info.annotation, *get_args(info.annotation)) if is_dataclass(kind)), None)
            default = "required" if info.is_required() else _toml(info.default)
            yield f"{prefix}{name}", "section" if nested else default, info.description or ""
            if isinstance(nested, type):
                yield from describe(nested, f"{prefix}{name}.")
        return
    hints = get_type_hints(model, include_extras=True)
    instance = None if model is CameraSpec else model()
    for field in fields(model):
        meaning = hints[field.name].__metadata__[0]
        default = _toml(getattr(instance, field.name)) if instance else _field_default(field)
        yield f"{prefix}{field.name}", default, meaning


def values(recipe: Recipe) -> dict[str, str]:
    """Key to value for every key of `describe`; those of the cameras are lists over the cameras."""
    found: dict[str, str] = {}
    for key, _, _ in describe():
        head, _, tail = key.partition(".")
        value = getattr(recipe, head)
        if head == "cameras":
            found[key] = (
                ", ".join(_toml(getattr(camera, tail)) for camera in value) if tail else f"{len(value)} cameras"
            )
        else:
            found[key] = _toml(getattr(value, tail)) if tail else "section" if is_dataclass(value) else _toml(value)
    return found


def _field_default(field: Any) -> str:
    from dataclasses import MISSING

    return "required" if field.default is MISSING else _toml(field.default)


def _toml(value: Any) -> str:
    if is_dataclass(value) and not isinstance(value, type):
        return json.dumps(asdict(value))
    return "none" if value is None else json.dumps(value)


def _known() -> str:
    return ", ".join(recipe_names())


def _sentence(error: ValidationError) -> str:
    """The first fault of a validation as one sentence with the key's path."""
    # A misspelt key is missing under its right name as well: what is unknown comes first.
    first = min(error.errors(include_url=False), key=lambda fault: fault["type"] not in UNKNOWN_KEY)
    path = [
        str(part) for part in first["loc"] if not (isinstance(part, str) and part.startswith(("tuple[", "literal[")))
    ]
    key = ".".join(path) or "recipe"
    kind, given = first["type"], first.get("input")
    if kind in UNKNOWN_KEY:
        known = _keys_beside(path)
        close = difflib.get_close_matches(path[-1], known, n=1)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        return f"unknown key {key!r}{hint}; known keys there are {', '.join(known)}"
    if kind in ("missing", "missing_argument", "missing_keyword_only_argument"):
        return f"key {key!r} is missing; add it"
    if kind == "value_error":
        return str(first.get("ctx", {}).get("error", first["msg"]))
    meaning = next((text for name, _, text in describe() if name == ".".join(p for p in path if not p.isdigit())), "")
    return f"key {key!r} is {_short(given)} ({first['msg'][:1].lower()}{first['msg'][1:]}); it takes: {meaning}"


def _keys_beside(path: list[str]) -> list[str]:
    parents = [part for part in path[:-1] if not part.isdigit()]
    prefix = ".".join(parents)
    keys = [key for key, _, _ in describe()]
    return [key.rpartition(".")[2] for key in keys if key.rpartition(".")[0] == prefix]


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
