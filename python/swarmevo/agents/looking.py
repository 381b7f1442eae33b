"""Tools that look at what there is, and compute nothing."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Annotated, Any

from mcp.types import CallToolResult
from pydantic import Field

from . import pages, places
from .answers import answer, table
from .examples import example, examples_of
from .failures import bad_argument
from .parameters import Address, Budgets, Experiment, File, Seconds, Where
from .places import Directory
from .program import Place, Program

PART_LEN = 6000
"""Characters of a long section in one answer."""
HISTORY = ("generation", "best", "mean", "min")


@dataclass
class Looking:
    """The tools of a server that only look."""

    directory: Directory
    program: Program
    budgets: Budgets

    async def docs(
        self, section: Annotated[str | None, Field(description="a page or a section, such as `tasks` or `tasks#the-language`")] = None,
        start: Annotated[int, Field(ge=0, description="the character to begin at, in a long section")] = 0,
    ) -> CallToolResult:
        """Read the manual: without `section` its pages and their sections, with it the text. Begin with `agents`; before you write a script, read `tasks`."""
        if section is None:
            return answer({"pages": pages.contents()}, "docs(section=\"agents\")")
        body, steps = pages.section(section)
        end = start + PART_LEN
        steps = [f"docs(section={json.dumps(section)}, start={end}) reads on"] if end < len(body) else steps
        return answer({"section": section, "text": body[start:end]}, *steps)

    async def examples(
        self, name: Annotated[str | None, Field(description="an example to read")] = None
    ) -> CallToolResult:
        """List the example experiments, or read one: its experiment file and the script of its task."""
        found = await examples_of(self.program)
        if name is None:
            rows = [[it["name"], it["about"]] for it in found]
            return answer({"examples": rows}, "examples(name=...) reads the one that is nearest to your task", "draft(name, task) copies it")
        texts = await example(self.program, name)
        return answer(texts, f"draft(name=..., task={name!r}, script=..., changes=...) writes your variant of it")

    async def schema(
        self, key: Annotated[str, Field(description="a place in an experiment file; NAME stands for a name of your choice: world.objects.NAME.num_instances")] = ""
    ) -> CallToolResult:
        """Explain one key of experiment files: meaning, values, range, default, and the keys below it. Without `key`: the top of the file."""
        found = await self.program.document("schema", f"--key={key}", where="key")
        return answer(found, "schema(key) of a key below it", "draft(changes={key: value}) sets a value")

    async def validate(self, file: File) -> CallToolResult:
        """Check an experiment file and its script, without running it: every mistake at once, with its line, and warnings."""
        return answer(*await self.checked(file))

    async def checked(self, file: str) -> tuple[dict[str, Any], str]:
        """What is wrong with a file, and the next step."""
        self.directory.experiment_file(file)
        [found] = await self.program.document("validate", "--", file, where=file, accept=(0, 2))
        if not found["ok"]:
            return found, "mend every problem, then validate again; `schema` explains a key, docs(section=\"tasks\") the language of scripts"
        if found["warnings"]:
            return found, "mend what the warnings name, unless you meant it; then `run` it"
        return found, f"run(file=\"{file}\", seconds=30)"

    async def experiments(self, place: Where = "here") -> CallToolResult:
        """List the experiments: number, name, state, generations, and what each champion is worth on trials that selected nothing."""
        found = await self.program.document("list", *self.program.of(place))
        columns = ("id", "name", "group", "state", "generations_done", "generations", "champion_fitness")
        return answer(table(found, columns, 40), "`explain`, `history` or `individual` of one of them; `compare` several")

    async def explain(self, experiment: Experiment, place: Where = "here") -> CallToolResult:
        """Explain the present state of an experiment: what it waits for, what is wrong, the next steps."""
        places.experiment(experiment)
        return answer(await self._explained(experiment, place), "`history` shows its generations, `individual` its champion")

    async def _explained(self, experiment: str, place: Place) -> dict[str, Any]:
        found = await self.program.document("explain", *self.program.of(place), "--", experiment, where=experiment)
        # Of a group, a list.
        return found if isinstance(found, dict) else {"experiments": found}

    async def follow(self, experiment: Experiment, seconds: Seconds = None, place: Where = "here") -> CallToolResult:
        """Wait until an experiment has ended, `seconds` at most, and say how far it is. The experiment goes on without you."""
        places.experiment(experiment)
        whole = max(1, round(self.budgets.within(seconds, 30)))
        await self.program.run("watch", "--quiet", "--for=ended", f"--timeout={whole}s", *self.program.of(place), "--", experiment, seconds=whole + 10)
        found = await self._explained(experiment, place)
        state = found.get("experiment", {}).get("state")
        return answer(found, "`individual` shows its champion" if state == "completed" else "`follow` again; the findings say what it waits for")

    async def history(
        self, experiment: Experiment, place: Where = "here",
        rows: Annotated[int, Field(ge=2, le=40, description="number of generations to show, evenly spaced")] = 12,
    ) -> CallToolResult:
        """Show how fitness rose: best, mean and least fitness of some generations, from the first to the last. `best` is the luck of few trials, never what a champion is worth."""
        places.experiment(experiment)
        found = await self.program.document("history", *self.program.of(place), "--", experiment, where=experiment)
        return answer(table(found, HISTORY, rows), "`individual` says what the champion is worth")

    async def individual(self, address: Address, place: Where = "here") -> CallToolResult:
        """Show an individual: what it is worth, and the network that it encodes. Only `judged` is an honest number: its trials selected nothing."""
        places.address(address)
        found = await self.program.document("individual", *self.program.of(place), "--", address, where=address)
        network = found.pop("network", {})
        found["genes"] = len(found.pop("genotype", ()))
        found["network"] = {key: len(it) if isinstance(it, (list, dict)) else it for key, it in network.items()}
        return answer(found, f"picture(address=\"{address}\") shows what it does", f"evaluate(address=\"{address}\") tests it under other conditions")

    async def compare(
        self, of: Annotated[list[str], Field(min_length=2, max_length=10, description="groups of runs, or numbers of experiments")],
        place: Where = "here",
    ) -> CallToolResult:
        """Compare groups of runs: median and interval of each, and how certain it is that one is better. Single runs prove nothing: compare groups of five seeds or more."""
        for name in map(places.experiment, of):
            if (self.directory.path / name).exists():
                bad_argument("of", f"{name!r} is a file; this tool compares experiments", "give numbers or names of `experiments`")
        if len(set(of)) < len(of):
            bad_argument("of", "a group or an experiment is given twice", "give each once")
        found = await self.program.document("compare", *self.program.of(place), "--", *of, where=", ".join(of))
        return answer(found, "if the intervals overlap, run more seeds before you conclude anything")
