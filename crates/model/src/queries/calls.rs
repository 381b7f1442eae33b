//! The list of calls that only read, and the calls that read rows: experiments, generations and
//! events, page by page.

use swarm_proto::v1::{
    self, CompletedGeneration, GetExperimentRequest, GetExperimentResponse, ListEventsRequest,
    ListEventsResponse, ListExperimentsRequest, ListExperimentsResponse, ListGenerationsRequest,
    ListGenerationsResponse,
};
use tonic::Status;

use crate::{
    ids::ExperimentId,
    labels::LABELS_MAX,
    limits::PAGE_LEN_MAX,
    store::{ExperimentState, Filter, GenerationRecord},
};

use super::{Reader, experiment};

/// Passes all reading calls of `ExperimentService` to a macro, before its other arguments. Each
/// is a method of [`Reader`], from request to response.
#[macro_export]
macro_rules! reading_calls {
    ($then:ident $($rest:tt)*) => {
        $then! {
            reads {
                get_experiment(GetExperimentRequest) -> GetExperimentResponse;
                list_experiments(ListExperimentsRequest) -> ListExperimentsResponse;
                list_generations(ListGenerationsRequest) -> ListGenerationsResponse;
                list_events(ListEventsRequest) -> ListEventsResponse;
                get_champion(GetChampionRequest) -> GetChampionResponse;
                get_individuals(GetIndividualsRequest) -> GetIndividualsResponse;
                get_lineage(GetLineageRequest) -> GetLineageResponse;
                get_repertoire(GetRepertoireRequest) -> GetRepertoireResponse;
                get_front(GetFrontRequest) -> GetFrontResponse;
                list_dynamics(ListDynamicsRequest) -> ListDynamicsResponse;
            }
            $($rest)*
        }
    };
}

impl Reader {
    /// One experiment, with its file in canonical form.
    pub async fn get_experiment(
        &self,
        request: GetExperimentRequest,
    ) -> Result<GetExperimentResponse, Status> {
        let id = ExperimentId(request.experiment_id);
        Ok(self.read(move |store| experiment(store, id)).await?.into())
    }

    /// The experiments that pass a client's filters, oldest first.
    pub async fn list_experiments(
        &self,
        request: ListExperimentsRequest,
    ) -> Result<ListExperimentsResponse, Status> {
        let filter = filter(request)?;
        let found = self.read(move |store| Ok(store.experiments(&filter)?)).await?;
        Ok(ListExperimentsResponse { experiments: found.into_iter().map(Into::into).collect() })
    }

    /// Completed generations, oldest first.
    pub async fn list_generations(
        &self,
        request: ListGenerationsRequest,
    ) -> Result<ListGenerationsResponse, Status> {
        let ListGenerationsRequest { experiment_id, from_generation, page_size } = request;
        let (id, len) = (ExperimentId(experiment_id), page_len(page_size));
        let read = self.read(move |store| {
            experiment(store, id)?;
            Ok(store.generations(id, from_generation, len + 1)?)
        });
        let (generations, next) = split(read.await?, len);
        let completed = |(completed_at_ms, generation): (u64, GenerationRecord)| {
            CompletedGeneration { summary: Some(generation.into()), completed_at_ms }
        };
        Ok(ListGenerationsResponse {
            generations: generations.into_iter().map(completed).collect(),
            next_generation: next.map(|(_, generation)| generation.generation),
        })
    }

    /// Events, oldest first.
    pub async fn list_events(
        &self,
        request: ListEventsRequest,
    ) -> Result<ListEventsResponse, Status> {
        let ListEventsRequest { experiment_id, from_sequence, page_size } = request;
        let (id, len) = (ExperimentId(experiment_id), page_len(page_size));
        let read = self.read(move |store| {
            experiment(store, id)?;
            Ok(store.events(id, from_sequence, len + 1)?)
        });
        let (events, next) = split(read.await?, len);
        Ok(ListEventsResponse {
            events: events.into_iter().map(Into::into).collect(),
            next_sequence: next.map(|event| event.sequence),
        })
    }
}

/// The filters of a client; INVALID_ARGUMENT for an unknown state, and for more labels than an
/// experiment has. Each state and each label takes time and a variable of SQL.
fn filter(request: ListExperimentsRequest) -> Result<Filter, Status> {
    let mut states: Vec<ExperimentState> = Vec::new();
    for &number in &request.states {
        let state = v1::ExperimentState::try_from(number)
            .map_err(|_| Status::invalid_argument(format!("no experiment is in state {number}")))?;
        let state: ExperimentState = state.try_into()?;
        if !states.contains(&state) {
            states.push(state);
        }
    }
    let ListExperimentsRequest {
        named,
        labels,
        without_archived,
        config_digest,
        after,
        page_size,
        ..
    } = request;
    if labels.len() > LABELS_MAX {
        return Err(Status::invalid_argument(format!(
            "an experiment has at most {LABELS_MAX} labels, so a list cannot want {}",
            labels.len()
        )));
    }
    let some = |text: String| (!text.is_empty()).then_some(text);
    let label = |label: String| match label.split_once('=') {
        Some((key, value)) => (key.to_owned(), Some(value.to_owned())),
        None => (label, None),
    };
    Ok(Filter {
        named: some(named),
        states,
        labels: labels.into_iter().map(label).collect(),
        without_archived,
        config_digest: some(config_digest),
        after,
        limit: (page_size > 0).then_some(page_size),
    })
}

/// Length of a page; 0 requests the largest.
fn page_len(page_size: u32) -> u32 {
    if page_size == 0 { PAGE_LEN_MAX } else { page_size.min(PAGE_LEN_MAX) }
}

/// Splits items into a page and the first item after it, if there is one.
fn split<T>(mut items: Vec<T>, page_len: u32) -> (Vec<T>, Option<T>) {
    let rest = items.split_off((page_len as usize).min(items.len()));
    (items, rest.into_iter().next())
}
