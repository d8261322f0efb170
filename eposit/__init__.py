"""EPOSIT: absolute camera pose for pinhole and fish-eye cameras (NumPy, SciPy and llvmlite)."""

# The compared solvers are imported here, so that `eposit.opnp.solve` works after `import eposit`. SciPy, which takes
# three times as long to load as all of this, and LLVM are loaded by what needs them first.
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
