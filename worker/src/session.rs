//! One conversation with the coordinator, from `Hello` to the end of its stream.

use std::{
    collections::{BTreeMap, BTreeSet},
    error::Error,
    sync::Arc,
    time::Duration,
};

use evolution::Distribution;
use model::{codec, ids::JobId};
use swarm_proto::v1::{
    self, WorkRequest, WorkResponse, work_response::Message,
    worker_service_client::WorkerServiceClient,
};
use swarm_transport::{
    Bearer, FROM_COORDINATOR_LEN_MAX, Link, TO_COORDINATOR_LEN_MAX, tls_diagnosis,
};
use tokio::{
    sync::mpsc,
    time::{Instant, MissedTickBehavior, interval_at, sleep_until, timeout},
};
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::{
    Code, Status, Streaming, service::interceptor::InterceptedService, transport::Channel,
};
use tracing::{debug, info};

use crate::{
    WorkerConfig,
    assignment::ItemResult,
    convert::{self, RESULTS_PER_MESSAGE_MAX},
    pool::{Evaluator, Pool, Queued, Reply},
};

/// Most messages that wait for the network.
const OUTBOUND_MESSAGES_MAX: usize = 16;
/// Longest time for which results wait for others; also the duration below which an item counts
/// as short.
const HELD_MAX: Duration = Duration::from_millis(1);
/// Time for the coordinator to answer `Hello`.
const WELCOME_TIMEOUT: Duration = Duration::from_secs(10);
/// Time for the coordinator to confirm the end of a drained stream.
const GOODBYE_TIMEOUT: Duration = Duration::from_secs(5);

/// A stream whose `Welcome` has arrived.
pub(crate) struct Session {
    welcome: v1::Welcome,
    inbound: Streaming<WorkResponse>,
    outbound: mpsc::Sender<WorkRequest>,
}

/// Why a session could not be opened.
#[derive(Debug)]
pub(crate) enum OpenError {
    /// The versions differ, so another attempt is useless. Has the coordinator's reason.
    VersionMismatch(String),
    /// The coordinator does not accept the credentials. Has the coordinator's reason.
    Denied(String),
    /// The coordinator refused for now.
    Refused(String),
    /// The coordinator did not answer.
    Unreachable(String),
}

/// How a session ended.
#[derive(Debug)]
pub(crate) enum Ended {
    /// The worker ended it, and all results are delivered.
    Drained,
    /// The stream broke.
    Lost {
        reason: String,
        /// Whether the session had lasted for a heartbeat, or had received a message.
        worked: bool,
    },
}

impl Session {
    pub(crate) async fn open(
        link: &Link,
        config: &WorkerConfig,
        process_id: u64,
    ) -> Result<Self, OpenError> {
        let channel = link.endpoint.connect().await.map_err(|error| {
            let reason = tls_diagnosis(&error);
            let or_else = || with_causes(error.source().unwrap_or(&error));
            OpenError::Unreachable(reason.unwrap_or_else(or_else))
        })?;
        let client = WorkerServiceClient::with_interceptor(channel, link.bearer.clone())
            .max_decoding_message_size(FROM_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(TO_COORDINATOR_LEN_MAX);
        timeout(WELCOME_TIMEOUT, Self::introduce(client, config, process_id))
            .await
            .map_err(|_| OpenError::Refused("no answer to Hello".into()))?
            .map_err(|status| refusal(&status, link))
    }

    async fn introduce(
        mut client: WorkerServiceClient<InterceptedService<Channel, Bearer>>,
        config: &WorkerConfig,
        process_id: u64,
    ) -> Result<Self, Status> {
        let (outbound, requests) = mpsc::channel(OUTBOUND_MESSAGES_MAX);
        outbound.try_send(convert::hello(config, process_id)).expect("a new channel has room");
        let mut inbound = client.work(ReceiverStream::new(requests)).await?.into_inner();
        match inbound.message().await? {
            Some(WorkResponse { message: Some(Message::Welcome(welcome)) }) => {
                Ok(Self { welcome, inbound, outbound })
            }
            Some(_) => Err(Status::internal("it did not answer with a welcome")),
            None => Err(Status::unavailable("it closed the stream")),
        }
    }

    /// The coordinator's number for this stream.
    pub(crate) fn worker_id(&self) -> u64 {
        self.welcome.worker_id
    }

    /// Computes the coordinator's assignments until the stream breaks, or until `shutdown`. After
    /// `shutdown`, it first delivers the results of items in progress; `give_up` drops items of
    /// scripts.
    pub(crate) async fn serve(
        self,
        pool: &Pool,
        shutdown: &CancellationToken,
        give_up: &CancellationToken,
        evaluator: &(dyn Fn(String) -> Evaluator + Sync),
    ) -> Ended {
        let Self { welcome, mut inbound, outbound } = self;
        let (reply, mut results) = mpsc::channel(pool.capacity());
        let mut state = SessionState {
            pool,
            evaluator,
            jobs: BTreeMap::new(),
            reply: Some(reply),
            ready: Vec::new(),
            held_until: None,
        };
        let period = Duration::from_millis(u64::from(welcome.heartbeat_interval_ms.max(1)));
        let mut heartbeat = interval_at(Instant::now() + period, period);
        heartbeat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut worked = false;
        let mut computed = Vec::new();
        let mut all_computed = false;
        let mut has_given_up = false;

        while !(all_computed && state.ready.is_empty()) {
            // While the network does not accept results, the worker accepts no more assignments.
            let has_room = state.ready.len() < RESULTS_PER_MESSAGE_MAX;
            tokio::select! {
                biased;
                () = shutdown.cancelled(), if !state.is_draining() => {
                    state.drain();
                    if outbound.send(convert::draining()).await.is_err() {
                        return Ended::Lost { reason: STOPPED_READING.into(), worked };
                    }
                }
                () = give_up.cancelled(), if state.is_draining() && !has_given_up => {
                    has_given_up = true;
                    state.give_up();
                }
                _ = heartbeat.tick() => {
                    worked = true;
                    // If there is no room, the waiting messages are signs of life.
                    let _ = outbound.try_send(convert::heartbeat());
                }
                message = inbound.message(), if has_room => match message {
                    Ok(Some(WorkResponse { message: Some(message) })) => {
                        worked = true;
                        state.on_message(message);
                    }
                    // A later version's kind of message.
                    Ok(Some(WorkResponse { message: None })) => {}
                    Ok(None) => {
                        let reason = "the coordinator closed the stream".into();
                        return Ended::Lost { reason, worked };
                    }
                    Err(status) => return Ended::Lost { reason: describe(&status), worked },
                },
                n = results.recv_many(&mut computed, RESULTS_PER_MESSAGE_MAX),
                    if has_room && !all_computed =>
                {
                    all_computed = n == 0;
                    state.on_computed(computed.drain(..));
                }
                permit = room(&outbound, state.held_until), if !state.ready.is_empty() => {
                    match permit {
                        Ok(permit) => permit.send(convert::next_message(&mut state.ready)),
                        Err(_) => return Ended::Lost { reason: STOPPED_READING.into(), worked },
                    }
                    state.held_until = None;
                }
            }
        }

        // Closing our side tells the coordinator that we are done. When it closes its side, it
        // has read everything.
        drop(outbound);
        let goodbye = async { while let Ok(Some(_)) = inbound.message().await {} };
        if timeout(GOODBYE_TIMEOUT, goodbye).await.is_err() {
            debug!("the coordinator did not confirm the end of the stream");
        }
        Ended::Drained
    }
}

/// Waits for the end of a delay, and for room for a message.
async fn room(
    outbound: &mpsc::Sender<WorkRequest>,
    held_until: Option<Instant>,
) -> Result<mpsc::Permit<'_, WorkRequest>, mpsc::error::SendError<()>> {
    if let Some(until) = held_until {
        sleep_until(until).await;
    }
    outbound.reserve().await
}

const STOPPED_READING: &str = "the coordinator stopped reading";

/// The data that all assignments of a job share.
struct Job {
    evaluator: Evaluator,
    /// Whether items may take any time, because a script runs in them.
    has_script: bool,
    /// The distribution of its latest generation.
    distribution: Option<Arc<Distribution>>,
}

/// The state of a session: specifications, and results to send.
struct SessionState<'a> {
    pool: &'a Pool,
    evaluator: &'a (dyn Fn(String) -> Evaluator + Sync),
    /// The jobs whose specification has arrived, and that have not ended.
    jobs: BTreeMap<JobId, Job>,
    /// The channel for results; `None` once the worker accepts no more assignments.
    reply: Option<Reply>,
    /// Results that wait for the network.
    ready: Vec<v1::ItemResult>,
    /// Until when `ready` results wait for others.
    held_until: Option<Instant>,
}

impl SessionState<'_> {
    fn is_draining(&self) -> bool {
        self.reply.is_none()
    }

    fn drain(&mut self) {
        self.reply = None;
        let dropped = self.pool.drop_queued();
        info!(dropped, "draining");
    }

    fn give_up(&self) {
        let has_script = |assignment: &crate::assignment::Assignment| {
            self.jobs.get(&assignment.job).is_none_or(|job| job.has_script)
        };
        let dropped = self.pool.cancel(has_script);
        if dropped > 0 {
            info!(dropped, "items of scripts are dropped: other workers compute them");
        }
    }

    /// Results of short items wait until there are as many results as items in the queue. So the
    /// worker sends few messages, and slots do not run out of items.
    fn on_computed(&mut self, computed: impl Iterator<Item = ItemResult>) {
        let mut are_short = true;
        let computed = computed.inspect(|result| are_short &= result.duration < HELD_MAX);
        self.ready.extend(computed.map(convert::result));
        self.held_until = if are_short && self.ready.len() < self.pool.n_queued() {
            self.held_until.or_else(|| Some(Instant::now() + HELD_MAX))
        } else {
            None
        };
    }

    fn on_message(&mut self, message: Message) {
        match message {
            Message::Spec(v1::JobSpec { job, config_json }) => {
                if let Some(job) = codec::read_job(job) {
                    let has_script = convert::has_script(&config_json);
                    let evaluator = (self.evaluator)(config_json);
                    self.jobs.insert(job, Job { evaluator, has_script, distribution: None });
                }
            }
            Message::Distribution(v1::Distribution { job, distribution }) => {
                let Some(job) = codec::read_job(job).and_then(|id| self.jobs.get_mut(&id)) else {
                    return;
                };
                // Without a distribution, the assignments that need it fail.
                job.distribution = Distribution::from_bytes(&distribution).ok().map(Arc::new);
            }
            Message::Assignments(assignments) => self.on_assignments(assignments),
            Message::EndJob(v1::EndJob { job }) => {
                let Some(job) = codec::read_job(job) else { return };
                self.jobs.remove(&job);
                let dropped = self.pool.cancel(|assignment| assignment.job == job);
                debug!(%job, dropped, "job ended");
            }
            Message::DropAssignments(v1::DropAssignments { assignment_ids }) => {
                let ids = BTreeSet::from_iter(assignment_ids);
                let dropped = self.pool.cancel(|assignment| ids.contains(&assignment.id));
                debug!(dropped, "assignments dropped");
            }
            Message::Welcome(_) => debug!("ignored a second welcome"),
        }
    }

    /// Queues assignments, and fails those that cannot be queued. While the worker drains, it drops
    /// assignments: the coordinator sent them before it knew of the draining.
    fn on_assignments(&mut self, assignments: v1::Assignments) {
        let Some(reply) = &self.reply else { return };
        let common = convert::common(&assignments).and_then(|common| {
            let job = self.jobs.get(&common.job);
            let job = job.ok_or_else(|| {
                format!("the coordinator sent no specification of {}", common.job)
            })?;
            Ok((common, job))
        });
        let mut queued = Vec::with_capacity(assignments.assignments.len());
        for assignment in assignments.assignments {
            let read = common
                .as_ref()
                .map_err(|message| convert::failure(assignment.assignment_id, message.clone()));
            let read = read.and_then(|(common, Job { evaluator, distribution, .. })| {
                let assignment = convert::assignment(common, distribution.as_ref(), assignment)?;
                let (evaluator, reply) = (Arc::clone(evaluator), reply.clone());
                Ok(Queued { assignment, evaluator, reply })
            });
            match read {
                Ok(one) => queued.push(one),
                Err(failure) => self.ready.push(failure),
            }
        }
        for Queued { assignment, .. } in self.pool.submit(queued) {
            let message = format!("more than {} assignments are queued", self.pool.capacity());
            self.ready.push(convert::failure(assignment.id, message));
        }
    }
}

fn refusal(status: &Status, link: &Link) -> OpenError {
    match status.code() {
        Code::FailedPrecondition => OpenError::VersionMismatch(status.message().into()),
        Code::Unauthenticated | Code::PermissionDenied => {
            OpenError::Denied(status.message().into())
        }
        _ => OpenError::Refused(match link.hint(status) {
            Some(hint) => format!("{}; {hint}", describe(status)),
            None => describe(status),
        }),
    }
}

fn describe(status: &Status) -> String {
    if let Some(diagnosis) = tls_diagnosis(status) {
        return diagnosis;
    }
    let message = status.message();
    let text = if message.is_empty() { status.code().description() } else { message };
    append_causes(text.into(), status.source())
}

/// The text of an error and its causes, without repetitions.
pub(crate) fn with_causes(error: &dyn Error) -> String {
    append_causes(error.to_string(), error.source())
}

fn append_causes(mut text: String, mut source: Option<&dyn Error>) -> String {
    while let Some(cause) = source {
        let cause_text = cause.to_string();
        if !text.contains(&cause_text) {
            text = format!("{text}: {cause_text}");
        }
        source = cause.source();
    }
    text
}

#[cfg(test)]
mod tests;
