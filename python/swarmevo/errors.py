"""The exceptions of this package."""

from __future__ import annotations

from typing import NamedTuple, Sequence


class Problem(NamedTuple):
    """One mistake in an experiment file."""

    path: str
    """Place of the mistake, such as ``algorithm.population_size``; empty for the whole file."""
    line: int | None
    """Line in the file, from 1, if the text has such a place."""
    message: str
    """The mistake, and the valid values."""

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
    """A champion is used with an experiment in which it did not evolve: the digests of their configurations
    differ."""

    def __init__(self, reason: str, advice: str) -> None:
        self.reason = reason
        """The difference between the experiments."""
        super().__init__(reason, advice)

    def __str__(self) -> str:
        return f"{self.reason}. {self.args[1]}"


class EvolutionError(SwarmError, ValueError):
    """Evolution can learn nothing from a generation, or from any later one: no fitness is finite, or all
    individuals had the same fitness for a hundred generations while chance drove the distribution out of all
    bounds."""


class FleetWarning(UserWarning):
    """A request to a coordinator waits, because the coordinator has no workers."""


class EvolutionWarning(UserWarning):
    """Evolution learns nothing, or less than it could. A coordinator reports this as notices of a run, and
    ``swarmctl`` as warnings about a file."""


class InternalError(SwarmError, RuntimeError):
    """The simulator has panicked, because of a bug or an edited state of an evolution."""


class FleetError(SwarmError):
    """The coordinator has refused a request, or is unreachable.

    ``code`` is the name of the gRPC status, such as ``"NOT_FOUND"``; ``docs/clients.md`` explains each.
    An error that is a ValueError or a KeyError without a fleet is one with a fleet, too:
    :class:`RefusedArgument`, :class:`NotFound`.
    """

    def __init__(self, code: str, message: str) -> None:
        self.code = code
        super().__init__(code, message)

    def __str__(self) -> str:
        return str(self.args[1])


class RefusedArgument(FleetError, ValueError):
    """An argument is invalid: ``INVALID_ARGUMENT`` or ``OUT_OF_RANGE``."""


class NotFound(FleetError, KeyError):
    """The experiment, or the requested part of it, does not exist: ``NOT_FOUND``."""


def refused(code: str, message: str) -> FleetError:
    """The error of a status."""
    kinds = {"INVALID_ARGUMENT": RefusedArgument, "OUT_OF_RANGE": RefusedArgument, "NOT_FOUND": NotFound}
    return kinds.get(code, FleetError)(code, message)


class ForkError(SwarmError, RuntimeError):
    """An object does not work in a forked process, because its threads or connections stay in the parent:
    create it again here, or start processes by ``multiprocessing.get_context("spawn")``."""
