"""An answer to the question how the swarm solves its task: sentences, each backed by a number."""

from __future__ import annotations

from typing import Any

import numpy as np

from .channel import FIRST, symbols
from .ctrnn import Equilibrium
from .findings import Findings, Input
from .information import Dependence
from .proportions import conditional
from .settling import Settled
from .wording import half_width, listed, message, share

SMALL = 0.05
"""A change of the fitness below this share of it counts as small."""
CONSTANT = 0.99
"""An input whose most frequent value exceeds this share counts as a constant."""


def answer(found: Findings) -> list[str]:
    """Sentences, the most important first. Leaves out statements that do not apply to a genotype."""
    return [
        *_inputs(found),
        *_modes(found),
        *_symbols(found),
        *_meaning(found),
        *_heeding(found),
        *_settling(found),
        *_network(found),
    ]


def _inputs(found: Findings) -> list[str]:
    whole = float(found.trace.fitness.mean())
    said = [_loss(it, whole) for it in found.inputs if _matters(it)]
    unused = [it.sensor for it in found.inputs if not it.change.any()]
    small = [it.sensor for it in found.inputs if it.change.any() and not _matters(it)]
    if unused:
        said.append(f"{listed(unused)} {'is' if len(unused) == 1 else 'are'} not used: without, not a bit of the fitness changes.")
    if small:
        said.append(f"Without {listed(small)} the fitness changes little, or by no more than these episodes can show.")
    return said


def _matters(it: Input) -> bool:
    """Whether the fitness is clearly lower without the input."""
    change, fitness = float(it.change.mean()), float((it.fitness - it.change).mean())
    return change + half_width(it.change) < 0 and -change > SMALL * abs(fitness)


def _loss(it: Input, whole: float) -> str:
    said = f"Without {it.sensor} the fitness is {it.fitness.mean():.3f} instead of {whole:.3f}"
    if it.usual > CONSTANT:
        said += f", although it has the same value in {share(it.usual)} of its readings: it serves as a constant"
    return said + "."


def _modes(found: Findings) -> list[str]:
    if found.use is None:
        return []
    trace, sends = found.trace, found.trace.sends[:, FIRST:]
    if found.use.sends > 0.9995:
        return ["All robots send in every step; no robot relays, so robots hear only their neighbours."]
    said = [f"Robots send their own message in {share(found.use.sends)} of the steps, and relay what they hear in the others."]
    lit = trace.leds[:, FIRST:] > 0
    if lit.any() and not lit.all():
        by = conditional(lit, sends.astype(int))
        shares = [f"{share(by[mode].share)} of those that {name}" for mode, name in ((1, "send"), (0, "relay")) if mode in by]
        said.append(f"The LED is on in {listed(shares)}.")
    return said


def _symbols(found: Findings) -> list[str]:
    if found.use is None:
        return []
    use, trace = found.use, found.trace
    heard = list(use.shares.items())[:3]
    if use.entropy == 0:
        return [f"Every message is {message(heard[0][0])}: it tells only that a robot is near."]
    said = [f"The sent messages have {use.entropy:.2f} bits: " + listed([f"{message(it)} in {share(of)}" for it, of in heard]) + "."]
    lit = trace.leds[:, FIRST:] > 0
    if lit.any() and not lit.all():
        code = symbols(trace)
        by = conditional(lit, np.where(trace.sends[:, FIRST:], code.own, -1))
        shares = [f"{message(it)} with the LED on in {share(by[code.legend.index(it)].share)}" for it, _ in heard]
        said.append(f"It sends {listed(shares)}.")
    if found.spread is not None and not np.isnan(found.spread.speed):
        it = found.spread
        said.append(
            f"A word is heard by {it.hearers:.1f} robots on average and {it.farthest} at most, after {it.longest} steps at the "
            f"latest, and moves {it.speed:.0f} cm with each step."
        )
    return said


def _meaning(found: Findings) -> list[str]:
    starts = {"About its sender, a message tells most of": found.told, "About its hearer's next action, it tells most of": found.heeded}
    clearest = [(start, _clearest(of)) for start, of in starts.items()]
    return [f"{start} {it[0]}: {it[1].bits:.2f} bits, {it[1].chance:.2f} of them by chance." for start, it in clearest if it is not None]


def _clearest(of: dict[str, Dependence]) -> tuple[str, Dependence] | None:
    clear = [(name, it) for name, it in of.items() if it.p < 0.01 and it.excess > 0.01]
    return max(clear, key=lambda it: it[1].excess, default=None)


def _heeding(found: Findings) -> list[str]:
    said = []
    has_led = bool((found.trace.leds > 0).any())
    it = found.influence
    if it is not None and it.said.any():
        moved = share(float((it.reached[it.said] > 0).mean()))
        led = f", and another LED in {share(float((it.leds[it.said] > 0).mean()))}" if has_led else ""
        said.append(
            f"A single message, replaced by zeros, changes the actions of another robot within ten steps in {moved} of {it.said.sum()} cases{led}."
            if it.reached.any()
            else f"None of {it.said.sum()} messages that were replaced by zeros changed the action of any robot."
        )
    for sensor, of in found.attention.items():
        if of.sensed.any():
            heeded = share(float(of.heeded[of.sensed].mean()))
            led = f"; its LED differs in {of.leds[of.sensed].mean():.2f} of ten steps" if has_led else ""
            said.append(
                f"A robot that senses nothing by {sensor} for one step acts differently, by at least a bit, in {heeded} of "
                f"{of.sensed.sum()} cases{led}."
            )
    return said


def _settling(found: Findings) -> list[str]:
    """The states where the network settles: each pattern of outputs, with the inputs that lead to
    it."""
    rest = [it for it in found.settled if isinstance(it.attractor, Equilibrium)]
    # Leaves out outputs that are the same under all inputs.
    changing = [name for name in (rest[0].outputs if rest else ()) if len({round(it.outputs[name][0], 1) for it in rest}) > 1]
    if rest and not changing:
        alike = _rates(rest[0], [*rest[0].outputs])
        return [f"Held at any of the {len(rest)} most frequent inputs, the network settles alike, with {alike}."]
    patterns: dict[str, list[Settled]] = {}
    for it in rest:
        patterns.setdefault(_rates(it, changing), []).append(it)
    stimuli = list(found.experiment.to_dict()["topology"]["stimuli"].values())
    return [
        f"Held at {' or at '.join(_sensed(stimuli, it) for it in of)} ({share(sum(it.share for it in of))} of the steps), the "
        f"network settles with {rates}."
        for rates, of in patterns.items()
    ]


def _rates(it: Settled, names: list[str]) -> str:
    return listed([f"{name} at {round(it.outputs[name][0], 1) + 0.0:.1f}" for name in names])


def _sensed(stimuli: list[dict[str, Any]], it: Settled) -> str:
    """The inputs of each sensor that are not 0."""
    said, first = [], 0
    for stimulus in stimuli:
        values = it.inputs[first : first + stimulus["n"]]
        first += stimulus["n"]
        if values.any():
            said.append(f"{stimulus['sensor'].rpartition(':')[2]} {message(values.tolist())}")
    return listed(said) if said else "nothing"


def _network(found: Findings) -> list[str]:
    said = []
    neurons, groups = found.lesions["neurons"], found.lesions["groups"]
    lost = [it.part for it in neurons if it.ci95[1] < 0][:3]
    if lost:
        first = next(it for it in neurons if it.part == lost[0])
        said.append(f"The neurons that it misses most are {listed(lost)}: without {first.part} the fitness is {first.fitness:.3f}.")
    idle = [it.part for it in neurons if it.is_same]
    if idle:
        said.append(f"{len(idle)} of {len(neurons)} neurons do not influence others: without them, not a bit changes.")
    unused = [it.part for it in groups if it.is_same]
    if unused:
        said.append(f"Of the groups of synapses, {listed(unused)} could be left out.")
    of = found.components
    said.append(
        f"Its {len(of.shares)} neurons use about {of.dimension:.1f} dimensions; the first two components have "
        f"{share(float(of.shares[:2].sum()))} of the variance."
    )
    return said
