"""Arrays and arguments for the public functions: an answer, or a ValueError with a sentence."""

from __future__ import annotations

import contextlib
import random
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

import eposit
from datasets.recipe.model import parse_recipe
from datasets.store.dataset import open_dataset
from datasets.store.images import decode_pixels, decode_png
from eposit import gpnpf, opnp, pnpfr
from eposit.released import solve as released
from render.targets.chessboard import Chessboard
from tests.hostile.running import Call
from tests.hostile.values import any_number, any_value
from tests.wrong_input import Place

LENSES = (*eposit.LENS_NAMES,)
NUMBERS = {"fx": 500.0, "fy": 500.0, "cx": 400.0, "cy": 300.0, "width": 800, "height": 600}


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """Some calls, each with wrong arguments."""
    calls: list[Call] = []
    told: list[str] = []
    for _ in range(5):
        what, call = rng.choice((_solve, _solve, _solve, _solve, _others, _camera, _lens, _board, _texts))(rng)
        told.append(what)
        calls.append(_judged(what, call))
    return "; ".join(told)[:300], calls


def _judged(what: str, call: Callable[[], Any]) -> Callable[[], int]:
    """0 for an answer, 2 for a sentence in a ValueError."""

    def run() -> int:
        try:
            call()
        except ValueError as error:
            text = str(error)
            print(f"error: {text}" if len(text.split()) >= 4 else f"no sentence: {text} of {what}", file=sys.stderr)
            return 2
        except BaseException:
            print(what, file=sys.stderr)
            raise
        return 0

    return run


def _good(rng: random.Random) -> tuple[Any, Any, Any]:
    noise = np.random.default_rng(rng.randrange(2**32))
    n = rng.choice((4, 5, 6, 8, 10, 40))
    points = noise.uniform(-500, 500, (n, 3))
    if rng.random() < 0.3:
        points[:, 2] = 0.0
    camera = eposit.Camera(lens=rng.choice(("perspective", "equisolid", "orthogonal")), **NUMBERS)
    return points, camera.project(points + [0.0, 0.0, 2000.0]), camera


def _hostile(rng: random.Random, array: Any) -> Any:
    """An array of the same kind with something wrong."""
    changed = np.array(array, np.float64)
    ways: list[Callable[[], Any]] = [
        lambda: _put(rng, changed, any_number(rng)),
        lambda: changed * rng.choice((1e300, 1e-300, 1e-320, 1e150, 1e-150, 1e20, 1e-20, 0.0)),
        lambda: changed.astype(complex),
        lambda: changed.astype(complex) + 1j,
        lambda: changed.astype(str),
        lambda: changed.astype(object),
        lambda: changed.astype(bool),
        lambda: changed.astype(np.float16),
        lambda: changed.astype(np.int8),
        lambda: changed.astype(np.longdouble),
        lambda: changed.tolist(),
        lambda: changed[::-1],
        lambda: changed.T,
        lambda: np.asfortranarray(changed),
        lambda: changed[:3],
        lambda: changed[:0],
        lambda: changed[:, :1],
        lambda: changed[None],
        lambda: changed[None, None],
        lambda: np.zeros((0, *changed.shape)),
        lambda: np.ma.masked_array(changed, mask=rng.random() < 0.5),
        lambda: np.ma.masked_invalid(changed),
        lambda: np.broadcast_to(changed[:1], changed.shape),
        lambda: np.repeat(changed[:1], len(changed), 0),
        lambda: np.full_like(changed, np.nan),
        lambda: changed.view(type("Own", (np.ndarray,), {})),
        lambda: np.matrix(changed) if changed.ndim == 2 else changed,
        lambda: memoryview(changed),
        lambda: changed.tobytes(),
        lambda: iter(changed),
        lambda: [[1, 2], [3]],
        lambda: [*changed.tolist()[:-1], "x"],
        lambda: {"a": 1},
        lambda: None,
        lambda: "points",
        lambda: any_value(rng),
        lambda: [changed] * 3,
        lambda: np.array(changed, dtype=[("x", float)]) if False else changed.astype("datetime64[s]"),
        lambda: np.datetime64("now"),
        lambda: _put(rng, changed + 1e15, 0.0),
        lambda: np.full_like(changed, any_number(rng)),
        lambda: changed.astype(">f8"),
        lambda: changed.astype(np.uint64),
    ]
    return rng.choice(ways)()


def _put(rng: random.Random, array: Any, value: Any) -> Any:
    with contextlib.suppress(OverflowError, ValueError):
        array.reshape(-1)[rng.randrange(array.size)] = value
    return array


def _solve(rng: random.Random) -> tuple[str, Callable[[], Any]]:
    points, pixels, camera = _good(rng)
    keywords: dict[str, Any] = {}
    what: list[str] = []
    for _ in range(rng.choice((1, 1, 2))):
        where = rng.choice(("points", "points", "pixels", "pixels", "camera", "keyword", "keyword"))
        if where == "points":
            points = _hostile(rng, points) if isinstance(points, np.ndarray) else points
        elif where == "pixels":
            pixels = _hostile(rng, pixels) if isinstance(pixels, np.ndarray) else pixels
        elif where == "camera":
            camera = rng.choice((None, {}, "camera", 5, object(), eposit.Camera, np.eye(3), [1, 2]))
        else:
            name = rng.choice(
                ("method", "refine", "sigma_px", "robust", "tol", "max_iterations", "theta_centre", "rays")
            )
            keywords[name] = rng.choice(
                (
                    any_value(rng),
                    any_number(rng),
                    np.ones(len(NUMBERS)),
                    np.full((3, 2, 2), 1.0),
                    _hostile(rng, np.ones((8, 3))),
                )
            )
            if name in ("max_iterations", "tol", "theta_centre") and rng.random() < 0.7:
                keywords["method"] = rng.choice(("eposit", "posit", "centred"))
        what.append(where)
    if rng.random() < 0.2:
        keywords.setdefault("robust", True)
    if rng.random() < 0.2:
        keywords.setdefault("method", rng.choice(("eposit", "posit", "centred")))
    shown = {name: _shown(value) for name, value in keywords.items()}
    told = f"solve {what} {_shown(points)} {_shown(pixels)} {str(camera)[:20]} {shown}"
    return told, lambda: eposit.solve(points, pixels, camera, **keywords)


def _others(rng: random.Random) -> tuple[str, Callable[[], Any]]:
    points, pixels, camera = _good(rng)
    which = rng.randrange(3)
    points = _hostile(rng, points) if which == 0 else points
    pixels = _hostile(rng, pixels) if which == 1 else pixels
    camera = rng.choice((None, {}, 5, camera)) if which == 2 else camera
    solver = rng.choice((opnp.solve, gpnpf.solve, pnpfr.solve, released))
    return f"{solver.__module__} {_shown(points)} {_shown(pixels)} {str(camera)[:20]}", lambda: solver(
        points, pixels, camera
    )


def _camera(rng: random.Random) -> tuple[str, Callable[[], Any]]:
    values: dict[str, Any] = {"lens": rng.choice(LENSES), **NUMBERS}
    for _ in range(rng.choice((1, 2))):
        values[rng.choice((*values, "coefficients"))] = any_value(rng)
    return f"Camera { ({k: _shown(v) for k, v in values.items()}) }", lambda: eposit.Camera(**values).project(
        [[0.0, 0.0, 1.0]]
    )


def _lens(rng: random.Random) -> tuple[str, Callable[[], Any]]:
    counts = {name: len(names) for name, (names, _) in eposit.COEFFICIENTS.items()}
    name = rng.choice(LENSES)
    coefficients = tuple(rng.choice((0.0, 0.1, -0.1, 0.6, any_number(rng))) for _ in range(counts.get(name, 0)))
    points = _hostile(rng, np.ones((3, 3)))
    pixels = _hostile(rng, np.ones((3, 2)) * 100)

    def call() -> None:
        camera = eposit.Camera(lens=name, coefficients=coefficients, **NUMBERS)
        rng.choice((camera.project, camera.sees))(points)
        rng.choice((camera.bearing, camera.contains))(pixels)

    return f"{name} {coefficients} {_shown(points)} {_shown(pixels)}", call


def _board(rng: random.Random) -> tuple[str, Callable[[], Any]]:
    names = (
        "columns",
        "rows",
        "square_mm",
        "margin_squares",
        "circle_square",
        "circle_radius_mm",
        "circle_height_mm",
        "white",
        "black",
    )
    values = {rng.choice(names): any_value(rng) for _ in range(rng.choice((1, 2)))}
    return f"Chessboard { ({k: _shown(v) for k, v in values.items()}) }", lambda: Chessboard(**values).point_grid


def _texts(rng: random.Random) -> tuple[str, Callable[[], Any]]:
    value = any_value(rng)
    data = rng.choice((b"", b"x", None, 5, "png", b"\x89PNG\r\n\x1a\n"))
    calls: dict[str, Callable[[], Any]] = {
        "parse_recipe": lambda: parse_recipe(value if isinstance(value, str) else "a = 1", "it"),
        "open_dataset": lambda: open_dataset(__import__("pathlib").Path(str(value).replace("\0", "")[:200])),
        "decode_png": lambda: decode_png(data),
        "decode_pixels": lambda: decode_pixels(data),
        "pose": lambda: eposit.Pose(np.eye(3), np.ones(3)).apply(_hostile(rng, np.ones((4, 3)))),
    }
    name = rng.choice(sorted(calls))
    return f"{name} {_shown(value)} {data!r}", calls[name]


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}"
    return f"{type(value).__name__} {str(value)[:20]!r}"
