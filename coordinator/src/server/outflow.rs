//! Bounds the memory of long answers that wait for their readers. An answer that nobody reads is
//! dropped with the rest of its stream, so that it takes no memory.

use std::{
    pin::Pin,
    sync::{Arc, Mutex, MutexGuard, PoisonError, Weak},
    task::{Context, Poll, ready},
};

use http_body::Frame;
use tokio::time::{Instant, sleep_until};
use tonic::{Status, body::Body, codegen::Bytes};

use crate::{
    byte_budget::{ByteBudget, TakenBytes},
    limits::{OUTFLOW_LEN_MAX, SHORT_LEN, WATCH_PATIENCE},
};

/// Bytes of a piece. The connection takes one piece at a time, and holds it if the peer does not
/// read.
const PIECE_LEN: usize = 32 << 10;

/// Room for long answers.
#[derive(Debug, Clone)]
pub struct Outflow(ByteBudget);

/// The waiting part of an answer, or of a stream of answers.
struct Unread {
    body: Body,
    rest: Bytes,
    place: Option<TakenBytes>,
    /// Time at which the last piece was taken.
    taken: Instant,
    is_watched: bool,
}

/// `None` if it was dropped because nobody read it.
type Shared = Mutex<Option<Unread>>;

/// Hands an answer out in pieces.
struct Pieces {
    room: ByteBudget,
    unread: Arc<Shared>,
}

impl Default for Outflow {
    fn default() -> Self {
        Self(ByteBudget::new(OUTFLOW_LEN_MAX))
    }
}

impl Outflow {
    /// Wraps an answer, to send it in pieces if there is room for it.
    pub fn wrap(&self, body: Body) -> Body {
        let (rest, taken) = (Bytes::new(), Instant::now());
        let unread = Unread { body, rest, place: None, taken, is_watched: false };
        let unread = Arc::new(Mutex::new(Some(unread)));
        Body::new(Pieces { room: self.0.clone(), unread })
    }
}

impl Unread {
    /// The next waiting piece.
    fn piece(&mut self) -> Frame<Bytes> {
        self.taken = Instant::now();
        Frame::data(self.rest.split_to(PIECE_LEN.min(self.rest.len())))
    }
}

impl http_body::Body for Pieces {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let mut shared = lock(&self.unread);
        let Some(unread) = &mut *shared else {
            let why = "the answer was not read in time; ask again";
            return Poll::Ready(Some(Err(Status::aborted(why))));
        };
        if !unread.rest.is_empty() {
            return Poll::Ready(Some(Ok(unread.piece())));
        }
        unread.place = None;
        let Some(frame) = ready!(Pin::new(&mut unread.body).poll_frame(context)?) else {
            return Poll::Ready(None);
        };
        let bytes = match frame.into_data() {
            Ok(bytes) if bytes.len() > SHORT_LEN => bytes,
            Ok(bytes) => return Poll::Ready(Some(Ok(Frame::data(bytes)))),
            Err(trailers) => return Poll::Ready(Some(Ok(trailers))),
        };
        let Some(place) = self.room.try_take(bytes.len()) else {
            let why = "many long answers wait for their readers; try again in a minute";
            return Poll::Ready(Some(Err(Status::resource_exhausted(why))));
        };
        (unread.place, unread.rest) = (Some(place), bytes);
        if !unread.is_watched {
            unread.is_watched = true;
            tokio::spawn(watch(Arc::downgrade(&self.unread)));
        }
        Poll::Ready(Some(Ok(unread.piece())))
    }

    /// A refusal is in the headers of an answer, and clients accept no frame after them.
    fn is_end_stream(&self) -> bool {
        let shared = lock(&self.unread);
        shared.as_ref().is_some_and(|unread| unread.rest.is_empty() && unread.body.is_end_stream())
    }
}

/// Drops an answer that nobody reads.
async fn watch(unread: Weak<Shared>) {
    loop {
        let due = {
            let Some(unread) = unread.upgrade() else { return };
            let mut shared = lock(&unread);
            let Some(answer) = &mut *shared else { return };
            if answer.rest.is_empty() {
                answer.is_watched = false;
                return;
            }
            let due = answer.taken + WATCH_PATIENCE;
            if due <= Instant::now() {
                *shared = None;
                return;
            }
            due
        };
        sleep_until(due).await;
    }
}

fn lock(shared: &Shared) -> MutexGuard<'_, Option<Unread>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use http_body_util::{BodyExt as _, Full};

    use super::*;

    fn answer(outflow: &Outflow, len: usize) -> Body {
        outflow.wrap(Body::new(Full::new(Bytes::from(vec![7; len]))))
    }

    async fn piece(body: &mut Body) -> Result<usize, Status> {
        Ok(body.frame().await.unwrap()?.into_data().unwrap().len())
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_is_whole_however_slowly_it_is_read() {
        let outflow = Outflow::default();
        let mut body = answer(&outflow, 1_000_000);
        let mut n_bytes = 0;
        while let Some(frame) = body.frame().await {
            n_bytes += frame.unwrap().into_data().unwrap().len();
            tokio::time::sleep(WATCH_PATIENCE - Duration::from_secs(1)).await;
        }
        assert_eq!(n_bytes, 1_000_000);
        assert_eq!(outflow.0.len_left(), OUTFLOW_LEN_MAX);
    }

    #[tokio::test(start_paused = true)]
    async fn an_answer_that_nobody_reads_is_dropped_and_its_room_is_free() {
        let outflow = Outflow::default();
        let mut body = answer(&outflow, 1_000_000);
        assert_eq!(piece(&mut body).await.unwrap(), PIECE_LEN);
        assert!(outflow.0.len_left() < OUTFLOW_LEN_MAX);
        tokio::time::sleep(WATCH_PATIENCE + Duration::from_secs(1)).await;
        assert_eq!(outflow.0.len_left(), OUTFLOW_LEN_MAX);
        assert_eq!(piece(&mut body).await.unwrap_err().code(), tonic::Code::Aborted);
    }

    #[test]
    fn an_answer_without_a_message_has_no_frame() {
        use http_body::Body as _;
        assert!(Outflow::default().wrap(Body::empty()).is_end_stream());
        assert!(!answer(&Outflow::default(), 1).is_end_stream());
    }

    #[tokio::test]
    async fn an_answer_too_many_is_refused_and_a_short_one_is_not() {
        let outflow = Outflow::default();
        let mut waiting = Vec::new();
        for _ in 0..OUTFLOW_LEN_MAX >> 26 {
            let mut body = answer(&outflow, 1 << 26);
            piece(&mut body).await.unwrap();
            waiting.push(body);
        }
        let refused = piece(&mut answer(&outflow, 1 << 26)).await.unwrap_err();
        assert_eq!(refused.code(), tonic::Code::ResourceExhausted);
        assert_eq!(piece(&mut answer(&outflow, SHORT_LEN)).await.unwrap(), SHORT_LEN);
        waiting.pop();
        piece(&mut answer(&outflow, 1 << 26)).await.unwrap();
    }
}
