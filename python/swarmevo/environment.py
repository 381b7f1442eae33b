"""Experiments as environments of PettingZoo."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .extras import needs

if TYPE_CHECKING:
    from .experiment import Experiment
    from .swarm_env import SwarmEnv


def parallel_env(experiment: Experiment) -> SwarmEnv:
    """An experiment as a PettingZoo ``ParallelEnv``: an agent per robot with a network.

    Observations are the stimuli of the robot's controller, ``[I]`` float32. Actions are dictionaries with the
    robot's actuators: ``wheels`` (right and left, in [-1, 1]), ``led``, ``send`` (1 its own message, 0 relay)
    and ``message`` (in [0, 1], before quantisation). Absent parts of an action are those of
    :meth:`Episodes.idle`; a missing action, an unknown part and an unknown agent are a ValueError. All agents
    get the fitness of the step as reward, 0 where it does not count. Episodes are truncated after
    ``experiment.n_steps``.

    ``reset(seed=s)`` begins with trial 0 of the trial set of generation s, and every further ``reset()``
    moves to that of the next generation; ``options={"generation": g, "trial": t}``, with a number or a
    :class:`TrialSet`, chooses a trial.

    The environment can be copied and pickled in any step, and used in a forked process, with the same bits.
    """
    with needs("steps"):
        from .swarm_env import SwarmEnv

    return SwarmEnv(experiment)
