"""Summaries of generations: one type for runs of this process, of a fleet and of data
directories."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Callable, Iterator, Sequence

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Generation:
    """The summary of a generation, over the individuals whose fitness is finite."""

    index: int
    """From 0."""
    best: float
    mean: float
    min: float
    n_non_finite: int | None = field(compare=False)
    """Number of individuals whose fitness is not finite; they rank last. None if not recorded."""
    digest: str
    """A link of a hash chain over all genotypes and fitness so far: equal digests mean equal runs,
    bit for bit."""
    standard_deviation: float | None = None
    """Standard deviation over the population."""
    duration_ms: int | None = field(default=None, compare=False)
    """Wall-clock time, if it was measured."""
    episodes: int | None = field(default=None, compare=False)
    """Episodes simulated."""
    workers: int | None = field(default=None, compare=False)
    """Number of workers at its end; of threads, for a run of this process."""
    idle_share: float | None = field(default=None, compare=False)
    """Share of the fleet's time without computing."""
    completed_at_ms: int | None = field(default=None, compare=False)
    """Milliseconds since 1970 UTC."""

    @property
    def generation(self) -> int:
        """The earlier name of ``index`` in results of :meth:`FleetRun.watch`."""
        warnings.warn("`generation` of a Generation is now `index`", DeprecationWarning, stacklevel=2)
        return self.index

    def _timed(self, seconds: float, episodes: int, workers: int) -> Generation:
        return replace(self, duration_ms=round(1000 * seconds), episodes=episodes, workers=workers)

    def __repr__(self) -> str:
        return f"<Generation {self.index}: best {self.best:.6g}, mean {self.mean:.6g}>"


def of_message(summary: Any, completed_at_ms: int | None = None) -> Generation:
    """A generation from a message ``GenerationSummary``."""
    return Generation(
        summary.generation, summary.best, summary.mean, summary.min, None, summary.digest, summary.standard_deviation,
        summary.duration_ms, summary.episodes, summary.workers, summary.idle_share, completed_at_ms,
    )


class Generations(list[Generation]):
    """A list that can still be called, because ``generations`` was a method of recorded runs."""

    def __init__(self, generations: Sequence[Generation], messages: Callable[[], Iterator[Any]]) -> None:
        super().__init__(generations)
        self._messages = messages

    def __call__(self) -> Iterator[Any]:
        """The messages ``CompletedGeneration``."""
        warnings.warn("`generations` is now a list of Generation: leave out the ()", DeprecationWarning, stacklevel=2)
        return self._messages()

    def __reduce__(self) -> tuple[type[list[Generation]], tuple[list[Generation]]]:
        return (list, (list(self),))


COLUMNS = tuple("generation" if it.name == "index" else it.name for it in fields(Generation) if it.name != "n_non_finite")


def table(generations: Sequence[Generation]) -> pandas.DataFrame:
    """A row per generation: best, mean, min, standard deviation, digest, times."""
    from .extras import needs

    with needs("data"):
        import pandas

    rows = [[getattr(it, "index" if name == "generation" else name) for name in COLUMNS] for it in generations]
    return pandas.DataFrame(rows, columns=list(COLUMNS))
