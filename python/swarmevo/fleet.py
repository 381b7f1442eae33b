"""A coordinator and its fleet."""

from __future__ import annotations

import os
import time
import uuid
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Iterator, Mapping, Sequence, TypeVar
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments, protocol
from .champion import Champion, Genes
from .errors import ExperimentError, FleetError, FleetWarning, ForkError, refused
from .experiment import Experiment, as_experiment
from .extras import needs
from .generations import Generation, of_message
from .progress import shown
from .records import RecordedRun, Records, config_json, problems_of
from .settings import Settings
from .trials import TRIALS_MAX, AnyTrialSet, TrialSet

if TYPE_CHECKING:
    import pandas

Floats = NDArray[np.float64]
T = TypeVar("T")

REQUEST_LEN_MAX = 7 << 20
"""Bytes of genes in one request; a coordinator accepts 8 MiB."""
IN_FLIGHT_MAX = 8
"""Requests of an evaluation that a coordinator has at a time: it holds 256 MiB of all clients, and refuses the rest."""
VALUES_MAX = 1 << 21
"""Genotypes times trials in one request."""
DEADLINE_S = 30.0
PAUSE_S = 1.0
SILENCE_MAX_S = 2.0
"""The longest silent wait for workers."""
TRANSIENT = ("UNAVAILABLE", "DEADLINE_EXCEEDED", "ABORTED", "RESOURCE_EXHAUSTED")
"""Transient errors; every request can be repeated. The last one: the coordinator has too much to do."""
ENDS = ("completed", "failed", "cancelled")


def connect(
    coordinator: str | None = None,
    *,
    token_file: str | None = None,
    tls_ca: str | None = None,
    tls_cert: str | None = None,
    tls_key: str | None = None,
    tls_domain: str | None = None,
    plaintext: bool = False,
    patience: float = 60.0,
) -> Client:
    """A client of a coordinator. Absent arguments come from the same places as for ``swarmctl``:
    the environment (``SWARM_COORDINATOR``, ``SWARM_CLIENT_TOKEN``, ``SWARM_TLS_CA``, ...), else
    the settings file, else ``http://127.0.0.1:7700`` without a token.

    ``patience``: the time in seconds for which the client repeats requests while the coordinator
    is unreachable or has too much to do.
    """
    if coordinator is not None:
        arguments.name_of(coordinator, "coordinator")
    given = Settings(coordinator, token_file, tls_ca, tls_cert, tls_key, tls_domain, plaintext)
    return Client(Settings.find(given), patience)


class Client(Records):
    """A connection to a coordinator; use :func:`connect`. Threads may share it."""

    def __init__(self, settings: Settings, patience: float = 60.0) -> None:
        with needs("fleet"):
            import google.protobuf
            import grpc

        self.address: str = settings.address
        """The coordinator's address."""
        self._process = os.getpid()
        self.patience = arguments.seconds(patience, "patience")
        url = urlsplit(self.address)
        if url.scheme not in ("http", "https") or not url.hostname:
            raise ValueError(
                f"the coordinator's address is http:// or https:// with host and port, not "
                f"{self.address!r}"
            )
        target = url.netloc if url.port else f"{url.netloc}:{443 if url.scheme == 'https' else 80}"
        token = settings.token()
        is_here = url.hostname in ("127.0.0.1", "::1", "localhost")
        if token and url.scheme != "https" and not is_here and not settings.plaintext:
            raise ValueError(
                f"the token would be sent to {url.hostname} unencrypted; use https:// and tls_ca, "
                f"or plaintext=True if every member of that network is trusted"
            )
        self._metadata = [("authorization", f"Bearer {token}")] if token else []
        options: list[tuple[str, Any]] = [
            # While a coordinator sends nothing, only pings show whether it is alive.
            ("grpc.keepalive_time_ms", 20_000),
            ("grpc.max_reconnect_backoff_ms", 2000),
            ("grpc.max_receive_message_length", 64 << 20),
            ("grpc.max_send_message_length", -1),
        ]
        if url.scheme == "https":
            if settings.tls_domain:
                options.append(("grpc.ssl_target_name_override", settings.tls_domain))

            def read(path: str | None) -> bytes | None:
                return None if path is None else Path(path).read_bytes()

            tls = grpc.ssl_channel_credentials(
                read(settings.tls_ca), read(settings.tls_key), read(settings.tls_cert)
            )
            self._channel = grpc.secure_channel(target, tls, options)
        else:
            self._channel = grpc.insecure_channel(target, options)

    def close(self) -> None:
        """Closes the connection."""
        self._channel.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def submit(
        self,
        experiment: Experiment | Mapping[str, Any] | str,
        *,
        name: str = "",
        seed: int | None = None,
        generations: int | None = None,
        priority: int | None = None,
        labels: Mapping[str, str] | None = None,
        request_id: str | None = None,
    ) -> FleetRun:
        """Submits an experiment to the fleet: an :class:`Experiment`, a file's text, or its content.
        ``name``, ``seed`` and ``generations`` replace the file's. The same ``request_id`` returns the same
        experiment. Raises :class:`ExperimentError` with all mistakes in the file."""
        arguments.name_of(name, "name")
        if name:
            experiment = as_experiment(experiment).replace(name=name)
        request: dict[str, Any] = {
            "request_id": arguments.name_of(request_id or str(uuid.uuid4()), "request_id"),
            "config_json": config_json(experiment),
            "default_name": "experiment",
            "labels": {
                arguments.name_of(key, "the key of a label"): arguments.name_of(value, f"label {key}")
                for key, value in (labels or {}).items()
            },
        }
        optional = {
            "seed": None if seed is None else arguments.whole(seed, "seed"),
            "generations": None if generations is None else arguments.whole(generations, "generations", 1),
            "priority": None if priority is None else _priority(priority),
        }
        request |= {key: value for key, value in optional.items() if value is not None}
        try:
            submitted = self._call("SubmitExperiment", **request)
        except FleetError as error:
            if error.code == "INVALID_ARGUMENT":
                raise ExperimentError(problems_of(str(error))) from None
            raise
        return self._run(submitted.experiment.id)

    def run(self, experiment: int | str) -> FleetRun:
        """See :meth:`Records.run`."""
        run = super().run(experiment)
        assert isinstance(run, FleetRun)
        return run

    def workers(self) -> pandas.DataFrame:
        """A row per connected worker."""
        with needs("data"):
            import pandas

        found = self._request("FleetService", "ListWorkers").workers
        names = ("id", "name", "slots", "items_in_flight", "results_per_second", "idle_share",
                 "draining", "distrusted")
        return pandas.DataFrame([[getattr(it, key) for key in names] for it in found], columns=names)

    def evaluate(
        self,
        experiment: Experiment,
        genotypes: Genes | Sequence[Champion],
        generation: AnyTrialSet = 0,
        *,
        trials: int | None = None,
        priority: int | None = None,
    ) -> Floats:
        """Fitness ``[P, T]`` of genotypes ``[P, d]`` (or ``[d]``: then ``[T]``), computed by the fleet: the
        bits of :meth:`Experiment.evaluate`, with the audits and repetitions of a generation. Without workers
        the call waits, and issues a :class:`FleetWarning` after two seconds.

        ``generation``: the generation of the trials, or a trial set other than that of evaluations.
        ``trials``: their number; the file's if absent. ``priority``: share of the fleet, 1 to 1000.
        """
        genes, is_one = experiment._genotypes(genotypes)
        n_trials = experiment.n_trials if trials is None else arguments.whole(trials, "trials", 1, TRIALS_MAX)
        request: dict[str, Any] = {
            "config_json": experiment.to_json(),
            "trials": _evolution_trials(TrialSet.of(generation)),
            "trial_count": n_trials,
        }
        if priority is not None:
            request["priority"] = _priority(priority)
        message = protocol.message("Genes")
        per_call = REQUEST_LEN_MAX // (8 * experiment.n_genes + 16)
        per_call = max(1, min(per_call, VALUES_MAX // max(1, n_trials)))
        parts = [genes[first : first + per_call] for first in range(0, len(genes), per_call)]
        if not parts:
            return np.empty((0, n_trials))
        asked = [
            request | {"genotypes": [message.FromString(it) for it in _core.encode_genes(part)]}
            for part in parts
        ]
        answers = self._in_parts("EvaluationService", "EvaluateFitness", asked)
        fitness = np.array([it.values for answer in answers for it in answer.fitness])
        return fitness[0] if is_one else fitness

    def _measured(self, config_json: str, genotype: Floats, trials: int) -> tuple[list[str], list[tuple[float, Floats]]]:
        """A genotype in trials of :meth:`TrialSet.evaluation`: names of the measures, and of each trial its fitness
        and its measures ``[steps, measures]``."""
        call, request_class = self._call_of("EvaluationService", "Evaluate", "unary_stream")
        request = request_class(config_json=config_json, genotype=genotype, trial_count=trials)

        def read() -> tuple[list[str], list[tuple[float, Floats]]]:
            names: list[str] = []
            measured: list[tuple[float, Floats]] = []
            for it in call(request, metadata=self._metadata):
                if it.WhichOneof("message") == "task":
                    names = list(it.task.metrics)
                else:
                    values = np.array(it.trial.values).reshape(-1, len(names)) if names else np.empty((0, 0))
                    measured.append((it.trial.fitness, values))
            return names, measured

        return self._patiently(read)

    def _run(self, experiment_id: int) -> FleetRun:
        return FleetRun(self, experiment_id)

    def _call(self, name: str, **request: Any) -> Any:
        return self._request("ExperimentService", name, **request)

    def _call_of(self, service: str, name: str, kind: str = "unary_unary") -> tuple[Any, Any]:
        """A call, and the class of its request."""
        if self._process != os.getpid():
            raise ForkError("this client is connected in another process; swarmevo.connect() makes one for this process")
        path, request_class, response_class = protocol.method(service, name)
        stub = getattr(self._channel, kind)
        return stub(path, request_class.SerializeToString, response_class.FromString), request_class

    def _request(self, service: str, name: str, **request: Any) -> Any:
        """The answer to one request, repeated after transient errors."""
        call, request_class = self._call_of(service, name)
        message = request_class(**request)
        return self._patiently(
            lambda: call(message, metadata=self._metadata, timeout=DEADLINE_S)
        )

    def _in_parts(self, service: str, name: str, requests: list[dict[str, Any]]) -> list[Any]:
        """Answers to requests without a time limit, some of which are under way together."""
        call, request_class = self._call_of(service, name)
        messages = [request_class(**request) for request in requests]
        waiting: list[Any] = []
        try:
            answers: list[Any] = []
            for i, message in enumerate(messages):
                unsent = messages[len(waiting) : i + IN_FLIGHT_MAX]
                waiting += [call.future(it, metadata=self._metadata) for it in unsent]

                def answer(i: int = i, message: Any = message) -> Any:
                    try:
                        return self._aloud(waiting[i])
                    except BaseException:
                        waiting[i].cancel()
                        waiting[i] = call.future(message, metadata=self._metadata)
                        raise

                answers.append(self._patiently(answer))
            return answers
        finally:
            # A caller that stops waiting cancels the work.
            for future in waiting:
                future.cancel()

    def _aloud(self, future: Any) -> Any:
        """The result of a call; warns if it waits for workers."""
        import grpc

        try:
            return future.result(timeout=SILENCE_MAX_S)
        except grpc.FutureTimeoutError:
            self._warn_without_workers(7)
            return future.result()

    def _warn_without_workers(self, stacklevel: int) -> None:
        try:
            has_workers = bool(self._request("FleetService", "ListWorkers").workers)
        except FleetError:
            # The waiting caller gets this error itself.
            return
        if not has_workers:
            warnings.warn(
                f"waiting for a worker: the coordinator at {self.address} has none; start one with "
                f"`worker --coordinator {self.address}`",
                FleetWarning,
                stacklevel=stacklevel,
            )

    def _patiently(self, attempt: Callable[[], T]) -> T:
        give_up_at = time.monotonic() + self.patience
        while True:
            try:
                with _errors(self.address):
                    return attempt()
            except FleetError as error:
                if error.code not in TRANSIENT or time.monotonic() >= give_up_at:
                    raise
                time.sleep(PAUSE_S)

    def __repr__(self) -> str:
        return f"<Client of {self.address}>"


class FleetRun(RecordedRun):
    """An experiment that a coordinator runs, or has run."""

    _records: Client

    def watch(self) -> Iterator[Generation]:
        """All generations, each once, beginning with completed ones, until the experiment has ended, even if
        the coordinator restarts. Issues a :class:`FleetWarning` if there are no workers."""
        self._warn_if_it_waits(4)
        yield from self._watched()

    def _warn_if_it_waits(self, stacklevel: int) -> None:
        if self.state not in ENDS:
            self._records._warn_without_workers(stacklevel)

    def _watched(self) -> Iterator[Generation]:
        client = self._records
        call, request_class = client._call_of("ExperimentService", "WatchExperiment", "unary_stream")
        request = request_class(experiment_id=self.id, from_sequence=1)
        is_over = False
        while not is_over:
            events = call(request, metadata=client._metadata)
            try:
                with _errors(client.address):
                    for response in events:
                        event = response.event
                        request.from_sequence = event.sequence + 1
                        kind = event.WhichOneof("kind")
                        if kind == "generation_completed":
                            yield of_message(event.generation_completed, event.at_ms)
                        elif kind == "state_changed":
                            is_over = protocol.states().get(event.state_changed.state) in ENDS
            except FleetError as error:
                if error.code not in TRANSIENT:
                    raise
            finally:
                events.cancel()
            if not is_over:
                time.sleep(PAUSE_S)
                # Raises if the coordinator does not come back.
                self.refresh()

    def wait(self, *, progress: bool = True) -> FleetRun:
        """Waits for its end. ``progress``: whether tqdm, if installed, shows the progress. Raises
        :class:`FleetError` if the experiment fails or is cancelled."""
        self._warn_if_it_waits(4)
        for _ in shown(self._watched(), self.name, progress, total=self.message.generations):
            pass
        state = self.state
        if state != "completed":
            raise FleetError(state.upper(), f"experiment {self.id} {state}: {self.message.reason}")
        return self

    def pause(self, reason: str = "") -> None:
        """Pauses the experiment until it is resumed. FleetError if it has ended."""
        self._records._call("PauseExperiment", experiment_id=self.id, reason=reason)

    def resume(self, generations: int | None = None) -> None:
        """Resumes a paused, failed or cancelled experiment; or extends a completed one to
        ``generations`` in total."""
        if generations is None:
            self._records._call("ResumeExperiment", experiment_id=self.id)
        else:
            self.extend(generations)

    def cancel(self) -> None:
        """Ends it."""
        self._records._call("CancelExperiment", experiment_id=self.id)

    def extend(self, generations: int) -> None:
        """The name of ``resume(generations)`` in earlier releases."""
        generations = arguments.whole(generations, "generations", 1)
        self._records._call("ExtendExperiment", experiment_id=self.id, generations=generations)

    def set_priority(self, priority: int) -> None:
        """Sets its share of the fleet relative to other experiments, 1 to 1000."""
        self._records._call("SetPriority", experiment_id=self.id, priority=_priority(priority))


def _priority(priority: int) -> int:
    return arguments.whole(priority, "priority", 1, 1000)


@contextmanager
def _errors(address: str) -> Iterator[None]:
    """Errors of gRPC as :class:`FleetError`."""
    import grpc

    try:
        yield
    except grpc.RpcError as error:
        code = error.code()
        name = "UNKNOWN" if code is None else code.name
        text = error.details() or name
        raise refused(name, text if name != "UNAVAILABLE" else f"{address}: {text}") from None


def _evolution_trials(trial_set: TrialSet) -> Any:
    message = protocol.message("EvolutionTrials")
    if trial_set.kind == "generation":
        return message(generation=trial_set.generation)
    if trial_set.kind == "judgement":
        return message(judgement=trial_set.generation)
    if trial_set.kind == "held_out":
        comparison = protocol.message("ComparisonTrials")
        return message(
            comparison=comparison(generation=trial_set.generation, block=trial_set.block)
        )
    raise ValueError(f"the fleet computes trials of an evolution, not {trial_set}")
