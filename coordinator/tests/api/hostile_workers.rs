//! A coordinator, and workers that send arbitrary messages.
#![allow(clippy::needless_update, reason = "messages get more fields as the protocol grows")]

use std::{
    net::Ipv4Addr,
    panic,
    sync::atomic::{AtomicUsize, Ordering},
    time::Duration,
};

use coordinator::Coordinator;
use evolution::Distribution;
use experiment_file::ExperimentConfig;
use proptest::{collection::vec, prelude::*, test_runner::TestRunner};
use prost::{
    Message as _,
    bytes::{Buf as _, BufMut as _},
};
use sim_core::{Simulation, TrialSet};
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{
        Draining, Experiment, ExperimentState, GetExperimentRequest, Heartbeat, Hello, ItemFailure,
        ItemResult, ItemResults, SubmitExperimentRequest, TrialFitness, TrialMeasures, WorkRequest,
        WorkResponse, experiment_service_client::ExperimentServiceClient, item_result::Outcome,
        trial_set, work_request, work_response,
    },
};
use tokio::{runtime::Runtime, sync::mpsc};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{
    Code, Request, Status, Streaming,
    client::Grpc,
    codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder},
    transport::{Channel, Endpoint},
};

/// A deadline that only a hanging coordinator misses.
const DEADLINE: Duration = Duration::from_secs(60);
/// More memory than any messages may make the coordinator hold.
const RESIDENT_KB_MAX: u64 = 1 << 20;

static N_PANICS: AtomicUsize = AtomicUsize::new(0);

/// A coordinator in this process; its panics fail the test.
struct Stage {
    coordinator: Coordinator,
    experiments: ExperimentServiceClient<Channel>,
    _data: tempfile::TempDir,
}

impl Stage {
    async fn start() -> Self {
        static HOOK: std::sync::Once = std::sync::Once::new();
        HOOK.call_once(|| {
            let default = panic::take_hook();
            panic::set_hook(Box::new(move |info| {
                if info.location().is_some_and(|at| !at.file().contains("tests/api")) {
                    N_PANICS.fetch_add(1, Ordering::SeqCst);
                }
                default(info);
            }));
        });
        let data = tempfile::tempdir().unwrap();
        let listen = (Ipv4Addr::LOCALHOST, 0).into();
        let config = super::config(listen, data.path().to_owned());
        let coordinator = Coordinator::start(config).await.unwrap();
        let url = format!("http://{}", coordinator.local_addr());
        let experiments = ExperimentServiceClient::connect(url).await.unwrap();
        Self { coordinator, experiments, _data: data }
    }

    async fn submit(&self) -> u64 {
        let mut config: serde_json::Value =
            serde_json::from_str(include_str!("../../../configs/quickstart.json")).unwrap();
        let algorithm = &mut config["algorithm"];
        algorithm["population_size"] = 4.into();
        algorithm["num_evaluations"] = N_TRIALS.into();
        algorithm["champion_trials"] = N_TRIALS.into();
        algorithm["judgement_trials"] = N_TRIALS.into();
        algorithm["generations"] = 2.into();
        let config_json = config.to_string();
        let request = SubmitExperimentRequest { config_json, ..Default::default() };
        let response = self.experiments.clone().submit_experiment(request).await.unwrap();
        response.into_inner().experiment.unwrap().id
    }

    async fn experiment(&self, experiment_id: u64) -> Experiment {
        let request = GetExperimentRequest { experiment_id };
        let response = self.experiments.clone().get_experiment(request).await.unwrap();
        response.into_inner().experiment.unwrap()
    }

    async fn worker(&self) -> RawWorker {
        RawWorker::connect(&format!("http://{}", self.coordinator.local_addr())).await
    }

    /// Lets a correct worker finish the experiment.
    async fn settle(&self, experiment_id: u64) -> ExperimentState {
        let mut worker = self.worker().await;
        // With a unique name, because others may be in quarantine.
        let hello = Hello { name: "honest".to_owned(), ..hello() };
        worker.say(work_request::Message::Hello(hello)).await;
        let working = async {
            let mut inbox = worker.inbox().await.unwrap();
            let (mut simulation, mut distribution) = (None, None);
            while self.experiment(experiment_id).await.state() == ExperimentState::Running {
                let received =
                    tokio::time::timeout(Duration::from_millis(20), inbox.message()).await;
                let Ok(received) = received else { continue };
                let batch = match received.unwrap().unwrap().message {
                    Some(work_response::Message::Spec(spec)) => {
                        let config = ExperimentConfig::from_canonical_json(&spec.config_json);
                        simulation = Some(Simulation::compile(&config.unwrap()).unwrap());
                        continue;
                    }
                    Some(work_response::Message::Distribution(message)) => {
                        distribution = Distribution::from_bytes(&message.distribution).ok();
                        continue;
                    }
                    Some(work_response::Message::Assignments(batch)) => batch,
                    _ => continue,
                };
                let trial_set = match batch.trial_set.unwrap().trial_set.unwrap() {
                    trial_set::TrialSet::Generation(generation) => TrialSet::Generation(generation),
                    trial_set::TrialSet::HeldOut(trials) => TrialSet::HeldOut {
                        generation: trials.generation,
                        block: trials.block.try_into().unwrap(),
                    },
                    trial_set::TrialSet::Judgement(generation) => TrialSet::Judgement(generation),
                    trial_set::TrialSet::Evaluation(_) => TrialSet::Evaluation,
                };
                let simulation = simulation.as_ref().expect("the specification comes first");
                for mut assignment in batch.assignments {
                    if let Some(individual) = assignment.individual {
                        let distribution = distribution.as_ref().expect("it comes first");
                        assignment.genotype = distribution.genotype(individual as usize).unwrap();
                    }
                    let first = assignment.first_trial;
                    let trials = first..first + assignment.trial_count;
                    let values =
                        simulation.evaluate(&assignment.genotype, trial_set, trials).unwrap();
                    worker
                        .result(assignment.assignment_id, Outcome::Fitness(TrialFitness { values }))
                        .await;
                }
            }
        };
        tokio::time::timeout(DEADLINE, working).await.expect("a good worker is served");
        self.experiment(experiment_id).await.state()
    }
}

const N_TRIALS: u32 = 2;

/// A worker that sends bytes.
struct RawWorker {
    outbox: mpsc::Sender<Vec<u8>>,
    opening: tokio::task::JoinHandle<Result<Streaming<WorkResponse>, Status>>,
}

impl RawWorker {
    async fn connect(url: &str) -> Self {
        let channel = Endpoint::from_shared(url.to_owned()).unwrap().connect().await.unwrap();
        let (outbox, requests) = mpsc::channel(64);
        let opening = tokio::spawn(async move {
            let mut client = Grpc::new(channel);
            client.ready().await.unwrap();
            let path = http::uri::PathAndQuery::from_static("/swarm.v1.WorkerService/Work");
            let requests = Request::new(ReceiverStream::new(requests));
            Ok(client.streaming(requests, path, RawCodec).await?.into_inner())
        });
        Self { outbox, opening }
    }

    async fn send(&self, bytes: Vec<u8>) {
        // If the coordinator has ended the stream, that is an answer, too.
        let _ = self.outbox.send(bytes).await;
    }

    async fn say(&self, message: work_request::Message) {
        self.send(WorkRequest { message: Some(message) }.encode_to_vec()).await;
    }

    async fn result(&self, assignment_id: u64, outcome: Outcome) {
        let result = ItemResult { assignment_id, outcome: Some(outcome), compute_us: 1 };
        self.say(work_request::Message::Results(ItemResults { results: vec![result] })).await;
    }

    /// Sends nothing more, and reads until the coordinator has read everything.
    async fn finish(self) {
        let Self { outbox, opening } = self;
        drop(outbox);
        let reading = async {
            if let Ok(mut inbox) = opening.await.unwrap() {
                while let Ok(Some(_)) = inbox.message().await {}
            }
        };
        tokio::time::timeout(DEADLINE, reading).await.expect("the stream ends");
    }

    async fn inbox(&mut self) -> Result<Streaming<WorkResponse>, Status> {
        (&mut self.opening).await.unwrap()
    }
}

/// Sends raw bytes.
#[derive(Clone, Copy)]
struct RawCodec;

impl Codec for RawCodec {
    type Encode = Vec<u8>;
    type Decode = WorkResponse;
    type Encoder = Self;
    type Decoder = Self;

    fn encoder(&mut self) -> Self {
        *self
    }

    fn decoder(&mut self) -> Self {
        *self
    }
}

impl Encoder for RawCodec {
    type Item = Vec<u8>;
    type Error = Status;

    fn encode(&mut self, item: Vec<u8>, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        buffer.put_slice(&item);
        Ok(())
    }
}

impl Decoder for RawCodec {
    type Item = WorkResponse;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<WorkResponse>, Status> {
        let bytes = buffer.copy_to_bytes(buffer.remaining());
        WorkResponse::decode(bytes).map(Some).map_err(|error| Status::internal(error.to_string()))
    }
}

fn hello() -> Hello {
    Hello {
        protocol_version: PROTOCOL_VERSION,
        sim_core_fingerprint: sim_core::FINGERPRINT.to_owned(),
        name: "good".to_owned(),
        slots: 2,
        ..Default::default()
    }
}

fn resident_kb_max() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0 kB");
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

fn assert_unharmed() {
    assert_eq!(N_PANICS.load(Ordering::SeqCst), 0, "something panicked");
    let kb = resident_kb_max();
    assert!(kb < RESIDENT_KB_MAX, "{kb} kB were resident");
}

/// Numbers that arithmetic trips over.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(f64::MAX),
        Just(f64::MIN),
        Just(5e-324),
        Just(-0.0),
        any::<f64>(),
        0.0..1.0,
    ]
}

/// A valid message with arbitrary values. Items are numbered from 1, so a small number probably
/// names an item of the worker.
fn message() -> impl Strategy<Value = work_request::Message> {
    let outcome = prop_oneof![
        4 => vec(number(), N_TRIALS as usize)
            .prop_map(|values| Some(Outcome::Fitness(TrialFitness { values }))),
        1 => vec(number(), 0..40)
            .prop_map(|values| Some(Outcome::Fitness(TrialFitness { values }))),
        1 => vec(number(), 0..40)
            .prop_map(|values| Some(Outcome::Measures(TrialMeasures { values }))),
        1 => any::<String>().prop_map(|message| Some(Outcome::Failure(ItemFailure { message }))),
        1 => Just(None),
    ];
    let assignment_id = prop_oneof![4 => 1..16_u64, 1 => any::<u64>()];
    let result =
        (assignment_id, outcome, any::<u64>()).prop_map(|(assignment_id, outcome, compute_us)| {
            ItemResult { assignment_id, outcome, compute_us }
        });
    prop_oneof![
        8 => vec(result, 0..30)
            .prop_map(|results| work_request::Message::Results(ItemResults { results })),
        2 => Just(work_request::Message::Heartbeat(Heartbeat {})),
        1 => Just(work_request::Message::Draining(Draining {})),
        1 => Just(work_request::Message::Hello(hello())),
    ]
}

/// Bytes of a message, of a damaged message, or arbitrary ones.
fn bytes() -> impl Strategy<Value = Vec<u8>> {
    let message = message().prop_map(|m| WorkRequest { message: Some(m) }.encode_to_vec());
    let damaged = (message, vec((any::<prop::sample::Index>(), any::<u8>()), 0..4), any::<bool>());
    let damaged = damaged.prop_map(|(mut bytes, changes, is_cut)| {
        for (at, byte) in &changes {
            if !bytes.is_empty() {
                let at = at.index(bytes.len());
                bytes[at] = *byte;
            }
        }
        if let (true, Some((at, _))) = (is_cut, changes.first()) {
            bytes.truncate(at.index(bytes.len() + 1));
        }
        bytes
    });
    prop_oneof![
        6 => message_bytes(),
        3 => damaged,
        1 => vec(any::<u8>(), 0..200),
    ]
}

fn message_bytes() -> impl Strategy<Value = Vec<u8>> {
    message().prop_map(|message| WorkRequest { message: Some(message) }.encode_to_vec())
}

fn introduction() -> impl Strategy<Value = Vec<u8>> {
    let name = prop_oneof![Just("bad".to_owned()), any::<String>()];
    let slots = prop_oneof![4 => 1..5_u32, 1 => Just(4096), 1 => any::<u32>()];
    let valid = (name, slots).prop_map(|(name, slots)| {
        let message = work_request::Message::Hello(Hello { name, slots, ..hello() });
        WorkRequest { message: Some(message) }.encode_to_vec()
    });
    prop_oneof![8 => valid, 1 => bytes()]
}

#[test]
fn nothing_that_a_worker_sends_harms_the_coordinator() {
    let runtime = Runtime::new().unwrap();
    let config = ProptestConfig { cases: 32, failure_persistence: None, ..Default::default() };
    let strategy = (introduction(), vec(bytes(), 0..12));
    TestRunner::new(config)
        .run(&strategy, |(introduction, messages)| {
            runtime.block_on(async {
                let stage = Stage::start().await;
                let id = stage.submit().await;
                let worker = stage.worker().await;
                worker.send(introduction).await;
                for message in messages {
                    worker.send(message).await;
                }
                worker.finish().await;
                let state = stage.settle(id).await;
                stage.coordinator.shutdown().await;
                prop_assert_eq!(state, ExperimentState::Completed);
                Ok(())
            })?;
            assert_unharmed();
            Ok(())
        })
        .unwrap();
}

#[tokio::test]
async fn millions_of_empty_results_cost_no_memory() {
    let stage = Stage::start().await;
    let mut worker = stage.worker().await;
    worker.say(work_request::Message::Hello(hello())).await;
    let mut inbox = worker.inbox().await.unwrap();
    inbox.message().await.unwrap();
    // Two bytes each.
    let results = vec![ItemResult::default(); 2_000_000];
    worker.say(work_request::Message::Results(ItemResults { results })).await;
    assert!(inbox.message().await.is_err() || inbox.message().await.unwrap().is_none());
    let id = stage.submit().await;
    assert_eq!(stage.settle(id).await, ExperimentState::Completed);
    assert_unharmed();
}

#[tokio::test]
async fn a_message_that_is_too_large_ends_its_stream_alone() {
    let stage = Stage::start().await;
    let mut worker = stage.worker().await;
    worker.say(work_request::Message::Hello(hello())).await;
    let mut inbox = worker.inbox().await.unwrap();
    inbox.message().await.unwrap();
    worker.send(vec![0; swarm_transport::TO_COORDINATOR_LEN_MAX + 1]).await;
    assert!(inbox.message().await.is_err() || inbox.message().await.unwrap().is_none());
    let id = stage.submit().await;
    assert_eq!(stage.settle(id).await, ExperimentState::Completed);
}

#[tokio::test]
async fn fitness_that_overflows_or_is_not_a_number_is_ranked_last_and_survived() {
    let stage = Stage::start().await;
    let id = stage.submit().await;
    let mut worker = stage.worker().await;
    worker.say(work_request::Message::Hello(hello())).await;
    let mut inbox = worker.inbox().await.unwrap();
    let values = [[f64::NAN, 1.0], [f64::MAX, f64::MAX], [f64::MIN, f64::MAX], [1e300, -1e300]];
    let mut values = values.iter().cycle();
    while stage.experiment(id).await.state() == ExperimentState::Running {
        let received = tokio::time::timeout(Duration::from_millis(20), inbox.message()).await;
        let Ok(received) = received else { continue };
        let message = received.unwrap().unwrap().message.unwrap();
        let work_response::Message::Assignments(batch) = message else { continue };
        for assignment in batch.assignments {
            let values = values.next().unwrap()[..assignment.trial_count as usize].to_vec();
            worker
                .result(assignment.assignment_id, Outcome::Fitness(TrialFitness { values }))
                .await;
        }
    }
    assert_eq!(stage.experiment(id).await.state(), ExperimentState::Completed);
    assert_unharmed();
}

#[tokio::test]
async fn slots_are_within_bounds_and_names_too() {
    let stage = Stage::start().await;
    for (slots, name_len, pattern_len, expected) in [
        (0, 1, 0, Code::InvalidArgument),
        (4097, 1, 0, Code::InvalidArgument),
        (u32::MAX, 1, 0, Code::InvalidArgument),
        (1, 129, 0, Code::InvalidArgument),
        (1, 1, 129, Code::InvalidArgument),
        (4096, 128, 128, Code::Ok),
    ] {
        let (name, experiments) = ("w".repeat(name_len), "*".repeat(pattern_len));
        let mut worker = stage.worker().await;
        worker
            .say(work_request::Message::Hello(Hello { slots, name, experiments, ..hello() }))
            .await;
        let code = worker.inbox().await.map_or_else(|status| status.code(), |_| Code::Ok);
        assert_eq!(code, expected);
    }
}
