//! The list of experiments for pages: the whole list once, and then only changes.
//!
//! Each row has the version of the list in which it changed. A page sends its version, and gets
//! the rows of later versions. All pages share one copy of the list.

use std::{
    collections::BTreeMap,
    time::{Duration, SystemTime},
};

use axum::{
    extract::State,
    http::{HeaderMap, header::CONTENT_TYPE},
    response::{IntoResponse, Response, sse::Event},
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use swarm_proto::v1::{Experiment, ListGenerationsRequest};
use tokio::sync::Mutex;

use super::{
    Shared,
    answers::ExperimentAnswer,
    live,
    problem::{Problem, Query},
};

/// Generations of the small curve of a row.
const RECENT: u64 = 40;
/// Minimum time between two events: people do not read a list faster.
const PAUSE: Duration = Duration::from_secs(1);

/// The list as last read.
#[derive(Debug)]
pub struct List {
    /// An id of this server: versions of another server are meaningless.
    epoch: String,
    known: Mutex<Known>,
}

impl Default for List {
    fn default() -> Self {
        let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
        Self { epoch: format!("{:x}", since.as_nanos()), known: Mutex::default() }
    }
}

#[derive(Debug, Default)]
struct Known {
    /// The count of writes at the time of reading.
    count: Option<u64>,
    version: u64,
    rows: BTreeMap<u64, Row>,
}

#[derive(Debug)]
struct Row {
    version: u64,
    generations_done: u64,
    /// Best fitness of the latest generations.
    recent: Vec<f32>,
    /// The row as JSON; none: the experiment was deleted.
    text: Option<String>,
}

/// The answer to a page that has some version of the list.
#[derive(Debug)]
struct Changes {
    mark: String,
    is_whole: bool,
    changed: Vec<String>,
    gone: Vec<u64>,
}

impl Changes {
    fn is_empty(&self) -> bool {
        !self.is_whole && self.changed.is_empty() && self.gone.is_empty()
    }

    fn to_json(&self) -> String {
        let Self { mark, is_whole, changed, gone } = self;
        let (mark, gone, changed) = (json!(mark), json!(gone), changed.join(","));
        format!(r#"{{"mark":{mark},"whole":{is_whole},"gone":{gone},"experiments":[{changed}]}}"#)
    }
}

/// An experiment in the list.
#[derive(Serialize)]
struct RowAnswer<'a> {
    #[serde(flatten)]
    experiment: ExperimentAnswer,
    recent: &'a [f32],
}

impl List {
    /// The rows that are newer than the version in `mark`; all rows if this server does not
    /// know that version.
    async fn since(&self, shared: &Shared, mark: &str) -> Result<Changes, Problem> {
        let count = *shared.reader.news().borrow();
        let mut known = self.known.lock().await;
        if known.count != Some(count) {
            known.update(shared).await?;
            known.count = Some(count);
        }
        let version = mark.strip_prefix(&*self.epoch).and_then(|rest| rest.strip_prefix('.'));
        let version = version.and_then(|number| number.parse::<u64>().ok());
        let is_newer = |row: &Row| version.is_none_or(|version| row.version > version);
        let newer = || known.rows.iter().filter(|(_, row)| is_newer(row));
        let gone = newer().filter(|(_, row)| row.text.is_none() && version.is_some());
        Ok(Changes {
            mark: format!("{}.{}", self.epoch, known.version),
            is_whole: version.is_none(),
            changed: newer().filter_map(|(_, row)| row.text.clone()).collect(),
            gone: gone.map(|(id, _)| *id).collect(),
        })
    }
}

impl Known {
    async fn update(&mut self, shared: &Shared) -> Result<(), Problem> {
        let experiments = shared.experiments().await?;
        let version = self.version + 1;
        for (id, row) in &mut self.rows {
            let is_there = experiments.binary_search_by_key(id, |experiment| experiment.id).is_ok();
            if !is_there && row.text.take().is_some() {
                row.version = version;
            }
        }
        for experiment in experiments {
            self.update_row(shared, experiment, version).await?;
        }
        if self.rows.values().any(|row| row.version == version) {
            self.version = version;
        }
        Ok(())
    }

    async fn update_row(
        &mut self,
        shared: &Shared,
        experiment: Experiment,
        version: u64,
    ) -> Result<(), Problem> {
        let (id, generations_done) = (experiment.id, experiment.generations_done);
        let old = self.rows.get(&id);
        let recent = match old {
            Some(old) if old.generations_done == generations_done => old.recent.clone(),
            _ => recent(shared, id, generations_done).await?,
        };
        let experiment = ExperimentAnswer::new(experiment, shared.control.is_some());
        let text = serde_json::to_string(&RowAnswer { experiment, recent: &recent });
        let text = text.expect("plain data serialises");
        if old.and_then(|old| old.text.as_ref()) != Some(&text) {
            let row = Row { version, generations_done, recent, text: Some(text) };
            self.rows.insert(id, row);
        }
        Ok(())
    }
}

async fn recent(shared: &Shared, id: u64, done: u64) -> Result<Vec<f32>, Problem> {
    let request = ListGenerationsRequest {
        experiment_id: id,
        from_generation: done.saturating_sub(RECENT),
        page_size: RECENT as u32,
    };
    let page = shared.reader.list_generations(request).await?;
    let summaries = page.generations.iter().filter_map(|generation| generation.summary.as_ref());
    Ok(summaries.map(|summary| summary.best as f32).collect())
}

/// The version of a page.
#[derive(Debug, Deserialize)]
pub struct Since {
    #[serde(default)]
    since: String,
}

/// All experiments, or the changes since a version.
pub async fn all(
    State(shared): State<Shared>,
    Query(Since { since }): Query<Since>,
) -> Result<Response, Problem> {
    let changes = shared.list.since(&shared, &since).await?;
    Ok(([(CONTENT_TYPE, "application/json")], changes.to_json()).into_response())
}

/// The list as a stream, with an event at every change. The id of an event is the resulting
/// version, so a page continues without a gap after it was cut off.
pub async fn live(
    State(shared): State<Shared>,
    Query(Since { since }): Query<Since>,
    headers: HeaderMap,
) -> Response {
    let again = headers.get("last-event-id").and_then(|id| id.to_str().ok()).map(str::to_owned);
    let news = shared.reader.news();
    let state = (shared, news, again.unwrap_or(since), Duration::ZERO);
    live::stream(futures_util::stream::unfold(state, |(shared, mut news, mark, rest)| async move {
        live::rest(&shared, rest).await?;
        loop {
            news.borrow_and_update();
            // A failed reading of the database may succeed later.
            if let Ok(changes) = shared.list.since(&shared, &mark).await
                && !changes.is_empty()
            {
                let event = Event::default().id(changes.mark.clone()).data(changes.to_json());
                return Some((Ok(event), (shared, news, changes.mark, PAUSE)));
            }
            live::wait(&shared, &mut news).await?;
        }
    }))
}
