//! The pages over HTTP: access to them, and their content. This module decides nothing about
//! experiments.

mod access;
mod answers;
mod assets;
mod compare;
mod compression;
mod controllers;
mod experiments;
mod fleet;
mod limits;
mod list;
mod live;
mod problem;
mod replays;

use std::{convert::Infallible, io, net::SocketAddr, sync::Arc};

use axum::{
    Router,
    body::Body,
    http::Request,
    middleware,
    routing::{get, post},
};
use hyper::body::Incoming;
use model::queries::Reader;
use rustls::ServerConfig;
use swarm_proto::v1::{
    Experiment, GetExperimentRequest, GetExperimentResponse, ListExperimentsRequest,
};
use swarm_transport::{
    Token,
    listening::{Peer, serve_http},
};
use tokio::{net::TcpListener, sync::Semaphore};
use tokio_util::sync::CancellationToken;
use tonic::Status;
use tower::ServiceExt as _;

use crate::source::Control;

use self::{
    access::Access,
    fleet::{Explanations, LatestAnswer},
    limits::{AnswerRoom, CONNECTIONS, REPLAYS_MAX, REQUESTS},
    list::List,
    live::Latest,
    problem::Problem,
    replays::Judgements,
};

/// The served content, and the access to it.
#[derive(Clone)]
pub struct Site {
    /// The source of experiments.
    pub reader: Arc<Reader>,
    /// The coordinator, if one runs.
    pub control: Option<Arc<dyn Control>>,
    /// The token that browsers must show, if any.
    pub token: Option<Token>,
    /// The TLS configuration, if any.
    pub tls: Option<Arc<ServerConfig>>,
}

/// The shared state of all handlers.
#[derive(Clone)]
struct Shared {
    reader: Arc<Reader>,
    control: Option<Arc<dyn Control>>,
    workers: Arc<LatestAnswer>,
    timeline: Arc<LatestAnswer>,
    explanations: Arc<Explanations>,
    latest: Arc<Latest>,
    list: Arc<List>,
    judgements: Arc<Judgements>,
    replays: Arc<Semaphore>,
    shutdown: CancellationToken,
}

impl Shared {
    /// One experiment, with its file in canonical form.
    async fn experiment(&self, experiment_id: u64) -> Result<GetExperimentResponse, Status> {
        self.reader.get_experiment(GetExperimentRequest { experiment_id }).await
    }

    /// All experiments, oldest first.
    async fn experiments(&self) -> Result<Vec<Experiment>, Status> {
        Ok(self.reader.list_experiments(ListExperimentsRequest::default()).await?.experiments)
    }
}

impl Site {
    /// Serves until `shutdown`.
    pub async fn serve(self, listener: TcpListener, shutdown: CancellationToken) -> io::Result<()> {
        let address = listener.local_addr()?;
        let tls = self.tls.clone();
        let router = self.router(address, shutdown.clone());
        let answer = move |request: Request<Incoming>, peer: Peer| {
            let mut request = request.map(Body::new);
            request.extensions_mut().insert(peer);
            let answering = router.clone().oneshot(request);
            async move { answering.await.unwrap_or_else(|never: Infallible| match never {}) }
        };
        serve_http(listener, (CONNECTIONS, REQUESTS), tls, answer, shutdown).await;
        Ok(())
    }

    fn router(self, address: SocketAddr, shutdown: CancellationToken) -> Router {
        let Self { reader, control, token, tls } = self;
        let access = Arc::new(Access::new(token, tls.is_some(), address));
        let shared = Shared {
            reader,
            control,
            workers: Arc::default(),
            timeline: Arc::default(),
            explanations: Arc::default(),
            latest: Arc::default(),
            list: Arc::default(),
            judgements: Arc::default(),
            replays: Arc::new(Semaphore::new(REPLAYS_MAX)),
            shutdown,
        };
        let api = Router::new()
            .route("/session", get(fleet::session))
            .route("/workers", get(fleet::workers))
            .route("/timeline", get(fleet::timeline))
            .route("/live", get(list::live))
            .route("/compare", get(compare::compare))
            .route("/experiments", get(list::all))
            .route("/experiments/{id}", get(experiments::one))
            .route("/experiments/{id}/generations", get(experiments::generations))
            .route("/experiments/{id}/events", get(experiments::events))
            .route("/experiments/{id}/fitness", get(experiments::fitness))
            .route("/experiments/{id}/dynamics", get(experiments::dynamics))
            .route("/experiments/{id}/families", get(experiments::families))
            .route("/experiments/{id}/repertoire", get(experiments::repertoire))
            .route("/experiments/{id}/front", get(experiments::front))
            .route("/experiments/{id}/live", get(live::generations))
            .route("/experiments/{id}/explain", get(fleet::explain))
            .route("/experiments/{id}/{action}", post(fleet::steer))
            .route("/replay/{*address}", get(replays::replay))
            .route("/individual/{*address}", get(replays::individual))
            .route("/trials/{*address}", get(replays::trials))
            .route("/controller/{*address}", get(controllers::controller))
            .fallback(Problem::nowhere)
            .method_not_allowed_fallback(Problem::nowhere)
            .layer(middleware::from_fn(compression::compress))
            .layer(middleware::from_fn_with_state(AnswerRoom::default(), limits::hold_answers))
            .with_state(shared);
        Router::new()
            .nest("/api", api)
            .merge(assets::routes().layer(middleware::from_fn(compression::compress)))
            .route("/login", post(access::login).with_state(access.clone()))
            .layer(middleware::from_fn_with_state(access, access::check))
    }
}

#[cfg(test)]
mod tests;
