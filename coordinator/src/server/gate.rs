//! The gate before all services: it checks tokens, and limits the number of calls.

use std::sync::{Arc, Mutex, PoisonError};

use http::{Request, header::AUTHORIZATION};
use swarm_proto::v1::worker_service_server;
use swarm_transport::{
    BEARER, Throttle,
    listening::{Peer, TooManyConnections},
};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tonic::{Status, body::Body, transport::server::TlsConnectInfo};
use tonic_health::pb::health_server;
use tracing::warn;

use super::{
    access::{Role, Tokens},
    call_layer::{Guard, Watch},
};
use crate::{
    clock,
    limits::{CLIENT_CALLS_MAX, WORKERS_MAX},
};

/// Decides which calls may pass.
#[derive(Debug, Clone)]
pub struct Gate {
    tokens: Option<Arc<Tokens>>,
    client_calls: Arc<Semaphore>,
    worker_calls: Arc<Semaphore>,
    log: Arc<Mutex<Throttle>>,
}

/// An admitted call, with its permit among simultaneous calls. Health probes take no permit.
#[derive(Debug)]
pub struct Admitted {
    _place: Option<OwnedSemaphorePermit>,
}

impl Watch for Admitted {}

impl Gate {
    /// A gate that requires tokens, if given.
    pub fn new(tokens: Option<Tokens>) -> Self {
        Self {
            tokens: tokens.map(Arc::new),
            client_calls: Arc::new(Semaphore::new(CLIENT_CALLS_MAX)),
            worker_calls: Arc::new(Semaphore::new(WORKERS_MAX)),
            log: Arc::default(),
        }
    }

    fn admit(
        &self,
        role: Role,
        authorization: Option<&[u8]>,
    ) -> Result<OwnedSemaphorePermit, Status> {
        self.authorize(role, authorization)?;
        let calls = match role {
            Role::Client => &self.client_calls,
            Role::Worker => &self.worker_calls,
        };
        Arc::clone(calls).try_acquire_owned().map_err(|_| {
            Status::resource_exhausted(format!(
                "the coordinator serves as many {role}s as it can; try again later"
            ))
        })
    }

    fn authorize(&self, role: Role, authorization: Option<&[u8]>) -> Result<(), Status> {
        let Some(tokens) = &self.tokens else { return Ok(()) };
        let Some(authorization) = authorization else {
            return Err(Status::unauthenticated(format!(
                "the coordinator wants the {role} token and got none; pass --token-file"
            )));
        };
        match bearer_token(authorization).and_then(|token| tokens.role_of(token)) {
            Some(presented) if presented == role => Ok(()),
            Some(presented) => Err(Status::permission_denied(format!(
                "the {presented} token does not permit this; it takes the {role} token"
            ))),
            None => Err(Status::unauthenticated(format!(
                "this is not the coordinator's {role} token; pass the right one with --token-file"
            ))),
        }
    }

    fn log_refusal(&self, peer: Option<&Peer>, path: &str, status: &Status) {
        let mut log = self.log.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(withheld) = log.on_line(clock::now()) else { return };
        drop(log);
        let address = peer.map_or_else(|| "?".to_owned(), |peer| peer.address().to_string());
        warn!(address, path, withheld, reason = status.message(), "call refused");
    }
}

/// The role whose token a call needs. `None` for health probes, which must not need a secret.
/// Services that are not listed here need the client's token.
fn role_for(path: &str) -> Option<Role> {
    match path.trim_start_matches('/').split('/').next() {
        Some(health_server::SERVICE_NAME) => None,
        Some(worker_service_server::SERVICE_NAME) => Some(Role::Worker),
        _ => Some(Role::Client),
    }
}

/// The token of a header, whose scheme may be written in any case.
fn bearer_token(authorization: &[u8]) -> Option<&[u8]> {
    let (scheme, token) = authorization.split_at_checked(BEARER.len())?;
    scheme.eq_ignore_ascii_case(BEARER.as_bytes()).then_some(token)
}

impl Guard for Gate {
    type Call = Admitted;

    fn begin(&self, request: &mut Request<Body>) -> Result<Admitted, Status> {
        let path = request.uri().path();
        let Some(role) = role_for(path) else { return Ok(Admitted { _place: None }) };
        let extensions = request.extensions();
        let encrypted = || extensions.get::<TlsConnectInfo<Peer>>().map(TlsConnectInfo::get_ref);
        let peer = extensions.get::<Peer>().or_else(encrypted).cloned();
        let authorization = request.headers().get(AUTHORIZATION).map(|value| value.as_bytes());
        let place = self
            .admit(role, authorization)
            .and_then(|place| match peer.as_ref().map_or(Ok(()), Peer::admit) {
                Ok(()) => Ok(place),
                Err(TooManyConnections) => Err(Status::resource_exhausted(
                    "the coordinator has as many connections as it can; try again later",
                )),
            })
            .inspect_err(|status| self.log_refusal(peer.as_ref(), path, status))?;
        // Removes the checked token, which no service may see.
        request.headers_mut().remove(AUTHORIZATION);
        if let Some(peer) = peer {
            request.extensions_mut().insert(peer);
        }
        Ok(Admitted { _place: Some(place) })
    }
}

#[cfg(test)]
mod tests {
    use std::{convert::Infallible, future::ready};

    use http::Response;
    use http_body_util::Full;
    use swarm_transport::Token;
    use tonic::Code;
    use tower::{Layer as _, Service as _, service_fn};

    use super::*;
    use crate::server::call_layer::CallLayer;

    fn gate() -> Gate {
        let token = |letter: &str| Token::parse(&letter.repeat(32)).unwrap();
        Gate::new(Some(Tokens::new(token("c"), token("w")).unwrap()))
    }

    fn code(gate: &Gate, role: Role, authorization: Option<&str>) -> Code {
        let admitted = gate.admit(role, authorization.map(str::as_bytes));
        admitted.map_or_else(|status| status.code(), |_| Code::Ok)
    }

    #[test]
    fn roles_are_told_apart() {
        let (gate, client, worker) = (gate(), "c".repeat(32), "w".repeat(32));
        for (role, own, other) in
            [(Role::Client, &client, &worker), (Role::Worker, &worker, &client)]
        {
            let code = |authorization: Option<&str>| code(&gate, role, authorization);
            assert_eq!(code(Some(&format!("Bearer {own}"))), Code::Ok);
            assert_eq!(code(Some(&format!("bearer {own}"))), Code::Ok);
            assert_eq!(code(Some(&format!("Bearer {other}"))), Code::PermissionDenied);
            for wrong in ["", "Bearer", "Bearer ", "Basic abc", own, &format!("Bearer {own}x")] {
                assert_eq!(code(Some(wrong)), Code::Unauthenticated, "{wrong}");
            }
            assert_eq!(code(None), Code::Unauthenticated);
        }
    }

    #[test]
    fn only_health_takes_no_token() {
        assert_eq!(role_for("/grpc.health.v1.Health/Check"), None);
        assert_eq!(role_for("/swarm.v1.WorkerService/Work"), Some(Role::Worker));
        for path in [
            "/swarm.v1.ExperimentService/SubmitExperiment",
            "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo",
            "/swarm.v1.ServiceOfTheFuture/Anything",
            "/grpc.health.v1.HealthAndMore/Check",
            "/",
            "",
        ] {
            assert_eq!(role_for(path), Some(Role::Client), "{path}");
        }
    }

    #[test]
    fn without_tokens_everybody_may_pass() {
        let gate = Gate::new(None);
        assert_eq!(code(&gate, Role::Client, None), Code::Ok);
        assert_eq!(code(&gate, Role::Worker, Some("whatever")), Code::Ok);
    }

    #[test]
    fn one_call_too_many_is_refused_until_another_ends() {
        let gate = Gate::new(None);
        let mut calls: Vec<_> =
            (0..CLIENT_CALLS_MAX).map(|_| gate.admit(Role::Client, None).unwrap()).collect();
        assert_eq!(code(&gate, Role::Client, None), Code::ResourceExhausted);
        assert_eq!(code(&gate, Role::Worker, None), Code::Ok, "they are counted apart");
        calls.pop();
        assert_eq!(code(&gate, Role::Client, None), Code::Ok);
    }

    #[tokio::test]
    async fn a_call_counts_until_its_answer_is_dropped() {
        let answer = service_fn(|_: Request<Body>| {
            ready(Ok::<_, Infallible>(Response::new(Body::new(Full::from("answer")))))
        });
        let gate = Gate::new(None);
        let mut guarded = CallLayer(gate.clone()).layer(answer);
        let response = guarded.call(Request::new(Body::empty())).await.unwrap();
        assert_eq!(gate.client_calls.available_permits(), CLIENT_CALLS_MAX - 1);
        drop(response);
        assert_eq!(gate.client_calls.available_permits(), CLIENT_CALLS_MAX);
    }
}
