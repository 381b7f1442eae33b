"""A report as one HTML file, with its tables as CSV beside it."""

from __future__ import annotations

import csv
import html
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 56rem; margin: 2rem auto; padding: 0 1rem; color: #1a1a1a; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
table { border-collapse: collapse; margin: 0.8rem 0; font-variant-numeric: tabular-nums; display: block; overflow-x: auto; }
th, td { padding: 0.2rem 0.9rem 0.2rem 0; text-align: right; border-bottom: 1px solid #ddd; }
th:first-child, td:first-child { text-align: left; } td + td { white-space: nowrap; } th { font-weight: 600; }
svg { max-width: 100%; height: auto; } p.note { color: #555; }
@media (prefers-color-scheme: dark) { body { background: #16181c; color: #e8e8e8; } th, td { border-color: #333; }
  p.note { color: #aaa; } figure { background: #fff; } }
figure { margin: 0.8rem 0; }
"""


class Page:
    """The content of a report, in order."""

    def __init__(self, title: str, directory: Path) -> None:
        self.title = title
        self.directory = directory
        self._body: list[str] = []
        directory.mkdir(parents=True, exist_ok=True)

    def heading(self, text: str) -> None:
        self._body.append(f"<h2>{html.escape(text)}</h2>")

    def text(self, text: str) -> None:
        self._body.append(f"<p>{html.escape(text)}</p>")

    def note(self, text: str) -> None:
        """A note that explains the table or figure above it."""
        self._body.append(f'<p class="note">{html.escape(text)}</p>')

    def sentences(self, name: str, sentences: Sequence[str]) -> None:
        """A list, also written to ``NAME.txt``."""
        (self.directory / f"{name}.txt").write_text("\n".join(sentences) + "\n", encoding="utf-8")
        self._body.append(f"<ul>{''.join(f'<li>{html.escape(it)}</li>' for it in sentences)}</ul>")

    def table(self, name: str, head: Sequence[str], rows: Iterable[Sequence[object]], shown: int | None = None) -> None:
        """A table, also written to ``NAME.csv``; the page has its first ``shown`` rows, all if absent."""
        cells = [[_text(cell) for cell in row] for row in rows]
        with open(self.directory / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([list(head), *cells])
        lines = ["".join(f"<td>{html.escape(cell)}</td>" for cell in row) for row in cells[:shown]]
        heads = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
        body = "".join(f"<tr>{line}</tr>" for line in lines)
        self._body.append(f"<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>")

    def figure(self, figure: Figure) -> None:
        """A figure of Matplotlib, as SVG within the page."""
        file = io.StringIO()
        # Without a date and with counted names, the same report gives the same file.
        figure.savefig(file, format="svg", bbox_inches="tight", metadata={"Date": None})
        svg = file.getvalue()
        self._body.append(f"<figure>{svg[svg.index('<svg') :]}</figure>")

    def write(self) -> Path:
        """Writes ``report.html`` and returns its path."""
        title = html.escape(self.title)
        path = self.directory / "report.html"
        path.write_text(
            f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>'
            f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style>'
            f"<h1>{title}</h1>{''.join(self._body)}</html>\n",
            encoding="utf-8",
        )
        return path


def _text(cell: object) -> str:
    return f"{cell:.3f}" if isinstance(cell, float) else str(cell)
