"""The memory of the nights: a folder of Parquet files, each written once and never changed.

`runs/ID.parquet` has one row, `findings/ID.parquet` one for each metric in each slice, `measures/DIGEST.parquet` a
table of measures under the hash of its content, so that a night without a change adds none. A run counts once its file
in `runs` is there, which is written last: a process that is killed before leaves the history as it was. Two nights at
once have different names.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from datasets.errors import UserError
from datasets.store.atomic import replace_atomically, sweep
from datasets.store.digest import table_digest
from datasets.store.refusals import refused
from pipelines.nightly.judgement import Finding
from pipelines.nightly.record import Night

SCHEMA_VERSION = "1"
LATEST = "latest"
ADVICE = "move it away, or restore it from a backup"
_TEXT = pa.string()
_TIMES = ("ratio", "low", "high", "old_ms", "new_ms")
_PAIRS = pa.list_(pa.struct([("name", _TEXT), ("value", _TEXT)]))


def _field(name: str, kind: pa.DataType, meaning: str) -> pa.Field:
    return pa.field(name, kind, metadata={b"meaning": meaning.encode()})


RUNS = pa.schema(
    [
        _field("run_id", _TEXT, "name of the run; sorts by time"),
        _field("started", pa.timestamp("us", tz="UTC"), "when it began"),
        _field("recipe", _TEXT, "recipe of the suites"),
        _field("baseline", _TEXT, "baseline that the run was compared with"),
        _field("exit", pa.int32(), "exit code: 0 fine, 1 worse, 3 no verdict, 4 could not run"),
        _field("sentence", _TEXT, "the run in one sentence"),
        _field("facts", _PAIRS, "commit, versions, processor, BLAS kernel; waivers that have ended"),
        _field(
            "data",
            _PAIRS,
            "what was read, with its hash: `pinned` and each suite with its regime, the pictures; `replay` with "
            "a suite and a setting, poses of unchanged points; `code`, its files; `code of` a user's "
            "function, its files; `fresh seed`, that seed itself",
        ),
        _field(
            "gates",
            pa.list_(pa.struct([("gate", _TEXT), ("state", _TEXT), ("sentence", _TEXT)])),
            "how each gate ended, in their order",
        ),
        _field(
            "speed",
            pa.list_(pa.struct([("stage", _TEXT), *((name, pa.float64()) for name in _TIMES)])),
            "processor time of each stage, candidate over baseline: ratio, smallest, largest; ms a frame, old and new",
        ),
        _field("measures", _PAIRS, "suite and side (old or new), and the digest of their table in `measures`"),
    ],
    metadata={b"schema_version": SCHEMA_VERSION.encode()},
)

FINDINGS = pa.schema(
    [
        _field("run_id", _TEXT, "run"),
        _field("suite", _TEXT, "pinned, fresh, or confirming: the second look at what changed in fresh"),
        _field("slice", _TEXT, "sensor regime / camera / system"),
        _field("metric", _TEXT, "what is compared"),
        _field("unit", _TEXT, "unit of the numbers; `1` and `log` are pure numbers"),
        _field("poses", pa.int32(), "poses that both sides have"),
        _field("old", pa.float64(), "the baseline's mean; a calibration's is the log of the mean"),
        _field("new", pa.float64(), "the candidate's"),
        _field("effect", pa.float64(), "new minus old"),
        _field("low", pa.float64(), "lower end of the effect's 95 % interval"),
        _field("high", pa.float64(), "upper end"),
        _field("p", pa.float64(), "chance of such an effect without a change, for this comparison alone"),
        _field("margin", pa.float64(), "a smaller effect does not matter"),
        _field("smallest_visible", pa.float64(), "effect that would have been seen in 95 of 100 such nights"),
        _field("verdict", _TEXT, "worse, better, equal or unproved"),
    ],
    metadata={b"schema_version": SCHEMA_VERSION.encode()},
)


def new_run_id(started: datetime) -> str:
    """A name that sorts by time and that no other run has."""
    return f"{started:%Y%m%dT%H%M%SZ}-{secrets.token_hex(4)}"


class History:
    """The folder of a history. Nothing is read before it is asked for."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def append(
        self, night: Night, findings: Mapping[str, Sequence[Finding]], alpha: float, measures: Mapping[str, pa.Table]
    ) -> None:
        """Add a run. findings: suite to what was compared. alpha: level of their family. measures: by suite and side.

        Raises:
            UserError: the disk or its permissions refuse.
        """
        sweep(self.root)  # what killed processes left half written
        digests = [(name, self.keep(table)) for name, table in measures.items()]
        _write(self.root / "findings" / f"{night.run_id}.parquet", finding_rows(night.run_id, findings, alpha))
        _write(self.root / "runs" / f"{night.run_id}.parquet", _run_row(night, digests))

    def keep(self, measures: pa.Table) -> str:
        """Store a table of measures under its digest, which is returned; one that is there stays."""
        digest = table_digest(measures)
        path = self.root / "measures" / f"{digest}.parquet"
        if not path.is_file():
            _write(path, measures)
        return digest

    def check(self) -> None:
        """Whether the files of all runs can be opened, which costs less than a night that cannot be shown.

        Raises:
            UserError: one is damaged.
        """
        for run_id in self.run_ids():
            for kind in ("runs", "findings"):
                _open(self.root / kind / f"{run_id}.parquet")

    def runs(self) -> pa.Table:
        """All runs, the oldest first: columns of `RUNS`."""
        return self._read("runs", self.run_ids(), RUNS)

    def name_of(self, run: str) -> str:
        """A run's name; `latest` is the newest.

        Raises:
            UserError: there is no run, or none of that name.
        """
        ids = self.run_ids()
        if not ids:
            raise UserError(f"{self.root} holds no nights; run `nightly run` with this --history first")
        if run == LATEST:
            return ids[-1]
        if run not in ids:
            raise UserError(f"{self.root} has no run {run!r}; give `latest`, or a name from its folder `runs`")
        return run

    def run(self, run_id: str) -> dict[str, Any]:
        """One run: columns of `RUNS`.

        Raises:
            UserError: there is none of that name, or its file is damaged.
        """
        return self._read("runs", [self.name_of(run_id)], RUNS).to_pylist()[0]

    def run_ids(self) -> list[str]:
        """Names of the runs, the oldest first."""
        return sorted(path.stem for path in (self.root / "runs").glob("[!.]*.parquet"))

    def findings(self, run_ids: Sequence[str]) -> pa.Table:
        """Findings of some runs: columns of `FINDINGS`."""
        return self._read("findings", run_ids, FINDINGS)

    def measures(self, digest: str) -> pa.Table:
        """A table of measures by its digest.

        Raises:
            UserError: it is missing, damaged, or not what its name says.
        """
        path = self.root / "measures" / f"{digest}.parquet"
        table = _read(path)
        if table_digest(table) != digest:
            raise UserError(f"{path} does not hold what its name says; restore it or accept a new baseline")
        return table

    def pinned(self, run: dict[str, Any]) -> pa.Table:
        """What a run, a row of `RUNS`, measured on the pinned pictures.

        Raises:
            UserError: it did not get through them, or the table is missing or damaged.
        """
        digests = {item["name"]: item["value"] for item in run["measures"]}
        if "pinned new" not in digests:
            raise UserError(f"run {run['run_id']} did not get through the pinned pictures; choose another run")
        return self.measures(digests["pinned new"])

    def _read(self, kind: str, run_ids: Sequence[str], schema: pa.Schema) -> pa.Table:
        tables = [_read(self.root / kind / f"{run_id}.parquet", schema) for run_id in run_ids]
        return pa.concat_tables(tables) if tables else schema.empty_table()


def _open(path: Path) -> pq.ParquetFile:
    try:
        return pq.ParquetFile(path)
    except FileNotFoundError:
        raise UserError(f"{path} is missing; {ADVICE}") from None
    except (OSError, pa.ArrowException) as error:
        raise _damaged(path, error) from None


def _read(path: Path, schema: pa.Schema | None = None) -> pa.Table:
    try:
        table = _open(path).read()
    except (OSError, pa.ArrowException) as error:
        raise _damaged(path, error) from None
    if schema is not None and not table.schema.equals(schema):
        raise UserError(f"{path} has other columns than this version writes; {ADVICE}")
    return table


def _damaged(path: Path, error: Exception) -> UserError:
    return UserError(f"{path} is not a readable Parquet file ({error}); {ADVICE}")


def _write(path: Path, table: pa.Table) -> None:
    try:
        with replace_atomically(path) as temporary:
            pq.write_table(table, temporary, compression="zstd")
    except OSError as error:
        raise refused(path, error) from error


def _run_row(night: Night, digests: list[tuple[str, str]]) -> pa.Table:
    row = {
        "run_id": night.run_id,
        "started": night.started,
        "recipe": night.recipe,
        "baseline": night.baseline,
        "exit": int(night.exit),
        "sentence": night.sentence,
        "facts": _pairs(night.facts),
        "data": _pairs(night.data),
        "gates": [{"gate": o.gate, "state": o.state, "sentence": o.sentence} for o in night.outcomes],
        "speed": [asdict(item) for item in night.timings],
        "measures": _pairs(digests),
    }
    return pa.Table.from_pylist([row], schema=RUNS)


def _pairs(items: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    return [{"name": name, "value": value} for name, value in items]


def finding_rows(run_id: str, findings: Mapping[str, Sequence[Finding]], alpha: float) -> pa.Table:
    """What was compared, by suite, as rows of `FINDINGS`. alpha: level of their family."""
    columns: dict[str, Callable[[Finding, int], object]] = {
        "slice": lambda item, _: item.slice,
        "metric": lambda item, _: item.change.metric.name,
        "unit": lambda item, _: item.change.metric.unit,
        "poses": lambda item, _: item.change.poses,
        "old": lambda item, _: item.change.old,
        "new": lambda item, _: item.change.new,
        "effect": lambda item, _: item.change.effect,
        "low": lambda item, _: item.change.interval[0],
        "high": lambda item, _: item.change.interval[1],
        "p": lambda item, _: item.change.p,
        "margin": lambda item, _: item.change.metric.margin,
        "smallest_visible": lambda item, tests: item.change.smallest_visible(alpha, tests),
        "verdict": lambda item, _: item.verdict,
    }
    rows = [
        {"run_id": run_id, "suite": suite} | {name: of(item, len(items)) for name, of in columns.items()}
        for suite, items in findings.items()
        for item in items
    ]
    return pa.Table.from_pylist(rows, schema=FINDINGS)
