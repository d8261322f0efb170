"""A wrong recipe: one sentence that names the key, exit code 2, and no dataset is begun."""

from __future__ import annotations

import pytest

from tests.wrong_input import alone, assert_one_sentence, assert_refused


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
        "takes 4 finite coefficients",
    ),
    "coefficients for a pinhole": (added("coefficients = [0.1]"), "takes no coefficients"),
    "samples not a square": (recipe("samples = 4", "samples = 5"), "must be a square number"),
    "seed of 5000 digits": (recipe("seed = 5", f"seed = {'9' * 5000}"), "use numbers, texts and lists"),
    "name with a zero byte": (lambda place: ("describe", "a\0b.toml"), "its name holds a zero byte"),
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
    "circle in the middle": (
        added("[target]\ncolumns = 9\nrows = 7\ncircle_square = [5, 4]"),
        "look the same after half a turn",
    ),
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
    "rows read backwards": (
        added("[optics]\nline_time_us = -1.0"),
        "optics line_time_us is -1.0; it must lie in 0 to 1000 microseconds",
    ),
    "two focal lengths of grey": (
        added("[optics]\nred_focal = 1.0003"),
        "which takes pictures in colour; set colour = true under [outputs]",
    ),
    "focal length of another lens": (
        added("[outputs]\ncolour = true\n[optics]\nblue_focal = 1.1"),
        "optics blue_focal is 1.1; it must lie in 0.98 to 1.02",
    ),
    "open pupil without focus": (added("[optics]\naperture_mm = 4"), "focus_mm is left out; give the distance"),
    "focus inside the lens": (added("[optics]\naperture_mm = 4\nfocus_mm = 3"), "it must be larger than aperture_mm"),
    "open pupil in hybrid": (
        added('[world]\nmethod = "hybrid"\n[optics]\naperture_mm = 4\nfocus_mm = 2000'),
        "set method to path or closed, or aperture_mm to 0",
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


@pytest.mark.parametrize("name", RECIPES)
def test_a_wrong_recipe_gives_one_sentence_and_begins_nothing(name, place, cli):
    assert_refused(RECIPES[name], place, cli)
    assert not place.new().exists()


def test_a_wrong_recipe_to_a_process_of_its_own(place):
    arrange, words = RECIPES["unknown key"]
    done = alone(*arrange(place))
    assert_one_sentence(done.returncode, done.stderr, words)
