"""The gRPC protocol, from its published descriptor: no generated code.

``docs/clients.md`` and ``proto/swarm/v1`` of the project describe the messages.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from . import _core
from .extras import needs

PACKAGE = "swarm.v1"


@lru_cache(maxsize=None)
def _pool() -> Any:
    with needs("fleet"):
        from google.protobuf import descriptor_pb2, descriptor_pool

    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(_core.PROTOCOL).file:
        pool.Add(file)
    return pool


@lru_cache(maxsize=None)
def message(name: str) -> Any:
    """The class of a message, such as ``GetExperimentRequest``."""
    with needs("fleet"):
        from google.protobuf import message_factory

    return message_factory.GetMessageClass(_pool().FindMessageTypeByName(f"{PACKAGE}.{name}"))


@lru_cache(maxsize=None)
def method(service: str, name: str) -> tuple[str, Any, Any]:
    """Path of a call, and the classes of its request and of its responses."""
    found = _pool().FindServiceByName(f"{PACKAGE}.{service}").FindMethodByName(name)
    path = f"/{PACKAGE}.{service}/{name}"
    return path, message(found.input_type.name), message(found.output_type.name)


@lru_cache(maxsize=None)
def states() -> dict[int, str]:
    """Names of the states of an experiment, such as ``running``."""
    values = _pool().FindEnumTypeByName(f"{PACKAGE}.ExperimentState").values
    prefix = "EXPERIMENT_STATE_"
    return {value.number: value.name.removeprefix(prefix).lower() for value in values}
