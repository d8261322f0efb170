"""Wrong input to the command line: one sentence that says what is wrong, exit code 2, and nothing is lost."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from render import backend

NOBODY = 65534  # any user but root, who is refused nothing


@dataclass(frozen=True)
class Place:
    """Where a case lays out its files."""

    folder: Path
    text: str
    source: Path
    patch: pytest.MonkeyPatch

    def recipe(self, text=None, name="recipe.toml"):
        path = self.folder / name
        path.write_bytes((self.text if text is None else text).encode())
        return path

    def dataset(self, without=()):
        root = self.folder / "dataset"
        shutil.copytree(self.source, root)
        for name in without:
            shutil.rmtree(root / name)
        return root

    def new(self):
        return self.folder / "new"


def recipe(old, new):
    """A recipe in which `old` became `new`."""

    def arrange(place):
        assert old in place.text
        return "generate", place.recipe(place.text.replace(old, new, 1)), "--out", place.new()

    return arrange


def added(line):
    """A recipe with one more line, or section, at its end."""
    return recipe("nominal_f = 338\n", f"nominal_f = 338\n{line}\n")


def recipe_bytes(data):
    def arrange(place):
        path = place.recipe()
        path.write_bytes(data)
        return "generate", path, "--out", place.new()

    return arrange


def estimate(*words):
    return lambda place: ("estimate", place.dataset(), *words)


def on_dataset(name, *words, without=()):
    """A command on a dataset in which some tables are not there yet."""
    return lambda place: (name, place.dataset(without), *words)


def first(root, table):
    return min((root / table).iterdir())


def damaged(file, change, *words, without=()):
    """A command on a dataset whose first file of a folder was changed: bytes to bytes, or to None for deleted."""

    def arrange(place):
        root = place.dataset(without)
        path = first(root, file)
        data = change(path.read_bytes())
        path.unlink() if data is None else path.write_bytes(data)
        return words[0], root, *words[1:]

    return arrange


def half(data):
    return data[: len(data) // 2]


def garbage(data):
    return bytes(range(256)) * 20


def gone(data):
    return None


def put_image(root, data):
    """Give the first frame other image bytes; the shard's footer stays."""
    path = first(root, "frames")
    table = pq.read_table(path)
    rows = table.to_pylist()
    rows[0]["image"]["bytes"] = data
    pq.write_table(pa.Table.from_pylist(rows, schema=table.schema), path)


def not_a_png(*words):
    def arrange(place):
        root = place.dataset(without=["detections"])
        put_image(root, b"not a PNG")
        return words[0], root, *words[1:]

    return arrange


def other_recipe(place):
    return "generate", "smoke", "--out", place.dataset()


def recipe_of_dataset(data):
    """A dataset whose own recipe is damaged."""

    def arrange(place):
        root = place.dataset()
        (root / "recipe.toml").write_bytes(data)
        return "generate", place.recipe(), "--out", root

    return arrange


def out_is_a_file(place):
    place.new().write_text("mine")
    return "generate", place.recipe(), "--out", place.new()


def out_under_a_file(place):
    place.new().write_text("mine")
    return "generate", place.recipe(), "--out", place.new() / "dataset"


def out_not_empty(place):
    place.new().mkdir()
    (place.new() / "notes.txt").write_text("mine")
    return "generate", place.recipe(), "--out", place.new()


def before_generate(place):
    root = place.new()
    root.mkdir()
    (root / "recipe.toml").write_text(place.text)
    return "detect", root


def environment(variable, value):
    """Rendering in a process that looks for its compiler anew, with a variable set to a value or to a fake library."""

    def arrange(place):
        place.patch.setattr(backend, "load", backend.load.__wrapped__)
        place.patch.setenv("EPOSIT_VARIANT", backend.CPU_VARIANT)
        place.patch.setenv(variable, value(place) if callable(value) else value)
        return "generate", place.recipe(), "--out", place.new()

    return arrange


def fake_library(name):
    def write(place):
        path = place.folder / name
        path.write_bytes(garbage(b""))
        return str(path)

    return write


def old_llvm(place):
    """A real library that says it is LLVM 14."""
    place.patch.setattr(backend, "llvm_version", lambda library: 14)
    return fake_library("libLLVM.so")(place)


RECIPES = {
    "unknown key": (recipe("samples = 4", "smaples = 4"), "unknown key 'smaples' (did you mean 'samples'?)"),
    "unknown key in a section": (recipe("step = 90", "stepp = 90"), "'trajectory.stepp' (did you mean 'step'?)"),
    "unknown key in a camera": (recipe("fx = ", "f_x = "), "unknown key 'cameras.0.f_x'"),
    "unknown section": (added("[senser]\ngamma = 2.2"), "unknown key 'senser' (did you mean 'sensor'?)"),
    "missing key": (recipe("fy = 345.3\n", ""), "key 'cameras.0.fy' is missing"),
    "no cameras": (recipe_bytes(b'name = "empty"'), "key 'cameras' is missing"),
    "text for a number": (recipe("seed = 5", 'seed = "5"'), "key 'seed' is '5'"),
    "fraction for a count": (recipe("width = 400", "width = 400.5"), "key 'cameras.0.width' is 400.5"),
    "number for a section": (recipe("[trajectory]\nstop = 90\nstep = 90", "[[trajectory]]"), "key 'trajectory' is"),
    "not a number": (recipe("cx = 201.9", "cx = nan"), "key 'cameras.0.cx' is nan"),
    "date": (recipe("seed = 5", "seed = 2026-01-01"), "use numbers, texts and lists"),
    "unknown lens": (recipe('lens = "perspective"', 'lens = "fisheye"'), "unknown lens 'fisheye'; known lenses are"),
    "kannala-brandt with three": (
        recipe('lens = "perspective"', 'lens = "kannala_brandt"\ncoefficients = [0.1, 0.0, 0.0]'),
        "takes four finite coefficients",
    ),
    "coefficients for a pinhole": (added("coefficients = [0.1]"), "takes no coefficients"),
    "samples not a square": (recipe("samples = 4", "samples = 5"), "must be a square number"),
    "negative seed": (recipe("seed = 5", "seed = -5"), "key 'seed' is -5"),
    "empty shards": (recipe("shard_frames = 1", "shard_frames = 0"), "key 'shard_frames' is 0"),
    "negative focal length": (recipe("fx = 344.7", "fx = -344.7"), "has fx -344.7"),
    "negative nominal focal length": (recipe("nominal_f = 338", "nominal_f = -338"), "has nominal_f -338"),
    "zero width": (recipe("width = 400", "width = 0"), "camera width is 0"),
    "negative height": (recipe("height = 300", "height = -300"), "camera height is -300"),
    "picture too large": (recipe("width = 400", "width = 4000000"), "4000000 x 300 pixels; at most"),
    "bad TOML": (recipe("seed = 5", "seed = "), "is not valid TOML"),
    "not UTF-8": (recipe_bytes(b'name = "caf\xe9"'), "it is not UTF-8 text"),
    "two cameras of one name": (
        lambda place: (
            "generate",
            place.recipe(place.text + place.text[place.text.index("[[cameras]]") :]),
            "--out",
            place.new(),
        ),
        "cameras are named pinhole, pinhole",
    ),
    "symmetric board": (added("[target]\nrows = 8"), "looks the same after half a turn"),
    "circle on a black square": (added("[target]\ncircle_square = [1, 1]"), "it must be a white square"),
    "one of four twice": (recipe("[2, 0]", "[0, 0]"), "give four different ones"),
    "no such corner": (recipe("[2, 0]", "[9, 0]"), "target has no point [9, 0]"),
    "exposure zero": (added("[sensor]\nexposure = 0.0"), "sensor exposure is 0.0"),
    "lamp behind the board": (added("[light]\nlamp_position_mm = [0.0, 0.0, 5.0]"), "the lamp stands in front"),
    "unknown regime": (added('[sensor]\nregime = "paperr"'), "sensor regime is 'paperr'; choose one of clean"),
    "regime is a list": (added("[sensor]\nregime = [1]"), "sensor regime is [1]; choose one of clean"),
    "negative defocus": (added("[sensor]\ndefocus_radius_px = -1.0"), "sensor defocus_radius_px is -1.0"),
    "negative exposure time": (
        added("[sensor]\nexposure_s = -0.1"),
        "sensor exposure_s is -0.1; it must lie in 0 to 1",
    ),
    "negative full well": (added("[sensor]\nfull_well_e = -1"), "sensor full_well_e is -1.0; it must lie in 0 to"),
    "read noise without electrons": (added("[sensor]\nread_noise_e = 2.5"), "give full_well_e, which says how many"),
    "all light lost": (added("[sensor]\nvignetting = 1.0"), "sensor vignetting is 1.0; it must lie in 0 to 0.95"),
    "misspelt sensor key": (added('[sensor]\nregime = "harsh"\nfull_wel_e = 1'), "(did you mean 'full_well_e'?)"),
    "unknown kind": (recipe("step = 90", 'step = 90\nkind = "line"'), "trajectory kind is 'line'; choose one of helix"),
    "key of another kind": (
        recipe("stop = 90\nstep = 90", 'kind = "field"\nstep = 90'),
        "unknown key 'trajectory.step'; known keys of kind 'field' are kind, field_deg",
    ),
    "misspelt key of a kind": (
        recipe("stop = 90\nstep = 90", 'kind = "scatter"\ntilt_range = [0, 1]'),
        "(did you mean 'tilt_range_deg'?)",
    ),
    "wrong type in a kind": (
        recipe("stop = 90\nstep = 90", 'kind = "scatter"\ntilt_range_deg = 10'),
        "key 'trajectory.tilt_range_deg' is 10",
    ),
    "range upside down": (
        recipe("stop = 90\nstep = 90", 'kind = "scatter"\ntilt_range_deg = [30, 0]'),
        "trajectory tilt_range_deg is [30.0, 0.0]; give the least and the largest",
    ),
    "no poses": (recipe("stop = 90\nstep = 90", 'kind = "scatter"\ncount = 0'), "trajectory count is 0"),
    "no field angle": (recipe("stop = 90\nstep = 90", 'kind = "field"\nfield_deg = []'), "is an empty list"),
    "field angle behind": (recipe("stop = 90\nstep = 90", 'kind = "field"\nfield_deg = [180]'), "below 180 degrees"),
    "no azimuth": (recipe("stop = 90\nstep = 90", 'kind = "field"\nazimuth_deg = 0'), "or a count above 0"),
    "negative distance": (recipe("stop = 90\nstep = 90", 'kind = "field"\ndistance_mm = [-1]'), "are above 0 mm"),
    "negative speed": (
        recipe("stop = 90\nstep = 90", 'kind = "field"\nspeed_mm_per_s = -1'),
        "trajectory speed_mm_per_s is -1.0",
    ),
    "scatter that fits nowhere": (
        recipe("stop = 90\nstep = 90", 'kind = "scatter"\noffset_range_mm = [5000, 6000]'),
        "none of 2000 random poses has the whole target in every camera",
    ),
    "field of a camera": (added("max_field_deg = -5"), "has max_field_deg -5.0; it must lie in 0 to 180 degrees"),
    "camera without a view": (
        added("max_field_deg = 1"),
        "sees no pose, as max_field_deg is 1; raise it",
    ),
    "step zero": (recipe("step = 90", "step = 0"), "trajectory step is 0"),
    "stop before start": (recipe("stop = 90", "stop = -90"), "stop must not come first"),
    "board behind the camera": (
        recipe("step = 90", "step = 90\ndepth_mm = -2000.0\nangle_deg = [180.0, 0.0, 0.0]"),
        "55 of 55 target points are behind the camera",
    ),
    "board from behind": (recipe("step = 90", "step = 90\nangle_deg = [180.0, 0.0, 0.0]"), "behind the board"),
    "board outside the image": (
        recipe("step = 90", "step = 90\nradius_mm = 9000.0"),
        "frame 0 (camera pinhole, t = 0 s): 55 of 55 target points lie outside the image",
    ),
    "board partly outside": (recipe("step = 90", "step = 90\nradius_mm = 900.0"), "or set allow_cropped = true"),
}

CASES = RECIPES | {
    # Which recipe.
    "missing recipe": (lambda place: ("run", place.folder / "no.toml", "--out", place.new()), "cannot read recipe"),
    "recipe is a folder": (lambda place: ("run", f"{place.folder}/", "--out", place.new()), "Is a directory"),
    "unknown recipe": (lambda place: ("run", "dmo", "--out", place.new()), "did you mean demo?"),
    "describe an unknown recipe": (lambda place: ("describe", "smokey"), "did you mean smoke?"),
    # Where to.
    "another recipe's folder": (other_recipe, "holds a dataset of another recipe"),
    "dataset with a recipe in no encoding": (recipe_of_dataset(b"\xff\xfe\x00"), "it is not UTF-8 text"),
    "dataset with a damaged recipe": (recipe_of_dataset(b"name"), "is not valid TOML"),
    "out is a file": (out_is_a_file, "is a file; give a folder to --out"),
    "out under a file": (out_under_a_file, "Not a directory"),
    "out not empty": (out_not_empty, "is not empty and holds no dataset"),
    "no dataset": (lambda place: ("detect", place.folder), "holds no dataset (recipe.toml is missing)"),
    "dataset is a file": (lambda place: ("verify", place.recipe()), "holds no dataset"),
    "masters from nowhere": (
        lambda place: ("generate", place.recipe(), "--out", place.new(), "--masters", place.folder / "no"),
        "holds no dataset (recipe.toml is missing)",
    ),
    "masters from here": (
        lambda place: ("generate", place.recipe(), "--out", (root := place.dataset()), "--masters", root),
        "is the dataset that is to be made; give the folder of another one",
    ),
    "regime on the command line": (
        lambda place: ("run", place.recipe(), "--out", place.new(), "--regime", "best"),
        "sensor regime is 'best'; choose one of clean, typical, paper, harsh",
    ),
    "regime where no line fits": (
        lambda place: (
            *("run", place.recipe("sensor = {gamma = 2.2}\n" + place.text), "--out", place.new()),
            *("--regime", "harsh"),
        ),
        'write regime = "harsh" under [sensor] there',
    ),
    # Damaged files.
    "truncated frames": (damaged("frames", half, "detect", without=["detections"]), "delete it and run the generate"),
    "truncated frames, verify": (damaged("frames", half, "verify"), "is damaged; delete it"),
    "garbage keypoints": (damaged("keypoints", garbage, "report"), "is damaged; delete it and run the generate stage"),
    "garbage detections": (
        damaged("detections", garbage, "estimate", "--solver", "posit"),
        "is damaged; delete it and run the detect stage",
    ),
    "truncated estimates": (damaged("estimates", half, "score"), "is damaged; delete it and run the estimate stage"),
    "empty scores": (damaged("scores", lambda data: b"", "report"), "is damaged; delete it and run the score stage"),
    "scores damaged under another stage": (
        damaged("scores", garbage, "estimate", "--solver", "posit"),
        "is damaged; delete it and run the score stage",
    ),
    "shard of another dataset": (
        lambda place: ("detect", _mixed(place.dataset(without=["detections"]))),
        "belongs to another recipe; delete it",
    ),
    "truncated master": (damaged("masters", half, "verify"), "cannot be read as a master"),
    "garbage master": (damaged("masters", garbage, "verify"), "cannot be read as a master"),
    "missing master": (damaged("masters", gone, "verify"), "is missing; run the generate stage"),
    "image is no PNG": (not_a_png("detect"), "the image is not an 8-bit grey PNG"),
    "image is no PNG, verify": (not_a_png("verify"), "the image is not an 8-bit grey PNG"),
    # Stages out of order, or half done.
    "detect before generate": (before_generate, "is missing; run the generate stage first"),
    "estimate before detect": (
        on_dataset("estimate", "--solver", "posit", without=["detections"]),
        "is missing; run the detect stage first",
    ),
    "score before estimate": (on_dataset("score", without=["estimates"]), "run the estimate stage first"),
    "report before score": (on_dataset("report", without=["scores"]), "run the score stage first"),
    "score without a shard of frames": (
        damaged("frames", gone, "score", without=["scores"]),
        "is missing; run the generate stage first",
    ),
    "report without a shard of detections": (
        damaged("detections", gone, "report"),
        "is missing; run the detect stage first",
    ),
    # Options.
    "unknown solver": (estimate("--solver", "upnp"), "unknown solver 'upnp'; choose one of best"),
    "unknown camera": (estimate("--camera", "wide"), "unknown camera 'wide'; choose one of exact"),
    "unknown use": (estimate("--use", "five"), "unknown use 'five'; choose one of four"),
    "unknown points": (estimate("--points", "seen"), "unknown points 'seen'; choose one of detected"),
    "unknown detector": (
        on_dataset("detect", "--detector", "edge-fitt"),
        "unknown detector 'edge-fitt'; choose one of edge-fit, opencv-subpix, opencv-sb",
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
    "detector without a shard of detections": (
        damaged("detections", gone, "estimate", "--solver", "posit"),
        "detections-00000-of-00002.parquet is missing; run the detect stage",
    ),
    "another detector before generate": (
        lambda place: (*before_generate(place), "--detector", "opencv-sb"),
        "is missing; run the generate stage first",
    ),
    "negative noise": (estimate("--points", "truth+noise", "--noise-px", "-0.4"), "noise of -0.4 px is not usable"),
    "noise not a number": (estimate("--points", "truth+noise", "--noise-px", "nan"), "noise of nan px is not usable"),
    "zero draws": (estimate("--points", "truth+noise", "--draws", "0"), "0 draws are not usable"),
    "zero workers": (estimate("--solver", "posit", "--workers", "0"), "0 workers are not usable; give --workers from"),
    "too many workers": (estimate("--solver", "posit", "--workers", "999"), "999 workers are not usable"),
    # The compiler that rendering needs.
    "old LLVM": (environment(backend.LIBRARY_VARIABLE, old_llvm), "names LLVM 14, which would abort the process"),
    "missing LLVM": (environment(backend.LIBRARY_VARIABLE, "nowhere/libLLVM.so"), "which is not a file"),
    "LLVM is no library": (
        environment(backend.LIBRARY_VARIABLE, fake_library("libLLVM-20.so")),
        "which is not an LLVM library",
    ),
    "unknown variant": (environment("EPOSIT_VARIANT", "scalar_rgb"), "EPOSIT_VARIANT is 'scalar_rgb'; it must be one"),
}

USAGE = {
    "unknown option": (lambda place: ("run", "smoke", "--fast", "--out", place.new()), "No such option: --fast"),
    "unknown command": (lambda place: ("rnu", "smoke"), "No such command 'rnu'"),
    "no folder": (lambda place: ("generate", "smoke"), "Missing option '--out'"),
    "detector of a stage without one": (lambda place: ("score", place.new(), "--detector", "opencv-sb"), "--detector"),
    "workers not a number": (lambda place: ("run", "smoke", "--workers", "two", "--out", place.new()), "--workers"),
}

ALONE = ("unknown key", "out is a file", "truncated master", "score before estimate")


def _mixed(root):
    """A dataset with a sound shard that carries another recipe's hash."""
    path = first(root, "frames")
    table = pq.read_table(path)
    other = {**table.schema.metadata, b"recipe": b"0" * 64}
    pq.write_table(table.replace_schema_metadata(other), path)
    return root


@pytest.fixture
def place(tmp_path, tiny, monkeypatch):
    text, source = tiny
    return Place(tmp_path, text, source, monkeypatch)


def files(folder):
    """Path to content and time of every file under a folder."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in found}


def assert_one_sentence(code, err, words):
    assert code == 2
    assert err.startswith("error: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1
    assert words in err


@pytest.mark.parametrize("name", CASES)
def test_wrong_input_gives_one_sentence_and_loses_nothing(name, place, cli):
    arrange, words = CASES[name]
    arguments = arrange(place)
    before = files(place.folder)
    outcome = cli(*arguments)
    assert_one_sentence(outcome.code, outcome.err, words)
    assert before.items() <= files(place.folder).items()
    assert name not in RECIPES or not place.new().exists()


@pytest.mark.parametrize("name", USAGE)
def test_wrong_usage_shows_the_usage(name, place, cli):
    arrange, words = USAGE[name]
    outcome = cli(*arrange(place))
    assert outcome.code == 2
    assert outcome.err.startswith("Usage: ")
    assert words in outcome.err
    assert "Traceback" not in outcome.err
    assert not place.new().exists()


def alone(*words, **variables):
    """A command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "pipelines", *map(str, words)],
        cwd=Path(__file__).parents[1],
        env=os.environ | variables,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("name", ALONE)
def test_wrong_input_to_a_process_of_its_own(name, place):
    arrange, words = CASES[name]
    done = alone(*arrange(place))
    assert_one_sentence(done.returncode, done.stderr, words)


@pytest.mark.parametrize("workers", [1, 2])
def test_an_unusable_compiler_in_a_process_of_its_own(workers, place):
    library = {backend.LIBRARY_VARIABLE: fake_library("libLLVM-14.so")(place), "EPOSIT_VARIANT": backend.CPU_VARIANT}
    done = alone("generate", place.recipe(), "--out", place.new(), "--workers", workers, **library)
    assert_one_sentence(done.returncode, done.stderr, "which is not an LLVM library")


def test_doctor_names_the_unusable_compiler(place, cli):
    environment(backend.LIBRARY_VARIABLE, old_llvm)(place)
    outcome = cli("doctor")
    assert_one_sentence(outcome.code, outcome.err, "see the lines marked MISSING")
    assert "MISSING  LLVM" in outcome.out


@contextmanager
def another_user():
    """Whom the permissions of files bind: this user, or for root a user without rights."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def public(place):
    """A place that every user can reach; at the end its files can be removed again."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        yield Place(folder, place.text, place.source, place.patch)
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o755)


def lock(folder, mode):
    """Set the rights on a folder and all folders in it."""
    for path in (*(path for path in folder.rglob("*") if path.is_dir()), folder):
        path.chmod(mode)


def test_a_new_dataset_in_a_read_only_folder(public, cli):
    arguments = "generate", public.recipe(), "--out", public.new()
    lock(public.folder, 0o555)
    with another_user():
        outcome = cli(*arguments)
    assert_one_sentence(outcome.code, outcome.err, "the folder is read-only for this user; choose another --out")
    assert not public.new().exists()


@pytest.mark.parametrize(
    ("words", "without"), [(("estimate", "--solver", "posit"), ()), (("score",), ("scores",)), (("report",), ())]
)
def test_a_stage_on_a_read_only_dataset(words, without, public, cli):
    root = public.dataset(without)
    before = files(root)
    lock(root, 0o555)
    with another_user():
        outcome = cli(words[0], root, *words[1:])
    assert_one_sentence(outcome.code, outcome.err, "the folder is read-only for this user")
    assert files(root) == before


@pytest.mark.parametrize("words", [("verify",), ("detect",), ("generate", "--out")])
def test_a_folder_that_is_closed_to_the_user(words, public, cli):
    arguments = (words[0], public.recipe(), words[1]) if len(words) > 1 else words
    root = public.dataset()
    root.chmod(0o000)
    with another_user():
        outcome = cli(*arguments, root)
    assert_one_sentence(outcome.code, outcome.err, "this user has no permission")


@pytest.mark.parametrize(
    ("table", "words"),
    [("estimates", ("score",)), ("estimates", ("estimate",)), ("scores", ("estimate", "--solver", "posit"))],
)
def test_an_unreadable_shard_is_not_called_damaged(table, words, public, cli):
    root = public.dataset(["scores"] if words == ("score",) else [])
    lock(root, 0o777)
    path = first(root, table)
    path.chmod(0o000)
    with another_user():
        outcome = cli(words[0], root, *words[1:])
    assert_one_sentence(outcome.code, outcome.err, f"cannot read {path}")
    assert "delete" not in outcome.err
    assert path.exists()


@pytest.mark.parametrize(
    "image",
    [np.full((300, 400), 90, np.uint8), np.random.default_rng(0).integers(0, 256, (300, 400), dtype=np.uint8)],
    ids=["grey", "noise"],
)
def test_a_picture_without_the_board_is_a_status_not_an_error(image, place, cli):
    root = place.dataset(without=["detections", "estimates", "scores"])
    put_image(root, cv2.imencode(".png", image)[1].tobytes())
    assert cli("detect", root).code == 0
    assert cli("estimate", root).code == 0
    found = pq.read_table(first(root, "detections"))
    assert set(found["status"].to_pylist()) == {"board_not_found"}
    assert np.isnan(found["x_px"].to_numpy()).all()
    assert pq.read_table(first(root, "estimates"))["status"].to_pylist() == ["points_missing"]
