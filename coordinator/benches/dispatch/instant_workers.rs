//! Workers that compute nothing: they answer items at once, and record the times.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use anyhow::bail;
use evolution::Distribution;
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{
        self, ItemResult, ItemResults, TrialFitness, WorkRequest, WorkResponse,
        item_result::Outcome, work_request, work_response,
        worker_service_client::WorkerServiceClient,
    },
};
use tokio::{
    sync::{mpsc, watch},
    task::JoinSet,
};
use tokio_stream::wrappers::ReceiverStream;

use super::CoordinatorProcess;

const RETRY_INTERVAL: Duration = Duration::from_millis(1);
/// Number of answers that may wait for the network.
const OUTBOX_LEN: usize = 64;
/// Most bytes of a message to a worker.
const MESSAGE_LEN_MAX: usize = 64 << 20;

/// A set of workers, which leave when this is dropped.
pub struct InstantWorkers {
    _tasks: JoinSet<()>,
    diary: Arc<Diary>,
}

/// A generation as the workers saw it.
#[derive(Debug, Clone, Copy)]
pub struct Round {
    /// When the first item arrived.
    pub started: Instant,
    /// When the last answer was given.
    ended: Instant,
}

struct Diary {
    rounds: Mutex<BTreeMap<u64, Round>>,
    latest: watch::Sender<Option<u64>>,
}

impl InstantWorkers {
    /// Starts workers that connect as soon as they can.
    pub fn start(coordinator: &CoordinatorProcess, n_workers: usize, n_slots: u32) -> Self {
        let diary = Arc::new(Diary { rounds: Mutex::default(), latest: watch::Sender::new(None) });
        let mut tasks = JoinSet::new();
        for worker in 0..n_workers {
            let (url, diary) = (coordinator.url(), Arc::clone(&diary));
            tasks.spawn(async move {
                while let Err(_retry) =
                    work(&url, format!("instant-{worker}"), n_slots, &diary).await
                {
                    tokio::time::sleep(RETRY_INTERVAL).await;
                }
            });
        }
        Self { _tasks: tasks, diary }
    }

    /// Waits for generations `first` to `last`, and returns them.
    pub async fn rounds(&self, first: u64, last: u64) -> Vec<Round> {
        let mut latest = self.diary.latest.subscribe();
        latest.wait_for(|latest| *latest > Some(last)).await.expect("the diary is ours");
        let rounds = self.diary.rounds.lock().expect("nobody panics while writing");
        (first..=last).map(|generation| rounds[&generation]).collect()
    }

    /// The present generation.
    pub fn latest(&self) -> u64 {
        self.diary.latest.borrow().unwrap_or_default()
    }

    /// Waits for the first generation, and returns it as soon as it has begun.
    pub async fn first_round(&self) -> Round {
        let mut latest = self.diary.latest.subscribe();
        latest.wait_for(Option::is_some).await.expect("the diary is ours");
        let rounds = self.diary.rounds.lock().expect("nobody panics while writing");
        *rounds.values().next().expect("one has begun")
    }
}

impl Round {
    /// Time from the first item to the last answer.
    pub fn evaluating(&self) -> Duration {
        self.ended - self.started
    }
}

impl Diary {
    fn note(&self, generation: u64, received: Instant) {
        let mut rounds = self.rounds.lock().expect("nobody panics while writing");
        let new = Round { started: received, ended: received };
        let round = rounds.entry(generation).or_insert(new);
        round.ended = now();
        self.latest.send_if_modified(|latest| {
            let is_new = *latest < Some(generation);
            if is_new {
                *latest = Some(generation);
            }
            is_new
        });
    }
}

/// Runs one stream until it ends.
async fn work(url: &str, name: String, n_slots: u32, diary: &Diary) -> anyhow::Result<()> {
    let (outbox, requests) = mpsc::channel(OUTBOX_LEN);
    let hello = work_request::Message::Hello(v1::Hello {
        protocol_version: PROTOCOL_VERSION,
        sim_core_fingerprint: sim_core::FINGERPRINT.to_owned(),
        name,
        slots: n_slots,
        ..v1::Hello::default()
    });
    outbox.send(WorkRequest { message: Some(hello) }).await?;
    let mut client = WorkerServiceClient::connect(url.to_owned())
        .await?
        .max_decoding_message_size(MESSAGE_LEN_MAX);
    let mut inbound = client.work(ReceiverStream::new(requests)).await?.into_inner();
    let mut distribution = None;
    while let Some(WorkResponse { message }) = inbound.message().await? {
        let received = now();
        let batch = match message {
            Some(work_response::Message::Distribution(message)) => {
                distribution = Some(Distribution::from_bytes(&message.distribution)?);
                continue;
            }
            Some(work_response::Message::Assignments(batch)) => batch,
            _ => continue,
        };
        let answer = |assignment| answer(assignment, distribution.as_ref());
        let results = batch.assignments.iter().map(answer).collect();
        let results = work_request::Message::Results(ItemResults { results });
        outbox.send(WorkRequest { message: Some(results) }).await?;
        let Some(v1::trial_set::TrialSet::Generation(generation)) =
            batch.trial_set.and_then(|set| set.trial_set)
        else {
            continue;
        };
        diary.note(generation, received);
    }
    bail!("the stream ended")
}

/// Any fitness will do, as long as it depends on the genotype alone.
fn answer(assignment: &v1::Assignment, distribution: Option<&Distribution>) -> ItemResult {
    let drawn = assignment.individual.and_then(|i| distribution?.genotype(i as usize));
    let genotype = drawn.as_ref().unwrap_or(&assignment.genotype);
    let values = vec![genotype[0]; assignment.trial_count as usize];
    let outcome = Some(Outcome::Fitness(TrialFitness { values }));
    ItemResult { assignment_id: assignment.assignment_id, outcome, compute_us: 0 }
}

#[expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
fn now() -> Instant {
    Instant::now()
}

/// The value in the middle.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
