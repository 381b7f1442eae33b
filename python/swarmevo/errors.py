"""What goes wrong."""

from __future__ import annotations

from typing import NamedTuple, Sequence


class Problem(NamedTuple):
    """One mistake in an experiment file."""

    path: str
    """Where, such as ``algorithm.population_size``; empty for the whole file."""
    line: int | None
    """Line in the file, from 1, if the text has such a place."""
    message: str
    """What is wrong, and what would be right."""

    def __str__(self) -> str:
        line = "" if self.line is None else f"line {self.line}: "
        return line + (f"{self.path}: " if self.path else "") + self.message


class SwarmError(Exception):
    """The base of all errors of this package."""


class ExperimentError(SwarmError, ValueError):
    """An experiment file with mistakes: all of them."""

    def __init__(self, problems: Sequence[tuple[str, int | None, str]]) -> None:
        self.problems: list[Problem] = [Problem(*problem) for problem in problems]
        """In the order of the file; never empty."""
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))


class OtherExperimentError(SwarmError, ValueError):
    """A champion meets an experiment that it was not evolved in: their configurations have other digests."""

    def __init__(self, reason: str, advice: str) -> None:
        self.reason = reason
        """How they differ."""
        super().__init__(reason, advice)

    def __str__(self) -> str:
        return f"{self.reason}. {self.args[1]}"


class EvolutionError(SwarmError, ValueError):
    """Evolution can learn nothing from a generation, or from any later one: no fitness is finite, or all have been the
    same for a hundred generations while chance has driven the distribution out of all bounds."""


class FleetWarning(UserWarning):
    """What a coordinator is asked for waits: it has no workers."""


class EvolutionWarning(UserWarning):
    """Evolution learns nothing, or less than it could: what a coordinator has as notices of a run, and ``swarmctl``
    as warnings of a file."""


class InternalError(SwarmError, RuntimeError):
    """The simulator has panicked: a bug of it, or a state of an evolution that was edited."""


class FleetError(SwarmError):
    """The coordinator has refused a request, or cannot be reached.

    ``code`` is the name of the gRPC status, such as ``"NOT_FOUND"``; ``docs/clients.md``
    says what each means. What would be a ValueError or KeyError here is one there, too: :class:`RefusedArgument`,
    :class:`NotFound`.
    """

    def __init__(self, code: str, message: str) -> None:
        self.code = code
        super().__init__(code, message)

    def __str__(self) -> str:
        return str(self.args[1])


class RefusedArgument(FleetError, ValueError):
    """An argument does not fit: ``INVALID_ARGUMENT`` or ``OUT_OF_RANGE``."""


class NotFound(FleetError, KeyError):
    """There is no such experiment, or nothing of it yet: ``NOT_FOUND``."""


def refused(code: str, message: str) -> FleetError:
    """The error of a status."""
    kinds = {"INVALID_ARGUMENT": RefusedArgument, "OUT_OF_RANGE": RefusedArgument, "NOT_FOUND": NotFound}
    return kinds.get(code, FleetError)(code, message)


class ForkError(SwarmError, RuntimeError):
    """Something does not work in a process that was forked, because its threads or connections are in another:
    make it anew here, or start processes by ``multiprocessing.get_context("spawn")``."""
