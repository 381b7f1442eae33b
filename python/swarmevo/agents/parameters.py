"""Arguments of tools, with what an agent reads about each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from .failures import Failure
from .places import key

File = Annotated[str, Field(description="an experiment file in the working directory, such as spread.json")]
Address = Annotated[str, Field(description="a genotype: `3` is the champion of experiment 3, `3@0/17` individual 17 of "
                               "its generation 0, `3@59/mean` the mean of the distribution after generation 59")]
Experiment = Annotated[str, Field(description="number or name of an experiment")]
Where = Annotated[Literal["here", "fleet"], Field(description="here: what `run` has computed in the working directory; "
                                                  "fleet: what a coordinator has")]
Seconds = Annotated[float | None, Field(gt=0, description="time budget of this call")]
Seeds = Annotated[list[Annotated[int, Field(ge=0)]] | None, Field(min_length=1, max_length=20, description="a run with each of these seeds, instead of the file's")]
Changes = Annotated[dict[str, Any] | None, Field(description="values by their place in the experiment file, such as "
                                                 '{"world.objects.robot.num_instances": 20}')]
CHANGES_MAX = 20


@dataclass(frozen=True)
class Budgets:
    """What a call may cost at most; a person sets it when the server starts."""

    seconds: float = 120.0
    """Time of a call."""
    episodes: int = 1_000_000
    """Episodes of a run or an evaluation: individuals times trials."""

    def within(self, seconds: float | None, default: float) -> float:
        """A time budget within the bound."""
        if seconds is None:
            return min(default, self.seconds)
        if seconds > self.seconds:
            raise Failure("budget", "seconds", f"a call may take {self.seconds:g} s at most, not {seconds:g}",
                          f"give {self.seconds:g} or less; a run that needs longer continues with the next call of `run`")
        return seconds

    def afford(self, n_episodes: int, asked: int, what: str, step: str) -> None:
        """Refuses work of more episodes than were asked for, or than the server permits."""
        most = min(asked, self.episodes)
        if n_episodes > most:
            bound = "`episodes` of this call" if asked <= self.episodes else "the bound of this server"
            raise Failure("budget", "episodes", f"{what}: {n_episodes} episodes; {bound} is {most}", step)


def settings(changes: dict[str, Any] | None) -> list[str]:
    """Arguments of ``swarmctl`` that change values of a file, all of them together."""
    import json

    if len(changes or {}) > CHANGES_MAX:
        raise Failure("bad_argument", "changes", f"a call has {CHANGES_MAX} changes at most", "edit the experiment file instead")
    pairs = [f"{key(place)}={json.dumps(value)}" for place, value in (changes or {}).items()]
    return [f"--set={';'.join(pairs)}"] if pairs else []
