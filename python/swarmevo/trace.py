"""Traces: all recorded values of episodes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import arguments
from .extras import needs
from .replay import Replay
from .trials import TRIALS_MAX

if TYPE_CHECKING:
    import pandas
    import polars

    from .experiment import Experiment

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Ints = NDArray[np.int32]
Counts = NDArray[np.uint32]
Bools = NDArray[np.bool_]


class Trace:
    """T episodes of a genotype, step by step, for R robots.

    All arrays come directly from the simulator. Robots are numbered in the order of
    the objects of the experiment file; lengths are centimetres, angles radians.
    """

    fitness: Floats
    """``[T]``: the same bits as :meth:`Experiment.evaluate` gives."""
    step_fitness: Floats
    """``[T, steps]``; NaN if a step does not count."""
    positions: Floats
    """``[T, steps, R, 2]``: x and y at the end of the step, cm."""
    headings: Floats
    """``[T, steps, R]``: at the end of the step, in [0, 2 pi)."""
    wheels: Floats
    """``[T, steps, R, 2]``: right and left wheel, in [-1, 1]."""
    leds: Counts
    """``[T, steps, R]``: colour of the LED, 0 off."""
    sends: Bools
    """``[T, steps, R]``: whether it sends its own message (else it relays)."""
    messages: Floats
    """``[T, steps, R, M]``: its own message, as quantised to a symbol."""
    frame_emitters: Ints
    """``[T, steps, R]``: the robot that emitted the received frame; -1 without a frame."""
    frame_originators: Ints
    """``[T, steps, R]``: the robot whose message the frame carries; -1 without a frame."""
    frame_hops: Counts
    """``[T, steps, R]``: number of emissions of the message so far, from 1; 0 without a frame."""
    frame_sectors: Ints
    """``[T, steps, R]``: the sector that received the frame; -1 without one."""
    frame_signals: Floats
    """``[T, steps, R]``: strength of the frame, in (0, 1]; 0 without one."""
    frame_messages: Floats
    """``[T, steps, R, M]``: the message of the frame; zeros without one."""
    targets: NDArray[np.int8]
    """``[T, steps, R]``: whether the LED should be on; -1 if the task has no target."""
    stimuli: Floats32
    """``[T, steps, R, I]``: inputs of its controller; NaN for inputs that it lacks."""
    activities: Floats32
    """``[T, steps, R, N]``: activity of its neurons after the step; NaN without a network."""
    voltages: Floats32
    """``[T, steps, R, N]``: voltage of spiking neurons after the step, mV; N is 0 without such
    neurons."""
    lights: Floats
    """``[T, steps, L, 2]``: positions of lights during the step, cm."""
    areas: Floats
    """``[T, A, 2]``: positions of ground areas at the start, cm."""
    movables: Floats
    """``[T, steps, B, 3]``: x and y, cm, and heading of movables at the end of the step."""
    touches: Bools
    """``[T, steps, R]``: whether its body touches something."""

    def __init__(
        self,
        experiment: Experiment,
        genotype: Floats,
        where: tuple[str, int, int, int, int],
        arrays: dict[str, NDArray[Any]],
    ) -> None:
        self.experiment = experiment
        """The simulated experiment."""
        self.genotype = genotype
        """``[d]``: by whom."""
        self._where = where
        measures = arrays.pop("measures")
        names = experiment.measure_names
        self.measures: dict[str, Floats] = {name: measures[..., i] for i, name in enumerate(names)}
        """Measures by name, ``[T, steps]``; NaN for steps without a value."""
        for name, array in arrays.items():
            setattr(self, name, array)

    @property
    def trials(self) -> range:
        """The numbers of the T trials in their set."""
        return range(self._where[3], self._where[4])

    @property
    def n_steps(self) -> int:
        """Environment steps of an episode."""
        return int(self.headings.shape[1])

    @property
    def n_robots(self) -> int:
        """Robots, R."""
        return int(self.headings.shape[2])

    @property
    def objects(self) -> list[str]:
        """``[R]``: the object of each robot in the experiment file."""
        objects = self.experiment.to_dict()["world"]["objects"].items()
        robots = [(name, it) for name, it in objects if it["type"] == "robot"]
        return [name for name, it in robots for _ in range(it["num_instances"])]

    @property
    def stimulus_names(self) -> list[str]:
        """``[I]``: names of the inputs of a network: ``STIMULUS_0`` and so on."""
        stimuli = self.experiment.to_dict()["topology"]["stimuli"].items()
        names = [f"{name}_{i}" for name, it in stimuli for i in range(it["n"])]
        # Robots without a network may have more.
        extra = range(len(names), self.stimuli.shape[-1])
        return [*names, *(f"input_{i}" for i in extra)][: self.stimuli.shape[-1]]

    @property
    def neuron_names(self) -> list[str]:
        """``[N]``: names of the neurons: ``ENSEMBLE_0`` and so on."""
        ensembles = self.experiment.to_dict()["topology"]["ensembles"].items()
        names = [f"{name}_{i}" for name, it in ensembles for i in range(it["n"])]
        return names[: self.activities.shape[-1]]

    def columns(self) -> dict[str, NDArray[Any]]:
        """The columns of :meth:`to_pandas`: one value per trial, step and robot."""
        shape = self.headings.shape
        n_trials, n_steps, n_robots = shape

        def flat(array: NDArray[Any]) -> NDArray[Any]:
            return np.broadcast_to(array, shape).reshape(-1)

        def of_step(array: NDArray[Any]) -> NDArray[Any]:
            return flat(array[:, :, np.newaxis])

        names = self.objects
        columns: dict[str, NDArray[Any]] = {
            "trial": flat(np.array(self.trials)[:, np.newaxis, np.newaxis]),
            "step": flat(np.arange(n_steps)[np.newaxis, :, np.newaxis]),
            "robot": flat(np.arange(n_robots)[np.newaxis, np.newaxis, :]),
            "object": flat(np.array(names, dtype=object)[np.newaxis, np.newaxis, :]),
            "x_cm": flat(self.positions[..., 0]),
            "y_cm": flat(self.positions[..., 1]),
            "heading_rad": flat(self.headings),
            "wheel_right": flat(self.wheels[..., 0]),
            "wheel_left": flat(self.wheels[..., 1]),
            "led": flat(self.leds),
            "sends": flat(self.sends),
        }
        for i in range(self.messages.shape[-1]):
            columns[f"message_{i}"] = flat(self.messages[..., i])
        columns["frame_emitter"] = flat(self.frame_emitters)
        columns["frame_originator"] = flat(self.frame_originators)
        columns["frame_hops"] = flat(self.frame_hops)
        columns["frame_sector"] = flat(self.frame_sectors)
        columns["frame_signal"] = flat(self.frame_signals)
        for i in range(self.frame_messages.shape[-1]):
            columns[f"frame_message_{i}"] = flat(self.frame_messages[..., i])
        for i, name in enumerate(self.stimulus_names):
            columns[f"stimulus_{name}"] = flat(self.stimuli[..., i])
        for i, name in enumerate(self.neuron_names):
            columns[f"neuron_{name}"] = flat(self.activities[..., i])
        for i in range(self.lights.shape[2]):
            columns[f"light_{i}_x_cm"] = of_step(self.lights[:, :, i, 0])
            columns[f"light_{i}_y_cm"] = of_step(self.lights[:, :, i, 1])
        for i in range(self.movables.shape[2]):
            columns[f"movable_{i}_x_cm"] = of_step(self.movables[:, :, i, 0])
            columns[f"movable_{i}_y_cm"] = of_step(self.movables[:, :, i, 1])
            columns[f"movable_{i}_heading_rad"] = of_step(self.movables[:, :, i, 2])
        if self.experiment.to_dict()["world"].get("bodies") is not None:
            columns["touches"] = flat(self.touches)
        columns["step_fitness"] = of_step(self.step_fitness)
        for name, measure in self.measures.items():
            columns[f"metric_{name}"] = of_step(measure)
        columns["led_target"] = flat(self.targets)
        return columns

    def to_pandas(self) -> pandas.DataFrame:
        """One row per trial, step and robot."""
        with needs("data"):
            import pandas

        return pandas.DataFrame(self.columns())

    def to_polars(self) -> polars.DataFrame:
        """One row per trial, step and robot."""
        with needs("data"):
            import polars

        columns: dict[str, Any] = dict(self.columns())
        columns["object"] = polars.Series(columns["object"].tolist(), dtype=polars.Categorical)
        return polars.DataFrame(columns)

    def show(self, trial: int | None = None, *, height: int = 800) -> Replay:
        """The player with one of the trials, the first if absent, for a notebook. It needs no
        network. ``height``: of the frame, in pixels."""
        trial = self.trials.start if trial is None else arguments.whole(trial, "trial", 0, TRIALS_MAX - 1)
        height = arguments.whole(height, "height", 1, 100_000)
        if trial not in self.trials:
            raise ValueError(f"the trace has trials {self.trials}, not {trial}")
        where = (*self._where[:3], trial, trial + 1)
        html = self.experiment._core.replay_html(self.genotype, where, self.experiment.name)
        return Replay(html, height)

    def save(self, path: str | os.PathLike[str], trial: int | None = None) -> None:
        """Writes :meth:`show` as a file for any browser."""
        Path(path).write_text(self.show(trial).html, encoding="utf-8")

    def __repr__(self) -> str:
        return (
            f"<Trace of {self.experiment.name!r}: trials {self.trials.start} to "
            f"{self.trials.stop - 1}, {self.n_steps} steps, {self.n_robots} robots>"
        )
