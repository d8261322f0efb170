"""The pages: links lead somewhere, the reference follows the code, nothing is loaded from the network."""

import importlib.util
import re
import subprocess
import sys
from html.parser import HTMLParser

import pytest

from datasets.recipe.model import describe, recipe_names
from datasets.schema import TABLES
from pipelines.cli import COMMANDS, NIGHTLY_COMMANDS, all_commands
from tests.docs.documents import DOCUMENTS, ROOT
from tools import reference

LOADS = {"script": "src", "img": "src", "iframe": "src", "source": "src", "link": "href"}


def test_links_between_documents_lead_somewhere():
    for path in DOCUMENTS:
        for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", path.read_text()):
            if "://" not in link and "_generated" not in link:
                assert (path.parent / link).exists(), f"{path.relative_to(ROOT)}: {link}"


def test_the_reference_has_every_command_option_key_and_column():
    commands, keys, tables = reference.commands(), reference.recipe_keys(), reference.tables()
    for name in all_commands():
        assert f"## {name}\n" in commands
    for _, example in (*COMMANDS, *NIGHTLY_COMMANDS):
        assert f"python -m pipelines {example}" in commands
    assert "`--overwrite`" in commands
    assert all(f"`{key}`" in keys for key, _, _ in describe())
    assert all(f"`{name}`" in reference.recipes() for name in recipe_names())
    assert all(f"`{field.name}`" in tables for schema in TABLES.values() for field in schema)
    assert "`beyond_90_degrees`" in reference.library()


class Loaded(HTMLParser):
    """Addresses that a browser loads to show a page."""

    def __init__(self):
        super().__init__()
        self.addresses = []

    def handle_starttag(self, tag, attrs):
        if tag in LOADS:
            self.addresses += [value or "" for name, value in attrs if name == LOADS[tag]]


@pytest.mark.full
@pytest.mark.skipif(importlib.util.find_spec("sphinx") is None, reason="needs the extra `docs`")
def test_pages_build_without_warnings_and_load_nothing_from_the_network(tmp_path):
    options = ["--quiet", "--fail-on-warning", "--keep-going", "-d", str(tmp_path / "doctrees")]
    build = [sys.executable, "-m", "sphinx", *options, str(ROOT / "docs"), str(tmp_path / "pages")]
    done = subprocess.run(build, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    pages = list((tmp_path / "pages").rglob("*.html"))
    assert len(pages) >= len(list((ROOT / "docs").rglob("*.md")))
    for page in pages:
        loaded = Loaded()
        loaded.feed(page.read_text())
        assert loaded.addresses, page
        assert [address for address in loaded.addresses if "//" in address] == [], page
    for sheet in (tmp_path / "pages").rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", sheet.read_text()), sheet
