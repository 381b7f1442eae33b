//! Compresses long answers with gzip for browsers that accept it: lists, curves and modules
//! shrink to a fraction.

use std::io::Write as _;

use axum::{
    body::{Body, HttpBody as _, to_bytes},
    extract::Request,
    http::{
        HeaderMap, HeaderValue,
        header::{ACCEPT_ENCODING, CONTENT_ENCODING, CONTENT_LENGTH, CONTENT_TYPE, VARY},
    },
    middleware::Next,
    response::Response,
};
use flate2::{Compression, write::GzEncoder};

/// Answers of a packet or two stay uncompressed.
const LEN_MIN: u64 = 2 << 10;

/// Compresses an answer if that is worthwhile.
pub async fn compress(request: Request, next: Next) -> Response {
    let is_wanted = takes_gzip(request.headers());
    let mut response = next.run(request).await;
    let len = response.body().size_hint().exact();
    let Some(len) = len.filter(|len| *len >= LEN_MIN && is_text(response.headers())) else {
        return response;
    };
    response.headers_mut().append(VARY, HeaderValue::from_static("accept-encoding"));
    if !is_wanted {
        return response;
    }
    let (mut head, body) = response.into_parts();
    // An answer of known length is in memory.
    let whole = to_bytes(body, len as usize).await.unwrap_or_default();
    let packing = tokio::task::spawn_blocking(move || {
        let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
        packed.write_all(&whole).and_then(|()| packed.finish()).expect("memory takes all writes")
    });
    let Ok(packed) = packing.await else { return Response::from_parts(head, Body::empty()) };
    head.headers.remove(CONTENT_LENGTH);
    head.headers.insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    Response::from_parts(head, packed.into())
}

fn is_text(headers: &HeaderMap) -> bool {
    let kind = headers.get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    kind.starts_with("text/") || kind.starts_with("application/json")
}

/// Whether a browser accepts gzip, and does not refuse it with `q=0`.
fn takes_gzip(headers: &HeaderMap) -> bool {
    let lists = headers.get_all(ACCEPT_ENCODING).iter().filter_map(|list| list.to_str().ok());
    lists.flat_map(|list| list.split(',')).any(|one| {
        let mut parts = one.split(';').map(str::trim);
        parts.next() == Some("gzip") && !parts.any(|part| matches!(part, "q=0" | "q=0.0"))
    })
}
