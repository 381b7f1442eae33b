//! The gRPC server: all services, behind the gate and the limits for every call.

use std::io;

use http::{Request, Response};
use swarm_proto::{
    FILE_DESCRIPTOR_SET,
    v1::{
        evaluation_service_server::EvaluationServiceServer,
        experiment_service_server::ExperimentServiceServer,
        fleet_service_server::FleetServiceServer, worker_service_server::WorkerServiceServer,
    },
};
use swarm_transport::{FROM_COORDINATOR_LEN_MAX, TO_COORDINATOR_LEN_MAX};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio_stream::Stream;
use tokio_util::sync::CancellationToken;
use tonic::{
    body::Body,
    transport::{Error, Server, server::Connected},
};
use tonic_health::{
    pb::health_server::{Health, HealthServer},
    server::health_reporter,
};

use tonic_reflection::pb::{
    v1::server_reflection_server as v1, v1alpha::server_reflection_server as v1alpha,
};

use tower::util::{MapRequestLayer, MapResponseLayer};

use super::{call_layer::CallLayer, calls::Calls, gate::Gate, intake::Intake, outflow::Outflow};
use crate::{
    limits::{CALLS_PER_CONNECTION_MAX, HEADERS_LEN_MAX, KEEPALIVE, WINDOW_LEN},
    rpc::{Evaluations, Experiments, Fleet, WorkerOutflow, Workers},
};

/// All services of the coordinator.
pub struct Services {
    pub workers: Workers,
    pub fleet: Fleet,
    pub experiments: Experiments,
    pub evaluations: Evaluations,
    pub room: Room,
}

/// Room for long messages and answers, shared by all connections to the services.
#[derive(Debug, Clone, Default)]
pub struct Room {
    intake: Intake,
    outflow: Outflow,
    pub to_workers: WorkerOutflow,
}

/// A service with limits on the length of messages.
macro_rules! limited {
    ($server:ident, $service:expr) => {
        $server::new($service)
            .max_decoding_message_size(TO_COORDINATOR_LEN_MAX)
            .max_encoding_message_size(FROM_COORDINATOR_LEN_MAX)
    };
}

/// A server with limits on connections and headers; TLS is the caller's.
pub fn builder() -> Server {
    Server::builder()
        .http2_keepalive_interval(Some(KEEPALIVE))
        .http2_keepalive_timeout(Some(KEEPALIVE))
        .http2_max_header_list_size(HEADERS_LEN_MAX)
        .max_concurrent_streams(CALLS_PER_CONNECTION_MAX)
        .initial_stream_window_size(WINDOW_LEN)
        .initial_connection_window_size(WINDOW_LEN)
}

impl Services {
    /// Serves until shutdown. It counts every call, and passes it through the gate; long messages
    /// and answers wait for room.
    pub async fn serve<IO>(
        self,
        server: Server,
        connections: impl Stream<Item = io::Result<IO>> + Send + 'static,
        calls: Calls,
        gate: Gate,
        shutdown: CancellationToken,
    ) -> Result<(), Error>
    where
        IO: AsyncRead + AsyncWrite + Connected + Unpin + Send + 'static,
        IO::ConnectInfo: Clone + Send + Sync + 'static,
    {
        let Self { workers, fleet, experiments, evaluations, room } = self;
        let Room { intake, outflow, .. } = room;
        let (reflection_v1, reflection_v1alpha) = reflection();
        server
            .layer(CallLayer(calls))
            .layer(CallLayer(gate))
            .layer(MapRequestLayer::new(move |request: Request<Body>| {
                request.map(|body| intake.wrap(body))
            }))
            .layer(MapResponseLayer::new(move |response: Response<Body>| {
                response.map(|body| outflow.wrap(body))
            }))
            .add_service(health().await)
            .add_service(reflection_v1)
            .add_service(reflection_v1alpha)
            .add_service(limited!(WorkerServiceServer, workers))
            .add_service(limited!(FleetServiceServer, fleet))
            .add_service(limited!(ExperimentServiceServer, experiments))
            .add_service(limited!(EvaluationServiceServer, evaluations))
            .serve_with_incoming_shutdown(connections, shutdown.cancelled_owned())
            .await
    }
}

/// The health service, which reports every service as serving.
async fn health() -> HealthServer<impl Health> {
    let (reporter, health) = health_reporter();
    reporter.set_serving::<EvaluationServiceServer<Evaluations>>().await;
    reporter.set_serving::<ExperimentServiceServer<Experiments>>().await;
    reporter.set_serving::<FleetServiceServer<Fleet>>().await;
    reporter.set_serving::<WorkerServiceServer<Workers>>().await;
    health
}

/// Describes the services, also under the former name of reflection, which Evans and older
/// grpcurl request.
fn reflection() -> (
    v1::ServerReflectionServer<impl v1::ServerReflection>,
    v1alpha::ServerReflectionServer<impl v1alpha::ServerReflection>,
) {
    const VALID: &str = "the descriptors come from the build";
    let builder = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(FILE_DESCRIPTOR_SET)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    (builder().build_v1().expect(VALID), builder().build_v1alpha().expect(VALID))
}
