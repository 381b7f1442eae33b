//! The requests of clients, one function each.

use swarm_proto::v1::{
    CompletedGeneration, EvaluateFitnessRequest, EvaluateRequest, EvaluateResponse, Event,
    Experiment, ExportExperimentRequest, GenerationDynamics, GetChampionRequest,
    GetChampionResponse, ImportExperimentRequest, ListDynamicsRequest, ListEventsRequest,
    ListGenerationsRequest, SubmitExperimentRequest, SubmitExperimentResponse,
    WatchExperimentRequest, WatchExperimentResponse, WatchExplanationRequest,
    WatchExplanationResponse, WatchNewsRequest, WatchNewsResponse,
};
use tonic::{Response, Status, Streaming};

use super::{Connection, PATIENCE_WHILE_FOLLOWING, present};
use crate::{error::Error, interrupt, waiting};

/// Bytes of a bundle in one message.
const PIECE_LEN: usize = 1 << 20;
/// Number of events per request.
const EVENT_PAGE_LEN: u32 = 100;

impl Connection {
    /// Starts an experiment, or returns the experiment of the same request id.
    pub async fn submit(
        &self,
        request: SubmitExperimentRequest,
    ) -> Result<SubmitExperimentResponse, Error> {
        interrupt::changing(match self.data_dir() {
            None => "submitted experiments continue on the coordinator".to_owned(),
            Some(_) => format!("`{}` shows what was submitted", self.command(&["list"])),
        });
        self.call(async |client| client.submit_experiment(request.clone()).await).await
    }

    /// One experiment.
    pub async fn experiment(&self, experiment_id: u64) -> Result<Experiment, Error> {
        Ok(self.stored(experiment_id).await?.0)
    }

    /// The measures of a genotype, as a stream; not repeated.
    pub async fn evaluate(
        &self,
        request: EvaluateRequest,
    ) -> Result<Streaming<EvaluateResponse>, Status> {
        self.evaluations.clone().evaluate(request).await.map(Response::into_inner)
    }

    /// The best genotype so far; [`Error::NotFound`] if there is none.
    pub async fn champion(&self, experiment_id: u64) -> Result<GetChampionResponse, Error> {
        let request = GetChampionRequest { experiment_id };
        self.call(async |client| client.get_champion(request).await).await
    }

    /// All completed generations.
    pub async fn generations(&self, experiment_id: u64) -> Result<Vec<CompletedGeneration>, Error> {
        let mut generations = Vec::new();
        let mut next_generation = Some(0);
        while let Some(from_generation) = next_generation {
            let request = ListGenerationsRequest { experiment_id, from_generation, page_size: 0 };
            let page = self.call(async |client| client.list_generations(request).await).await;
            let page = page.map_err(|error| error.about(experiment_id))?;
            generations.extend(page.generations);
            next_generation = page.next_generation;
        }
        Ok(generations)
    }

    /// The movement of evolution in all completed generations; for a fork, in its own
    /// generations.
    pub async fn dynamics(&self, experiment_id: u64) -> Result<Vec<GenerationDynamics>, Error> {
        let mut generations = Vec::new();
        let mut next = Some(0);
        while let Some(from_generation) = next {
            let request = ListDynamicsRequest { experiment_id, from_generation };
            let page = self.call(async |client| client.list_dynamics(request).await).await;
            let page = page.map_err(|error| error.about(experiment_id))?;
            generations.extend(page.generations);
            next = page.next_generation;
        }
        Ok(generations)
    }

    /// Some of an experiment's past events, from a sequence number on.
    pub async fn events_page(
        &self,
        experiment_id: u64,
        from_sequence: u64,
    ) -> Result<Vec<Event>, Error> {
        let page_size = EVENT_PAGE_LEN;
        let request = ListEventsRequest { experiment_id, from_sequence, page_size };
        let page = self.call(async |client| client.list_events(request).await).await;
        let page = page.map_err(|error| error.about(experiment_id))?;
        Ok(page.events)
    }

    /// An experiment's events from a sequence number on, past and future; not repeated.
    pub async fn events(
        &self,
        experiment_id: u64,
        from_sequence: u64,
    ) -> Result<Streaming<WatchExperimentResponse>, Status> {
        let request = WatchExperimentRequest { experiment_id, from_sequence };
        self.client.clone().watch_experiment(request).await.map(Response::into_inner)
    }

    /// The explanation of an experiment, at once and at every change; not repeated.
    pub async fn explanations(
        &self,
        experiment_id: u64,
    ) -> Result<Streaming<WatchExplanationResponse>, Status> {
        let request = WatchExplanationRequest { experiment_id };
        self.client.clone().watch_explanation(request).await.map(Response::into_inner)
    }

    /// A message at once, and whenever any experiment may have new events; not repeated.
    pub async fn news(&self) -> Result<Streaming<WatchNewsResponse>, Status> {
        let request = WatchNewsRequest {};
        self.client.clone().watch_news(request).await.map(Response::into_inner)
    }

    /// An ended experiment as a bundle; not repeated.
    pub async fn export(&self, experiment_id: u64) -> Result<Vec<u8>, Error> {
        let bundle = async {
            let request = ExportExperimentRequest { experiment_id };
            let mut pieces = self.patient().export_experiment(request).await?.into_inner();
            let mut bytes = Vec::new();
            while let Some(answer) = pieces.message().await? {
                bytes.extend(answer.piece);
            }
            Ok::<_, Status>(bytes)
        };
        match waiting::aloud(async || Some(self.waits(None)), bundle).await {
            Ok(bytes) => Ok(bytes),
            Err(status) => Err(self.diagnose(self.error(&status)).await.about(experiment_id)),
        }
    }

    /// Imports a bundle; not repeated. Returns the experiment, and whether the coordinator did
    /// not have it before.
    pub async fn import(&self, bundle: &[u8]) -> Result<(Experiment, bool), Error> {
        let remains = "the experiment may be imported; a second import changes nothing";
        interrupt::changing(remains.to_owned());
        let pieces = bundle.chunks(PIECE_LEN).map(<[u8]>::to_vec).collect::<Vec<_>>();
        let requests = pieces.into_iter().map(|piece| ImportExperimentRequest { piece });
        let imported = async {
            let answer = self.patient().import_experiment(tokio_stream::iter(requests)).await?;
            Ok::<_, Status>(answer.into_inner())
        };
        match waiting::aloud(async || Some(self.waits(None)), imported).await {
            Ok(answer) => Ok((present(answer.experiment)?, answer.is_new)),
            Err(status) => Err(self.diagnose(self.error(&status)).await),
        }
    }

    /// The fitness of genotypes in trials of an evolution, without a time limit.
    /// `otherwise`: the alternative without a fleet.
    pub async fn fitness(
        &self,
        request: EvaluateFitnessRequest,
        otherwise: &str,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let evaluations = self.way.evaluations(&self.way.patient_channel());
        let answer = self
            .with_patience(PATIENCE_WHILE_FOLLOWING)
            .retry(
                async || evaluations.clone().evaluate_fitness(request.clone()).await,
                async || waiting::fleet(self, otherwise).await,
            )
            .await?;
        Ok(answer.fitness.into_iter().map(|of| of.values).collect())
    }
}
