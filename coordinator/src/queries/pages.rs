//! What has happened to an experiment, page by page.

use crate::{
    ids::ExperimentId,
    limits::PAGE_LEN_MAX,
    store::{Event, GenerationRecord, Store},
};

use super::{QueryError, experiment};

/// A part of a list.
#[derive(Debug)]
pub struct Page<T> {
    /// At most as many as were asked for.
    pub items: Vec<T>,
    /// The first item after them, if there is one.
    pub next: Option<T>,
}

/// Completed generations from `from_generation` on, oldest first, and when each was
/// completed, in milliseconds since 1970 UTC. `page_len`: 0 for as many as possible.
pub fn generations(
    store: &Store,
    id: ExperimentId,
    from_generation: u64,
    page_len: u32,
) -> Result<Page<(u64, GenerationRecord)>, QueryError> {
    experiment(store, id)?;
    let page_len = bounded(page_len);
    Ok(page(store.generations(id, from_generation, page_len + 1)?, page_len))
}

/// Events from `from_sequence` on, oldest first. `page_len`: 0 for as many as
/// possible.
pub fn events(
    store: &Store,
    id: ExperimentId,
    from_sequence: u64,
    page_len: u32,
) -> Result<Page<Event>, QueryError> {
    experiment(store, id)?;
    let page_len = bounded(page_len);
    Ok(page(store.events(id, from_sequence, page_len + 1)?, page_len))
}

fn bounded(page_len: u32) -> u32 {
    if page_len == 0 { PAGE_LEN_MAX } else { page_len.min(PAGE_LEN_MAX) }
}

fn page<T>(mut items: Vec<T>, page_len: u32) -> Page<T> {
    let rest = items.split_off((page_len as usize).min(items.len()));
    Page { items, next: rest.into_iter().next() }
}
