//! Where experiments are unless somebody says otherwise.

/// Where `run` and a coordinator keep their data unless told otherwise.
pub const DEFAULT_DATA_DIR: &str = "./swarm-data";
/// Where a coordinator listens unless told otherwise.
pub const DEFAULT_LISTEN: ([u8; 4], u16) = ([127, 0, 0, 1], 7700);
/// The coordinator's default address.
pub const DEFAULT_COORDINATOR: &str = "http://127.0.0.1:7700";
