//! `WorkerService`: one stream per worker, translated to the driver's events.

use std::{
    num::NonZeroU64,
    pin::Pin,
    sync::{Mutex, PoisonError},
};

use futures_util::stream::unfold;
use swarm_proto::{
    PROTOCOL_VERSION, SLOTS_MAX, WORKER_NAME_LEN_MAX,
    v1::{
        Hello, WorkRequest, WorkResponse, work_request::Message,
        worker_service_server::WorkerService,
    },
};
use swarm_transport::{Throttle, listening::Peer};
use tokio::sync::{mpsc, oneshot};
use tokio_stream::Stream;
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status, Streaming};
use tracing::warn;

use engine::{Introduction, NamePattern};

use crate::{
    byte_budget::ByteBudget,
    clock,
    driver::{DriverEvent, EventSender, WorkerLink, WorkerMessage},
    ids::WorkerId,
    limits::{
        HELLO_TIMEOUT, ITEMS_PER_SLOT_MAX, RESULTS_PER_MESSAGE_MAX, SHORT_LEN, WORKER_OUTBOX_SLACK,
        WORKER_OUTFLOW_LEN_MAX,
    },
    text::printable,
};

use super::{
    convert::{self, WelcomeTimes},
    shutting_down,
};

/// Memory of a message while it is encoded, relative to its length: the message itself, and a
/// growing buffer.
const COPIES: usize = 3;

/// Room for long messages to workers.
#[derive(Debug, Clone)]
pub struct WorkerOutflow(ByteBudget);

impl Default for WorkerOutflow {
    fn default() -> Self {
        Self(ByteBudget::new(WORKER_OUTFLOW_LEN_MAX))
    }
}

/// The service.
#[derive(Debug)]
pub struct Workers {
    /// The channel to the driver.
    pub events: EventSender,
    /// Room for messages to workers.
    pub outflow: WorkerOutflow,
    /// The durations in `Welcome`.
    pub times: WelcomeTimes,
    /// Ends all streams.
    pub shutdown: CancellationToken,
    /// Limits the log lines about refused workers, which may reconnect at once.
    pub refusals: Mutex<Throttle>,
}

#[tonic::async_trait]
impl WorkerService for Workers {
    type WorkStream = Pin<Box<dyn Stream<Item = Result<WorkResponse, Status>> + Send>>;

    async fn work(
        &self,
        request: Request<Streaming<WorkRequest>>,
    ) -> Result<Response<Self::WorkStream>, Status> {
        let peer = request.extensions().get::<Peer>();
        let address = peer.map_or_else(|| "?".to_owned(), |peer| peer.address().to_string());
        let mut inbound = request.into_inner();
        let first = tokio::time::timeout(HELLO_TIMEOUT, inbound.message())
            .await
            .map_err(|_| Status::deadline_exceeded("no Hello in time"))??;
        let hello = match first.and_then(|request| request.message) {
            Some(Message::Hello(hello)) => hello,
            _ => return Err(Status::invalid_argument("the first message must be Hello")),
        };
        check_hello(&hello).inspect_err(|status| {
            let refusals = &mut *self.refusals.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(withheld) = refusals.on_line(clock::now()) {
                let name = printable(&hello.name);
                warn!(name, address, withheld, reason = status.message(), "worker refused");
            }
        })?;

        let n_slots = hello.slots as usize;
        let (outbox, inbox) = mpsc::channel(ITEMS_PER_SLOT_MAX * n_slots + WORKER_OUTBOX_SLACK);
        let link = WorkerLink { outbox, dropped: self.shutdown.child_token() };
        let dropped = link.dropped.clone();
        let (reply, id) = oneshot::channel();
        let introduction = Introduction {
            name: printable(&hello.name).into(),
            version: printable(&hello.version),
            n_slots,
            experiments: NamePattern::new(&printable(&hello.experiments)),
            process: NonZeroU64::new(hello.process_id),
        };
        let joined = DriverEvent::WorkerJoined { introduction, link, reply };
        self.events.send(joined).await.map_err(|_| shutting_down())?;
        let id = id.await.map_err(|_| shutting_down())?;
        tokio::spawn(listen(id, inbound, self.events.clone(), dropped));

        let (times, room) = (self.times, self.outflow.0.clone());
        let outbound = unfold((inbox, room, None), move |(mut inbox, room, place)| async move {
            // The worker has taken the previous message.
            drop(place);
            let message = inbox.recv().await?;
            // A long message waits for room, which it holds until the worker has taken it.
            let place = match message.payload_len() {
                0..=SHORT_LEN => None,
                len => room.take(COPIES * len).await,
            };
            Some((convert::to_wire(message, times), (inbox, room, place)))
        });
        Ok(Response::new(Box::pin(outbound)))
    }
}

/// Passes a worker's messages on until its stream ends.
async fn listen(
    id: WorkerId,
    mut inbound: Streaming<WorkRequest>,
    events: EventSender,
    dropped: CancellationToken,
) {
    let reason = loop {
        let received = tokio::select! {
            () = dropped.cancelled() => return,
            received = inbound.message() => received,
        };
        let message = match received {
            Ok(Some(WorkRequest { message: Some(message) })) => message,
            // A kind of message that this version does not know.
            Ok(Some(WorkRequest { message: None })) => continue,
            Ok(None) => break "it closed its stream".to_owned(),
            Err(status) => {
                break format!("its stream broke: {}", printable(status.message()));
            }
        };
        let message = match message {
            Message::Heartbeat(_) => WorkerMessage::Heartbeat,
            Message::Draining(_) => WorkerMessage::Draining,
            Message::Results(results) if results.results.len() > RESULTS_PER_MESSAGE_MAX => {
                break format!("it sent {} results at once", results.results.len());
            }
            Message::Results(results) => WorkerMessage::Results(
                results.results.into_iter().map(convert::item_result).collect(),
            ),
            Message::Hello(_) => break "it said Hello twice".to_owned(),
        };
        if events.send(DriverEvent::WorkerSpoke(id, message)).await.is_err() {
            return;
        }
    };
    // If the driver is gone, so are all workers.
    let _ = events.send(DriverEvent::WorkerLeft { worker: id, reason }).await;
}

fn check_hello(hello: &Hello) -> Result<(), Status> {
    if hello.protocol_version != PROTOCOL_VERSION {
        return Err(Status::failed_precondition(format!(
            "the worker speaks protocol version {}, the coordinator {PROTOCOL_VERSION}; \
             run the same release on both sides",
            hello.protocol_version
        )));
    }
    if hello.sim_core_fingerprint != sim_core::FINGERPRINT {
        return Err(Status::failed_precondition(format!(
            "the worker simulates with \"{}\", the coordinator with \"{}\"; \
             run the same release on both sides",
            printable(&hello.sim_core_fingerprint),
            sim_core::FINGERPRINT
        )));
    }
    if hello.slots == 0 || hello.slots > SLOTS_MAX {
        return Err(Status::invalid_argument(format!(
            "slots is {}, not within 1..={SLOTS_MAX}",
            hello.slots
        )));
    }
    if hello.name.len() > WORKER_NAME_LEN_MAX {
        return Err(Status::invalid_argument(format!(
            "name is longer than {WORKER_NAME_LEN_MAX} bytes"
        )));
    }
    for (what, text) in [("version", &hello.version), ("experiments", &hello.experiments)] {
        if text.len() > WORKER_NAME_LEN_MAX {
            let message = format!("{what} is longer than {WORKER_NAME_LEN_MAX} bytes");
            return Err(Status::invalid_argument(message));
        }
    }
    Ok(())
}
