"""Optional packages, and the commands to install them."""

from __future__ import annotations

from contextlib import contextmanager
from typing import Iterator

PACKAGES = {
    "agents": ("mcp",),
    "analysis": ("scipy",),
    "data": ("pandas", "polars", "pyarrow"),
    "fleet": ("grpc", "google"),
    "network": ("networkx",),
    "plot": ("matplotlib",),
    "ribs": ("ribs",),
    "steps": ("gymnasium", "pettingzoo"),
}
"""Imported packages, by the extra that installs them."""


@contextmanager
def needs(extra: str) -> Iterator[None]:
    """Imports packages of an extra; if one is missing, the ModuleNotFoundError names the command to
    install it."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in PACKAGES[extra]:
            raise
        raise ModuleNotFoundError(
            f"this needs the package {package!r}, which is not installed: pip install 'swarmevo[{extra}]'",
            name=error.name, path=error.path,
        ) from None
