"""Progress bars."""

from __future__ import annotations

from typing import Iterable, Iterator, TypeVar

Item = TypeVar("Item")


def shown(
    items: Iterable[Item], name: str, progress: bool, total: int | None = None, initial: int = 0
) -> Iterator[Item]:
    """Iterates over ``items``; tqdm, if installed and requested, shows the progress."""
    if progress:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            pass
        else:
            items = tqdm(items, desc=name, unit="generation", total=total, initial=initial)
    yield from items
