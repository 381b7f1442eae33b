#!/usr/bin/env python3
"""Submits an experiment file to a coordinator and follows it to its end.

First install the requirements, and generate the Python code of the protocol:

    pip install -r client/examples/requirements.txt
    python -m grpc_tools.protoc -I proto --python_out=client/examples \\
        --grpc_python_out=client/examples proto/swarm/v1/experiment.proto

    python client/examples/submit.py configs/quickstart.json --seed 7

docs/clients.md explains this program. Its exit codes are those of swarmctl (docs/swarmctl.md).
"""

import argparse
import os
import sys
import time
import uuid
from pathlib import Path
from typing import Callable, TypeVar
from urllib.parse import urlsplit

import grpc
from grpc import StatusCode

from swarm.v1 import experiment_pb2 as pb
from swarm.v1.experiment_pb2_grpc import ExperimentServiceStub

Response = TypeVar("Response")

# Transient errors. Every request can be repeated safely.
TRANSIENT = (
    StatusCode.UNAVAILABLE, StatusCode.DEADLINE_EXCEEDED,
    StatusCode.RESOURCE_EXHAUSTED, StatusCode.ABORTED,
)
# All other errors exit with 1.
EXIT_CODES = {
    StatusCode.INVALID_ARGUMENT: 2,
    StatusCode.NOT_FOUND: 3, StatusCode.FAILED_PRECONDITION: 3,
    StatusCode.UNAVAILABLE: 4, StatusCode.DEADLINE_EXCEEDED: 4,
    StatusCode.UNAUTHENTICATED: 7, StatusCode.PERMISSION_DENIED: 7,
    StatusCode.UNIMPLEMENTED: 9,
}
ENDS = {
    pb.EXPERIMENT_STATE_COMPLETED: 0,
    pb.EXPERIMENT_STATE_FAILED: 5, pb.EXPERIMENT_STATE_CANCELLED: 6,
}
DEADLINE_S = 30  # of one request
PAUSE_S = 1  # between attempts


class Coordinator:
    """A coordinator that may be unreachable for a while."""

    def __init__(self, args: argparse.Namespace) -> None:
        url = urlsplit(args.coordinator)
        token = os.environ.get("SWARM_CLIENT_TOKEN")
        if args.token_file:
            token = args.token_file.read_text().strip()
        is_here = url.hostname in ("127.0.0.1", "::1", "localhost")
        if token and url.scheme != "https" and not is_here:
            raise ValueError("the token would be sent unencrypted; use https:// and --tls-ca")
        options = [
            # While a coordinator sends nothing, only pings show whether it is alive.
            ("grpc.keepalive_time_ms", 20_000),
            ("grpc.max_reconnect_backoff_ms", 2000),
            ("grpc.max_receive_message_length", 64 << 20),
        ]
        if url.scheme == "https":
            tls = grpc.ssl_channel_credentials(args.tls_ca.read_bytes() if args.tls_ca else None)
            channel = grpc.secure_channel(url.netloc, tls, options)
        else:
            channel = grpc.insecure_channel(url.netloc, options)
        self.stub = ExperimentServiceStub(channel)
        self.metadata = [("authorization", f"Bearer {token}")] if token else []
        self.patience_s: float = args.patience

    def call(self, method: Callable[..., Response], request: object) -> Response:
        """The answer to one request, repeated while the coordinator is unreachable."""
        give_up_at = time.monotonic() + self.patience_s
        while True:
            try:
                return method(request, metadata=self.metadata, timeout=DEADLINE_S)
            except grpc.RpcError as error:
                if error.code() not in TRANSIENT or time.monotonic() >= give_up_at:
                    raise
                remark(f"{error.details()}; trying again")
                time.sleep(PAUSE_S)

    def follow(self, experiment: pb.Experiment) -> None:
        """Prints every generation once, even if the stream breaks."""
        get = pb.GetExperimentRequest(experiment_id=experiment.id)
        watch = pb.WatchExperimentRequest(experiment_id=experiment.id, from_sequence=1)
        is_over = False
        while not is_over:
            try:
                for response in self.stub.WatchExperiment(watch, metadata=self.metadata):
                    event = response.event
                    watch.from_sequence = event.sequence + 1
                    kind = event.WhichOneof("kind")
                    if kind == "generation_completed":
                        done = event.generation_completed
                        print(f"{done.generation + 1}/{experiment.generations}  "
                              f"best {done.best:.3f}  mean {done.mean:.3f}  "
                              f"digest {done.digest[:12]}", flush=True)
                    elif kind == "state_changed":
                        is_over = event.state_changed.state in ENDS
            except grpc.RpcError as error:
                if error.code() not in TRANSIENT:
                    raise
                remark(f"{error.details()}; following on from event {watch.from_sequence}")
            if not is_over:
                time.sleep(PAUSE_S)
                self.call(self.stub.GetExperiment, get)


def run(args: argparse.Namespace) -> int:
    coordinator = Coordinator(args)
    stub = coordinator.stub
    submission = pb.SubmitExperimentRequest(
        request_id=args.request_id,
        config_json=args.file.read_text(),
        default_name=args.file.stem,
        seed=args.seed,
        generations=args.generations,
    )
    experiment = coordinator.call(stub.SubmitExperiment, submission).experiment
    print(f"experiment {experiment.id} ({experiment.name}), seed {experiment.seed}", flush=True)

    coordinator.follow(experiment)
    get = pb.GetExperimentRequest(experiment_id=experiment.id)
    experiment = coordinator.call(stub.GetExperiment, get).experiment
    if experiment.generations_done > 0:
        by_id = pb.GetChampionRequest(experiment_id=experiment.id)
        champion = coordinator.call(stub.GetChampion, by_id)
        line = f"champion of generation {champion.generation}"
        if champion.HasField("judged"):  # not if it was cancelled or has failed
            judged = champion.judged
            line += f": fitness {judged.mean:.6f}, 95 % {judged.low:.6f} to {judged.high:.6f}"
        print(line)
    print(f"digest {experiment.digest}")
    if experiment.reason:
        remark(experiment.reason)
    return ENDS.get(experiment.state, 1)


def remark(text: str) -> None:
    print(text, file=sys.stderr)


def main() -> int:
    parser = argparse.ArgumentParser(description="Submits an experiment file and follows it.")
    option = parser.add_argument
    option("file", type=Path, help="the experiment file")
    option("--coordinator", default=os.environ.get("SWARM_COORDINATOR", "http://127.0.0.1:7700"),
           metavar="URL", help="http:// or https:// [%(default)s]")
    option("--seed", type=int, help="instead of the file's")
    option("--generations", type=int, help="instead of the file's")
    option("--token-file", type=Path, help="or the token itself in SWARM_CLIENT_TOKEN")
    option("--tls-ca", type=Path, help="PEM file of the authority to trust [public ones]")
    option("--request-id", default=str(uuid.uuid4()), help="a repeated id returns the same experiment")
    option("--patience", type=float, default=60, help="seconds to wait for the coordinator [60]")
    args = parser.parse_args()
    try:
        return run(args)
    except (OSError, ValueError) as error:
        remark(f"error: {error}")
        return 2
    except grpc.RpcError as error:
        # INVALID_ARGUMENT has a line for every mistake in the file.
        about = args.file if error.code() == StatusCode.INVALID_ARGUMENT else args.coordinator
        for line in (error.details() or "").splitlines():
            remark(f"{about}: {line}")
        return EXIT_CODES.get(error.code(), 1)
    except KeyboardInterrupt:
        remark("interrupted; the experiment continues")
        return 130


if __name__ == "__main__":
    sys.exit(main())
