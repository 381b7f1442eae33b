//! The ancestors of an individual.

use swarm_proto::v1::{
    Ancestor, BirthOperator, GenesOfParent, GetLineageResponse, PopulationLineage,
};

/// A lineage with each kind of birth.
pub fn lineage() -> GetLineageResponse {
    let ancestor = |generation, individual, fitness, genes| Ancestor {
        generation,
        individual,
        fitness,
        genes,
        ..Ancestor::default()
    };
    let parent = |individual, genes| GenesOfParent { individual, genes, generation: None };
    let ancestors = vec![
        Ancestor {
            operator: BirthOperator::Crossover.into(),
            parents: vec![parent(0, 7), parent(4, 2)],
            new_genes: 1,
            ..ancestor(2, 5, 1.5, 10)
        },
        Ancestor {
            operator: BirthOperator::Elite.into(),
            parents: vec![parent(4, 10)],
            ..ancestor(1, 0, 1.25, 7)
        },
        Ancestor {
            operator: BirthOperator::Copy.into(),
            parents: vec![parent(4, 9)],
            new_genes: 1,
            ..ancestor(1, 4, 0.5, 2)
        },
        ancestor(0, 4, 1.0, 9),
    ];
    let lineage = PopulationLineage { population: "p1".into(), ancestors };
    GetLineageResponse { populations: vec![lineage], experiment_id: 3 }
}
