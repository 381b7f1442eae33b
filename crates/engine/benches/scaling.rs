//! Measures how well the engine uses a fleet of one to ten thousand workers: the real engine
//! drives simulated workers in virtual time. Prints the tables of
//! `docs/notebook/2026-11-fleet.md`.

#[path = "../tests/fleets/numbers.rs"]
mod numbers;

use std::time::{Duration, Instant};

use engine::{
    Assignments, Batch, Command, Engine, EngineConfig, Introduction, ItemResult, NamePattern,
    ToWorker,
};
use model::{
    ids::{ExperimentId, JobId},
    priority::Priority,
};
use numbers::{Ask as _, SimulatedFleet, fitness, population, simulated};
use sim_core::{Output, TrialSet};
use simulated_fleet::{FleetModel, uniform};

const EXPERIMENT: JobId = JobId::Experiment(ExperimentId(1));
const LEASE: Duration = Duration::from_secs(10);
const N_TRIALS: u32 = 5;
const N_GENERATIONS: u64 = 8;
/// Number of first generations, which teach the engine the durations of items.
const N_TEACHING: u64 = 4;
const CALL_OVERHEAD: f64 = 0.4;
/// Largest relative deviation of a trial's duration from the mean.
const DISPERSION: f64 = 0.3;

/// The durations in the model.
#[derive(Debug, Clone, Copy)]
struct Costs {
    /// A trial on a worker of speed 1.
    trial: Duration,
    /// One way between coordinator and worker.
    latency: Duration,
}

const LONG: Costs = Costs { trial: Duration::from_millis(100), latency: Duration::from_millis(1) };
/// As measured, in a local network.
const EXPERIMENT_A: Costs =
    Costs { trial: Duration::from_micros(900), latency: Duration::from_micros(200) };

fn main() {
    let plain = EngineConfig { split: false, duplicate: false, ..EngineConfig::new(LEASE) };
    let split = EngineConfig { split: true, ..plain };
    let both = EngineConfig { duplicate: true, ..split };
    println!("parallel efficiency; whole: items of all trials; split: by trial; both: split,");
    println!("and moved and duplicated; known: all given out at once by known speeds");
    for costs in [LONG, EXPERIMENT_A] {
        for population_size in [100, 10_000] {
            for stalled in [0.0, 0.01] {
                print!("\ntrials of {:?}, {:?} each way, ", costs.trial, costs.latency);
                println!("P = {population_size}, {} % of the workers stall", 100.0 * stalled);
                println!("workers   whole   split    both   known   limit");
                for n_workers in [1, 10, 100, 1_000, 10_000] {
                    let measured = [plain, split, both].map(|config| {
                        costs.efficiency(config, population_size, n_workers, stalled)
                    });
                    print!("{n_workers:>7}");
                    let known = costs.with_known_speeds(population_size, n_workers);
                    let limit = costs.limit(population_size, n_workers);
                    for share in measured.into_iter().chain([known, limit]) {
                        print!(" {:>6.1}%", 100.0 * share);
                    }
                    println!();
                }
            }
        }
    }
    println!("\nengine alone, 10,000 workers of one slot, a generation of 100,000:");
    println!("{:.0} items/s", throughput());
}

fn speed(worker: usize) -> f64 {
    0.5 + uniform(worker as u64)
}

fn total_speed(n_workers: usize) -> f64 {
    (0..n_workers).map(speed).sum()
}

impl Costs {
    /// Time of all work on a worker of speed 1, if no item is split.
    fn work(self, population_size: usize) -> Duration {
        self.trial.mul_f64(population_size as f64 * (f64::from(N_TRIALS) + CALL_OVERHEAD))
    }

    /// No generation takes less than the work divided by the workers' speeds, nor
    /// less than one trial on the fastest worker.
    fn limit(self, population_size: usize, n_workers: usize) -> f64 {
        let ideal = self.work(population_size).div_f64(total_speed(n_workers));
        let fastest = (0..n_workers).map(speed).fold(0.0, f64::max);
        let one_trial = self.trial.mul_f64((1.0 + CALL_OVERHEAD) / fastest);
        ideal.as_secs_f64() / ideal.max(one_trial).as_secs_f64()
    }

    /// The shortest time of a scheduler that knows all speeds, but not the duration of each trial.
    /// It assigns all trials at once, with the best margin for long trials.
    fn with_known_speeds(self, population_size: usize, n_workers: usize) -> f64 {
        let margins = (0..=8).map(|half| f64::from(half) / 2.0);
        let times = margins.map(|margin| self.planned_time(population_size, n_workers, margin));
        let best = times.fold(f64::INFINITY, f64::min);
        self.work(population_size).div_f64(total_speed(n_workers)).as_secs_f64() / best
    }

    /// Duration of a generation, s, if every worker gets as many trials as it should compute in
    /// the same time, plus `margin` standard deviations.
    fn planned_time(self, population_size: usize, n_workers: usize, margin: f64) -> f64 {
        let n_needed = population_size * N_TRIALS as usize;
        // A uniform distribution's standard deviation is its width / sqrt(12).
        let deviation = 2.0 * DISPERSION / 12_f64.sqrt();
        // In trials of a worker of speed 1.
        let overhead = |n: usize| n.div_ceil(N_TRIALS as usize) as f64 * CALL_OVERHEAD;
        let expected = |n: usize| n as f64 + overhead(n) + margin * deviation * (n as f64).sqrt();
        let n_within = |time: f64, worker: usize| {
            let most = (time * speed(worker)) as usize;
            (0..=most).rev().find(|&n| expected(n) <= time * speed(worker)).unwrap_or(0)
        };
        let is_enough = |time: f64| {
            (0..n_workers).map(|worker| n_within(time, worker)).sum::<usize>() >= n_needed
        };
        let (mut too_short, mut enough) = (0.0, 1.0);
        while !is_enough(enough) {
            enough *= 2.0;
        }
        while enough - too_short > 1e-3 * enough {
            let middle = f64::midpoint(too_short, enough);
            *if is_enough(middle) { &mut enough } else { &mut too_short } = middle;
        }
        let (mut n_given, mut longest) = (0, 0.0_f64);
        for worker in 0..n_workers {
            let n = n_within(enough, worker).min(n_needed - n_given);
            let trials = (n_given..n_given + n).map(|trial| uniform(trial as u64));
            let trials = trials.map(|draw| 1.0 + DISPERSION * (2.0 * draw - 1.0)).sum::<f64>();
            longest = longest.max((trials + overhead(n)) / speed(worker));
            n_given += n;
        }
        longest * self.trial.as_secs_f64() + 2.0 * self.latency.as_secs_f64()
    }

    /// The duration of generations without idle slots, divided by their real duration.
    fn efficiency(
        self,
        config: EngineConfig,
        population_size: usize,
        n_workers: usize,
        stalled: f64,
    ) -> f64 {
        let model = FleetModel {
            latency: self.latency,
            trial: self.trial,
            dispersion: DISPERSION,
            stops: false,
            checks: false,
        };
        let mut fleet = simulated(model, config);
        for worker in 0..n_workers {
            fleet.join(1, speed(worker));
        }
        fleet.submit(EXPERIMENT, 100);
        let mut measured_from = Duration::ZERO;
        for generation in 0..N_GENERATIONS {
            if generation == N_TEACHING {
                measured_from = fleet.now();
            }
            fleet.ask(EXPERIMENT, generation, population_size, N_TRIALS);
            let ids = fleet.worker_ids();
            let n_stalled = (stalled * n_workers as f64) as usize;
            for i in 0..n_stalled {
                let place = generation << 32 | i as u64;
                let id = ids[(uniform(place) * ids.len() as f64) as usize];
                fleet.stall(id, Duration::from_secs(30));
            }
            let n_evaluated = generation as usize + 1;
            let is_done = |fleet: &SimulatedFleet| fleet.evaluated.len() == n_evaluated;
            assert!(fleet.run_until(Duration::from_secs(1_000_000), is_done));
        }
        let taken =
            (fleet.now() - measured_from).as_secs_f64() / (N_GENERATIONS - N_TEACHING) as f64;
        self.work(population_size).div_f64(total_speed(n_workers)).as_secs_f64() / taken
    }
}

/// Items per second of one core, if workers and network cost nothing.
#[expect(clippy::disallowed_methods, reason = "measures the engine's own time")]
fn throughput() -> f64 {
    let mut now = engine::Instant::after_origin(Duration::ZERO);
    let mut engine = Engine::new(now, EngineConfig::new(LEASE));
    for worker in 0..10_000 {
        let name = format!("worker-{worker}").into();
        let version = String::new();
        engine.on_worker_joined(
            now,
            Introduction {
                name,
                version,
                n_slots: 1,
                experiments: NamePattern::default(),
                process: None,
            },
        );
    }
    engine.on_job_started(now, EXPERIMENT, "name".into(), "spec".into(), Priority::default());
    let genotypes = population(100_000);
    let started = Instant::now();
    let batch = Batch::fitness(TrialSet::Generation(0), genotypes, 1);
    engine.on_batch_requested(now, EXPERIMENT, batch);
    let mut n_items = 0;
    loop {
        match engine.poll_command() {
            Some(Command::Send(worker, ToWorker::Assignments(Assignments { items, .. }))) => {
                n_items += items.len();
                now += Duration::from_micros(10);
                let compute_time = Duration::from_millis(100);
                for assignment in items {
                    let outcome = Ok(vec![fitness(&assignment.genotype, 0)]);
                    let result = ItemResult {
                        id: assignment.id,
                        output: Output::Fitness,
                        outcome,
                        compute_time,
                    };
                    engine.on_results(now, worker, vec![result]);
                }
            }
            Some(Command::FinishBatch { .. }) => break,
            Some(_) => {}
            None => unreachable!("the generation is not finished"),
        }
    }
    n_items as f64 / started.elapsed().as_secs_f64()
}
