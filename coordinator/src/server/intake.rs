//! Bounds the memory of incoming long messages: a message is read once there is room for all of
//! it, and for its decoded form.

use std::{
    pin::Pin,
    task::{Context, Poll, ready},
};

use http_body::Frame;
use swarm_transport::TO_COORDINATOR_LEN_MAX;
use tokio::time::{Sleep, sleep};
use tonic::{Status, body::Body, codegen::Bytes};

use crate::{
    byte_budget::{ByteBudget, TakenBytes},
    limits::{INTAKE_LEN_MAX, MESSAGE_TIME, SHORT_LEN},
};

/// Memory of a message relative to its length: a buffer that grew, and the decoded form.
const COPIES: usize = 3;
/// Bytes of the head before a message. The head says whether the message is compressed, and its
/// length.
const HEAD_LEN: usize = 5;

/// Room for long messages.
#[derive(Debug, Clone)]
pub struct Intake(ByteBudget);

/// The messages of a call; long ones wait for room.
struct Arriving {
    body: Body,
    room: ByteBudget,
    /// The arrived bytes of the head of the next message.
    head: Vec<u8>,
    /// Bytes of the message that are still to come.
    n_left: usize,
    /// Arrived bytes that wait for room.
    held: Option<Bytes>,
    waiting: Option<Pin<Box<dyn Future<Output = Option<TakenBytes>> + Send>>>,
    /// The room of the message that arrives, or arrived last.
    place: Option<TakenBytes>,
    deadline: Option<Pin<Box<Sleep>>>,
}

impl Default for Intake {
    fn default() -> Self {
        Self(ByteBudget::new(INTAKE_LEN_MAX))
    }
}

impl Intake {
    /// Wraps a body, so that its messages wait for room.
    pub fn wrap(&self, body: Body) -> Body {
        Body::new(Arriving {
            body,
            room: self.0.clone(),
            head: Vec::with_capacity(HEAD_LEN),
            n_left: 0,
            held: None,
            waiting: None,
            place: None,
            deadline: None,
        })
    }
}

impl Arriving {
    /// Scans arrived bytes. Returns the length of the last message that begins in them.
    fn scan(&mut self, mut bytes: &[u8]) -> Option<usize> {
        let mut begun = None;
        while !bytes.is_empty() {
            let wanted = if self.n_left > 0 { self.n_left } else { HEAD_LEN - self.head.len() };
            let (part, rest) = bytes.split_at(wanted.min(bytes.len()));
            bytes = rest;
            if self.n_left > 0 {
                self.n_left -= part.len();
                continue;
            }
            self.head.extend_from_slice(part);
            if let &[_, a, b, c, d] = &*self.head {
                self.head.clear();
                self.n_left = u32::from_be_bytes([a, b, c, d]) as usize;
                begun = Some(self.n_left);
            }
        }
        begun
    }

    /// Begins a message, and releases the room of the previous one.
    fn begin(&mut self, len: usize) {
        (self.place, self.deadline) = (None, None);
        if len <= SHORT_LEN {
            return;
        }
        // A longer message is refused after its head.
        let room = self.room.take(COPIES * len.min(TO_COORDINATOR_LEN_MAX));
        self.waiting = Some(Box::pin(room));
    }
}

impl http_body::Body for Arriving {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let this = self.get_mut();
        loop {
            if let Some(waiting) = &mut this.waiting {
                this.place = ready!(waiting.as_mut().poll(context));
                this.waiting = None;
                this.deadline = Some(Box::pin(sleep(MESSAGE_TIME)));
            }
            if let Some(bytes) = this.held.take() {
                return Poll::Ready(Some(Ok(Frame::data(bytes))));
            }
            if this.n_left > 0
                && let Some(deadline) = &mut this.deadline
                && deadline.as_mut().poll(context).is_ready()
            {
                let seconds = MESSAGE_TIME.as_secs();
                let why = format!("a message did not arrive within {seconds} s");
                return Poll::Ready(Some(Err(Status::deadline_exceeded(why))));
            }
            let Some(frame) = ready!(Pin::new(&mut this.body).poll_frame(context)?) else {
                return Poll::Ready(None);
            };
            match frame.into_data() {
                Ok(bytes) => {
                    if let Some(len) = this.scan(&bytes) {
                        this.begin(len);
                    }
                    this.held = Some(bytes);
                }
                Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        self.held.is_none() && self.body.is_end_stream()
    }
}

#[cfg(test)]
mod tests {
    use http_body_util::{BodyExt as _, StreamBody};
    use tokio::sync::mpsc;
    use tokio_stream::{StreamExt as _, wrappers::ReceiverStream};

    use super::*;

    /// A body of messages, in frames of this many bytes, and the sender for more.
    fn body(intake: &Intake, messages: &[usize], frame_len: usize) -> (Body, mpsc::Sender<Bytes>) {
        let mut bytes = Vec::new();
        for &len in messages {
            bytes.push(0);
            bytes.extend((len as u32).to_be_bytes());
            bytes.resize(bytes.len() + len, 1);
        }
        let (sender, frames) = mpsc::channel(1 + bytes.len() / frame_len);
        for frame in bytes.chunks(frame_len) {
            sender.try_send(Bytes::copy_from_slice(frame)).unwrap();
        }
        let frames = ReceiverStream::new(frames).map(|bytes| Ok::<_, Status>(Frame::data(bytes)));
        (intake.wrap(Body::new(StreamBody::new(frames))), sender)
    }

    async fn read(body: &mut Body) -> usize {
        body.frame().await.unwrap().unwrap().into_data().unwrap().len()
    }

    #[tokio::test]
    async fn long_messages_wait_until_there_is_room_and_short_ones_do_not() {
        let intake = Intake::default();
        let long = TO_COORDINATOR_LEN_MAX;
        let n_fit = INTAKE_LEN_MAX / (COPIES * long);
        let mut arriving: Vec<_> = (0..n_fit).map(|_| body(&intake, &[long], 1 << 20)).collect();
        for (body, _sender) in &mut arriving {
            read(body).await;
        }
        let (mut another, _sender) = body(&intake, &[long], 1 << 20);
        let mut reading = Box::pin(read(&mut another));
        let at_once = tokio::time::timeout(std::time::Duration::ZERO, reading.as_mut());
        assert!(at_once.await.is_err(), "{n_fit} take all the room");
        let (mut short, _sender) = body(&intake, &[SHORT_LEN], 1 << 10);
        read(&mut short).await;
        arriving.pop();
        reading.await;
    }

    #[tokio::test]
    async fn a_message_is_found_however_it_is_cut_and_its_room_is_free_when_the_next_begins() {
        for frame_len in [1, 4, 5, 7, 100_000, 10_000_000] {
            let intake = Intake::default();
            let all = intake.0.len_left();
            let (mut both, sender) = body(&intake, &[3, 100_000, 0, 200_000, 3], frame_len);
            drop(sender);
            let mut fewest = all;
            let mut n_bytes = 0;
            while let Some(frame) = both.frame().await {
                n_bytes += frame.unwrap().into_data().unwrap().len();
                fewest = fewest.min(intake.0.len_left());
            }
            assert_eq!(n_bytes, 300_006 + 5 * HEAD_LEN);
            if frame_len <= 100_000 {
                assert_eq!(all - fewest, (COPIES * 200_000) >> 14 << 14, "{frame_len}");
            }
            assert_eq!(intake.0.len_left(), all);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_call_that_sends_a_long_message_slowly_is_ended() {
        let intake = Intake::default();
        let (mut slow, sender) = body(&intake, &[], 1);
        sender.send(Bytes::from_static(b"\0\0\x10\0\0")).await.unwrap();
        read(&mut slow).await;
        let status = slow.frame().await.unwrap().unwrap_err();
        assert_eq!(status.code(), tonic::Code::DeadlineExceeded);
    }
}
