//! Readings that a script computes.

use determinism::Isa;
use determinism::random::TrialSet;
use experiment_file::{
    Drawn, ExperimentConfig, ObjectConfig, PseudoRealityConfig, RobotConfig, RobotController,
};
use serde_json::json;

use super::acting::{failure, watch};
use super::with_script;
use crate::simulation::Simulation;
use crate::stepping::Stepper;
use crate::testing::{experiment_a, experiment_d, genotype};

/// Experiment D with `n_steps` steps. Its robots have a `script_sensor` of two values from -1 to 2,
/// and their networks get these values.
fn sensing(text: &str, n_steps: u32) -> ExperimentConfig {
    let config = with_script(experiment_d(), "t.star", text);
    let mut file = serde_json::to_value(&config).unwrap();
    file["algorithm"]["evaluation_steps"] = json!(n_steps);
    file["topology"]["stimuli"]["said"] = json!({"n": 2, "sensor": "script_sensor"});
    let hidden = file["topology"]["ensembles"].as_object().unwrap().keys().next().unwrap().clone();
    file["topology"]["synapses"]["heed"] = json!({"pre": "said", "post": hidden});
    file["world"]["objects"]["robotA"]["sensors"]["script_sensor"] =
        json!({"n": 2, "low": -1, "high": 2});
    ExperimentConfig::from_json(&file.to_string(), "t", evolution::ALGORITHMS).unwrap().0
}

/// The robots of a configuration, at any position among its objects.
fn robots(config: &mut ExperimentConfig) -> &mut RobotConfig {
    let mut objects = config.world.objects.values_mut();
    let robots = objects.find_map(|object| match object {
        ObjectConfig::Robot(robots) => Some(robots),
        _ => None,
    });
    robots.unwrap()
}

/// The last two inputs of a robot in each step.
fn said(config: &ExperimentConfig, robot: usize) -> Vec<[f64; 2]> {
    let two = |stimuli: &[f64]| [stimuli[stimuli.len() - 2], stimuli[stimuli.len() - 1]];
    watch(config).iter().map(|step| two(&step.robots[robot].stimuli)).collect()
}

const FITNESS: &str = "\ndef fitness(world):\n    return 1\n";

#[test]
fn the_clamped_result_of_sense_reaches_networks_in_the_same_step() {
    let text = "def sense(robot):\n    return (robot.id / 4 - robot.world.step, robot.id >= 2)";
    let config = sensing(&format!("{text}{FITNESS}"), 3);
    assert_eq!(said(&config, 1), [[0.25, 0.0], [-0.75, 0.0], [-1.0, 0.0]]);
    assert_eq!(said(&config, 4), [[1.0, 1.0], [0.0, 1.0], [-1.0, 1.0]]);
    let text = "def sense(robot):\n    return [1e300, -1e300]";
    assert_eq!(said(&sensing(&format!("{text}{FITNESS}"), 1), 0), [[2.0, -1.0]]);
}

#[test]
fn a_pseudo_reality_distorts_what_sense_returns() {
    let text = "def sense(robot):\n    return (robot.id / 4, 1)";
    let mut config = sensing(&format!("{text}{FITNESS}"), 2);
    robots(&mut config).perturbations.pseudo_reality = Some(PseudoRealityConfig {
        sensor_gain: Drawn::always(0.5),
        sensor_offset: Drawn::always(0.25),
        ..Default::default()
    });
    // The range from -1 to 2 has a width of 3.
    assert_eq!(said(&config, 1), [[0.875, 1.25]; 2]);
    assert_eq!(said(&config, 9), [[1.875, 1.25]; 2]);
}

#[test]
fn a_script_reads_other_sensors_of_this_step_and_its_own_of_the_previous_step() {
    let text = "\
def sense(robot):
    last = robot.sense('script_sensor')
    others = [other.sense('script_sensor')[0] for other in robot.world.robots]
    if [other for other in others if other != last[0]]:
        fail('sees what others are about to sense', others)
    robot.state['light'] = robot.sense('light_sensor')
    return [last[0] + 0.5, max(robot.state['light'])]
def fitness(world):
    for robot in world.robots:
        if robot.sense('light_sensor') != robot.state['light']:
            fail('light')
    return sum([robot.sense('script_sensor')[1] for robot in world.robots])
";
    let config = sensing(text, 4);
    let values = said(&config, 0);
    assert_eq!(values.iter().map(|reading| reading[0]).collect::<Vec<_>>(), [0.5, 1.0, 1.5, 2.0]);
    let sum = |step: &crate::record::StepRecord| {
        step.robots.iter().map(|robot| robot.stimuli[robot.stimuli.len() - 1]).sum::<f64>()
    };
    for step in watch(&config) {
        assert!((step.fitness.unwrap() - sum(&step)).abs() < 1e-5);
    }
}

#[test]
fn a_robot_with_a_script_controller_reads_its_script_sensor_too() {
    let text = "\
def sense(robot):
    return [robot.world.step / 8, 0]
def control(robot):
    robot.left = robot.sense('script_sensor')[0]
";
    let mut config = sensing(&format!("{text}{FITNESS}"), 4);
    robots(&mut config).controller = RobotController::ScriptController;
    let left: Vec<f64> = watch(&config).iter().map(|step| step.robots[2].wheels[1]).collect();
    assert_eq!(left, [0.0, 0.125, 0.25, 0.375]);
}

#[test]
fn robots_draw_their_noise_from_streams_of_their_own() {
    let text = |who: &str| {
        format!("def sense(robot):\n    return [robot.normal() if {who} else 0, 0]{FITNESS}")
    };
    let values = |who| said(&sensing(&text(who), 10), 3);
    let (all, alone) = (values("True"), values("robot.id == 3"));
    assert_eq!(all, alone);
    assert!(all.windows(2).all(|pair| pair[0] != pair[1]), "{all:?}");
}

#[test]
fn networks_of_inhibited_robots_get_zeros_while_the_script_goes_on() {
    let text = "\
def sense(robot):
    robot.state['n'] = robot.state.get('n', 0) + 1
    return [1, 1]
def fitness(world):
    return sum([robot.state['n'] for robot in world.robots])
";
    let mut config = sensing(text, 2);
    let n_robots = robots(&mut config).num_instances;
    let mut file = serde_json::to_value(&config).unwrap();
    file["world"]["objects"]["robotA"]["perturbations"] =
        json!({"stimuli_inhibition": {"stimuli": "script_sensor", "affected_robots": 2}});
    let (config, _) =
        ExperimentConfig::from_json(&file.to_string(), "t", evolution::ALGORITHMS).unwrap();
    let steps = watch(&config);
    let blind = steps[1].robots.iter().filter(|robot| robot.stimuli.ends_with(&[0.0, 0.0])).count();
    let seeing =
        steps[1].robots.iter().filter(|robot| robot.stimuli.ends_with(&[1.0, 1.0])).count();
    assert_eq!((blind, seeing), (2, n_robots as usize - 2));
    assert_eq!(steps[1].fitness, Some(2.0 * f64::from(n_robots)));
}

#[test]
fn the_same_bits_alone_side_by_side_step_by_step_and_on_every_instruction_set() {
    let text = "\
def sense(robot):
    lamp = robot.world.lights[0]
    return [math.exp(-robot.distance(lamp) / 50) + 0.1 * robot.normal(), robot.random()]
def fitness(world):
    return sum([math.sin(robot.x) + robot.right for robot in world.robots])
";
    let simulation = Simulation::compile(&sensing(text, 40)).unwrap();
    let genotype = genotype(simulation.genotype_len(), 2);
    let together = simulation.evaluate(&genotype, 5, 0..4).unwrap();
    for trial in 0..4 {
        let alone = simulation.evaluate(&genotype, 5, trial..trial + 1).unwrap();
        assert_eq!(alone[0].to_bits(), together[trial as usize].to_bits());
    }
    for isa in Isa::available() {
        let other = simulation.clone().with_isa(isa);
        assert_eq!(other.evaluate(&genotype, 5, 0..4).unwrap(), together, "{isa:?}");
    }
    let mut stepper = Stepper::new(&simulation, TrialSet::Generation(5), 0..4).unwrap();
    let mut policy = stepper.policy(&genotype).unwrap();
    for _ in 0..40 {
        let actions = stepper.decide(&mut policy);
        stepper.step(&actions).unwrap();
    }
    assert_eq!(stepper.fitness(), together);
}

#[test]
fn errors_name_their_place_reason_and_object() {
    for (body, reason) in [
        (
            "return [1, math.inf]",
            "t.star:1: `sense` returns inf as element 1; a `script_sensor` with",
        ),
        ("return [0 * math.inf, 1]", "`sense` returns NaN as element 0"),
        (
            "return [1]",
            "returns a list of 1; a `script_sensor` with `n` 2 needs a list of 2 numbers",
        ),
        ("return range(3)", "returns a list of 3; a `script_sensor` with `n` 2"),
        ("return 1", "returns an int; a `script_sensor` with `n` 2 needs a list of 2 numbers"),
        ("return 'ab'", "returns a string; a `script_sensor`"),
        ("pass", "returns None; a `script_sensor`"),
        ("return [1, 'x']", "returns a string as element 1; a `script_sensor`"),
        ("return [1, None]", "returns None as element 1; a `script_sensor`"),
        ("return [1, 1 / 0]", "t.star:2: division by zero"),
        ("robot.left = 1", "`left` of a robot cannot be changed here; `sense` returns a list"),
        ("robot.carries = True", "`carries` of a robot cannot be changed here; `sense` returns"),
        (
            "return [robot.world.robots[1].random(), 0] if robot.id == 0 else [0, 0]",
            "draws for itself only in `control`, `move` or `sense`",
        ),
        ("[0 for i in range(999) for j in range(999) if False]", "does too much"),
    ] {
        let error = failure(&sensing(&format!("def sense(robot):\n    {body}{FITNESS}"), 20));
        assert!(error.contains(reason), "{body}: {error}");
        assert!(error.contains(", for robot 0 (in step 0 of generation 3"), "{body}: {error}");
    }
}

#[test]
fn only_a_script_sensor_gives_the_name_sense_a_meaning() {
    let error = Simulation::compile(&sensing(FITNESS, 10)).unwrap_err().to_string();
    assert!(error.contains("t.star: has no function `sense`, but `world.objects.robotA.sensors.script_sensor` leaves"), "{error}");
    let helper = "def sense(robot, factor):\n    return factor * robot.x";
    let error = Simulation::compile(&sensing(&format!("{helper}{FITNESS}"), 10)).unwrap_err();
    assert!(error.to_string().contains("t.star:1: `sense` takes 1 argument, not 2"), "{error}");
    let text = format!("{helper}{FITNESS}");
    Simulation::compile(&with_script(experiment_a(), "t.star", &text)).unwrap();
    // A built-in fitness function, with a `script_sensor` and without one.
    let mut config = sensing("def sense(robot):\n    return [0, 1]", 10);
    config.algorithm.fitness_function = experiment_d().algorithm.fitness_function;
    Simulation::compile(&config).unwrap();
    robots(&mut config).sensors.script_sensor = None;
    config.topology = experiment_d().topology;
    let error = Simulation::compile(&config).unwrap_err().to_string();
    assert!(error.contains("no robot has a `script_sensor`"), "{error}");
}
