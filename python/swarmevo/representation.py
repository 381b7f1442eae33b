"""The one-line representation of results with arrays."""

from __future__ import annotations

import reprlib
from typing import Any

import numpy as np

LENGTH_MAX = 200


def short(self: Any) -> str:
    """The class and attributes of an object, with the shape of arrays and the length of long lists."""
    parts = [f"{name}={_short(value)}" for name, value in vars(self).items() if not name.startswith("_")]
    text = ", ".join(parts)
    return f"<{type(self).__name__}: {text if len(text) <= LENGTH_MAX else text[: LENGTH_MAX - 3] + '...'}>"


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {list(value.shape)}" if value.ndim else repr(value.item())
    if isinstance(value, (float, np.floating)):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple, dict, range)) and len(value) > 4:
        return f"{type(value).__name__} of {len(value)}"
    return reprlib.repr(value)
