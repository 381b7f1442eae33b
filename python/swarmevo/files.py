"""The database of a data directory, read without a coordinator."""

from __future__ import annotations

import itertools
import os
from importlib import import_module
from pathlib import Path
from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray

from . import _core, protocol
from .extras import needs
from .records import RecordedRun, Records


AT_ONCE = 32
"""Number of generations whose fitness is read at once."""

_left_behind: list[_core.Database] = []


def open(directory: str | os.PathLike[str] = "swarm-data") -> Archive:
    """Opens the data directory of ``swarmctl run`` or of a coordinator. Only reads it; a
    coordinator may use it meanwhile."""
    return Archive(directory)


class Archive(Records):
    """A data directory; use :func:`open`."""

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        self.directory = Path(directory)
        """The data directory."""
        self._database = _core.Database(os.fspath(directory))
        self._process = os.getpid()

    def to_parquet(self, directory: str | os.PathLike[str]) -> list[Path]:
        """Writes ``experiments.parquet``, and for each experiment ``history-ID.parquet`` and
        ``fitness-ID.parquet``: the tables of :meth:`~Records.experiments`,
        :meth:`~RecordedRun.history` and :meth:`~RecordedRun.fitness_log`. Returns the files."""
        with needs("data"):
            import_module("pyarrow")
        directory = Path(directory)
        directory.mkdir(parents=True, exist_ok=True)
        files = [directory / "experiments.parquet"]
        self.experiments().to_parquet(files[0], index=False)
        for run in self.runs():
            if run.message.generations_done == 0:
                continue
            for name, table in (("history", run.history()), ("fitness", run.fitness_log())):
                files.append(directory / f"{name}-{run.id}.parquet")
                table.to_parquet(files[-1], index=False)
        return files

    def _fitness(self, experiment: int, generations: Sequence[int]) -> list[NDArray[np.float64]]:
        fitness: list[NDArray[np.float64]] = []
        while len(fitness) < len(generations):
            first = generations[len(fitness)]
            wanted = itertools.takewhile(lambda it: it[0] == it[1], zip(generations[len(fitness) :], itertools.count(first)))
            n_wanted = min(sum(1 for _ in wanted), AT_ONCE)
            read = _core.fitness_log(os.fspath(self.directory), experiment, first, n_wanted)
            found = list(itertools.takewhile(lambda it: it is not None, read))
            # Without the fitness, the answer tells why it is missing.
            fitness += [it for it in found if it is not None] or super()._fitness(experiment, [first])
        return fitness

    def _run(self, experiment_id: int) -> RecordedRun:
        return RecordedRun(self, experiment_id)

    def _call(self, name: str, **request: Any) -> Any:
        _, request_class, response_class = protocol.method("ExperimentService", name)
        if self._process != os.getpid():
            # A forked process must neither use nor close a database that its parent opened.
            _left_behind.append(self._database)
            self._database, self._process = _core.Database(os.fspath(self.directory)), os.getpid()
        answer = self._database.call(name, request_class(**request).SerializeToString())
        return response_class.FromString(answer)

    def __reduce__(self) -> tuple[type[Archive], tuple[Path]]:
        return (Archive, (self.directory,))

    def __repr__(self) -> str:
        return f"<Archive in {self.directory}>"
