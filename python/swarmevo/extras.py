"""What of other packages is needed, and how to get it."""

from __future__ import annotations

from contextlib import contextmanager
from typing import Iterator

PACKAGES = {
    "analysis": ("scipy",),
    "data": ("pandas", "polars", "pyarrow"),
    "fleet": ("grpc", "google"),
    "network": ("networkx",),
    "plot": ("matplotlib",),
    "steps": ("gymnasium", "pettingzoo"),
}
"""Packages that are imported, by the extra that brings them."""


@contextmanager
def needs(extra: str) -> Iterator[None]:
    """Imports packages of an extra; if one is missing, the ModuleNotFoundError says how to install it."""
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
