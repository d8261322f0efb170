"""EPOSIT: absolute camera pose for pinhole and fish-eye cameras (NumPy and SciPy only)."""

from eposit.camera import Camera
from eposit.lens import LENS_NAMES, Lens, get_lens
from eposit.pose import Pose
from eposit.solution import Solution, Status
from eposit.solver import METHODS, solve

__all__ = ["LENS_NAMES", "METHODS", "Camera", "Lens", "Pose", "Solution", "Status", "get_lens", "solve"]
