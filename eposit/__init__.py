"""EPOSIT: absolute camera pose for pinhole and fish-eye cameras (NumPy, SciPy and Numba)."""

# The compared solvers are imported here, so that `eposit.opnp.solve` works after `import eposit`. Little is gained by
# importing them later: of the 490 ms of processor time that `import eposit` takes, NumPy has 105, SciPy 305 and these
# four 30.
from eposit import gpnpf, opnp, pnpfr, released
from eposit.camera import Camera
from eposit.lens import COEFFICIENTS, LENS_NAMES, get_lens
from eposit.lens_law import Lens
from eposit.pose import Pose
from eposit.solution import Solution, Status
from eposit.solver import METHODS, solve

__all__ = [
    "COEFFICIENTS",
    "LENS_NAMES",
    "METHODS",
    "Camera",
    "Lens",
    "Pose",
    "Solution",
    "Status",
    "get_lens",
    "gpnpf",
    "opnp",
    "pnpfr",
    "released",
    "solve",
]
