"""A coordinator and its workers, as processes that end with the test."""

import os
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator

import swarmevo


class Fleet:
    """A coordinator on a free port, and workers."""

    def __init__(
        self, programs: Path, directory: Path, environment: dict[str, str], args: tuple[str, ...]
    ) -> None:
        self.programs, self.directory, self.environment = programs, directory, environment
        self.args = args
        self.processes: list[subprocess.Popen] = []
        self.listen = "127.0.0.1:0"
        self.url = self.start_coordinator()

    def start_coordinator(self) -> str:
        """Starts the coordinator. A restarted one gets the same port."""
        log = self.directory / f"coordinator-{len(self.processes)}.log"
        args = ["coordinator", "--listen", self.listen, "--data-dir", self.directory / "data",
                *self.args]
        self.coordinator = self._start(log, *args)
        give_up_at = time.monotonic() + 60
        while time.monotonic() < give_up_at and self.coordinator.poll() is None:
            for word in log.read_text().split():
                if word.startswith(("addr=", "address=", "listen=")):
                    self.listen = word.split("=", 1)[1].strip('"').removeprefix("http://")
                    return f"http://{self.listen}"
            time.sleep(0.02)
        raise AssertionError(log.read_text())

    def start_worker(self, name: str = "worker") -> subprocess.Popen:
        log = self.directory / f"{name}-{len(self.processes)}.log"
        args = ["worker", "--coordinator", self.url, "--name", name, "--slots", "1"]
        return self._start(log, *args)

    def _start(self, log: Path, program: str, *args: object) -> subprocess.Popen:
        with log.open("w") as output:
            process = subprocess.Popen(
                [self.programs / program, *map(str, args)],
                stdout=output, stderr=subprocess.STDOUT, env=os.environ | self.environment,
            )
        self.processes.append(process)
        return process

    def connect(self, **settings: object) -> swarmevo.Client:
        return swarmevo.connect(self.url, **settings)

    def stop(self) -> None:
        for process in self.processes:
            process.kill()
            process.wait()


@contextmanager
def fleet(programs: Path, directory: Path, *args: str, **environment: str) -> Iterator[Fleet]:
    """A fleet without workers; ``args`` are the coordinator's."""
    started = Fleet(programs, directory, environment, args)
    try:
        yield started
    finally:
        started.stop()
