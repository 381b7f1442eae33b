//! The services on a data directory for code that is not asynchronous: calls by their names.

use std::path::Path;

use http::uri::PathAndQuery;
use swarm_proto::v1::experiment_service_server;
use swarm_transport::FROM_COORDINATOR_LEN_MAX;
use tokio::runtime::{Builder, Runtime};
use tokio_util::bytes::{Buf as _, BufMut as _};
use tonic::{
    Request, Status,
    client::Grpc,
    codec::{BufferSettings, Codec, DecodeBuf, Decoder, EncodeBuf, Encoder},
};

use super::{InProcess, StartError};

/// The experiments in a data directory, which are only read. A coordinator may use it meanwhile.
#[derive(Debug)]
pub struct BlockingReader {
    /// Dropped before the runtime that its tasks are on.
    services: InProcess,
    runtime: Runtime,
}

impl BlockingReader {
    /// Opens the database in a directory.
    pub fn open(data_dir: &Path) -> Result<Self, StartError> {
        let runtime = Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(StartError::Runtime)?;
        let services = runtime.block_on(InProcess::read(data_dir))?;
        Ok(Self { services, runtime })
    }

    /// A call of `ExperimentService` with one answer: request and response as they travel.
    pub fn call(&self, name: &str, request: Vec<u8>) -> Result<Vec<u8>, Status> {
        let unknown = || Status::unimplemented(format!("there is no call `{name}`"));
        let path = format!("/{}/{name}", experiment_service_server::SERVICE_NAME);
        let path = PathAndQuery::try_from(path).map_err(|_| unknown())?;
        self.runtime.block_on(async {
            let mut client = Grpc::new(self.services.door().channel(None))
                .max_decoding_message_size(FROM_COORDINATOR_LEN_MAX);
            client.ready().await.map_err(|error| Status::internal(error.to_string()))?;
            let answer = client.unary(Request::new(request), path, Bytes).await;
            answer.map(tonic::Response::into_inner)
        })
    }
}

/// Messages as they travel.
#[derive(Debug, Clone, Copy)]
struct Bytes;

impl Codec for Bytes {
    type Encode = Vec<u8>;
    type Decode = Vec<u8>;
    type Encoder = Self;
    type Decoder = Self;

    fn encoder(&mut self) -> Self {
        Self
    }

    fn decoder(&mut self) -> Self {
        Self
    }
}

impl Encoder for Bytes {
    type Item = Vec<u8>;
    type Error = Status;

    fn encode(&mut self, message: Vec<u8>, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        buffer.put_slice(&message);
        Ok(())
    }

    fn buffer_settings(&self) -> BufferSettings {
        BufferSettings::default()
    }
}

impl Decoder for Bytes {
    type Item = Vec<u8>;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<Vec<u8>>, Status> {
        let mut message = vec![0; buffer.remaining()];
        buffer.copy_to_slice(&mut message);
        Ok(Some(message))
    }
}
