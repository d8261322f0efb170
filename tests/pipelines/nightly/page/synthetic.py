"""Histories of many nights, written as tables without pictures, and frames to look at."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from pipelines.nightly.gates import regenerate
from pipelines.nightly.history import FINDINGS, RUNS, History
from pipelines.nightly.metrics import CORNERS, POSES
from pipelines.nightly.page.frames import rendered_otherwise
from pipelines.nightly.page.write import Shown
from pipelines.pages.pictures import Marks, Picture, Side
from render.targets.image_region import Region
from tests.pipelines.nightly.simulated import CAMERAS

START = datetime.datetime(2025, 5, 4, 3, 2, tzinfo=datetime.UTC)
SYSTEMS = (("edge-fit", CORNERS), ("best detected exact all", POSES))
GATES = ("ran", "data", "regenerate", "replay", "accuracy", "fresh", "failures", "tail", "speed")
FACTS = {"commit": "8c2f1e0d", "eposit": "0.1.0", "numpy": "2.4.0", "opencv": "5.0.0", "processor": "x86 family 6"}


def history(root, nights, slices, suites=("pinned", "fresh"), faulty=True, names=str):
    """A history of so many nights and slices; the last has a bias in one slice if it is faulty."""
    rng = np.random.default_rng(1)
    regimes = [f"regime-{i}" for i in range(1 + (slices - 1) // (len(CAMERAS) * len(SYSTEMS)))]
    every = [(f"{regime}/{camera}/{name}", held) for regime in regimes for camera in CAMERAS for name, held in SYSTEMS]
    series = [(suite, names(name), metric) for suite in suites for name, held in every[:slices] for metric in held]
    static = _static(series)
    for kind in ("runs", "findings"):
        (root / kind).mkdir(parents=True)
    ids = [f"{START + datetime.timedelta(days=i):%Y%m%dT%H%M%SZ}-{i:08x}" for i in range(nights)]
    for i, run_id in enumerate(ids):
        fault = faulty and i == nights - 1
        exit_code = 1 if fault or i % 90 == 40 else 3 if i % 120 == 70 else 0
        if exit_code != 3:
            pq.write_table(_findings(run_id, static, series, rng, fault), root / "findings" / f"{run_id}.parquet")
        else:
            pq.write_table(FINDINGS.empty_table(), root / "findings" / f"{run_id}.parquet")
        run = _run(run_id, i, exit_code, "first" if i < nights // 2 else "second")
        pq.write_table(pa.Table.from_pylist([run], schema=RUNS), root / "runs" / f"{run_id}.parquet")
    return History(root)


def pictures(count, names=str):
    """Frames of a board with noise, whose candidate has a bias; the last one's candidate found nothing."""
    return [_picture(i, names, lost=i == count - 1) for i in range(count)]


def shown(count, names=str):
    """`pictures`, and a frame that comes out otherwise."""
    return Shown(pictures(count, names), _otherwise(names))


def _static(series):
    columns = {"suite": [item[0] for item in series], "slice": [item[1] for item in series]}
    columns |= {"metric": [item[2].name for item in series], "unit": [item[2].unit for item in series]}
    encoded = {name: pa.array(values).dictionary_encode().cast(pa.string()) for name, values in columns.items()}
    margin = np.array([item[2].margin for item in series])
    usual = {"corner_log_ms": -10.67, "pose_log_t": -2.0, "pose_log_R": -2.0}
    middle = np.array([usual.get(metric.name, 0.0) for *_, metric in series])
    return encoded, margin, middle


def _findings(run_id, static, series, rng, fault):
    columns, margin, middle = static
    n = len(margin)
    effect = 0.12 * margin * rng.normal(size=n)
    spread = 0.35 * margin * (1.0 + 0.2 * rng.random(n))
    verdict = np.where(rng.random(n) < 0.01, "unproved", "equal").astype(object)
    if fault:
        of_one = np.array([suite == "pinned" and name == series[0][1] for suite, name, _ in series])
        biased = of_one & np.array([metric.name in ("corner_x", "corner_log_ms") for *_, metric in series])
        effect[biased] += 4.0 * margin[biased]
        verdict[biased] = "worse"
        verdict[-1], effect[-1] = "better", -2.5 * margin[-1]
        verdict[-2], effect[-2] = "worse", 1.8 * margin[-2]
    old = middle + 0.2 * margin
    numbers = {"old": old, "new": old + effect, "effect": effect, "low": effect - spread, "high": effect + spread}
    numbers |= {"p": np.full(n, 0.5), "margin": margin, "smallest_visible": 1.1 * margin}
    values = columns | numbers | {"run_id": [run_id] * n, "poses": np.full(n, 20, np.int32), "verdict": verdict}
    return pa.table([pa.array(values[field.name], field.type) for field in FINDINGS], schema=FINDINGS)


def _run(run_id, i, exit_code, baseline):
    states = dict.fromkeys(GATES, "passed") | {"replay": "changed", "speed": "warned", "tail": "not run"}
    told = {
        "ran": "all stages ran on 2 suites",
        "replay": "312 of 400 frames differ, at most by 6e-5 sigma",
        "tail": "no system has 400 frames, fewer than tails need",
        "speed": "detection takes 1.06 [1.03, 1.12] times the baseline's processor time, margin 1.10",
        "accuracy": "all 800 metrics are equal within their margins",
    }
    sentence = f"fine: nothing is shown to be worse than {baseline}; 1 gate with a warning"
    if exit_code == 1:
        states["accuracy"] = "failed"
        told["accuracy"] = (
            "corner_x in regime-0/perspective/edge-fit is worse by +0.0020 [+0.0018, +0.0022] px, margin 0.0005; 1 more"
        )
        sentence = f"accuracy: {told['accuracy']}"
    if exit_code == 3:
        states = dict.fromkeys(GATES, "not run") | {"ran": "passed", "data": "failed"}
        told["data"] = "the pinned suite holds 3f09, and the baseline was measured on 77ae"
        sentence = f"data: {told['data']}"
    facts = FACTS | {"numpy": "2.4.0" if i % 100 else "2.4.1", "commit": f"{(i * 2654435761) % 2**32:08x}"}
    return {
        "run_id": run_id,
        "started": START + datetime.timedelta(days=i),
        "recipe": "nightly",
        "baseline": baseline,
        "exit": exit_code,
        "sentence": sentence,
        "speed": [],
        "facts": [{"name": name, "value": value} for name, value in facts.items()],
        "data": [{"name": "pinned", "value": "77ae" * 16}, {"name": "fresh", "value": f"{i:064x}"}],
        "gates": [
            {"gate": gate, "state": states[gate], "sentence": told.get(gate, "nothing to tell")} for gate in GATES
        ],
        "measures": [],
    }


def _picture(i, names, lost):
    rng = np.random.default_rng(i)
    y, x = np.mgrid[0:300, 0:360]
    board = np.where(((x - 30) // 30 + (y - 30) // 30) % 2, 200.0, 40.0)
    inside = (x > 30) & (x < 330) & (y > 30) & (y < 270)
    crop = np.clip(np.where(inside, board, 90.0) + rng.normal(0.0, 4.0, x.shape), 0, 255).astype(np.uint8)
    points = np.stack(np.meshgrid(np.arange(60, 330, 30), np.arange(60, 270, 30)), axis=-1).reshape(-1, 2) + [700, 500]
    old = rng.normal(0.0, 0.005, points.shape)
    new = np.full(points.shape, np.nan) if lost else old + [0.01, 0.0]
    return Picture(
        17 * i + 3,
        "pinned, " + names(f"regime-0/{CAMERAS[i % 5]}/edge-fit"),
        names("no corner is found any more" if lost else f"corner_x is {0.01:g} px further off"),
        names(f"python -m pipelines nightly frame pinned-regime-0 {17 * i + 3}"),
        (700, 500),
        (Side("baseline", Marks(points + old - 0.5, old), crop), Side("candidate", Marks(points + new - 0.5, new))),
    )


def _otherwise(names):
    stored = np.full((300, 360), 90, np.uint8)
    rendered = stored.copy()
    rendered[100:110, 50] += 3
    again = regenerate.Again(names("pinned-regime-0"), 7, stored, rendered, Region(0, 0, 360, 300), 2e-10)
    return rendered_otherwise([again], "20260504T030000Z-00000000", Path("nights"))
