//! Randomly damaged scripts: each is refused, fails with its file and line, or computes finite
//! numbers. None panics, hangs or takes unlimited memory.
//!
//! `SWARM_TEST_SCRIPTS` sets their number.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    fs,
    path::{Path, PathBuf},
    sync::mpsc::{RecvTimeoutError, channel},
    thread,
    time::Duration,
};

use determinism::random::{Purpose, Stream, TrialSet};
use experiment_file::{
    ExperimentConfig, FitnessFunction, LightController, ObjectConfig, RobotController,
    ScriptConfig, TaskConfig,
};
use serde_json::json;
use sim_core::{EvaluateError, Simulation};

/// Valid scripts, each with its experiment.
fn scripts() -> Vec<(String, ExperimentConfig)> {
    let tasks = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/tasks");
    let read = |path: &Path| fs::read_to_string(path).unwrap();
    let of_folder =
        |folder: PathBuf| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> =
        of_folder(tasks.clone()).chain(of_folder(tasks.join("thesis"))).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "star"));
    paths.sort();
    let experiment = |path: &Path| {
        let own = path.with_extension("json");
        let file = if own.exists() { own } else { tasks.join("../light_follower_snes.json") };
        let text = read(&file);
        let script = ScriptConfig { name: "hostile.star".into(), text: read(path) };
        let text = match experiment_file::script_path(&text) {
            Some((_, place)) => experiment_file::inline_script(&text, place, &script),
            None => text,
        };
        let (mut config, _) =
            ExperimentConfig::from_json(&text, "hostile", evolution::ALGORITHMS).unwrap();
        config.algorithm.fitness_function = FitnessFunction::Script;
        config.algorithm.evaluation_steps = 5;
        (script.text, config)
    };
    let mut scripts: Vec<_> = paths.iter().map(|path| experiment(path)).collect();
    // Some scripts also act.
    for file in ["light_orbit.star", "light_prey.star"] {
        let (text, mut config) = experiment(&tasks.join("thesis/goto_light.star"));
        let moves = read(&tasks.join("moves").join(file));
        for object in config.world.objects.values_mut() {
            match object {
                ObjectConfig::Robot(robot) => robot.controller = RobotController::ScriptController,
                ObjectConfig::LightSource(light) => {
                    light.controller = LightController::ScriptController {};
                }
                _ => {}
            }
        }
        scripts.push((format!("{text}\n{moves}\n{ACTS}"), config));
    }
    let mut by_hand: Vec<PathBuf> = of_folder(tasks.join("by_hand")).collect();
    by_hand.sort();
    for by_hand in by_hand {
        let (text, mut config) = experiment(&tasks.join(by_hand.file_name().unwrap()));
        for object in config.world.objects.values_mut() {
            if let ObjectConfig::Robot(robot) = object {
                robot.controller = RobotController::ScriptController;
            }
        }
        scripts.push((format!("{text}\n{}", read(&by_hand)), config));
    }
    let (_, config) = experiment(&tasks.join("dispersion.star"));
    scripts.push((PUSHES.to_owned(), with_bodies(&config)));
    scripts
}

/// The same experiment between walls, with movables and obstacles.
fn with_bodies(config: &ExperimentConfig) -> ExperimentConfig {
    let mut file = serde_json::to_value(config).unwrap();
    let world = &mut file["world"];
    (world["boundary"], world["bodies"]) = ("walls".into(), json!({}));
    let uniform = json!({"name": "random_uniform", "params": {"low": 100, "high": 500, "size": 2}});
    for (name, params) in [("movable", json!({"mass": 0.1})), ("obstacle", json!({}))] {
        world["objects"][name] = json!({
            "type": name, "num_instances": 3, "initializers": {"positions": uniform}, "params": params,
        });
    }
    for robot in config.world.objects.keys() {
        world["objects"][robot]["controller"] = "script_controller".into();
    }
    ExperimentConfig::from_json(&file.to_string(), "hostile", evolution::ALGORITHMS).unwrap().0
}

/// Robots that push boxes, which are put elsewhere again.
const PUSHES: &str = "
def control(robot):
    box = robot.world.movables[robot.id % 3]
    robot.left = 1 if robot.bearing(box) < 0 else 0.5
    robot.right = 0 if None in robot.touches else 0.8

def react(world):
    for box in world.movables:
        if box.distance(world.center) < 100 and not world.walls_between(box, world.center):
            world.place(box, (600 * world.random(), 600 * world.random()), box.heading + 1)

def fitness(world):
    return sum([len(robot.touches) + robot.distance(world.movables[0]) for robot in world.robots])
";

/// Robots that turn towards received frames, and fail at random.
const ACTS: &str = "
def control(robot):
    light = robot.sense('light_sensor')
    turn = robot.heard_from / math.pi if robot.heard else robot.random()
    robot.left = min(light[0] + 0.3, 1)
    robot.right = max(min(robot.left + turn, 1), -1)
    robot.mode = 'send' if robot.state.get('n', 0) % 2 else 'relay'
    robot.message = [robot.random(), 0.5]
    robot.state['n'] = robot.state.get('n', 0) + 1

def react(world):
    for robot in world.robots:
        robot.failed = world.random() < 0.1
        robot.carries = not robot.failed
    world.lights[0].on = world.step % 2 == 0
";

/// Number of the first pieces, which are values.
const N_VALUES: usize = 17;
/// The pieces that a mutation inserts.
const PIECES: [&str; 36] = [
    "0",
    "-1",
    "1e308",
    "9223372036854775807",
    "None",
    "''",
    "[]",
    "{}",
    "()",
    "x",
    "world",
    "world.state",
    "robot",
    "math.inf",
    "range(100000)",
    "range(10)",
    "[x for x in range(999)]",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ":",
    "\n",
    "    ",
    " + ",
    " * ",
    " / ",
    " % ",
    " for x in ",
    " if ",
    " in ",
    ".",
    ", ",
    "\"",
];

/// A text with some of its pieces removed, doubled, moved or replaced.
fn mutated(text: &str, stream: &mut Stream) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut pieces: Vec<String> = Vec::new();
    for c in text.chars() {
        match pieces.last_mut() {
            Some(last) if last.ends_with(is_word) && is_word(c) => last.push(c),
            _ => pieces.push(c.to_string()),
        }
    }
    // Replaces a word by another one, which mostly gives another valid script.
    let words: Vec<usize> =
        (0..pieces.len()).filter(|&at| pieces[at].starts_with(is_word)).collect();
    for _ in 0..=stream.below(2) {
        let at = words[stream.below(words.len())];
        pieces[at] = match stream.below(2) {
            0 => pieces[words[stream.below(words.len())]].clone(),
            _ => PIECES[stream.below(N_VALUES)].to_owned(),
        };
    }
    // In one of three texts, an arbitrary mutation follows.
    for _ in 0..stream.below(3).saturating_sub(1) {
        let at = stream.below(pieces.len());
        let other = stream.below(pieces.len());
        match stream.below(4) {
            0 => drop(pieces.remove(at)),
            1 => pieces.insert(at, pieces[other].clone()),
            2 => pieces.swap(at, other),
            _ => pieces.insert(at, PIECES[stream.below(PIECES.len())].to_owned()),
        }
    }
    pieces.concat()
}

/// Longest time of five steps on a busy machine; a script's whole budget for them takes about a
/// second.
const PATIENCE: Duration = Duration::from_secs(120);
/// Largest allowed peak memory of this process, KiB; a script may keep some hundred KiB.
const PEAK_KIB: u64 = 256 << 10;

#[test]
fn damaged_scripts_are_refused_or_fail_with_their_place_or_compute_numbers() {
    let (next, started) = channel();
    let trying = thread::spawn(move || try_damaged_scripts(|text| next.send(text).unwrap()));
    let mut latest = String::new();
    loop {
        match started.recv_timeout(PATIENCE) {
            Ok(text) => latest = text,
            Err(RecvTimeoutError::Timeout) => panic!("this script does not end:\n{latest}"),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    trying.join().unwrap();
    // Not every system reports the peak memory.
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    if let Some(peak) = status.lines().find_map(|line| line.strip_prefix("VmHWM:")) {
        let peak: u64 = peak.trim().trim_end_matches(" kB").parse().unwrap();
        assert!(peak < PEAK_KIB, "{peak} KiB");
    }
}

/// `on_start` is called with each script.
fn try_damaged_scripts(on_start: impl Fn(String)) {
    let n = std::env::var("SWARM_TEST_SCRIPTS").map_or(300, |n| n.parse().unwrap());
    let scripts = scripts();
    let mut stream = Stream::new(1, 0, 0, Purpose::Evolution, 0);
    let (mut n_refused, mut n_failed, mut n_computed) = (0, 0, 0);
    for number in 0..n {
        let (text, config) = &scripts[number % scripts.len()];
        let text = mutated(text, &mut stream);
        on_start(text.clone());
        let mut config = config.clone();
        let script = ScriptConfig { name: "hostile.star".into(), text: text.clone() };
        config.task = Some(TaskConfig { script });
        let simulation = match Simulation::compile(&config) {
            Ok(simulation) => simulation,
            Err(error) => {
                assert!(
                    error.problems.iter().all(|problem| problem.path == "task.script"),
                    "{error}"
                );
                n_refused += 1;
                continue;
            }
        };
        let genotype = vec![0.6; simulation.genotype_len()];
        match simulation.measure_while(&genotype, TrialSet::Generation(0), 0..1, &|| true) {
            Ok(values) => {
                assert!(values.unwrap()[0].is_finite(), "{text}");
                n_computed += 1;
            }
            Err(EvaluateError::Script { error, .. }) => {
                let n_lines = text.lines().count() as u32;
                assert!((1..=n_lines.max(1)).contains(&error.line), "{error}\n{text}");
                assert!(error.message.len() < 1000, "{error}");
                n_failed += 1;
            }
            Err(error) => panic!("{error}\n{text}"),
        }
    }
    // All three outcomes happen, otherwise the mutations are too weak or too strong.
    assert!(
        n_refused > n / 10 && n_failed > n / 50 && n_computed > n / 50,
        "{n_refused} refused, {n_failed} failed, {n_computed} computed"
    );
}
