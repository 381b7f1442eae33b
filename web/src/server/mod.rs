//! The pages over HTTP: who may see them, what they are made of, and nothing that
//! decides.

mod access;
mod answers;
mod assets;
mod experiments;
mod fleet;
mod listener;
mod live;
mod problem;
mod replays;

use std::{io, net::SocketAddr, sync::Arc};

use axum::{
    Router,
    extract::DefaultBodyLimit,
    middleware,
    routing::{get, post},
};
use rustls::ServerConfig;
use swarm_transport::Token;
use tokio::{net::TcpListener, sync::Semaphore};
use tokio_util::sync::CancellationToken;

use crate::source::{Archive, Control};

use self::{
    access::Access,
    fleet::{Explanations, LatestAnswer},
    listener::Connections,
    live::Latest,
    problem::Problem,
};

/// Bytes of a request's body: a token, or what to change.
const BODY_LEN_MAX: usize = 16 << 10;
/// Episodes that are simulated for pages at the same time.
const REPLAYS_MAX: usize = 2;

/// What is served, and to whom.
#[derive(Clone)]
pub struct Site {
    /// Where experiments are read.
    pub archive: Arc<dyn Archive>,
    /// The coordinator, if one runs.
    pub control: Option<Arc<dyn Control>>,
    /// What people have to know, if anything.
    pub token: Option<Token>,
    /// How the way to them is encrypted, if it is.
    pub tls: Option<Arc<ServerConfig>>,
}

/// What all handlers share.
#[derive(Clone)]
struct Shared {
    archive: Arc<dyn Archive>,
    control: Option<Arc<dyn Control>>,
    workers: Arc<LatestAnswer>,
    timeline: Arc<LatestAnswer>,
    explanations: Arc<Explanations>,
    latest: Arc<Latest>,
    replays: Arc<Semaphore>,
    shutdown: CancellationToken,
}

impl Site {
    /// Serves until `shutdown`.
    pub async fn serve(self, listener: TcpListener, shutdown: CancellationToken) -> io::Result<()> {
        let address = listener.local_addr()?;
        let connections = Connections::accept(listener, self.tls.clone(), shutdown.clone());
        let router = self.router(address, shutdown.clone());
        axum::serve(connections, router).with_graceful_shutdown(shutdown.cancelled_owned()).await
    }

    fn router(self, address: SocketAddr, shutdown: CancellationToken) -> Router {
        let Self { archive, control, token, tls } = self;
        let access = Arc::new(Access::new(token, tls.is_some(), address));
        let shared = Shared {
            archive,
            control,
            workers: Arc::default(),
            timeline: Arc::default(),
            explanations: Arc::default(),
            latest: Arc::default(),
            replays: Arc::new(Semaphore::new(REPLAYS_MAX)),
            shutdown,
        };
        let api = Router::new()
            .route("/session", get(fleet::session))
            .route("/workers", get(fleet::workers))
            .route("/timeline", get(fleet::timeline))
            .route("/live", get(live::news))
            .route("/experiments", get(experiments::all))
            .route("/experiments/{id}", get(experiments::one))
            .route("/experiments/{id}/generations", get(experiments::generations))
            .route("/experiments/{id}/events", get(experiments::events))
            .route("/experiments/{id}/fitness", get(experiments::fitness))
            .route("/experiments/{id}/dynamics", get(experiments::dynamics))
            .route("/experiments/{id}/live", get(live::generations))
            .route("/experiments/{id}/explain", get(fleet::explain))
            .route("/experiments/{id}/{action}", post(fleet::steer))
            .route("/replay/{*address}", get(replays::replay))
            .fallback(Problem::nowhere)
            .method_not_allowed_fallback(Problem::nowhere)
            .with_state(shared);
        Router::new()
            .nest("/api", api)
            .merge(assets::routes())
            .route("/login", post(access::login).with_state(access.clone()))
            .layer(middleware::from_fn_with_state(access, access::check))
            .layer(DefaultBodyLimit::max(BODY_LEN_MAX))
    }
}

#[cfg(test)]
mod tests;
