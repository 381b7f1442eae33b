"""The experiments that are part of ``swarmctl``."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from .. import arguments
from .failures import Failure
from .program import Program


async def examples_of(program: Program) -> list[dict[str, Any]]:
    """Their names, and what each is about."""
    found: list[dict[str, Any]] = await program.document("examples")
    return found


async def example(program: Program, name: str, as_name: str | None = None) -> dict[str, str]:
    """The texts of an example, by the names of its files; ``as_name`` names the experiment."""
    try:
        arguments.known([name], [it["name"] for it in await examples_of(program)], "example")
    except ValueError as error:
        raise Failure("not_found", "task", str(error), "`examples` lists them with what each is about") from None
    with tempfile.TemporaryDirectory() as directory:
        there = Program(Path(directory), None)
        await there.document("new", f"--task={name}", "--", as_name or name)
        return {it.name: it.read_text(encoding="utf-8") for it in sorted(Path(directory).iterdir())}
