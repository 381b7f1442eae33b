//! The pages of a coordinator: the same token and TLS as for clients.

use std::{path::Path, sync::Arc};

use model::queries::Reader;
use swarm_transport::{Token, server_tls};
use swarm_web::Site;
use tokio::{net::TcpListener, sync::watch};
use tokio_util::sync::CancellationToken;
use tracing::error;

use super::{Access, StartError, Tls, Tokens};
use crate::rpc::Experiments;

/// The parts of the site that exist before the database is open.
pub struct Builder {
    token: Option<Token>,
    tls: Option<Arc<rustls::ServerConfig>>,
}

impl Builder {
    pub fn new(access: &Access) -> Result<Self, StartError> {
        let tls = |tls: &Tls| server_tls(&tls.identity).map(Arc::new);
        let tls = access.tls.as_ref().map(tls).transpose();
        Ok(Self {
            token: access.tokens.as_ref().map(Tokens::client).cloned(),
            tls: tls.map_err(|error| StartError::Tls(error.to_string()))?,
        })
    }

    /// `news` changes after each write to the database.
    pub fn site(
        self,
        data_dir: &Path,
        news: watch::Receiver<u64>,
        experiments: Experiments,
    ) -> Result<Site, StartError> {
        Ok(Site {
            reader: Arc::new(Reader::open(data_dir, news)?),
            control: Some(Arc::new(experiments)),
            token: self.token,
            tls: self.tls,
        })
    }
}

/// Serves until shutdown. Errors end only the pages, not the evolution.
pub async fn serve(site: Site, listener: TcpListener, shutdown: CancellationToken) {
    if let Err(error) = site.serve(listener, shutdown).await {
        error!("pages are no longer served: {error}");
    }
}
