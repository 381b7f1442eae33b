//! What a visitor sees of a fleet: items on their way, and what becomes of workers.

use std::{collections::BTreeMap, mem, ops::Range, time::Duration};

use model::ids::{AssignmentId, QuestionId, WorkerId};
use serde::Serialize;
use simulated_fleet::Note;

use super::{machine::Machine, ms};

/// Most events between two looks; a page that looks too seldom misses the rest.
const EVENTS_MAX: usize = 4096;

/// Why a worker computes an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Purpose {
    /// Nobody computes it.
    Item,
    /// Another worker computes it, too, and perhaps more slowly.
    Copy,
    /// Its result is known, and is to be confirmed.
    Audit,
}

/// What happens, at `at` ms. Workers are indices.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "what", rename_all = "kebab-case")]
pub enum Event {
    /// The coordinator sends an item, which arrives at `until`.
    Sent {
        at: f64,
        until: f64,
        assignment: u64,
        worker: usize,
        individual: u32,
        first: u32,
        end: u32,
        purpose: Purpose,
    },
    /// A worker computes an item until `until`, if nothing comes between.
    Began { at: f64, until: f64, assignment: u64 },
    /// A result is on its way, and arrives at `until`.
    Returned { at: f64, until: f64, assignment: u64 },
    /// A result has arrived.
    Arrived { at: f64, assignment: u64 },
    /// The coordinator no longer needs an item.
    Dropped { at: f64, assignment: u64 },
    /// The coordinator gives a worker up.
    GivenUp { at: f64, worker: usize, reason: String },
    /// The coordinator asks the referee.
    Asked { at: f64, question: u64, individual: u32, first: u32, end: u32 },
    /// The referee answers.
    Answered { at: f64, question: u64 },
    /// A worker is proved faulty.
    Quarantined { at: f64, worker: usize, reason: String },
    /// Another batch begins.
    Round { at: f64, name: String },
}

/// An item without a result.
#[derive(Debug)]
struct InFlight {
    worker: usize,
    individual: u32,
    trials: Range<u32>,
    purpose: Purpose,
}

/// Follows the notes of a fleet.
#[derive(Debug, Default)]
pub struct Spectator {
    events: Vec<Event>,
    round: String,
    in_flight: BTreeMap<AssignmentId, InFlight>,
    /// The first worker with a result for a trial, by individual and trial; none is the referee.
    done: BTreeMap<(u32, u32), Option<usize>>,
    /// The questions without an answer: individual and trials.
    asked: BTreeMap<QuestionId, (u32, Range<u32>)>,
}

impl Spectator {
    /// The events since the last look.
    pub fn take(&mut self) -> Vec<Event> {
        mem::take(&mut self.events)
    }

    /// A worker has lost its items.
    pub fn forget(&mut self, worker: usize) {
        self.in_flight.retain(|_, item| item.worker != worker);
    }

    /// The number of audits that workers have.
    pub fn n_audits(&self) -> usize {
        self.in_flight.values().filter(|item| item.purpose == Purpose::Audit).count()
    }

    /// The present batch.
    pub fn see_round(&mut self, now: Duration, name: String) {
        if self.round != name {
            self.done.clear();
            self.asked.clear();
            self.in_flight.clear();
            self.round.clone_from(&name);
            self.add(Event::Round { at: ms(now), name });
        }
    }

    /// What has happened to a fleet of these machines, which lose dropped connections.
    pub fn see(&mut self, notes: Vec<(Duration, Note)>, machines: &mut [Machine]) {
        for (at, note) in notes {
            if let Some(event) = self.event(ms(at), note, machines) {
                self.add(event);
            }
        }
    }

    fn add(&mut self, event: Event) {
        if self.events.len() < EVENTS_MAX {
            self.events.push(event);
        }
    }

    fn event(&mut self, at: f64, note: Note, machines: &mut [Machine]) -> Option<Event> {
        let index =
            |id: WorkerId| machines.iter().position(|machine| machine.connection == Some(id));
        Some(match note {
            Note::Sent { worker, assignment, individual, trials, arrives } => {
                let worker = index(worker)?;
                let purpose = self.purpose(individual, trials.clone());
                let (first, end) = (trials.start, trials.end);
                let item = InFlight { worker, individual, trials, purpose };
                self.in_flight.insert(assignment, item);
                let (until, assignment) = (ms(arrives), assignment.0);
                Event::Sent { at, until, assignment, worker, individual, first, end, purpose }
            }
            Note::Began { assignment, ends } => {
                Event::Began { at, until: ms(ends), assignment: assignment.0 }
            }
            Note::Returned { assignment, arrives } => {
                Event::Returned { at, until: ms(arrives), assignment: assignment.0 }
            }
            Note::Arrived { assignment } => {
                if let Some(InFlight { worker, individual, trials, .. }) =
                    self.in_flight.remove(&assignment)
                {
                    for trial in trials {
                        self.done.entry((individual, trial)).or_insert(Some(worker));
                    }
                }
                Event::Arrived { at, assignment: assignment.0 }
            }
            Note::Dropped { assignment } => {
                self.in_flight.remove(&assignment);
                Event::Dropped { at, assignment: assignment.0 }
            }
            Note::Disconnected { worker, reason } => {
                let worker = index(worker)?;
                machines[worker].connection = None;
                self.forget(worker);
                Event::GivenUp { at, worker, reason }
            }
            Note::Asked { question, individual, trials } => {
                let (first, end) = (trials.start, trials.end);
                self.asked.insert(question, (individual, trials));
                Event::Asked { at, question: question.0, individual, first, end }
            }
            Note::Answered { question } => {
                let (individual, trials) = self.asked.remove(&question)?;
                self.done.extend(trials.map(|trial| ((individual, trial), None)));
                Event::Answered { at, question: question.0 }
            }
            Note::Quarantined { name, reason } => {
                let worker = machines.iter().position(|machine| machine.name == name)?;
                // Its results no longer count.
                self.done.retain(|_, first| *first != Some(worker));
                Event::Quarantined { at, worker, reason }
            }
        })
    }

    fn purpose(&self, individual: u32, trials: Range<u32>) -> Purpose {
        let is_computed = |item: &InFlight| {
            item.individual == individual
                && item.trials.start < trials.end
                && trials.start < item.trials.end
        };
        if trials.clone().all(|trial| self.done.contains_key(&(individual, trial))) {
            Purpose::Audit
        } else if self.in_flight.values().any(is_computed) {
            Purpose::Copy
        } else {
            Purpose::Item
        }
    }
}
