//! The present state of the coordinator, and actions on it.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use axum::{
    Json,
    body::Bytes,
    extract::State,
    http::header::CONTENT_TYPE,
    response::{IntoResponse, Response},
};
use experiment_file::Seed;
use model::wire::round_name;
use serde::Deserialize;
use serde_json::{Value, json};
use swarm_proto::v1::{ExplainExperimentResponse, ForkPoint, Round, SubmitExperimentRequest};
use tokio::{sync::Mutex, time::Instant};

use super::{
    Shared,
    answers::{self, ExperimentAnswer, WorkerAnswer},
    problem::{Body, Path, Problem},
};
use crate::source::{Action, Control};

/// The time for which an answer serves all pages.
const FRESH: Duration = Duration::from_secs(1);

/// Number of experiments whose latest explanation is cached for other pages.
const EXPLANATIONS_MAX: usize = 256;

/// The cached answer to a question of many pages.
#[derive(Debug, Default)]
pub struct LatestAnswer(Mutex<Option<(Instant, Bytes)>>);

impl LatestAnswer {
    /// The cached answer, or a new one if it is old: the coordinator is asked once a second,
    /// for any number of pages.
    async fn get(
        &self,
        ask: impl Future<Output = Result<Value, Problem>>,
    ) -> Result<Response, Problem> {
        let mut latest = self.0.lock().await;
        let answer = match &*latest {
            Some((at, answer)) if at.elapsed() < FRESH => answer.clone(),
            _ => {
                let answer = Bytes::from(ask.await?.to_string());
                *latest = Some((Instant::now(), answer.clone()));
                answer
            }
        };
        Ok(([(CONTENT_TYPE, "application/json")], answer).into_response())
    }
}

/// The cached answers about some experiments.
#[derive(Debug, Default)]
pub struct Explanations(Mutex<BTreeMap<u64, Arc<LatestAnswer>>>);

impl Explanations {
    async fn latest(&self, id: u64) -> Arc<LatestAnswer> {
        let mut known = self.0.lock().await;
        if known.len() >= EXPLANATIONS_MAX {
            known.clear();
        }
        Arc::clone(known.entry(id).or_default())
    }
}

/// The possible actions.
pub async fn session(State(shared): State<Shared>) -> Json<Value> {
    Json(json!({ "has_coordinator": shared.control.is_some() }))
}

fn control(shared: &Shared) -> Result<&dyn Control, Problem> {
    shared.control.as_deref().ok_or_else(Problem::no_coordinator)
}

/// The connected workers.
pub async fn workers(State(shared): State<Shared>) -> Result<Response, Problem> {
    let control = control(&shared)?;
    let ask = async {
        let workers = control.workers().await?.into_iter().map(WorkerAnswer::from);
        Ok(json!({ "workers": workers.collect::<Vec<_>>() }))
    };
    shared.workers.get(ask).await
}

/// The latest assignments of the workers.
pub async fn timeline(State(shared): State<Shared>) -> Result<Response, Problem> {
    let control = control(&shared)?;
    shared.timeline.get(async { Ok(answers::timeline(control.timeline().await?)) }).await
}

/// The activity of an experiment, or the reason why it waits.
pub async fn explain(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
) -> Result<Response, Problem> {
    let control = control(&shared)?;
    let latest = shared.explanations.latest(id).await;
    latest.get(async { Ok(explanation(control.explain(id).await?)) }).await
}

fn explanation(response: ExplainExperimentResponse) -> Value {
    let troubles = [response.store_trouble, response.incompatible, response.shortage].into_iter();
    let troubles: Vec<String> = troubles.filter(|text| !text.is_empty()).collect();
    let held = |round: &Round| -> Vec<Value> {
        let held = round.held.iter();
        held.map(|items| json!([items.worker_name, items.items, items.held_ms, items.silent_ms]))
            .collect()
    };
    json!({
        "round": response.round.map(|round| json!({
            "name": round_name(&round),
            "episodes": round.episodes,
            "episodes_left": round.episodes_left,
            "items_queued": round.items_queued,
            "running_ms": round.running_ms,
            "held": held(&round),
        })),
        "workers": response.workers,
        "workers_available": response.workers_available,
        "workers_of_others": response.workers_of_others,
        "rivals": response.rivals,
        "withheld": response
            .withheld
            .iter()
            .map(|worker| json!([worker.worker_name, worker.reason]))
            .collect::<Vec<_>>(),
        // The reason why an experiment does not advance, if any.
        "troubles": troubles,
    })
}

/// The parameters of an action.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Order {
    /// For `priority`.
    priority: Option<u32>,
    /// For `fork`: the last shared generation.
    generation: Option<u64>,
    /// For `fork`: another seed.
    seed: Option<Seed>,
    /// For `label`: labels to set.
    set: BTreeMap<String, String>,
    /// For `label`: keys to remove.
    remove: Vec<String>,
}

/// Pauses, resumes, cancels, forks, archives or labels an experiment, or gives it another priority.
pub async fn steer(
    State(shared): State<Shared>,
    Path((id, action)): Path<(u64, String)>,
    Body(order): Body<Order>,
) -> Result<Json<ExperimentAnswer>, Problem> {
    let control = control(&shared)?;
    let action = match (&*action, order.priority) {
        ("pause", _) => Action::Pause,
        ("resume", _) => Action::Resume,
        ("cancel", _) => Action::Cancel,
        ("priority", Some(priority)) => Action::Priority(priority),
        ("archive", _) => Action::Archive(true),
        ("restore", _) => Action::Archive(false),
        ("label", _) => Action::Label(order.set, order.remove),
        ("fork", _) => return fork(&shared, control, id, &order).await,
        (action, _) => return Err(Problem::bad(format!("no such action: {action}"))),
    };
    Ok(Json(ExperimentAnswer::new(control.steer(id, action).await?, true)))
}

async fn fork(
    shared: &Shared,
    control: &dyn Control,
    id: u64,
    order: &Order,
) -> Result<Json<ExperimentAnswer>, Problem> {
    let generation = order.generation.ok_or_else(|| Problem::bad("fork needs a generation"))?;
    let parent = shared.experiment(id).await?;
    let forked = control.submit(SubmitExperimentRequest {
        config_json: parent.config_json,
        seed: order.seed.map(|Seed(seed)| seed),
        fork_of: Some(ForkPoint { experiment_id: id, generation }),
        ..SubmitExperimentRequest::default()
    });
    Ok(Json(ExperimentAnswer::new(forked.await?, true)))
}
