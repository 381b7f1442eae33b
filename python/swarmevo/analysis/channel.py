"""The channel of a swarm: its messages, their information, and the reactions of hearers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import arguments
from ..trace import Trace
from .information import Codes, Dependence, dependence, entropy, mutual_information
from ..representation import short

FIRST = 10
"""The first step that counts: before it, the simulator forces robots to send."""


@dataclass(frozen=True)
class Symbols:
    """The messages of a swarm, numbered."""

    legend: list[tuple[float, ...]]
    """The message of each code, most frequent first."""
    own: Codes
    """``[T, steps, R]``: code of each robot's own message, sent or not."""
    heard: Codes
    """``[T, steps, R]``: code of the message that each robot heard; -1 without a frame."""

    __repr__ = short


def symbols(trace: Trace, first: int = FIRST) -> Symbols:
    """The messages of a trace, from step ``first`` on."""
    first = arguments.whole(first, "first", 0)
    own, others = trace.messages[:, first:], trace.frame_messages[:, first:]
    there = trace.frame_emitters[:, first:] >= 0
    everything = np.concatenate([own.reshape(-1, own.shape[-1]), others[there]])
    distinct, inverse, counts = np.unique(everything, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(-counts, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    coded = rank[inverse.reshape(-1)]
    n_own = own[..., 0].size
    found = np.full(there.shape, -1, dtype=np.int64)
    found[there] = coded[n_own:]
    return Symbols([tuple(row) for row in distinct[order].tolist()], coded[:n_own].reshape(there.shape), found)


@dataclass(frozen=True)
class ChannelUse:
    """How a swarm uses its channel."""

    sends: float
    """Share of robots and steps that send their own message; the others relay."""
    shares: dict[tuple[float, ...], float]
    """Share of each symbol among the sent messages, most frequent first."""
    entropy: float
    """Entropy of these shares, bits: 0 is a channel without content."""
    hears: float
    """Share of robots and steps that hear a frame."""
    hops: NDArray[np.float64]
    """Share of the heard frames by their number of emissions, from 1 on."""

    __repr__ = short


def channel_use(trace: Trace, first: int = FIRST) -> ChannelUse:
    """Statistics of sent and heard messages from step ``first`` on."""
    first = arguments.whole(first, "first", 0)
    found = symbols(trace, first)
    sends = trace.sends[:, first:]
    sent = found.own[sends]
    counts = np.bincount(sent, minlength=len(found.legend))
    order = [int(code) for code in np.argsort(-counts, kind="stable") if counts[code]]
    hops = trace.frame_hops[:, first:]
    frames = np.bincount(hops[hops > 0].astype(np.int64))[1:]
    return ChannelUse(
        float(sends.mean()),
        {found.legend[code]: float(counts[code] / counts.sum()) for code in order},
        entropy(sent),
        float((found.heard >= 0).mean()),
        frames / max(1, frames.sum()),
    )


def heard(trace: Trace, first: int = FIRST) -> Codes:
    """``[T, steps, R]``: the symbol that each robot heard, as its code + 1; 0 for none."""
    first = arguments.whole(first, "first", 0)
    return symbols(trace, first).heard + 1


def signalling(trace: Trace, about: ArrayLike, *, first: int = FIRST, shuffles: int = 200) -> Dependence:
    """*Positive signalling* (Lowe et al. 2019): the information of a message about its sender.

    ``about`` is a code ``[T, steps, R]`` of the sender's state or stimuli in all steps, such as
    ``trace.leds`` or ``discretise(trace.stimuli[..., 0])``; negative for missing values. Only sent
    messages count. It does not tell whether any robot listens.
    """
    first = arguments.whole(first, "first", 0)
    shuffles = arguments.whole(shuffles, "shuffles", 0)
    state = np.where(trace.sends, np.asarray(about, dtype=np.int64), -1)[:, first:]
    return dependence(symbols(trace, first).own, state, shuffles=shuffles)


def listening(trace: Trace, response: ArrayLike, *, first: int = FIRST, shuffles: int = 200) -> Dependence:
    """*Positive listening*, as far as a trace shows it: the information of the message just heard
    about the robot's next action.

    ``response`` is a code ``[T, steps, R]``, such as ``trace.leds``. A robot acts on the frame of the
    same step. Neighbouring robots also sense similar values, so dependence does not prove influence.
    """
    first = arguments.whole(first, "first", 0)
    shuffles = arguments.whole(shuffles, "shuffles", 0)
    done = np.asarray(response, dtype=np.int64)[:, first:]
    return dependence(symbols(trace, first).heard, done, shuffles=shuffles)


def speaker_consistency(
    trace: Trace, action: ArrayLike, lags: Iterable[int] = range(5), *, first: int = FIRST
) -> dict[int, float]:
    """Speaker consistency by lag: the agreement of a robot's messages with its actions. Jaques et al.
    (2019) average normalised conditional entropies. This function divides the mutual information of the
    message that a robot sends and its own action ``lag`` steps later by the entropy of the message (the
    uncertainty coefficient, Theil 1970): 1 if the message follows from the action, 0 if it has no
    content.
    """
    first = arguments.whole(first, "first", 0)
    found, done = symbols(trace, first).own, np.asarray(action, dtype=np.int64)[:, first:]
    sends = trace.sends[:, first:]
    result = {}
    for lag in (arguments.whole(it, "a lag") for it in lags):
        end = found.shape[1] - lag
        if lag < 0 or end <= 0:
            raise ValueError(f"lags are from 0 to {found.shape[1] - 1} for the {found.shape[1]} steps that count, not {lag}")
        there = sends[:, :end]
        said, did = found[:, :end][there], done[:, lag:][there]
        whole = entropy(said)
        result[lag] = mutual_information(said, did) / whole if whole > 0 else 0.0
    return result


def informants(trace: Trace, first: int = FIRST) -> NDArray[np.float64]:
    """``[R, R]``: the share of the messages heard by robot i that robot j had first sent, over all
    trials; rows of robots that heard nothing are zeros."""
    first = arguments.whole(first, "first", 0)
    n = trace.n_robots
    originators = trace.frame_originators[:, first:]
    counts = np.zeros((n, n))
    for robot in range(n):
        known = originators[:, :, robot]
        counts[robot] = np.bincount(known[known >= 0], minlength=n)
    totals = counts.sum(axis=1, keepdims=True)
    return np.asarray(counts / np.maximum(totals, 1))



def sectors_heard(trace: Trace, window: int = 10) -> Codes:
    """``[T, steps, R]``: the number of sectors of its receiver in which a robot heard a frame within
    the last ``window`` steps, this one included. The thesis counts neighbours this way (Fig. 6.19). In
    the first steps, the window is shorter."""
    window = arguments.whole(window, "window", 1)
    sectors = np.asarray(trace.frame_sectors)
    found = np.zeros(sectors.shape, dtype=np.int64)
    for sector in range(int(sectors.max(initial=-1)) + 1):
        times = np.cumsum(sectors == sector, axis=1)
        before = np.zeros_like(times)
        before[:, window:] = times[:, :-window]
        found += times > before
    return found
