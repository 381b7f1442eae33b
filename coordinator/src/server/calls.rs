//! Counts the calls of all services, by method and status.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex, PoisonError},
};

use http::{HeaderMap, Request};
use prost::Message as _;
use prost_types::FileDescriptorSet;
use tonic::{Code, Status, body::Body};

use super::call_layer::{Guard, Watch};

/// Stands for a method that no service has, because callers choose their paths.
const UNKNOWN: &str = "unknown";

/// The calls that have ended.
#[derive(Debug, Clone)]
pub struct Calls {
    /// Paths of all methods, without the first slash.
    methods: Arc<BTreeSet<String>>,
    ended: Arc<Mutex<BTreeMap<(String, &'static str), u64>>>,
}

/// A call that has not ended.
pub struct Call {
    calls: Calls,
    method: String,
    /// The answered status; `None` if the call is abandoned before.
    code: Option<Code>,
}

impl Default for Calls {
    fn default() -> Self {
        let files = [
            swarm_proto::FILE_DESCRIPTOR_SET,
            tonic_health::pb::FILE_DESCRIPTOR_SET,
            tonic_reflection::pb::v1::FILE_DESCRIPTOR_SET,
            tonic_reflection::pb::v1alpha::FILE_DESCRIPTOR_SET,
        ];
        Self {
            methods: Arc::new(files.into_iter().flat_map(methods).collect()),
            ended: Arc::default(),
        }
    }
}

impl Calls {
    /// Ended calls by method (`package.Service/Method`) and status code (`OK`).
    pub fn ended(&self) -> BTreeMap<(String, &'static str), u64> {
        self.ended.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Guard for Calls {
    type Call = Call;

    fn begin(&self, request: &mut Request<Body>) -> Result<Call, Status> {
        let path = request.uri().path();
        let method = path.strip_prefix('/').filter(|path| self.methods.contains(*path));
        let method = method.unwrap_or(UNKNOWN).to_owned();
        Ok(Call { calls: self.clone(), method, code: None })
    }
}

impl Watch for Call {
    /// Reads the status, which is in the trailers, or in the headers of an answer
    /// without content.
    fn on_headers(&mut self, headers: &HeaderMap) {
        if let Some(code) = headers.get(Status::GRPC_STATUS) {
            self.code = Some(Code::from_bytes(code.as_bytes()));
        }
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        let key = (std::mem::take(&mut self.method), name(self.code.unwrap_or(Code::Cancelled)));
        let mut ended = self.calls.ended.lock().unwrap_or_else(PoisonError::into_inner);
        *ended.entry(key).or_default() += 1;
    }
}

/// The methods of all services of encoded descriptors.
fn methods(descriptors: &[u8]) -> Vec<String> {
    let files =
        FileDescriptorSet::decode(descriptors).expect("the descriptors come from the build");
    let mut methods = Vec::new();
    for file in &files.file {
        for service in &file.service {
            for method in &service.method {
                methods.push(format!("{}.{}/{}", file.package(), service.name(), method.name()));
            }
        }
    }
    methods
}

/// A status code as the gRPC specification writes it.
fn name(code: Code) -> &'static str {
    match code {
        Code::Ok => "OK",
        Code::Cancelled => "CANCELLED",
        Code::Unknown => "UNKNOWN",
        Code::InvalidArgument => "INVALID_ARGUMENT",
        Code::DeadlineExceeded => "DEADLINE_EXCEEDED",
        Code::NotFound => "NOT_FOUND",
        Code::AlreadyExists => "ALREADY_EXISTS",
        Code::PermissionDenied => "PERMISSION_DENIED",
        Code::ResourceExhausted => "RESOURCE_EXHAUSTED",
        Code::FailedPrecondition => "FAILED_PRECONDITION",
        Code::Aborted => "ABORTED",
        Code::OutOfRange => "OUT_OF_RANGE",
        Code::Unimplemented => "UNIMPLEMENTED",
        Code::Internal => "INTERNAL",
        Code::Unavailable => "UNAVAILABLE",
        Code::DataLoss => "DATA_LOSS",
        Code::Unauthenticated => "UNAUTHENTICATED",
    }
}

#[cfg(test)]
mod tests {
    use std::{convert::Infallible, future::ready};

    use http::Response;
    use http_body_util::Full;
    use tower::{Layer as _, Service as _, service_fn};

    use super::*;
    use crate::server::call_layer::CallLayer;

    /// Calls a method that answers with a status in the headers, or without a status.
    async fn call(calls: &Calls, path: &str, code: Option<Code>) -> Response<Body> {
        let request = Request::builder().uri(path).body(Body::empty()).unwrap();
        let answer = service_fn(|_: Request<Body>| {
            ready(Ok::<_, Infallible>(match code {
                Some(code) => Status::new(code, "").into_http(),
                None => Response::new(Body::new(Full::from("content"))),
            }))
        });
        CallLayer(calls.clone()).layer(answer).call(request).await.unwrap()
    }

    #[tokio::test]
    async fn calls_are_counted_by_method_and_code() {
        let calls = Calls::default();
        let list = "/swarm.v1.ExperimentService/ListExperiments";
        drop(call(&calls, list, Some(Code::Ok)).await);
        drop(call(&calls, list, Some(Code::Unauthenticated)).await);
        drop(call(&calls, list, Some(Code::Unauthenticated)).await);
        drop(call(&calls, "/grpc.health.v1.Health/Check", Some(Code::NotFound)).await);
        let reflections = ["v1", "v1alpha"]
            .map(|name| format!("grpc.reflection.{name}.ServerReflection/ServerReflectionInfo"));
        for path in &reflections {
            drop(call(&calls, &format!("/{path}"), Some(Code::Ok)).await);
        }
        for path in ["/", "/swarm.v1.ExperimentService/Other", "/a/b"] {
            drop(call(&calls, path, Some(Code::Unimplemented)).await);
        }
        let [v1, v1alpha] = reflections;
        let expected = [
            ((v1, "OK"), 1),
            ((v1alpha, "OK"), 1),
            (("grpc.health.v1.Health/Check".to_owned(), "NOT_FOUND"), 1),
            ((list[1..].to_owned(), "OK"), 1),
            ((list[1..].to_owned(), "UNAUTHENTICATED"), 2),
            (("unknown".to_owned(), "UNIMPLEMENTED"), 3),
        ];
        assert_eq!(calls.ended(), BTreeMap::from(expected));
    }

    #[tokio::test]
    async fn a_call_that_is_given_up_counts_as_cancelled_and_not_before() {
        let calls = Calls::default();
        let answer = call(&calls, "/swarm.v1.WorkerService/Work", None).await;
        assert!(calls.ended().is_empty());
        drop(answer);
        let key = ("swarm.v1.WorkerService/Work".to_owned(), "CANCELLED");
        assert_eq!(calls.ended(), BTreeMap::from([(key, 1)]));
    }
}
