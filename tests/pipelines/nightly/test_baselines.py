"""The file of baselines: what is accepted stands, nothing that was there is lost, a wrong file is one sentence."""

import multiprocessing
from datetime import date
from pathlib import Path

import pytest

from datasets.errors import UserError
from pipelines.nightly.accepted import Baseline, Waiver
from pipelines.nightly.baselines import accept, load

TODAY = date(2026, 5, 4)
CONTEXT = multiprocessing.get_context("spawn")

WRITTEN = """\
# Kept by the perception team.

[[baseline]]
name = "spring"  # before the new detector
recipe = "nightly"
checkout = "old"
commit = "0a1b2c3"
pinned_data = "{0}"
run = "20260228T030000Z-00000000"
measures = {{ pinned = "{0}" }}
accepted_by = "Ada"
accepted_on = 2026-03-01
reason = "first"

[[waiver]]
gate = "failures"
slice = "typical/equisolid/edge-fit"
frame = 17
reason = "glare, see the picture"
by = "Ada"
until = 2026-05-04
run = "20260301T030000Z-00000000"
""".format("0" * 64)


@pytest.fixture
def path(tmp_path):
    (tmp_path / "old").mkdir()
    path = tmp_path / "baselines.toml"
    path.write_text(WRITTEN)
    return path


def _baseline(name, **changes):
    given = {"recipe": "nightly", "checkout": Path("old"), "commit": "ffff", "pinned_data": "1" * 64}
    given |= {
        "measures": {"pinned": "2" * 64, "fresh": "3" * 64},
        "accepted_by": "Bo",
        "accepted_on": TODAY,
        "run": "r",
    }
    return Baseline(name=name, reason='corners "without" bias\nand a new lens', **(given | changes))


def _waiver(**changes):
    given = {"gate": "accuracy", "slice": "typical/orthogonal/edge-fit", "metric": "corner_x", "reason": "known"}
    return Waiver(**(given | {"by": "Bo", "run": "20260504T030000Z-00000000"} | changes))


def test_a_file_written_by_hand_is_read(path):
    found = load(path)
    assert found.current("nightly").name == "spring"
    assert found.current("nightly").checkout == path.parent / "old"
    assert found.current("nightly").accepted_on == date(2026, 3, 1)
    assert found.waivers[0].frame == 17


def test_what_is_accepted_is_read_back_and_is_current(path):
    for entry in (_baseline("summer"), _baseline("wheel", checkout=None, version="0.1.0")):
        accept(path, entry)
        assert load(path).current("nightly").name == entry.name
    summer = load(path).baselines[1]
    assert summer.checkout == path.parent / "old"
    assert summer.measures == {"pinned": "2" * 64, "fresh": "3" * 64}
    assert summer.reason == 'corners "without" bias\nand a new lens'
    assert accept(path, _waiver()) == load(path)
    assert load(path).waivers[1] == _waiver()


@pytest.mark.parametrize("end", ["", "\n", "\n# the end", "\r\n# the end\r\n"])
def test_accepting_leaves_every_byte_that_was_there(path, end):
    before = (WRITTEN.rstrip() + end).encode()
    path.write_bytes(before)
    accept(path, _waiver())
    accept(path, _baseline("summer"))
    assert path.read_bytes().startswith(before)
    assert [item.name for item in load(path).baselines] == ["spring", "summer"]


def test_the_first_entry_makes_the_file(tmp_path):
    accept(tmp_path / "new" / "baselines.toml", _baseline("first", checkout=tmp_path))
    assert load(tmp_path / "new" / "baselines.toml").current("nightly").name == "first"
    assert [item.name for item in (tmp_path / "new").iterdir()] == ["baselines.toml"]


def test_no_file_holds_nothing(tmp_path):
    found = load(tmp_path / "baselines.toml")
    assert not found.is_waived("accuracy", "a/b/c", "corner_x", TODAY)
    with pytest.raises(UserError, match="has no baseline of recipe 'nightly', none at all; accept a run"):
        found.current("nightly")


def test_a_baseline_of_another_recipe_is_not_taken(path):
    with pytest.raises(UserError, match="no baseline of recipe 'nightly-smoke', only of nightly; accept a run"):
        load(path).current("nightly-smoke")


def test_a_checkout_that_is_gone_is_told_for_the_current_baseline_only(path, tmp_path):
    accept(path, _baseline("summer", checkout=tmp_path))
    (tmp_path / "old").rmdir()
    assert load(path).current("nightly").name == "summer"
    path.write_text(WRITTEN)
    with pytest.raises(UserError, match=r"baselines.toml: key 'baseline.0.checkout' is .*old.*check out 0a1b2c3 there"):
        load(path).current("nightly")


@pytest.mark.parametrize(
    ("entry", "asked"),
    [
        (_waiver(), ("accuracy", "typical/orthogonal/edge-fit", "corner_x")),
        (_waiver(gate="failures", metric=None, frame=3), ("failures", "typical/orthogonal/edge-fit", 3)),
        (_waiver(gate="speed", metric=None, slice="detect"), ("speed", "detect", None)),
    ],
)
def test_a_waiver_covers_what_it_names_and_nothing_else(path, entry, asked):
    accept(path, entry)
    found = load(path)
    gate, name, what = asked
    assert found.is_waived(gate, name, what, TODAY)
    assert not found.is_waived(gate, name, "circle_x", TODAY)
    assert not found.is_waived(gate, "typical/perspective/edge-fit", what, TODAY)
    assert not found.is_waived("fresh", name, what, TODAY)


def test_an_expired_waiver_no_longer_holds_and_is_told(path):
    asked = "failures", "typical/equisolid/edge-fit", 17
    assert load(path).is_waived(*asked, TODAY)
    assert load(path).expired(TODAY) == []
    later = date(2026, 5, 5)
    assert not load(path).is_waived(*asked, later)
    (told,) = load(path).expired(later)
    assert "frame 17 in typical/equisolid/edge-fit at gate failures ended on 2026-05-04" in told
    accept(path, _waiver(gate="failures", slice="typical/equisolid/edge-fit", metric=None, frame=17))
    assert load(path).expired(later) == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("commit", "comit", "unknown key 'baseline.0.comit' (did you mean 'commit'?)"),
        ("[[waiver]]", "[[waivers]]", "unknown key 'waivers' (did you mean 'waiver'?)"),
        ("[[waiver]]", "[waiver]", "key 'waiver' is"),
        ('by = "Ada"\nuntil', "until", "key 'waiver.0.by' is missing"),
        ('reason = "first"', 'reason = ""', "key 'baseline.0.reason' is ''"),
        ('"failures"', '"failurs"', "key 'waiver.0.gate' is 'failurs'"),
        ("frame = 17", 'frame = "17"', "key 'waiver.0.frame' is '17'"),
        ("frame = 17", 'metric = "corner_x"', "waiver of gate 'failures' has 'metric'; give 'frame' alone"),
        ("frame = 17\n", "", "waiver of gate 'failures' has neither"),
        ("2026-03-01", '"spring"', "key 'baseline.0.accepted_on' is 'spring'"),
        ("2026-03-01", "2026-03-01T00:00:00Z", "key 'baseline.0.accepted_on' is '2026-03-01 00:00:00+00:00'"),
        ("2026-05-04", "2026-13-04", "is not valid TOML"),
        ('checkout = "old"', 'checkout = "old"\nversion = "1"', "has both of the keys 'checkout' and 'version'"),
        ('checkout = "old"', "", "has neither of the keys 'checkout' and 'version'"),
        ('pinned = "0', 'pinned = "z', "key 'measures.pinned' is 'z0"),
        ("[[waiver]]", WRITTEN + "[[waiver]]", "key 'baseline.name' is 'spring' 2 times"),
        ("Ada", "\udcff", "is not UTF-8 text"),
    ],
)
def test_a_wrong_file_is_one_sentence_and_stays(path, old, new, words):
    assert old in WRITTEN
    path.write_bytes(WRITTEN.replace(old, new).encode(errors="surrogateescape"))
    before = path.read_bytes()
    for use in (lambda: load(path), lambda: accept(path, _waiver())):
        with pytest.raises(UserError) as told:
            use()
        assert str(told.value).startswith(str(path))
        assert words in str(told.value)
        assert "\n" not in str(told.value)
    assert path.read_bytes() == before


def test_a_name_is_accepted_once(path):
    with pytest.raises(UserError, match="'spring' 2 times"):
        accept(path, _baseline("spring"))
    assert path.read_text() == WRITTEN


def _accept_many(path, name, both_ready):
    both_ready.wait(60)
    for number in range(10):
        accept(path, _waiver(slice=f"{name}/{number}"))


def test_two_who_accept_at_once_both_stand(path):
    both_ready = CONTEXT.Barrier(2)
    processes = [CONTEXT.Process(target=_accept_many, args=(path, name, both_ready)) for name in ("a", "b")]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
    assert [process.exitcode for process in processes] == [0, 0]
    assert len(load(path).waivers) == 21
