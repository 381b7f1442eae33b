//! The experiments whose logs have the generations of a fork.

use crate::{
    ids::ExperimentId,
    store::{ExperimentRecord, ForkRecord, Store},
};

use super::QueryError;

/// An experiment, and those that it continues.
#[derive(Debug)]
pub(super) struct Ancestry {
    id: ExperimentId,
    /// The parent, its parent and so on, each with the last generation that its fork shares.
    parents: Vec<(ExperimentId, u64)>,
}

impl Ancestry {
    /// Reads the ancestry of an experiment. It ends with the last ancestor that the store has.
    pub fn read(store: &Store, experiment: &ExperimentRecord) -> Result<Self, QueryError> {
        let mut parents = Vec::new();
        let mut fork = experiment.fork.clone();
        while let Some(ForkRecord { parent, generation, .. }) = fork {
            let Some(found) = store.experiment(parent)? else { break };
            parents.push((parent, generation));
            fork = found.record.fork;
        }
        Ok(Self { id: experiment.id, parents })
    }

    /// The experiment that computed a generation of the history: only its log has the generation.
    pub fn experiment_of(&self, generation: u64) -> ExperimentId {
        let shared = self.parents.iter().take_while(|(_, last)| generation <= *last);
        shared.last().map_or(self.id, |(parent, _)| *parent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        queries::{StoredGeneration, experiment},
        store::inspection::tests::advance_to,
        submission::{Parent, Submission},
    };

    /// An experiment with four generations of its own.
    fn submit(store: &mut Store, parent: Option<Parent>) -> ExperimentId {
        let config_json = include_str!("../../../../configs/quickstart.json").to_owned();
        let submission = Submission { config_json, parent, ..Submission::default() };
        let (id, _) = store.create(&submission.check(&|| true).unwrap().new, 5).unwrap();
        for _ in 0..4 {
            advance_to(false, store, id, None);
        }
        id
    }

    fn fork(store: &mut Store, parent: ExperimentId, generation: u64) -> ExperimentId {
        let stored = StoredGeneration::read(store, parent, generation).unwrap();
        let evolution = stored.repeat().unwrap().after;
        submit(store, Some(Parent { experiment: stored.experiment, evolution }))
    }

    #[test]
    fn a_generation_of_a_fork_of_a_fork_is_that_of_the_ancestor_that_computed_it() {
        let directory = tempfile::tempdir().unwrap();
        let mut store = Store::open(directory.path()).unwrap();
        let first = submit(&mut store, None);
        let second = fork(&mut store, first, 1);
        let third = fork(&mut store, second, 3);
        let found = experiment(&store, third).unwrap();
        let ancestry = Ancestry::read(&store, &found).unwrap();
        let computed: Vec<ExperimentId> = (0..6).map(|it| ancestry.experiment_of(it)).collect();
        assert_eq!(computed, [first, first, second, second, third, third]);
        for (generation, id) in (0..).zip(computed) {
            StoredGeneration::read(&store, id, generation).unwrap();
        }
    }
}
