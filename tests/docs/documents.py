"""The documents, and the commands and Python programs in them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

from pipelines.cli import all_commands

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = sorted(
    [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + list((ROOT / "docs").rglob("*.md"))
)
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
RUN = "python -m pipelines "
PLACEHOLDER = "COMMAND"  # stands for any command
COMMANDS = all_commands()


def name(path):
    """A document's path inside the checkout."""
    return str(path.relative_to(ROOT))


def commands():
    """(document, line) of every `python -m pipelines` line and every such command between back quotes."""
    for path in DOCUMENTS:
        text = path.read_text()
        found = re.findall(rf"^{RUN}(.+)$", text, flags=re.M) + re.findall(rf"`{RUN}([^`\n]+)`", text)
        for line in found:
            if line != PLACEHOLDER:
                yield name(path), line


def named(words):
    """Name of the command that words behind `python -m pipelines` run: the first word, or two if it is of a group."""
    return next(name for name in (words[0], " ".join(words[:2])) if name in COMMANDS)


def wrong_options(line):
    """Options of a line behind `python -m pipelines` that its command does not have."""
    words = shlex.split(line, comments=True)
    command = COMMANDS[named(words)]
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    return {word for word in words if word.startswith("-")} - known


def programs():
    """(document, text) of every Python program in the documents."""
    for path in DOCUMENTS:
        for text in re.findall(r"^```python\n(.*?)^```", path.read_text(), flags=re.S | re.M):
            yield name(path), text
