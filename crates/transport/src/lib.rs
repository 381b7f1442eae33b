//! Secure connections between the programs: tokens, TLS, and the limits that both ends of a
//! connection share.
//!
//! A worker or client turns an address and its [`Credentials`] into a [`Link`], which refuses
//! configurations that would reveal a secret. `docs/security.md` has the model.

mod address;
mod backoff;
mod banner;
mod credentials;
mod expiry;
mod link;
pub mod listening;
mod pem;
mod pinned;
mod server_tls;
mod throttle;
mod tls_diagnosis;
mod token;

pub use address::listen_address;
pub use backoff::Backoff;
pub use banner::{Banner, banner};
pub use credentials::{CredentialArgs, CredentialError, Credentials};
pub use expiry::{Expiries, Expiry};
pub use link::{Bearer, Link, LinkError, is_loopback};
pub use pem::{Identity, PemError, certificates};
pub use pinned::{PinError, pinned};
pub use server_tls::server_tls;
pub use throttle::Throttle;
pub use tls_diagnosis::tls_diagnosis;
pub use token::{BEARER, Token, TokenError};

/// Largest message to a coordinator, bytes. An experiment file has at most 1 MiB. A worker sends at
/// most 256 results at once; with 1,000 trials each, they have about 2 MB.
pub const TO_COORDINATOR_LEN_MAX: usize = 8 << 20;
/// Largest message from a coordinator, bytes: networks as JSON and lists of all experiments are
/// long.
pub const FROM_COORDINATOR_LEN_MAX: usize = 64 << 20;
