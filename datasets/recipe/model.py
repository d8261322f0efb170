"""A recipe: everything that decides a dataset's content, from one TOML file, strictly typed."""

from __future__ import annotations

import functools
import hashlib
import json
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError, field_validator, model_validator

from datasets.errors import UserError, did_you_mean
from datasets.recipe.camera_sets import SUFFIX, resolved
from datasets.recipe.cameras import CameraSpec
from datasets.recipe.cameras import assumed_camera as assumed_camera
from datasets.recipe.describe import Key, keys_of, sentence, values_of
from datasets.recipe.outputs import Outputs
from datasets.recipe.quality import QUALITIES, QualityName, quality_text
from datasets.recipe.sensor import sensor_values
from datasets.recipe.small_text import read_small_text
from datasets.recipe.targets import DEFAULT_PATTERN, target_values
from datasets.recipe.world_file import with_world_file
from datasets.recipe.written_out import written_out
from datasets.trajectories import TRAJECTORIES, Trajectory
from datasets.trajectories.helix import Helix
from render.light import Light
from render.optics import Optics
from render.sensor.presets import DEFAULT_REGIME, SensorModel, regimes
from render.targets.chessboard import CIRCLE, Chessboard
from render.targets.kinds import PATTERNS, AnyTarget
from render.world import World

RECIPES = resources.files("datasets") / "recipes"


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
    shard_frames: Annotated[
        int | None,
        Field(
            ge=1,
            le=10000,
            description="frames in one shard; if left out a sixteenth of all, at least 10, at most 1000 or as many as "
            "have 400 million pixels",
        ),
    ] = None
    allow_cropped: Annotated[bool, Field(description="whether target points may lie outside the image")] = False
    four: Annotated[
        tuple[tuple[int, int] | str, ...] | None,
        Field(
            description='points of `--use four`, M0 first: inner corners [column, row] from 0, or "circle"; '
            "the outermost corners of the first row and column and the circle if left out; only for pattern chessboard"
        ),
    ] = None
    target: Annotated[AnyTarget, Field(discriminator="pattern", description="the board")] = Chessboard()
    light: Annotated[Light, Field(description="lamp, surrounding, background")] = Light()
    sensor: Annotated[SensorModel, Field(description="linear light to 8 bits")] = SensorModel()
    world: Annotated[World, Field(description="what surrounds the target, and how its light is computed")] = World()
    optics: Annotated[Optics, Field(description="lens and shutter: what decides the rays of a picture")] = Optics()
    outputs: Annotated[Outputs, Field(description="what the dataset holds beside grey pictures")] = Outputs()
    trajectory: Annotated[Trajectory, Field(discriminator="kind", description="the target's path")] = Helix()
    cameras: Annotated[
        tuple[CameraSpec, ...],
        Field(min_length=1, description='the cameras, or the name of a set such as "paper"; each sees every pose'),
    ]
    _most_shard_frames: int | None = PrivateAttr(default=None)

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
        if self.world.method == "hybrid" and self.world.surface != "matt" and self.target.sheet.sag_mm:
            raise ValueError(
                f"world method is 'hybrid', whose shiny layer is flat, surface {self.world.surface!r}, and the target "
                f"bent by {self.target.sheet.sag_mm:g} mm; set surface to matt, bend_sag_mm to 0, or method to path"
            )
        if self.world.method == "hybrid" and self.optics.pupil:
            raise ValueError(
                f"optics aperture_mm is {self.optics.aperture_mm} and world method 'hybrid', which has sharp edges; "
                "set method to path or closed, or aperture_mm to 0"
            )
        if self.optics.is_chromatic and not self.outputs.colour:
            raise ValueError(
                f"optics red_focal is {self.optics.red_focal} and blue_focal {self.optics.blue_focal}, which takes "
                "pictures in colour; set colour = true under [outputs], or both to 1"
            )
        return self

    def sample_count(self) -> int:
        """`samples`, or the quality's."""
        return QUALITIES[self.quality].samples if self.samples is None else self.samples

    def four_indices(self) -> list[int]:
        """Rows in the target's `points` of the four points, M0 first.

        Of a target without a circle they are the outermost points of the first and the last row, all in one plane.

        Raises:
            ValueError: the recipe names four points of such a target, or one that the target does not have.
        """
        across, down = self.target.point_grid
        if not isinstance(self.target, Chessboard):
            if self.four is not None:
                raise ValueError(f'four is for pattern "chessboard"; leave it out for {self.target.pattern!r}')
            return [0, across - 1, across * (down - 1), across * down - 1]
        four = ((0, 0), (across - 1, 0), (0, down - 1), CIRCLE) if self.four is None else self.four
        return [self.target.index(point) for point in four]

    def chessboard(self) -> Chessboard:
        """The target, for what needs the chessboard with its circle.

        Raises:
            UserError: it is another kind.
        """
        if not isinstance(self.target, Chessboard):
            raise UserError(
                f'recipe {self.name} has the target {self.target.pattern!r}; this needs pattern = "chessboard"'
            )
        return self.target

    @property
    def most_shard_frames(self) -> int | None:
        """Most frames that a shard has where `shard_frames` is left out; None is today's rule."""
        return self._most_shard_frames

    def with_most_shard_frames(self, most: int) -> Recipe:
        """The same recipe, hash included, for a dataset that was cut by an earlier rule."""
        cut = self.model_copy()
        cut._most_shard_frames = most
        return cut

    def __hash__(self) -> int:
        return hash(self.digest())

    def __copy__(self) -> Self:
        """As `model_copy` begins, which may go on to change fields: the digest is made anew."""
        copied = super().__copy__()
        vars(copied).pop("_digest", None)
        return copied

    def digest(self) -> str:
        """Hash of everything that decides the content; name and description do not, nor how samples are chosen.

        Sections that a recipe leaves out take no part, nor do later keys of its sensor, so that these do not change the
        hashes of old recipes. Of a world's file its hash counts, not its place.
        """
        return self._digest

    @functools.cached_property  # each shard that is read or written asks several times, and nothing of it can change
    def _digest(self) -> str:
        content = self.model_dump(mode="json", exclude={"name", "description", "quality"})
        content["sensor"] = sensor_values(self.sensor)
        content |= {"samples": self.sample_count(), "target": target_values(self.target)}
        for name, default in (("world", World()), ("outputs", Outputs()), ("optics", Optics())):
            if getattr(self, name) == default:
                del content[name]
        if "world" in content and self.world.file_sha256:
            del content["world"]["file"]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def parse_recipe(text: str, source: str) -> Recipe:
    """The recipe in a TOML text. `source` names it in messages.

    Raises:
        UserError: not TOML, an unknown key (with the nearest known one), a wrong type or a value out of range.
    """
    try:
        return Recipe.model_validate_json(json.dumps(_completed(tomllib.loads(text), source)))
    except UserError:
        raise
    except RecursionError:
        raise UserError(f"{source} has lists in lists too deep to be read; a recipe needs three levels") from None
    except tomllib.TOMLDecodeError as error:
        raise UserError(f"{source} is not valid TOML: {error}; mend that line") from None
    except (TypeError, ValueError) as error:
        if isinstance(error, ValidationError):
            raise UserError(f"{source}: {sentence(error, Recipe)}") from None
        raise UserError(
            f"{source} holds a value that a recipe cannot take: {error}; use numbers, texts and lists"
        ) from None


def _completed(data: dict[str, Any], source: str) -> dict[str, Any]:
    """A recipe's data with its trajectory's and target's kinds and the values of the regime and cameras it names."""
    path, sensor, target = data.get("trajectory"), data.get("sensor"), data.get("target")
    if isinstance(target, dict):
        pattern = target.setdefault("pattern", DEFAULT_PATTERN)
        if pattern not in list(PATTERNS):
            raise UserError(f"{source}: target pattern is {pattern!r}; choose one of {', '.join(PATTERNS)}")
    if isinstance(path, dict):
        kind = path.setdefault("kind", "helix")
        if kind not in list(TRAJECTORIES):
            raise UserError(f"{source}: trajectory kind is {kind!r}; choose one of {', '.join(TRAJECTORIES)}")
    if isinstance(sensor, dict):
        regime = sensor.pop("regime", DEFAULT_REGIME)
        if regime not in list(regimes()):
            raise UserError(f"{source}: sensor regime is {regime!r}; choose one of {', '.join(regimes())}")
        data["sensor"] = asdict(regimes()[regime]) | sensor
    if "cameras" in data:
        data["cameras"] = resolved(data["cameras"], source)
    return data


def target_of(pattern: str, values: Sequence[str]) -> AnyTarget:
    """A target with a pattern's defaults but for some values, each KEY=VALUE as a line of a recipe's [target].

    Raises:
        UserError: an unknown pattern or key, a wrong value, or no KEY=VALUE.
    """
    lines = [f"pattern = {json.dumps(pattern)}", *values]
    text = "\n".join(['name = "target"', 'cameras = "paper"', "[target]", *lines])
    return parse_recipe(text, "target").target


def load_recipe(given: str | Path) -> tuple[Recipe, str]:
    """A recipe and its text, by path or by the name of one that comes with the package.

    The text has values instead of the names of camera sets, so that a dataset which keeps it needs nothing else.

    Raises:
        UserError: no such file or name, or a wrong recipe.
    """
    name = str(given)
    if isinstance(given, Path) or name.endswith(SUFFIX) or "/" in name:
        path = given if isinstance(given, Path) else Path(given)
        try:
            text = read_small_text(path)
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
            raise UserError(f"cannot read recipe {name}: {reason}; give a .toml file, or one of {_known()}") from None
        text = with_world_file(text, path.parent, name)
        return parse_recipe(text, name), written_out(text, name)
    if name not in recipe_names():
        hint = did_you_mean(name, recipe_names())
        raise UserError(f"unknown recipe {name!r}{hint}; known ones are {_known()}, or give a path to a .toml file")
    text = (RECIPES / f"{name}{SUFFIX}").read_text(encoding="utf-8")
    return parse_recipe(text, f"recipe {name}"), written_out(text, f"recipe {name}")


def recipe_names() -> list[str]:
    """Names of the recipes that come with the package."""
    return sorted(path.name.removesuffix(SUFFIX) for path in RECIPES.iterdir() if path.name.endswith(SUFFIX))


def describe() -> Iterator[Key]:
    """Key, default and meaning of every key of a recipe, from the same fields that validate it."""
    return keys_of(Recipe)


def values(recipe: Recipe) -> dict[str, str]:
    """Key to value for every key of `describe` that the recipe takes."""
    return values_of(recipe)


def _known() -> str:
    return ", ".join(recipe_names())
