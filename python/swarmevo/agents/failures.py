"""What an agent is told when a call does not succeed: what is wrong, where, and what to do next."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import NoReturn

CODES = {
    1: "internal",
    2: "bad_input",
    3: "not_found",
    4: "unreachable",
    5: "experiment_failed",
    6: "experiment_cancelled",
    7: "token_refused",
    8: "no_tls",
    9: "not_a_coordinator",
    10: "not_ended",
    11: "database_damaged",
    12: "claim_false",
    71: "machine_too_small",
    130: "interrupted",
}
"""Codes of failures of ``swarmctl``, by its exit code."""

NEXT = {
    "internal": "this is a bug or a full disk: show the message to a person",
    "bad_input": "change what the message names, and call again",
    "not_found": "`experiments` lists what there is; `explain` says what an experiment waits for",
    "unreachable": "the coordinator does not answer: work with place=\"here\", or ask a person to start it",
    "experiment_failed": "`explain` names the cause; mend the file, `validate` it, and run it as a new experiment",
    "experiment_cancelled": "`history` and `individual` still have its results; a person decides whether it goes on",
    "token_refused": "ask a person for the client's token; it belongs in the environment of this server, not in a call",
    "no_tls": "ask a person to check address and certificates of the coordinator",
    "not_a_coordinator": "ask a person to check the address of the coordinator, and its version",
    "not_ended": "call `follow` again later; the experiment goes on without you",
    "database_damaged": "ask a person to run `swarmctl doctor` on the data directory",
    "claim_false": "do not trust this bundle: the message says which claim is false",
    "machine_too_small": "ask for less at once, or let a person free memory and threads",
    "interrupted": "call again: complete generations are kept",
}
"""The next step after a failure, if its message has no better one."""


@dataclass(eq=False)
class Failure(Exception):
    """A call that has not succeeded."""

    code: str
    """Stable; one of the names of :data:`CODES`, or ``bad_argument``, ``outside_directory``, ``exists``,
    ``not_allowed``, ``budget``, ``busy``, ``no_fleet``, ``no_program``."""
    where: str
    """The argument, file or experiment that is concerned; may be empty."""
    message: str
    """What is wrong, in one sentence; all mistakes of a file, one per line."""
    next: str
    """What to do."""

    def __str__(self) -> str:
        return json.dumps({"error": asdict(self)}, ensure_ascii=False)


def of_program(exit_code: int, stderr: str, where: str) -> Failure:
    """The failure of ``swarmctl`` that ended with this code and these lines on standard error."""
    code = CODES.get(exit_code, "internal")
    lines = [line.removeprefix("error: ") for line in stderr.splitlines() if not _is_remark(line)]
    message = "\n".join(lines).strip() or f"swarmctl ended with code {exit_code} and no message"
    return Failure(code, where, message, NEXT[code])


def _is_remark(line: str) -> bool:
    """Whether a line is no part of an error."""
    remarks = ("working on ", "computing in this process", "warning: ", "For more information", "standard output")
    return line.startswith(remarks)


def bad_argument(where: str, message: str, step: str) -> NoReturn:
    """Refuses an argument."""
    raise Failure("bad_argument", where, message, step)
