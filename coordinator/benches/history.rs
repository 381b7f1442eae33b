//! Measures the size of an experiment's history on disk, and the time to recover an individual,
//! per algorithm, at the size of experiment A: 100 individuals of 445 genes, 5 trials. The
//! fitness is invented; everything else is as in a coordinator. An argument selects algorithms by
//! a part of their name.
#![allow(clippy::disallowed_methods, reason = "a benchmark measures time")]

use std::{env, fs, path::Path, time::Instant};

use coordinator::{
    priority::Priority,
    store::{Entry, GenerationCommit, GenerationRecord, NewExperiment, Store},
};
use evolution::{ALGORITHMS, Digest, Evolution, Params, Told};
use experiment_file::{ExperimentConfig, Keeps};
use model::queries::BlockingReader;
use prost::Message as _;
use swarm_proto::v1::{GetIndividualsRequest, GetIndividualsResponse};

fn main() {
    let filter = env::args().skip(1).find(|argument| !argument.starts_with('-'));
    println!(
        "{:12} {:>11} {:>10} {:>10} {:>10} {:>10} {:>10}",
        "", "generations", "log", "keyframes", "database", "last", "slowest"
    );
    println!(
        "{:12} {:>11} {:>10} {:>10} {:>10} {:>10} {:>10}",
        "", "", "B/gen.", "B/gen.", "B/gen.", "s", "s"
    );
    for algorithm in ALGORITHMS {
        if filter.as_ref().is_none_or(|filter| algorithm.name.contains(filter.as_str())) {
            let is_slow = algorithm.keeps == Keeps::Matrix;
            measure(algorithm.name, if is_slow { 150 } else { 1000 });
        }
    }
}

fn config(algorithm: &str) -> ExperimentConfig {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/leader_selection_snes.json");
    let text = fs::read_to_string(path).expect("shipped with the project");
    let (mut config, _) =
        ExperimentConfig::from_json(&text, "", ALGORITHMS).expect("the file is right");
    config.algorithm.name = algorithm.to_owned();
    for population in config.algorithm.populations.values_mut() {
        population.params = Params::default();
    }
    config
}

fn measure(algorithm: &str, n_generations: u64) {
    let config = config(algorithm);
    let simulation = sim_core::Simulation::compile(&config).expect("the file is right");
    let segments = simulation.population_segments();
    let mut evolution = Evolution::new(&config, segments, sim_core::FINGERPRINT);
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mut store = Store::open(directory.path()).expect("a new database");
    let n_trials = config.algorithm.num_evaluations as usize;
    let champion_every = config.algorithm.champion_every;
    let new = NewExperiment {
        request_id: None,
        config_digest: Digest::of_config(&config, sim_core::FINGERPRINT),
        genotype_len: simulation.genotype_len(),
        keyframe: evolution.keyframe(),
        priority: Priority::default(),
        membership: None,
        labels: Default::default(),
        fork: None,
        champion: None,
        config,
    };
    let (id, _) = store.create(&new, 0).expect("the database can be written");
    let (mut log, mut keyframes, mut latest_keyframe, mut farthest) = (0, 0, 0, (0, 0));
    for generation in 0..n_generations {
        let asked = evolution.ask();
        let fitness = |genes: &Vec<f64>| {
            let at = |trial: usize| genes[trial] - (genes[trial + 9] - 0.3).abs();
            (0..n_trials).map(at).collect()
        };
        let mut told = Told::from_fitness(asked.genotypes.iter().map(fitness).collect());
        let summary = evolution.tell(asked, &told.trial_fitness).expect("all fitness is finite");
        if evolution.n_generations().is_multiple_of(champion_every) {
            let mut round = evolution.reevaluation().expect("there are candidates");
            while !round.is_over() {
                let trial_fitness = |genes: &Vec<f64>| (0..50).map(|trial| genes[trial]).collect();
                round.learn(&round.genotypes().iter().map(trial_fitness).collect::<Vec<_>>());
            }
            evolution.set_champion(&round);
            told.blocks = round.blocks().to_vec();
        }
        let told = told.to_bytes();
        let is_due = evolution.is_keyframe_due(told.len());
        let keyframe = is_due.then(|| evolution.keyframe());
        log += told.len();
        keyframes += keyframe.as_ref().map_or(0, Vec::len);
        if is_due {
            latest_keyframe = generation + 1;
        } else if generation - latest_keyframe > farthest.0 {
            farthest = (generation - latest_keyframe, generation);
        }
        let record = GenerationRecord {
            generation,
            statistics: summary.statistics,
            digest: summary.digest.to_string(),
            duration_ms: 1,
            episodes: 500,
            workers: 2,
            idle_share: 0.5,
        };
        let commit = GenerationCommit {
            generation: &record,
            entry: Entry { told: &told, keyframe: keyframe.as_deref() },
            champion: evolution.champion(),
            digest: &record.digest,
            notices: &[],
            completed: (generation + 1 == n_generations).then_some(""),
        };
        store.commit_generation(id, 0, &commit).expect("the database can be written");
    }
    drop(store);
    let database = fs::metadata(directory.path().join("swarmevo.sqlite3"));
    let database = database.expect("there is one").len();
    let per_generation = |n_bytes: usize| n_bytes as u64 / n_generations;
    println!(
        "{algorithm:12} {n_generations:>11} {:>10} {:>10} {:>10} {:>10.3} {:>10.3}",
        per_generation(log),
        per_generation(keyframes),
        database / n_generations,
        seconds(directory.path(), &format!("{id}@{}/7", n_generations - 1)),
        seconds(directory.path(), &format!("{id}@{}/7", farthest.1)),
    );
}

/// Time to recover an individual and decode its network, from a closed database.
fn seconds(directory: &Path, address: &str) -> f64 {
    let started = Instant::now();
    let reader = BlockingReader::open(directory).expect("it is sound");
    let request = GetIndividualsRequest { address: address.to_owned(), ..Default::default() };
    let answer = reader.call("GetIndividuals", &request.encode_to_vec());
    let answer = GetIndividualsResponse::decode(&*answer.expect("it is in the log"));
    let answer = answer.expect("it is an answer");
    let seconds = started.elapsed().as_secs_f64();
    assert_eq!(answer.individuals.len(), 1);
    seconds
}
