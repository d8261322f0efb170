"""EPOSIT: absolute camera pose for pinhole and fish-eye cameras (NumPy and SciPy only)."""

# The compared solvers are imported here, so that `eposit.opnp.solve` works after `import eposit`. Nothing is gained by
# importing them later: of the 600 ms that `import eposit` takes, SciPy has 500 and these four have 20.
from eposit import gpnpf, opnp, pnpfr, released
from eposit.camera import Camera
from eposit.lens import LENS_NAMES, Lens, get_lens
from eposit.pose import Pose
from eposit.solution import Solution, Status
from eposit.solver import METHODS, solve

__all__ = [
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
