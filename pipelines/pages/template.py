"""Pages from templates: the one Jinja environment, with the shared look and script."""

from __future__ import annotations

import base64
import functools
import hashlib
from pathlib import Path

import jinja2

from pipelines.pages import numbers
from pipelines.pages.sections import Drawing

FOLDER = Path(__file__).parent
LAYOUT, PIECES = "layout.html", "pieces.html"  # which a page's template extends, and takes its parts from


def rendered(template: Path, **values: object) -> str:
    """The page of a template, which extends `layout.html`; what it is given is escaped but for what it marks as safe.

    A style sheet of the template's name beside it is added to the shared one.
    """
    return _compiled(template).render(**values)


@functools.cache  # a night writes its page several times, and compiling takes longer than filling in
def _compiled(template: Path) -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.FileSystemLoader(template.parent), jinja2.FileSystemLoader(FOLDER)]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    own = template.with_suffix(".css")
    sheets = [FOLDER / "page.css", *([own] if own.exists() else [])]
    style = "\n".join(sheet.read_text(encoding="utf-8") for sheet in sheets)
    script = (FOLDER / "page.js").read_text(encoding="utf-8")
    environment.globals |= {"style": style, "script": script, "policy": _policy(style, script)}
    environment.filters |= {
        "sensible": numbers.sensible,
        "interval": numbers.with_interval,
        "share": numbers.share,
    }
    environment.tests["drawing"] = lambda item: isinstance(item, Drawing)
    return environment.get_template(template.name)


def _policy(style: str, script: str) -> str:
    """Content security policy: nothing is loaded, and only this page's own style and script are used."""
    digests = (hashlib.sha256(text.encode()).digest() for text in (style, script))
    of_style, of_script = (f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    return (
        f"default-src 'none'; style-src {of_style}; script-src {of_script}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
