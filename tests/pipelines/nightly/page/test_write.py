"""The page: one file that loads nothing, whose names are escaped, and that tells what the history holds."""

import base64
import hashlib
import re

import pytest

from datasets.errors import UserError
from pipelines.nightly.history import History
from pipelines.nightly.page.findings import CHANGED
from pipelines.nightly.page.write import MOST_PICTURES, write_page
from tests.pipelines.nightly.page import synthetic
from tests.pipelines.pages.parsed import Page, assert_named_for_a_screen_reader

MOST_BYTES = 1_500_000
HOSTILE = "\"'><script>alert(1)</script><img src=x onerror=alert(1)>&amp;"


def _written(folder, history, run_id=None, shown=None):
    write_page(history, run_id, folder / "report.html", shown)
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A history of six nights, and the text of the last one's page."""
    folder = tmp_path_factory.mktemp("small")
    history = synthetic.history(folder / "history", 6, 10)
    return history, _written(folder, history, shown=synthetic.shown(2))


@pytest.mark.full
def test_a_year_of_a_hundred_slices_is_small(tmp_path):
    history = synthetic.history(tmp_path / "history", 365, 100)
    text = _written(tmp_path, history, shown=synthetic.shown(MOST_PICTURES))
    assert len(text.encode()) < MOST_BYTES
    page = Page(text)
    assert len(page.of("tbody")) > 100
    assert len([body for body in page.of("tbody") if "id" in body.attributes]) == 100
    (nights,) = page.of("svg", "nights")
    assert len(page.inside(nights, "rect")) == 365
    assert len(page.of("button", "enlarge")) == MOST_PICTURES + 1


def test_nothing_is_loaded_and_no_text_is_run(small):
    _, text = small
    page = Page(text)
    addresses = [item.attributes[name] for item in page.all for name in ("href", "src") if name in item.attributes]
    assert all(address.startswith(("#", "data:image/jpeg;base64,")) for address in addresses)
    code = re.sub(r"base64,[A-Za-z0-9+/=]+", "", text)
    assert not re.search(r"https?:|//[a-z]|url\(|@import|\beval\b|Function\(|innerHTML|fetch\(|XMLHttp|import\(", code)
    assert not [item for item in page.all if any(name.startswith("on") or name == "style" for name in item.attributes)]
    (policy,) = (item.attributes["content"] for item in page.of("meta") if "http-equiv" in item.attributes)
    assert policy.startswith("default-src 'none';")
    for tag in ("style", "script"):
        (own,) = page.of(tag)
        digest = base64.b64encode(hashlib.sha256("".join(own.words).encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}';" in policy


def test_everything_has_a_name_for_a_screen_reader(small):
    _, text = small
    assert_named_for_a_screen_reader(Page(text))


def test_the_verdict_and_the_gates_are_told(small):
    history, text = small
    page, run = Page(text), history.runs().to_pylist()[-1]
    assert page.of("h1")[0].text == run["sentence"]
    assert page.of("p", "word")[0].text == "worseexit 1"
    (strip,) = page.of("ol", "strip")
    assert [item.text for item in page.inside(strip, "b")] == [gate["gate"] for gate in run["gates"]]
    assert [item.text for item in page.inside(strip, "span")] == [gate["state"] for gate in run["gates"]]
    (listed,) = page.of("dl", "gates")
    assert [item.text for item in page.inside(listed, "dd")] == [gate["sentence"] for gate in run["gates"]]
    accept, *waive = [item.text for item in page.of("pre")]
    assert f"accept {run['run_id']} --history " in accept
    assert len(waive) == 2
    assert all(" --gate accuracy --slice regime-0/perspective/edge-fit --metric corner_" in item for item in waive)


def test_changes_are_told_first_in_the_list_and_in_the_table(small):
    history, text = small
    page = Page(text)
    (listed,) = page.of("ol", "changes")
    titles = [item.text for item in page.inside(listed, "h3")]
    assert set(titles[:2]) == {
        f"worse {name} in regime-0/perspective/edge-fit" for name in ("corner_x", "corner_log_ms")
    }
    assert len(titles) == 2  # what one look at fresh views saw is not among them
    kinds = [body.attributes["data-kind"] for body in page.of("tbody") if "data-kind" in body.attributes]
    assert len(kinds) == 10
    assert kinds[:2] == ["worse changed", "unconfirmed"]
    assert not set(" ".join(kinds[2:]).split()) & {*CHANGED, "changed"}
    found = history.findings(history.run_ids()[-1:]).to_pylist()
    details = [item for item in page.of("tr") if any("detail" in parent.classes for parent in item.parents)]
    assert len(details) == len(found) + len(kinds)  # and a head for each slice


def test_a_baseline_that_moved_is_marked(small):
    _, text = small
    page = Page(text)
    trends = [item for item in page.of("path", "moved") if item.attributes["d"]]
    assert {item.attributes["d"] for item in trends} == {"M2.5 0V400"}  # between the third night and the fourth
    assert "Baseline changed: 2025-05-07 to second." in page.of("main")[0].text


def test_facts_that_changed_over_night_say_so(small):
    _, text = small
    page = Page(text)
    (other,) = page.of("tr", "other")  # and not the fresh suite, which is another every night
    assert page.inside(other, "th")[0].text == "commit"
    assert page.inside(other, "span", "was")[0].text.startswith("the night before: ")


def test_frames_are_shown_beside_each_other(small):
    _, text = small
    page = Page(text)
    otherwise, frames = page.of("ul", "frames")
    assert [item.text for item in page.inside(frames, "b")] == ["baseline", "candidate"] * 2
    assert len(page.inside(frames, "image")) == 2  # each picture once, although it is shown twice
    assert "nothing found" in page.inside(frames, "figcaption")[-1].text
    assert "nightly frame pinned-regime-0 3" in page.inside(frames, "code")[0].text
    assert [item.text for item in page.inside(otherwise, "b")] == ["stored", "rendered tonight", "difference"]
    assert len(page.inside(otherwise, "image")) == 3
    (told,) = [item.text for item in page.inside(otherwise, "p") if not item.classes]
    assert told == "differs by 3 grey levels at most, in 0.0093 % of the pixels; true points by 2e-10 px"
    assert "nightly frame pinned-regime-0 7 --run 2026" in page.inside(otherwise, "code")[0].text


def test_hostile_names_stay_text(tmp_path, small):
    """The same elements with the same attributes as with harmless names."""
    history = synthetic.history(tmp_path / "history", 6, 10, names=lambda name: name + HOSTILE)
    text = _written(tmp_path, history, shown=synthetic.shown(2, names=lambda name: name + HOSTILE))
    shape = [
        [(item.tag, sorted(item.attributes)) for item in Page(one).all if item.tag != "wbr"] for one in (text, small[1])
    ]
    assert shape[0] == shape[1]
    assert HOSTILE in Page(text).of("tbody")[0].attributes["data-words"]


def test_equal_history_gives_equal_bytes(tmp_path, small):
    history, text = small
    assert _written(tmp_path, history, shown=synthetic.shown(2)) == text


def test_an_earlier_run_is_shown_with_the_nights_before_it(tmp_path, small):
    history, _ = small
    run_id = history.run_ids()[2]
    page = Page(_written(tmp_path, history, run_id))
    assert page.of("p", "word")[0].text == "fineexit 0"
    assert len(page.inside(page.of("svg", "nights")[0], "rect")) == 3
    assert not page.of("ol", "changes")
    assert not page.of("ul", "frames")
    assert "No metric changed by more than its margin." in page.of("main")[0].text


@pytest.mark.parametrize("nights", [1, 71])
def test_a_night_without_findings_has_a_page(tmp_path, nights):
    """Night 71 has no verdict; a first night has none before it."""
    history = synthetic.history(tmp_path / "history", nights, 2, faulty=False)
    page = Page(_written(tmp_path, history))
    assert page.of("p", "word")[0].text == ("fineexit 0" if nights == 1 else "no verdictexit 3")
    assert bool(page.of("table", "slices")) == (nights == 1)


def test_what_is_not_there_is_a_sentence(tmp_path, small):
    out = tmp_path / "report.html"
    with pytest.raises(UserError, match="holds no nights"):
        write_page(History(tmp_path / "none"), None, out)
    with pytest.raises(UserError, match="no run 'x'"):
        write_page(small[0], "x", out)
    assert not out.exists()
