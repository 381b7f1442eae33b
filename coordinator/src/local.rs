//! Experiments that the calling process computes itself, without a fleet. Like a coordinator, it
//! finds, stores and continues them in the database of a data directory.

use std::{path::Path, time::Duration};

use evolution::{Champion, Evolution, Statistics, Told, mean};
use experiment_file::ConfigError;
use model::restored::restore_evolution;

use crate::{
    clock,
    control::{Existing, Placement, place},
    ids::ExperimentId,
    limits::UNFINISHED_MAX,
    runs::news,
    store::{
        Entry, ExperimentRecord, ExperimentState, GenerationCommit, GenerationRecord, Store,
        StoreError,
    },
    submission::Submission,
};

/// Number of generations to read at once.
const PAGE_LEN: u32 = 100;

/// An experiment in a data directory, which no other process changes meanwhile.
#[derive(Debug)]
pub struct LocalRun {
    store: Store,
    id: ExperimentId,
}

/// A generation to commit.
#[derive(Debug)]
pub struct Done<'a> {
    /// The state of evolution after it.
    pub evolution: &'a Evolution,
    /// Its fitness, as evolution learnt it.
    pub told: &'a Told,
    /// Notices from the update of evolution.
    pub notices: &'a [String],
    /// Its duration.
    pub duration: Duration,
    /// Number of threads or processes that compute in parallel.
    pub n_workers: u64,
    /// Why the run is over, if this is the last generation.
    pub completed: Option<&'a str>,
}

/// Why a data directory cannot take an experiment.
#[derive(Debug, thiserror::Error)]
pub enum LocalRunError {
    /// The experiment has problems.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The database cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The stored state does not allow the experiment to continue.
    #[error("experiment {0} cannot continue: {1}; start again in another data directory")]
    Unsound(ExperimentId, String),
    /// The limit of unfinished experiments is reached.
    #[error("{UNFINISHED_MAX} experiments of this data directory are unfinished; take another one")]
    TooMany,
}

impl LocalRun {
    /// Opens the experiment of a file's text in a data directory: an identical one that is
    /// unfinished, has completed, or has completed fewer generations; otherwise a new one. Locks
    /// the directory until it is dropped.
    pub fn open(directory: &Path, config_json: String) -> Result<Self, LocalRunError> {
        let new = Submission { config_json, ..Submission::default() }.check(&|| true)?.new;
        let mut store = Store::open(directory)?;
        let existing = Existing { resume_unfinished: true, reuse: true };
        let id = match place(&mut store, new, existing, u64::MAX)?.0 {
            Placement::Runs(runnable) => runnable.id,
            Placement::RunsAlready(id) => id,
            Placement::TooMany | Placement::NoMemory(_) => return Err(LocalRunError::TooMany),
        };
        let mut this = Self { store, id };
        if this.record()?.state == ExperimentState::Paused {
            let (running, now) = (ExperimentState::Running, clock::unix_ms());
            this.store.set_state(id, now, running, "goes on in the process that requested it")?;
        }
        Ok(this)
    }

    /// Its number.
    pub fn id(&self) -> ExperimentId {
        self.id
    }

    /// Its present record.
    pub fn record(&self) -> Result<ExperimentRecord, StoreError> {
        let found = self.store.experiment(self.id)?;
        found
            .map(|found| found.record)
            .ok_or_else(|| StoreError::Corrupt(format!("experiment {} is gone", self.id)))
    }

    /// The state of evolution after the latest generation.
    pub fn evolution(&self) -> Result<Evolution, LocalRunError> {
        let (record, checkpoint) = self.store.resumable(self.id)?;
        restore_evolution(&record, &checkpoint).map_err(|why| LocalRunError::Unsound(self.id, why))
    }

    /// The champion so far.
    pub fn champion(&self) -> Result<Option<Champion>, StoreError> {
        self.store.champion(self.id)
    }

    /// All generations, in order.
    pub fn history(&self) -> Result<Vec<GenerationRecord>, StoreError> {
        let mut history: Vec<GenerationRecord> = Vec::new();
        loop {
            let page = self.store.generations(self.id, history.len() as u64, PAGE_LEN)?;
            let is_last = page.len() < PAGE_LEN as usize;
            history.extend(page.into_iter().map(|(_, generation)| generation));
            if is_last {
                return Ok(history);
            }
        }
    }

    /// Stores a generation with its state, fitness log and champion. Returns its row.
    pub fn commit(&mut self, done: &Done<'_>) -> Result<GenerationRecord, LocalRunError> {
        let Done { evolution, told, notices, duration, n_workers, completed } = *done;
        let unsound = |why: String| LocalRunError::Unsound(self.id, why);
        let outcome = evolution.outcome(told).map_err(|error| unsound(error.to_string()))?;
        let means: Vec<f64> = told.trial_fitness.iter().map(|trials| mean(trials)).collect();
        let generation = GenerationRecord {
            generation: evolution.n_generations().saturating_sub(1),
            statistics: Statistics::from_fitness(&means),
            digest: evolution.digest().to_string(),
            duration_ms: duration.as_millis() as u64,
            episodes: told.n_episodes(),
            workers: n_workers,
            idle_share: 0.0,
        };
        let mut notices = notices.to_vec();
        notices.extend(news(evolution, told, outcome.champion.as_ref()));
        let bytes = told.to_bytes();
        let keyframe = evolution.is_keyframe_due(bytes.len()).then(|| evolution.keyframe());
        let commit = GenerationCommit {
            generation: &generation,
            entry: Entry { told: &bytes, keyframe: keyframe.as_deref() },
            champion: outcome.champion.as_ref(),
            digest: &outcome.digest.to_string(),
            notices: &notices,
            completed,
        };
        self.store.commit_generation(self.id, clock::unix_ms(), &commit)?;
        Ok(generation)
    }

    /// Ends the experiment as failed, because no later generation could learn anything.
    pub fn fail(&mut self, reason: &str) -> Result<(), StoreError> {
        self.store.set_state(self.id, clock::unix_ms(), ExperimentState::Failed, reason)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use evolution::End;
    use serde_json::{Value, json};

    use super::*;

    /// The quickstart with this many generations, and no comparison before the end.
    fn file(generations: u64) -> String {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/quickstart.json");
        let mut file: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
        file["algorithm"]["generations"] = json!(generations);
        file["algorithm"]["champion_every"] = json!(1000);
        file.to_string()
    }

    /// Computes up to generation `until`; judges the champion after the last of `n_generations`.
    fn compute(run: &mut LocalRun, until: u64, n_generations: u64) {
        let mut evolution = run.evolution().unwrap();
        while evolution.n_generations() < until {
            let asked = evolution.ask();
            let fitness: Vec<Vec<f64>> =
                asked.genotypes.iter().map(|genes| vec![genes[0], genes[1]]).collect();
            evolution.tell(asked, &fitness).unwrap();
            let is_last = evolution.n_generations() == n_generations;
            let judgement = if is_last { vec![0.5, 0.25] } else { Vec::new() };
            let end = End { judgement, ..End::default() };
            let told = Told { end, ..Told::from_fitness(fitness) };
            let completed = is_last.then_some("");
            let duration = Duration::from_millis(5);
            run.commit(&Done {
                evolution: &evolution,
                told: &told,
                notices: &[],
                duration,
                n_workers: 1,
                completed,
            })
            .unwrap();
        }
    }

    #[test]
    fn a_run_goes_on_where_it_was_left_to_the_same_bits() {
        let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let mut run = LocalRun::open(whole.path(), file(5)).unwrap();
        compute(&mut run, 5, 5);
        let expected = run.record().unwrap();
        for until in [2, 3, 5] {
            let mut run = LocalRun::open(parts.path(), file(5)).unwrap();
            assert!(matches!(
                LocalRun::open(parts.path(), file(5)),
                Err(LocalRunError::Store(StoreError::Locked { .. }))
            ));
            compute(&mut run, until, 5);
        }
        let run = LocalRun::open(parts.path(), file(5)).unwrap();
        let found = run.record().unwrap();
        assert_eq!((found.id, found.digest), (ExperimentId(1), expected.digest));
        assert_eq!(found.state, ExperimentState::Completed);
        assert_eq!(run.history().unwrap().len(), 5);
        assert_eq!(run.champion().unwrap().unwrap().judged.unwrap().n_trials, 2);
    }

    #[test]
    fn a_run_that_goes_on_knows_for_how_long_fitness_has_been_the_same() {
        let n_done = 170;
        let directory = tempfile::tempdir().unwrap();
        let mut run = LocalRun::open(directory.path(), file(1000)).unwrap();
        let mut evolution = run.evolution().unwrap();
        let fitness_of = |generation: u64, n: usize| -> Vec<Vec<f64>> {
            // An individual without finite fitness counts as a difference.
            let first = if generation == 9 { f64::NAN } else { 0.25 };
            (0..n).map(|i| vec![if i == 0 { first } else { 0.25 }]).collect()
        };
        for generation in 0..n_done {
            let asked = evolution.ask();
            let fitness = fitness_of(generation, asked.genotypes.len());
            evolution.tell(asked, &fitness).unwrap();
            run.commit(&Done {
                evolution: &evolution,
                told: &Told::from_fitness(fitness),
                notices: &[],
                duration: Duration::from_millis(5),
                n_workers: 1,
                completed: None,
            })
            .unwrap();
        }
        let (_, checkpoint) = run.store.resumable(run.id).unwrap();
        assert!(checkpoint.log.len() < n_done as usize, "there is a keyframe in between");
        drop(run);
        let run = LocalRun::open(directory.path(), file(1000)).unwrap();
        let restored = run.evolution().unwrap();
        assert_eq!((restored.n_flat(), evolution.n_flat()), (n_done - 10, n_done - 10));
        assert_eq!(restored.digest(), evolution.digest());
    }

    #[test]
    fn a_longer_run_goes_on_from_a_shorter_one_and_a_paused_one_is_resumed() {
        let directory = tempfile::tempdir().unwrap();
        compute(&mut LocalRun::open(directory.path(), file(2)).unwrap(), 2, 2);
        let mut run = LocalRun::open(directory.path(), file(3)).unwrap();
        assert_eq!((run.id(), run.evolution().unwrap().n_generations()), (ExperimentId(1), 2));
        let (id, paused) = (run.id(), ExperimentState::Paused);
        run.store.set_state(id, 0, paused, "lunch").unwrap();
        drop(run);
        let run = LocalRun::open(directory.path(), file(3)).unwrap();
        assert_eq!(run.record().unwrap().state, ExperimentState::Running);
    }

    #[test]
    fn a_run_that_failed_keeps_the_reason_and_the_next_one_begins_anew() {
        let directory = tempfile::tempdir().unwrap();
        let mut run = LocalRun::open(directory.path(), file(3)).unwrap();
        compute(&mut run, 2, 3);
        run.fail("nothing can be learnt").unwrap();
        let failed = run.record().unwrap();
        assert_eq!(failed.state, ExperimentState::Failed);
        assert_eq!(failed.reason, "nothing can be learnt");
        drop(run);
        let next = LocalRun::open(directory.path(), file(3)).unwrap();
        assert_eq!((next.id(), next.evolution().unwrap().n_generations()), (ExperimentId(2), 0));
    }

    #[test]
    fn a_file_with_problems_leaves_no_database() {
        let directory = tempfile::tempdir().unwrap();
        let at = directory.path().join("data");
        let refused = LocalRun::open(&at, file(0));
        assert!(matches!(refused, Err(LocalRunError::Config(_))));
        assert!(!at.exists());
    }
}
