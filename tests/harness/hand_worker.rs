//! A worker whose messages the test chooses one by one.

use std::collections::BTreeMap;

use evolution::Distribution;
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{
        Assignments, HeldOutTrials, Hello, ItemResult, ItemResults, JobId, TrialFitness,
        WorkRequest, WorkResponse, item_result::Outcome, job_id::Job, trial_set, work_request,
        work_response, worker_service_client::WorkerServiceClient,
    },
};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Status, Streaming};

/// The introduction of a worker that the coordinator accepts.
pub fn hello() -> Hello {
    Hello {
        protocol_version: PROTOCOL_VERSION,
        sim_core_fingerprint: sim_core::FINGERPRINT.to_owned(),
        name: "by hand".to_owned(),
        slots: 1,
        ..Hello::default()
    }
}

/// The number of an experiment. Panics if the job is not an experiment.
pub fn experiment_of(job: Option<JobId>) -> u64 {
    match job.and_then(|job| job.job) {
        Some(Job::Experiment(id)) => id,
        other => panic!("no experiment: {other:?}"),
    }
}

/// The experiment and the trial set of assignments. Panics if their job is not an experiment.
pub fn trial_set_of(assignments: &Assignments) -> (u64, sim_core::TrialSet) {
    let trial_set = match assignments.trial_set.and_then(|set| set.trial_set) {
        Some(trial_set::TrialSet::Generation(generation)) => {
            sim_core::TrialSet::Generation(generation)
        }
        Some(trial_set::TrialSet::HeldOut(HeldOutTrials { generation, block })) => {
            let block = block.try_into().expect("there are few blocks");
            sim_core::TrialSet::HeldOut { generation, block }
        }
        Some(trial_set::TrialSet::Judgement(generation)) => {
            sim_core::TrialSet::Judgement(generation)
        }
        other => panic!("no trial set of an experiment: {other:?}"),
    };
    (experiment_of(assignments.job), trial_set)
}

/// The stream of a worker. It sends nothing by itself, not even heartbeats.
#[derive(Debug)]
pub struct HandWorker {
    outbox: mpsc::Sender<WorkRequest>,
    inbox: Streaming<WorkResponse>,
    /// The latest distribution of each experiment.
    distributions: BTreeMap<u64, Distribution>,
}

impl HandWorker {
    /// Connects and sends `Hello`.
    pub async fn connect(url: &str, hello: Hello) -> Result<Self, Status> {
        let client = WorkerServiceClient::connect(url.to_owned()).await;
        let mut client = client.map_err(|error| Status::unavailable(error.to_string()))?;
        let (outbox, requests) = mpsc::channel(16);
        let message = Some(work_request::Message::Hello(hello));
        outbox.try_send(WorkRequest { message }).expect("a new channel has room");
        let inbox = client.work(ReceiverStream::new(requests)).await?.into_inner();
        Ok(Self { outbox, inbox, distributions: BTreeMap::new() })
    }

    /// The next message. Assignments contain all genotypes, including those that the worker draws
    /// itself.
    pub async fn receive(&mut self) -> Result<work_response::Message, Status> {
        let response = self.inbox.message().await?;
        let response = response.ok_or_else(|| Status::unavailable("the stream has ended"))?;
        let mut message = response.message.expect("known kind");
        match &mut message {
            work_response::Message::Distribution(sent) => {
                let read = Distribution::from_bytes(&sent.distribution).expect("of this version");
                self.distributions.insert(experiment_of(sent.job), read);
            }
            work_response::Message::Assignments(Assignments { job, assignments, .. }) => {
                for assignment in assignments {
                    let Some(individual) = assignment.individual else { continue };
                    let distribution = &self.distributions[&experiment_of(*job)];
                    let drawn = distribution.genotype(individual as usize);
                    assignment.genotype = drawn.expect("there is such an individual");
                }
            }
            _ => {}
        }
        Ok(message)
    }

    /// The next assignments.
    pub async fn receive_assignments(&mut self) -> Result<Assignments, Status> {
        loop {
            if let work_response::Message::Assignments(assignments) = self.receive().await? {
                return Ok(assignments);
            }
        }
    }

    /// The status with which the coordinator ends the stream.
    pub async fn receive_end(&mut self) -> Status {
        loop {
            if let Err(status) = self.receive().await {
                return status;
            }
        }
    }

    /// Sends any message.
    pub async fn say(&self, message: work_request::Message) {
        // If the stream has ended, `receive` reports it.
        let _ = self.outbox.send(WorkRequest { message: Some(message) }).await;
    }

    /// Closes its side of the stream after all messages, and waits for the coordinator to close
    /// the other side.
    pub async fn hang_up(self) {
        let Self { outbox, mut inbox, .. } = self;
        drop(outbox);
        while let Ok(Some(_)) = inbox.message().await {}
    }

    /// Answers an assignment.
    pub async fn answer(&self, assignment_id: u64, outcome: Outcome) {
        let result = ItemResult { assignment_id, outcome: Some(outcome), compute_us: 1 };
        self.say(work_request::Message::Results(ItemResults { results: vec![result] })).await;
    }

    /// Answers an assignment with fitness.
    pub async fn answer_fitness(&self, assignment_id: u64, values: Vec<f64>) {
        self.answer(assignment_id, Outcome::Fitness(TrialFitness { values })).await;
    }
}
