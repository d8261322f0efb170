"""What a user has after `import eposit`, in a process that has imported nothing else."""

import subprocess
import sys


def test_every_solver_is_there_after_a_bare_import():
    names = ["opnp", "gpnpf", "pnpfr", "released"]
    call = f"import eposit; print([callable(getattr(eposit, name).solve) for name in {names}])"
    done = subprocess.run([sys.executable, "-c", call], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str([True] * 4)
