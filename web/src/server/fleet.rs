//! What the coordinator does at this moment, and having it do something.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use axum::{
    Json,
    body::Bytes,
    extract::State,
    http::header::CONTENT_TYPE,
    response::{IntoResponse, Response},
};
use experiment_file::Seed;
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

/// For how long an answer serves all pages.
const FRESH: Duration = Duration::from_secs(1);

/// Experiments whose latest explanation is kept for other pages.
const EXPLANATIONS_MAX: usize = 256;

/// The latest answer to a question that many pages ask.
#[derive(Debug, Default)]
pub struct LatestAnswer(Mutex<Option<(Instant, Bytes)>>);

impl LatestAnswer {
    /// That answer, or a new one if it is old: the coordinator is asked once a second, whoever
    /// looks.
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

/// The latest answer about each of some experiments.
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

/// What can be done here.
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

/// Who computed what lately.
pub async fn timeline(State(shared): State<Shared>) -> Result<Response, Problem> {
    let control = control(&shared)?;
    shared.timeline.get(async { Ok(answers::timeline(control.timeline().await?)) }).await
}

/// What an experiment does, or waits for.
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
            "generation": round.generation,
            "kind": match (round.held_out, round.judgement) {
                (true, _) => "re-evaluation of candidates",
                (_, true) => "judgement of the champion",
                _ => "generation",
            },
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
        // Why nothing goes on, if that is so.
        "troubles": troubles,
    })
}

/// What an action needs to know.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Order {
    /// For `priority`.
    priority: Option<u32>,
    /// For `fork`: the last generation that both have.
    generation: Option<u64>,
    /// For `fork`: another seed.
    seed: Option<Seed>,
    /// For `label`: what to set.
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
