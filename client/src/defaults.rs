//! Default places of experiments.

/// The default data directory of `run` and of a coordinator.
pub const DEFAULT_DATA_DIR: &str = "./swarm-data";
/// The address on which a coordinator listens by default.
pub const DEFAULT_LISTEN: ([u8; 4], u16) = ([127, 0, 0, 1], 7700);
/// The coordinator's default address.
pub const DEFAULT_COORDINATOR: &str = "http://127.0.0.1:7700";
