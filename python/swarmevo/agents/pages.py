"""Pages of the manual that agents need; files of ``docs/`` that are part of the package."""

from __future__ import annotations

import re
from pathlib import Path

from .. import arguments
from .failures import Failure

FOLDER = Path(__file__).parent / "manual"
HEADING = re.compile(r"^#{1,3} (.+)$", re.MULTILINE)
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def names() -> list[str]:
    """The pages' names."""
    return sorted(it.stem for it in FOLDER.glob("*.md"))


def text(page: str) -> str:
    """A page."""
    try:
        arguments.known([page], names(), "page")
    except ValueError as error:
        raise Failure("not_found", "section", str(error), "docs() lists pages and sections") from None
    return (FOLDER / f"{page}.md").read_text(encoding="utf-8")


def contents() -> dict[str, list[str]]:
    """The sections of every page."""
    return {page: [anchor(title) for title, _ in sections(text(page))[1:]] for page in names()}


def section(name: str) -> tuple[str, list[str]]:
    """The text of ``page`` or ``page#section``, and the next steps. A page without a section is its
    beginning, up to its second heading."""
    page, _, wanted = name.partition("#")
    found = sections(text(page))
    anchors = [anchor(title) for title, _ in found]
    if not wanted:
        steps = [f"docs(section=\"{page}#{it}\")" for it in anchors[1:3]]
        others = ["another of its sections: " + ", ".join(anchors[3:])] if len(anchors) > 3 else []
        return found[0][1], steps + others or ["docs() lists all pages"]
    try:
        arguments.known([wanted], anchors[1:], f"section of `{page}`")
    except ValueError as error:
        raise Failure("not_found", "section", str(error), "give one of these sections") from None
    at = anchors.index(wanted)
    return found[at][1], [f"docs(section=\"{page}#{it}\")" for it in anchors[at + 1 : at + 2]] or ["docs() lists all pages"]


def sections(body: str) -> list[tuple[str, str]]:
    """Titles and texts of the sections of a page. Comments in examples are no headings."""
    hidden = FENCE.sub(lambda it: re.sub("[^\n]", " ", it[0]), body)
    starts = [it.start() for it in HEADING.finditer(hidden)]
    titles = [it[1] for it in HEADING.finditer(hidden)]
    ends = [*starts[1:], len(body)]
    return [(title, body[start:end].strip()) for title, start, end in zip(titles, starts, ends)]


def anchor(title: str) -> str:
    """The name of a section in links."""
    return re.sub(r"[^\w -]", "", title.lower()).strip().replace(" ", "-")
