//! The wire protocol: code generated from `swarm/v1/*.proto`, and the limits that coordinator and
//! worker enforce.

/// Package `swarm.v1`.
// Generated code keeps its own style.
#[allow(missing_docs, unused_qualifications, clippy::all)]
pub mod v1 {
    tonic::include_proto!("swarm.v1");
}

/// Version of the worker protocol, as `worker.proto` says. Coordinator and worker must
/// agree.
pub const PROTOCOL_VERSION: u32 = v1::ProtocolVersion::Current as u32;

/// Largest number of slots of a worker.
pub const SLOTS_MAX: u32 = 4096;

/// Largest length of a worker's name, and of its version, in bytes.
pub const WORKER_NAME_LEN_MAX: usize = 128;

/// The encoded descriptors of the package, for gRPC reflection.
pub const FILE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/swarm.v1.bin"));
