"""The report in a browser: sorted, filtered, opened by mouse and by keyboard alone, dark, narrow, off the network."""

import functools

import pytest

from pipelines.report.page import REPORT
from tests.pipelines.pages.browsing import LEAST_CONTRAST

pytestmark = pytest.mark.full

TEXTS = (
    "h1", ".word b", ".word span", ".of span", ".facts li", ".muted", ".in", "figcaption", "output", "code", "pre",
    "thead th button", ".detail dt", ".cards > caption", "summary", ".figure > figcaption", "footer",
)  # fmt: skip
SETTINGS = "#poses-table > tbody:not(.out) > tr > th"


@pytest.fixture
def visit(visiting, reported):
    """Open the report of two frames."""
    return functools.partial(visiting, reported / REPORT)


def _settings(page):
    return page.eval_on_selector_all(SETTINGS, "all => all.map(e => e.dataset.value)")


def test_the_poses_sort(visit):
    page = visit().page
    first = _settings(page)
    assert len(set(first)) == 5
    head = page.locator("#poses-table th:nth-child(1)[data-sort]")
    for state, wanted in (("ascending", sorted(first)), ("descending", sorted(first, reverse=True))):
        head.locator("button").click()
        assert head.get_attribute("aria-sort") == state
        assert _settings(page) == wanted
    page.locator("#poses-table th:nth-child(5)[data-sort] button").click()
    cells = "#poses-table > tbody > tr > td:nth-child(5)"
    sizes = page.eval_on_selector_all(cells, "all => all.map(e => +e.dataset.value)")
    assert sizes == sorted(sizes, reverse=True)  # the largest first
    assert page.locator("#poses-table [aria-sort]").count() == 1
    page.locator("#poses-table th:nth-child(6)[data-sort] button").click()
    stated = page.eval_on_selector_all(
        "#poses-table > tbody > tr > td:nth-child(6)", "all => all.map(e => e.dataset.value)"
    )
    assert "" not in stated[: len([value for value in stated if value])]  # settings that state none come last


def test_the_poses_filter(visit):
    page = visit().page
    form = page.locator("form[data-table=poses-table]")
    form.locator("[name=words]").fill("BEST truth")
    assert _settings(page) == ["best truth exact all"]
    assert form.locator("output").inner_text() == "1 of 5 shown"
    form.locator("[name=words]").fill("")
    form.locator("[name=kind]").select_option(label="eposit detected nominal four")
    assert _settings(page) == ["eposit detected nominal four"]


def test_a_row_opens_to_every_component(visit):
    page = visit().page
    detail = page.locator("#poses-table .detail").first
    assert not detail.is_visible()
    page.locator("#poses-table .opens").first.click()
    assert detail.is_visible()
    assert detail.locator("tbody tr").count() == 9
    page.locator("#poses-table .opens").first.click()
    assert not detail.is_visible()


def test_a_frame_opens_large_and_its_command_names_the_folder(visit, reported):
    page = visit().page
    for code in page.locator(".command").all():
        assert f" frame {reported} " in code.inner_text()
    small = page.locator("section[aria-labelledby=worst] .sides svg").first.bounding_box()
    page.locator("section[aria-labelledby=worst] .sides").first.click()
    dialog = page.locator("dialog")
    assert dialog.locator(".sides svg").bounding_box()["width"] > 2.0 * small["width"]
    assert "The bar is an error of " in dialog.inner_text()
    page.locator("dialog button").click()
    assert not dialog.is_visible()


def test_pictures_are_large_enough_to_see_residuals(visit):
    """Half the page, and most arrows at least a tenth of the shown picture: 40 px."""
    page = visit().page
    shown = page.locator("section[aria-labelledby=pictures] .sides svg").first
    assert shown.bounding_box()["width"] > 400
    size = page.evaluate("document.querySelector('.arrow').getBoundingClientRect().width")
    assert size > 40


def test_the_keyboard_alone_is_enough(visit):
    here = visit()
    page = here.page
    page.keyboard.press("Tab")
    assert here.focused("e => e.className") == "skip"
    here.tab_to("#theme")
    here.tab_to(".enlarge")
    page.keyboard.press("Enter")
    assert page.locator("dialog").is_visible()
    page.keyboard.press("Escape")
    assert here.focused("e => e.className") == "enlarge"
    here.tab_to("#poses-table th[data-sort] button")
    page.keyboard.press("Enter")
    assert page.locator("#poses-table th").first.get_attribute("aria-sort") == "ascending"
    here.tab_to("#poses-table .opens")
    page.keyboard.press("Space")
    assert here.focused("e => e.getAttribute('aria-expanded')") == "true"
    here.tab_to("summary")
    here.tab_to("pre")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_both_themes_can_be_read(visit, scheme):
    here = visit(scheme=scheme)
    page = here.page
    for button in page.locator(".opens").all():
        button.click()
    back = "+getComputedStyle(document.body).backgroundColor.match(/\\d+/)[0] < 128"
    for dark in (scheme == "dark", scheme != "dark"):
        assert page.evaluate(back) is dark
        ratios = here.contrasts(TEXTS)
        assert min(ratios.values()) >= LEAST_CONTRAST, ratios
        ticks = page.evaluate("getComputedStyle(document.querySelector('.drawing text')).fill")
        assert ticks == page.evaluate("getComputedStyle(document.body).color")
        page.locator("#theme").click()


@pytest.mark.parametrize("width", [320, 400, 760, 1000, 1280])
def test_the_page_never_scrolls_sideways(visit, width):
    page = visit(width=width).page
    for button in page.locator(".opens").all():
        button.click()
    page.evaluate("for (const each of document.querySelectorAll('details')) each.open = true")
    assert page.evaluate("document.documentElement.scrollWidth") == width
    page.locator(".enlarge").first.click()
    assert page.evaluate("document.querySelector('dialog').scrollWidth") <= width


def test_paper_shows_what_is_folded_away(visit):
    page = visit(scheme="dark").page
    assert page.locator("details[open]").count() == 1
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.locator("details[open]").count() == 5
    assert page.locator("#theme:visible, .enlarge:visible, .filter:visible").count() == 0
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.locator("details[open]").count() == 1


def test_without_the_script_everything_can_be_read(browser, reported):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((reported / REPORT).as_uri())
    assert page.locator("#poses-table .detail:visible").count() == 5
    assert page.locator("button:visible").count() == 0
