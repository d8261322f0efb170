"""The reference pages of the documentation, written from the code when the pages are built."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Iterable
from typing import get_type_hints

import pyarrow as pa
import typer.core

import eposit
from datasets.recipe.model import describe, load_recipe, recipe_names
from datasets.schema import dictionary
from pipelines.cli import all_commands
from pipelines.nightly.accepted import Baseline, Waiver
from pipelines.nightly.history import FINDINGS, RUNS
from pipelines.nightly.measures import SCHEMA as MEASURES
from render.sensor.presets import regime_rows, regimes

LIBRARY = ("solve", "Camera", "Solution", "Status", "Pose", "Lens", "get_lens")

HISTORY = {"runs": RUNS, "findings": FINDINGS, "measures": MEASURES}
ACCEPTED = {"baseline": Baseline, "waiver": Waiver}


def table(titles: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A Markdown table; bars inside cells are escaped."""
    lines = [list(titles)]
    lines += [["---"] * len(lines[0])]
    lines += [[str(cell).replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def commands() -> str:
    """Every command with its arguments, options, defaults and an example."""
    return "\n".join(_command(name, command) for name, command in all_commands().items())


def _command(name: str, command: typer.core.TyperCommand) -> str:
    rows = []
    for parameter in command.params:  # pyright: ignore[reportAttributeAccessIssue]
        if parameter.param_type_name == "argument":
            names = f"`{parameter.metavar}`"
        else:
            names = ", ".join(f"`{option}`" for option in (*parameter.opts, *parameter.secondary_opts))
        rows.append((names, _default(parameter), _literal(parameter.help or "")))
    options = table(("argument or option", "default", "meaning"), rows) if rows else "It takes no options.\n"
    example = command.epilog.removeprefix("Example: ")  # pyright: ignore[reportAttributeAccessIssue]
    return f"## {name}\n\n{command.help}\n\n```\n{example}\n```\n\n{options}"  # pyright: ignore[reportAttributeAccessIssue]


def _default(parameter: object) -> str:
    if parameter.required:  # pyright: ignore[reportAttributeAccessIssue]
        return "required"
    value = parameter.default  # pyright: ignore[reportAttributeAccessIssue]
    return "" if value is None or value is False else f"`{value}`"


def _literal(text: str) -> str:
    """A text in which Markdown sees no markup but code between back quotes."""
    return text.replace("<", "&lt;").replace("[", "\\[").replace("*", "\\*")


def recipes() -> str:
    """The recipes that come with the checkout, with their descriptions."""
    return table(
        ("recipe", "what it is for"), ((f"`{name}`", load_recipe(name)[0].description) for name in recipe_names())
    )


def recipe_keys() -> str:
    """Every key of a recipe with its default and meaning."""
    return table(
        ("key", "default", "meaning"), ((f"`{key}`", f"`{value}`", _literal(text)) for key, value, text in describe())
    )


def sensor_regimes() -> str:
    """The sensor's values in each regime."""
    return table(("key", *regimes()), ((f"`sensor.{key}`", *row) for key, row in regime_rows()))


def tables() -> str:
    """Every table of a dataset with its columns."""
    return dictionary().replace("### ", "## ")


def history() -> str:
    """Every table of the history of the nights with its columns."""
    return "\n".join(f"### {name}\n\n{_columns(schema)}" for name, schema in HISTORY.items())


def _columns(schema: pa.Schema) -> str:
    rows = []
    for field in schema:
        known = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        unit = f", {known['unit']}" if known.get("unit", "1") != "1" else ""
        rows.append((f"`{field.name}`", f"`{field.type}`", known["meaning"] + unit))
    return table(("column", "type", "meaning"), rows)


def baselines() -> str:
    """Every key of the file of baselines, with its meaning."""
    return "\n".join(f"### `[[{name}]]`\n\n{_entry_keys(kind)}" for name, kind in ACCEPTED.items())


def _entry_keys(kind: type) -> str:
    hints = get_type_hints(kind, include_extras=True)
    rows = []
    for field in dataclasses.fields(kind):
        needed = "required" if field.default is dataclasses.MISSING else ""
        rows.append((f"`{field.name}`", needed, _literal(hints[field.name].__metadata__[0])))
    return table(("key", "", "meaning"), rows)


def library() -> str:
    """What `import eposit` offers: signatures and docstrings."""
    return "\n".join(_entry(name) for name in LIBRARY)


def _entry(name: str) -> str:
    thing = getattr(eposit, name)
    text = inspect.getdoc(thing) or ""
    head = f"## eposit.{name}\n\n"
    if name == "Status":
        rows = ((f"`{status}`", meaning) for status, meaning in _meanings(thing).items())
        return f"{head}{text}\n\n{table(('status', 'meaning'), rows)}"
    signature = f"{name}{inspect.signature(thing)}".replace("'", "").replace(", ", ",\n    ")
    methods = (
        [_method(name, member) for member in vars(thing) if _public(thing, member)] if inspect.isclass(thing) else []
    )
    return f"{head}```text\n{text}\n```\n\n```python\n{signature}\n```\n" + "".join(methods)


def _public(kind: type, member: str) -> bool:
    return not member.startswith("_") and (
        inspect.isfunction(vars(kind)[member]) or isinstance(vars(kind)[member], property)
    )


def _method(owner: str, member: str) -> str:
    function = inspect.getattr_static(getattr(eposit, owner), member)
    return f"\n- `{owner}.{member}`: {(inspect.getdoc(function) or '').splitlines()[0]}\n"


def _meanings(statuses: type) -> dict[str, str]:
    """Each status with the comment behind its line, which says when it is given."""
    lines = inspect.getsource(statuses).splitlines()
    return {line.split('"')[1]: line.partition("#")[2].strip() for line in lines if " = " in line}
