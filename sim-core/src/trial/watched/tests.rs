//! Interventions through whole episodes.

use std::ops::Range;

use experiment_file::{
    ExperimentConfig, Initializer, LightController, ObjectConfig, RobotController, ScriptConfig,
    TaskConfig,
};
use serde_json::json;

use crate::intervention::{Act, Intervention, Thing};
use crate::record::StepRecord;
use crate::testing::{experiment_a, experiment_b, experiment_d, genotype, robot};
use crate::torus::Vec2;
use crate::{EvaluateError, Simulation, TrialSet};

/// All robots send in the first ten steps.
const STEP: u32 = 4;
const N_STEPS: u32 = 80;

/// The light follower, with a light that all robots see.
fn bright() -> ExperimentConfig {
    let mut config = experiment_d();
    robot(&mut config).sensors.light_sensor.as_mut().unwrap().range = 400.0;
    for object in config.world.objects.values_mut() {
        if let ObjectConfig::LightSource(light) = object {
            light.params.range = 400.0;
        }
    }
    config
}

/// The same with a script beside the built-in fitness function.
fn with_script(mut config: ExperimentConfig, text: &str) -> ExperimentConfig {
    let script = ScriptConfig { name: "test.star".into(), text: text.into() };
    config.task = Some(TaskConfig { script });
    config
}

fn at(step: u32, thing: Thing, act: Act) -> Intervention {
    Intervention { step, thing, act }
}

/// All steps of an episode with these interventions.
fn watch(config: &ExperimentConfig, interventions: &[Intervention]) -> Vec<StepRecord> {
    try_watch(config, interventions).unwrap()
}

fn try_watch(
    config: &ExperimentConfig,
    interventions: &[Intervention],
) -> Result<Vec<StepRecord>, EvaluateError> {
    let mut config = config.clone();
    config.algorithm.evaluation_steps = N_STEPS;
    let simulation = Simulation::compile(&config).unwrap();
    let simulation = simulation.with_interventions(interventions.to_vec()).unwrap();
    let genotype = genotype(simulation.genotype_len(), 1);
    let mut steps = Vec::new();
    let mut keep = |step: &StepRecord| steps.push(step.clone());
    simulation.simulate(&genotype, TrialSet::Generation(0), 0, &mut keep)?;
    Ok(steps)
}

/// The steps from the intervention on.
fn after(steps: &[StepRecord]) -> &[StepRecord] {
    &steps[STEP as usize..]
}

/// Whether any robot hears this one in any step.
fn is_heard(steps: &[StepRecord], robot: usize) -> bool {
    let robots = steps.iter().flat_map(|step| &step.robots);
    robots.filter_map(|robot| robot.received).any(|frame| frame.emitter == robot)
}

/// A robot that others hear in the second half of the undisturbed episode.
fn heard_robot(steps: &[StepRecord]) -> usize {
    (0..steps[0].robots.len()).find(|&robot| is_heard(after(steps), robot)).unwrap()
}

#[test]
fn the_past_stays_and_the_future_changes() {
    let config = experiment_d();
    let undisturbed = watch(&config, &[]);
    let number = heard_robot(&undisturbed);
    let elsewhere = Vec2::new(3.0, 4.0);
    for act in [Act::Remove, Act::Freeze, Act::Mute, Act::Deafen, Act::Place(elsewhere)] {
        let disturbed = watch(&config, &[at(STEP, Thing::Robot(number), act)]);
        let (before, now) = disturbed.split_at(STEP as usize);
        assert_eq!(before, &undisturbed[..STEP as usize], "{act:?}");
        assert_ne!(now, after(&undisturbed), "{act:?}");
    }
}

#[test]
fn a_mute_robot_hears_and_a_deaf_one_is_heard() {
    let config = experiment_d();
    let undisturbed = watch(&config, &[]);
    let number = heard_robot(&undisturbed);
    let hears = |steps: &[StepRecord]| {
        steps.iter().any(|step| {
            let robot = &step.robots[number];
            robot.received.is_some() || robot.received_message.iter().any(|value| *value != 0.0)
        })
    };
    assert!(hears(after(&undisturbed)));
    let mute = watch(&config, &[at(STEP, Thing::Robot(number), Act::Mute)]);
    assert_eq!((is_heard(after(&mute), number), hears(after(&mute))), (false, true));
    let deaf = watch(&config, &[at(STEP, Thing::Robot(number), Act::Deafen)]);
    assert_eq!((is_heard(after(&deaf), number), hears(after(&deaf))), (true, false));
}

#[test]
fn a_frozen_robot_stands_still_and_goes_on_talking() {
    let config = experiment_d();
    let number = heard_robot(&watch(&config, &[]));
    let frozen = watch(&config, &[at(STEP, Thing::Robot(number), Act::Freeze)]);
    let pose = |step: &StepRecord| (step.robots[number].position, step.robots[number].heading);
    let before = pose(&frozen[STEP as usize - 1]);
    assert_ne!(pose(&frozen[STEP as usize - 2]), before, "it moved before");
    assert!(after(&frozen).iter().all(|step| pose(step) == before));
    assert!(is_heard(after(&frozen), number));
}

#[test]
fn a_removed_robot_is_dark_and_nobody_hears_it() {
    let config = experiment_a();
    let number = heard_robot(&watch(&config, &[]));
    let removed = watch(&config, &[at(STEP, Thing::Robot(number), Act::Remove)]);
    assert!(!is_heard(after(&removed), number));
    let is_gone = |step: &StepRecord| {
        let robot = &step.robots[number];
        robot.failed && robot.led == 0 && robot.wheels == [0.0; 2] && robot.received.is_none()
    };
    assert!(after(&removed).iter().all(is_gone));
}

#[test]
fn things_go_on_from_where_they_are_put() {
    let config = bright();
    let place = Vec2::new(420.0, 340.0);
    let is_near = |position: Vec2| (position - place).norm() < 15.0;
    for thing in [Thing::Robot(3), Thing::Light(0)] {
        let moved = watch(&config, &[at(STEP, thing, Act::Place(place))]);
        let where_is = |step: &StepRecord| match thing {
            Thing::Light(light) => step.lights[light],
            _ => step.robots[thing.number()].position,
        };
        assert!(!is_near(where_is(&moved[STEP as usize - 1])), "{thing:?}");
        assert!(after(&moved)[..3].iter().all(|step| is_near(where_is(step))), "{thing:?}");
        let undisturbed = watch(&config, &[]);
        assert_ne!(after(&moved)[1].robots, after(&undisturbed)[1].robots, "{thing:?}");
    }
}

#[test]
fn the_border_is_that_of_the_places_where_robots_are_put() {
    // No robot of this experiment moves by itself: a change is seen at once or never.
    let mut config = experiment_b();
    let square = [[0.0, 0.0], [80.0, 0.0], [80.0, 80.0], [0.0, 80.0], [41.0, 40.0]];
    let robots = robot(&mut config);
    robots.num_instances = 5;
    let values = square.map(|place| place.to_vec()).to_vec();
    robots.initializers.positions = Initializer::Fixed { values };
    let steps = watch(
        &config,
        &[
            at(STEP, Thing::Robot(4), Act::Place(Vec2::new(500.0, 500.0))),
            at(2 * STEP, Thing::Robot(4), Act::Place(Vec2::new(39.0, 40.0))),
        ],
    );
    for step in &steps {
        let is_away = (STEP..2 * STEP).contains(&step.step);
        let targets: Vec<_> = step.robots.iter().map(|robot| robot.target).collect();
        let corners = [Some(true); 4];
        assert_eq!(targets, [&corners[..], &[Some(is_away)]].concat(), "step {}", step.step);
    }
}

#[test]
fn a_frozen_light_stays_and_nobody_sees_a_removed_one() {
    let config = bright();
    let frozen = watch(&config, &[at(STEP, Thing::Light(0), Act::Freeze)]);
    assert_ne!(frozen[1].lights, frozen[2].lights, "it moves");
    assert!(after(&frozen).iter().all(|step| step.lights == frozen[STEP as usize].lights));
    // Nothing sees where an invisible light is.
    let out = at(STEP, Thing::Light(0), Act::Remove);
    let elsewhere = at(STEP, Thing::Light(0), Act::Place(Vec2::new(1.0, 1.0)));
    let robots =
        |steps: Vec<StepRecord>| steps.into_iter().map(|step| step.robots).collect::<Vec<_>>();
    let removed = robots(watch(&config, &[out]));
    assert_eq!(removed, robots(watch(&config, &[out, elsewhere])));
    assert_ne!(removed, robots(watch(&config, &[])));
}

#[test]
fn a_script_cannot_undo_an_intervention() {
    let mut config = experiment_a();
    robot(&mut config).perturbations.leader_failure = None;
    let script =
        "def react(world):\n    for robot in world.robots:\n        robot.failed = False\n";
    let config = with_script(config, script);
    let interventions =
        [at(STEP, Thing::Robot(1), Act::Remove), at(STEP, Thing::Robot(2), Act::Mute)];
    let steps = watch(&config, &interventions);
    // Frames of the step before are on the air.
    for number in [1, 2] {
        assert!(!is_heard(after(&steps), number), "robot {number}");
    }
    assert!(after(&steps).iter().all(|step| step.robots[1].wheels == [0.0; 2]));
}

#[test]
fn a_script_does_not_move_a_frozen_light() {
    let mut config =
        with_script(experiment_d(), "def move(light):\n    return light.x + 1, light.y\n");
    for object in config.world.objects.values_mut() {
        if let ObjectConfig::LightSource(light) = object {
            light.controller = LightController::ScriptController {};
        }
    }
    let place = Vec2::new(420.0, 340.0);
    let steps = watch(
        &config,
        &[at(STEP, Thing::Light(0), Act::Freeze), at(2 * STEP, Thing::Light(0), Act::Place(place))],
    );
    assert_ne!(steps[1].lights, steps[2].lights, "it moves");
    let (frozen, elsewhere) = after(&steps).split_at(STEP as usize);
    assert!(frozen.iter().all(|step| step.lights == frozen[0].lights));
    assert!(elsewhere.iter().all(|step| step.lights == [place]));
}

#[test]
fn a_script_senses_no_removed_robot_and_its_task_counts_it() {
    let script = "\
def control(robot):
    robot.led = 1 in [other.id for other in robot.neighbours(10000)]
def measures(world):
    return {'others': len(world.robots[0].neighbours(10000))}
";
    let mut config = with_script(experiment_a(), script);
    robot(&mut config).controller = RobotController::ScriptController;
    let steps = watch(&config, &[at(STEP, Thing::Robot(1), Act::Remove)]);
    let n_seeing = |step: &StepRecord| step.robots.iter().filter(|robot| robot.led > 0).count();
    let (before, now) = steps.split_at(STEP as usize);
    assert!(before.iter().all(|step| n_seeing(step) == 9), "all but robot 1 itself");
    assert!(now.iter().all(|step| n_seeing(step) == 0));
    assert!(steps.iter().all(|step| step.measures["others"] == 9.0));
}

#[test]
fn all_interventions_that_do_not_fit_are_named_at_once() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let n_steps = simulation.n_steps();
    let error = simulation
        .with_interventions(vec![
            at(n_steps, Thing::Robot(0), Act::Mute),
            at(0, Thing::Robot(99), Act::Mute),
            at(0, Thing::Light(0), Act::Remove),
            at(0, Thing::Robot(0), Act::Place(Vec2::new(f64::NAN, 0.0))),
            at(0, Thing::Robot(0), Act::Place(Vec2::new(0.0, 1e9))),
        ])
        .unwrap_err();
    assert_eq!(error.problems.len(), 5, "{error}");
    assert!(error.problems[1].contains("the world has the numbers 0 to 9"), "{error}");
    assert!(error.problems[2].contains("the world has no light"), "{error}");
    let simulation = Simulation::compile(&experiment_d()).unwrap();
    let error = simulation.with_interventions(vec![at(0, Thing::Light(0), Act::Mute)]).unwrap_err();
    assert_eq!(error.to_string(), "mute: nothing can do this to a light");
    let simulation = Simulation::compile(&experiment_d()).unwrap();
    let many = vec![at(0, Thing::Robot(0), Act::Mute); crate::INTERVENTIONS_MAX + 1];
    assert_eq!(simulation.with_interventions(many).unwrap_err().problems.len(), 1);
}

/// Two robots drive towards a third one between walls.
fn corridor() -> ExperimentConfig {
    let text = json!({
        "topology": {
            "stimuli": {
                "near": {"n": 4, "sensor": "proximity_sensor"},
                "light": {"n": 4, "sensor": "light_sensor"},
                "ground": {"n": 1, "sensor": "ground_sensor"},
                "others": {"n": 3, "sensor": "neighborhood_pos_sensor"},
            },
            "ensembles": {"OUT": {"n": 2, "activation": "tanh"}},
            "synapses": {"in": {"pre": ["near"], "post": ["OUT"]}},
            "outputs": {"wheels": {"ensemble": "OUT", "actuator": "wheel_actuator"}},
            "decoding": {"wheels": {"scheme": "IdentityDecoding"}},
        },
        "algorithm": {
            "name": "SNES", "evolvable_object": "robot", "fitness_function": "goto_light",
            "population_size": 10, "generations": 3, "evaluation_steps": 80, "num_evaluations": 1,
            "populations": {
                "all": {"objects": ["synapses:weights:all", "neurons:bias:all"], "min_vals": 1, "max_vals": 3}
            },
        },
        "world": {
            "width": 200, "height": 60, "boundary": "walls", "bodies": {},
            "objects": {
                "robot": {
                    "type": "robot", "num_instances": 3, "controller": "neural_controller",
                    "sensors": {
                        "proximity_sensor": {"n_rays": 4, "range": 30},
                        "light_sensor": {"range": 400, "n_sectors": 4, "noise_variance": 0, "blocked_by": "bodies"},
                        "ground_sensor": {"color": "black"},
                        "neighborhood_pos_sensor": {"n_neighbors": 1},
                    },
                    "actuators": {"wheel_actuator": {}},
                    "initializers": {
                        "positions": {"name": "fixed", "params": {"values": [[20, 30], [60, 30], [180, 12]]}},
                        "orientations": {"name": "fixed", "params": {"values": [[0], [0], [1]]}},
                    },
                },
                "box": {
                    "type": "movable", "num_instances": 1,
                    "params": {"radius": 8, "mass": 0.1, "friction": 0.1},
                    "initializers": {"positions": {"name": "fixed", "params": {"values": [[120, 30]]}}},
                },
                "lamp": {
                    "type": "light_source", "num_instances": 1, "params": {"range": 400},
                    "initializers": {"positions": {"name": "fixed", "params": {"values": [[190, 30]]}}},
                },
                "nest": {
                    "type": "ground_area", "num_instances": 1, "params": {"range": 10, "color": "black"},
                    "initializers": {"positions": {"name": "fixed", "params": {"values": [[20, 30]]}}},
                },
            },
        },
    });
    ExperimentConfig::from_json(&text.to_string(), "test", evolution::ALGORITHMS).unwrap().0
}

#[test]
fn bodies_go_through_the_place_of_a_removed_robot() {
    let config = corridor();
    let block = at(0, Thing::Robot(1), Act::Freeze);
    let farthest = |steps: &[StepRecord]| {
        steps.iter().map(|step| step.robots[0].position.x).fold(0.0, f64::max)
    };
    let blocked = watch(&config, &[block]);
    assert!(blocked.iter().any(|step| step.robots[0].touches), "it bumps into the other one");
    let free = watch(&config, &[block, at(0, Thing::Robot(1), Act::Remove)]);
    assert!(farthest(&free) > farthest(&blocked) + 10.0, "{}", farthest(&free));
    let [before, after] = [&free[0], free.last().unwrap()].map(|step| step.robots[1].position);
    assert_eq!(before, after, "the removed robot is not pushed");
}

/// What robot 0 sees in the step of the interventions: near things, light, its ground.
fn sight(interventions: &[Intervention]) -> [bool; 3] {
    // The box is aside, and the robots stay where they are.
    let stay = [0, 1].map(|robot| at(0, Thing::Robot(robot), Act::Freeze));
    let aside = at(0, Thing::Movable(0), Act::Place(Vec2::new(100.0, 10.0)));
    let steps = watch(&corridor(), &[&stay[..], &[aside], interventions].concat());
    // Stimuli are in the alphabetical order of their names in this JSON. Walls are farther than
    // half of the rays' range.
    let stimuli = &steps[STEP as usize].robots[0].stimuli;
    let sees =
        |inputs: Range<usize>, more_than| stimuli[inputs].iter().any(|value| *value > more_than);
    [sees(5..9, 0.5), sees(1..5, 0.0), sees(0..1, 0.0)]
}

#[test]
fn a_removed_robot_is_neither_seen_nor_in_the_way() {
    let beside = at(STEP, Thing::Robot(1), Act::Place(Vec2::new(38.0, 30.0)));
    let remove = at(STEP, Thing::Robot(1), Act::Remove);
    assert_eq!(sight(&[beside]), [true, false, true], "it hides the lamp");
    assert_eq!(sight(&[beside, remove]), [false, true, true]);
}

#[test]
fn the_nearest_robot_is_the_nearest_that_is_not_removed() {
    let stay = [0, 1, 2].map(|robot| at(0, Thing::Robot(robot), Act::Freeze));
    let nearest = |interventions: &[Intervention]| {
        let steps = watch(&corridor(), &[&stay[..], interventions].concat());
        // The stimulus after those of `sight`.
        steps[STEP as usize].robots[0].stimuli[9..12].to_vec()
    };
    assert_eq!(nearest(&[]), [60.0, 30.0, 0.0]);
    assert_eq!(nearest(&[at(STEP, Thing::Robot(1), Act::Remove)]), [180.0, 12.0, 1.0]);
}

#[test]
fn an_area_goes_away_or_goes_out() {
    let nest = Thing::Area(0);
    assert!(sight(&[])[2]);
    assert!(!sight(&[at(STEP, nest, Act::Remove)])[2]);
    assert!(!sight(&[at(STEP, nest, Act::Place(Vec2::new(180.0, 50.0)))])[2]);
}

#[test]
fn a_body_has_room_at_the_place_of_a_removed_robot() {
    let there = Act::Place(Vec2::new(60.0, 30.0));
    let stay = at(0, Thing::Robot(1), Act::Freeze);
    let put = at(STEP, Thing::Robot(2), there);
    assert!(matches!(try_watch(&corridor(), &[stay, put]), Err(EvaluateError::NoRoom { .. })));
    let remove = at(STEP, Thing::Robot(1), Act::Remove);
    assert!(try_watch(&corridor(), &[stay, remove, put]).is_ok());
}

#[test]
fn a_body_has_room_only_where_nothing_else_is() {
    let config = corridor();
    let put = |thing, x, y| {
        try_watch(&config, &[at(STEP, thing, Act::Place(Vec2::new(x, y)))]).map(|steps| {
            let step = &steps[STEP as usize];
            (step.robots[2].position, step.movables[0].position)
        })
    };
    let (robot, _) = put(Thing::Robot(2), 150.0, 45.0).unwrap();
    assert!((robot - Vec2::new(150.0, 45.0)).norm() < 5.0, "{robot:?}");
    let (_, load) = put(Thing::Movable(0), 160.0, 45.0).unwrap();
    assert!((load - Vec2::new(160.0, 45.0)).norm() < 5.0, "{load:?}");
    for (thing, x, y) in [(Thing::Robot(2), 0.5, 30.0), (Thing::Movable(0), 180.0, 59.0)] {
        let error = put(thing, x, y).unwrap_err();
        assert!(matches!(error, EvaluateError::NoRoom { step: STEP, .. }), "{error}");
    }
}
