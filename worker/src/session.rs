//! One conversation with the coordinator, from `Hello` to the end of its stream.

use std::{
    collections::{BTreeMap, BTreeSet},
    error::Error,
    sync::Arc,
    time::Duration,
};

use swarm_proto::v1::{
    self, WorkRequest, WorkResponse, work_response::Message,
    worker_service_client::WorkerServiceClient,
};
use swarm_transport::{
    Bearer, FROM_COORDINATOR_LEN_MAX, Link, TO_COORDINATOR_LEN_MAX, tls_diagnosis,
};
use tokio::{
    sync::mpsc,
    time::{Instant, MissedTickBehavior, interval_at, timeout},
};
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::{
    Code, Status, Streaming, service::interceptor::InterceptedService, transport::Channel,
};
use tracing::{debug, info};

use crate::{
    WorkerConfig,
    assignment::{ItemResult, JobId},
    convert,
    pool::{Evaluator, Pool, Queued},
};

/// Messages that wait for the network.
const OUTBOUND_MESSAGES_MAX: usize = 16;
/// Results in one message, so that no message outgrows what a coordinator accepts.
const RESULTS_PER_MESSAGE_MAX: usize = 256;
/// How long the coordinator may take to answer `Hello`.
const WELCOME_TIMEOUT: Duration = Duration::from_secs(10);
/// How long it may take to confirm the end of a drained stream.
const GOODBYE_TIMEOUT: Duration = Duration::from_secs(5);

/// A stream whose `Welcome` has arrived.
pub(crate) struct Session {
    welcome: v1::Welcome,
    inbound: Streaming<WorkResponse>,
    outbound: mpsc::Sender<WorkRequest>,
}

/// Why there is no session.
#[derive(Debug)]
pub(crate) enum OpenError {
    /// There never will be one; with the coordinator's reason.
    VersionMismatch(String),
    /// Not with these credentials; with the coordinator's reason.
    Denied(String),
    /// The coordinator said no, for now.
    Refused(String),
    /// Nobody answered.
    Unreachable(String),
}

/// How a session ended.
#[derive(Debug)]
pub(crate) enum Ended {
    /// As asked; all results are delivered.
    Drained,
    /// The stream broke.
    Lost {
        reason: String,
        /// Whether the session was good for anything before.
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
            Some(_) => Err(Status::internal("it answered something else than a welcome")),
            None => Err(Status::unavailable("it closed the stream")),
        }
    }

    /// The coordinator's number for this stream.
    pub(crate) fn worker_id(&self) -> u64 {
        self.welcome.worker_id
    }

    /// Computes what the coordinator sends, until the stream breaks, or until
    /// `shutdown` and everything that was being computed then is delivered.
    pub(crate) async fn serve(
        self,
        pool: &Pool,
        shutdown: &CancellationToken,
        evaluator: &(dyn Fn(String) -> Evaluator + Sync),
    ) -> Ended {
        let Self { welcome, mut inbound, outbound } = self;
        let (reply, mut results) = mpsc::channel(pool.capacity());
        let mut state = SessionState {
            pool,
            evaluator,
            evaluators: BTreeMap::new(),
            reply: Some(reply),
            ready: Vec::new(),
        };
        let period = Duration::from_millis(u64::from(welcome.heartbeat_interval_ms.max(1)));
        let mut heartbeat = interval_at(Instant::now() + period, period);
        heartbeat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut worked = false;
        let mut computed = Vec::new();
        let mut all_computed = false;

        while !(all_computed && state.ready.is_empty()) {
            // Results that the network does not take stop the intake of more.
            let has_room = state.ready.len() < RESULTS_PER_MESSAGE_MAX;
            tokio::select! {
                biased;
                () = shutdown.cancelled(), if !state.is_draining() => {
                    state.drain();
                    if outbound.send(convert::draining()).await.is_err() {
                        return Ended::Lost { reason: STOPPED_READING.into(), worked };
                    }
                }
                _ = heartbeat.tick() => {
                    worked = true;
                    // If there is no room, what waits there is a sign of life too.
                    let _ = outbound.try_send(convert::heartbeat());
                }
                message = inbound.message(), if has_room => match message {
                    Ok(Some(WorkResponse { message: Some(message) })) => {
                        worked = true;
                        state.on_message(message);
                    }
                    // A kind of message from the future.
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
                    state.ready.extend(computed.drain(..).map(convert::result));
                }
                permit = outbound.reserve(), if !state.ready.is_empty() => match permit {
                    Ok(permit) => permit.send(convert::next_message(&mut state.ready)),
                    Err(_) => return Ended::Lost { reason: STOPPED_READING.into(), worked },
                },
            }
        }

        // Closing our side tells the coordinator; its closing tells us that it
        // has read everything.
        drop(outbound);
        let goodbye = async { while let Ok(Some(_)) = inbound.message().await {} };
        if timeout(GOODBYE_TIMEOUT, goodbye).await.is_err() {
            debug!("the coordinator did not confirm the end of the stream");
        }
        Ended::Drained
    }
}

const STOPPED_READING: &str = "the coordinator stopped reading";

/// The state of a session: specifications, and results to be sent.
struct SessionState<'a> {
    pool: &'a Pool,
    evaluator: &'a (dyn Fn(String) -> Evaluator + Sync),
    /// The jobs whose specification has come, and not their end.
    evaluators: BTreeMap<JobId, Evaluator>,
    /// Where slots put results; none once no more assignments are taken.
    reply: Option<mpsc::Sender<ItemResult>>,
    /// Results that wait for the network.
    ready: Vec<v1::ItemResult>,
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

    fn on_message(&mut self, message: Message) {
        match message {
            Message::Spec(v1::JobSpec { job, config_json }) => {
                if let Some(job) = convert::job(job) {
                    self.evaluators.insert(job, (self.evaluator)(config_json));
                }
            }
            Message::Assignments(assignments) => self.on_assignments(assignments),
            Message::EndJob(v1::EndJob { job }) => {
                let Some(job) = convert::job(job) else { return };
                self.evaluators.remove(&job);
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

    /// Queues assignments, and fails those that cannot be queued. While the worker
    /// drains they are dropped: the coordinator had not yet heard of it.
    fn on_assignments(&mut self, assignments: v1::Assignments) {
        let Some(reply) = &self.reply else { return };
        let common = convert::common(&assignments).and_then(|common| {
            let evaluator = self.evaluators.get(&common.job);
            let evaluator =
                evaluator.ok_or_else(|| format!("no specification of {} came", common.job));
            Ok((common, Arc::clone(evaluator?)))
        });
        for assignment in assignments.assignments {
            let id = assignment.assignment_id;
            let queued = common.as_ref().map_err(|message| convert::failure(id, message.clone()));
            let queued = queued.and_then(|(common, evaluator)| {
                let assignment = convert::assignment(common, assignment)?;
                let (evaluator, reply) = (Arc::clone(evaluator), reply.clone());
                self.pool.submit(Queued { assignment, evaluator, reply }).map_err(|_| {
                    let message =
                        format!("more than {} assignments are queued", self.pool.capacity());
                    convert::failure(id, message)
                })
            });
            self.ready.extend(queued.err());
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

/// An error and its causes, each said once.
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
