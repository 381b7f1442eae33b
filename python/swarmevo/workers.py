"""Workers inside running engines: executors, Dask, Ray.

A worker is a thread of this package in a process of the engine; no program must be copied.
"""

from __future__ import annotations

import logging
import os
import socket
import threading
import time
import uuid
from concurrent import futures
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any, Callable, Protocol, Union, cast

from . import _core, arguments
from .settings import Settings

log = logging.getLogger(__name__)

POLL_S = 0.2
WORKERS_MAX = 100_000
PAUSE_MIN_S, PAUSE_MAX_S = 0.5, 30.0

_stopping: dict[str, threading.Event] = {}
"""Stop events of the :class:`Workers` in this process, by key."""


class Submits(Protocol):
    """An executor of ``concurrent.futures``, or a client of Dask."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **options: Any) -> Any:
        """Calls ``fn`` on some worker of the engine."""


Engine = Union[Submits, ModuleType]
"""An engine of workers: an executor, a Dask client, or the module ``ray``."""


def workers(
    where: Engine,
    n: int,
    coordinator: str | None = None,
    *,
    slots: int = 1,
    name: str = "swarmevo",
    turn: float = 60.0,
    token_file: str | None = None,
    tls_ca: str | None = None,
    tls_cert: str | None = None,
    tls_key: str | None = None,
    tls_domain: str | None = None,
    plaintext: bool = False,
) -> Workers:
    """Keeps n workers alive inside a ``concurrent.futures`` executor, a Dask cluster (its
    client) or a Ray cluster (the module ``ray``, after ``ray.init``).

    Each worker is a task that occupies a thread or process of the engine and computes ``slots``
    items at the same time. After ``turn`` seconds it leaves, and another task takes its place, so
    workers end soon after this process does. If a node is lost, its worker is started again, and
    other workers compute its items.

    An executor of processes must spawn its processes: a forked process would share the
    connections of this process, and disturb them. ``ProcessPoolExecutor(4, mp_context=get_context("spawn"))``.

    ``coordinator``: its address, which the workers' nodes must reach. All settings
    but the token have the defaults of :func:`connect`. The token is that of workers: this process
    reads it from ``SWARM_WORKER_TOKEN`` or the file that ``SWARM_WORKER_TOKEN_FILE`` names. Workers read
    TLS files on their own nodes.
    """
    n = arguments.whole(n, "n, the number of workers,", 1, WORKERS_MAX)
    slots = arguments.whole(slots, "slots", 1, 1024)
    arguments.name_of(name, "name")
    turn = arguments.seconds(turn, "turn")
    given = Settings(coordinator, None, tls_ca, tls_cert, tls_key, tls_domain, plaintext)
    settings = Settings.find(given)
    token_file = token_file or os.environ.get("SWARM_WORKER_TOKEN_FILE")
    token = Path(token_file).read_text() if token_file else os.environ.get("SWARM_WORKER_TOKEN")
    tls = (settings.tls_ca, settings.tls_cert, settings.tls_key, settings.tls_domain,
           settings.plaintext)
    key = str(uuid.uuid4())
    places = [
        _Place((key, settings.address, f"{name}-{index}", slots, token, tls, turn))
        for index in range(n)
    ]
    return Workers(_adapter(where, slots), key, places)


def serve(
    key: str,
    coordinator: str,
    name: str,
    slots: int,
    token: str | None,
    tls: tuple[str | None, str | None, str | None, str | None, bool],
    turn: float,
) -> None:
    """Runs a worker for ``turn`` seconds, or until the :class:`Workers` of this key in this
    process stop. Engines call it."""
    stopping = _stopping.get(key) or threading.Event()
    worker = _core.Worker(coordinator, f"{name}-{socket.gethostname()}", slots, token, tls)
    leave_at = time.monotonic() + turn
    try:
        while worker.is_alive() and time.monotonic() < leave_at and not stopping.wait(POLL_S):
            pass
    finally:
        # The worker finishes its items and delivers the results.
        worker.stop()
        worker.join()


@dataclass
class _Place:
    """One of the n workers."""

    arguments: tuple[Any, ...]
    task: Any = None
    n_failures: int = 0
    not_before: float = 0.0


class _Adapter(Protocol):
    def start(self, place: _Place) -> Any: ...

    def ended(self, task: Any) -> bool: ...

    def check(self, task: Any) -> None: ...


class Workers:
    """A fixed number of live workers; use :func:`workers`. A context manager, which stops them at
    its end."""

    def __init__(self, adapter: _Adapter, key: str, places: list[_Place]) -> None:
        self._adapter, self._key, self._places = adapter, key, places
        self._stopped = _stopping[key] = threading.Event()
        self.problem: str | None = None
        """The reason why the latest worker ended unexpectedly, for example a lost node or a
        refusal by the coordinator."""
        self._keeper = threading.Thread(target=self._keep, name="swarmevo-workers", daemon=True)
        self._keeper.start()

    @property
    def n_running(self) -> int:
        """Number of tasks that the engine runs or will start."""
        return sum(place.task is not None for place in self._places)

    def stop(self, wait: bool = True) -> None:
        """Tells all workers to finish their items and to leave: in this process at once, in others
        at the end of their turns. ``wait``: whether to wait until they have left."""
        self._stopped.set()
        if wait:
            self._keeper.join()

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def _keep(self) -> None:
        while not (self._stopped.is_set() and self.n_running == 0):
            for place in self._places:
                self._look_after(place)
            time.sleep(POLL_S)
        del _stopping[self._key]

    def _look_after(self, place: _Place) -> None:
        try:
            if place.task is not None and self._adapter.ended(place.task):
                task, place.task = place.task, None
                self._adapter.check(task)
                place.n_failures = 0
            is_due = not self._stopped.is_set() and time.monotonic() >= place.not_before
            if place.task is None and is_due:
                place.task = self._adapter.start(place)
        except Exception as error:
            place.n_failures += 1
            pause = min(PAUSE_MIN_S * 2**place.n_failures, PAUSE_MAX_S)
            place.not_before = time.monotonic() + pause
            self.problem = f"{place.arguments[2]}: {error or type(error).__name__}"
            log.warning("worker ended; trying again in %.0f s: %s", pause, self.problem)

    def __repr__(self) -> str:
        return f"<Workers: {self.n_running} of {len(self._places)}>"


class _OfExecutor:
    """Futures of ``concurrent.futures`` and of Dask."""

    def __init__(self, executor: Submits) -> None:
        if _forks(executor):
            raise ValueError(
                "this executor forks its processes, which would share the connections of this process; "
                'give it mp_context=multiprocessing.get_context("spawn")'
            )
        self._executor = executor
        self._is_dask = type(executor).__module__.split(".")[0] == "distributed"

    def start(self, place: _Place) -> Any:
        # Dask treats calls with equal arguments as one.
        options = {"pure": False} if self._is_dask else {}
        return self._executor.submit(serve, *place.arguments, **options)

    def ended(self, task: Any) -> bool:
        return bool(task.done())

    def check(self, task: Any) -> None:
        task.result()


def _forks(executor: Submits) -> bool:
    # No public attribute tells how a pool starts its processes.
    context = getattr(executor, "_mp_context", None)
    return isinstance(executor, futures.ProcessPoolExecutor) and (
        context is not None and context.get_start_method() == "fork"
    )


class _OfRay:
    def __init__(self, ray: Any, slots: int) -> None:
        self._ray = ray
        self._serve = ray.remote(num_cpus=slots, max_retries=0)(serve)

    def start(self, place: _Place) -> Any:
        return self._serve.remote(*place.arguments)

    def ended(self, task: Any) -> bool:
        return bool(self._ray.wait([task], timeout=0)[0])

    def check(self, task: Any) -> None:
        self._ray.get(task)


def _adapter(where: Engine, slots: int) -> _Adapter:
    if isinstance(where, ModuleType):
        if where.__name__ != "ray":
            raise TypeError(f"workers run in an executor, a client of Dask or ray, not {where}")
        return _OfRay(where, slots)
    if not callable(getattr(where, "submit", None)):
        raise TypeError(f"workers run in an executor, a client of Dask or ray, not {where}")
    return _OfExecutor(cast(Submits, where))
