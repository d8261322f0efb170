"""The page in a browser: sorted, filtered, opened by mouse and by keyboard alone, dark, narrow, and off the network."""

from __future__ import annotations

import functools

import pytest

from pipelines.nightly.page.write import MOST_PICTURES, write_page
from tests.pipelines.nightly.page import synthetic
from tests.pipelines.pages.browsing import LEAST_CONTRAST

pytestmark = pytest.mark.full

TEXTS = (
    "h1", ".word b", ".word span", ".of span", ".strip b", ".strip span", ".state.passed", ".state.failed",
    ".state.warned", ".state.changed", ".state.not-run", ".mark.worse", ".mark.unconfirmed", ".mark.unproved",
    ".mark.equal", ".muted", ".changes a", ".opens", ".detail .mark.equal", "output", ".was", "pre",
)  # fmt: skip


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    history = synthetic.history(folder / "history", 6, 10)
    write_page(history, None, folder / "report.html", synthetic.shown(2))
    return folder / "report.html"


@pytest.fixture
def visit(visiting, small):
    """Open the small page, or another."""
    return functools.partial(visiting, small)


def _slices(page):
    return page.eval_on_selector_all(".slices > tbody:not(.out) > tr > th", "all => all.map(e => e.dataset.value)")


def test_the_table_sorts(visit):
    page = visit().page
    first = _slices(page)
    head = page.locator(".slices th:nth-child(1)[data-sort]")
    for state, wanted in (("ascending", sorted(first)), ("descending", sorted(first, reverse=True))):
        head.locator("button").click()
        assert head.get_attribute("aria-sort") == state
        assert page.locator("[aria-sort]").count() == 1
        assert _slices(page) == wanted
    page.locator(".slices th:nth-child(5)[data-sort] button").click()
    sizes = page.eval_on_selector_all(".slices > tbody > tr > .number", "all => all.map(e => +e.dataset.value)")
    assert sizes == sorted(sizes, reverse=True)  # the largest first
    page.locator(".slices th:nth-child(2)[data-sort] button").click()
    assert _slices(page) == first


def test_the_table_filters(visit):
    page = visit().page
    page.fill("[name=words]", "EQUISOLID edge")
    assert _slices(page) == ["regime-0/equisolid/edge-fit"]
    assert page.locator(".filter output").inner_text() == "1 of 10 shown"
    page.fill("[name=words]", "")
    page.select_option("[name=kind]", "changed")
    assert _slices(page) == ["regime-0/perspective/edge-fit"]
    page.select_option("[name=kind]", "unconfirmed")
    assert _slices(page) == ["regime-0/orthogonal/best detected exact all"]
    page.fill("[name=words]", "nowhere")
    assert _slices(page) == []


def test_a_slice_opens_and_a_change_leads_to_it(visit):
    page = visit().page
    detail = page.locator("tbody:has(> tr > th[data-value='regime-0/perspective/edge-fit']) > .detail")
    assert not detail.is_visible()
    page.select_option("[name=kind]", "equal")
    page.locator(".changes a").first.click()
    assert detail.is_visible()
    assert page.locator("tr tbody tr:visible").count() == 14  # seven metrics of two suites
    page.locator("tbody.open .opens").click()
    assert not detail.is_visible()


def test_a_frame_opens_large_and_closes(visit):
    page = visit().page
    page.locator("section[aria-labelledby=frames] .sides").first.click()
    dialog = page.locator("dialog")
    assert dialog.is_visible()
    shown, small = (page.locator(f"{where} .sides svg").first.bounding_box() for where in ("dialog", "ul[class]"))
    assert shown["width"] > 2.0 * small["width"]
    assert "The bar is an error of " in dialog.inner_text()
    page.locator("dialog button").click()
    assert not dialog.is_visible()


def test_the_keyboard_alone_is_enough(visit):
    here = visit()
    page = here.page
    page.keyboard.press("Tab")
    assert here.focused("e => e.className") == "skip"
    here.tab_to("#theme")
    here.tab_to(".strip a")
    assert page.locator("[role=tooltip]:visible").count() == 1
    here.tab_to(".slices th:nth-child(1)[data-sort] button")
    page.keyboard.press("Enter")
    assert page.locator(".slices th:nth-child(1)[data-sort]").get_attribute("aria-sort") == "ascending"
    here.tab_to(".opens")
    page.keyboard.press("Space")
    assert here.focused("e => e.getAttribute('aria-expanded')") == "true"
    here.tab_to(".enlarge")
    page.keyboard.press("Enter")
    assert page.locator("dialog").is_visible()
    page.keyboard.press("Escape")
    assert not page.locator("dialog").is_visible()
    assert here.focused("e => e.className") == "enlarge"
    here.tab_to("pre")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_both_themes_can_be_read(visit, scheme):
    here = visit(scheme=scheme)
    page = here.page
    page.locator(".opens").first.click()
    back = "+getComputedStyle(document.body).backgroundColor.match(/\\d+/)[0] < 128"
    for dark in (scheme == "dark", scheme != "dark"):
        assert page.evaluate(back) is dark
        ratios = here.contrasts(TEXTS)
        assert min(ratios.values()) >= LEAST_CONTRAST, ratios
        page.locator("#theme").click()


@pytest.mark.parametrize("width", [320, 400, 760, 1000])
def test_the_page_never_scrolls_sideways(visit, width):
    page = visit(width=width).page
    for button in page.locator(".opens").all():
        button.click()
    assert page.evaluate("document.documentElement.scrollWidth") == width
    page.locator(".enlarge").first.click()
    assert page.evaluate("document.querySelector('dialog').scrollWidth") <= width


def test_paper_shows_names_and_the_details_of_what_is_worse(visit):
    page = visit(scheme="dark").page
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.locator(".slices > tbody > tr > th:visible").count() == 10
    assert page.locator(".detail:visible").count() == 1
    assert page.locator("#theme:visible, .enlarge:visible, .filter:visible").count() == 0


def test_without_the_script_everything_can_be_read(browser, small):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(small.as_uri())
    assert page.locator(".detail:visible").count() == 10
    assert page.locator("button:visible").count() == 0


def test_a_year_of_a_hundred_slices_opens(visiting, tmp_path, capsys):
    history = synthetic.history(tmp_path / "history", 365, 100)
    path = tmp_path / "report.html"
    write_page(history, None, path, synthetic.shown(MOST_PICTURES))
    page = visiting(path).page
    assert page.locator(".slices > tbody:visible").count() == 100
    loaded = page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd")
    painted = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    with capsys.disabled():
        size = path.stat().st_size / 1e6
        print(f"\n365 nights x 100 slices: {size:.2f} MB, painted after {painted:.0f} ms, loaded after {loaded:.0f} ms")
