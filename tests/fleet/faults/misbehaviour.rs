//! Workers that violate the protocol, or die of their items.

use std::{
    collections::BTreeMap,
    io::{Read as _, Write as _},
    net::TcpStream,
    sync::{Arc, OnceLock},
};

use experiment_file::ExperimentConfig;
use harness::{
    CoordinatorProcess, Experiment, HandWorker, WorkerProcess, experiment_of, hello, trial_set_of,
    undisturbed,
};
use sim_core::TrialSet;
use swarm_proto::v1::{
    Assignment, Draining, Heartbeat, Hello, ItemResult, ItemResults, JobSpec,
    SubmitExperimentRequest, TrialFitness, WorkRequest, WorkResponse, item_result::Outcome,
    work_request::Message, work_response, worker_service_client::WorkerServiceClient,
};
use tonic::{Code, Request, codegen::http::uri::PathAndQuery, transport::Endpoint};
use tonic_prost::ProstCodec;

use super::{OTHER, TINY, n_lost};

/// Enough generations for each intruder to find work.
const GENERATIONS: u64 = 6;

/// A worker in the middle of an experiment, with items.
struct Intruder {
    worker: HandWorker,
    experiment: sim_core::Simulation,
    trial_set: TrialSet,
    assignments: Vec<Assignment>,
}

impl Intruder {
    async fn join(url: &str, name: &str) -> Self {
        let hello = Hello { name: name.to_owned(), ..hello() };
        let mut worker = HandWorker::connect(url, hello).await.unwrap();
        let experiment = loop {
            if let work_response::Message::Spec(spec) = worker.receive().await.unwrap() {
                break compile(&spec);
            }
        };
        let batch = worker.receive_assignments().await.unwrap();
        let (_, trial_set) = trial_set_of(&batch);
        Self { worker, experiment, trial_set, assignments: batch.assignments }
    }

    /// The true fitness of its first item.
    fn honest_fitness(&self) -> Vec<f64> {
        evaluate(&self.experiment, self.trial_set, &self.assignments[0])
    }

    /// Computes honestly until its generation is complete, and leaves.
    async fn complete_generation(mut self, coordinator: &CoordinatorProcess, name: &str) {
        let mut assignments = std::mem::take(&mut self.assignments);
        loop {
            for assignment in &assignments {
                let values = evaluate(&self.experiment, self.trial_set, assignment);
                self.worker.answer_fitness(assignment.assignment_id, values).await;
            }
            let batch = self.worker.receive_assignments().await.unwrap();
            if trial_set_of(&batch).1 != self.trial_set {
                return self.leave(coordinator, name).await;
            }
            assignments = batch.assignments;
        }
    }

    /// Leaves without harm, after the coordinator has read all its messages.
    async fn leave(self, coordinator: &CoordinatorProcess, name: &str) {
        self.worker.say(Message::Draining(Draining {})).await;
        self.worker.hang_up().await;
        coordinator.process.wait_for("end of the worker's stream", |line| {
            line["message"] == "worker left" && line["name"] == name
        });
    }
}

fn compile(spec: &JobSpec) -> sim_core::Simulation {
    let (config, _) =
        ExperimentConfig::from_json(&spec.config_json, "", evolution::ALGORITHMS).unwrap();
    sim_core::Simulation::compile(&config).unwrap()
}

fn evaluate(
    experiment: &sim_core::Simulation,
    trial_set: TrialSet,
    assignment: &Assignment,
) -> Vec<f64> {
    let trials = assignment.first_trial..assignment.first_trial + assignment.trial_count;
    experiment.evaluate(&assignment.genotype, trial_set, trials).unwrap()
}

fn fitness(assignment_id: u64, values: Vec<f64>) -> ItemResult {
    let outcome = Some(Outcome::Fitness(TrialFitness { values }));
    ItemResult { assignment_id, outcome, compute_us: u64::MAX }
}

/// Waits until a worker is lost; returns why.
fn reason_of_loss(coordinator: &CoordinatorProcess, name: &str) -> String {
    let lost = coordinator
        .process
        .wait_for("loss", |line| line["message"] == "worker lost" && line["name"] == name);
    lost["reason"].as_str().unwrap().to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn nonsense_from_one_worker_does_not_reach_the_work_of_another() {
    let coordinator = CoordinatorProcess::start();
    let url = coordinator.url();
    let experiment = Experiment::tiny(GENERATIONS);
    let id = coordinator.submit(&experiment.path());

    // Results of wrong sizes, with any values. There is no second worker: it might get copies of
    // the items, and the coordinator would recall the items before the answer.
    let wrong: [fn(usize) -> Vec<f64>; 4] = [
        |_| vec![],
        |n_trials| vec![f64::NAN; n_trials + 1],
        |n_trials| vec![1e300; n_trials + 2],
        |_| vec![f64::INFINITY; 100_000],
    ];
    for (case, wrong) in wrong.into_iter().enumerate() {
        let name = format!("sizes-{case}");
        let intruder = Intruder::join(&url, &name).await;
        let (assignment_id, n_trials) =
            (intruder.assignments[0].assignment_id, intruder.assignments[0].trial_count);
        let values = wrong(n_trials as usize);
        let expected = format!("{} values for {n_trials} trials", values.len());
        intruder.worker.answer_fitness(assignment_id, values).await;
        let faulty = coordinator
            .process
            .wait_for("quarantine", |line| line["level"] == "ERROR" && line["name"] == *name);
        let reason = faulty["reason"].as_str().unwrap();
        assert!(reason.contains(&expected), "{reason}, not {expected}");
        intruder.leave(&coordinator, &name).await;
        let name = format!("honest-{case}");
        Intruder::join(&url, &name).await.complete_generation(&coordinator, &name).await;
    }

    // Results for all items except its own.
    let intruder = Intruder::join(&url, "greedy").await;
    let own: Vec<u64> =
        intruder.assignments.iter().map(|assignment| assignment.assignment_id).collect();
    let others = (0..own[0] + 100).chain([u64::MAX]).filter(|id| !own.contains(id));
    let results = others.map(|id| fitness(id, vec![f64::NAN; 2])).collect();
    intruder.worker.say(Message::Results(ItemResults { results })).await;
    intruder.leave(&coordinator, "greedy").await;

    // The same result twice, the second time with another value, and once more.
    let intruder = Intruder::join(&url, "repetitive").await;
    let (first, right) = (intruder.assignments[0].assignment_id, intruder.honest_fitness());
    let wrong: Vec<f64> = right.iter().map(|fitness| fitness + 1.0).collect();
    let results = vec![fitness(first, right), fitness(first, wrong.clone())];
    intruder.worker.say(Message::Results(ItemResults { results })).await;
    intruder.worker.answer_fitness(first, wrong).await;
    intruder.leave(&coordinator, "repetitive").await;

    // Messages out of order.
    let intruder = Intruder::join(&url, "polite").await;
    intruder.worker.say(Message::Hello(hello())).await;
    assert_eq!(reason_of_loss(&coordinator, "polite"), "it said Hello twice");

    let _honest = WorkerProcess::start(&coordinator, "honest");
    let (code, finished) = coordinator.watch(id).end();
    assert_eq!(code, Some(0), "{}", finished.last);
    assert_eq!(finished.digests(), undisturbed(&experiment));
}

#[tokio::test(flavor = "multi_thread")]
async fn streams_that_are_not_the_protocol_are_ended_and_the_others_go_on() {
    let coordinator = CoordinatorProcess::start();
    let url = coordinator.url();
    let id = TINY.submit(&coordinator);

    // Bytes that are not gRPC. The HTTP/2 server says goodbye and closes.
    let mut raw = TcpStream::connect(coordinator.address()).unwrap();
    raw.write_all(&[0x5a; 4096]).unwrap();
    let mut answer = Vec::new();
    let _ = raw.read_to_end(&mut answer);

    // A wrong message: text instead of an introduction.
    let channel = Endpoint::from_shared(url.clone()).unwrap().connect().await.unwrap();
    let mut client = tonic::client::Grpc::new(channel);
    client.ready().await.unwrap();
    let garbage = SubmitExperimentRequest { request_id: "hello?".to_owned(), ..Default::default() };
    let codec = ProstCodec::<SubmitExperimentRequest, WorkResponse>::default();
    let path = PathAndQuery::from_static("/swarm.v1.WorkerService/Work");
    let request = Request::new(tokio_stream::iter([garbage]));
    let status = client.streaming(request, path, codec).await.unwrap_err();
    assert_eq!(status.code(), Code::Internal, "{status}");

    // A first message that is not an introduction.
    let mut client = WorkerServiceClient::connect(url.clone()).await.unwrap();
    let message = Some(Message::Heartbeat(Heartbeat {}));
    let status = client.work(tokio_stream::iter([WorkRequest { message }])).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument);

    // A message that is too long. Its worker's items go to others.
    let mut intruder = Intruder::join(&url, "talkative").await;
    let values = vec![0.0; 3 << 20];
    intruder.worker.answer_fitness(intruder.assignments[0].assignment_id, values).await;
    intruder.worker.receive_end().await;
    assert!(reason_of_loss(&coordinator, "talkative").contains("its stream broke"));

    let _honest = WorkerProcess::start(&coordinator, "honest");
    TINY.assert_undisturbed(coordinator.watch(id));
}

/// The second generation of the first experiment.
const POISONED: (u64, TrialSet) = (1, TrialSet::Generation(1));

/// Runs a worker that computes honestly, and dies at the first genotype of [`POISONED`].
async fn die_of(poison: Arc<OnceLock<Vec<f64>>>, url: String, name: String) {
    loop {
        let hello = Hello { name: name.clone(), ..hello() };
        let Ok(mut worker) = HandWorker::connect(&url, hello).await else { return };
        serve_until_poisoned(&mut worker, &poison).await;
        // The coordinator reads its earlier messages, so only the deadly item is to blame.
        worker.hang_up().await;
    }
}

async fn serve_until_poisoned(worker: &mut HandWorker, poison: &OnceLock<Vec<f64>>) {
    let mut experiments = BTreeMap::new();
    while let Ok(message) = worker.receive().await {
        let batch = match message {
            work_response::Message::Spec(spec) => {
                experiments.insert(experiment_of(spec.job), compile(&spec));
                continue;
            }
            work_response::Message::Assignments(batch) => batch,
            _ => continue,
        };
        let (experiment, trial_set) = trial_set_of(&batch);
        for assignment in &batch.assignments {
            if (experiment, trial_set) == POISONED
                && *poison.get_or_init(|| assignment.genotype.clone()) == assignment.genotype
            {
                return;
            }
            let values = evaluate(&experiments[&experiment], trial_set, assignment);
            worker.answer_fitness(assignment.assignment_id, values).await;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_genotype_that_takes_every_worker_down_is_computed_by_the_coordinator() {
    let coordinator = CoordinatorProcess::start();
    let poisoned = TINY.submit(&coordinator);
    assert_eq!(poisoned, POISONED.0);
    let sound = OTHER.submit(&coordinator);
    let poison = Arc::new(OnceLock::new());
    for i in 0..3 {
        let name = format!("mortal-{i}");
        tokio::spawn(die_of(Arc::clone(&poison), coordinator.url(), name));
    }
    OTHER.assert_undisturbed(coordinator.watch(sound));
    // The genotype does no harm to the coordinator's own process.
    TINY.assert_undisturbed(coordinator.watch(poisoned));
    let n_lost = n_lost(&coordinator);
    // Each of two trials may be an item of its own. The referee computes an item at its third
    // loss at the latest; losses of copies within one second count once.
    assert!((2..=2 * 3 * 3).contains(&n_lost), "{n_lost} workers were lost");
}
