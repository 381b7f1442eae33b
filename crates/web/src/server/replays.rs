//! Episodes for the player, simulated on request.

use std::{collections::BTreeMap, sync::Arc};

use axum::{
    Json,
    extract::State,
    http::{StatusCode, header::CONTENT_TYPE},
    response::{IntoResponse, Response},
};
use experiment_file::ExperimentConfig;
use replay::{Episode, Judged, Replay, Trials, WhatIf};
use serde::Serialize;
use sim_core::{FINGERPRINT, Simulation, TrialSet};
use swarm_proto::v1::{GetChampionResponse, JudgedFitness};
use tokio::sync::{Mutex, OnceCell};

use super::{
    Shared,
    problem::{Path, Problem, Query},
};

/// Cached judgements whose trials were simulated again, by experiment and generation.
#[derive(Debug, Default)]
pub struct Judgements(Mutex<BTreeMap<(u64, u64), Judgement>>);

/// The trials of a judgement, once requested.
type Judgement = Arc<OnceCell<Trials>>;

/// Number of judgements that are cached for other pages.
const JUDGEMENTS_MAX: usize = 64;

impl Judgements {
    async fn of_generation(&self, experiment: u64, generation: u64) -> Judgement {
        let mut known = self.0.lock().await;
        if known.len() >= JUDGEMENTS_MAX {
            known.clear();
        }
        Arc::clone(known.entry((experiment, generation)).or_default())
    }
}

/// A genotype that can be simulated again.
#[derive(Clone)]
pub struct Subject {
    experiment: u64,
    config_json: String,
    /// The genotype and its fitness.
    pub individual: GetChampionResponse,
    /// Its name for people.
    pub name: String,
}

impl Subject {
    pub async fn find(shared: &Shared, address: &str) -> Result<Self, Problem> {
        let id: Option<u64> = address.split('@').next().and_then(|id| id.parse().ok());
        if id.is_none() {
            return Err(Problem::bad(format!("`{address}` names no genotype")));
        }
        let individual = shared.reader.individual(address).await?;
        // The elite of a cell of a fork may have been born in the parent.
        let experiment = individual.experiment_id;
        let found = shared.experiment(experiment).await?;
        let simulation =
            found.experiment.map(|experiment| experiment.simulation).unwrap_or_default();
        if simulation != FINGERPRINT {
            let why = format!(
                "the experiment was computed with \"{simulation}\", but this is \
                 \"{FINGERPRINT}\""
            );
            return Err(Problem::new(StatusCode::CONFLICT, why));
        }
        let name = name(address, &individual);
        Ok(Self { experiment, config_json: found.config_json, individual, name })
    }

    /// The experiment with the requested changes.
    pub fn compile(&self, what_if: &WhatIf) -> Result<(ExperimentConfig, Simulation), Problem> {
        what_if.compile(&self.config_json).map_err(|error| Problem::bad(error.to_string()))
    }

    /// The trials of its judgement, or else of its generation.
    async fn trials(&self, shared: &Shared) -> Result<Trials, Problem> {
        let GetChampionResponse { generation, trial_fitness, judged, .. } = &self.individual;
        let Some(judged) = judged.filter(|judged| judged.trials > 0) else {
            return Ok(Trials::of_generation(*generation, trial_fitness.clone()));
        };
        let JudgedFitness { mean, low, high, trials, generation } = judged;
        let judged = Judged { generation, trials, mean, interval: (low, high) };
        let known = shared.judgements.of_generation(self.experiment, generation).await;
        let subject = self.clone();
        let trials = known.get_or_try_init(|| {
            work(shared, move |keep_going| {
                let (_, simulation) = subject.compile(&WhatIf::default())?;
                let genotype = &subject.individual.genotype;
                Trials::of_judgement(&simulation, genotype, judged, keep_going)
                    .map_err(|error| Problem::bad(error.to_string()))?
                    .ok_or_else(stopping)
            })
        });
        trials.await.cloned()
    }
}

/// The error that nobody waits for the answer any more.
pub fn stopping() -> Problem {
    Problem::new(StatusCode::SERVICE_UNAVAILABLE, "the server stops")
}

/// Simulates in turn; stops when the server ends or the browser goes away.
pub async fn work<T: Send + 'static>(
    shared: &Shared,
    simulate: impl FnOnce(&dyn Fn() -> bool) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    let permit = Arc::clone(&shared.replays).acquire_owned().await.map_err(|_| stopping())?;
    let end = shared.shutdown.child_token();
    let _ended_with_the_request = end.clone().drop_guard();
    let simulating = tokio::task::spawn_blocking(move || {
        let _permit = permit;
        simulate(&|| !end.is_cancelled())
    });
    simulating.await.map_err(|_| {
        Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "simulating panicked; please report this")
    })?
}

/// The trials of the genotype at an address.
pub async fn trials(
    State(shared): State<Shared>,
    Path(address): Path<String>,
) -> Result<Json<Trials>, Problem> {
    Ok(Json(Subject::find(&shared, &address).await?.trials(&shared).await?))
}

/// The individual at an address, for a page that simulates it.
#[derive(Debug, Serialize)]
pub struct Individual {
    /// The message of pages to the simulator for browsers.
    played: Played,
    genotype: Vec<f64>,
}

#[derive(Debug, Serialize)]
struct Played {
    /// The experiment file.
    config: String,
    name: String,
    generation: u64,
    /// Worlds and trial of the unchanged episode.
    trials: TrialSet,
    trial: u32,
}

/// The individual at an address, and its unchanged episode.
pub async fn individual(
    State(shared): State<Shared>,
    Path(address): Path<String>,
) -> Result<Json<Individual>, Problem> {
    let subject = Subject::find(&shared, &address).await?;
    let (trials, trial) = world(&shared, &subject, &WhatIf::default()).await?;
    let Subject { config_json: config, individual, name, .. } = subject;
    let played = Played { config, name, generation: individual.generation, trials, trial };
    Ok(Json(Individual { played, genotype: individual.genotype }))
}

/// The episode of the genotype at an address, with the requested changes.
pub async fn replay(
    State(shared): State<Shared>,
    Path(address): Path<String>,
    Query(what_if): Query<WhatIf>,
) -> Result<Response, Problem> {
    let subject = Subject::find(&shared, &address).await?;
    let (trial_set, trial) = world(&shared, &subject, &what_if).await?;
    let packed = work(&shared, move |keep_going| {
        let (config, simulation) = subject.compile(&what_if)?;
        let Subject { individual, name, .. } = &subject;
        let (config, simulation, genotype) = (&config, &simulation, &*individual.genotype);
        let episode = Episode { config, simulation, genotype, name, trial_set, trial };
        let replay = Replay::simulate_while(&episode, keep_going);
        Ok(replay.map_err(|error| Problem::bad(error.to_string()))?.encode())
    });
    Ok(([(CONTENT_TYPE, "application/octet-stream")], packed.await?).into_response())
}

/// The world of the episode: for a champion, the median trial of its judgement.
async fn world(
    shared: &Shared,
    subject: &Subject,
    what_if: &WhatIf,
) -> Result<(TrialSet, u32), Problem> {
    let individual = &subject.individual;
    let judged = individual.judged.filter(|judged| judged.trials > 0);
    let is_named = what_if.trial.is_some() || what_if.generation.is_some();
    match (what_if.judged, judged) {
        (Some(trial), Some(judged)) if trial < judged.trials => {
            Ok((TrialSet::Judgement(judged.generation), trial))
        }
        (Some(trial), Some(judged)) => {
            let last = judged.trials - 1;
            Err(Problem::bad(format!("judged={trial}: the trials are 0 to {last}")))
        }
        (Some(_), None) => Err(Problem::bad("it has not been judged")),
        (None, Some(judged)) if !is_named => {
            let median = subject.trials(shared).await?.median();
            Ok((TrialSet::Judgement(judged.generation), median))
        }
        (None, _) => {
            let generation = what_if.generation.unwrap_or(individual.generation);
            Ok((TrialSet::Generation(generation), what_if.trial.unwrap_or_default()))
        }
    }
}

/// The name of the genotype at an address, for people.
fn name(address: &str, individual: &GetChampionResponse) -> String {
    let generation = individual.generation;
    match (address.split_once('@'), individual.individual) {
        (None, _) => format!("Champion of experiment {address}"),
        (Some((id, _)), Some(i)) => {
            format!("Individual {i} of generation {generation} of experiment {id}")
        }
        (Some((id, _)), None) => {
            format!("Mean of the distribution after generation {generation} of experiment {id}")
        }
    }
}
