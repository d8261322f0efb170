"""The poses of a recipe, each made from its number alone."""

from __future__ import annotations

from datasets.errors import UserError
from datasets.plan.faults import cameras_of, fault_of
from datasets.plan.frame import Stream, rng_for
from datasets.recipe.model import Recipe
from datasets.trajectories.helix import Helix
from datasets.trajectories.listed import Listed
from datasets.trajectories.scatter import MAX_TRIES, Scatter
from datasets.trajectories.view import PosedFrame, hand_held
from eposit import Pose


def pose_of(recipe: Recipe, pose_id: int) -> Pose:
    """Where the target stands in front of the camera.

    Raises:
        UserError: a scattered pose that no draw fits.
    """
    path, target = recipe.trajectory, recipe.target
    if isinstance(path, Helix):
        return path.cam_from_obj(path.time_s(pose_id), target)
    return _scattered(path, recipe, pose_id) if isinstance(path, Scatter) else path.pose(pose_id, target)


def view_of(recipe: Recipe, pose_id: int) -> PosedFrame:
    """Where the target stands and how it moves. Errors as `pose_of`."""
    path, target = recipe.trajectory, recipe.target
    if isinstance(path, Helix):
        return path.view(path.time_s(pose_id), target)
    pose = pose_of(recipe, pose_id)
    rng = rng_for(recipe.seed, Stream.HAND, pose_id)
    rate = hand_held(pose, target, path.speed_mm_per_s, path.turn_deg_per_s, rng)
    defocus = path.poses[pose_id].defocus_radius_px if isinstance(path, Listed) else None
    return PosedFrame(float(pose_id), pose, rate, defocus)


def _scattered(path: Scatter, recipe: Recipe, pose_id: int) -> Pose:
    def fits(pose: Pose) -> bool:
        cameras = cameras_of(recipe, pose)
        return bool(cameras) and all(fault_of(camera, pose, recipe) is None for camera in cameras)

    rng = rng_for(recipe.seed, Stream.POSE, pose_id)
    pose = path.pose(rng, recipe.target, recipe.cameras[0].true_camera(), fits)
    if pose is None:
        raise UserError(
            f"pose {pose_id}: none of {MAX_TRIES} random poses has the whole target in every camera; increase "
            "depth_range_mm, or narrow offset_range_mm and tilt_range_deg"
        )
    return pose
