"""An isolated network: the course of its state under constant inputs (thesis, section 2.1.3).

tau dv/dt = -v + W u + W_in phi, u = F(g (v + beta)): Eq. 2.6, in continuous time; `trajectory` is
Euler's method as in the simulator. Needs SciPy (`analysis`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..extras import needs
from .. import arguments
from ..network import Network
from ..representation import short

Floats = NDArray[np.float64]

_NEAR = 1e-6
"""Two equilibria whose rates differ by less are the same."""


@dataclass(frozen=True)
class Equilibrium:
    """An equilibrium: a state that does not change."""

    voltages: Floats
    """``[N]``"""
    rates: Floats
    """``[N]``"""
    eigenvalues: NDArray[np.complex128]
    """``[N]``: eigenvalues of the Jacobian of dv/dt there, largest real part first."""

    @property
    def is_stable(self) -> bool:
        """Whether nearby states return to it: a point attractor."""
        return bool(self.eigenvalues[0].real < 0)

    __repr__ = short


@dataclass(frozen=True)
class LimitCycle:
    """A limit cycle: states that repeat themselves."""

    period: float
    """Period in the unit of tau."""
    rates: Floats
    """``[K, N]``: K states of one period, at equal intervals of time."""

    __repr__ = short


class CTRNN:
    """The dynamics of N neurons with I inputs."""

    def __init__(
        self,
        weights: ArrayLike,
        *,
        tau: ArrayLike = 1.0,
        bias: ArrayLike = 0.0,
        gain: ArrayLike = 1.0,
        input_weights: ArrayLike | None = None,
        activations: Sequence[str] | str = "sigmoid",
    ) -> None:
        """``weights[post, pre]`` ``[N, N]``; ``input_weights[post, input]`` ``[N, I]``, the unit matrix if
        absent. The other arguments have a value per neuron, or one for all neurons. ``activations``:
        ``sigmoid``, ``tanh``, ``identity`` or ``relu``."""
        self.weights: Floats = np.array(weights, dtype=np.float64)
        n = len(self.weights)
        if self.weights.shape != (n, n):
            raise ValueError(f"weights are an array [N, N], not {list(self.weights.shape)}")
        self.input_weights: Floats = np.eye(n) if input_weights is None else np.array(input_weights, np.float64)
        self.tau, self.bias, self.gain = (np.broadcast_to(np.asarray(it, np.float64), n) for it in (tau, bias, gain))
        self.activations = [activations] * n if isinstance(activations, str) else list(activations)
        unknown = set(self.activations) - set(_ACTIVATIONS)
        if unknown or len(self.activations) != n or len(self.input_weights) != n:
            raise ValueError(f"{n} neurons need {n} activations of {sorted(_ACTIVATIONS)} and {n} rows of input weights; unknown: {sorted(unknown)}")

        self._of = {name: np.flatnonzero(np.array(self.activations) == name) for name in dict.fromkeys(self.activations)}

    def __repr__(self) -> str:
        return f"<CTRNN: {len(self.activations)} neurons, {np.shape(self.input_weights)[-1]} inputs>"

    @classmethod
    def of(cls, network: Network) -> CTRNN:
        """The dynamics of a genotype's network, ``experiment.network(genotype)``."""
        if network.description["neuron_model"] != "rate_model":
            raise ValueError(f"a network of {network.description['neuron_model']}; only rate_model has these equations")
        return cls(
            network.weights,
            tau=network.parameters["tau"],
            bias=network.parameters["bias"],
            gain=network.parameters["gain"],
            input_weights=network.input_weights,
            activations=[neuron["activation"] for neuron in network.description["neurons"]],
        )

    def rates(self, voltages: ArrayLike) -> Floats:
        """u of v, both ``[..., N]``."""
        return self._apply(np.asarray(voltages, np.float64), 0)

    def derivative(self, voltages: ArrayLike, inputs: ArrayLike) -> Floats:
        """dv/dt ``[N]`` for v ``[N]`` and phi ``[I]``."""
        v = np.asarray(voltages, np.float64)
        drive = self.weights @ self.rates(v) + self.input_weights @ np.asarray(inputs, np.float64)
        return np.asarray((drive - v) / self.tau)

    def jacobian(self, voltages: ArrayLike) -> Floats:
        """The derivative of dv/dt with respect to v, ``[N, N]``."""
        slopes = self.gain * self._apply(np.asarray(voltages, np.float64), 1)
        return np.asarray((self.weights * slopes - np.eye(len(self.tau))) / self.tau[:, np.newaxis])

    def trajectory(self, inputs: ArrayLike, *, dt: float = 0.1, start: ArrayLike | None = None) -> Floats:
        """v ``[K + 1, N]`` from ``start`` (0 if absent), one Euler step (Eq. 2.9) per row of ``inputs`` ``[K, I]``."""
        n = len(self.tau)
        rows = np.asarray(inputs, np.float64)
        states = np.empty((len(rows) + 1, n))
        states[0] = 0.0 if start is None else start
        for step, phi in enumerate(rows):
            states[step + 1] = states[step] + dt * self.derivative(states[step], phi)
        return states

    def equilibria(self, inputs: ArrayLike, *, starts: int = 200, seed: int = 0) -> list[Equilibrium]:
        """The equilibria found from ``starts`` random rates, stable ones first; there may be
        more."""
        starts = arguments.whole(starts, "starts", 1)
        seed = arguments.whole(seed, "seed", 0)
        with needs("analysis"):
            from scipy.optimize import root

        rng = np.random.default_rng(seed)
        phi = np.asarray(inputs, np.float64)
        found: list[Equilibrium] = []
        for _ in range(starts):
            begin = self.weights @ rng.random(len(self.tau)) + self.input_weights @ phi
            it = root(self.derivative, begin, args=(phi,), jac=lambda v, _: self.jacobian(v), tol=1e-12)
            if not it.success or np.abs(self.derivative(it.x, phi)).max() > 1e-8:
                continue
            if all(np.abs(self.rates(it.x) - known.rates).max() > _NEAR for known in found):
                found.append(self.equilibrium(it.x))
        return sorted(found, key=lambda it: it.eigenvalues[0].real)

    def attractor(
        self, inputs: ArrayLike, *, start: ArrayLike | None = None, time: float | None = None
    ) -> Equilibrium | LimitCycle | None:
        """The attractor that the state reaches from ``start`` (0 if absent) under constant inputs: None if,
        after ``time`` (400 of the slowest neuron's tau if absent), it neither rests nor repeats itself."""
        with needs("analysis"):
            from scipy.integrate import solve_ivp
            from scipy.optimize import root

        phi = np.asarray(inputs, np.float64)
        slowest = float(self.tau.max())
        time = 400 * slowest if time is None else time
        begin = np.zeros(len(self.tau)) if start is None else np.asarray(start, np.float64)

        def flow(_: float, v: Floats) -> Floats:
            return self.derivative(v, phi)

        settings = {"method": "LSODA", "rtol": 1e-9, "atol": 1e-10}
        there = solve_ivp(flow, (0, time), begin, **settings).y[:, -1]
        rest = root(self.derivative, there, args=(phi,), jac=lambda v, _: self.jacobian(v), tol=1e-12)
        if rest.success and np.abs(rest.x - there).max() < 1e-4 and self.equilibrium(rest.x).is_stable:
            return self.equilibrium(rest.x)
        # A section through the neuron that moves most: a cycle returns to the same point.
        span = solve_ivp(flow, (0, time), there, dense_output=True, **settings)
        course = span.sol(np.linspace(0, time, 8000))
        mover = int(np.argmax(np.ptp(course, axis=1)))
        level = float(course[mover].mean())

        def crossing(_: float, v: Floats) -> float:
            return float(v[mover] - level)

        crossing.direction = 1  # type: ignore[attr-defined]
        events = solve_ivp(flow, (0, time), there, events=crossing, **settings)
        times, points = events.t_events[0], events.y_events[0]
        if np.ptp(course[mover]) < 1e-6 or len(times) < 2:
            return None
        last = points[-1]
        for rounds in range(1, len(times)):
            if np.abs(points[-1 - rounds] - last).max() < 1e-5:
                once = np.linspace(times[-1 - rounds], times[-1], 200, endpoint=False)
                return LimitCycle(float(times[-1] - times[-1 - rounds]), self.rates(span.sol(once).T))
        return None

    def follow(self, inputs: ArrayLike) -> list[Equilibrium | LimitCycle | None]:
        """The attractor for each row of ``inputs`` ``[K, I]``, each reached from the previous one. It
        shows how an attractor moves, and where it changes its kind (Fig. 2.3)."""
        found: list[Equilibrium | LimitCycle | None] = []
        start: Floats = np.zeros(len(self.tau))
        for phi in np.asarray(inputs, np.float64):
            it = self.attractor(phi, start=start)
            found.append(it)
            if isinstance(it, Equilibrium):
                start = it.voltages
        return found

    def equilibrium(self, voltages: Floats) -> Equilibrium:
        """The equilibrium at a state ``[N]`` with dv/dt = 0."""
        values = np.linalg.eigvals(self.jacobian(voltages)).astype(np.complex128)
        return Equilibrium(voltages, self.rates(voltages), values[np.argsort(-values.real)])

    def _apply(self, voltages: Floats, derivative: int) -> Floats:
        z = self.gain * (voltages + self.bias)
        result = np.empty_like(z)
        for name, neurons in self._of.items():
            result[..., neurons] = _ACTIVATIONS[name][derivative](z[..., neurons])
        return result


def _sigmoid(z: Floats) -> Floats:
    return np.asarray(0.5 * (1 + np.tanh(z / 2)))


_ACTIVATIONS: dict[str, tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]] = {
    "sigmoid": (_sigmoid, lambda z: _sigmoid(z) * (1 - _sigmoid(z))),
    "tanh": (np.tanh, lambda z: 1 - np.tanh(z) ** 2),
    "identity": (lambda z: z, np.ones_like),
    "relu": (lambda z: np.maximum(z, 0), lambda z: (z > 0).astype(float)),
}
