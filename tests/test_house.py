"""The house: which packages are ours, what an import costs, what the documents say."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from pipelines.cli import app

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = get_command(app).commands  # pyright: ignore


def test_datasets_and_render_are_ours():
    """Both names belong to other packages on PyPI; in this environment they must be this checkout's."""
    import datasets
    import render

    assert Path(datasets.__file__).is_relative_to(ROOT)
    assert Path(render.__file__).is_relative_to(ROOT)


def test_help_loads_nothing_heavy():
    code = (
        "import sys, pipelines.cli, eposit\n"
        "heavy = {'mitsuba', 'drjit', 'cv2', 'pyarrow', 'matplotlib', 'OpenEXR'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_eposit_needs_numpy_and_scipy_only():
    code = (
        "import sys, eposit\n"
        "ours = {'datasets', 'render', 'pipelines'}\n"
        "other = (ours | {'mitsuba', 'cv2', 'pyarrow', 'pydantic', 'typer'}) & set(sys.modules)\n"
        "assert not other, other"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_an_example_and_a_line_in_the_readme(name):
    command = COMMANDS[name]
    assert command.help
    assert command.epilog.startswith("Example: python -m pipelines ")
    assert f"`{name}`" in (ROOT / "README.md").read_text()


def test_readme_commands_are_real():
    """Every `python -m pipelines` line in the README names a command and options that exist."""
    text = (ROOT / "README.md").read_text()
    lines = re.findall(r"^python -m pipelines (.+)$", text, flags=re.M)
    assert len(lines) >= 5
    for line in lines:
        words = shlex.split(line, comments=True)
        command = COMMANDS[words[0]]
        known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
        assert {word for word in words if word.startswith("--")} <= known, line


def test_readme_solver_example_runs():
    text = (ROOT / "README.md").read_text()
    example = re.search(r"```python\n(.*?)```", text, flags=re.S)
    assert example
    done = subprocess.run([sys.executable, "-c", example[1]], capture_output=True, text=True, check=True)
    assert "ok" in done.stdout


def test_source_files_are_small():
    for package in ("eposit", "render", "datasets", "pipelines"):
        for path in (ROOT / package).rglob("*.py"):
            assert len(path.read_text().splitlines()) <= 300, path


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
