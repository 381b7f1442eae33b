"""Repertoires as archives of the package ribs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .extras import needs

if TYPE_CHECKING:
    from collections.abc import Callable

    from .records import RecordedRun


def to_ribs(run: RecordedRun, find: Callable[[], Any]) -> Any:
    """A ``GridArchive`` of the repertoire of a run. ``find`` requests its message
    ``GetRepertoireResponse``."""
    with needs("ribs"):
        from ribs.archives import GridArchive

    found = find()
    archive = GridArchive(
        solution_dim=run.experiment.n_genes,
        dims=[axis.cells for axis in found.axes],
        ranges=[(axis.low, axis.high) for axis in found.axes],
        # With another one, behaviours just below the end of a cell would belong to the next.
        epsilon=0.0,
        extra_fields={"address": ((), object)},
    )
    elites = [found.elites[place] for place in found.shown]
    if not elites:
        return archive
    genotypes: dict[str, Any] = {}
    for experiment, generation in sorted({(elite.experiment_id, elite.generation) for elite in elites}):
        individuals = run._records._run(experiment).individuals(generation).genotypes
        born = (elite for elite in elites if (elite.experiment_id, elite.generation) == (experiment, generation))
        genotypes |= {elite_address(elite): individuals[elite.individual] for elite in born}
    worth = [elite.judged if elite.HasField("judged") else elite for elite in elites]
    archive.add(
        np.array([genotypes[elite_address(elite)] for elite in elites]),
        np.array([it.fitness for it in worth]),
        np.array([it.descriptors for it in worth]),
        address=np.array([elite_address(elite) for elite in elites], dtype=object),
    )
    return archive


def elite_address(elite: Any) -> str:
    """The address of an elite, from its message. A fork has elites that were born in its parent."""
    return f"{elite.experiment_id}@{elite.generation}/{elite.individual}"
