"""The statements of docs/notebook/2026-11-four-answers.md, one by one, in episodes of the champions."""

import functools
from types import SimpleNamespace

import numpy as np
from conftest import PROJECT

from swarmevo import analysis
from swarmevo.analysis.answer import _settling
from swarmevo.analysis.channel import FIRST
from swarmevo.analysis.thesis.champion import Champion
from swarmevo.analysis.thesis.light_follower import light_sectors
from swarmevo.analysis.thesis.orientation_consensus import directions

TRIALS = 10


def champion(name):
    return Champion(name, PROJECT / "results", PROJECT / "configs", TRIALS)


@functools.cache
def episodes(name):
    return champion(name).trace()


def within(flags, window):
    """The number of true values in the last `window` steps, this one included: [T, steps, R]."""
    sums = np.cumsum(flags, axis=1)
    before = np.zeros_like(sums)
    before[:, window:] = sums[:, :-window]
    return sums - before


def said_of(name):
    """The statements of a report on the states where the network settles."""
    of = champion(name)
    found = analysis.settled(of.experiment, of.genotype, episodes(name))
    return _settling(SimpleNamespace(experiment=of.experiment, settled=found))


def test_reports_say_where_networks_settle():
    hears, alone = said_of("leader_selection")
    assert hears.startswith("Held at msg (1, 0) and receiving_direction (") and "OUT_LED_0 at 0.0" in hears
    assert alone.startswith("Held at nothing") and alone.endswith("OUT_MODE_0 at 1.0 and OUT_LED_0 at 1.0.")
    (alike,) = said_of("borderline")
    assert alike.startswith("Held at any of the 4 most frequent inputs") and alike.endswith("OUT_LED_0 at 1.0.")


class TestLeaderSelection:
    """A: a robot that hears nothing leads."""

    def test_robots_that_heard_nothing_for_ten_steps_are_on_and_those_that_heard_in_each_are_off(self):
        trace = episodes("leader_selection")
        lit, heard = trace.leds > 0, within(trace.frame_emitters >= 0, 10)
        # Robots that have led alone for 50 steps have failed: they hear, but must not lead.
        alone = lit & (lit.sum(axis=2, keepdims=True) == 1)
        failed = np.cumsum(within(alone, 50) >= 50, axis=1) > 0
        sound = ~np.roll(failed, 1, axis=1)
        sound[:, :20] = False
        assert lit[sound & (heard == 0)].mean() > 0.99
        assert lit[sound & (heard == 10)].mean() < 0.001
        shares = [lit[sound & (heard == n)].mean() for n in (1, 3, 5, 7)]
        assert shares == sorted(shares, reverse=True)

    def test_alone_the_network_leads_without_a_message_and_follows_with_one_from_any_side(self):
        a = champion("leader_selection")
        network = analysis.CTRNN.of(a.experiment.network(a.genotype))
        names = a.experiment.network(a.genotype).neurons
        led, mode = names.index("OUT_LED_0"), names.index("OUT_MODE_0")
        for side in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            follows = network.attractor([1, 0, 0, *side]).rates
            assert follows[led] < 0.01 and follows[mode] < 0.01
        for mode_now in (0, 1):
            leads = network.attractor([0, 0, mode_now, 0, 0]).rates
            assert leads[led] > 0.99 and leads[mode] > 0.99

    def test_a_leader_hears_nearly_nothing_and_all_begin_with_their_led_on(self):
        trace = episodes("leader_selection")
        lit = trace.leds > 0
        assert (trace.frame_emitters[:, 20:] >= 0)[lit[:, 20:]].mean() < 0.1
        assert lit[:, 0].mean() > 0.95


    def test_the_last_word_of_a_leader_is_heard_for_nine_steps_and_then_another_one_leads(self):
        trace = episodes("leader_selection")
        assert analysis.spread(trace).longest == 9
        n_lit = (trace.leds > 0).sum(axis=2)
        waits = []
        for of in n_lit:
            for step in np.flatnonzero((of[20:-1] == 1) & (of[21:] == 0)) + 21:
                again = np.flatnonzero(of[step:])
                waits.extend(again[:1].tolist())
        assert 8 <= np.median(waits) <= 11


class TestBorderline:
    """B: a robot that hears from opposite sides is inside."""

    def test_alone_the_network_is_off_only_if_it_hears_from_opposite_sides_and_no_third(self):
        b = champion("borderline")
        description = b.experiment.network(b.genotype)
        network, led = analysis.CTRNN.of(description), description.neurons.index("OUT_LED_0")
        topology = b.experiment.to_dict()["topology"]
        sides = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
        rng = np.random.default_rng(0)

        def rate(chosen):
            inputs = np.zeros((200, 5))
            inputs[:, 2] = 1
            inputs[:, 3:] = sides[rng.choice(chosen, 200)]
            states = network.trajectory(np.repeat(inputs, topology["time_scale"], axis=0), dt=topology["dt"])
            return network.rates(states[100 * topology["time_scale"] :])[:, led].mean()

        assert min(rate(chosen) for chosen in ([0], [1], [2], [3], [0, 1], [1, 2], [2, 3], [0, 3])) > 0.99
        assert max(rate(chosen) for chosen in ([0, 2], [1, 3])) < 0.5
        assert min(rate(chosen) for chosen in ([0, 1, 2], [1, 2, 3], [0, 2, 3], [0, 1, 3])) > 0.9
        assert rate([0, 1, 2, 3]) < 0.05

    def test_robots_that_hear_from_all_sides_are_off_and_from_two_on(self):
        trace = episodes("borderline")
        lit = analysis.conditional(trace.leds[:, 60:] > 0, analysis.sectors_heard(trace)[:, 60:])
        assert lit[4].share < 0.1 < 0.6 < lit[3].share < 0.9 < lit[2].share

    def test_every_message_is_the_same_and_everybody_sends(self):
        trace = episodes("borderline")
        assert trace.sends.all()
        assert (trace.messages[:, FIRST:] == 0).all()


class TestOrientationConsensus:
    """C: a robot turns until it hears in the sector opposite to the one in which it is heard."""

    def test_aligned_robots_rest_and_others_turn_to_the_side_that_aligns(self):
        trace = episodes("orientation_consensus")
        receiving, sending = directions(trace)
        apart = np.where(receiving >= 0, (sending - receiving) % 360, -1)
        wheel = trace.wheels[:, FIRST:, :, 0]
        assert np.abs(wheel[apart == 180]).mean() < 0.03
        assert np.median(wheel[apart == 90]) > 0.05 and np.median(wheel[apart == 270]) < -0.05
        assert (apart[:, :5] == 180).mean() < (apart[:, -100:] == 180).mean()

    def test_every_message_is_the_same_and_everybody_sends(self):
        trace = episodes("orientation_consensus")
        assert trace.sends[:, FIRST:].all()
        assert len(np.unique(trace.messages[:, FIRST:].reshape(-1, 2), axis=0)) == 1


class TestLightFollower:
    """D: turn to heard robots, stop for those behind, circle the light."""

    def test_in_the_dark_robots_drive_to_senders_in_front_turn_to_those_beside_and_stop_for_those_behind(self):
        trace = episodes("light_follower")
        dark = light_sectors(trace).max(axis=-1) == 0
        dark[:, :FIRST] = False
        front, left, behind, right = (np.median(trace.wheels[dark & (trace.frame_sectors == s)], axis=0) for s in range(4))
        assert (front > 0.95).all()
        assert left[0] > 0.9 and left[1] < 0.1, "the right wheel alone: it turns left"
        assert (behind < 0.1).all()
        assert right[0] < 0.1 and right[1] > 0.9

    def test_robots_that_see_the_light_have_it_on_their_right_or_behind_and_turn_right(self):
        trace = episodes("light_follower")
        light = light_sectors(trace)
        seen = light.max(axis=-1) > 0
        seen[:, :FIRST] = False
        side = light.argmax(axis=-1)[seen]
        assert np.isin(side, [3, 4, 5]).mean() > 0.95
        turns = (trace.wheels[..., 1] - trace.wheels[..., 0])[seen]
        assert np.median(turns) > 0.3

    def test_every_message_is_the_same_and_everybody_sends(self):
        trace = episodes("light_follower")
        assert trace.sends[:, FIRST:].all() and (trace.messages[:, FIRST:] == 0).all()
