//! Measures lists in a data directory with ten thousand experiments of the size of A, from request
//! to answer: all experiments, running ones, those of a name. Also measures the first opening of
//! the database. An argument gives another number of experiments; TMPDIR=/dev/shm makes their
//! creation much faster.
#![allow(clippy::disallowed_methods, reason = "a benchmark measures time")]

use std::{env, time::Instant};

use evolution::{
    ALGORITHMS, Champion, ChampionSource, Digest, Evolution, HeldOut, Judged, Real, Statistics,
};
use experiment_file::ExperimentConfig;
use model::{
    priority::Priority,
    queries::BlockingReader,
    store::{Entry, GenerationCommit, GenerationRecord, NewExperiment, Store},
};
use prost::Message as _;
use swarm_proto::v1::{ExperimentState, ListExperimentsRequest, ListExperimentsResponse};

const SNES: &str = include_str!("../../../configs/leader_selection_snes.json");
/// How often each request is sent; the median counts.
const REPETITIONS: usize = 9;

fn main() {
    let n = env::args().find_map(|argument| argument.parse().ok()).unwrap_or(10_000);
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mut store = Store::open(directory.path()).expect("a new database");
    let new = new_experiment();
    for i in 0..n {
        put(&mut store, &new, i);
    }
    drop(store);
    let started = Instant::now();
    let reader = BlockingReader::open(directory.path()).expect("it is sound");
    println!("{:<28} {:>8.1} ms", "open", started.elapsed().as_secs_f64() * 1e3);
    let running = vec![ExperimentState::Running.into()];
    let named = format!("run-{}", n / 2);
    let requests = [
        ("all", ListExperimentsRequest::default(), n),
        (
            "running",
            ListExperimentsRequest { states: running, ..Default::default() },
            n.div_ceil(100),
        ),
        ("of a name", ListExperimentsRequest { named, ..Default::default() }, 1),
    ];
    for (what, request, expected) in requests {
        let mut seconds: Vec<f64> = (0..REPETITIONS)
            .map(|_| {
                let started = Instant::now();
                let answer = reader.call("ListExperiments", &request.encode_to_vec());
                let answer = ListExperimentsResponse::decode(&*answer.expect("it is sound"));
                assert_eq!(answer.expect("it is an answer").experiments.len(), expected);
                started.elapsed().as_secs_f64()
            })
            .collect();
        seconds.sort_by(f64::total_cmp);
        println!("{what:<28} {:>8.1} ms", seconds[REPETITIONS / 2] * 1e3);
    }
}

fn new_experiment() -> NewExperiment {
    let (config, _) = ExperimentConfig::from_json(SNES, "", ALGORITHMS).expect("the file is right");
    let simulation = sim_core::Simulation::compile(&config).expect("the file is right");
    let segments = simulation.population_segments();
    NewExperiment {
        request_id: None,
        config_digest: Digest::of_config(&config, sim_core::FINGERPRINT),
        genotype_len: simulation.genotype_len(),
        keyframe: Evolution::new(&config, segments, sim_core::FINGERPRINT).keyframe(),
        priority: Priority::default(),
        membership: None,
        labels: Default::default(),
        fork: None,
        champion: None,
        config,
    }
}

/// An experiment with 12 generations, the first and the last of which have a champion; one in a
/// hundred is unfinished.
fn put(store: &mut Store, new: &NewExperiment, i: usize) {
    let mut new = new.clone();
    new.config.name = format!("run-{i}");
    new.config.seed = i as u64;
    let (id, _) = store.create(&new, 0).expect("the database can be written");
    let n_generations = 12;
    for generation in 0..n_generations {
        let record = GenerationRecord {
            generation,
            statistics: Statistics::from_fitness(&[0.1, 0.2]),
            digest: Digest::of_config(&new.config, "").to_string(),
            duration_ms: 1,
            episodes: 500,
            workers: 2,
            idle_share: 0.5,
        };
        let is_last = generation + 1 == n_generations && !i.is_multiple_of(100);
        let champion = (generation == 0 || generation + 1 == n_generations)
            .then(|| champion(&new, generation, is_last));
        let commit = GenerationCommit {
            generation: &record,
            entry: Entry { told: &[0; 400], keyframe: None },
            champion: champion.as_ref(),
            digest: &record.digest,
            notices: &[],
            completed: is_last.then_some(""),
        };
        store.commit_generation(id, 0, &commit).expect("the database can be written");
    }
}

/// A champion with genes of all digits; `is_judged`: whether the run has ended.
fn champion(new: &NewExperiment, generation: u64, is_judged: bool) -> Champion {
    let algorithm = &new.config.algorithm;
    let fraction = |i: usize| (i as f64 * std::f64::consts::PI).fract();
    let mean = Real::new(0.5).expect("it is a number");
    Champion {
        generation,
        source: ChampionSource::Individual(7),
        genotype: (1..=new.genotype_len).map(fraction).collect(),
        trial_fitness: (1..=algorithm.num_evaluations as usize).map(fraction).collect(),
        held_out: HeldOut::from_values(&[0.1, 0.2], generation),
        judged: is_judged.then_some(Judged {
            mean,
            low: mean,
            high: mean,
            n_trials: 100,
            generation,
        }),
    }
}
