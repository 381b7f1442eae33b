//! A tower layer that runs a [`Guard`] around every call of all services.

use std::{
    convert::Infallible,
    future::ready,
    pin::Pin,
    task::{Context, Poll},
};

use http::{HeaderMap, Request, Response};
use http_body_util::BodyExt as _;
use tonic::{Status, body::Body};
use tower::{Layer, Service};

/// Code that runs around every call.
pub trait Guard: Clone {
    /// Lives as long as a call: until its answer has been read, or given up.
    type Call: Watch + Send + 'static;

    /// Called at the beginning of a call; an error becomes the call's answer.
    fn begin(&self, request: &mut Request<Body>) -> Result<Self::Call, Status>;
}

/// Observes the answer of a call.
pub trait Watch {
    /// The headers of the answer, and its trailers.
    fn on_headers(&mut self, _headers: &HeaderMap) {}
}

/// The layer.
#[derive(Debug, Clone)]
pub struct CallLayer<G>(pub G);

/// Services inside a guard.
#[derive(Debug, Clone)]
pub struct Guarded<G, S> {
    guard: G,
    services: S,
}

impl<G: Guard, S> Layer<S> for CallLayer<G> {
    type Service = Guarded<G, S>;

    fn layer(&self, services: S) -> Guarded<G, S> {
        Guarded { guard: self.0.clone(), services }
    }
}

impl<G, S> Service<Request<Body>> for Guarded<G, S>
where
    G: Guard,
    S: Service<Request<Body>, Response = Response<Body>, Error = Infallible>,
    S::Future: Send + 'static,
{
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response<Body>, Infallible>> + Send>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.services.poll_ready(context)
    }

    fn call(&mut self, mut request: Request<Body>) -> Self::Future {
        let mut call = match self.guard.begin(&mut request) {
            Ok(call) => call,
            Err(status) => return Box::pin(ready(Ok(status.into_http()))),
        };
        let response = self.services.call(request);
        Box::pin(async move {
            let response = response.await?;
            call.on_headers(response.headers());
            let until_read = move |body: Body| {
                Body::new(body.inspect_frame(move |frame| {
                    if let Some(trailers) = frame.trailers_ref() {
                        call.on_headers(trailers);
                    }
                }))
            };
            Ok(response.map(until_read))
        })
    }
}
