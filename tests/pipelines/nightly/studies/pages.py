"""The pages of evidence, written from what the studies found as soon as every part is there."""

from __future__ import annotations

import numpy as np

from datasets.store.atomic import write_text
from pipelines.nightly.other_code import ROOT
from tests.pipelines.nightly.studies import faults, found, texts
from tests.pipelines.nightly.studies.reading import ALL, FOUR, NOISY
from tests.pipelines.nightly.studies.simulated_nights import OTHER, SAME

FOLDER = ROOT / "docs" / "evidence"
NONE = "not measured"
FAULTS = (
    faults.CORNER_BIAS, faults.MORE_NOISE, faults.CIRCLE, faults.FOCAL, faults.COVARIANCE, faults.SHIFT,
)  # fmt: skip
UNITS = {fault.name: fault.unit for fault in FAULTS}


def write_pages():
    """All pages, with what is there."""
    power_page()
    quiet_page()
    changes_page()


def power_page():
    """`nightly-power.md`."""
    simulated = found.parts("power-")
    real = found.parts("real-")
    text = [
        texts.POWER,
        made_with(simulated + real, "tests/pipelines/nightly/studies"),
        "## Simulated nights",
        texts.SIMULATED,
    ]
    text += [_share_table(simulated), "## The smallest size that is caught", texts.SMALLEST, _smallest_table(simulated)]
    text += ["## A bias that grows", texts.DRIFT, _drift_table(simulated), "## A solver that ends early", texts.EARLY]
    text += [_early_table(simulated), "## Real nights", texts.REAL, _real_table(real)]
    _write("nightly-power", text)


def quiet_page():
    """`nightly-quiet.md`."""
    parts, real = found.parts("quiet-"), found.parts("real-")
    text = [
        texts.QUIET,
        made_with(parts + real, "tests/pipelines/nightly/studies"),
        "## Simulated nights",
        texts.QUIET_SIMULATED,
    ]
    rows = [
        [part["name"].removeprefix("quiet-"), part["nights"], part["alarms"], _counts(part["by_gate"]),
         part["states"].get("accuracy warned", 0)]
        for part in parts
    ]  # fmt: skip
    text += [table(["poses", "nights", "with an alarm", "alarms by gate", "warned, gate `accuracy`"], rows)]
    text += [
        "## Real nights",
        texts.QUIET_REAL,
        _quiet_real_table(real),
        "## The scatter",
        texts.SCATTER,
        _scatter_table(),
    ]
    _write("nightly-quiet", text)


def changes_page():
    """`nightly-changes.md`."""
    parts = found.parts("changes-")
    rows = [
        [part["change"], part["exit"], *("{}: {}".format(*part["gates"][gate]) for gate in ("regenerate", "replay")),
         *(part["gates"][gate][0] for gate in ("accuracy", "fresh"))]
        for part in parts
    ]  # fmt: skip
    columns = ["change", "exit code", "`regenerate`", "`replay`", "`accuracy`", "`fresh`"]
    made = made_with(parts, "tests/pipelines/nightly/studies/test_changes.py")
    _write("nightly-changes", [texts.CHANGES, made, table(columns, rows)])


def _share_table(parts):
    keys = [f"{noise} {poses}" for poses in (20, 80) for noise in (SAME, OTHER)]
    shares = {part["name"].removeprefix("power-"): part["shares"] for part in parts if "shares" in part}
    names = dict.fromkeys(name for own in shares.values() for name in own)
    rows = []
    for name in names:
        cells = [shares[key][name] if key in shares else None for key in keys]
        rows.append([name, SIZES[name], *(NONE if cell is None else "{:.3f}, {:.3f}".format(*cell) for cell in cells)])
    return table(["fault", "size", *(f"{key} poses" for key in keys)], rows)


def _smallest_table(parts):
    keys = (f"{SAME} 20", f"{OTHER} 20", f"{OTHER} 80")
    held = {part["name"].removeprefix("power-smallest-"): part["smallest"] for part in parts if "smallest" in part}
    names = dict.fromkeys(name for own in held.values() for name in own)
    rows = [[name, *(_size(held[key][name], UNITS[name]) if key in held else NONE for key in keys)] for name in names]
    return table(["fault", *(f"{key} poses" for key in keys)], rows)


def _size(value, unit):
    if value is None:
        return "above four times"
    return f"{100.0 * value:.2g} %" if unit == "share" else f"{value:.2g} {unit}"


def _drift_table(parts):
    rows = []
    for part in parts:
        for noise, nights in part.get("nights", {}).items():
            caught = [night for night in nights if night]
            late = f"{np.median(caught):g}, {np.percentile(caught, 95):g}, {max(caught)}" if caught else "never"
            rows.append([part["name"].rpartition("-")[2], noise, len(nights), len(caught) / len(nights), late])
    return table(["poses", "pictures", "runs", "caught by night 30", "median, 95th percentile, last night"], rows)


def _early_table(parts):
    rows = [
        [row["steps"], *("{:.1g}, {:.1g}".format(*row["off"][name]) for name in (ALL, FOUR, NOISY)), row["caught"]]
        for part in parts
        for row in part.get("rows", [])
    ]
    return table(["steps too few", *(f"`{name}`" for name in (ALL, FOUR, NOISY)), "share with exit code 1"], rows)


def _real_table(parts):
    of = {}
    for part in parts:
        for row in part["rows"]:
            if row["fault"] != "none":
                of.setdefault((row["fault"], row["size"] if row["fault"] != "drift" else ""), []).append(row)
    rows = []
    for (fault, size), nights in of.items():
        right = sum(row["right"] and not row["other_lens"] for row in nights) if "right" in nights[0] else "-"
        shown = f"night {', '.join(str(row['size']) for row in nights)}" if fault == "drift" else SIZES.get(fault, size)
        rows.append([fault, shown, len(nights), sum(row["exit"] == 1 for row in nights), right, nights[0]["sentence"]])
    return table(["fault", "size", "nights", "exit code 1", "right slice", "what the first of them says"], rows)


def _quiet_real_table(parts):
    rows = [row for part in parts for row in part["rows"] if row["fault"] == "none"]
    if not rows:
        return NONE
    ratios = {stage: [row["speed"][stage] for row in rows] for stage in rows[0]["speed"]}
    shown = [f"{stage} {np.mean(own):.3f}, {np.std(own):.3f}, {max(own):.3f}" for stage, own in ratios.items()]
    return table(
        ["nights", "with exit code 0", "every number the same", "processor time: mean ratio, scatter, largest"],
        [[len(rows), sum(row["exit"] == 0 for row in rows), sum(row["identical"] for row in rows), "; ".join(shown)]],
    )


def _scatter_table():
    rows = [row for part in found.parts("scatter") for row in part["rows"]]
    shown = [[*row[:3], *(f"{value:.3g}" for value in row[3:])] for row in rows]
    return table(["regime", "system", "metric", "mean", "over poses", "over draws"], shown)


def _counts(counts):
    return ", ".join(f"{name} {count}" for name, count in counts.items()) or "none"


def made_with(parts, tests):
    """How to make the page again, and where it was made."""
    if not parts:
        return NONE
    machine = parts[0]["machine"]
    seconds = sum(part.get("processor_s", 0.0) for part in parts)
    versions = ", ".join(f"{name} {value}" for name, value in machine.items() if name not in ("processor", "date"))
    days = " and ".join(dict.fromkeys(part["date"] for part in parts))
    commits = ", ".join(dict.fromkeys(part["commit"][:7] for part in parts))
    return (
        f"Made by `python -m pytest -m slow {tests}` on {days} (commit {commits}), in {seconds / 60:.0f} minutes of "
        f"processor time on a machine that other work shared: {machine['processor']}; {versions}."
    )


SIZES = {fault.name: _size(fault.size, fault.unit) for fault in FAULTS}
SIZES |= {"slower detection": "15 %", "new failure": "1 frame"}


def table(columns, rows):
    """A table in Markdown."""
    if not rows:
        return NONE
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in line) + " |"
                     for line in lines)  # fmt: skip


def _write(name, text):
    FOLDER.mkdir(parents=True, exist_ok=True)
    write_text(FOLDER / f"{name}.md", "\n\n".join(part.strip() for part in text) + "\n")
