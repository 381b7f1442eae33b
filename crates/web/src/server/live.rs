//! News for pages, as server-sent events. A slow page gets fewer and longer events,
//! because each event is made on demand from the stored state.

use std::{collections::BTreeMap, convert::Infallible, sync::Arc, time::Duration};

use axum::{
    extract::State,
    http::HeaderMap,
    response::{
        IntoResponse, Response, Sse,
        sse::{Event, KeepAlive},
    },
};
use serde::Deserialize;
use serde_json::json;
use swarm_proto::v1::ListGenerationsRequest;
use tokio::sync::{Mutex, watch};
use tokio_stream::Stream;

use super::{
    Shared,
    answers::{self, ExperimentAnswer},
    problem::{Path, Problem, Query},
};

/// Minimum time between two events of a stream.
const PAUSE: Duration = Duration::from_millis(400);

/// Number of answers that are cached for other pages.
const LATEST_MAX: usize = 256;

/// The cached answers of each experiment: pages of the same experiment share the work.
#[derive(Debug, Default)]
pub struct Latest(Mutex<Known>);

/// For each experiment and first requested generation: the count of writes at the time of the
/// answer, and the answer.
type Known = BTreeMap<(u64, u64), (u64, Arc<News>)>;

/// The news of an experiment.
#[derive(Debug)]
struct News {
    /// The experiment as JSON.
    experiment: String,
    /// New generations as JSON, if there are any.
    generations: Option<String>,
    /// The generation after the last one in `generations`.
    next: u64,
    /// Whether more generations are already stored.
    is_cut: bool,
}

impl Latest {
    /// News of an experiment. `count`: the count of writes; an answer from the same count
    /// is still valid.
    async fn read(&self, shared: &Shared, id: u64, from: u64, count: u64) -> Option<Arc<News>> {
        let mut known = self.0.lock().await;
        if let Some((at, news)) = known.get(&(id, from))
            && *at == count
        {
            return Some(Arc::clone(news));
        }
        let request =
            ListGenerationsRequest { experiment_id: id, from_generation: from, page_size: 0 };
        let page = shared.reader.list_generations(request).await.ok()?;
        let found = shared.experiment(id).await.ok()?.experiment?;
        let rows: Vec<_> = page.generations.iter().filter_map(answers::generation_row).collect();
        let news = Arc::new(News {
            experiment: json!(ExperimentAnswer::new(found, shared.control.is_some())).to_string(),
            next: rows.last().map_or(from, |row| row.0 + 1),
            generations: (!rows.is_empty()).then(|| json!(rows).to_string()),
            is_cut: page.next_generation.is_some(),
        });
        if known.len() >= LATEST_MAX {
            known.clear();
        }
        known.insert((id, from), (count, Arc::clone(&news)));
        Some(news)
    }
}

/// The first requested generation.
#[derive(Debug, Deserialize)]
pub struct From {
    #[serde(default)]
    from: u64,
}

/// Generations of an experiment from some on, oldest first. The id of an event is the
/// generation after its last one, so a page continues without a gap after it was cut off.
pub async fn generations(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
    Query(From { from }): Query<From>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let again = headers.get("last-event-id").and_then(|id| id.to_str().ok()?.parse().ok());
    shared.experiment(id).await?;
    let news = shared.reader.news();
    let state = (shared, news, again.unwrap_or(from), Step::Read, String::new());
    let events = futures_util::stream::unfold(state, move |state| async move {
        let (shared, mut news, mut from, mut step, mut before) = state;
        loop {
            if step == Step::Wait {
                wait(&shared, &mut news).await?;
            }
            let count = *news.borrow_and_update();
            let latest = shared.latest.read(&shared, id, from, count).await?;
            from = latest.next;
            // Either more generations are ready at once, or the stream waits for the next
            // write.
            step = if latest.is_cut { Step::Read } else { Step::Wait };
            if latest.generations.is_none() && latest.experiment == before {
                continue;
            }
            before.clone_from(&latest.experiment);
            let rows = latest.generations.as_deref().unwrap_or("[]");
            let data = format!(r#"{{"experiment":{before},"generations":{rows}}}"#);
            let event = Event::default().id(from.to_string()).data(data);
            return Some((Ok(event), (shared, news, from, step, before)));
        }
    });
    Ok(stream(events))
}

/// The next state of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Read,
    Wait,
}

/// Waits for news, and a moment longer, to combine several; none at the end.
pub async fn wait(shared: &Shared, news: &mut watch::Receiver<u64>) -> Option<()> {
    tokio::select! {
        () = shared.shutdown.cancelled() => return None,
        changed = news.changed() => changed.ok()?,
    }
    rest(shared, PAUSE).await
}

/// Waits for a duration; none at the end.
pub async fn rest(shared: &Shared, time: Duration) -> Option<()> {
    tokio::select! {
        () = shared.shutdown.cancelled() => None,
        () = tokio::time::sleep(time) => Some(()),
    }
}

pub fn stream(events: impl Stream<Item = Result<Event, Infallible>> + Send + 'static) -> Response {
    Sse::new(events).keep_alive(KeepAlive::default()).into_response()
}
