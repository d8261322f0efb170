"""A dataset in the folder of another: the report of the outer one shows it."""

import shutil

import pytest

from datasets.store.dataset import open_dataset
from pipelines.report.page import REPORT, write_report
from tests.pipelines.pages.parsed import Page, assert_named_for_a_screen_reader


@pytest.mark.usefixtures("no_figures")
def test_a_dataset_in_the_folder_is_shown_and_linked(root, tmp_path):
    outer = tmp_path / "outer"
    shutil.copytree(root, outer)
    shutil.copytree(root, outer / "room")
    shutil.copytree(root, outer / "unfinished")  # without a report
    (outer / "room" / REPORT).write_text("a report")
    text = write_report(open_dataset(outer)).read_text()
    page = Page(text)
    assert [item.text for item in page.of("h2") if "Beside" in item.text] == ["Beside it: room"]
    assert [item.attributes["href"] for item in page.of("a") if "Its own report" in item.text] == [f"room/{REPORT}"]
    pictures = page.of("img")
    assert [item.attributes["alt"].split(",")[0] for item in pictures] == [open_dataset(root).recipe.cameras[0].name]
    assert all(item.attributes["src"].startswith("data:image/jpeg;base64,") for item in pictures)
    assert_named_for_a_screen_reader(page)
