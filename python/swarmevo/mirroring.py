"""Genes of optimisers without bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import arguments


def mirror(x: ArrayLike) -> NDArray[np.float64]:
    """Maps ``x`` to [0, 1] by reflection at both ends, as the algorithms here do with their
    samples. Some optimisers are slow with bounds, or hang: give them none, and mirror their
    samples.

    >>> mirror([-0.25, 0.5, 1.25, 2.5]).tolist()
    [0.25, 0.5, 0.75, 0.5]
    """
    folded: NDArray[Any] = np.abs(arguments.numbers(x, "x"))
    folded = folded - 2.0 * np.floor(folded / 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)
