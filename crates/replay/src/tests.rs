//! The player receives the values of the simulation.

use std::{fs, io::Read as _};

use flate2::read::GzDecoder;
use serde_json::Value;

use experiment_file::ObjectConfig;

use super::*;

/// The quickstart, cut to 40 steps.
fn quickstart() -> ExperimentConfig {
    let text =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/quickstart.json"));
    let text = text.unwrap().replace("\"evaluation_steps\": 100", "\"evaluation_steps\": 40");
    ExperimentConfig::from_json(&text, "", evolution::ALGORITHMS).unwrap().0
}

/// Header and body of a packed episode, read as the player does.
fn unpack(packed: &[u8]) -> (Value, Vec<u8>) {
    let mut all = Vec::new();
    GzDecoder::new(packed).read_to_end(&mut all).unwrap();
    let len = u32::from_le_bytes(all[..4].try_into().unwrap()) as usize;
    let header = serde_json::from_slice(&all[4..4 + len]).unwrap();
    (header, all.split_off(4 + len))
}

/// The values of a column, `[row][step]`.
fn values(header: &Value, body: &[u8], name: &str) -> Vec<f64> {
    let columns = header["columns"].as_array().unwrap();
    let column = columns.iter().find(|column| column["name"] == name).unwrap();
    let steps = header["steps"].as_u64().unwrap() as usize;
    let n = column["n_rows"].as_u64().unwrap() as usize * steps;
    let bytes = &body[column["offset"].as_u64().unwrap() as usize..];
    let scale = column["scale"].as_f64().unwrap();
    let raw: Vec<f64> = match column["type"].as_str().unwrap() {
        "i8" => bytes[..n].iter().map(|&byte| byte.cast_signed().into()).collect(),
        "i16" => bytes[..2 * n]
            .chunks(2)
            .map(|two| i16::from_le_bytes(two.try_into().unwrap()).into())
            .collect(),
        "i32" => bytes[..4 * n]
            .chunks(4)
            .map(|four| i32::from_le_bytes(four.try_into().unwrap()).into())
            .collect(),
        _ => bytes[..4 * n]
            .chunks(4)
            .map(|four| f32::from_le_bytes(four.try_into().unwrap()).into())
            .collect(),
    };
    let mut sums = raw;
    if column["is_difference"] == true {
        for row in sums.chunks_mut(steps) {
            for step in 1..steps {
                row[step] += row[step - 1];
            }
        }
    }
    sums.into_iter().map(|value| value * scale).collect()
}

#[test]
fn a_replay_has_every_step_of_every_robot_as_it_is_simulated() {
    let config = quickstart();
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = vec![0.6; simulation.genotype_len()];
    let episode = Episode {
        config: &config,
        simulation: &simulation,
        genotype: &genotype,
        name: "test",
        trial_set: TrialSet::Generation(3),
        trial: 1,
    };
    let (header, body) = unpack(&Replay::simulate(&episode).unwrap().encode());
    let mut steps = Vec::new();
    let summary =
        simulation.simulate(&genotype, 3, 1, &mut |step| steps.push(step.clone())).unwrap();
    assert_eq!(header["fitness"].as_f64().unwrap().to_bits(), summary.fitness.to_bits());
    assert_eq!((steps.len(), steps[0].robots.len()), (40, 5));
    let column = |name: &str| values(&header, &body, name);
    let near = |a: f64, b: f64, tolerance: f64| {
        assert!((a - b).abs() <= tolerance + 1e-9, "{a} is not {b}");
    };
    let [x, heading, emitter, heard, stimuli, neurons, measures] =
        ["x", "heading", "emitter", "heard", "stimuli", "neurons", "measures"].map(column);
    let n_stimuli = steps[0].robots[0].stimuli.len();
    let mut n_heard = 0;
    for (step, record) in steps.iter().enumerate() {
        for (index, robot) in record.robots.iter().enumerate() {
            near(x[index * 40 + step], robot.position.x, 0.005);
            near(heading[index * 40 + step], robot.heading, 0.0005);
            let from = robot.received.map_or(-1.0, |frame| frame.emitter as f64);
            near(emitter[index * 40 + step], from, 0.0);
            n_heard += usize::from(robot.received.is_some());
            near(heard[(index * 2 + 1) * 40 + step], robot.received_message[1], 0.005);
            let row = (index * n_stimuli + 2) * 40 + step;
            near(stimuli[row], robot.stimuli[2], 0.005);
            near(neurons[(index * 24 + 23) * 40 + step], robot.activity[23], 0.005);
        }
        let one_leader = record.measures["one_leader"];
        let row = header["measure_names"].as_array().unwrap();
        let row = row.iter().position(|name| name == "one_leader").unwrap();
        near(measures[row * 40 + step], one_leader, 1e-6);
    }
    assert!(n_heard > 0);
}

/// The first trial of an evaluation.
fn evaluated<'a>(
    config: &'a ExperimentConfig,
    simulation: &'a Simulation,
    genotype: &'a [f64],
) -> Episode<'a> {
    let (trial_set, name) = (TrialSet::Evaluation, "");
    Episode { config, simulation, genotype, name, trial_set, trial: 0 }
}

#[test]
fn an_episode_too_large_for_a_browser_is_refused() {
    let mut config = quickstart();
    config.algorithm.evaluation_steps = 100_000;
    if let Some(ObjectConfig::Robot(robot)) = config.world.objects.get_mut("robot") {
        robot.num_instances = 20;
    }
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = vec![0.5; simulation.genotype_len()];
    let episode = evaluated(&config, &simulation, &genotype);
    let error = Replay::simulate(&episode).unwrap_err().to_string();
    assert!(error.ends_with("simulate fewer steps or robots"), "{error}");
}

#[test]
fn a_replay_shows_robots_that_carry_something_or_have_failed() {
    let config = quickstart();
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = vec![0.6; simulation.genotype_len()];
    let episode = evaluated(&config, &simulation, &genotype);
    let scene = Scene::new(&episode).unwrap();
    let mut columns = Columns::new(&scene);
    let simulated = simulation.simulate(&genotype, episode.trial_set, 0, &mut |step| {
        let mut step = step.clone();
        // Values that a script could set.
        step.robots[1].carries = step.step == 7;
        step.robots[3].failed = step.step >= 39;
        columns.record(&scene, &step);
    });
    let replay = Replay { scene, summary: simulated.unwrap(), columns: columns.into_vec() };
    let (header, body) = unpack(&replay.encode());
    let marked = |name: &str| {
        let values = values(&header, &body, name);
        let marked = (0..values.len()).filter(|&at| values[at] > 0.0);
        marked.map(|at| (at / 40, at % 40)).collect::<Vec<_>>()
    };
    assert_eq!(marked("carries"), [(1, 7)]);
    assert_eq!(marked("failed"), [(3, 39)]);
}

/// Robots that drive straight on, behind a box and in front of a wall.
const PUSHING: &str = r#"{
  "task": {"script": {"name": "push.star", "text":
    "def control(robot):\n    robot.left = 1\n    robot.right = 1\n\ndef fitness(world):\n    return world.movables[0].x"}},
  "algorithm": {"name": "SNES", "evolvable_object": "robot", "population_size": 10, "generations": 1,
    "evaluation_steps": 20, "num_evaluations": 1,
    "populations": {"all": {"objects": ["synapses:weights:all"], "min_vals": -1, "max_vals": 1}}},
  "topology": {"stimuli": {"I": {"n": 8, "sensor": "proximity_sensor"}}, "ensembles": {"O": {"n": 2}},
    "synapses": {"s": {"pre": "I", "post": "O"}}, "outputs": {"w": {"ensemble": "O", "actuator": "wheel_actuator"}},
    "decoding": {"w": {"scheme": "IdentityDecoding"}}},
  "world": {"width": 200, "height": 100, "boundary": "walls", "bodies": {}, "objects": {
    "robot": {"type": "robot", "num_instances": 2, "controller": "script_controller",
      "sensors": {"proximity_sensor": {}}, "actuators": {"wheel_actuator": {}},
      "initializers": {"positions": {"name": "fixed", "params": {"values": [[30, 46], [30, 54]]}},
        "orientations": {"name": "fixed", "params": {"values": [[0]]}}}},
    "box": {"type": "movable", "num_instances": 1, "params": {"corners": [[0, 0], [20, 0], [20, 20], [0, 20]], "mass": 0.2},
      "initializers": {"positions": {"name": "fixed", "params": {"values": [[60, 50]]}}}},
    "pillar": {"type": "obstacle", "num_instances": 1, "params": {"radius": 5},
      "initializers": {"positions": {"name": "fixed", "params": {"values": [[150, 20]]}}}},
    "wall": {"type": "wall", "corners": [[120, 70], [120, 100]]}}}
}"#;

#[test]
fn a_replay_of_bodies_has_the_room_and_what_moves_in_it() {
    let (config, _) =
        ExperimentConfig::from_json(PUSHING, "pushing", evolution::ALGORITHMS).unwrap();
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = vec![0.5; simulation.genotype_len()];
    let episode = evaluated(&config, &simulation, &genotype);
    let (header, body) = unpack(&Replay::simulate(&episode).unwrap().encode());
    let room = &header["room"];
    assert_eq!(room["boundary"].as_array().unwrap().len(), 4);
    assert_eq!(room["walls"][0][1]["y"], 100.0);
    assert_eq!(room["obstacles"][0]["disc"]["center"]["x"], 150.0);
    assert_eq!(room["movables"][0]["polygon"][0]["x"], -10.0, "about its centre of mass");
    assert_eq!(room["radii"][1], 3.5);
    let [x, touches] = ["movable_x", "touches"].map(|name| values(&header, &body, name));
    assert!(x[0] == 60.0 && x[19] > 70.0, "the box moves: {x:?}");
    assert_eq!((touches[0], touches[19]), (0.0, 1.0));
}
