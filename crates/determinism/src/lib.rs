//! Numbers with the same bits on every machine.
//!
//! - [`random`]: random streams, each addressed by its purpose;
//! - [`normal`]: quantiles of the normal distribution;
//! - [`Isa`]: the vector instructions of a computation. They change its speed, but no bit of its
//!   results;
//! - [`simd`]: what these instructions compute, the same bits at every level.
//!
//! A stream's values depend on its address alone, not on the reader or the time of reading:
//!
//! ```
//! use determinism::random::{Purpose, Stream};
//!
//! // Seed 7, generation 1, trial 2, purpose, robot 3.
//! let mut stream = Stream::new(7, 1_u64, 2, Purpose::Reception, 3);
//! assert_eq!(stream.uniform(), 0.20192406347197278);
//!
//! let mut again = Stream::new(7, 1_u64, 2, Purpose::Reception, 3);
//! again.skip(1);
//! assert_eq!(again.normal(), stream.normal());
//!
//! let mut of_another_robot = Stream::new(7, 1_u64, 2, Purpose::Reception, 4);
//! assert_ne!(of_another_robot.uniform(), 0.20192406347197278);
//! ```

mod isa;
pub mod normal;
pub mod random;
pub mod simd;

pub use isa::{Isa, UnknownIsa};
