//! Experiments that bring their task as a script, on workers that do not know it.

use std::{fs, process::Command};

use harness::{
    CoordinatorProcess, Experiment, Outcome, WorkerProcess, binary, swarmctl, undisturbed,
    workspace_file,
};
use serde_json::json;

/// The small experiment, with a script beside its file.
fn scripted(generations: u64, script: &str) -> Experiment {
    let experiment = Experiment::small(generations).edit(|experiment| {
        experiment["task"] = json!({"script": "task.star"});
        let algorithm = experiment["algorithm"].as_object_mut().unwrap();
        algorithm.remove("fitness_function");
    });
    fs::write(experiment.path().with_file_name("task.star"), script).unwrap();
    experiment
}

fn leader_selection() -> String {
    let path = workspace_file("configs/tasks/thesis/identify_leader.star");
    fs::read_to_string(path).unwrap()
}

#[test]
fn workers_that_never_saw_a_script_compute_the_same_bits_through_a_kill() {
    let coordinator = CoordinatorProcess::start();
    let mut workers = WorkerProcess::start_many(&coordinator, 4);
    let experiment = scripted(5, &leader_selection());
    let watch = coordinator.watch(coordinator.submit(&experiment.path()));
    coordinator.wait_for_generation(1);
    drop(workers.pop());
    let digests = watch.finish().digests();
    assert_eq!(digests, undisturbed(&experiment), "one worker, in one process");
    // The fitness equals that of the built-in function; only the name of the task differs.
    let best = |experiment: &Experiment| {
        let directory = tempfile::tempdir().unwrap();
        let path = experiment.path();
        let args = ["run", path.to_str().unwrap(), "--generations", "2", "--data-dir"];
        let args = args.into_iter().chain([directory.path().to_str().unwrap()]);
        let lines = swarmctl(args).expect_success().json_lines();
        [lines[0]["best"].clone(), lines[1]["mean"].clone()]
    };
    assert_eq!(best(&experiment), best(&Experiment::small(5)));
}

/// A script that controls robots and lets them fail, and moves a lamp, beside the robots that
/// evolve.
const ACTS: &str = "
def control(robot):
    robot.led = robot.heard != None and robot.heard[0] > robot.random()
    robot.message = [robot.random(), 0.5]
    robot.mode = 'send' if robot.led else 'relay'

def move(lamp):
    return lamp.x + 3 * lamp.normal(), lamp.y + 3

def react(world):
    for robot in world.robots:
        robot.failed = world.random() < 0.1 and robot.distance(world.lights[0]) < 200
    world.lights[0].on = world.step % 50 < 25
";

#[test]
fn a_script_that_acts_gives_the_same_bits_on_one_and_on_four_unlike_workers_through_kills() {
    let script = leader_selection() + ACTS;
    let experiment = scripted(4, &script).edit(|experiment| {
        let objects = experiment["world"]["objects"].as_object_mut().unwrap();
        let mut extras = objects.values().next().unwrap().clone();
        extras["num_instances"] = json!(3);
        extras["controller"] = json!("script_controller");
        extras["perturbations"] = json!({});
        objects.insert("extras".into(), extras);
        let positions = json!({"name": "fixed", "params": {"values": [[500, 500]]}});
        let lamp = json!({
            "type": "light_source", "num_instances": 1, "controller": "script_controller",
            "initializers": {"positions": positions},
        });
        objects.insert("lamp".into(), lamp);
    });
    let mut coordinator = CoordinatorProcess::start();
    // Two workers use the instructions of every processor, two the best of this processor.
    let worker = |i: usize| {
        let isa: &[&str] = if i < 2 { &["--isa", "portable"] } else { &[] };
        WorkerProcess::start_with(&coordinator.url(), &format!("worker-{i}"), isa)
    };
    let mut workers: Vec<_> = (0..4).map(worker).collect();
    let id = coordinator.submit(&experiment.path());
    let watch = coordinator.watch(id);
    coordinator.wait_for_generation(1);
    drop(workers.pop());
    coordinator.wait_for_generation(2);
    coordinator.process.kill();
    coordinator.restart();
    drop(workers.pop());
    assert_eq!(watch.finish().digests(), undisturbed(&experiment), "one worker, in one process");
}

#[test]
fn a_script_that_goes_wrong_fails_its_experiment_and_nothing_else() {
    let coordinator = CoordinatorProcess::start();
    let workers = WorkerProcess::start_many(&coordinator, 2);
    let script = "def fitness(world):\n    return 1 / (world.step - 200)\n";
    let id = coordinator.submit(&scripted(3, script).path());
    let (code, finished) = coordinator.watch(id).end();
    assert_ne!(code, Some(0));
    let error = finished.last["reason"].as_str().unwrap_or_default().to_owned();
    assert!(error.contains("task.star:2: division by zero (in step 200 of"), "{}", finished.last);
    let experiment = Experiment::tiny(2);
    let other = coordinator.watch(coordinator.submit(&experiment.path())).finish();
    assert_eq!(other.digests(), undisturbed(&experiment));
    drop(workers);
}

#[test]
fn mistakes_in_a_script_are_reported_before_anything_is_computed() {
    let script = "def fitness(world):\n    return len(world.robos)\n";
    let experiment = scripted(3, script);
    let path = experiment.path();
    let validated = swarmctl(["validate", path.to_str().unwrap()]);
    let expected = "task.script: task.star:2: no object has a `robos`; did you mean `robots`?";
    assert!(validated.stderr.contains(expected), "{}", validated.stderr);
    assert_eq!(validated.code, Some(2));
    // The script fails in an early step.
    fs::write(path.with_file_name("task.star"), "def fitness(world):\n    return [1][world.step]")
        .unwrap();
    let validated = swarmctl(["validate", path.to_str().unwrap()]);
    assert!(validated.stderr.contains("there is no element 1 in a list of 1"), "{validated:?}");
    fs::remove_file(path.with_file_name("task.star")).unwrap();
    let validated = swarmctl(["validate", path.to_str().unwrap()]);
    assert!(validated.stderr.contains("task.script: cannot be read: "), "{}", validated.stderr);
}

#[test]
fn traces_and_simulations_have_the_measures_of_a_script() {
    let directory = tempfile::tempdir().unwrap();
    let trace = directory.path().join("trace.csv");
    let experiment = workspace_file("configs/tasks/dispersion.json");
    let args = ["simulate", experiment.to_str().unwrap(), "--trace", trace.to_str().unwrap()];
    let simulated = swarmctl(args).expect_success();
    assert!(simulated.stdout.contains("touching"), "{}", simulated.stdout);
    let header = fs::read_to_string(trace).unwrap().lines().next().unwrap().to_owned();
    assert!(header.ends_with(",metric_touching"), "{header}");
}

/// A script that is harmless in the steps in which it is tried. Then it uses its whole budget in
/// every call, so that a trial takes many minutes.
const BURNS: &str = "
def fitness(world):
    if world.step < 60:
        return 1.0
    x = 0
    for i in range(200):
        for j in range(150):
            x = sorted([i, 2, 1])[0] + sum(range(30))
    return x
";

#[test]
fn a_script_that_burns_time_is_ended_by_cancelling_it_and_by_signals() {
    let mut coordinator = CoordinatorProcess::start();
    let mut workers = WorkerProcess::start_many(&coordinator, 2);
    let burning = scripted(3, BURNS).edit(|experiment| {
        experiment["algorithm"]["evaluation_steps"] = json!(100_000);
    });
    let id = coordinator.submit(&burning.path());
    let is_busy = |worker: &serde_json::Value| worker["items_in_flight"].as_u64() > Some(0);
    let wait_until_busy = |coordinator: &CoordinatorProcess| loop {
        let workers = coordinator.swarmctl(&["workers"]).json().as_array().unwrap().clone();
        if !workers.is_empty() && workers.iter().all(is_busy) {
            return;
        }
    };
    wait_until_busy(&coordinator);
    coordinator.swarmctl(&["cancel", &id.to_string()]).expect_success();
    // The workers are free for another experiment.
    let experiment = Experiment::tiny(2);
    let other = coordinator.watch(coordinator.submit(&experiment.path())).finish();
    assert_eq!(other.digests(), undisturbed(&experiment));
    // A worker that is told to stop in the middle of an item does so.
    coordinator.submit(&burning.path());
    wait_until_busy(&coordinator);
    let mut stopped = workers.pop().unwrap();
    stopped.process.signal("TERM");
    assert_eq!(stopped.process.wait().code(), Some(0));
    coordinator.process.signal("TERM");
    assert_eq!(coordinator.process.wait().code(), Some(0));
}

#[test]
fn an_expensive_start_is_tried_for_a_moment_and_accepted_with_a_warning() {
    let coordinator = CoordinatorProcess::start();
    // A call takes nearly its whole budget, in long statements, so trying the first steps takes
    // seconds.
    let sums = vec!["i + j"; 60].join(", ");
    let loops = "for i in range(2000):\n        for j in range(100): x =";
    let script = format!("def fitness(world):\n    {loops} [{sums}]\n    return 1\n");
    let experiment = scripted(3, &script);
    let path = experiment.path();
    let validated = swarmctl(["validate", path.to_str().unwrap()]).expect_success();
    assert!(validated.stdout.contains("its start takes long"), "{}", validated.stdout);
    let mut submit = Command::new(binary("swarmctl"));
    submit.args(["--coordinator", &coordinator.url(), "submit", path.to_str().unwrap()]);
    let submitted = Outcome::of_command(&mut submit).expect_success();
    assert!(submitted.stderr.contains("its start takes long"), "{}", submitted.stderr);
}
