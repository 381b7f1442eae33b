"""Tools that write drafts and compute here, within the budget of the call."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from mcp.server.mcpserver import Context, Image
from mcp.types import CallToolResult
from pydantic import Field

from .. import Experiment as Parsed
from .. import _core
from . import places
from .answers import answer, table, text
from .examples import example
from .failures import Failure, bad_argument, of_program
from .looking import HISTORY, Looking
from .parameters import Address, Changes, Experiment, File, Seconds, Seeds, Where, settings
from .places import NAME, key
from .program import DATA, Done

SCRIPT_LEN_MAX = 32 << 10
"""Bytes of a script."""
PICTURE_PX = 640
MEASURED = ("n", "mean", "ci95")

Episodes = Annotated[int, Field(ge=1, description="budget of episodes: individuals times trials times generations")]


@dataclass
class Computing(Looking):
    """The tools of a server that look and compute here. They change no experiment of a coordinator."""

    async def draft(
        self,
        name: Annotated[str, Field(description="name of the experiment, and of its files NAME.json and NAME.star")],
        task: Annotated[str, Field(description="the example to start from")] = "aggregation",
        script: Annotated[str | None, Field(description="the whole text of the script of the task, instead of the example's")] = None,
        changes: Changes = None,
    ) -> CallToolResult:
        """Write an experiment file and the script of its task into the working directory, as a variant of an example, and validate both. Call again with the same name to mend a draft."""
        if not NAME.fullmatch(name):
            bad_argument("name", f"{name!r} is no name", "give letters, digits, - and _, such as dark_gathering")
        if script is not None and len(script.encode()) > SCRIPT_LEN_MAX:
            bad_argument("script", f"a script has {SCRIPT_LEN_MAX} bytes at most", "write a shorter one")
        texts = await example(self.program, task, name)
        if f"{name}.star" not in texts and script is not None:
            bad_argument("script", f"the example {task!r} has a built-in fitness function and no script", "start from an example with a script, such as aggregation")
        if changes:
            texts[f"{name}.json"] = changed(texts[f"{name}.json"], changes, texts.get(f"{name}.star"), name)
        texts |= {} if script is None else {f"{name}.star": script}
        for path, body in texts.items():
            self.directory.write(self.directory.inside(path, "name"), body)
        found, step = await self.checked(f"{name}.json")
        return answer({"written": sorted(texts)} | found, step)

    async def run(
        self, file: File, ctx: Context, seconds: Seconds = None, episodes: Episodes = 100_000,
        generations: Annotated[int | None, Field(ge=1, description="number of generations, instead of the file's")] = None,
        seeds: Seeds = None,
    ) -> CallToolResult:
        """Evolve an experiment file here, with all processors, until it ends or the budget does. A run that was stopped continues when you call again with the same arguments. Several seeds make a group of runs, named like the experiment."""
        seconds = self.budgets.within(seconds, 30)
        found, step = await self.checked(file)
        if not found["ok"]:
            raise Failure("invalid_experiment", file, "\n".join(it["message"] for it in found["problems"]), step)
        each = found["population_size"] * found["trials"]
        n = generations or found["generations"]
        each *= len(seeds or [0])
        self.budgets.afford(n * each, episodes, f"{n} generations of {found['population_size']} individuals in {found['trials']} trials, for {len(seeds or [0])} seeds",
                            f"give `generations` of {max(1, min(episodes, self.budgets.episodes) // each)} or less, or more `episodes` if the work is worth it")
        options = [] if generations is None else [f"--generations={generations}"]
        options += [f"--seeds={','.join(map(str, seeds))}"] if seeds else []
        done = await self._evolved(ctx, n, seconds, "run", f"--data-dir={DATA}", *options, "--", file)
        return outcome(done, file, n, "run, with the same arguments, continues")

    async def resume(
        self, experiment: Experiment, ctx: Context, seconds: Seconds = None, episodes: Episodes = 100_000,
        generations: Annotated[int | None, Field(ge=1, description="total number, to extend a completed run")] = None,
    ) -> CallToolResult:
        """Continue a run or a fork of this directory that the budget has stopped, or extend a completed one."""
        places.experiment(experiment)
        seconds, at = self.budgets.within(seconds, 30), self.program.of("here")
        about = (await self._explained(experiment, "here")).get("experiment")
        if about is None:
            bad_argument("experiment", f"{experiment!r} is a group", "give the number of one of its experiments")
        n = generations or about["generations"]
        self._afford_rest(about, about["generations_done"], n, episodes)
        options = [] if generations is None else [f"--generations={generations}"]
        done = await self._evolved(ctx, n, seconds, "resume", *at, *options, "--", experiment)
        return outcome(done, experiment, n, f"resume(experiment=\"{experiment}\") continues")

    def _afford_rest(self, about: dict[str, Any], done: int, n_generations: int, episodes: int) -> None:
        trials = (about.get("latest") or {}).get("episodes", about["population_size"]) / about["population_size"]
        rest = max(0, n_generations - done)
        n = round(rest * about["population_size"] * trials)
        self.budgets.afford(n, episodes, f"the rest of {rest} generations", "give fewer `generations`, or more `episodes` if the work is worth it")

    async def fork(
        self, address: Annotated[str, Field(description="the generation to continue after, such as 3@59")], ctx: Context,
        changes: Changes = None, seconds: Seconds = None, episodes: Episodes = 100_000,
        generations: Annotated[int | None, Field(ge=1, description="total number, with the shared ones; by default that of the parent")] = None,
        seed: Annotated[int | None, Field(ge=0, description="another seed for what follows")] = None,
    ) -> CallToolResult:
        """Continue an experiment of this directory from one of its generations, as a new experiment, with changes: other robots, another fitness, another seed."""
        places.address(address, generation_only=True)
        seconds, at = self.budgets.within(seconds, 30), self.program.of("here")
        parent, _, first = address.partition("@")
        about = (await self._explained(parent, "here")).get("experiment")
        if about is None:
            bad_argument("address", f"{parent!r} is a group", "give the number of one of its experiments")
        n = generations or about["generations"]
        self._afford_rest(about, int(first) + 1, n, episodes)
        options = [f"--{name}={it}" for name, it in (("generations", generations), ("seed", seed)) if it is not None]
        done = await self._evolved(ctx, n, seconds, "fork", "--watch", *at, *options, *settings(changes), "--", address)
        return outcome(done, address, n, "resume(experiment=...) continues")

    async def _evolved(self, ctx: Context, n_generations: int, seconds: float, *args: str) -> Done:
        async def report(line: dict[str, Any]) -> None:
            if "generation" in line:
                await ctx.report_progress(line["generation"] + 1, n_generations, f"best {line['best']:.6g}")

        async with self.program.computing():
            return await self.program.run(*args, seconds=seconds, on_line=report)

    async def evaluate(
        self, address: Address, place: Where = "here", seconds: Seconds = None,
        trials: Annotated[int, Field(ge=2, le=10_000, description="trials of each condition; no evolution uses them")] = 50,
        robots: Annotated[list[int] | None, Field(max_length=10, description="a condition with each of these numbers of robots")] = None,
        perturb: Annotated[list[str] | None, Field(max_length=10, description="a condition with each of leader_failure, topology_switch, uncontrollable_rotation, stimuli_inhibition")] = None,
        inhibit: Annotated[list[str] | None, Field(max_length=10, description="a condition without each of these stimuli, by their keys in the file")] = None,
        changes: Changes = None,
    ) -> CallToolResult:
        """Test a genotype here in trials that no evolution used: as it is, and under other conditions. Gives means with 95 % intervals of fitness and of every measure of the task."""
        places.address(address)
        conditions = [f"--robots={it}" for it in robots or ()] + [f"--perturb={key(it)}" for it in perturb or ()]
        conditions += [f"--inhibit={key(it)}" for it in inhibit or ()] + settings(changes)
        n = (1 + len(conditions)) * trials
        self.budgets.afford(n, n, f"{1 + len(conditions)} conditions of {trials} trials", "give fewer `trials` or conditions")
        at = self.program.of(place)
        async with self.program.computing():
            with tempfile.TemporaryDirectory() as results:
                found = await self.program.document(
                    "evaluate", "--local", *at, f"--to={results}", "--force", f"--trials={trials}", *conditions, "--", address,
                    where=address, seconds=self.budgets.within(seconds, 60))
        return answer({"trials": trials, "conditions": [condition(it) for it in found["conditions"]]},
                      "conditions differ if their intervals do not overlap", f"picture(address=\"{address}\") shows what the robots do")

    async def picture(
        self, address: Address, place: Where = "here", seconds: Seconds = None,
        step: Annotated[int | None, Field(ge=0, description="the step to show; by default the last")] = None,
        trial: Annotated[int | None, Field(ge=0, description="the trial, which sets the world; by default the median one of the champion's judgement")] = None,
    ) -> CallToolResult:
        """Look at a swarm: a picture of one step of an episode, with robots, LEDs, messages, lights and areas, and the paths that led there."""
        places.address(address)
        at = self.program.of(place)
        options = [f"--{name}={it}" for name, it in (("at", step), ("trial", trial)) if it is not None]
        with tempfile.TemporaryDirectory() as directory:
            file = Path(directory) / "picture.png"
            done = await self.program.run("replay", *at, f"--to={file}", f"--size={PICTURE_PX}", *options, "--", address,
                                          seconds=self.budgets.within(seconds, 60))
            if done.exit_code != 0 or not file.exists():
                raise of_program(done.exit_code, done.stderr, address)
            image = Image(data=file.read_bytes(), format="png").to_image_content()
        remarks = [it.partition("; others")[0] for it in done.stderr.splitlines() if it.startswith("playing")]
        facts = {"address": address, "shown": f"step {step}" if step is not None else "the last step", "about": " ".join(remarks) or None}
        return CallToolResult(content=[image, text(facts, "picture(step=0) shows the beginning", "`evaluate` says how typical this episode is")])

    async def export(
        self, experiment: Experiment, file: Annotated[str, Field(description="a new file in the working directory, which ends in .zip")],
        place: Where = "here",
    ) -> CallToolResult:
        """Write an ended experiment to a bundle: one file with which anybody can verify every claim about the run."""
        places.experiment(experiment)
        path = self.directory.free(file, "file", ".zip")
        found = await self.program.document("export", *self.program.of(place), f"--to={path}", "--", experiment, where=experiment, seconds=self.budgets.seconds)
        return answer(found | {"file": file}, f"verify(file=\"{file}\") proves what it claims")

    async def verify(
        self, file: Annotated[str, Field(description="a bundle in the working directory, which ends in .zip")], seconds: Seconds = None,
        generations: Annotated[int, Field(ge=0, le=100_000, description="number of generations to simulate again; the bundle's last digest draws them")] = 5,
    ) -> CallToolResult:
        """Check a bundle without trusting its author: repeats the evolution from the log, and simulates the champion's judgement and some generations again, bit for bit."""
        path = self.directory.existing(file, "file")
        async with self.program.computing():
            found = await self.program.document("verify", f"--generations={generations}", "--", str(path), where=file, seconds=self.budgets.within(seconds, 60))
        return answer(found | {"file": file}, "the bundle proves these claims, and no others: publish it with its sha256")


def changed(file: str, changes: dict[str, Any], script: str | None, name: str) -> str:
    """The text of an example, whose own script is ``script``, with other values: complete and without comments."""
    config = Parsed(file if script is None else _core.inline_script(file, f"{name}.star", script)).to_dict()
    if script is not None:
        config["task"]["script"] = f"{name}.star"
    for place, value in changes.items():
        *above, last = key(place).split(".")
        at: Any = config
        for part in above:
            at = at.setdefault(part, {}) if isinstance(at, dict) else None
        if not isinstance(at, dict):
            bad_argument("changes", f"{place!r} leads through a value that has no keys", "`schema` explains what is where")
        at[last] = value
    return json.dumps(config, indent=2) + "\n"


def outcome(done: Done, what: str, n_generations: int, again: str) -> CallToolResult:
    """The end of a run or of several, or how far they came."""
    completed = [it for it in done.lines if "best" in it]
    ends = [it for it in done.lines if "state" in it]
    curve = table(completed, HISTORY, 6) if len({it["experiment"] for it in completed}) == 1 else None
    if done.is_over_budget and not (ends and done.exit_code == 0):
        last = {it["experiment"]: it["generation"] + 1 for it in completed}
        facts = {"state": "stopped by the budget", "generations_done": last, "generations": n_generations, "curve": curve}
        return answer(facts, f"{again} where this call has stopped")
    if not ends or done.exit_code != 0:
        raise of_program(done.exit_code, done.stderr, what)
    kept = [{key: it for key, it in end.items() if key != "champion_file"} for end in ends]
    number = ends[0]["experiment"]
    if len(kept) > 1:
        return answer({"runs": kept}, "`compare` this group with another one", f"picture(address=\"{number}\") shows the champion of the first")
    return answer(kept[0] | {"curve": curve}, f"picture(address=\"{number}\") shows the champion", f"evaluate(address=\"{number}\") tests it",
                  f"export(experiment=\"{number}\", file=...) keeps the proof")


def condition(found: dict[str, Any]) -> dict[str, Any]:
    """The main numbers of a condition."""
    def chosen(statistics: dict[str, Any]) -> dict[str, Any]:
        return {key: statistics.get(key) for key in MEASURED}

    measures = {name: chosen(it["time_mean"]) for name, it in found["metrics"].items()}
    return {"name": found["name"], "robots": found["robots"], "fitness": chosen(found["fitness"]), "measures": measures}
