#!/usr/bin/env python3
"""Submits an experiment file to a coordinator and follows it to its end.

Once: install what it needs, and generate the Python side of the protocol.

    pip install -r client/examples/requirements.txt
    python -m grpc_tools.protoc -I proto --python_out=client/examples \\
        --grpc_python_out=client/examples proto/swarm/v1/experiment.proto

    python client/examples/submit.py configs/quickstart.json --seed 7

docs/clients.md explains it. Exit codes are those of swarmctl: docs/swarmctl.md.
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

# What may pass without anybody's doing. Every request can be repeated safely.
TRANSIENT = (StatusCode.UNAVAILABLE, StatusCode.DEADLINE_EXCEEDED, StatusCode.RESOURCE_EXHAUSTED, StatusCode.ABORTED)
EXIT_CODES = {
    StatusCode.INVALID_ARGUMENT: 2,
    StatusCode.NOT_FOUND: 3,
    StatusCode.FAILED_PRECONDITION: 3,
    StatusCode.UNAVAILABLE: 4,
    StatusCode.DEADLINE_EXCEEDED: 4,
    StatusCode.UNAUTHENTICATED: 7,
    StatusCode.PERMISSION_DENIED: 7,
    StatusCode.UNIMPLEMENTED: 9,
}
EXIT_CODES_OF_ENDS = {
    pb.EXPERIMENT_STATE_COMPLETED: 0,
    pb.EXPERIMENT_STATE_FAILED: 5,
    pb.EXPERIMENT_STATE_CANCELLED: 6,
}
DEADLINE_S = 30  # of one request
PAUSE_S = 1  # between attempts


class Coordinator:
    """A coordinator that may go away for a while and come back."""

    def __init__(self, args: argparse.Namespace) -> None:
        url = urlsplit(args.coordinator)
        token = args.token_file.read_text().strip() if args.token_file else os.environ.get("SWARM_CLIENT_TOKEN")
        if token and url.scheme != "https" and url.hostname not in ("127.0.0.1", "::1", "localhost"):
            raise ValueError("the token would travel unencrypted; use https:// and --tls-ca")
        options = [
            ("grpc.keepalive_time_ms", 20_000),  # Only pings tell a patient coordinator from a dead one.
            ("grpc.max_reconnect_backoff_ms", 2000),
            ("grpc.max_receive_message_length", 64 << 20),
        ]
        if url.scheme == "https":
            authorities = args.tls_ca.read_bytes() if args.tls_ca else None
            channel = grpc.secure_channel(url.netloc, grpc.ssl_channel_credentials(authorities), options)
        else:
            channel = grpc.insecure_channel(url.netloc, options)
        self.stub = ExperimentServiceStub(channel)
        self.metadata = [("authorization", f"Bearer {token}")] if token else []
        self.patience_s: float = args.patience

    def call(self, method: Callable[..., Response], request: object) -> Response:
        """One answer to one request, which is repeated while the coordinator is away."""
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
        """Prints every generation once, also across breaks of the stream."""
        next_sequence, is_over = 1, False
        while not is_over:
            request = pb.WatchExperimentRequest(experiment_id=experiment.id, from_sequence=next_sequence)
            try:
                for response in self.stub.WatchExperiment(request, metadata=self.metadata):
                    event = response.event
                    next_sequence = event.sequence + 1
                    kind = event.WhichOneof("kind")
                    if kind == "generation_completed":
                        print_generation(event.generation_completed, experiment.generations)
                    elif kind == "state_changed":
                        is_over = event.state_changed.state in EXIT_CODES_OF_ENDS
            except grpc.RpcError as error:
                if error.code() not in TRANSIENT:
                    raise
                remark(f"{error.details()}; following on from event {next_sequence}")
            if not is_over:
                time.sleep(PAUSE_S)
                self.call(self.stub.GetExperiment, pb.GetExperimentRequest(experiment_id=experiment.id))


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
        champion = coordinator.call(stub.GetChampion, pb.GetChampionRequest(experiment_id=experiment.id))
        print(f"champion of generation {champion.generation}: fitness {experiment.champion_fitness:.6f}")
    print(f"digest {experiment.digest}")
    if experiment.reason:
        remark(experiment.reason)
    return EXIT_CODES_OF_ENDS[experiment.state]


def print_generation(summary: pb.GenerationSummary, generations: int) -> None:
    fitness = f"best {summary.best:.3f}  mean {summary.mean:.3f}"
    print(f"{summary.generation + 1}/{generations}  {fitness}  digest {summary.digest[:12]}", flush=True)


def remark(text: str) -> None:
    print(text, file=sys.stderr)


def main() -> int:
    parser = argparse.ArgumentParser(description="Submits an experiment file and follows it to its end.")
    parser.add_argument("file", type=Path, help="the experiment file")
    url = os.environ.get("SWARM_COORDINATOR", "http://127.0.0.1:7700")
    parser.add_argument("--coordinator", default=url, metavar="URL", help="http:// or https:// [%(default)s]")
    parser.add_argument("--seed", type=int, help="instead of the file's")
    parser.add_argument("--generations", type=int, help="instead of the file's")
    parser.add_argument("--token-file", type=Path, help="or the token itself in SWARM_CLIENT_TOKEN")
    parser.add_argument("--tls-ca", type=Path, help="PEM file of the authority to trust [public ones]")
    parser.add_argument("--request-id", default=str(uuid.uuid4()), help="the same id: the same experiment")
    parser.add_argument("--patience", type=float, default=60, help="seconds to wait for the coordinator [60]")
    args = parser.parse_args()
    try:
        return run(args)
    except (OSError, ValueError) as error:
        remark(f"error: {error}")
        return 2
    except grpc.RpcError as error:
        # INVALID_ARGUMENT has a line for every mistake in the file.
        is_about_file = error.code() == StatusCode.INVALID_ARGUMENT
        for line in error.details().splitlines():
            remark(f"{args.file if is_about_file else args.coordinator}: {line}")
        return EXIT_CODES.get(error.code(), 1)
    except KeyboardInterrupt:
        remark("interrupted; the experiment goes on")
        return 130


if __name__ == "__main__":
    sys.exit(main())
