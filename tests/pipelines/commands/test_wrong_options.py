"""Wrong words on the command line: one sentence that says what is allowed, or the usage; exit code 2."""

from __future__ import annotations

import pytest

from tests.wrong_input import assert_refused, estimate, on_dataset

CASES = {
    "too little memory": (
        estimate("--solver", "mine:solve", "--memory-mb", 5),
        "--memory-mb 5: give MB from 100 to 10000000, as 1500",
    ),
    "missing recipe": (lambda place: ("run", place.folder / "no.toml", "--out", place.new()), "cannot read recipe"),
    "recipe is a folder": (lambda place: ("run", f"{place.folder}/", "--out", place.new()), "Is a directory"),
    "dataset with a long name": (lambda place: ("frame", "x" * 300, 0), "its name is longer than"),
    "unknown recipe": (lambda place: ("run", "dmo", "--out", place.new()), "(did you mean 'demo'?)"),
    "describe an unknown recipe": (lambda place: ("describe", "smokey"), "(did you mean 'smoke'?)"),
    "unknown solver": (estimate("--solver", "upnp"), "unknown solver 'upnp'; choose one of best"),
    "four points for all": (estimate("--solver", "poselib-p3p"), "solver poselib-p3p takes exactly four points; add"),
    "unknown camera": (estimate("--camera", "wide"), "unknown camera 'wide'; choose one of exact"),
    "unknown use": (estimate("--use", "five"), "unknown use 'five'; choose one of four"),
    "unknown points": (estimate("--points", "seen"), "unknown points 'seen'; choose one of detected"),
    "unknown detector": (
        on_dataset("detect", "--detector", "edge-fitt"),
        "unknown detector 'edge-fitt'; choose one of edge-fit, board-fit, opencv-subpix, opencv-sb",
    ),
    "empty detector": (on_dataset("detect", "--detector", ""), "unknown detector ''; choose one of edge-fit"),
    "detector in capitals": (on_dataset("detect", "--detector", "OPENCV-SB"), "unknown detector 'OPENCV-SB'"),
    "unknown detector, estimate": (estimate("--detector", "opencv"), "unknown detector 'opencv'; choose one of edge"),
    "unknown detector for true points": (
        estimate("--points", "truth", "--detector", "opencv"),
        "unknown detector 'opencv'; choose one of edge",
    ),
    "detector without detections": (
        estimate("--detector", "opencv-subpix"),
        "opencv-subpix-00000-of-00002.parquet is missing; run the detect --detector opencv-subpix stage",
    ),
    "negative noise": (estimate("--points", "truth+noise", "--noise-px", "-0.4"), "noise of -0.4 px is not usable"),
    "noise not a number": (estimate("--points", "truth+noise", "--noise-px", "nan"), "noise of nan px is not usable"),
    "zero draws": (estimate("--points", "truth+noise", "--draws", "0"), "0 draws are not usable"),
    "zero workers": (estimate("--solver", "posit", "--workers", "0"), "0 workers are not usable; give --workers from"),
    "unknown engine": (estimate("--engine", "spark"), "unknown engine 'spark'; choose one of local, ray"),
    "address of no engine": (estimate("--ray-address", "head:6379"), "--ray-address goes with --engine ray"),
    "part zero": (estimate("--shard", "0/4"), "shard '0/4' is not usable; give --shard I/N with I from 1 to N"),
    "part of a new dataset": (
        lambda place: ("run", place.recipe(), "--out", place.new(), "--shard", "5/4"),
        "shard '5/4' is not usable",
    ),
    "too many workers": (estimate("--solver", "posit", "--workers", "999"), "999 workers are not usable"),
}


USAGE = {
    "unknown option": (lambda place: ("run", "smoke", "--fast", "--out", place.new()), "No such option: --fast"),
    "unknown command": (lambda place: ("rnu", "smoke"), "No such command 'rnu'"),
    "no folder": (lambda place: ("generate", "smoke"), "Missing option '--out'"),
    "detector of a stage without one": (lambda place: ("score", place.new(), "--detector", "opencv-sb"), "--detector"),
    "workers not a number": (lambda place: ("run", "smoke", "--workers", "two", "--out", place.new()), "--workers"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_wrong_option_gives_one_sentence_and_loses_nothing(name, place, cli):
    assert_refused(CASES[name], place, cli)


@pytest.mark.parametrize("name", USAGE)
def test_wrong_usage_shows_the_usage(name, place, cli):
    arrange, words = USAGE[name]
    outcome = cli(*arrange(place))
    assert outcome.code == 2
    assert outcome.err.startswith("Usage: ")
    assert words in outcome.err
    assert "Traceback" not in outcome.err
    assert not place.new().exists()
