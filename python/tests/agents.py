"""An agent's side of the server, by the client of the official SDK."""

import json
import os
import shutil

import anyio
import pytest

pytest.importorskip("mcp")
from mcp import Client  # noqa: E402

from swarmevo.agents.answers import CHARACTERS_MAX  # noqa: E402


class Calls:
    """The calls of an agent, and what it read."""

    def __init__(self, client):
        self.client = client
        self.made = []

    async def __call__(self, tool, **arguments):
        """The text of an answer. Every answer is short, and says whether the call has succeeded."""
        answer = await self.client.call_tool(tool, arguments)
        texts = [it.text for it in answer.content if it.type == "text"]
        assert len(texts) == 1 and len(texts[0]) <= CHARACTERS_MAX, (tool, len(texts[0]))
        assert answer.is_error == texts[0].startswith('{"error"'), texts[0]
        self.made.append((tool, arguments, answer))
        return texts[0]

    async def facts(self, tool, **arguments):
        """The facts of an answer that has succeeded; there is a next step below them."""
        text = await self(tool, **arguments)
        body, _, steps = text.partition("\nnext: ")
        assert not text.startswith('{"error"') and steps, text
        return json.loads(body)

    async def error(self, tool, **arguments):
        """The error of an answer: each has a code, a message and a next step."""
        text = await self(tool, **arguments)
        assert text.startswith('{"error"'), text
        error = json.loads(text)["error"]
        assert list(error) == ["code", "where", "message", "next"] and error["code"] and error["message"] and error["next"]
        return error


def drive(server, script):
    """Runs an agent's script of calls against a server, in this process."""

    outcome, failures = [], []

    async def main():
        async with Client(server) as client:
            try:
                outcome.append(await script(Calls(client)))
            # Raised below, so that no group of exceptions hides it.
            except Exception as error:
                failures.append(error)

    anyio.run(main)
    if failures:
        raise failures[0]
    return outcome[0]


def put_on_path(monkeypatch, programs):
    """Lets the server find the programs that Cargo has built, unless the package has some."""
    if shutil.which("swarmctl") is None:
        monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
