"""A browser, for the pages."""

from __future__ import annotations

import os
import shutil

import pytest

from tests.pipelines.pages.browsing import Visit


@pytest.fixture(scope="session")
def browser():
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        pytest.fail("playwright is missing; `make test-full` installs it")
    names = ("chromium", "chromium-browser", "google-chrome")
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        pytest.fail("no Chromium is installed; `apt-get install chromium` on Debian")
    with sync_playwright() as started:
        # A browser's own sandbox does not run as root, as in a container.
        one = started.chromium.launch(executable_path=path, chromium_sandbox=os.geteuid() != 0)
        yield one
        one.close()


@pytest.fixture
def visiting(browser):
    """Open a page; at the end of the test nothing has been said on the console, and nothing loaded."""
    visits = []

    def opened(path, width=1280, scheme="light"):
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme, offline=True)
        new = Visit(context.new_page())
        new.page.on("console", lambda message: new.said.append(message.text))
        new.page.on("pageerror", lambda error: new.said.append(str(error)))
        new.page.on("request", lambda request: new.asked.append(request.url))
        new.page.goto(path.as_uri())
        visits.append((new, path))
        return new

    yield opened
    for each, path in visits:
        assert each.said == []
        assert [url for url in each.asked if not url.startswith("data:")] == [path.as_uri()]
