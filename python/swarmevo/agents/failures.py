"""What an agent is told when a call does not succeed: what is wrong, where, and what to do next."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import NoReturn

STEPS = {
    "bad_input": "change what the message names, and call again",
    "bad_argument": "change the argument, and call again",
    "invalid_experiment": "mend every mistake, then `validate`; `schema` explains a key",
    "bad_genotype": "give an address of this experiment, as `individual` shows it",
    "unknown_key": "call schema(key) of the key above, which lists the keys below it",
    "no_data_directory": "`run` an experiment file first; or name place=\"fleet\"",
    "not_found": "`experiments` lists what there is; `explain` says what an experiment waits for",
    "wrong_state": "`explain` says in which state it is",
    "unreachable": "the coordinator does not answer: work with place=\"here\", or ask a person to start it",
    "experiment_failed": "`explain` names the cause; mend the file, `validate` it, and run it as a new experiment",
    "experiment_cancelled": "`history` and `individual` still have its results; a person decides whether it goes on",
    "token_refused": "ask a person for the client's token; it belongs in the environment of this server, not in a call",
    "not_ended": "call `follow` again later; the experiment goes on without you",
    "interrupted": "call again: complete generations are kept",
}
"""Next steps in terms of this server's tools. For all other codes, ``swarmctl`` says what to do."""


@dataclass(eq=False)
class Failure(Exception):
    """A call that has not succeeded."""

    code: str
    """Stable: a code of ``swarmctl`` (``swarmctl schema --of error``), or ``outside_directory``, ``exists``,
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
    """The failure of ``swarmctl`` that ended with this code, as the last line of standard error describes it.

    >>> of_program(3, '{"error": {"code": "not_found", "where": null, "message": "no experiment 9", "next": ""}}', "9").where
    '9'
    """
    last = stderr.strip().rpartition("\n")[2]
    try:
        error = json.loads(last)["error"]
        code = error["code"]
        return Failure(code, error["where"] or where, error["message"], STEPS.get(code, error["next"]))
    except (ValueError, KeyError, TypeError):
        message = f"swarmctl ended with code {exit_code} and said: {last or 'nothing'}"
        return Failure("internal", where, message, "this is a bug, or a program of another version: show the message to a person")


def bad_argument(where: str, message: str, step: str) -> NoReturn:
    """Refuses an argument."""
    raise Failure("bad_argument", where, message, step)
