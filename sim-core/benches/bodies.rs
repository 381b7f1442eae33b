//! Measures worlds with bodies, whole episodes of a small neural controller with 8 rays, beside
//! Chipmunk (`pymunk.py`) stepping the same scenes.
//!
//! The two take turns, so that a machine that slows down slows both; figures are medians of
//! processor time, which a busy machine does not stretch. `PYMUNK_PYTHON` names a Python that has
//! pymunk; without one, only the first columns are measured. An argument names the scenes:
//! `PYMUNK_PYTHON=python3 cargo bench -p sim-core --bench bodies -- box`.
#![allow(clippy::disallowed_methods, reason = "a benchmark starts another program")]

use std::hint::black_box;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use determinism::random::{Purpose, Stream};
use experiment_file::ExperimentConfig;
use serde_json::{Value, json};
use sim_core::Simulation;

/// Number of rounds, of which the median counts.
const N_ROUNDS: usize = 9;
/// Processor time of one measurement, s.
const MEASUREMENT: f64 = 0.1;
/// Trials of a genotype, side by side as in the experiments.
const N_TRIALS: u32 = 5;
/// Environment steps of an episode.
const N_STEPS: u32 = 300;

/// A room, the same as in `pymunk.py`.
struct Scene {
    name: &'static str,
    n_robots: u32,
    n_obstacles: u32,
    n_boxes: u32,
    /// Side of the square room, cm.
    side: f64,
}

const SCENES: [Scene; 4] = [
    Scene { name: "obstacles", n_robots: 10, n_obstacles: 4, n_boxes: 0, side: 300.0 },
    Scene { name: "box", n_robots: 10, n_obstacles: 0, n_boxes: 1, side: 300.0 },
    Scene { name: "thousand", n_robots: 1_000, n_obstacles: 4, n_boxes: 0, side: 3_000.0 },
    Scene { name: "forest", n_robots: 1_000, n_obstacles: 400, n_boxes: 0, side: 3_000.0 },
];

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    println!("processor time, us per robot and step of 4 substeps");
    println!(
        "{:12} {:>10} {:>12} {:>14} {:>14} {:>14}",
        "", "all", "no rays", "Chipmunk", "its loop", "Chipmunk/all"
    );
    for scene in SCENES {
        if wanted.is_empty() || wanted.iter().any(|name| scene.name.contains(name.as_str())) {
            measure(&scene);
        }
    }
}

fn measure(scene: &Scene) {
    let mut own = Evaluations::new(scene, true);
    let mut without = Evaluations::new(scene, false);
    let mut chipmunk = Chipmunk::start(scene);
    let mut samples = [const { Vec::new() }; 4];
    for _ in 0..N_ROUNDS {
        let [alone, with_loop] = chipmunk.as_mut().map_or([f64::NAN; 2], Chipmunk::seconds);
        let seconds = [own.seconds(), without.seconds(), alone, with_loop];
        for (samples, seconds) in samples.iter_mut().zip(seconds) {
            samples.push(seconds * 1e6);
        }
    }
    let [all, without, alone, with_loop] = samples.map(|mut samples| {
        samples.sort_by(f64::total_cmp);
        samples[samples.len() / 2]
    });
    println!(
        "{:12} {all:10.2} {without:12.2} {alone:14.2} {with_loop:14.2} {:13.1}x",
        scene.name,
        alone / all
    );
}

/// Evaluations of several random genotypes, one after the other.
struct Evaluations {
    simulation: Simulation,
    genotypes: Vec<Vec<f64>>,
    robot_steps: f64,
    turn: usize,
}

impl Evaluations {
    /// `has_rays`: the network sees along 8 rays, or else a light.
    fn new(scene: &Scene, has_rays: bool) -> Self {
        let text = experiment(scene, has_rays).to_string();
        let config = ExperimentConfig::from_json(&text, "bench", evolution::ALGORITHMS);
        let (config, _) = config.expect("the experiment is valid");
        let simulation = Simulation::compile(&config).expect("the room holds its robots");
        let genotypes = (0..8).map(|seed| {
            let mut stream = Stream::new(seed, 0, 0, Purpose::Evolution, 0);
            (0..simulation.genotype_len()).map(|_| stream.uniform()).collect()
        });
        Self {
            genotypes: genotypes.collect(),
            simulation,
            robot_steps: f64::from(scene.n_robots * N_STEPS * N_TRIALS),
            turn: 0,
        }
    }

    /// Processor time per robot and step.
    fn seconds(&mut self) -> f64 {
        let start = processor_time();
        let mut n = 0.0;
        loop {
            self.turn += 1;
            let genotype = &self.genotypes[self.turn % self.genotypes.len()];
            let fitness = self.simulation.evaluate(genotype, 0, 0..N_TRIALS);
            black_box(fitness.expect("it is valid"));
            n += 1.0;
            let taken = processor_time() - start;
            if taken > MEASUREMENT {
                return taken / (n * self.robot_steps);
            }
        }
    }
}

/// Seconds that the processor has spent on this thread.
fn processor_time() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("this is Linux");
    let nanoseconds = text.split(' ').next().and_then(|number| number.parse().ok());
    nanoseconds.map(|number: f64| number * 1e-9).expect("the first number is the time")
}

/// A Python that steps a scene whenever it is asked to.
struct Chipmunk {
    child: Child,
    ask: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Chipmunk {
    fn start(scene: &Scene) -> Option<Self> {
        let python = std::env::var("PYMUNK_PYTHON").ok()?;
        let Scene { n_robots, n_obstacles, n_boxes, side, .. } = scene;
        let mut child = Command::new(python)
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/benches/pymunk.py"))
            .args([n_robots, n_obstacles, n_boxes].map(u32::to_string))
            .args([side.to_string(), MEASUREMENT.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("PYMUNK_PYTHON starts");
        let ask = child.stdin.take().expect("it is piped");
        let answers = BufReader::new(child.stdout.take().expect("it is piped"));
        Some(Self { child, ask, answers })
    }

    /// Processor time per robot and step, of Chipmunk alone and with the loop in Python.
    fn seconds(&mut self) -> [f64; 2] {
        writeln!(self.ask).expect("pymunk.py listens");
        let mut answer = String::new();
        self.answers.read_line(&mut answer).expect("pymunk.py answers");
        let mut numbers = answer.split_whitespace().map(|n| n.parse().expect("two numbers"));
        [0, 1].map(|_| numbers.next().expect("two numbers"))
    }
}

impl Drop for Chipmunk {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn experiment(scene: &Scene, has_rays: bool) -> Value {
    let &Scene { n_robots, n_obstacles, n_boxes, side, .. } = scene;
    let anywhere = |margin: f64| {
        json!({"positions": {"name": "random_uniform", "params": {"low": margin, "high": side - margin}},
               "orientations": {"name": "random_uniform"}})
    };
    let mut sensors = json!({"light_sensor": {}});
    if has_rays {
        sensors["proximity_sensor"] = json!({"n_rays": 8, "range": 20});
    }
    let stimulus = if has_rays {
        json!({"n": 8, "sensor": "proximity_sensor"})
    } else {
        json!({"n": 6, "sensor": "light_sensor"})
    };
    let mut objects = json!({
        "robot": {
            "type": "robot", "num_instances": n_robots, "controller": "neural_controller",
            "sensors": sensors, "actuators": {"wheel_actuator": {}}, "initializers": anywhere(4.0),
        },
    });
    // The fitness function wants one.
    objects["lamp"] = json!({
        "type": "light_source", "num_instances": 1, "params": {"range": 400},
        "initializers": {"positions": {"name": "fixed", "params": {"values": [[10, 10]]}}},
    });
    if n_obstacles > 0 {
        objects["post"] = json!({
            "type": "obstacle", "num_instances": n_obstacles, "params": {"radius": 10},
            "initializers": anywhere(30.0),
        });
    }
    if n_boxes > 0 {
        objects["box"] = json!({
            "type": "movable", "num_instances": n_boxes,
            "params": {
                "corners": [[-10, -10], [10, -10], [10, 10], [-10, 10]],
                "mass": 0.1, "friction": 0.1,
            },
            "initializers": anywhere(100.0),
        });
    }
    json!({
        "seed": 1,
        "topology": {
            "stimuli": {"near": stimulus},
            "ensembles": {"OUT": {"n": 2, "activation": "tanh"}},
            "synapses": {"in": {"pre": ["near"], "post": ["OUT"]}},
            "outputs": {"wheels": {"ensemble": "OUT", "actuator": "wheel_actuator"}},
            "decoding": {"wheels": {"scheme": "IdentityDecoding"}},
        },
        "algorithm": {
            "name": "SNES", "evolvable_object": "robot", "fitness_function": "goto_light",
            "population_size": 10, "generations": 1, "evaluation_steps": N_STEPS,
            "num_evaluations": N_TRIALS,
            "populations": {
                "all": {
                    "objects": ["synapses:weights:all", "neurons:bias:all"],
                    "min_vals": -3, "max_vals": 3,
                },
            },
        },
        "world": {
            "width": side, "height": side, "boundary": "walls", "bodies": {}, "objects": objects,
        },
    })
}
