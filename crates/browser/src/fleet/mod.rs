//! The fleet in a page: the coordinator's engine, in virtual time, with workers that a visitor
//! treats badly; and the same run on a fleet that nobody disturbs.
//!
//! Both fleets compute real fitness, so their digests are those of every other fleet.

mod computing;
mod evolving;
mod machine;
mod spectator;
#[cfg(test)]
mod tests;

use std::{cell::RefCell, rc::Rc, time::Duration};

use engine::{EngineConfig, ItemState};
use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use model::ids::{ExperimentId, JobId};
use model::priority::Priority;
use serde::Serialize;
use sim_core::{Simulation, TrialSet};
use simulated_fleet::{FleetModel, SimulatedFleet, uniform};

use computing::{Computing, Trials};
use evolving::{Evolving, Link};
pub use machine::Health;
use machine::Machine;
use spectator::{Event, Spectator};

/// The experiment of both fleets, which the first run of the manual computes, too.
const EXPERIMENT: &str = include_str!("../../../../configs/quickstart.json");
/// Number of workers.
pub const N_WORKERS: usize = 20;
/// The longest time that passes in a call.
const ADVANCE_MAX: Duration = Duration::from_secs(60);
/// A call ends after this number of simulated trials, so that a page stays responsive.
const TRIALS_PER_CALL: u64 = 12;
/// The coordinator's default.
const LEASE: Duration = Duration::from_secs(10);
const JOB: JobId = JobId::Experiment(ExperimentId(1));
/// Slow enough to be watched.
const MODEL: FleetModel = FleetModel {
    latency: Duration::from_millis(300),
    trial: Duration::from_millis(350),
    dispersion: 0.5,
    stops: true,
    checks: false,
};

/// A run on a fleet.
struct Run {
    fleet: SimulatedFleet<Computing>,
    evolving: Evolving,
    machines: Vec<Machine>,
    n_processes: u64,
    /// When the run was over.
    over_at: Option<Duration>,
}

/// The two fleets.
pub struct TwoFleets {
    trials: Rc<RefCell<Trials>>,
    disturbed: Run,
    undisturbed: Run,
    spectator: Spectator,
}

/// What a page draws.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Time since the beginning, ms.
    now: f64,
    /// The disturbed run.
    disturbed: Progress,
    /// The undisturbed run.
    undisturbed: Progress,
    /// The workers.
    workers: Vec<WorkerReport>,
    /// The state of each trial of the present batch, individual by individual, as a digit: queued,
    /// assigned, delayed, referred to the referee, done.
    cells: String,
    /// Individuals of the present batch.
    n_individuals: usize,
    /// Audits that no worker has yet.
    n_audits_waiting: usize,
    /// Audits that workers have.
    n_audits: usize,
    /// The open questions for the referee.
    questions: Vec<String>,
    /// What has happened since the last report.
    events: Vec<Event>,
}

/// How far a run is.
#[derive(Debug, Serialize)]
pub struct Progress {
    /// What is being computed, for people.
    round: String,
    /// The links of the digest chain, the last one of the run included.
    links: Vec<Link>,
    /// When the run was over, ms.
    over_at: Option<f64>,
}

/// A worker, as the visitor treats it and as the coordinator sees it.
#[derive(Debug, Serialize)]
pub struct WorkerReport {
    health: Health,
    is_connected: bool,
    quarantined: Option<String>,
    /// Why the coordinator gives it nothing for a while.
    waits: Option<String>,
    /// Items that the coordinator has given to it.
    n_items: usize,
    silent_ms: f64,
}

impl TwoFleets {
    /// Both fleets at the beginning. `audits`: the share of the individuals that two workers
    /// compute.
    pub fn new(audits: f64) -> Result<Self, String> {
        let (config, _) = ExperimentConfig::from_json(EXPERIMENT, "", ALGORITHMS)
            .map_err(|error| error.to_string())?;
        let simulation = Simulation::compile(&config).map_err(|error| error.to_string())?;
        let evolvings = [(); 2].map(|()| Evolving::new(config.clone(), &simulation));
        let trials = Rc::new(RefCell::new(Trials::new(simulation)));
        let audit_fraction = if audits.is_finite() { audits.clamp(0.0, 1.0) } else { 1.0 };
        let config = EngineConfig { audit_fraction, ..EngineConfig::new(LEASE) };
        let [disturbed, undisturbed] = evolvings;
        let work = |is_watched| Computing::new(Rc::clone(&trials), is_watched);
        let mut fleets = Self {
            disturbed: Run::new(config, disturbed, work(true)),
            undisturbed: Run::new(config, undisturbed, work(false)),
            trials,
            spectator: Spectator::default(),
        };
        fleets.look();
        fleets.disturbed.request();
        fleets.undisturbed.request();
        fleets.look();
        Ok(fleets)
    }

    /// Number of generations of the experiment.
    pub fn n_generations(&self) -> u64 {
        self.disturbed.evolving.n_generations()
    }

    /// The names of the workers.
    pub fn names(&self) -> Vec<&str> {
        self.disturbed.machines.iter().map(|machine| &*machine.name).collect()
    }

    /// Lets time pass, but less if that would take a page too long.
    pub fn advance(&mut self, time: Duration) -> Result<(), String> {
        let until = self.disturbed.fleet.now() + time.min(ADVANCE_MAX);
        let limit = self.trials.borrow().n_simulated() + TRIALS_PER_CALL;
        let may_go_on = |trials: &RefCell<Trials>| trials.borrow().n_simulated() < limit;
        while self.disturbed.advance(until, || may_go_on(&self.trials))? {
            // Sees the end of a batch before the items of the next one.
            self.look();
            self.disturbed.request();
        }
        let until = self.disturbed.fleet.now();
        while self.undisturbed.advance(until, || may_go_on(&self.trials))? {
            self.undisturbed.request();
        }
        self.look();
        Ok(())
    }

    /// The visitor changes the state of a worker's machine.
    pub fn treat(&mut self, worker: usize, health: Health) -> Result<(), String> {
        self.disturbed.treat(worker, health)?;
        if health == Health::Killed {
            self.spectator.forget(worker);
        }
        self.look();
        Ok(())
    }

    /// What has happened since the last report, and the present state.
    pub fn report(&mut self) -> Report {
        let run = &self.disturbed;
        let states = run.fleet.engine.trial_states(JOB);
        let digit = |state: &ItemState| char::from(b'0' + *state as u8);
        let activity = run.fleet.activity(JOB);
        let status = run.fleet.status();
        let workers = run.machines.iter().map(|machine| {
            let connection = status.iter().find(|status| Some(status.id) == machine.connection);
            WorkerReport {
                health: machine.health,
                is_connected: connection.is_some(),
                quarantined: connection.and_then(|status| status.quarantined.clone()),
                waits: connection.and_then(|status| status.waits.clone()),
                n_items: connection.map_or(0, |status| status.n_in_flight),
                silent_ms: connection.map_or(0.0, |status| ms(status.silent_for)),
            }
        });
        let batch = activity.batch;
        let question = |question: &engine::OpenQuestion| question.doubt.clone();
        Report {
            now: ms(run.fleet.now()),
            workers: workers.collect(),
            cells: states.iter().flatten().map(digit).collect(),
            n_individuals: states.len(),
            n_audits_waiting: batch.map_or(0, |batch| batch.n_audits_waiting),
            n_audits: self.spectator.n_audits(),
            questions: activity.questions.iter().map(question).collect(),
            disturbed: self.disturbed.progress(),
            undisturbed: self.undisturbed.progress(),
            events: self.spectator.take(),
        }
    }

    fn look(&mut self) {
        let notes = self.disturbed.fleet.work.take_notes();
        self.spectator.see(notes, &mut self.disturbed.machines);
        if let Some(trial_set) = self.disturbed.evolving.trial_set() {
            self.spectator.see_round(self.disturbed.fleet.now(), name_of(trial_set));
        }
    }
}

impl Run {
    fn new(config: EngineConfig, evolving: Evolving, work: Computing) -> Self {
        let machine =
            |i: usize| Machine::new(format!("worker-{:02}", i + 1), 0.75 + 0.5 * uniform(i as u64));
        let mut run = Self {
            fleet: SimulatedFleet::new(MODEL, config, work),
            evolving,
            machines: (0..N_WORKERS).map(machine).collect(),
            n_processes: 0,
            over_at: None,
        };
        run.fleet.tell(|engine, now| {
            let (name, priority) = ("quickstart".into(), Priority::default());
            engine.on_job_started(now, JOB, name, EXPERIMENT.into(), priority);
        });
        for machine in &mut run.machines {
            machine.treat(&mut run.fleet, Health::Healthy, &mut run.n_processes);
        }
        run
    }

    /// Lets time pass until a batch has ended; returns whether it has.
    fn advance(&mut self, until: Duration, may_go_on: impl Fn() -> bool) -> Result<bool, String> {
        let rest = until.saturating_sub(self.fleet.now());
        self.fleet.run_until(rest, |fleet| !fleet.evaluated.is_empty() || !may_go_on());
        if let Some((_, failure)) = self.fleet.failed.first() {
            return Err(failure.clone());
        }
        let Some((_, evaluated)) = self.fleet.evaluated.pop() else { return Ok(false) };
        self.evolving.learn(&evaluated)?;
        if self.evolving.is_over() {
            self.over_at = Some(self.fleet.now());
        }
        Ok(true)
    }

    /// Requests the present batch.
    fn request(&mut self) {
        let batch = self.evolving.batch();
        self.fleet.tell(|engine, now| match batch {
            Some(batch) => engine.on_batch_requested(now, JOB, batch),
            None => engine.on_job_ended(now, JOB),
        });
    }

    fn treat(&mut self, worker: usize, health: Health) -> Result<(), String> {
        let machine = self.machines.get_mut(worker).ok_or("there is no such worker")?;
        machine.treat(&mut self.fleet, health, &mut self.n_processes);
        Ok(())
    }

    fn progress(&self) -> Progress {
        Progress {
            round: self.evolving.trial_set().map_or("over".to_owned(), name_of),
            links: self.evolving.links().to_vec(),
            over_at: self.over_at.map(ms),
        }
    }
}

/// The name of a batch for people.
fn name_of(trial_set: TrialSet) -> String {
    match trial_set {
        TrialSet::HeldOut { generation, .. } => {
            format!("candidates for the champion after generation {generation}, on new trials")
        }
        TrialSet::Judgement(_) => "the champion, on trials that selected nothing".to_owned(),
        other => other.to_string(),
    }
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1000.0
}
