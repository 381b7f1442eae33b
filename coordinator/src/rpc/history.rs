//! What has happened to an experiment, page by page.

use swarm_proto::v1::{
    ListEventsRequest, ListEventsResponse, ListGenerationsRequest, ListGenerationsResponse,
};
use tonic::Status;

use crate::{ids::ExperimentId, limits::PAGE_LEN_MAX, shared_store::SharedStore};

use super::{convert, store_status};

/// Reads one page of completed generations.
pub async fn list_generations(
    store: &SharedStore,
    id: ExperimentId,
    request: ListGenerationsRequest,
) -> Result<ListGenerationsResponse, Status> {
    let page_len = page_len(request.page_size);
    let mut generations = store
        .read(move |store| store.generations(id, request.from_generation, page_len + 1))
        .await
        .map_err(store_status)?;
    let next = generations.split_off((page_len as usize).min(generations.len()));
    Ok(ListGenerationsResponse {
        generations: generations.into_iter().map(convert::completed_generation).collect(),
        next_generation: next.first().map(|(_, generation)| generation.generation),
    })
}

/// Reads one page of events.
pub async fn list_events(
    store: &SharedStore,
    id: ExperimentId,
    request: ListEventsRequest,
) -> Result<ListEventsResponse, Status> {
    let page_len = page_len(request.page_size);
    let mut events = store
        .read(move |store| store.events(id, request.from_sequence, page_len + 1))
        .await
        .map_err(store_status)?;
    let next = events.split_off((page_len as usize).min(events.len()));
    Ok(ListEventsResponse {
        events: events.into_iter().map(convert::event).collect(),
        next_sequence: next.first().map(|event| event.sequence),
    })
}

fn page_len(wanted: u32) -> u32 {
    if wanted == 0 { PAGE_LEN_MAX } else { wanted.min(PAGE_LEN_MAX) }
}
