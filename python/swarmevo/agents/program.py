"""Calls of ``swarmctl``: within a time, with bounded output, ended when the caller leaves."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, AsyncIterator, Awaitable, Callable, Literal

import anyio
from anyio.abc import ByteReceiveStream, Process

from .failures import Failure, of_program

Place = Literal["here", "fleet"]
OnLine = Callable[[dict[str, Any]], Awaitable[None]]

OUTPUT_MAX = 16 << 20
"""Bytes of output that are read."""
GRACE_S = 10.0
"""Time in which an interrupted program stores what is complete."""
DATA = "swarm-data"
"""The data directory of small runs."""
PLACES = ("SWARM_DATA_DIR", "SWARM_COORDINATOR")
"""Variables that say where commands work. Only the arguments of a call may, because only they are what a person has
permitted: with a coordinator in the environment, ``verify`` would compute on its fleet."""


@dataclass
class Done:
    """A call that has ended, or was ended with its budget."""

    exit_code: int
    stderr: str = ""
    lines: list[dict[str, Any]] = field(default_factory=list)
    """Objects of an output with an object per line."""
    tail: bytes = b""
    """What is no whole line yet; or the document, of an output that is one."""
    is_over_budget: bool = False
    is_too_long: bool = False


@dataclass
class Program:
    """``swarmctl`` in a working directory."""

    directory: Path
    coordinator: str | None
    """The address of a fleet, if there is one."""
    _computing: anyio.Semaphore = field(default_factory=lambda: anyio.Semaphore(1))

    def of(self, place: Place) -> list[str]:
        """The arguments that say where experiments are."""
        if place == "here":
            if not (self.directory / DATA).is_dir():
                raise Failure("not_found", "place", "nothing has run here yet", "`run` an experiment file; or name place=\"fleet\"")
            return [f"--data-dir={DATA}"]
        if self.coordinator is None:
            raise Failure("no_fleet", "place", "this server knows no coordinator", "use place=\"here\"; or ask a person to start swarmevo-mcp with --coordinator URL")
        return [f"--coordinator={self.coordinator}"]

    @asynccontextmanager
    async def computing(self) -> AsyncIterator[None]:
        """One computation at a time, because each of them uses all processors."""
        try:
            self._computing.acquire_nowait()
        except anyio.WouldBlock:
            raise Failure("busy", "", "another call computes here", "call again when that call has answered") from None
        try:
            yield
        finally:
            self._computing.release()

    async def document(self, *args: str, where: str = "", seconds: float = 30, accept: tuple[int, ...] = (0,)) -> Any:
        """The document that a short command prints."""
        done = await self.run(*args, seconds=seconds)
        if done.is_over_budget:
            raise Failure("budget", where, f"no answer within {seconds:g} s", "ask for less at once, or give more `seconds`")
        if done.exit_code not in accept or not done.tail.strip():
            raise of_program(done.exit_code, done.stderr, where)
        return json.loads(done.tail)

    async def run(self, *args: str, seconds: float, on_line: OnLine | None = None) -> Done:
        """Runs a command, and interrupts it when its time is over. ``on_line`` gets every object of an output
        with an object per line."""
        command = [swarmctl(), *args[:1], "--output=json", *args[1:]]
        environment = {key: it for key, it in os.environ.items() if key not in PLACES}
        # A session of its own: Ctrl-C of a terminal is for this process.
        process = await anyio.open_process(command, cwd=self.directory, env=environment, start_new_session=True, stdin=subprocess.DEVNULL)
        done = Done(0)
        try:
            with anyio.move_on_after(seconds) as budget:
                await self._read(process, done, on_line)
            if budget.cancelled_caught:
                done.is_over_budget = True
                process.send_signal(signal.SIGINT)
                with anyio.move_on_after(GRACE_S):
                    await self._read(process, done, on_line)
        finally:
            await _end(process)
        if done.is_too_long:
            raise Failure("budget", "", f"the answer has more than {OUTPUT_MAX >> 20} MiB", "ask for less at once")
        done.exit_code = -1 if process.returncode is None else process.returncode
        done.stderr = done.stderr.replace(f"{self.directory}/", "")
        return done

    async def _read(self, process: Process, done: Done, on_line: OnLine | None) -> None:
        assert process.stdout is not None and process.stderr is not None

        async def errors(stream: ByteReceiveStream) -> None:
            async for chunk in stream:
                done.stderr = (done.stderr + chunk.decode(errors="replace"))[-200_000:]

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(errors, process.stderr)
            if on_line is None:
                await _document(process.stdout, done)
            else:
                await _lines(process.stdout, done, on_line)
            if done.is_too_long:
                process.kill()
            await process.wait()


async def _document(stream: ByteReceiveStream, done: Done) -> None:
    async for chunk in stream:
        done.tail += chunk
        if len(done.tail) > OUTPUT_MAX:
            done.is_too_long = True
            return


async def _lines(stream: ByteReceiveStream, done: Done, on_line: OnLine) -> None:
    async for chunk in stream:
        *lines, done.tail = (done.tail + chunk).split(b"\n")
        for line in lines:
            done.lines.append(json.loads(line))
            await on_line(done.lines[-1])
        if len(done.tail) > OUTPUT_MAX:
            done.is_too_long = True
            return


async def _end(process: Process) -> None:
    """Ends a process that still runs, because its caller has left or it did not stop."""
    with anyio.CancelScope(shield=True):
        if process.returncode is None:
            process.send_signal(signal.SIGINT)
            with anyio.move_on_after(2):
                await process.wait()
        if process.returncode is None:
            process.kill()
            await process.wait()
        await process.aclose()


def swarmctl() -> str:
    """The path of the program, which is beside Python's if the package is installed with it."""
    beside = os.path.dirname(sys.executable)
    found = shutil.which("swarmctl", path=os.pathsep.join([beside, os.environ.get("PATH", os.defpath)]))
    if found is None:
        raise Failure("no_program", "", "swarmctl is not installed beside this package, nor on the path", "ask a person to install the wheel of swarmevo with its programs")
    return found
