//! A machine with a worker, as a visitor treats it.

use std::num::NonZeroU64;

use engine::{Introduction, NamePattern};
use model::ids::WorkerId;
use serde::{Deserialize, Serialize};
use simulated_fleet::{Conduct, SimulatedFleet};

use super::computing::Computing;

/// The speed of a slow machine, relative to its healthy one.
const SLOW: f64 = 0.25;

/// The state of a machine, which the coordinator does not know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Health {
    /// It computes.
    Healthy,
    /// The process was killed.
    Killed,
    /// The process is stopped: it neither computes nor says anything.
    Hung,
    /// It takes four times as long.
    Slow,
    /// It returns wrong numbers.
    Lying,
}

/// A machine.
#[derive(Debug)]
pub struct Machine {
    /// The name of its worker.
    pub name: String,
    /// The present connection of its worker.
    pub connection: Option<WorkerId>,
    /// Its state.
    pub health: Health,
    speed: f64,
    /// Identifies its latest process; 0 before the first one.
    process: u64,
}

impl Machine {
    /// A machine without a worker; `speed`: relative to the mean.
    pub fn new(name: String, speed: f64) -> Self {
        Self { name, connection: None, health: Health::Killed, speed, process: 0 }
    }

    /// Changes its state. `n_processes`: the number of processes so far.
    pub fn treat(
        &mut self,
        fleet: &mut SimulatedFleet<Computing>,
        health: Health,
        n_processes: &mut u64,
    ) {
        if health == Health::Killed {
            if let Some(id) = self.connection.take() {
                fleet.kill(id);
            }
            self.health = health;
            return;
        }
        if self.health == Health::Killed {
            *n_processes += 1;
            self.process = *n_processes;
        }
        let id = match self.connection {
            Some(id) => id,
            // It is new, or the coordinator gave it up while it hung.
            None => fleet.connect(self.introduction(), self.speed, Conduct::Honest, false),
        };
        self.connection = Some(id);
        if health == Health::Healthy {
            let name = self.name.clone();
            fleet.tell(|engine, now| {
                engine.on_readmitted(now, &name);
            });
        }
        let conduct = if health == Health::Lying { Conduct::Lies } else { Conduct::Honest };
        fleet.set_conduct(id, conduct);
        fleet.set_speed(id, if health == Health::Slow { SLOW * self.speed } else { self.speed });
        if health == Health::Hung {
            fleet.hang(id);
        } else if self.health == Health::Hung {
            fleet.wake(id);
        }
        self.health = health;
    }

    fn introduction(&self) -> Introduction {
        Introduction {
            name: self.name.as_str().into(),
            version: "simulated".to_owned(),
            n_slots: 1,
            experiments: NamePattern::default(),
            process: NonZeroU64::new(self.process),
        }
    }
}
