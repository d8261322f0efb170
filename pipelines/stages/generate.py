"""Stage 1: render, develop and store images with their truth."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.errors import UserError
from datasets.plan import Frame, frame_ids_of_shard, frames_of_shard, shard_count
from datasets.recipe.model import Recipe
from datasets.rows import pose_columns, table
from datasets.schema import FRAMES, KEYPOINTS, MOTION_COLUMNS, WORLD_PREFIX
from datasets.store.baked_light import light_of
from datasets.store.dataset import Dataset
from datasets.store.images import encode_png
from datasets.store.kept_masters import Kept, kept_of
from datasets.store.linear_images import MASTERS, LinearImageError, linear_path, write_linear
from datasets.store.masters import Master, archive_path, master_of, read_master
from datasets.store.packing import drop_packed_files, pack_masters
from datasets.store.pixel_truth import truth_path, write_truth
from datasets.store.refusals import refused
from eposit import Pose
from eposit.arrays import Array, Mask
from eposit.calibrated_lens import MOST_COEFFICIENTS
from eposit.pose import tilt_rad
from pipelines.engines.background import overlapped
from render.frame import LinearImage, render_world
from render.frame_truth import truth_of
from render.hybrid.bake import BakedLight
from render.motion import RollingPose, image_points, points_in_cam
from render.pathtraced.tiles import Viewpoint
from render.sensor.develop import FrameContext, develop
from render.targets.image_region import Region
from render.truth.pixels import PixelTruth


def is_done(dataset: Dataset, index: int) -> bool:
    """Whether both tables of a shard are there, its masters if they are kept, and its truth if it is asked."""
    count = shard_count(dataset.recipe)
    if not all(dataset.is_done(dataset.shard_path(name, index, count)) for name in ("frames", "keypoints")):
        return False
    kept, chosen = kept_of(dataset.root), frame_ids_of_shard(dataset.recipe, index)
    if kept is Kept.ARCHIVES and not (dataset.root / archive_path(chosen)).is_file():
        return False
    files = [linear_path] if kept is Kept.FILES else []
    files += [truth_path] if dataset.recipe.outputs.aovs else []
    return all((dataset.root / path_of(frame_id)).is_file() for path_of in files for frame_id in chosen)


def finish_packing(dataset: Dataset) -> None:
    """Remove what a run that was stopped while it packed has left of single linear images.

    Raises:
        UserError: the disk or its permissions refuse.
    """
    if kept_of(dataset.root) is Kept.ARCHIVES:
        try:
            drop_packed_files(dataset.root, dataset.recipe)
        except OSError as error:
            raise refused(dataset.root / MASTERS, error) from error


def run_shard(dataset: Dataset, index: int, advance: Callable[[], None] = lambda: None) -> None:
    """Make one shard of `frames` and `keypoints` and its masters, which are packed, or removed if they are not kept.

    What is there of them stays.

    advance: called after each frame.
    """
    recipe = dataset.recipe
    count, chosen = shard_count(recipe), frames_of_shard(recipe, index)
    visible: list[Mask | None] = []
    kept = kept_of(dataset.root)
    rows = list(overlapped(_makers(dataset, chosen, visible, kept), advance))
    if kept is Kept.ARCHIVES:
        _pack(dataset, frame_ids_of_shard(recipe, index))
    truth = pa.concat_tables(_keypoints(recipe, frame, seen) for frame, seen in zip(chosen, visible, strict=True))
    for name, made in (("keypoints", truth), ("frames", pa.Table.from_pylist(rows, schema=FRAMES))):
        path = dataset.shard_path(name, index, count)
        if not dataset.is_done(path):
            dataset.write_shard(path, made)
    if kept is Kept.NOT:
        for frame in chosen:  # of another dataset, put there by `--reuse`
            (dataset.root / linear_path(frame.frame_id)).unlink(missing_ok=True)


def _pack(dataset: Dataset, shard: range) -> None:
    try:
        pack_masters(dataset.root, shard)
    except OSError as error:
        raise refused(dataset.root / archive_path(shard), error) from error


def _makers(
    dataset: Dataset, chosen: Iterable[Frame], visible: list[Mask | None], kept: Kept
) -> Iterator[Callable[[], dict[str, object]]]:
    """What finishes each frame once its rays are traced. visible: gets which of each frame's points are."""
    for frame in chosen:
        master = master_of(dataset.root, dataset.recipe, frame, kept)
        light, is_new = _light(dataset, frame, master)
        traced = _traced(dataset.recipe, frame)
        visible.append(traced.visible)
        new = master if is_new and kept is not Kept.NOT else None
        yield functools.partial(_finish, dataset, frame, light, new, traced.pixels)


@dataclass(frozen=True, slots=True)
class _Traced:
    """Truth by rays, None where the recipe needs none."""

    visible: Mask | None = None
    pixels: PixelTruth | None = None


def _traced(recipe: Recipe, frame: Frame) -> _Traced:
    is_world = recipe.world.method != "closed"
    if not is_world and not recipe.outputs.aovs:
        return _Traced()
    camera, pose = frame.camera.true_camera(), frame.cam_from_obj
    try:
        found = truth_of(recipe.world, frame.world, recipe.target, recipe.light, camera, pose)
    except ValueError as error:
        raise UserError(f"frame {frame.frame_id}: {error}") from error
    return _Traced(found.visible() if is_world else None, found.pixels() if recipe.outputs.aovs else None)


def _light(dataset: Dataset, frame: Frame, master: Master) -> tuple[LinearImage, bool]:
    """The frame's linear light, and whether it is new: read if it is there and made from the same things."""
    try:
        return read_master(master), False
    except LinearImageError:
        return _rendered(dataset.recipe, frame, dataset.root), True


def linear_light(dataset: Dataset, frame: Frame) -> LinearImage:
    """The frame's linear light: that of the dataset where it is kept, else rendered anew.

    Raises:
        UserError: it cannot be rendered.
    """
    return _light(dataset, frame, master_of(dataset.root, dataset.recipe, frame, kept_of(dataset.root)))[0]


def _rendered(recipe: Recipe, frame: Frame, root: Path | None = None) -> LinearImage:
    """root: folder of the dataset that keeps the baked light; without one it is kept in memory."""
    view = Viewpoint(frame.camera.true_camera(), frame.cam_from_obj, frame.render_seed, recipe.optics)
    scenery = recipe.world, frame.world, recipe.target, recipe.light
    samples, in_colour = recipe.sample_count(), recipe.outputs.colour
    try:
        baked = _baked(recipe, frame, root)
        return render_world(*scenery, view, samples=samples, in_colour=in_colour, baked=baked)
    except ValueError as error:
        raise UserError(f"frame {frame.frame_id}: {error}") from error


def _baked(recipe: Recipe, frame: Frame, root: Path | None) -> BakedLight | None:
    if root is None or recipe.world.method != "hybrid":
        return None
    try:
        return light_of(root, recipe, frame)
    except OSError as error:
        raise refused(root, error) from error


def _developed(recipe: Recipe, frame: Frame, linear: LinearImage) -> NDArray[np.uint8]:
    camera = frame.camera.true_camera()
    context = FrameContext(recipe.target, camera, frame.cam_from_obj, frame.rate, linear.region, frame.sensor_seed)
    return develop(linear.full(camera), frame.sensor, context)


def picture(recipe: Recipe, frame: Frame) -> NDArray[np.uint8]:
    """(height, width) grey values of a frame, or (height, width, 3) RGB, rendered anew.

    Raises:
        UserError: it cannot be rendered.
    """
    return _developed(recipe, frame, _rendered(recipe, frame))


def _finish(
    dataset: Dataset, frame: Frame, linear: LinearImage, new: Master | None, truth: PixelTruth | None
) -> dict[str, object]:
    """Write the linear image and the truth if there are any, develop, and make the frame's row.

    new: where the linear image is to be kept; None if it is there already, or none is kept.
    """
    recipe, spec = dataset.recipe, frame.camera
    path = dataset.root / linear_path(frame.frame_id)
    try:
        if new is not None:
            write_linear(linear, spec.true_camera(), path, new.key)
        if truth is not None:
            path = dataset.root / truth_path(frame.frame_id)
            if not path.is_file():
                write_truth(truth, recipe.outputs.aovs, path)
    except OSError as error:
        raise refused(path, error) from error
    image = _developed(recipe, frame, linear)
    return _row(recipe, frame, linear.region, image)


def _row(recipe: Recipe, frame: Frame, region: Region, image: NDArray[np.uint8]) -> dict[str, object]:
    """The frame's row of `frames`."""
    spec = frame.camera
    coefficients = np.zeros(MOST_COEFFICIENTS)
    coefficients[: len(spec.coefficients)] = spec.coefficients
    has_world = recipe.world.method != "closed"
    drawn = {f"{WORLD_PREFIX}{name}": value if has_world else None for name, value in asdict(frame.world).items()}
    pose = {
        name: values[0] for name, values in pose_columns(frame.cam_from_obj.R[None], frame.cam_from_obj.t[None]).items()
    }
    return {
        "frame_id": frame.frame_id,
        "pose_id": frame.pose_id,
        "time_s": frame.time_s,
        "camera_name": spec.name,
        "lens": spec.lens,
        "image": {"bytes": encode_png(image), "path": f"{frame.frame_id:06d}.png"},
        **pose,
        **{f"{name}_px": getattr(spec, name) for name in ("fx", "fy", "cx", "cy")},
        **{f"k{i}": float(k) for i, k in enumerate(coefficients, 1)},
        "nominal_f_px": spec.nominal_camera().fx,
        "tilt_deg": float(np.degrees(tilt_rad(frame.cam_from_obj.R))),
        "width_px": spec.width,
        "height_px": spec.height,
        **dict(zip((f"region_{a}_px" for a in Region._fields), region, strict=True)),
        "render_seed": frame.render_seed,
        "sensor_seed": frame.sensor_seed,
        "master": linear_path(frame.frame_id),
        "truth": truth_path(frame.frame_id) if recipe.outputs.aovs else None,
        **drawn,
        **_motion_columns(frame.cam_from_obj),
    }


def _motion_columns(pose: Pose) -> dict[str, float | None]:
    """The line time and the pose's rate under a rolling shutter, null under a global one."""
    if not isinstance(pose, RollingPose):
        return dict.fromkeys(MOTION_COLUMNS)
    rate = pose.rate.velocity_mm_per_s, pose.rate.turn_rad_per_s
    return dict(zip(MOTION_COLUMNS, (1e6 * pose.line_time_s, *np.concatenate(rate).tolist()), strict=True))


def true_points(recipe: Recipe, frame: Frame) -> Array:
    """(n, 2) px images of the target's points, NaN beyond the lens."""
    return image_points(frame.camera.true_camera(), frame.cam_from_obj, recipe.target.points)


def _keypoints(recipe: Recipe, frame: Frame, visible: Mask | None) -> pa.Table:
    target, camera = recipe.target, frame.camera.true_camera()
    points, pixels = target.points, true_points(recipe, frame)
    in_cam = points_in_cam(camera, frame.cam_from_obj, points)
    outline = pixels.copy()
    for point in range(len(points)):
        rim = target.rim(point)
        if rim is not None:
            outline[point] = outline_centroid(image_points(camera, frame.cam_from_obj, rim))
    return table(
        KEYPOINTS,
        {
            "frame_id": np.full(len(points), frame.frame_id),
            "point_id": np.arange(len(points)),
            **{f"{axis}_obj_mm": points[:, i] for i, axis in enumerate("xyz")},
            "x_px": pixels[:, 0],
            "y_px": pixels[:, 1],
            "x_outline_px": outline[:, 0],
            "y_outline_px": outline[:, 1],
            "theta_deg": np.degrees(np.arctan2(np.hypot(in_cam[:, 0], in_cam[:, 1]), in_cam[:, 2])),
            "in_image": camera.contains(pixels),
            "visible": np.full(len(points), None) if visible is None else visible,
        },
    )


def outline_centroid(polygon: np.ndarray) -> np.ndarray:
    """(2,) area centroid of a closed polygon (n, 2)."""
    origin = polygon[0]  # near the polygon, so that differences of large products do not cost digits
    p = polygon - origin
    following = np.roll(p, -1, axis=0)
    cross = p[:, 0] * following[:, 1] - p[:, 1] * following[:, 0]
    return origin + cross @ (p + following) / (3.0 * cross.sum())
