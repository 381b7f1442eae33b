"""Whole runs in this process, with the same bits as a coordinator's."""

from __future__ import annotations

import os
import time
import warnings
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Callable

from . import arguments
from .champion import Champion
from .errors import EvolutionError, EvolutionWarning
from .evolution import Evaluate, Evolution, Floats, compute
from .experiment import Experiment, thread_count
from .generations import Generation, table
from .keepers import Done, End, InDatabase, InFile, Keeper
from .plotting import plot_history
from .progress import shown
from .trials import TrialSet

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

Callback = Callable[[Generation, Evolution], Any]
"""Called with every complete generation, and with a copy of the evolution after it."""


@dataclass(frozen=True, eq=False, repr=False)
class LocalRun:
    """A run that has ended, or was interrupted."""

    experiment: Experiment
    generations: list[Generation]
    """All complete generations, in order."""
    champion: Champion
    """The champion, judged on trials that selected nothing, unless the run was interrupted."""
    digest: str
    """Digest of every bit of the run, the same as ``swarmctl run`` prints."""
    evolution: Evolution
    """The evolution after the last generation, from which a run can continue."""
    id: int | None = None
    """Number of the run in the data directory, if there is one."""

    def history(self) -> pandas.DataFrame:
        """A row per generation: best, mean, min, standard deviation, digest, times."""
        return table(self.generations)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Best and mean fitness of every generation."""
        indices = [generation.index for generation in self.generations]
        best = [generation.best for generation in self.generations]
        mean = [generation.mean for generation in self.generations]
        return plot_history(ax, self.experiment.name, indices, best, mean)

    def __repr__(self) -> str:
        return (
            f"<LocalRun of {self.experiment.name!r}: {len(self.generations)} of {self.experiment.generations} generations, "
            f"champion {self.champion.fitness:.6f}>"
        )


class Interrupted(KeyboardInterrupt):
    """Ctrl-C has ended :func:`evolve`. ``run`` has everything until then: the complete generations,
    ``evolution`` after them, and the champion so far, which is not judged."""

    def __init__(self, run: LocalRun, advice: str) -> None:
        self.run = run
        super().__init__(run, advice)

    def __str__(self) -> str:
        run = self.run
        return f"{len(run.generations)} of {run.experiment.generations} generations are complete; {self.args[1]}"


def evolve(
    experiment: Experiment,
    generations: int | None = None,
    *,
    threads: int | None = None,
    progress: bool = True,
    evaluate: Evaluate | None = None,
    callback: Callback | None = None,
    data_dir: str | os.PathLike[str] | None = None,
) -> LocalRun:
    """Runs an experiment here, as ``swarmctl run`` does: the same generations, champion and
    digest.

    ``generations``: their number, instead of the file's. ``threads``: their number, that of the processors if
    absent. ``progress``: whether tqdm, if installed, shows the progress.

    ``data_dir``: a data directory that stores every generation, like that of ``swarmctl run``. The same call
    continues an interrupted run, and returns a completed one without computing it again; ``swarmctl list
    --data-dir``, ``swarmevo.open`` and ``swarmctl run`` know the run. No other program can use the directory
    meanwhile.

    ``callback``: called with every complete (and stored) :class:`Generation`, and with a copy of the
    evolution after it. Its exceptions end the run, unchanged.

    Warnings of the experiment, and a coordinator's notices that evolution learns nothing, are an
    ``EvolutionWarning``. Where a coordinator's run fails for that reason, this one raises an
    ``EvolutionError``, a ValueError, with the same message; ``data_dir`` keeps the earlier generations, and
    stores the failure. After a failure in a database, the same call starts another run, like ``swarmctl run``;
    after a failure in a file of ``evaluate``, the same call raises the error again at once.

    Ctrl-C raises :class:`Interrupted`, a KeyboardInterrupt whose ``run`` has all complete generations. If the
    experiment itself computes fitness, this takes at most a second.

    ``evaluate``: computes fitness instead of the experiment's own :meth:`~Experiment.evaluate`:
    ``f(genotypes, trial_set, n_trials)`` returns an array ``[P, T]`` of T = ``n_trials``, of any type of numbers
    (NumPy, JAX, PyTorch, lists, tuples), or ``[P]`` if trials do not matter, which counts as one trial. Anything
    else is a ValueError at once. A fitness that is not finite ranks last. Exceptions of ``evaluate`` end the
    run, unchanged. ``data_dir`` stores such a run in its own file, ``NAME-DIGEST.evolve.json``, because no
    coordinator could continue it. The file belongs to one function: another or a changed function needs
    another directory.
    """
    if not isinstance(experiment, Experiment):
        raise ValueError(f"evolve takes an Experiment, such as Experiment.from_file gives, not {type(experiment).__name__}")
    arguments.callable_of(evaluate, "evaluate")
    arguments.callable_of(callback, "callback")
    if generations is not None:
        experiment = experiment.replace(generations=generations)
    n_threads = thread_count(threads)
    experiment._warn(3)

    def here(genotypes: Floats, trial_set: TrialSet, n_trials: int) -> Floats:
        return experiment.evaluate(genotypes, trial_set, trials=n_trials, threads=threads)

    if data_dir is None:
        keeper = Keeper(experiment)
    else:
        keeper = (InDatabase if evaluate is None else InFile)(experiment, os.fspath(data_dir))
    run = _Run(experiment, keeper, here if evaluate is None else evaluate, callback, n_threads)
    with closing(keeper):
        try:
            todo = iter(run.step, False)
            for _ in shown(todo, experiment.name, progress, experiment.generations, len(run.done)):
                for notice in run.notices:
                    warnings.warn(notice, EvolutionWarning, stacklevel=2)
        except KeyboardInterrupt:
            if not run.done:
                raise
            lost = "`run` of this exception has them" if data_dir is None else f"the same call continues from {data_dir}"
            raise Interrupted(run.so_far(), lost) from None
        return run.ended()


class _Run:
    """A run, generation by generation. It contains only complete generations, even after an
    exception."""

    def __init__(
        self, experiment: Experiment, keeper: Keeper, evaluate: Evaluate, callback: Callback | None, n_threads: int
    ) -> None:
        self._experiment, self._keeper, self._evaluate = experiment, keeper, evaluate
        self._callback, self._n_threads = callback, n_threads
        self._settings = experiment.to_dict()["algorithm"]
        self._evolution, self.done = keeper.evolution, list(keeper.generations)
        self._end = keeper.end
        self.notices: list[str] = []
        """Digest of the latest generation."""

    def step(self) -> bool:
        """Computes one generation, unless the run is over; returns whether it did."""
        if self._end is not None:
            return False
        started = time.monotonic()
        n_trials = self._experiment.n_trials
        fitness = compute(self._evaluate, self._evolution.ask(), TrialSet.of(self._evolution.n_generations), n_trials)
        after = self._evolution.copy()
        try:
            told, self.notices, completed = after._tell(fitness, self._experiment._core)
        except EvolutionError as error:
            self._keeper.fail(str(error))
            raise
        is_due = after.n_generations % self._settings["champion_every"] == 0
        blocks = after._compare(self._evaluate, self._settings["champion_trials"]) if is_due else []
        judgement = None if completed is None else after._judge(self._evaluate, self._settings["judgement_trials"])
        seconds = time.monotonic() - started
        generation = told._timed(seconds, fitness.size, self._n_threads)
        kept = Done(generation, after, fitness, blocks, judgement, self.notices, seconds, self._n_threads, completed)
        self._keeper.commit(kept)
        self._evolution = after
        self.done.append(generation)
        if judgement is not None:
            self._end = End(judgement.champion, judgement.digest)
        if self._callback is not None:
            self._callback(generation, after.copy())
        return True

    def so_far(self) -> LocalRun:
        """The complete part of the run."""
        if self._end is not None:
            return self.ended()
        champion = self._evolution.champion
        assert champion is not None, "a generation is complete"
        digest = self._evolution.digest
        return LocalRun(self._experiment, self.done, champion, digest, self._evolution, self._keeper.id)

    def ended(self) -> LocalRun:
        """The whole run."""
        assert self._end is not None, "the run is over"
        champion, digest = self._end
        return LocalRun(self._experiment, self.done, champion, digest, self._evolution, self._keeper.id)
