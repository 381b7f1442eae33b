"""The server: its tools, its pages, and what it answers to calls that it does not understand."""

from __future__ import annotations

import difflib
import json
from pathlib import Path
from typing import Any

from mcp.server.mcpserver import Context, MCPServer
from mcp.server.mcpserver.exceptions import ResourceNotFoundError, ToolError, UnexpectedToolError
from mcp.types import CallToolResult, InputRequiredResult, ToolAnnotations
from pydantic import ValidationError

from .. import __version__
from . import pages
from .acting import Controlling, Submitting
from .answers import refusal
from .computing import Computing
from .failures import Failure
from .looking import Looking
from .parameters import Budgets
from .places import Directory
from .program import Program

INSTRUCTIONS = """Evolves controllers for robot swarms. Order: examples, draft, validate (until ok), run (short), individual \
and picture (does the swarm do what was meant?), evaluate (under other conditions), then more generations and five seeds or \
more, compare, export, verify. Only `judged` says what a champion is worth; `best` is luck. Every answer ends with a next \
step; every error has a code, a place, a message and a next step. docs(section="agents") explains costs and proofs."""

FLAGS = {"submit": "--allow-submit", "fork_on_fleet": "--allow-submit", "control": "--allow-control"}
LOOKING = ("docs", "examples", "schema", "validate", "experiments", "explain", "follow", "history", "individual", "compare")
COMPUTING = ("draft", "run", "resume", "fork", "evaluate", "picture", "export", "verify")


class Server(MCPServer[Any]):
    """A server that explains what is wrong with a call."""

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context[Any, Any] | None = None
    ) -> CallToolResult | InputRequiredResult:
        """The answer of a tool, or what an agent should do instead."""
        tools = {it.name: it for it in await self.list_tools()}
        try:
            if name not in tools:
                raise _unknown(name, list(tools))
            _known(arguments, list(tools[name].input_schema.get("properties", {})), name)
            return await super().call_tool(name, arguments, context)
        except Failure as failure:
            return refusal(failure)
        except UnexpectedToolError as error:
            cause = error.__cause__
            if not isinstance(cause, Failure):
                raise
            return refusal(cause)
        except ToolError as error:
            cause = error.__cause__
            if not isinstance(cause, ValidationError):
                raise
            return refusal(_invalid(cause, name))


def server(
    directory: str | Path, *, coordinator: str | None = None, allow_submit: bool = False, allow_control: bool = False,
    budgets: Budgets = Budgets(),
) -> Server:
    """A server that works in ``directory``, and on the fleet of ``coordinator``."""
    there = Directory(Path(directory))
    common = (there, Program(there.path, coordinator), budgets)
    made = Server("swarmevo", instructions=INSTRUCTIONS, version=__version__, log_level="WARNING")
    _add(made, Looking(*common), LOOKING, ToolAnnotations(read_only_hint=True, open_world_hint=False))
    _add(made, Computing(*common), COMPUTING, ToolAnnotations(read_only_hint=False, destructive_hint=False, open_world_hint=False))
    if allow_submit:
        _add(made, Submitting(*common), ("submit", "fork_on_fleet"), ToolAnnotations(read_only_hint=False, destructive_hint=False))
    if allow_control:
        _add(made, Controlling(*common), ("control",), ToolAnnotations(read_only_hint=False, destructive_hint=True))
    for page in pages.names():
        _add_page(made, page)
    return made


def _add(made: Server, tools: object, names: tuple[str, ...], annotations: ToolAnnotations) -> None:
    for name in names:
        made.add_tool(getattr(tools, name), annotations=annotations, structured_output=False)


def _add_page(made: Server, page: str) -> None:
    def read() -> str:
        try:
            return pages.text(page)
        except Failure as failure:
            raise ResourceNotFoundError(failure.message) from None

    title = pages.sections(pages.text(page))[0][0]
    made.resource(f"swarmevo://docs/{page}", name=page, title=title, mime_type="text/markdown")(read)


def _unknown(name: str, tools: list[str]) -> Failure:
    if flag := FLAGS.get(name):
        return Failure("not_allowed", name, f"this server was started without {flag}", f"ask a person whether to start swarmevo-mcp with {flag}; `run` computes here")
    return Failure("bad_argument", name, f"there is no tool {name!r}; there are: {', '.join(tools)}", "call one of these")


def _known(arguments: dict[str, Any], names: list[str], tool: str) -> None:
    for name in arguments:
        if name not in names:
            close = difflib.get_close_matches(name, names, 1)
            meant = f"; did you mean `{close[0]}`?" if close else ""
            raise Failure("bad_argument", name, f"`{tool}` has no argument {name!r}{meant}", f"its arguments are: {', '.join(names)}")


def _invalid(error: ValidationError, tool: str) -> Failure:
    """All invalid arguments of a call."""
    lines = []
    for it in error.errors(include_url=False):
        place = ".".join(str(part) for part in it["loc"])
        given = "" if it["type"] == "missing" else f", not {json.dumps(it['input'], default=str)[:80]}"
        lines.append(f"{place}: {it['msg'][:1].lower()}{it['msg'][1:]}{given}")
    wheres = ", ".join(dict.fromkeys(str(it["loc"][0]) for it in error.errors() if it["loc"]))
    return Failure("bad_argument", wheres, "\n".join(lines), f"mend these arguments of `{tool}`, and call again")
