//! The output of `--output json`. Numbers read back to the same bits; a fitness that is
//! not finite is `null`.

mod individuals;

use std::collections::BTreeMap;

use experiment_file::Seed;
use model::wire::state_name;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Serialize;
use swarm_proto::v1::{
    Event, Experiment, ExperimentState, ForkOrigin, GenerationSummary, GetChampionResponse,
    event::Kind,
};

use crate::{subject::Subject, text};

pub use self::individuals::{ChampionDocument, IndividualDocument, PopulationDocument};

/// A value on one line.
pub fn line(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("plain data with string keys serialises")
}

/// A value on several indented lines.
pub fn document(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("plain data with string keys serialises")
}

/// The states of experiments, by name.
fn states(_: &mut SchemaGenerator) -> Schema {
    let states = (0..).map_while(|number| ExperimentState::try_from(number).ok());
    json_schema!({"type": "string", "enum": states.map(state_name).collect::<Vec<_>>()})
}

/// An event, as `watch --events` prints it.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Event")]
pub struct LogLine<'a> {
    /// Time of the event, milliseconds since 1970 in UTC.
    at_ms: u64,
    /// Number of the experiment.
    experiment: u64,
    /// Name of the experiment.
    name: &'a str,
    /// Number of the event among those of its experiment, from 1.
    sequence: u64,
    /// Absent if this program does not know the kind of the event.
    #[serde(flatten)]
    kind: Option<LogKind<'a>>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum LogKind<'a> {
    /// A generation is complete.
    Generation(
        #[serde(serialize_with = "GenerationFields::serialize")]
        #[schemars(with = "GenerationFields")]
        &'a GenerationSummary,
    ),
    /// The experiment has another state.
    State {
        /// The new state.
        #[schemars(schema_with = "states")]
        state: &'static str,
        /// The reason; empty if there is none.
        reason: &'a str,
    },
    /// A remark of the coordinator.
    Notice {
        /// The remark, for people.
        message: &'a str,
    },
}

impl<'a> LogLine<'a> {
    pub fn new(experiment: &'a Experiment, event: &'a Event) -> Self {
        let kind = event.kind.as_ref().map(|kind| match kind {
            Kind::GenerationCompleted(summary) => LogKind::Generation(summary),
            Kind::StateChanged(change) => {
                LogKind::State { state: state_name(change.state()), reason: &change.reason }
            }
            Kind::Notice(notice) => LogKind::Notice { message: &notice.message },
        });
        let Experiment { id, name, .. } = experiment;
        Self { at_ms: event.at_ms, experiment: *id, name, sequence: event.sequence, kind }
    }
}

/// A generation, as `run`, `watch`, `list` and `history` print it.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Generation")]
pub struct GenerationLine<'a> {
    /// Number of the experiment.
    experiment: u64,
    #[serde(flatten, serialize_with = "GenerationFields::serialize")]
    #[schemars(with = "GenerationFields")]
    summary: &'a GenerationSummary,
    /// Time of the commit, milliseconds since 1970 in UTC. Only `history` prints it.
    #[serde(skip_serializing_if = "Option::is_none")]
    completed_at_ms: Option<u64>,
}

/// The fields of the message, in the order of the printed keys. It is no type of a value: Serde
/// takes the order of keys from a declaration, and the message has another one.
#[derive(Serialize, JsonSchema)]
#[serde(remote = "GenerationSummary")]
#[schemars(inline)]
struct GenerationFields {
    /// Number of the generation, from 0.
    generation: u64,
    /// Fitness of the best individual, its mean over the trials; in these trials it was lucky.
    #[schemars(with = "Option<f64>")]
    best: f64,
    /// Mean fitness of the individuals.
    #[schemars(with = "Option<f64>")]
    mean: f64,
    /// Fitness of the worst individual.
    #[schemars(with = "Option<f64>")]
    min: f64,
    /// Standard deviation of the individuals' fitness.
    #[schemars(with = "Option<f64>")]
    standard_deviation: f64,
    /// Number of simulated episodes.
    episodes: u64,
    /// Duration, milliseconds.
    duration_ms: u64,
    /// Number of workers that computed it.
    workers: u32,
    /// Share of the workers' time in which they had nothing to compute, from 0 to 1.
    idle_share: f64,
    /// Digest of everything up to this generation, 64 hexadecimal digits.
    digest: String,
}

impl<'a> GenerationLine<'a> {
    pub fn new(experiment_id: u64, summary: &'a GenerationSummary) -> Self {
        Self { experiment: experiment_id, summary, completed_at_ms: None }
    }

    pub fn completed_at(self, ms: u64) -> Self {
        Self { completed_at_ms: Some(ms), ..self }
    }
}

/// How an experiment ended: the last line of `run` and `watch`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "End")]
pub struct EndLine<'a> {
    /// Number of the experiment.
    experiment: u64,
    /// The state in which it ended.
    #[schemars(schema_with = "states")]
    state: &'static str,
    /// The reason of the state, if there is one.
    #[serde(skip_serializing_if = "str::is_empty")]
    reason: &'a str,
    /// Digest of the whole run, 64 hexadecimal digits; null before the first generation.
    digest: Option<&'a str>,
    /// Null before the first generation.
    champion: Option<ChampionSummary>,
    /// The file with the champion, which commands write that compute the experiment themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    champion_file: Option<&'a str>,
}

/// A champion without its genes.
#[derive(Debug, Serialize, JsonSchema)]
struct ChampionSummary {
    /// Fitness on trials that selected nothing, known once the run has ended.
    judged: Option<Judged>,
    /// Fitness on the trials that selected it among the candidates, which is optimistic.
    selection: Option<Selection>,
    /// Fitness on the trials of its generation, which made it a candidate; null for the mean of a
    /// distribution.
    fitness_when_chosen: Option<f64>,
    /// The generation in which it evolved, from 0.
    generation: u64,
    /// Its index in the generation, from 0; null for the mean of a distribution.
    individual: Option<u32>,
}

impl From<&GetChampionResponse> for ChampionSummary {
    fn from(champion: &GetChampionResponse) -> Self {
        Self {
            judged: champion.judged.as_ref().map(|judged| Judged {
                mean: judged.mean,
                ci95: [judged.low, judged.high],
                trials: judged.trials,
                generation: judged.generation,
            }),
            selection: champion.held_out.as_ref().map(|held_out| Selection {
                mean: held_out.mean,
                trials: held_out.trials,
                generation: held_out.generation,
            }),
            fitness_when_chosen: champion.fitness,
            generation: champion.generation,
            individual: champion.individual,
        }
    }
}

#[derive(Debug, Serialize, JsonSchema)]
struct Judged {
    /// Mean fitness of the trials.
    #[schemars(with = "Option<f64>")]
    mean: f64,
    /// Lower and upper end of the 95 % interval of the mean.
    #[schemars(with = "[Option<f64>; 2]")]
    ci95: [f64; 2],
    /// Number of trials.
    trials: u32,
    /// The generation after which it was judged, from 0.
    generation: u64,
}

#[derive(Debug, Serialize, JsonSchema)]
struct Selection {
    /// Mean fitness of the trials.
    #[schemars(with = "Option<f64>")]
    mean: f64,
    /// Number of trials.
    trials: u32,
    /// The generation after which it was selected, from 0.
    generation: u64,
}

impl<'a> EndLine<'a> {
    pub fn new(experiment: &'a Experiment, champion: Option<&GetChampionResponse>) -> Self {
        Self {
            experiment: experiment.id,
            state: state_name(experiment.state()),
            reason: &experiment.reason,
            digest: Some(&*experiment.digest).filter(|digest| !digest.is_empty()),
            champion: champion.map(ChampionSummary::from),
            champion_file: None,
        }
    }

    pub fn with_champion_file(self, champion_file: Option<&'a str>) -> Self {
        Self { champion_file, ..self }
    }
}

/// An experiment, as `list`, `submit` and `cancel` print it.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Experiment")]
pub struct ExperimentDocument<'a> {
    /// Number of the experiment.
    id: u64,
    /// Its name, which other experiments may have, too.
    name: &'a str,
    /// Its state.
    #[schemars(schema_with = "states")]
    state: &'static str,
    /// The reason of the state, if there is one.
    #[serde(skip_serializing_if = "str::is_empty")]
    reason: &'a str,
    /// Number of complete generations.
    generations_done: u64,
    /// Number of generations to do.
    generations: u64,
    seed: Seed,
    /// Name of the algorithm, such as SNES.
    algorithm: &'a str,
    /// Number of individuals of a generation.
    population_size: u32,
    /// Number of genes of an individual.
    genotype_len: u32,
    /// Share of the fleet relative to other experiments, from 1 to 1000.
    priority: u32,
    /// Name of its group, if it has one.
    #[serde(skip_serializing_if = "str::is_empty")]
    group: &'a str,
    /// The values, apart from the seed, in which it differs from others of its group.
    #[serde(skip_serializing_if = "str::is_empty")]
    variant: &'a str,
    /// Labels, by key; absent without labels.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    labels: &'a BTreeMap<String, String>,
    /// True if `list` leaves it out; else absent.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    archived: bool,
    /// Time of the submission, milliseconds since 1970 in UTC.
    submitted_at_ms: u64,
    /// Remaining time, milliseconds, if generations stay as fast as the latest ones; null if that
    /// is unknown, or the experiment has ended.
    eta_ms: Option<u64>,
    /// Mean fitness of the champion on trials that selected nothing; null before the end.
    champion_fitness: Option<f64>,
    /// Mean fitness of the champion on the trials that selected it, which is optimistic; null
    /// before these trials.
    champion_selection_fitness: Option<f64>,
    /// Digest of the experiment file with its seed, 64 hexadecimal digits.
    config_digest: &'a str,
    /// The origin of a fork; absent for others.
    #[serde(skip_serializing_if = "Option::is_none")]
    forked_from: Option<Origin<'a>>,
    /// The latest complete generation; null before the first.
    latest: Option<GenerationLine<'a>>,
}

/// The origin of a fork.
#[derive(Debug, Serialize, JsonSchema)]
struct Origin<'a> {
    /// Number of the parent.
    experiment: u64,
    /// The last generation that it shares with its parent, from 0.
    generation: u64,
    /// The changes of the experiment file, each as KEY=VALUE.
    changes: &'a [String],
}

impl<'a> From<&'a ForkOrigin> for Origin<'a> {
    fn from(origin: &'a ForkOrigin) -> Self {
        let ForkOrigin { experiment_id, generation, changes } = origin;
        Self { experiment: *experiment_id, generation: *generation, changes }
    }
}

impl<'a> From<&'a Experiment> for ExperimentDocument<'a> {
    fn from(experiment: &'a Experiment) -> Self {
        Self {
            id: experiment.id,
            name: &experiment.name,
            state: state_name(experiment.state()),
            reason: &experiment.reason,
            generations_done: experiment.generations_done,
            generations: experiment.generations,
            seed: Seed(experiment.seed),
            algorithm: &experiment.algorithm,
            population_size: experiment.population_size,
            genotype_len: experiment.genotype_len,
            priority: experiment.priority,
            group: &experiment.group,
            variant: &experiment.variant,
            labels: &experiment.labels,
            archived: experiment.archived,
            submitted_at_ms: experiment.submitted_at_ms,
            eta_ms: text::eta_ms(experiment),
            champion_fitness: experiment.champion_fitness,
            champion_selection_fitness: experiment.champion_selection_fitness,
            config_digest: &experiment.config_digest,
            forked_from: experiment.forked_from.as_ref().map(Into::into),
            latest: experiment
                .latest
                .as_ref()
                .map(|latest| GenerationLine::new(experiment.id, latest)),
        }
    }
}

/// The answer of a command about an experiment is one value; about a group, a list.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum OneOrMore<T> {
    One(T),
    More(Vec<T>),
}

impl<T> OneOrMore<T> {
    /// The answer about a subject.
    pub fn about(subject: &Subject, mut values: Vec<T>) -> Self {
        match (subject, values.len()) {
            (Subject::Experiment(_), 1) => Self::One(values.remove(0)),
            _ => Self::More(values),
        }
    }
}

#[cfg(test)]
mod tests;
