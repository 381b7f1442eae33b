"""Measures on traces and networks that explain how an evolved swarm solves its task.

Arrays have the axes of :class:`swarmevo.Trace`: trials, steps, robots. Rows of a trial depend on
each other, so all errors and levels of chance here are computed over trials, never over rows.
"""

from .ablation import Lesion, ablation, synapse_genes
from .border import alpha_shape, border
from .channel import (
    ChannelUse,
    Symbols,
    channel_use,
    heard,
    informants,
    listening,
    sectors_heard,
    signalling,
    speaker_consistency,
    symbols,
)
from .continuation import Bifurcation, Branch, continuation
from .counterfactual import Attention, Influence, attention, influence
from .ctrnn import CTRNN, Equilibrium, LimitCycle
from .generalisation import Condition, generalisation
from .information import Dependence, codes, dependence, discretise, entropy, mutual_information
from .proportions import Proportion, conditional, proportion
from .report import report
from .settling import Settled, settled
from .spread import Spread, spread
from .states import Components, components_of_states
from .variants import variant

__all__ = [
    "Attention", "Bifurcation", "Branch", "CTRNN", "ChannelUse", "Components", "Condition", "Dependence", "Equilibrium",
    "Influence", "Lesion", "LimitCycle", "Proportion", "Settled", "Spread", "Symbols", "ablation", "alpha_shape", "attention",
    "border", "channel_use", "codes", "components_of_states", "conditional", "continuation", "dependence", "discretise",
    "entropy", "generalisation", "heard", "influence", "informants", "listening", "mutual_information", "proportion",
    "report", "sectors_heard", "settled", "signalling", "speaker_consistency", "spread", "symbols", "synapse_genes", "variant",
]
