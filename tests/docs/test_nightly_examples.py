"""Starting a night from cron, systemd, GitHub and GitLab: sound files, and what they start is run with stand-ins."""

import configparser
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from pipelines.nightly.outputs import write_all
from tests.docs.documents import COMMANDS, ROOT, named
from tests.pipelines.nightly.whole_nights import results

EXAMPLES = ROOT / "examples" / "nightly"
SCRIPT = EXAMPLES / "nightly.sh"
NIGHTS = "out/nights"
CODES = (0, 1, 2, 3, 4)

# Tells how it was called, leaves a summary as a night does, and ends as told.
PYTHON = f"""\
#!/bin/sh
echo "python $*" >> "$CALLS"
mkdir -p {NIGHTS}
echo "# a summary" > {NIGHTS}/summary.md
echo "what a night prints"
exit "$CODE"
"""
MAKE = """\
#!/bin/sh
echo "make $*" >> "$CALLS"
"""


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """~/eposit with the examples and stand-ins for make and Python; CALLS names the file that tells of them."""
    root, bin = tmp_path / "eposit", tmp_path / "bin"
    shutil.copytree(EXAMPLES, root / "examples" / "nightly")
    for path, text in ((root / ".venv" / "bin" / "python", PYTHON), (bin / "make", MAKE)):
        path.parent.mkdir(parents=True)
        path.write_text(text)
        path.chmod(0o755)
    monkeypatch.setenv("PATH", f"{bin}:{os.environ['PATH']}")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("CALLS", str(tmp_path / "calls"))
    monkeypatch.setenv("CODE", "0")
    return root


def _shell(command, folder):
    return subprocess.run(["sh", "-c", command], cwd=folder, capture_output=True, text=True, timeout=60, check=False)


def _calls(checkout):
    return (checkout.parent / "calls").read_text().splitlines()


def _night():
    """Words of the command that the script starts, after `python -m pipelines`."""
    (line,) = re.findall(r"^exec \S+python -m pipelines (.+)$", SCRIPT.read_text(), flags=re.M)
    return shlex.split(line)


def _load(name):
    return yaml.safe_load((EXAMPLES / name).read_text())


def test_the_command_exists_with_its_options():
    words = _night()
    command = COMMANDS[named(words)]
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    assert {word for word in words if word.startswith("-")} <= known
    assert words[words.index("--history") + 1] == NIGHTS


def test_every_example_starts_the_one_script():
    others = [path for path in EXAMPLES.iterdir() if path != SCRIPT and path.suffix != ".timer"]
    assert len(others) == 4
    for path in others:
        assert "examples/nightly/nightly.sh" in path.read_text(), path
        assert "-m pipelines" not in path.read_text(), path


@pytest.mark.parametrize("code", CODES)
def test_the_script_sets_up_runs_and_ends_with_the_nights_code(checkout, monkeypatch, code):
    monkeypatch.setenv("CODE", str(code))
    done = _shell("eposit/examples/nightly/nightly.sh --quiet", checkout.parent)
    assert done.returncode == code, done.stderr
    assert _calls(checkout) == ["make setup", f"python -m pipelines {shlex.join(_night()[:-1])} --quiet"]


def test_a_machine_that_cannot_be_set_up_has_no_night(checkout):
    (checkout.parent / "bin" / "make").write_text("#!/bin/sh\nexit 7\n")
    assert _shell("examples/nightly/nightly.sh", checkout).returncode != 0
    assert not (checkout.parent / "calls").exists()


@pytest.mark.parametrize("code", CODES)
def test_cron_mails_a_night_that_is_not_fine(checkout, monkeypatch, code):
    monkeypatch.setenv("CODE", str(code))
    (line,) = [line for line in (EXAMPLES / "crontab").read_text().splitlines() if not line.startswith("#")]
    *times, command = line.split(maxsplit=5)
    assert times == ["0", "3", "*", "*", "*"]
    assert "%" not in command  # cron takes it for the end of the line
    done = _shell(command, checkout.parent)
    assert done.stderr == ""
    assert done.stdout == ("what a night prints\n" if code else "")
    assert _calls(checkout)[1].startswith("python -m pipelines nightly run")


def test_systemd_takes_the_units(checkout):
    units = [checkout / "examples" / "nightly" / f"eposit-nightly.{kind}" for kind in ("service", "timer")]
    if shutil.which("systemd-analyze"):
        command = ["systemd-analyze", "verify", "--user", "--man=no", *map(str, units)]
        environment = os.environ | {"XDG_RUNTIME_DIR": str(checkout.parent)}
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, env=environment)
        assert (done.returncode, done.stderr) == (0, "")
    service, timer = (configparser.ConfigParser(interpolation=None) for _ in units)
    service.read(units[0])
    timer.read(units[1])
    assert timer["Timer"]["OnCalendar"] == "*-*-* 03:00"
    started = Path(service["Service"]["ExecStart"].replace("%h", os.environ["HOME"]))
    assert os.access(started, os.X_OK)
    assert service["Service"]["WorkingDirectory"] == "%h/eposit"


def test_github_shows_the_summary_and_keeps_the_history_also_of_a_bad_night(checkout, monkeypatch):
    workflow = _load("github.yml")
    steps = workflow["jobs"]["nightly"]["steps"]
    assert workflow[True]["schedule"] == [{"cron": "0 3 * * *"}]  # YAML 1.1 reads the key `on` as true
    monkeypatch.setenv("CODE", "1")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(checkout.parent / "step"))
    night, summary = [step for step in steps if "run" in step]
    assert _shell(night["run"], checkout).returncode == 1
    assert summary["if"] == "always()"
    assert _shell(summary["run"], checkout).returncode == 0
    assert (checkout.parent / "step").read_text() == "# a summary\n"
    used = {step["uses"].partition("@")[0]: step for step in steps if "uses" in step}
    restore, save = used["actions/cache/restore"], used["actions/cache/save"]
    assert restore["with"]["path"] == save["with"]["path"] == NIGHTS
    assert save["with"]["key"].startswith(restore["with"]["restore-keys"])
    assert save["if"] == used["actions/upload-artifact"]["if"] == "always()"


def test_gitlab_keeps_the_history_also_of_a_bad_night(checkout, monkeypatch):
    job = _load("gitlab.yml")["nightly"]
    monkeypatch.setenv("CODE", "3")
    (line,) = job["script"]
    assert _shell(line, checkout).returncode == 3
    assert job["allow_failure"] == {"exit_codes": [3]}
    assert job["cache"] == {"key": "nights", "paths": [NIGHTS], "when": "always"}
    assert job["artifacts"]["when"] == "always"


def test_the_files_that_are_kept_are_those_of_a_night(tmp_path):
    written = {f"{NIGHTS}/{path.name}" for path in write_all(results(), tmp_path)} | {f"{NIGHTS}/report.html"}
    artifacts = _load("gitlab.yml")["nightly"]["artifacts"]
    (upload,) = [step for step in _load("github.yml")["jobs"]["nightly"]["steps"] if "upload" in step.get("uses", "")]
    for kept in ([*artifacts["paths"], *artifacts["reports"].values()], upload["with"]["path"].split()):
        assert set(kept) <= written
        assert f"{NIGHTS}/report.html" in kept
