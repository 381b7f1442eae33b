"""How an evolved swarm solves its task: measures on traces and on networks.

Arrays have the axes of :class:`swarmevo.Trace`: trials, steps, robots. Rows of a trial depend on
each other, so that every error and every level of chance here is one over trials, never over rows.
"""

from .channel import (
    ChannelUse,
    Symbols,
    channel_use,
    heard,
    informants,
    listening,
    signalling,
    speaker_consistency,
    symbols,
)
from .counterfactual import Influence, influence
from .ctrnn import CTRNN, Equilibrium, LimitCycle
from .generalisation import Condition, generalisation
from .information import Dependence, codes, dependence, discretise, entropy, mutual_information
from .proportions import Proportion, conditional, proportion
from .report import report

__all__ = [
    "CTRNN", "ChannelUse", "Condition", "Dependence", "Equilibrium", "Influence", "LimitCycle", "Proportion", "Symbols",
    "channel_use", "codes", "conditional", "dependence", "discretise", "entropy", "generalisation", "heard", "influence",
    "informants", "listening", "mutual_information", "proportion", "report", "signalling",
    "speaker_consistency", "symbols",
]
