//! Converts rows to messages for clients.

use evolution::{Champion, ChampionSource, HeldOut, Judged};
use swarm_proto::v1::{self, event::Kind};
use tonic::Status;

use crate::store::{
    Event, EventKind, ExperimentRecord, ExperimentState, GenerationRecord, StoredExperiment,
};

impl From<ExperimentRecord> for v1::Experiment {
    fn from(experiment: ExperimentRecord) -> Self {
        let generations_done = experiment.n_generations();
        let summary = experiment.summary;
        let (group, variant) = experiment
            .membership
            .map_or_else(Default::default, |membership| (membership.group, membership.variant));
        Self {
            id: experiment.id.0,
            name: experiment.name,
            state: v1::ExperimentState::from(experiment.state).into(),
            reason: experiment.reason,
            generations_done,
            generations: summary.generations,
            seed: summary.seed,
            algorithm: summary.algorithm,
            population_size: summary.population_size.try_into().unwrap_or(u32::MAX),
            genotype_len: experiment.genotype_len as u32,
            submitted_at_ms: experiment.submitted_at_ms,
            latest: experiment.latest.map(Into::into),
            champion_fitness: experiment.judged_fitness,
            champion_selection_fitness: experiment.held_out_fitness,
            config_digest: experiment.config_digest,
            digest: experiment.digest,
            priority: experiment.priority.weight(),
            last_sequence: experiment.last_sequence,
            simulation: experiment.fingerprint,
            group,
            variant,
            forked_from: experiment.fork.map(|fork| v1::ForkOrigin {
                experiment_id: fork.parent.0,
                generation: fork.generation,
                changes: fork.changes,
            }),
            labels: experiment.labels,
            archived: experiment.is_archived,
            recent_generation_ms: experiment.recent_generation_ms,
        }
    }
}

impl From<StoredExperiment> for v1::GetExperimentResponse {
    fn from(StoredExperiment { record, config_json }: StoredExperiment) -> Self {
        Self { experiment: Some(record.into()), config_json }
    }
}

impl From<GenerationRecord> for v1::GenerationSummary {
    fn from(generation: GenerationRecord) -> Self {
        Self {
            generation: generation.generation,
            best: generation.statistics.best.get(),
            mean: generation.statistics.mean.get(),
            min: generation.statistics.min.get(),
            standard_deviation: generation.statistics.standard_deviation.get(),
            digest: generation.digest,
            duration_ms: generation.duration_ms,
            episodes: generation.episodes,
            workers: generation.workers as u32,
            idle_share: generation.idle_share,
        }
    }
}

impl From<Event> for v1::Event {
    fn from(event: Event) -> Self {
        let kind = match event.kind {
            EventKind::Generation(completed) => Kind::GenerationCompleted(completed.into()),
            EventKind::State { state, reason } => {
                let state = v1::ExperimentState::from(state).into();
                Kind::StateChanged(v1::StateChange { state, reason })
            }
            EventKind::Notice(message) => Kind::Notice(v1::Notice { message }),
        };
        Self { sequence: event.sequence, at_ms: event.at_ms, kind: Some(kind) }
    }
}

impl From<ExperimentState> for v1::ExperimentState {
    fn from(state: ExperimentState) -> Self {
        match state {
            ExperimentState::Running => Self::Running,
            ExperimentState::Paused => Self::Paused,
            ExperimentState::Completed => Self::Completed,
            ExperimentState::Failed => Self::Failed,
            ExperimentState::Cancelled => Self::Cancelled,
        }
    }
}

/// Fails with INVALID_ARGUMENT for an unknown state.
impl TryFrom<v1::ExperimentState> for ExperimentState {
    type Error = Status;

    fn try_from(state: v1::ExperimentState) -> Result<Self, Status> {
        Ok(match state {
            v1::ExperimentState::Running => Self::Running,
            v1::ExperimentState::Paused => Self::Paused,
            v1::ExperimentState::Completed => Self::Completed,
            v1::ExperimentState::Failed => Self::Failed,
            v1::ExperimentState::Cancelled => Self::Cancelled,
            v1::ExperimentState::Unspecified => {
                return Err(Status::invalid_argument("no experiment is in the unspecified state"));
            }
        })
    }
}

/// The name of a state.
pub fn state_name(state: v1::ExperimentState) -> &'static str {
    ExperimentState::try_from(state).map_or("unknown", ExperimentState::name)
}

/// Whether an experiment in this state has ended.
pub fn has_ended(state: v1::ExperimentState) -> bool {
    ExperimentState::try_from(state).is_ok_and(|state| !state.is_unfinished())
}

/// A genotype as a message; `network_json`: empty if it is not decoded.
pub fn individual(
    experiment_id: u64,
    individual: Champion,
    network_json: String,
) -> v1::GetChampionResponse {
    v1::GetChampionResponse {
        experiment_id,
        generation: individual.generation,
        individual: match individual.source {
            ChampionSource::Individual(index) => Some(index),
            ChampionSource::Mean => None,
        },
        fitness: individual.fitness(),
        held_out: individual.held_out.map(held_out),
        judged: individual.judged.map(judged),
        trial_fitness: individual.trial_fitness,
        genotype: individual.genotype,
        network_json,
    }
}

fn held_out(held_out: HeldOut) -> v1::HeldOutFitness {
    v1::HeldOutFitness {
        mean: held_out.mean.get(),
        ci95: held_out.ci95.get(),
        trials: u32::try_from(held_out.n_trials).unwrap_or(u32::MAX),
        generation: held_out.generation,
    }
}

fn judged(judged: Judged) -> v1::JudgedFitness {
    let Judged { mean, low, high, n_trials, generation } = judged;
    let [mean, low, high] = [mean, low, high].map(f64::from);
    v1::JudgedFitness { mean, low, high, trials: n_trials, generation }
}

/// What the fleet computes in a round: "generation 12", or the champion after it.
pub fn round_name(round: &v1::Round) -> String {
    let generation = round.generation;
    if round.judgement {
        format!("the judgement of the champion after generation {generation}")
    } else if round.held_out {
        format!("the re-evaluation of candidates for the champion after generation {generation}")
    } else {
        format!("generation {generation}")
    }
}
