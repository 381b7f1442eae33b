//! Bounds on the stored data of experiments, on one answer about them, and on a worker's items,
//! including those that clients and workers check, too.

use std::time::Duration;

/// Time for which workers must have had a round's last items before the round counts as waiting
/// for them.
pub const BARRIER_AFTER: Duration = Duration::from_secs(10);
/// Number of generations that are recomputed at the same time for pages, which share the
/// processor with the coordinator.
pub const RECONSTRUCTIONS_OF_PAGES_MAX: usize = 1;
/// Bytes of genes and fitness in one answer with individuals of a generation.
pub const INDIVIDUALS_LEN_MAX: usize = 8 << 20;
/// Generations in one answer about the dynamics of evolution.
pub const DYNAMICS_PAGE_LEN_MAX: u64 = 100;
/// Generations that are repeated for one answer with parents and children.
pub const FAMILIES_PAGE_LEN_MAX: u64 = 100;
/// An answer with this number of children or more gets no further generation.
pub const CHILDREN_MAX: usize = 50_000;
/// Genes of all individuals in the generations of one lineage; a byte each.
pub const LINEAGE_GENES_MAX: u64 = 256 << 20;
/// Ancestors in one answer.
pub const ANCESTORS_MAX: usize = 100_000;
/// Bytes of a client's reason for a pause, and of a worker's texts about itself and its failures.
/// Longer texts of a worker are cut.
pub const TEXT_LEN_MAX: usize = 512;
/// Bytes of `request_id` and `default_name`.
pub const KEY_LEN_MAX: usize = 128;
/// Generations or events in one answer.
pub const PAGE_LEN_MAX: u32 = 1000;
/// Experiments that may be unfinished at the same time.
pub const UNFINISHED_MAX: usize = 1000;
/// Most items per slot that a worker has, in progress or waiting. A worker fails items that its
/// queue of this size cannot hold, so workers with a smaller value need a new protocol version.
pub const ITEMS_PER_SLOT_MAX: usize = 64;
/// Most numbers of an evaluation, 16 MiB: trials x steps x measures of the task, or the fitness and
/// descriptors of genotypes in trials.
pub const EVALUATION_VALUES_MAX: usize = 1 << 21;
