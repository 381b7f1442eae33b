"""The player, in a notebook."""

from __future__ import annotations

import html as html_module
from dataclasses import dataclass


@dataclass(frozen=True)
class Replay:
    """An episode with the player. Notebooks display it."""

    html: str
    """A whole page, which loads nothing from other servers."""
    height: int = 800
    """Height of the frame in a notebook, in pixels."""

    def _repr_html_(self) -> str:
        page = html_module.escape(self.html, quote=True)
        return (
            f'<iframe srcdoc="{page}" sandbox="allow-scripts" '
            f'style="width: 100%; height: {self.height}px; border: 0"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<Replay: {len(self.html)} characters of HTML>"
