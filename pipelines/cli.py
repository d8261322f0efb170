"""The command line: which commands there are, and how an error of theirs reaches the terminal."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import typer
import typer.core
import typer.main

from datasets.errors import UserError
from datasets.url_path import UnreachableError
from pipelines.commands import compare, nightly, plan, stages, tools, transfer
from pipelines.endings import UNFINISHED, UNREAD, USER_ERROR, UnfinishedError, printable, say_unexpected

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)  # what a disk refuses
EXAMPLE = "Example: python -m pipelines {}"
ABOUT = "Rendered images of a chessboard through exact fish-eye cameras, detected, solved and scored against truth."

# Each command with its example, in the order of `--help`.
COMMANDS: tuple[tuple[Callable[..., None], str], ...] = (
    (stages.run, "run demo --out out/demo"),
    (stages.generate, "generate demo --out out/demo"),
    (stages.detect, "detect out/demo --detector opencv-subpix"),
    (stages.estimate, "estimate out/demo --solver opencv-sqpnp --points truth+noise --noise-px 0.4 --use four"),
    (stages.score, "score out/demo --poses poses.csv --name theirs"),
    (stages.bound, "bound out/demo"),
    (stages.report, "report out/demo"),
    (stages.frame, "frame out/demo 0 --out out/frame.png"),
    (stages.demo, "demo --out out/demo"),
    (compare.compare, "compare out/before out/after"),
    (tools.verify, "verify out/demo"),
    (stages.repair, "repair out/demo"),
    (transfer.upload, "upload out/demo s3://bucket/demo"),
    (transfer.download, "download s3://bucket/demo out/demo"),
    (tools.doctor, "doctor"),
    (tools.bench, "bench demo --only render --only solver --out bench.md"),
    (tools.paper, "paper --points-only --out out/paper"),
    (tools.target, "target charuco --out board.pdf"),
    (plan.plan, "plan demo --frames 1e6 --workers 64"),
    (tools.recipes, "recipes"),
    (tools.describe, "describe demo"),
)

# `nightly` is a command with commands of its own.
NIGHTLY_COMMANDS: tuple[tuple[Callable[..., None], str], ...] = (
    (nightly.run, "nightly run nightly --history out/nights"),
    (nightly.accept, "nightly accept RUN --history out/nights --reason 'the new detector'"),
    (nightly.explain, "nightly explain typical/equisolid/edge-fit --history out/nights"),
    (nightly.frame, "nightly frame pinned-typical 0 --history out/nights --out out/frame.png"),
    (nightly.report, "nightly report --history out/nights"),
)
NIGHTLY_HELP = "Accuracy every night: compared with a frozen baseline, kept, shown, and judged by the exit code."


def command_line() -> typer.core.TyperGroup:
    """The commands as one application, built once."""
    app = typer.Typer(
        name="pipelines",
        help=ABOUT,
        epilog="Start with: python -m pipelines demo",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    _add(app, COMMANDS)
    nights = typer.Typer(help=NIGHTLY_HELP, no_args_is_help=True, rich_markup_mode=None)
    _add(nights, NIGHTLY_COMMANDS)
    app.add_typer(nights, name="nightly", epilog=EXAMPLE.format(NIGHTLY_COMMANDS[0][1]))
    return typer.main.get_group(app)


def _add(app: typer.Typer, commands: tuple[tuple[Callable[..., None], str], ...]) -> None:
    for command, example in commands:
        app.command(epilog=EXAMPLE.format(example))(command)


def all_commands() -> dict[str, typer.core.TyperCommand]:
    """Every command by its name; those of a group by both names."""
    found: dict[str, typer.core.TyperCommand] = {}
    for name, command in app.commands.items():
        own = getattr(command, "commands", {})
        found |= {f"{name} {inner}": item for inner, item in own.items()} or {name: command}  # pyright: ignore[reportAssignmentType]
    return found


app = command_line()


def guarded(command: Callable[[], Any]) -> int:
    """Run a command; an error becomes one sentence on stderr and an exit code: 2 for what the user can mend."""
    try:
        command()
    except SystemExit as stop:
        if isinstance(stop.__context__, BrokenPipeError):  # which Typer makes exit code 1: that of what is worse
            return _unread()
        return stop.code if isinstance(stop.code, int) else 1
    except BrokenPipeError:
        return _unread()
    except UnfinishedError as error:
        print(f"error: {printable(str(error))}", file=sys.stderr)
        return UNFINISHED
    except Exception as error:
        told = _told(error)
        if told is None:
            return say_unexpected(error)
        print(f"error: {printable(told)}", file=sys.stderr)
        return USER_ERROR
    return 0


def _unread() -> int:
    """Whoever read the output has gone, as `head` does: the exit code that a shell shows of any program then."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return UNREAD


def _told(error: Exception) -> str | None:
    """What a user can mend, as one sentence; None of anything else."""
    from datasets.store.refusals import refused
    from render.backend import BackendError

    if isinstance(error, UserError | UnreachableError | BackendError):
        return str(error)
    if isinstance(error, PermissionError):
        return f"cannot use {error.filename}: this user has no permission; ask its owner"
    if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
        return f"cannot use {error.filename}: its name is longer than this file system has names; give a shorter one"
    if isinstance(error, OSError) and error.errno in FULL:
        return str(refused(Path(error.filename or "a file"), error))
    if isinstance(error, MemoryError):
        return f"the memory is not enough ({error}); run again with fewer --workers, or with smaller pictures"
    return None


def main() -> int:
    """The command line in a process that listens to signals, or in that of a test."""
    return guarded(app)
