"""Tools that use or control a fleet, which a person permits when the server starts."""

from __future__ import annotations

from typing import Annotated, Literal

from mcp.types import CallToolResult
from pydantic import Field

from . import places
from .answers import answer
from .failures import Failure
from .looking import Looking
from .parameters import Changes, Experiment, File, Seeds, settings

Priority = Annotated[int, Field(ge=1, le=1000, description="share of the fleet, relative to other experiments")]


class Submitting(Looking):
    """The tools of ``--allow-submit``."""

    async def submit(
        self, file: File, seeds: Seeds = None, priority: Priority = 100,
        generations: Annotated[int | None, Field(ge=1, description="number of generations, instead of the file's")] = None,
        group: Annotated[str | None, Field(description="name of the group of runs")] = None,
    ) -> CallToolResult:
        """Submit an experiment file to the fleet, which others share. It runs until it ends, also without you. Costs computing time: validate the file and `run` a short version here before."""
        at = self.program.of("fleet")
        found, step = await self.checked(file)
        if not found["ok"]:
            raise Failure("invalid_experiment", file, "\n".join(it["message"] for it in found["problems"]), step)
        options = [f"--priority={priority}"] + [f"--{name}={it}" for name, it in (("generations", generations), ("group", group)) if it is not None]
        options += [f"--seeds={','.join(map(str, seeds))}"] if seeds else []
        submitted = await self.program.document("submit", *at, *options, "--", file, where=file, seconds=60)
        runs = submitted if isinstance(submitted, list) else [submitted]
        kept = [{key: it.get(key) for key in ("id", "name", "group", "seed", "state", "generations")} for it in runs]
        return answer({"submitted": kept}, "follow(experiment=..., place=\"fleet\")", "`explain` says what it waits for")

    async def fork_on_fleet(
        self, address: Annotated[str, Field(description="the generation to continue after, such as 3@59")], changes: Changes = None,
        generations: Annotated[int | None, Field(ge=1, description="total number, with the shared ones; by default that of the parent")] = None,
        seed: Annotated[int | None, Field(ge=0, description="another seed for what follows")] = None,
        priority: Priority = 100,
    ) -> CallToolResult:
        """Continue an experiment of the fleet from one of its generations, as a new experiment of the fleet, with changes."""
        places.address(address, generation_only=True)
        options = [f"--{name}={it}" for name, it in (("generations", generations), ("seed", seed)) if it is not None]
        found = await self.program.document("fork", *self.program.of("fleet"), f"--priority={priority}", *options, *settings(changes), "--", address, where=address, seconds=60)
        kept = {key: found.get(key) for key in ("id", "name", "seed", "state", "generations")}
        return answer({"submitted": kept}, "follow(experiment=..., place=\"fleet\")")


class Controlling(Looking):
    """The tool of ``--allow-control``."""

    async def control(
        self, experiment: Experiment, action: Literal["pause", "resume", "cancel", "priority"],
        reason: Annotated[str, Field(max_length=200, description="of a pause: what others read in `explain`")] = "",
        generations: Annotated[int | None, Field(ge=1, description="of resume: the total number, to extend a completed experiment")] = None,
        priority: Priority = 100,
    ) -> CallToolResult:
        """Pause, resume or extend, cancel, or reprioritise an experiment of the fleet. Other people may wait for it: ask before you cancel what you have not submitted."""
        places.experiment(experiment)
        options = {
            "pause": [f"--reason={reason}"] if reason else [],
            "resume": [] if generations is None else [f"--generations={generations}"],
        }.get(action, [])
        value = [str(priority)] if action == "priority" else []
        found = await self.program.document(action, *self.program.of("fleet"), *options, "--", experiment, *value, where=experiment)
        return answer({"done": action, "result": found}, f"explain(experiment=\"{experiment}\", place=\"fleet\") shows its state")
