//! Measures the parts of a generation one at a time.

use std::{
    fs::File,
    io::Write as _,
    time::{Duration, Instant},
};

use coordinator::{
    priority::Priority,
    store::{Entry, GenerationCommit, GenerationRecord, NewExperiment, Store},
};
use evolution::{Digest, Evolution, Told};
use experiment_file::ExperimentConfig;
use tempfile::TempDir;

use super::{instant_workers::median, ms};

const N_GENERATIONS: usize = 200;

/// Medians, ms.
pub struct Alone {
    /// Tell and ask.
    pub evolution: f64,
    /// The checkpoint as bytes, and the transaction.
    pub commit: f64,
    /// Append as many bytes to a file, and wait for the disk.
    pub sync: f64,
}

/// Runs an experiment without engine and network.
pub fn measure(file: &str) -> Alone {
    let (config, _) =
        ExperimentConfig::from_json(file, "", evolution::ALGORITHMS).expect("the file is right");
    let experiment = sim_core::Simulation::compile(&config).expect("the file is right");
    let mut evolution =
        Evolution::new(&config, experiment.population_segments(), sim_core::FINGERPRINT);
    let directory = TempDir::new().expect("a temporary directory");
    let mut store = Store::open(directory.path()).expect("a new database");
    let new = NewExperiment {
        request_id: None,
        config_digest: Digest::of_config(&config, sim_core::FINGERPRINT),
        genotype_len: experiment.genotype_len(),
        keyframe: evolution.keyframe(),
        priority: Priority::default(),
        membership: None,
        labels: Default::default(),
        fork: None,
        champion: None,
        config,
    };
    let (id, _) = store.create(&new, 0).expect("the database can be written");
    let mut scratch = File::create(directory.path().join("scratch")).expect("it can be written");

    let mut asked = evolution.ask();
    let (mut evolutions, mut commits, mut syncs) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..N_GENERATIONS {
        let trial_fitness: Vec<Vec<f64>> =
            asked.genotypes.iter().map(|genes| vec![genes[0]]).collect();
        let started = now();
        let record = evolution.tell(asked, &trial_fitness).expect("all fitness is finite");
        asked = evolution.ask();
        evolutions.push(ms(since(started)));

        let generation = GenerationRecord {
            generation: record.generation,
            statistics: record.statistics,
            digest: record.digest.to_string(),
            duration_ms: 1,
            episodes: trial_fitness.len() as u64,
            workers: 2,
            idle_share: 0.5,
        };
        let started = now();
        let told = Told::from_fitness(trial_fitness).to_bytes();
        let is_due = evolution.is_keyframe_due(told.len());
        let keyframe = is_due.then(|| evolution.keyframe());
        let commit = GenerationCommit {
            generation: &generation,
            entry: Entry { told: &told, keyframe: keyframe.as_deref() },
            champion: evolution.champion(),
            digest: &generation.digest,
            notices: &[],
            completed: None,
        };
        store.commit_generation(id, 0, &commit).expect("the database can be written");
        commits.push(ms(since(started)));

        let started = now();
        scratch.write_all(&told).expect("it can be written");
        scratch.sync_data().expect("it can be written");
        syncs.push(ms(since(started)));
    }
    Alone { evolution: median(&evolutions), commit: median(&commits), sync: median(&syncs) }
}

#[expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
fn now() -> Instant {
    Instant::now()
}

fn since(started: Instant) -> Duration {
    now() - started
}
