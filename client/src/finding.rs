//! The findings about an experiment's progress, with the next steps.

use std::{borrow::Cow, fmt, path::Path};

use model::{limits::BARRIER_AFTER, store::Holder, wire::round_name};
use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::{
    Experiment, ExperimentState, ExplainExperimentResponse, Round, WithheldWorker,
};

use crate::{clock, connection::Connection, text};

/// Maximum number of listed workers, so that everything fits one screen.
pub const WORKERS_MAX: usize = 8;

/// If a worker holds an item for longer, the findings suggest checking the worker.
const LONG_MS: u64 = 60_000;

/// One cause of an experiment's progress, or of the lack of it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Finding {
    kind: Kind,
    /// The finding, in one sentence.
    what: String,
    /// The next steps of the user; empty if none are necessary.
    next_steps: Vec<String>,
}

/// The kind of a finding, for programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    Ended,
    Paused,
    Incompatible,
    StoreTrouble,
    Memory,
    NoWorkers,
    NoWorkersAvailable,
    TakenByNone,
    Quarantine,
    WorkersWaiting,
    Referee,
    RefereeTrouble,
    IndividualsFailing,
    Queued,
    Audits,
    Barrier,
    Computing,
    BetweenGenerations,
    Deserted,
    ComputedElsewhere,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.what)?;
        self.next_steps.iter().try_for_each(|step| write!(f, "\n  -> {step}"))
    }
}

impl Finding {
    /// Adds the place of a connection to the commands of the next steps, because they would not
    /// find it by themselves.
    pub fn name_place(&mut self, connection: &Connection) {
        for step in &mut self.next_steps {
            *step = connection.in_place(step);
        }
    }

    /// Whether it concerns the fleet, and so is the same for all experiments.
    pub fn is_of_fleet(&self) -> bool {
        use Kind::{NoWorkers, NoWorkersAvailable, Quarantine, StoreTrouble, WorkersWaiting};
        matches!(
            self.kind,
            StoreTrouble | NoWorkers | NoWorkersAvailable | Quarantine | WorkersWaiting
        )
    }

    /// Whether it stops the whole experiment. `held_ms`: the time since a worker got the
    /// oldest items of its round.
    fn is_stall(&self, held_ms: u64) -> bool {
        use Kind::{
            Audits, Barrier, Incompatible, Memory, NoWorkers, NoWorkersAvailable, Paused, Queued,
            RefereeTrouble, StoreTrouble, TakenByNone,
        };
        match self.kind {
            Paused | Incompatible | StoreTrouble | Memory | NoWorkers | NoWorkersAvailable
            | TakenByNone | RefereeTrouble | Audits => true,
            // Other items are computed meanwhile.
            Queued => held_ms == 0,
            Barrier => u128::from(held_ms) >= BARRIER_AFTER.as_millis(),
            _ => false,
        }
    }
}

/// The obstacle of an experiment, if any.
pub fn stall(answer: &ExplainExperimentResponse, address: &str) -> Option<Finding> {
    let held_ms = answer.round.as_ref().map_or(0, held_ms);
    let findings = findings(answer.experiment.as_ref()?, answer, address);
    let mut stall = findings.into_iter().find(|finding| finding.is_stall(held_ms))?;
    if stall.kind == Kind::Barrier {
        // The times in its text advance although the situation is the same.
        stall.what = "the last items of the generation take a long time".to_owned();
        let id = answer.experiment.as_ref().map_or(0, |experiment| experiment.id);
        stall.next_steps = vec![format!("see which workers have them: swarmctl explain {id}")];
    }
    Some(stall)
}

/// The finding about an unfinished experiment in a data directory. `holder`: the program that
/// uses the directory.
pub fn in_directory(experiment: &Experiment, data_dir: &Path, holder: Option<&Holder>) -> Finding {
    let address = holder.and_then(|holder| holder.address.as_deref());
    match (holder, address) {
        (_, Some(address)) => finding(
            Kind::ComputedElsewhere,
            format!("a coordinator uses {}", data_dir.display()),
            [format!("ask it: swarmctl explain {} --coordinator {address}", experiment.id)],
        ),
        (Some(holder), None) => finding(
            Kind::ComputedElsewhere,
            format!("{holder} uses {}", data_dir.display()),
            [format!("follow it: {}", text::command_in("watch", experiment.id, data_dir))],
        ),
        (None, _) => finding(
            Kind::Deserted,
            "no program computes it",
            [format!("continue it: {}", text::command_in("resume", experiment.id, data_dir))],
        ),
    }
}

/// All findings about an experiment, the most important first.
pub fn findings(
    experiment: &Experiment,
    answer: &ExplainExperimentResponse,
    address: &str,
) -> Vec<Finding> {
    let id = experiment.id;
    match experiment.state() {
        ExperimentState::Completed => {
            let steps = [format!("read its champion: swarmctl champion {id}"), history(id)];
            return vec![finding(Kind::Ended, "it has completed", steps)];
        }
        ExperimentState::Failed | ExperimentState::Cancelled => {
            let steps = [format!("read its events: swarmctl watch {id} --events"), history(id)];
            return vec![finding(Kind::Ended, "it has ended early, for the reason above", steps)];
        }
        ExperimentState::Paused => {
            let steps = [format!("continue it: swarmctl resume {id}")];
            let what = text::with_reason("it is paused", &experiment.reason);
            return vec![finding(Kind::Paused, what, steps)];
        }
        ExperimentState::Running | ExperimentState::Unspecified => {}
    }
    if !answer.incompatible.is_empty() {
        let what = format!("only another version can compute it: {}", answer.incompatible);
        let steps = [
            "finish it with a coordinator of that version".to_owned(),
            format!("or cancel it and submit it again: swarmctl cancel {id}"),
        ];
        return vec![finding(Kind::Incompatible, what, steps)];
    }
    let mut findings = Vec::new();
    if !answer.store_trouble.is_empty() {
        let what = format!("the coordinator cannot store anything: {}", answer.store_trouble);
        let steps = ["free space on its disk; the coordinator retries by itself".to_owned()];
        findings.push(finding(Kind::StoreTrouble, what, steps));
    }
    if !answer.shortage.is_empty() {
        let what = format!("it waits for memory: {}", answer.shortage);
        let steps = [
            "see the others: swarmctl list".to_owned(),
            "or cancel one: swarmctl cancel ID".to_owned(),
        ];
        findings.push(finding(Kind::Memory, what, steps));
        return findings;
    }
    findings.extend(of_workers(experiment, answer, address));
    findings.extend(of_withheld(answer));
    findings.extend(of_questions(answer));
    match &answer.round {
        Some(round) => findings.extend(of_round(id, round, answer, address)),
        None => {
            let what = "between generations: the algorithm is updated and the generation is stored";
            findings.push(finding(Kind::BetweenGenerations, what, []));
        }
    }
    findings
}

fn of_workers(
    experiment: &Experiment,
    answer: &ExplainExperimentResponse,
    address: &str,
) -> Option<Finding> {
    let start = format!("start some: worker --coordinator {address}");
    if answer.workers == 0 {
        return Some(finding(Kind::NoWorkers, "no worker is connected", [start]));
    }
    if answer.workers_available == 0 && answer.workers_of_others > 0 {
        let workers = text::counted(answer.workers_of_others.into(), "worker");
        let what = format!(
            "no worker takes it: {workers} would be free, but only for experiments with other \
             names than {}",
            experiment.name
        );
        let steps = ["see for which: swarmctl workers --output wide".to_owned(), start];
        return Some(finding(Kind::TakenByNone, what, steps));
    }
    if answer.workers_available == 0 {
        let workers = text::counted(answer.workers.into(), "connected worker");
        let what =
            format!("none of {workers} gets items: all are leaving, waiting or in quarantine");
        let steps = ["see the reasons: swarmctl workers --output wide".to_owned(), start];
        return Some(finding(Kind::NoWorkersAvailable, what, steps));
    }
    None
}

/// Workers that get no items.
fn of_withheld(answer: &ExplainExperimentResponse) -> Vec<Finding> {
    let (quarantined, waiting): (Vec<_>, Vec<_>) =
        answer.withheld.iter().partition(|worker| worker.quarantined);
    let list = |workers: &[&WithheldWorker]| {
        let lines = workers.iter().take(WORKERS_MAX);
        lines.fold(String::new(), |text, worker| {
            text + &format!("\n  {}: {}", worker.worker_name, worker.reason)
        })
    };
    let mut findings = Vec::new();
    if let [first, ..] = quarantined[..] {
        let workers = text::counted(quarantined.len() as u64, "worker");
        let what = format!("{workers} in quarantine, proved faulty:{}", list(&quarantined));
        let steps = [
            "check the machine (memory, overheating) and the worker's program; the other workers \
             continue"
                .to_owned(),
            format!("then readmit it: swarmctl workers --readmit {}", quoted(&first.worker_name)),
        ];
        findings.push(finding(Kind::Quarantine, what, steps));
    }
    if !waiting.is_empty() {
        let workers = text::counted(waiting.len() as u64, "worker");
        let what = format!("{workers} without items for a while:{}", list(&waiting));
        let steps = [
            "no action is needed: each worker gets items again as its line says".to_owned(),
            "a worker that has returned nothing for a long time hangs: read its log and restart \
             it, which is safe"
                .to_owned(),
        ];
        findings.push(finding(Kind::WorkersWaiting, what, steps));
    }
    findings
}

/// The items that the referee computes.
fn of_questions(answer: &ExplainExperimentResponse) -> Vec<Finding> {
    let Some(question) = answer.questions.first() else { return Vec::new() };
    let more = match answer.questions.len() {
        1 => String::new(),
        n => format!(" ({} more)", n - 1),
    };
    let doubt = format!("individual {}: {}{more}", question.individual, question.doubt);
    let mut findings = vec![finding(
        Kind::Referee,
        format!("the coordinator computes an item itself to find the correct result; {doubt}"),
        [],
    )];
    if let Some(question) = answer.questions.iter().find(|question| !question.trouble.is_empty()) {
        let what = format!("it cannot do so at present: {}", question.trouble);
        let steps =
            ["fix that on the coordinator's machine; the coordinator retries within a minute"
                .to_owned()];
        findings.push(finding(Kind::RefereeTrouble, what, steps));
    }
    findings
}

fn of_round(
    id: u64,
    round: &Round,
    answer: &ExplainExperimentResponse,
    address: &str,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    if round.individuals_failing > 0 {
        let individuals = text::counted(round.individuals_failing.into(), "individual");
        let what = format!(
            "workers were lost while they computed {individuals}; if one also crashes the \
             coordinator's referee, the experiment fails"
        );
        let steps = [
            "find out why workers are lost: read their logs, and whether their machine is short \
             of memory"
                .to_owned(),
            "no other action is needed: other workers compute the items again".to_owned(),
        ];
        findings.push(finding(Kind::IndividualsFailing, what, steps));
    }
    let n_held: u64 = round.held.iter().map(|held| u64::from(held.items)).sum();
    let held_for = clock::duration_ms(held_ms(round));
    let is_served = answer.workers_available > 0;
    if is_served && round.items_queued > 0 && !answer.rivals.is_empty() {
        let ids: Vec<String> = answer.rivals.iter().take(10).map(u64::to_string).collect();
        let what = format!(
            "queued beside {} with unassigned items: {}",
            text::counted(answer.rivals.len() as u64, "other experiment"),
            ids.join(", ")
        );
        let steps = [
            format!("raise its share: swarmctl priority {id} N"),
            "or pause another experiment: swarmctl pause ID".to_owned(),
        ];
        findings.push(finding(Kind::Queued, what, steps));
    } else if round.items_queued == 0 && n_held > 0 {
        let holders = match &round.held[..] {
            [holder] => format!("worker {}", holder.worker_name),
            holders => text::counted(holders.len() as u64, "worker"),
        };
        let what = format!(
            "at the barrier: waiting for the last {} of {}, on {holders} for {held_for}",
            text::counted(n_held, "item"),
            round_name(round),
        );
        findings.push(finding(Kind::Barrier, what, look(round)));
    } else if n_held > 0 {
        let what = format!(
            "being computed: {} on {}, the oldest for {held_for}",
            text::counted(n_held, "item"),
            text::counted(round.held.len() as u64, "worker"),
        );
        findings.push(finding(Kind::Computing, what, look(round)));
    } else if round.items_queued == 0 && round.audits_waiting > 0 {
        let what = format!(
            "waiting for a worker of another name to audit {}; without one, the audit is skipped \
             after 30 s",
            text::counted(round.audits_waiting.into(), "item"),
        );
        let steps = [format!("start another: worker --coordinator {address}")];
        findings.push(finding(Kind::Audits, what, steps));
    }
    findings
}

/// Time since the oldest assignment, in milliseconds.
fn held_ms(round: &Round) -> u64 {
    round.held.iter().map(|held| held.held_ms).max().unwrap_or(0)
}

/// The next steps for a batch that takes long.
fn look(round: &Round) -> Vec<String> {
    if held_ms(round) < LONG_MS {
        return Vec::new();
    }
    vec![
        "long episodes can take this long; if these should be shorter, check the workers: \
         swarmctl workers"
            .into(),
        "stopping or killing a worker is safe: other workers get its items".into(),
    ]
}

/// A worker's name, quoted as one word of a shell.
fn quoted(name: &str) -> String {
    // Only a text with the character 0 cannot be quoted, and the coordinator sends none.
    shlex::try_quote(name).map_or_else(|_| "NAME".to_owned(), Cow::into_owned)
}

fn history(id: u64) -> String {
    format!("read all generations: swarmctl history {id}")
}

fn finding(
    kind: Kind,
    what: impl Into<String>,
    next_steps: impl IntoIterator<Item = String>,
) -> Finding {
    Finding { kind, what: what.into(), next_steps: next_steps.into_iter().collect() }
}

#[cfg(test)]
mod tests {
    use swarm_proto::v1::{HeldItems, RefereeQuestion};

    use super::*;

    fn kinds(experiment: Experiment, answer: &ExplainExperimentResponse) -> Vec<Kind> {
        findings(&experiment, answer, "http://h:1").iter().map(|finding| finding.kind).collect()
    }

    fn running() -> Experiment {
        Experiment { id: 3, state: ExperimentState::Running.into(), ..Experiment::default() }
    }

    fn held(items: u32) -> HeldItems {
        HeldItems { worker_name: "w".into(), items, ..HeldItems::default() }
    }

    /// Two workers compute, and items wait for them.
    fn healthy() -> ExplainExperimentResponse {
        let round = Round { items_queued: 7, held: vec![held(2), held(2)], ..Round::default() };
        ExplainExperimentResponse {
            round: Some(round),
            workers: 2,
            workers_available: 2,
            ..ExplainExperimentResponse::default()
        }
    }

    #[test]
    fn an_experiment_that_is_computed_needs_nothing() {
        let findings = findings(&running(), &healthy(), "http://h:1");
        assert_eq!(findings.len(), 1);
        assert_eq!(findings[0].kind, Kind::Computing);
        assert_eq!(findings[0].next_steps, [""; 0]);
    }

    #[test]
    fn an_ended_or_paused_experiment_waits_for_nothing_else() {
        for (state, kind) in [
            (ExperimentState::Completed, Kind::Ended),
            (ExperimentState::Failed, Kind::Ended),
            (ExperimentState::Cancelled, Kind::Ended),
            (ExperimentState::Paused, Kind::Paused),
        ] {
            let experiment = Experiment { state: state.into(), ..running() };
            assert_eq!(kinds(experiment, &ExplainExperimentResponse::default()), [kind]);
        }
    }

    #[test]
    fn every_obstacle_is_found() {
        let nobody = ExplainExperimentResponse { workers: 0, workers_available: 0, ..healthy() };
        assert_eq!(kinds(running(), &nobody)[0], Kind::NoWorkers);
        let leaving = ExplainExperimentResponse { workers_available: 0, ..healthy() };
        assert_eq!(kinds(running(), &leaving)[0], Kind::NoWorkersAvailable);
        let divided = ExplainExperimentResponse { workers_of_others: 1, ..leaving };
        assert_eq!(kinds(running(), &divided)[0], Kind::TakenByNone);
        let shared = ExplainExperimentResponse { rivals: vec![4], ..healthy() };
        assert_eq!(kinds(running(), &shared), [Kind::Queued]);
        let full = ExplainExperimentResponse { store_trouble: "disk".into(), ..healthy() };
        assert_eq!(kinds(running(), &full), [Kind::StoreTrouble, Kind::Computing]);
        let round = Round { audits_waiting: 2, ..Round::default() };
        let audited = ExplainExperimentResponse { round: Some(round), ..healthy() };
        assert_eq!(kinds(running(), &audited), [Kind::Audits]);
        let large = ExplainExperimentResponse { shortage: "9 MiB".into(), ..healthy() };
        assert_eq!(kinds(running(), &large), [Kind::Memory]);
        let other = ExplainExperimentResponse { incompatible: "older".into(), ..healthy() };
        assert_eq!(kinds(running(), &other), [Kind::Incompatible]);
        let between = ExplainExperimentResponse { round: None, ..healthy() };
        assert_eq!(kinds(running(), &between), [Kind::BetweenGenerations]);
        let worker = |quarantined| WithheldWorker { quarantined, ..WithheldWorker::default() };
        let withheld = vec![worker(true), worker(false)];
        let doubtful = ExplainExperimentResponse { withheld, ..healthy() };
        let expected = [Kind::Quarantine, Kind::WorkersWaiting, Kind::Computing];
        assert_eq!(kinds(running(), &doubtful), expected);
        let question = RefereeQuestion { trouble: "no program".into(), ..Default::default() };
        let asked = ExplainExperimentResponse { questions: vec![question], ..healthy() };
        let expected = [Kind::Referee, Kind::RefereeTrouble, Kind::Computing];
        assert_eq!(kinds(running(), &asked), expected);
        let round = Round { individuals_failing: 1, ..healthy().round.unwrap() };
        let failing = ExplainExperimentResponse { round: Some(round), ..healthy() };
        assert_eq!(kinds(running(), &failing), [Kind::IndividualsFailing, Kind::Computing]);
    }

    #[test]
    fn the_barrier_names_the_last_workers_and_the_time_of_waiting() {
        let held = HeldItems { held_ms: 61_000, ..held(2) };
        let round = Round { generation: 5, held: vec![held], ..Round::default() };
        let answer = ExplainExperimentResponse { round: Some(round), ..healthy() };
        let findings = findings(&running(), &answer, "http://h:1");
        assert_eq!(findings[0].kind, Kind::Barrier);
        let text = "at the barrier: waiting for the last 2 items of generation 5, on worker w \
                    for 1 min 1 s";
        assert_eq!(findings[0].what, text);
        assert_eq!(findings[0].next_steps.len(), 2);
    }
}
