//! Rooms through experiments: starts, sensors, shadows, bits.

use experiment_file::ExperimentConfig;
use serde_json::{Value, json};

use crate::record::StepRecord;
use crate::torus::Vec2;
use crate::{Simulation, TrialSet};
use determinism::Isa;

/// Six robots with proximity sensors, three pillars and a box in a room.
fn experiment() -> Value {
    let circle = |radius: u32, center: [u32; 2]| json!({"name": "random_circumference", "params": {"radius": radius, "center": center}});
    json!({
        "seed": 3,
        "topology": {
            "stimuli": {
                "near": {"n": 6, "sensor": "proximity_sensor"},
                "touch": {"n": 4, "sensor": "contact_sensor"},
            },
            "ensembles": {"OUT": {"n": 2, "activation": "tanh"}},
            "synapses": {"in": {"pre": ["near", "touch"], "post": ["OUT"]}},
            "outputs": {"wheels": {"ensemble": "OUT", "actuator": "wheel_actuator"}},
            "decoding": {"wheels": {"scheme": "IdentityDecoding"}},
        },
        "algorithm": {
            "name": "SNES", "evolvable_object": "robot", "fitness_function": "goto_light",
            "population_size": 10, "generations": 3, "evaluation_steps": 60, "num_evaluations": 4,
            "populations": {
                "all": {"objects": ["synapses:weights:all", "neurons:bias:all"], "min_vals": -3, "max_vals": 3}
            },
        },
        "world": {
            "width": 200, "height": 150, "boundary": "walls", "bodies": {},
            "objects": {
                "robot": {
                    "type": "robot", "num_instances": 6, "controller": "neural_controller",
                    "sensors": {
                        "proximity_sensor": {"n_rays": 6, "range": 25, "noise_sigma": 0.02},
                        "contact_sensor": {},
                        "light_sensor": {"range": 400, "blocked_by": "bodies"},
                    },
                    "actuators": {"wheel_actuator": {}},
                    "initializers": {"positions": circle(30, [50, 75])},
                },
                "pillar": {
                    "type": "obstacle", "num_instances": 3, "params": {"radius": 8},
                    "initializers": {"positions": circle(30, [140, 75])},
                },
                "box": {
                    "type": "movable", "num_instances": 1,
                    "params": {"corners": [[-8, -8], [8, -8], [8, 8], [-8, 8]], "mass": 0.1, "friction": 0.1},
                    "initializers": {
                        "positions": {"name": "fixed", "params": {"values": [[50, 75]]}},
                        "orientations": {"name": "random_uniform"},
                    },
                },
                "lamp": {
                    "type": "light_source", "num_instances": 1, "params": {"range": 400},
                    "initializers": {"positions": {"name": "fixed", "params": {"values": [[180, 75]]}}},
                },
            },
        },
    })
}

fn compiled(experiment: &Value) -> Simulation {
    let text = experiment.to_string();
    let (config, _) = ExperimentConfig::from_json(&text, "test", evolution::ALGORITHMS).unwrap();
    Simulation::compile(&config).unwrap()
}

fn genotype(simulation: &Simulation) -> Vec<f64> {
    crate::testing::genotype(simulation.genotype_len(), 1)
}

fn watch(experiment: &Value, trial: u32, mut look: impl FnMut(&StepRecord)) {
    let simulation = compiled(experiment);
    let genotype = genotype(&simulation);
    simulation.simulate(&genotype, TrialSet::Generation(0), trial, &mut look).unwrap();
}

#[test]
fn bits_depend_neither_on_the_processor_nor_on_the_company_of_a_trial() {
    let simulation = compiled(&experiment());
    let genotype = genotype(&simulation);
    let all = simulation.evaluate(&genotype, 5, 0..4).unwrap();
    let one_by_one: Vec<f64> = (0..4)
        .flat_map(|trial| simulation.evaluate(&genotype, 5, trial..trial + 1).unwrap())
        .collect();
    assert_eq!(all, one_by_one);
    for isa in Isa::available() {
        let other = simulation.clone().with_isa(isa);
        assert_eq!(other.evaluate(&genotype, 5, 0..4).unwrap(), all, "{}", isa.name());
    }
}

#[test]
fn format_1_of_bodies_keeps_its_bits() {
    let simulation = compiled(&experiment());
    let fitness = simulation.evaluate(&genotype(&simulation), 0, 0..4).unwrap();
    let bits: Vec<u64> = fitness.into_iter().map(f64::to_bits).collect();
    let known = [
        0x3fcb_bbbb_bbbb_bbbf,
        0x3fa9_9999_9999_9997,
        0x3fbb_05b0_5b05_b05e,
        0x3fac_71c7_1c71_c71a,
    ];
    assert_eq!(bits, known, "{bits:#x?}");
}

#[test]
fn nothing_overlaps_at_the_start() {
    let mut experiment = experiment();
    experiment["algorithm"]["evaluation_steps"] = json!(1);
    let positions = &mut experiment["world"]["objects"]["robot"]["initializers"]["positions"];
    *positions = json!({"name": "random_uniform", "params": {"low": 4, "high": 146}});
    for trial in 0..50 {
        watch(&experiment, trial, |step| {
            let at = |robot: usize| step.robots[robot].position;
            for robot in 0..step.robots.len() {
                for other in 0..robot {
                    let apart = (at(robot) - at(other)).norm();
                    assert!(apart > 6.9, "trial {trial}: {robot} and {other} are {apart} cm apart");
                }
                let Vec2 { x, y } = at(robot);
                assert!(x > 3.4 && y > 3.4 && y < 146.6, "trial {trial}: {x}, {y}");
            }
        });
    }
}

#[test]
fn a_room_that_cannot_hold_its_robots_is_refused() {
    let mut experiment = experiment();
    experiment["world"]["objects"]["robot"]["num_instances"] = json!(40);
    let text = experiment.to_string();
    let (config, _) = ExperimentConfig::from_json(&text, "test", evolution::ALGORITHMS).unwrap();
    let error = Simulation::compile(&config).unwrap_err().to_string();
    assert!(error.contains("world.objects.robot.initializers.positions: no place for"), "{error}");
}

#[test]
fn robots_whose_steps_last_differently_are_refused() {
    let mut experiment = experiment();
    let objects = experiment["world"]["objects"].as_object_mut().unwrap();
    let mut slow = objects["robot"].clone();
    slow["num_instances"] = json!(1);
    slow["actuators"]["wheel_actuator"] = json!({"step_duration": 0.1});
    objects.insert("slow".into(), slow);
    let text = experiment.to_string();
    let (config, _) = ExperimentConfig::from_json(&text, "test", evolution::ALGORITHMS).unwrap();
    let error = Simulation::compile(&config).unwrap_err().to_string();
    assert!(error.contains("wheel_actuator.step_duration: is 0."), "{error}");
}

/// A robot at (100, 75) that looks along x and stands still, between these other objects.
fn one_robot(objects: Value) -> Value {
    let mut experiment = experiment();
    let world = &mut experiment["world"]["objects"];
    let robot = &mut world["robot"];
    robot["num_instances"] = json!(1);
    robot["initializers"] = json!({
        "positions": {"name": "fixed", "params": {"values": [[100, 75]]}},
        "orientations": {"name": "fixed", "params": {"values": [[0]]}},
    });
    robot["sensors"]["proximity_sensor"] = json!({"n_rays": 6, "range": 20});
    world.as_object_mut().unwrap().retain(|name, _| name == "robot" || name == "lamp");
    world.as_object_mut().unwrap().extend(objects.as_object().unwrap().clone());
    experiment["algorithm"]["evaluation_steps"] = json!(1);
    experiment
}

fn fixed(kind: &str, at: [f64; 2], params: Value) -> Value {
    json!({
        "type": kind, "num_instances": 1, "params": params,
        "initializers": {"positions": {"name": "fixed", "params": {"values": [at]}}},
    })
}

fn stimuli(experiment: &Value) -> Vec<f64> {
    let mut stimuli = Vec::new();
    watch(experiment, 0, |step| stimuli = step.robots[0].stimuli.clone());
    stimuli
}

#[test]
fn rays_read_the_distance_from_the_rim() {
    // A wall 10 cm from the rim ahead; a pillar 5 cm from it behind.
    let world = one_robot(json!({
        "wall": {"type": "wall", "corners": [[113.5, 0], [113.5, 150]]},
        "pillar": fixed("obstacle", [81.5, 75.0], json!({"radius": 10})),
    }));
    let stimuli = stimuli(&world);
    assert!((stimuli[0] - 0.5).abs() < 1e-12, "ahead: {stimuli:?}");
    assert!((stimuli[3] - 0.75).abs() < 1e-12, "behind: {stimuli:?}");
    // 60 degrees: 3.5 cm of radius and 23.5 cm of way to the wall, out of reach.
    assert_eq!((stimuli[1], stimuli[5]), (0.0, 0.0), "{stimuli:?}");
    assert_eq!(&stimuli[6..], [0.0; 4], "it touches nothing");
}

#[test]
fn who_leans_on_something_sees_it() {
    let line = json!([[113.5, 0], [113.5, 150]]);
    let block = json!({"corners": [[0, -20], [8, -20], [8, 20], [0, 20]]});
    for (name, thing) in [
        ("line", json!({"type": "wall", "corners": line})),
        ("obstacle", fixed("obstacle", [113.5, 75.0], block.clone())),
        ("movable", fixed("movable", [113.5, 75.0], block)),
    ] {
        let mut world = one_robot(json!({"thing": thing}));
        world["algorithm"]["evaluation_steps"] = json!(20);
        let simulation = compiled(&world);
        // Straight on at full speed.
        let genotype = vec![1.0; simulation.genotype_len()];
        let mut stimuli = Vec::new();
        let look = &mut |step: &StepRecord| stimuli = step.robots[0].stimuli.clone();
        simulation.simulate(&genotype, TrialSet::Generation(0), 0, look).unwrap();
        assert!(stimuli[0] > 0.999 && stimuli[6] == 1.0, "{name}: {stimuli:?}");
    }
}

#[test]
fn rays_meet_only_what_the_sensor_sees() {
    let mut world = one_robot(json!({
        "wall": {"type": "wall", "corners": [[113.5, 0], [113.5, 150]]},
        "box": fixed("movable", [81.5, 75.0], json!({"radius": 10})),
    }));
    let read = |world: &mut Value, sees: Value| {
        world["world"]["objects"]["robot"]["sensors"]["proximity_sensor"]["sees"] = sees;
        let stimuli = stimuli(world);
        [stimuli[0] > 0.0, stimuli[3] > 0.0]
    };
    assert_eq!(read(&mut world, json!("all")), [true, true]);
    assert_eq!(read(&mut world, json!("walls")), [true, false]);
    assert_eq!(read(&mut world, json!("objects")), [false, true]);
    assert_eq!(read(&mut world, json!(["robots", "walls"])), [true, false]);
    assert_eq!(read(&mut world, json!("robots")), [false, false]);
}

#[test]
fn light_passes_walls_only_where_nothing_is_said() {
    let read = |blocked_by: &str, objects: Value| {
        let mut world = one_robot(objects);
        let sensor = &mut world["world"]["objects"]["robot"]["sensors"]["light_sensor"];
        *sensor =
            json!({"n_sectors": 4, "range": 400, "decay_rho": 0.001, "blocked_by": blocked_by});
        world["topology"]["stimuli"] = json!({"light": {"n": 4, "sensor": "light_sensor"}});
        world["topology"]["synapses"]["in"]["pre"] = json!(["light"]);
        stimuli(&world)[0] > 0.5
    };
    let wall = json!({"wall": {"type": "wall", "corners": [[140, 60], [140, 90]]}});
    let beside = json!({"wall": {"type": "wall", "corners": [[140, 80], [140, 90]]}});
    let cask = json!({"cask": fixed("movable", [140.0, 75.0], json!({"radius": 10}))});
    assert!(read("nothing", wall.clone()) && read("walls", beside.clone()));
    assert!(!read("walls", wall.clone()) && !read("bodies", wall));
    assert!(read("walls", cask.clone()) && !read("bodies", cask));
}

#[test]
fn robots_see_each_other_through_walls_only_where_nothing_is_said() {
    let read = |blocked_by: &str, objects: Value| {
        let mut world = one_robot(objects);
        let robot = &mut world["world"]["objects"]["robot"];
        robot["num_instances"] = json!(2);
        robot["initializers"]["positions"]["params"]["values"] = json!([[100, 75], [140, 75]]);
        robot["sensors"]["distance_sensor"] =
            json!({"n_sectors": 4, "range": 60, "noise_variance": 0, "blocked_by": blocked_by});
        world["topology"]["stimuli"] = json!({"near": {"n": 4, "sensor": "distance_sensor"}});
        world["topology"]["synapses"]["in"]["pre"] = json!(["near"]);
        let ahead = stimuli(&world)[0];
        assert!(ahead == 0.0 || (ahead - libm::exp(-2.0)).abs() < 1e-6, "{ahead}");
        ahead > 0.0
    };
    let wall = json!({"wall": {"type": "wall", "corners": [[120, 60], [120, 90]]}});
    let beside = json!({"wall": {"type": "wall", "corners": [[120, 76], [120, 90]]}});
    let cask = json!({"cask": fixed("movable", [120.0, 75.0], json!({"radius": 5}))});
    assert!(read("nothing", wall.clone()) && read("walls", beside.clone()));
    assert!(read("bodies", beside), "the two robots do not hide each other");
    assert!(!read("walls", wall.clone()) && !read("bodies", wall));
    assert!(read("walls", cask.clone()) && !read("bodies", cask));
}

#[test]
fn nobody_leaves_a_room_with_a_corner_inside() {
    let mut experiment = experiment();
    experiment["world"]["boundary"] =
        json!([[0, 0], [200, 0], [200, 60], [100, 60], [100, 150], [0, 150]]);
    experiment["world"]["objects"].as_object_mut().unwrap().retain(|name, _| name != "pillar");
    experiment["algorithm"]["evaluation_steps"] = json!(400);
    for trial in 0..8 {
        watch(&experiment, trial, |step| {
            for robot in &step.robots {
                let Vec2 { x, y } = robot.position;
                let is_inside =
                    x > 3.4 && y > 3.4 && x < 196.6 && y < 146.6 && (x < 96.6 || y < 56.6);
                let is_at_corner = (robot.position - Vec2::new(100.0, 60.0)).norm() > 3.4;
                assert!((is_inside || x < 103.5 && y < 63.5) && is_at_corner, "{x}, {y}");
            }
        });
    }
}
