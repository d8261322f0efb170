"""The house: which packages are ours, what an import costs, what the documents say."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from pipelines.cli import all_commands

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = all_commands()


def test_datasets_and_render_are_ours():
    """Both names belong to other packages on PyPI; in this environment they must be this checkout's."""
    import datasets
    import render

    assert Path(datasets.__file__).is_relative_to(ROOT)
    assert Path(render.__file__).is_relative_to(ROOT)


def test_no_file_has_marks_of_a_merge_that_was_left_open():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("this is no checkout")
    for name in filter(None, listed.stdout.split("\0")):
        path = ROOT / name
        if path.suffix in {".py", ".md", ".toml", ".yml", ".js", ".css", ".txt"} and path.is_file():
            assert not re.search(r"^(<{7} |>{7} )", path.read_text(), re.MULTILINE), name


def test_help_loads_nothing_heavy():
    code = (
        "import sys, pipelines.cli, eposit\n"
        "heavy = {'mitsuba', 'drjit', 'cv2', 'pyarrow', 'matplotlib', 'OpenEXR'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_eposit_needs_numpy_scipy_and_llvmlite_only():
    code = (
        "import sys, eposit\n"
        "ours = {'datasets', 'render', 'pipelines'}\n"
        "other = (ours | {'mitsuba', 'cv2', 'pyarrow', 'pydantic', 'typer', 'numba'}) & set(sys.modules)\n"
        "assert not other, other"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_scipy_and_llvm_are_loaded_by_what_needs_them_only():
    code = "import sys, eposit; assert not {'scipy', 'llvmlite'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_and_an_example(name):
    command = COMMANDS[name]
    assert command.help
    assert command.epilog.startswith("Example: python -m pipelines ")


# Functions that may be longer than 60 lines, and why.
LONG = {
    "solve": "half of it is the contract that users read",
    "derivatives": "one pass over the points, with all sums in local variables: a sum in memory would wait for it",
    "register_sensor": "defines a class inside it: its base is there only once Mitsuba's variant is set",
}


def test_source_files_and_functions_are_small():
    for package in ("eposit", "render", "datasets", "pipelines"):
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text()
            assert len(text.splitlines()) <= 300, path
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.FunctionDef) and node.name not in LONG:
                    assert node.end_lineno - node.lineno < 60, (path, node.name)


def test_the_wheel_lists_every_package_of_the_library():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    found = [path.parent.relative_to(ROOT) for path in (ROOT / "eposit").rglob("__init__.py")]
    assert sorted(listed) == sorted(".".join(path.parts) for path in found)


def test_the_hosted_runner_uses_targets_that_exist():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text())["jobs"]
    steps = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    matrix = jobs["library"]["strategy"]["matrix"]["include"]
    used = {word for step in steps for word in step.split()[1:] if step.startswith("make") and word.isidentifier()}
    used |= {entry["target"] for entry in matrix} | {"test-full"}
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.M))
    assert used <= targets


@pytest.mark.full
def test_the_wheel_holds_eposit_only_and_works_alone(tmp_path):
    import venv
    import zipfile

    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0] for name in names if ".dist-info" not in name} == {"eposit"}
    assert "eposit/py.typed" in names
    venv.create(tmp_path / "empty", with_pip=True)
    python = tmp_path / "empty" / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", str(wheel)], check=True)
    code = (
        "import eposit, numpy as np, importlib.util as u\n"
        "assert not any(u.find_spec(name) for name in ('render', 'datasets', 'pipelines', 'cv2', 'mitsuba'))\n"
        "camera = eposit.Camera(lens='equisolid', fx=500., fy=500., cx=400., cy=300., width=800, height=600)\n"
        "points = np.array([(0., 0, 0), (200, 0, 0), (0, 200, 0), (0, 0, -50)])\n"
        "pixels = camera.project(points + (100., 50., 1500.))\n"
        "assert eposit.solve(points, pixels, camera).status == 'ok'"
    )
    subprocess.run([python, "-c", code], check=True, cwd=tmp_path)
