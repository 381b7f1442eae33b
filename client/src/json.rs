//! The output of `--output json`. Numbers read back to the same bits; a fitness that is
//! not finite is `null`.

mod individuals;

use std::collections::BTreeMap;

use experiment_file::Seed;
use model::wire::state_name;
use serde::Serialize;
use swarm_proto::v1::{
    Event, Experiment, ForkOrigin, GenerationSummary, GetChampionResponse, event::Kind,
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

/// An event, as `watch --events` prints it.
#[derive(Debug, Serialize)]
pub struct LogLine<'a> {
    at_ms: u64,
    experiment: u64,
    name: &'a str,
    sequence: u64,
    #[serde(flatten)]
    kind: Option<LogKind<'a>>,
}

#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum LogKind<'a> {
    Generation(#[serde(serialize_with = "GenerationFields::serialize")] &'a GenerationSummary),
    State { state: &'static str, reason: &'a str },
    Notice { message: &'a str },
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
#[derive(Debug, Serialize)]
pub struct GenerationLine<'a> {
    experiment: u64,
    #[serde(flatten, serialize_with = "GenerationFields::serialize")]
    summary: &'a GenerationSummary,
    /// Only `history` prints it.
    #[serde(skip_serializing_if = "Option::is_none")]
    completed_at_ms: Option<u64>,
}

/// The fields of the message, in the order of the printed keys. It is no type of a value: Serde
/// takes the order of keys from a declaration, and the message has another one.
#[derive(Serialize)]
#[serde(remote = "GenerationSummary")]
struct GenerationFields {
    generation: u64,
    best: f64,
    mean: f64,
    min: f64,
    standard_deviation: f64,
    episodes: u64,
    duration_ms: u64,
    workers: u32,
    idle_share: f64,
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
#[derive(Debug, Serialize)]
pub struct EndLine<'a> {
    experiment: u64,
    state: &'static str,
    #[serde(skip_serializing_if = "str::is_empty")]
    reason: &'a str,
    digest: Option<&'a str>,
    champion: Option<ChampionSummary>,
    #[serde(skip_serializing_if = "Option::is_none")]
    champion_file: Option<&'a str>,
}

/// A champion without its genes. `judged`: fitness on trials that selected nothing.
/// `selection`: on the trials that selected it among the candidates.
/// `fitness_when_chosen`: on those of its generation, which made it a candidate.
#[derive(Debug, Serialize)]
struct ChampionSummary {
    judged: Option<Judged>,
    selection: Option<Selection>,
    fitness_when_chosen: Option<f64>,
    generation: u64,
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

#[derive(Debug, Serialize)]
struct Judged {
    mean: f64,
    /// Lower and upper end.
    ci95: [f64; 2],
    trials: u32,
    generation: u64,
}

#[derive(Debug, Serialize)]
struct Selection {
    mean: f64,
    trials: u32,
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
#[derive(Debug, Serialize)]
pub struct ExperimentDocument<'a> {
    id: u64,
    name: &'a str,
    state: &'static str,
    #[serde(skip_serializing_if = "str::is_empty")]
    reason: &'a str,
    generations_done: u64,
    generations: u64,
    seed: Seed,
    algorithm: &'a str,
    population_size: u32,
    genotype_len: u32,
    priority: u32,
    #[serde(skip_serializing_if = "str::is_empty")]
    group: &'a str,
    #[serde(skip_serializing_if = "str::is_empty")]
    variant: &'a str,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    labels: &'a BTreeMap<String, String>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    archived: bool,
    submitted_at_ms: u64,
    eta_ms: Option<u64>,
    champion_fitness: Option<f64>,
    champion_selection_fitness: Option<f64>,
    config_digest: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    forked_from: Option<Origin<'a>>,
    latest: Option<GenerationLine<'a>>,
}

/// The origin of a fork.
#[derive(Debug, Serialize)]
struct Origin<'a> {
    experiment: u64,
    generation: u64,
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

/// The answer of a command about an experiment is the experiment; about a group, a list.
pub fn experiments(subject: &Subject, experiments: &[Experiment]) -> String {
    let documents: Vec<ExperimentDocument<'_>> = experiments.iter().map(Into::into).collect();
    match (subject, &documents[..]) {
        (Subject::Experiment(_), [one]) => document(one),
        _ => document(&documents),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};
    use swarm_proto::v1::{ExperimentState, HeldOutFitness, JudgedFitness};

    use super::*;

    fn summary() -> GenerationSummary {
        GenerationSummary {
            generation: 11,
            best: 0.1 + 0.2,
            mean: f64::MIN_POSITIVE,
            min: -0.0,
            standard_deviation: 1.0 / 3.0,
            digest: "1a2b".into(),
            duration_ms: 250,
            episodes: 500,
            workers: 2,
            idle_share: 0.05,
        }
    }

    fn champion() -> GetChampionResponse {
        GetChampionResponse {
            experiment_id: 3,
            generation: 7,
            individual: Some(2),
            fitness: Some(1.25),
            held_out: None,
            judged: None,
            trial_fitness: vec![1.0, 1.5],
            genotype: vec![0.1, 1.0 / 3.0],
            network_json: r#"{"neurons":[{"tau":0.1}]}"#.into(),
        }
    }

    #[test]
    fn a_generation_is_one_line_whose_numbers_read_back_exactly() {
        let summary = summary();
        let text = line(&GenerationLine::new(3, &summary));
        assert!(!text.contains('\n'));
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["experiment"], 3);
        assert_eq!(value["generation"], 11);
        assert_eq!(value["digest"], "1a2b");
        let bits = |key: &str| value[key].as_f64().unwrap().to_bits();
        assert_eq!(bits("best"), summary.best.to_bits());
        assert_eq!(bits("mean"), summary.mean.to_bits());
        assert_eq!(bits("min"), summary.min.to_bits());
        assert_eq!(bits("standard_deviation"), summary.standard_deviation.to_bits());
    }

    #[test]
    fn a_seed_that_jq_would_round_is_text() {
        let experiment = |seed| Experiment { seed, ..Experiment::default() };
        let seed = |seed| {
            let experiment = experiment(seed);
            let listed = serde_json::to_value(ExperimentDocument::from(&experiment)).unwrap();
            let champion = champion();
            let champion = ChampionDocument::new(&experiment, &champion).unwrap();
            assert_eq!(listed["seed"], serde_json::to_value(champion).unwrap()["seed"]);
            listed["seed"].clone()
        };
        assert_eq!(seed(1 << 53), 1_u64 << 53);
        assert_eq!(seed((1 << 53) + 1), "9007199254740993");
    }

    #[test]
    fn a_fitness_that_is_no_number_is_null() {
        let summary = GenerationSummary { min: f64::NAN, ..summary() };
        let value: Value = serde_json::from_str(&line(&GenerationLine::new(3, &summary))).unwrap();
        assert_eq!(value["min"], Value::Null);
    }

    #[test]
    fn the_end_names_state_digest_and_champion() {
        let experiment = Experiment {
            id: 3,
            state: ExperimentState::Completed.into(),
            digest: "1a2b".into(),
            ..Experiment::default()
        };
        let champion = champion();
        let value = serde_json::to_value(EndLine::new(&experiment, Some(&champion))).unwrap();
        assert_eq!(
            value,
            json!({
                "experiment": 3,
                "state": "completed",
                "digest": "1a2b",
                "champion": {
                    "judged": null,
                    "selection": null,
                    "fitness_when_chosen": 1.25,
                    "generation": 7,
                    "individual": 2,
                },
            })
        );
    }

    #[test]
    fn judged_and_selection_fitness_stay_apart() {
        let held_out = HeldOutFitness { mean: 1.5, ci95: 0.125, trials: 50, generation: 9 };
        let judged =
            JudgedFitness { mean: 1.0, low: 0.75, high: 1.125, trials: 200, generation: 9 };
        let champion =
            GetChampionResponse { held_out: Some(held_out), judged: Some(judged), ..champion() };
        let value = serde_json::to_value(ChampionSummary::from(&champion)).unwrap();
        let judged = json!({"mean": 1.0, "ci95": [0.75, 1.125], "trials": 200, "generation": 9});
        assert_eq!(value["judged"], judged);
        assert_eq!(value["selection"], json!({"mean": 1.5, "trials": 50, "generation": 9}));
        assert_eq!(value["fitness_when_chosen"], 1.25);
    }

    #[test]
    fn a_failure_before_the_first_generation_has_a_reason_and_no_champion() {
        let experiment = Experiment {
            id: 3,
            state: ExperimentState::Failed.into(),
            reason: "item 7 killed 3 workers".into(),
            ..Experiment::default()
        };
        let value = serde_json::to_value(EndLine::new(&experiment, None)).unwrap();
        let reason = "item 7 killed 3 workers";
        assert_eq!(
            value,
            json!({"experiment": 3, "state": "failed", "reason": reason, "digest": null, "champion": null})
        );
    }

    #[test]
    fn a_champion_contains_its_network_and_its_experiment() {
        let champion = champion();
        let experiment = Experiment {
            name: "leader".into(),
            seed: 7,
            config_digest: "c0".repeat(32),
            simulation: "sim-core 1".into(),
            ..Experiment::default()
        };
        let document = ChampionDocument::new(&experiment, &champion).unwrap();
        let value = serde_json::to_value(document).unwrap();
        assert_eq!(value["name"], "leader");
        assert_eq!(value["seed"], 7);
        assert_eq!(value["config_digest"], "c0".repeat(32));
        assert_eq!(value["simulation"], "sim-core 1");
        assert_eq!(value["network"]["neurons"][0]["tau"], 0.1);
        assert_eq!(value["genotype"][1].as_f64().unwrap().to_bits(), (1.0f64 / 3.0).to_bits());
        let broken = GetChampionResponse { network_json: "{".into(), ..champion };
        assert!(ChampionDocument::new(&experiment, &broken).is_err());
    }
}
