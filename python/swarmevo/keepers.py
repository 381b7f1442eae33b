"""Storage for the generations of a run: none, the database of a data directory, or a file."""

from __future__ import annotations

import itertools
import json
import os
import re
import time
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _core
from .champion import Champion, Judged, Selection
from .errors import EvolutionError
from .evolution import Evolution, Generation, Judgement
from .experiment import Experiment

try:
    import fcntl
except ImportError:  # elsewhere than on Unix
    fcntl = None  # type: ignore[assignment]

Floats = NDArray[np.float64]

WRITE_EVERY_S = 1.0
"""The interval between writes of a file, which is also written at the end."""
FORMAT = 1


class End(NamedTuple):
    """The stored end of a completed run."""

    champion: Champion
    digest: str


class Done(NamedTuple):
    """A complete generation."""

    generation: Generation
    evolution: Evolution
    """After it."""
    fitness: Floats
    blocks: list[Floats]
    """Fitness of the blocks of a scheduled comparison, if any."""
    judgement: Judgement | None
    """The end of the run, after the last generation."""
    notices: list[str]
    """Notices."""
    seconds: float
    n_workers: int
    completed: str | None
    """The reason, if it was the last generation; empty: all are done."""


class Keeper:
    """Keeps nothing."""

    id: int | None = None
    """The number of the experiment, if it has one."""
    end: End | None = None
    """The end, if the run was complete before."""

    def __init__(self, experiment: Experiment) -> None:
        self.evolution: Evolution = experiment._evolution()
        """The evolution after the stored generations."""
        self.generations: list[Generation] = []
        """Those."""

    def commit(self, done: Done) -> None:
        """Keeps a generation."""

    def fail(self, reason: str) -> None:
        """Stores the failure: evolution cannot learn from the next generation."""

    def close(self) -> None:
        """Writes pending data, and releases the storage for others."""


class InDatabase(Keeper):
    """Storage in the database of a data directory, like ``swarmctl run``."""

    def __init__(self, experiment: Experiment, directory: str) -> None:
        self._record = _core.Record(directory, experiment._core)
        try:
            self.id, is_over, digest = self._record.state()
            empty = experiment._evolution()
            self.evolution = Evolution._of(self._record.evolution(), empty._trials, empty._origin)
            self.generations = [
                Generation(index, best, mean, least, None, link, deviation, duration_ms)
                for index, best, mean, least, deviation, link, duration_ms in self._record.history()
            ]
            champion = self._record.champion()
            if is_over and champion is not None:
                self.end = End(Champion._of(champion, empty._origin), digest)
        except BaseException:
            self._record.close()
            raise

    def commit(self, done: Done) -> None:
        judgement = done.judgement
        self._record.commit(
            done.evolution._core,
            done.fitness,
            done.blocks,
            [] if judgement is None else judgement.blocks,
            None if judgement is None else judgement.fitness,
            done.notices,
            done.seconds,
            done.n_workers,
            done.completed,
        )

    def fail(self, reason: str) -> None:
        self._record.fail(reason)

    def close(self) -> None:
        self._record.close()


class InFile(Keeper):
    """Storage in a file of a data directory, for runs with a fitness function of the caller: neither a
    coordinator nor ``swarmctl`` could continue them."""

    def __init__(self, experiment: Experiment, directory: str) -> None:
        super().__init__(experiment)
        name = re.sub(r"[^\w.-]", "_", experiment.name)[:50]
        self.path = Path(directory) / f"{name}-{experiment.config_digest[:12]}.evolve.json"
        """The file."""
        self._experiment = experiment
        self._written_at = time.monotonic()
        self._is_new = False
        self._failed: str | None = None
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._lock = _lock(self.path.with_suffix(".lock"))
        try:
            if self.path.exists():
                self._read()
        except BaseException:
            self._lock.close()
            raise

    def _read(self) -> None:
        try:
            found = json.loads(self.path.read_text(encoding="utf-8"))
            if found["format"] != FORMAT or found["config_digest"] != self._experiment.config_digest:
                raise ValueError("it has another format, or belongs to another experiment")
            generations = [Generation(**it) for it in found["generations"]]
            state = _core.Evolution.from_json(found["evolution"], _n_flat(generations, self._experiment.population_size))
            if state.n_generations != len(generations) or (generations and state.digest != generations[-1].digest):
                raise ValueError("its generations do not match its evolution")
            end = None if found["end"] is None else _end_of(found["end"], self._experiment)
        except (ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{self.path} is no run to continue: {error}; move it elsewhere to start again") from None
        if found.get("failed") is not None:
            raise EvolutionError(f"{found['failed']}; the run in {self.path} failed: move the file elsewhere to start again")
        self.evolution = Evolution._of(state, self.evolution._trials, self.evolution._origin)
        self.generations = generations
        if end is not None and len(generations) >= self._experiment.generations:
            self.end = end

    def commit(self, done: Done) -> None:
        self.evolution = done.evolution
        self.generations = [*self.generations, done.generation]
        if done.judgement is not None:
            self.end = End(done.judgement.champion, done.judgement.digest)
        self._is_new = True
        if time.monotonic() - self._written_at >= WRITE_EVERY_S:
            self._write()

    def fail(self, reason: str) -> None:
        # Without a stored generation, a restart loses nothing.
        if self.generations:
            self._failed, self._is_new = reason, True

    def close(self) -> None:
        try:
            if self._is_new:
                self._write()
        finally:
            self._lock.close()

    def _write(self) -> None:
        """Writes a new file, then replaces the old one, so that the file is always complete."""
        content = {
            "format": FORMAT,
            "config_digest": self._experiment.config_digest,
            "experiment": self._experiment.to_dict(),
            "generations": [vars(it) for it in self.generations],
            "evolution": self.evolution.to_json(),
            "end": None if self.end is None else _end_to(self.end),
            "failed": self._failed,
        }
        unfinished = self.path.with_suffix(".new")
        with unfinished.open("w", encoding="utf-8") as file:
            json.dump(content, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(unfinished, self.path)
        self._written_at, self._is_new = time.monotonic(), False


def _n_flat(generations: list[Generation], population_size: int) -> int:
    """The number of latest generations in which all individuals had the same fitness."""
    if population_size < 2:
        return 0
    same = itertools.takewhile(lambda it: it.n_non_finite == 0 and it.best == it.min, reversed(generations))
    return sum(1 for _ in same)


def _lock(path: Path) -> IO[str]:
    """The lock file that keeps other runs of the same experiment out of the directory, if the system supports
    it."""
    file = path.open("w")
    if fcntl is not None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.close()
            raise OSError(f"{path.parent} is in use by another run of this experiment; stop it or choose another directory") from None
    return file


def _end_to(end: End) -> dict[str, Any]:
    champion = {**vars(end.champion), "origin": None}
    plain = {key: it.tolist() if isinstance(it, np.ndarray) else it for key, it in champion.items()}
    return {"champion": plain, "digest": end.digest}


def _end_of(found: dict[str, Any], experiment: Experiment) -> End:
    it = found["champion"]
    it |= {key: np.array(it[key], dtype=np.float64) for key in ("genotype", "trial_fitness")}
    it |= {"selection": it["selection"] and Selection(*it["selection"]), "judged": it["judged"] and Judged(*it["judged"])}
    return End(Champion(**{**it, "origin": experiment._origin}), found["digest"])
