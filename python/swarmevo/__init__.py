"""Simulates and evolves robot swarms: here, and on a fleet.

>>> import swarmevo
>>> experiment = swarmevo.Experiment.quickstart()
>>> run = swarmevo.evolve(experiment, generations=2, progress=False)
>>> run.champion.genotype.shape
(424,)
"""

from ._core import FINGERPRINT
from ._core import VERSION as __version__
from .champion import Champion, Judged, Origin, Selection
from .environment import parallel_env
from .episodes import Actions, Episodes
from .errors import (
    EvolutionError,
    EvolutionWarning,
    ExperimentError,
    FleetError,
    FleetWarning,
    ForkError,
    InternalError,
    NotFound,
    OtherExperimentError,
    Problem,
    RefusedArgument,
    SwarmError,
)
from .evolution import (
    CMAES,
    GA,
    NSGA2,
    PGPE,
    SNES,
    XNES,
    Evolution,
    OpenAIES,
    SepCMAES,
    algorithms,
)
from .experiment import Experiment, Measured
from .files import Archive, open
from .fleet import Client, FleetRun, connect
from .generations import Generation
from .judging import Verdict, judge
from .local import Interrupted, LocalRun, evolve
from .mirroring import mirror
from .network import Network
from .records import Individuals, RecordedRun
from .replay import Replay
from .trace import Trace
from .trials import TrialSet
from .workers import Workers, workers

__all__ = [
    "Actions", "Archive", "CMAES", "Champion", "Client", "Episodes", "Evolution", "EvolutionError",
    "EvolutionWarning", "Experiment", "ExperimentError",
    "FINGERPRINT", "FleetError", "FleetRun", "FleetWarning", "ForkError", "GA", "Generation", "Individuals", "InternalError",
    "Interrupted", "Judged", "LocalRun", "Measured", "NSGA2", "Network", "NotFound", "OpenAIES", "Origin", "OtherExperimentError", "PGPE", "Problem", "RecordedRun", "RefusedArgument", "Replay", "SNES", "Selection",
    "SepCMAES", "SwarmError", "Trace", "TrialSet", "Verdict", "Workers", "XNES", "__version__", "algorithms", "connect", "evolve", "judge",
    "mirror", "open", "parallel_env", "workers",
]
