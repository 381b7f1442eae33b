"""The movement of a network's equilibria while an input changes, and their bifurcations.

Pseudo-arclength continuation (Keller 1977; Kuznetsov, Elements of Applied Bifurcation Theory 2004, chapter
10): the method follows a branch along its own length, so also around folds. It locates points where real
parts of eigenvalues change their sign: a pair of complex eigenvalues is a Hopf bifurcation, a single real
one a fold.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..extras import needs
from .. import arguments
from .ctrnn import CTRNN, Equilibrium
from ..representation import short

Floats = NDArray[np.float64]

_TOLERANCE = 1e-10
"""Tolerance of dv/dt at an equilibrium."""
_SAME = 1e-4
"""Two equilibria at one end are the same if their rates differ by less."""


@dataclass(frozen=True)
class Bifurcation:
    """A point of a branch at which its equilibria change their kind."""

    kind: Literal["hopf", "fold"]
    """The kind: a limit cycle begins there, or two equilibria meet."""
    share: float
    """The position on the way from the first inputs to the last, in [0, 1]."""
    equilibrium: Equilibrium
    """The equilibrium there: the real parts of one or two of its eigenvalues are 0."""
    period: float
    """Period of the new cycle, 2 pi / the imaginary part, in the unit of tau; NaN for a fold."""

    __repr__ = short


@dataclass(frozen=True)
class Branch:
    """A curve of equilibria: K points in the order of its length."""

    shares: Floats
    """``[K]``: positions on the way from the first inputs to the last, in [0, 1]."""
    voltages: Floats
    """``[K, N]``"""
    rates: Floats
    """``[K, N]``"""
    eigenvalues: NDArray[np.complex128]
    """``[K, N]``: largest real part first."""
    bifurcations: list[Bifurcation]
    """In the order of the branch."""

    @property
    def stable(self) -> NDArray[np.bool_]:
        """``[K]``: whether each of its points attracts."""
        return np.asarray(self.eigenvalues[:, 0].real < 0)

    __repr__ = short


def continuation(
    network: CTRNN, first: ArrayLike, last: ArrayLike, *, starts: int = 200, max_step: float = 0.02, max_points: int = 20_000
) -> list[Branch]:
    """The equilibria of ``network`` while its inputs move in a straight line from ``first`` to ``last``, both
    ``[I]``.

    Branches begin at the equilibria that ``starts`` random searches find at either end: a closed branch,
    which reaches neither end, is not found. ``max_step``: the maximum step length, over shares of the way and
    voltages together. Raises ``ValueError`` if a branch takes more than ``max_points``.
    """
    starts = arguments.whole(starts, "starts", 1)
    max_points = arguments.whole(max_points, "max_points", 1)
    begin, end = np.asarray(first, np.float64), np.asarray(last, np.float64)
    path = _Path(network, begin, end - begin)
    ends = [(share, it) for share in (0.0, 1.0) for it in network.equilibria(path.inputs(share), starts=starts)]
    branches: list[Branch] = []
    for share, it in ends:
        if not any(_ends_at(branch, share, it) for branch in branches):
            branches.append(_branch(path, share, it, max_step, max_points))
    return branches


@dataclass(frozen=True)
class _Path:
    """Equilibria x = (v, s): dv/dt is 0 for the inputs at the share s of the way."""

    network: CTRNN
    first: Floats
    change: Floats

    def inputs(self, share: float) -> Floats:
        return self.first + share * self.change

    def derivative(self, x: Floats) -> Floats:
        return self.network.derivative(x[:-1], self.inputs(float(x[-1])))

    def slopes(self, x: Floats) -> Floats:
        """``[N, N + 1]``: the derivative of dv/dt with respect to v and s."""
        by_share = self.network.input_weights @ self.change / self.network.tau
        return np.column_stack([self.network.jacobian(x[:-1]), by_share])

    def tangent(self, x: Floats, towards: Floats) -> Floats:
        """The direction of the branch at ``x`` that has an acute angle with ``towards``."""
        direction = np.linalg.svd(self.slopes(x))[2][-1]
        return np.asarray(direction if direction @ towards >= 0 else -direction)

    def step(self, x: Floats, tangent: Floats, length: float) -> tuple[Floats, int] | None:
        """The point of the branch whose projection on ``tangent`` is ``length`` ahead of ``x``, by Newton's
        method, with its number of steps."""
        ahead = x + length * tangent
        found = ahead.copy()
        for n in range(1, 12):
            wrong = np.append(self.derivative(found), tangent @ (found - ahead))
            if np.abs(wrong).max() < _TOLERANCE:
                return (found, n) if np.linalg.norm(found - ahead) < 2 * length else None
            try:
                found = found - np.linalg.solve(np.vstack([self.slopes(found), tangent]), wrong)
            except np.linalg.LinAlgError:
                return None
        return None

    def equilibrium(self, x: Floats) -> Equilibrium:
        return self.network.equilibrium(x[:-1])


def _branch(path: _Path, share: float, start: Equilibrium, max_step: float, max_points: int) -> Branch:
    points = [np.append(start.voltages, share)]
    kinds = [start]
    found: list[Bifurcation] = []
    inwards = np.zeros(len(points[0]))
    inwards[-1] = 1.0 if share == 0 else -1.0
    tangent = path.tangent(points[0], inwards)
    length = max_step / 4
    while 0 <= points[-1][-1] <= 1:
        if len(points) > max_points:
            raise ValueError(f"a branch of more than {max_points} points; increase max_points or max_step")
        there = path.step(points[-1], tangent, length)
        onwards = None if there is None else path.tangent(there[0], tangent)
        # A sharp bend may be a jump to another branch: try a shorter step.
        if there is None or onwards is None or onwards @ tangent < 0.9:
            length /= 2
            if length < 1e-9:
                raise ValueError(f"the branch cannot be followed beyond {points[-1][-1]:.6g} of the way")
            continue
        points.append(there[0])
        kinds.append(path.equilibrium(there[0]))
        found.extend(_crossings(path, points[-2], tangent, length, kinds[-2], kinds[-1]))
        tangent = onwards
        length = min(max_step, length * (1.5 if there[1] <= 4 else 0.8))
    shares = np.array([x[-1] for x in points])
    inside = [it for it in found if 0 <= it.share <= 1]
    _to_the_end(path, points, kinds, shares)
    return Branch(
        shares, np.stack([it.voltages for it in kinds]), np.stack([it.rates for it in kinds]),
        np.stack([it.eigenvalues for it in kinds]), inside,
    )


def _to_the_end(path: _Path, points: list[Floats], kinds: list[Equilibrium], shares: Floats) -> None:
    """Moves the last point, which lies beyond the end of the way, to that end."""
    with needs("analysis"):
        from scipy.optimize import root

    shares[-1] = min(1.0, max(0.0, shares[-1]))
    phi = path.inputs(float(shares[-1]))
    network = path.network
    it = root(network.derivative, points[-1][:-1], args=(phi,), jac=lambda v, _: network.jacobian(v), tol=1e-12)
    if it.success:
        kinds[-1] = network.equilibrium(it.x)


def _crossings(
    path: _Path, x: Floats, tangent: Floats, length: float, before: Equilibrium, after: Equilibrium
) -> Iterator[Bifurcation]:
    """The bifurcations within a step, by bisection on the number of eigenvalues with a positive real part."""
    low, unstable = 0.0, _unstable(before)
    while unstable != _unstable(after):
        high = length
        at = after
        while high - low > 1e-12 * max(1.0, length):
            middle = (low + high) / 2
            if middle in (low, high):
                break
            there = path.step(x, tangent, middle)
            if there is None:
                return
            between = path.equilibrium(there[0])
            if _unstable(between) == unstable:
                low = middle
            else:
                high, at = middle, between
        low, unstable = high, _unstable(at)
        there = path.step(x, tangent, high)
        if there is None:
            return
        nearest = at.eigenvalues[np.argmin(np.abs(at.eigenvalues.real))]
        turn = abs(float(nearest.imag))
        # A real eigenvalue passes through 0 where two equilibria meet.
        is_hopf = turn > 1e-6
        yield Bifurcation("hopf" if is_hopf else "fold", float(there[0][-1]), at, 2 * np.pi / turn if is_hopf else np.nan)


def _unstable(it: Equilibrium) -> int:
    return int((it.eigenvalues.real > 0).sum())


def _ends_at(branch: Branch, share: float, it: Equilibrium) -> bool:
    ends = ((branch.shares[0], branch.rates[0]), (branch.shares[-1], branch.rates[-1]))
    return any(at == share and np.abs(rates - it.rates).max() < _SAME for at, rates in ends)
