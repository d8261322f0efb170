"""The part of a picture that the target can touch; outside it a picture needs no rendering."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render.motion import image_points
from render.targets import Target
from render.targets.image_region import Region

Image = NDArray[np.float32]  # (height, width) linear radiance
REGION_MARGIN = 8  # px around the target's outline; a point spread of 1.5 px needs 6


def target_region(target: Target, camera: Camera, cam_from_obj: Pose, margin: int = REGION_MARGIN) -> Region:
    """The smallest rectangle of the picture that holds the target's image and a margin.

    Raises:
        ValueError: the target has no image, or none inside the picture.
    """
    outline = image_points(camera, cam_from_obj, target.outline())
    if np.any(np.isnan(outline)):
        return Region.whole(camera.width, camera.height)  # part of the board is beyond the lens: it may reach anywhere
    low = np.floor(outline.min(axis=0)).astype(int) - margin
    high = np.ceil(outline.max(axis=0)).astype(int) + margin + 1
    low, high = np.maximum(low, 0), np.minimum(high, (camera.width, camera.height))
    if np.any(high <= low):
        raise ValueError("the target's image lies outside the picture; move the target or the camera")
    return Region.between((int(low[0]), int(low[1])), (int(high[0]), int(high[1])))
