//! Limits on the resources that strangers and slow readers can use.

use std::{sync::Arc, time::Duration};

use axum::{
    body::{Body, HttpBody as _},
    extract::{Request, State},
    http::StatusCode,
    middleware::Next,
    response::{IntoResponse as _, Response},
};
use http_body_util::BodyExt as _;
use swarm_transport::listening::{HttpLimits, Known, ListenerLimits, Room};
use tokio::sync::Semaphore;

use super::problem::Problem;

/// Bytes of a request's body: a token, or a change.
pub const BODY_LEN_MAX: usize = 16 << 10;
/// Time limit for a request to arrive.
pub const BODY_TIME: Duration = Duration::from_secs(10);
/// Maximum number of simultaneous simulations for pages.
pub const REPLAYS_MAX: usize = 2;

/// Maximum number of connections; a browser has up to six. At the limit, a new connection
/// of a known browser ends the one whose last request is the oldest. A page that loses its
/// news this way reconnects by itself.
pub const CONNECTIONS: ListenerLimits = ListenerLimits {
    strangers: ROOM,
    admission_time: Duration::from_secs(30),
    known: Known::EndsAnother(ROOM),
    stall_time: Duration::from_secs(30),
};
const ROOM: Room = Room {
    n_places: 512,
    silent_grace: Duration::from_millis(100),
    heard_grace: Duration::from_millis(500),
};
/// Requests: a cookie has less than 1 KiB.
pub const REQUESTS: HttpLimits = HttpLimits {
    headers_time: Duration::from_secs(10),
    headers_len: 16 << 10,
    n_headers: 64,
    keep_alive: true,
};

/// Maximum bytes of long answers that wait for their readers.
const ANSWERS_LEN_MAX: usize = 256 << 20;
/// The unit of counting, in bytes. Shorter answers are not counted, because there are at
/// most as many as connections.
const UNIT: usize = 64 << 10;

/// The budget for answers that are being sent.
#[derive(Debug, Clone)]
pub struct AnswerRoom(Arc<Semaphore>);

impl Default for AnswerRoom {
    fn default() -> Self {
        Self(Arc::new(Semaphore::new(ANSWERS_LEN_MAX / UNIT)))
    }
}

/// Sends a long answer if the budget allows, and reserves its bytes until it is read.
pub async fn hold_answers(
    State(AnswerRoom(room)): State<AnswerRoom>,
    request: Request,
    next: Next,
) -> Response {
    let response = next.run(request).await;
    let len = response.body().size_hint().lower();
    let n_units = u32::try_from(len / UNIT as u64).unwrap_or(u32::MAX);
    match room.try_acquire_many_owned(n_units) {
        Ok(place) => response.map(|body| {
            Body::new(body.map_frame(move |frame| {
                let _ = &place;
                frame
            }))
        }),
        Err(_) => {
            let why = "many long answers wait for their readers; try again in a minute";
            Problem::new(StatusCode::SERVICE_UNAVAILABLE, why).into_response()
        }
    }
}
