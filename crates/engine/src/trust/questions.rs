//! The questions for the referee, and their reasons.
//!
//! The simulation is deterministic: an item fails everywhere or nowhere, and a trial gives the
//! same bits everywhere. So the referee's result is authoritative, and shows which worker was
//! wrong.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::Duration,
};

use model::ids::{JobId, QuestionId, WorkerId};
use sim_core::TrialSet;

use crate::{Instant, referee::RefereeRequest};

use super::super::{Command, batch::name_of, item::Item, known_results::same_bits};

/// Number of processes that an item must take down before it is to blame. A single death may have
/// another cause, such as a system that is short of memory.
const N_DEATHS: u32 = 3;
/// Time between these attempts, in which other causes should pass.
const DEATH_DELAY: Duration = Duration::from_secs(5);
/// Time before another attempt if the referee could not answer; doubles with each attempt.
const FIRST_DELAY: Duration = Duration::from_secs(1);
/// The longest time before another attempt.
const DELAY_MAX: Duration = Duration::from_secs(60);

/// A question for the referee.
#[derive(Debug)]
pub struct Question {
    /// The item's job.
    pub job: JobId,
    /// The item.
    pub item: Item,
    /// The request to the referee.
    pub request: RefereeRequest,
    /// Why the engine asks.
    pub doubt: Doubt,
    /// When to ask again, if the referee could not answer.
    ask_again: Option<Instant>,
    /// Why the referee could not answer.
    pub trouble: Option<String>,
    n_delays: u32,
    n_deaths: u32,
}

/// Why the engine asks the referee.
#[derive(Debug)]
pub enum Doubt {
    /// A worker reports that the item fails.
    Failure {
        /// The worker.
        reporter: Party,
        /// The worker's message.
        message: String,
    },
    /// Workers were lost while they computed the item.
    Losses,
    /// Two workers' values for a trial differ.
    Disagreement {
        /// The two workers, and the numbers that each has returned for the trial.
        parties: [(Party, Vec<f64>); 2],
    },
    /// No individual of a generation has a finite fitness, according to the workers. This would
    /// end evolution, so the referee checks it.
    NoFitness,
}

/// A worker whose result is in doubt; it may have left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Party {
    /// Its connection.
    pub id: WorkerId,
    /// Its name.
    pub name: Arc<str>,
}

/// An item that the referee computes, or will.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenQuestion {
    /// The item's individual.
    pub individual: u32,
    /// The doubt that the referee settles.
    pub doubt: String,
    /// Why the referee could not answer so far.
    pub trouble: Option<String>,
}

impl Question {
    /// A question that has not been asked.
    pub fn new(job: JobId, item: Item, request: RefereeRequest, doubt: Doubt) -> Self {
        Self { job, item, request, doubt, ask_again: None, trouble: None, n_delays: 0, n_deaths: 0 }
    }

    /// The workers whose results are in doubt.
    pub fn parties(&self) -> Vec<&Party> {
        match &self.doubt {
            Doubt::Failure { reporter, .. } => vec![reporter],
            Doubt::Losses | Doubt::NoFitness => vec![],
            Doubt::Disagreement { parties: [(first, _), (second, _)] } => vec![first, second],
        }
    }

    /// The workers that are wrong, each with its error, if the item has these values, or fails
    /// for this reason.
    pub fn refuted(&self, finding: Result<&[f64], &str>) -> Vec<(&Party, String)> {
        let place = self.place();
        match (&self.doubt, finding) {
            (Doubt::Failure { reporter, message }, Ok(_)) => {
                let reason = format!(
                    "it reports that {place} fails (\"{message}\"), and the referee computes it"
                );
                vec![(reporter, reason)]
            }
            (Doubt::Disagreement { parties }, Ok(right)) => parties
                .iter()
                .filter(|(_, returned)| !same_bits(returned, right))
                .map(|(party, returned)| (party, wrong(returned, right, &place)))
                .collect(),
            (Doubt::Disagreement { parties }, Err(failure)) => parties
                .iter()
                .map(|(party, returned)| {
                    let first = returned.first().map_or("nothing".to_owned(), |v| format!("{v:?}"));
                    (party, format!("it returned {first} for {place}, which fails: {failure}"))
                })
                .collect(),
            _ => Vec::new(),
        }
    }

    /// The item in messages.
    pub fn place(&self) -> String {
        place(&self.item, self.request.trial_set)
    }

    /// The question, for people.
    pub fn activity(&self) -> OpenQuestion {
        let doubt = match &self.doubt {
            Doubt::Failure { reporter, message } => {
                format!("worker \"{}\" reports that it fails: {message}", reporter.name)
            }
            Doubt::Losses => "workers were lost again and again while they computed it".to_owned(),
            Doubt::Disagreement { parties: [(first, _), (second, _)] } => {
                format!("workers \"{}\" and \"{}\" return different bits", first.name, second.name)
            }
            Doubt::NoFitness => {
                "no individual of the generation has a finite fitness, as the workers say"
                    .to_owned()
            }
        };
        OpenQuestion { individual: self.item.individual, doubt, trouble: self.trouble.clone() }
    }

    /// Whether its item is withheld from workers until the answer. An item that workers have
    /// computed is not withheld, nor is any while the referee cannot answer.
    pub fn withholds(&self) -> bool {
        matches!(self.doubt, Doubt::Failure { .. } | Doubt::Losses) && self.trouble.is_none()
    }

    /// The referee could not answer.
    pub fn postpone(&mut self, now: Instant, trouble: String) {
        let delay = (FIRST_DELAY * (1 << self.n_delays.min(10))).min(DELAY_MAX);
        self.n_delays += 1;
        self.ask_again = Some(now + delay);
        self.trouble = Some(trouble);
    }

    /// The referee's process died over the item; returns whether the item is to blame.
    pub fn on_death(&mut self, now: Instant) -> bool {
        self.n_deaths += 1;
        self.ask_again = Some(now + DEATH_DELAY);
        self.n_deaths >= N_DEATHS
    }

    fn command(&self, id: QuestionId) -> Command {
        Command::AskReferee { question: id, request: self.request.clone() }
    }
}

/// The questions without an answer.
#[derive(Debug, Default)]
pub struct Questions {
    open: BTreeMap<QuestionId, Question>,
    n_asked: u64,
}

impl Questions {
    /// Adds a question; returns its id and the command that asks it.
    pub fn ask(&mut self, question: Question) -> (QuestionId, Command) {
        self.n_asked += 1;
        let id = QuestionId(self.n_asked);
        let command = question.command(id);
        self.open.insert(id, question);
        (id, command)
    }

    /// Removes a question.
    pub fn take(&mut self, id: QuestionId) -> Option<Question> {
        self.open.remove(&id)
    }

    /// Puts a removed question back.
    pub fn put_back(&mut self, id: QuestionId, question: Question) {
        self.open.insert(id, question);
    }

    /// The commands that repeat questions that the referee could not answer.
    pub fn asked_again(&mut self, now: Instant) -> Vec<Command> {
        let ask = |(&id, question): (&QuestionId, &mut Question)| {
            question.ask_again.take_if(|at| *at <= now)?;
            Some(question.command(id))
        };
        self.open.iter_mut().filter_map(ask).collect()
    }

    /// The questions about a job.
    pub fn about(&self, job: JobId) -> impl Iterator<Item = (QuestionId, &Question)> {
        let ours = self.open.iter().filter(move |(_, question)| question.job == job);
        ours.map(|(&id, question)| (id, question))
    }

    /// Number of questions about a job with a reason that satisfies `is_reason`.
    pub fn n_about(&self, job: JobId, is_reason: impl Fn(&Doubt) -> bool) -> usize {
        self.about(job).filter(|(_, question)| is_reason(&question.doubt)).count()
    }

    /// The names of the workers with a result in doubt. A reported failure that the referee cannot
    /// check puts no result in doubt.
    pub fn doubted(&self) -> BTreeSet<&str> {
        let is_moot = |question: &&Question| {
            question.trouble.is_some() && matches!(question.doubt, Doubt::Failure { .. })
        };
        let questions = self.open.values().filter(|question| !is_moot(question));
        questions.flat_map(Question::parties).map(|party| &*party.name).collect()
    }

    /// Whether the referee may soon answer a question.
    pub fn is_answerable(&self, id: QuestionId) -> bool {
        self.open.get(&id).is_none_or(|question| question.trouble.is_none())
    }

    /// Number of questions since the engine began.
    pub fn n_asked(&self) -> u64 {
        self.n_asked
    }
}

/// An item of the batch of a trial set in messages.
pub fn place(item: &Item, trial_set: TrialSet) -> String {
    let Item { individual, trials } = item;
    let batch = name_of(trial_set);
    if trials.len() == 1 {
        format!("trial {} of individual {individual} of {batch}", trials.start)
    } else {
        format!("trials {}..{} of individual {individual} of {batch}", trials.start, trials.end)
    }
}

/// Describes the first wrong number of a worker's result.
pub fn wrong(returned: &[f64], right: &[f64], place: &str) -> String {
    let mut pairs = returned.iter().zip(right);
    let (returned, right) = pairs
        .find(|(returned, right)| returned.to_bits() != right.to_bits())
        .unwrap_or((&f64::NAN, &f64::NAN));
    format!("it returned {returned:?} for {place}, and the referee {right:?}")
}
