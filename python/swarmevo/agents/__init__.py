"""A server by which agents experiment with robot swarms (Model Context Protocol): ``swarmevo-mcp``.

Its tools call this package and ``swarmctl``; ``docs/agents.md`` of the project explains them.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..extras import needs

if TYPE_CHECKING:
    from .serving import Server

__all__ = ["server"]


def server(directory: str | Path, *, coordinator: str | None = None, allow_submit: bool = False, allow_control: bool = False) -> Server:
    """A server, for a program that serves it in its own way. ``directory``: the only one in which calls
    read and write files. ``coordinator``: the address of a fleet."""
    with needs("agents"):
        from . import serving
    return serving.server(directory, coordinator=coordinator, allow_submit=allow_submit, allow_control=allow_control)
