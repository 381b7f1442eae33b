//! Faults cost time, but change no bit of the result.
//!
//! Every test asserts that its fault has happened, and that the digests of all
//! generations and of the champion equal those of an undisturbed run.

// These tests need failpoints, which optimised programs lack.
#[cfg(debug_assertions)]
mod commits;
mod coordinator;
mod databases;
mod disk;
mod integrity;
mod misbehaviour;
mod network;
mod recovery;
mod trouble;
mod workers;

use std::sync::OnceLock;

use harness::{CoordinatorProcess, Experiment, LogLine, Watch, undisturbed};

/// Number of generations of these experiments.
const GENERATIONS: u64 = 6;

/// An experiment whose generations take tens of milliseconds each, enough time for a fault.
static SMALL: Subject = Subject::new(|| Experiment::small(GENERATIONS));
/// An experiment with more items than two workers of one slot get at once.
static MANY: Subject = Subject::new(|| {
    Experiment::small(GENERATIONS).edit(|e| e["algorithm"]["population_size"] = 60.into())
});
/// A short experiment, for faults that need no time.
static TINY: Subject = Subject::new(|| Experiment::tiny(GENERATIONS));

/// A second experiment, beside another one.
static OTHER: Subject =
    Subject::new(|| Experiment::tiny(GENERATIONS).edit(|e| e["seed"] = 8.into()));

/// An experiment and its digests.
struct Subject {
    make: fn() -> Experiment,
    undisturbed: OnceLock<Vec<String>>,
}

impl Subject {
    const fn new(make: fn() -> Experiment) -> Self {
        Self { make, undisturbed: OnceLock::new() }
    }

    fn submit(&self, coordinator: &CoordinatorProcess) -> u64 {
        coordinator.submit(&(self.make)().path())
    }

    /// The digests of an undisturbed run.
    fn undisturbed(&self) -> &[String] {
        self.undisturbed.get_or_init(|| undisturbed(&(self.make)()))
    }

    fn assert_undisturbed(&self, watch: Watch) {
        assert_eq!(watch.finish().digests(), self.undisturbed());
    }
}

/// Waits until a worker has got items of a generation; returns the line, and the number of lines
/// of the coordinator's log up to it.
fn wait_for_assignment(coordinator: &CoordinatorProcess, generation: u64) -> (usize, LogLine) {
    coordinator.process.find(0, "assignment", |line| {
        line["message"] == "items assigned" && line["generation"] == generation
    })
}

/// Waits until a worker is lost; returns the line.
fn wait_for_loss(coordinator: &CoordinatorProcess) -> LogLine {
    coordinator.process.wait_for("loss", |line| line["message"] == "worker lost")
}

/// The workers that a coordinator has lost so far.
fn n_lost(coordinator: &CoordinatorProcess) -> usize {
    coordinator.process.lines().iter().filter(|line| line["message"] == "worker lost").count()
}

/// The generation at which a restarted coordinator continued.
fn resumed_at(coordinator: &CoordinatorProcess) -> u64 {
    let line = coordinator
        .process
        .wait_for("start of the experiment", |line| line["message"] == "experiment starts");
    line["generation"].as_u64().unwrap()
}
