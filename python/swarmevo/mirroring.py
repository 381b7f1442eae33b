"""Genes of optimisers without bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import arguments


def mirror(x: ArrayLike) -> NDArray[np.float64]:
    """``x`` in [0, 1], by reflection at both ends: what the algorithms here do with what
    they draw. Some optimisers are slow with bounds, or hang; give them none, and mirror what
    they ask for.

    >>> mirror([-0.25, 0.5, 1.25, 2.5]).tolist()
    [0.25, 0.5, 0.75, 0.5]
    """
    folded: NDArray[Any] = np.abs(arguments.numbers(x, "x"))
    folded = folded - 2.0 * np.floor(folded / 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)
