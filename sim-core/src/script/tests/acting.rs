//! Actions of scripts: control robots, move lights and areas, react.

use determinism::Isa;
use determinism::random::TrialSet;
use experiment_file::{
    AreaController, ExperimentConfig, LightController, ObjectConfig, RobotController,
};

use super::{measured, with_script};
use crate::record::StepRecord;
use crate::simulation::Simulation;
use crate::stepping::{Actions, Stepper};
use crate::testing::{experiment_a, experiment_d, genotype, robot};

const GOTO_LIGHT: &str = include_str!("../../../../configs/tasks/thesis/goto_light.star");
const LIGHT_ORBIT: &str = include_str!("../../../../configs/tasks/moves/light_orbit.star");

const LIGHT_PREY: &str = include_str!("../../../../configs/tasks/moves/light_prey.star");

/// The only light of a configuration.
fn light(config: &mut ExperimentConfig) -> &mut LightController {
    let mut objects = config.world.objects.values_mut();
    let light = objects.find_map(|object| match object {
        ObjectConfig::LightSource(light) => Some(&mut light.controller),
        _ => None,
    });
    light.unwrap()
}

/// Experiment D with `n_steps` steps, whose robots this script controls.
pub(super) fn controlled(text: &str, n_steps: u32) -> ExperimentConfig {
    let mut config = with_script(experiment_d(), "t.star", text);
    config.algorithm.evaluation_steps = n_steps;
    robot(&mut config).controller = RobotController::ScriptController;
    config
}

/// All steps of a trial.
pub(super) fn watch(config: &ExperimentConfig) -> Vec<StepRecord> {
    let simulation = Simulation::compile(config).unwrap();
    let genotype = genotype(simulation.genotype_len(), 1);
    let mut steps = Vec::new();
    let observe = &mut |step: &StepRecord| steps.push(step.clone());
    simulation.simulate(&genotype, TrialSet::Evaluation, 0, observe).unwrap();
    steps
}

/// The failure of an episode.
pub(super) fn failure(config: &ExperimentConfig) -> String {
    let simulation = Simulation::compile(config).unwrap();
    let genotype = vec![0.5; simulation.genotype_len()];
    simulation.evaluate(&genotype, TrialSet::Generation(3), 1..2).unwrap_err().to_string()
}

#[test]
fn the_lights_of_the_thesis_and_of_the_original_have_the_same_bits_as_scripts() {
    let mut short = experiment_d();
    // The orbit turns back about once in 100 steps.
    short.algorithm.evaluation_steps = 400;
    let orbit = light(&mut short).clone();
    for (built_in, script) in
        [(orbit, LIGHT_ORBIT), (LightController::LightPreyController {}, LIGHT_PREY)]
    {
        let mut config = with_script(short.clone(), "d.star", GOTO_LIGHT);
        *light(&mut config) = built_in;
        let built_in = measured(&Simulation::compile(&config).unwrap());
        config = with_script(config, "d.star", &format!("{GOTO_LIGHT}\n{script}"));
        *light(&mut config) = LightController::ScriptController {};
        let script = Simulation::compile(&config).unwrap();
        for isa in Isa::available() {
            assert_eq!(measured(&script.clone().with_isa(isa)), built_in, "{isa:?}");
        }
    }
}

#[test]
fn control_assigns_actions_and_robots_stand_dark_by_default() {
    let text = "\
def control(robot):
    if robot.id == 1:
        robot.left = -0.25
        robot.right = 1
        robot.mode = 'relay'
        robot.message = [0, 1]
def fitness(world):
    return sum([robot.right for robot in world.robots])
";
    let steps = watch(&controlled(text, 30));
    let [one, two] = [1, 2].map(|robot| &steps[20].robots[robot]);
    assert_eq!((one.wheels, two.wheels), ([1.0, -0.25], [0.0; 2]));
    assert_eq!(format!("{:?} {:?}", one.mode, two.mode), "Relay Send");
    assert!(one.message[0] < 0.1 && one.message[1] > 0.9, "{:?}", one.message);
    assert_eq!(steps[0].robots[2].position, steps[29].robots[2].position);
    assert_eq!(steps[20].fitness, Some(1.0));
}

/// All robots decide at the same time, so the order of the calls does not matter.
#[test]
fn a_robot_sees_the_previous_actions_of_others_not_their_plans() {
    let text = "\
def control(robot):
    robot.left = (robot.world.step % 2) / 2
    for other in robot.world.robots:
        if robot.world.step > 0 and other.left != ((robot.world.step - 1) % 2) / 2:
            fail('robot', robot.id, 'sees', other.left)
def fitness(world):
    return 1
";
    assert_eq!(watch(&controlled(text, 20)).len(), 20);
}

#[test]
fn a_robot_senses_the_stimuli_that_its_network_would_get() {
    // In experiment D, most robots' networks do not get the light.
    let text = "\
def control(robot):
    light = robot.sense('light_sensor')
    if max(light) > 0 and not robot.sees_light:
        fail('inhibited', robot.id)
    robot.state['light'] = sum(light)
    heard = robot.sense('wireless_receiver:msg')
    if (robot.heard or [0, 0]) != heard or len(robot.sense('wireless_receiver:signal')) != 1:
        fail('heard', robot.id)
def fitness(world):
    return sum([robot.state.get('light', 0) for robot in world.robots])
";
    let mut config = controlled(text, 40);
    let steps = watch(&config);
    // Networks of the same robots get the same readings in the first step, because the robots are
    // at the same places.
    robot(&mut config).controller = RobotController::NeuralController;
    let of_networks = watch(&config);
    let inputs = config.topology.stimuli.iter().scan(0, |first, (_, stimulus)| {
        *first += stimulus.n as usize;
        Some((stimulus.sensor.name(), *first - stimulus.n as usize..*first))
    });
    let light = inputs.filter(|(name, _)| *name == "light_sensor").map(|(_, inputs)| inputs).next();
    let light = light.unwrap();
    let sum: f64 =
        of_networks[0].robots.iter().flat_map(|robot| &robot.stimuli[light.clone()]).sum();
    assert!((steps[0].fitness.unwrap() - sum).abs() < 1e-5 && sum > 0.0, "{sum}");
}

#[test]
fn robots_draw_from_streams_of_their_own() {
    let text = |who: &str| {
        format!(
            "def control(robot):\n    if {who}:\n        robot.right = robot.random()\n\
             def fitness(world):\n    return world.robots[3].right"
        )
    };
    let fitness = |who| {
        let steps = watch(&controlled(&text(who), 10));
        steps.iter().map(|step| step.fitness.unwrap()).collect::<Vec<_>>()
    };
    let (all, alone) = (fitness("True"), fitness("robot.id == 3"));
    assert_eq!(all, alone);
    assert!(all.windows(2).all(|pair| pair[0] != pair[1]), "{all:?}");
}

#[test]
fn the_same_bits_alone_side_by_side_step_by_step_and_on_every_instruction_set() {
    let text = format!(
        "{GOTO_LIGHT}
def control(robot):
    light = robot.sense('light_sensor')
    robot.left = min(light[0] + 0.2 + 0.1 * robot.random(), 1)
    robot.right = min(max(light) + 0.3, 1)
    robot.message = [robot.random(), 0.5]
{LIGHT_ORBIT}
def react(world):
    for robot in world.robots:
        robot.failed = (world.step + robot.id) % 7 == 0
    world.lights[0].on = world.step % 5 > 0
"
    );
    let mut config = controlled(&text, 60);
    *light(&mut config) = LightController::ScriptController {};
    let simulation = Simulation::compile(&config).unwrap();
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
    for _ in 0..60 {
        stepper.step(&Actions::default()).unwrap();
    }
    assert_eq!(stepper.fitness(), together);
}

#[test]
fn a_robot_that_failed_stands_dark_and_unheard_until_it_works_again() {
    let text = "\
def react(world):
    world.robots[0].failed = world.step >= 20 and world.step < 40
def fitness(world):
    return 1
";
    let mut config = with_script(experiment_a(), "t.star", text);
    config.algorithm.evaluation_steps = 60;
    let steps = watch(&config);
    let hears_it = |step: &StepRecord| {
        step.robots.iter().any(|robot| robot.received.is_some_and(|frame| frame.emitter == 0))
    };
    let n_heard =
        |range: std::ops::Range<usize>| steps[range].iter().filter(|step| hears_it(step)).count();
    assert!(n_heard(0..21) > 0 && n_heard(41..60) > 0);
    // At the end of step 20, the script makes the robot fail.
    assert_eq!(n_heard(21..41), 0);
    for step in &steps {
        assert_eq!(step.robots[0].failed, (20..40).contains(&step.step), "step {}", step.step);
        assert!(!(21..=40).contains(&step.step) || step.robots[0].led == 0, "step {}", step.step);
    }
    // When a robot fails, others hear the robots behind it instead.
    assert!(steps[25].robots.iter().skip(1).all(|robot| robot.received.is_some()));
}

#[test]
fn sensors_do_not_see_things_that_are_off_and_the_script_moves_things() {
    let text = "\
def control(robot):
    robot.state['seen'] = max(robot.sense('light_sensor')) + robot.sense('ground_sensor')[0]
def move(thing):
    if thing.world.step == 4:
        return None
    return (thing.x + thing.world.width + 1, thing.y - 2)
def react(world):
    on = world.step != 2
    world.areas[0].on = on
    world.lights[0].on = on
    for robot in world.robots:
        robot.carries = on
def fitness(world):
    if world.areas[0].on != world.lights[0].on or world.robots[0].carries != world.areas[0].on:
        fail('on')
    return sum([robot.state['seen'] for robot in world.robots])
";
    let mut config = controlled(text, 6);
    *light(&mut config) = LightController::ScriptController {};
    let area = serde_json::json!({
        "type": "ground_area", "num_instances": 1, "controller": "script_controller",
        "initializers": {"positions": {"name": "fixed", "params": {"values": [[500, 500]]}}},
        "params": {"range": 400.0},
    });
    let mut file = serde_json::to_value(&config).unwrap();
    file["world"]["objects"]["ground"] = area;
    let sensors = &mut file["world"]["objects"]["robotA"]["sensors"];
    sensors["ground_sensor"] = serde_json::json!({});
    sensors["light_sensor"]["noise_variance"] = serde_json::json!(0);
    let (config, _) =
        ExperimentConfig::from_json(&file.to_string(), "t", evolution::ALGORITHMS).unwrap();
    let ObjectConfig::GroundArea(area) = &config.world.objects["ground"] else { panic!() };
    assert_eq!(area.controller, Some(AreaController::ScriptController));
    let steps = watch(&config);
    for pair in steps.windows(2) {
        let stays = pair[0].step == 4;
        for (before, after) in
            [(pair[0].areas[0], pair[1].areas[0]), (pair[0].lights[0], pair[1].lights[0])]
        {
            let way = if stays { (0.0, 0.0) } else { (1.0, -2.0) };
            assert!((after.x - before.x - way.0).abs() + (after.y - before.y - way.1).abs() < 1e-9);
        }
    }
    let seen: Vec<bool> = steps.iter().map(|step| step.fitness.unwrap() > 0.0).collect();
    assert_eq!(seen, [true, true, true, false, true, true]);
}

#[test]
fn errors_name_their_place_reason_and_object() {
    let fitness = "def fitness(world):\n    return 1\n";
    for (body, reason) in [
        ("robot.left = 2", "t.star:2: the action of a wheel is in [-1, 1], not 2"),
        ("robot.right = 0 * math.inf", "is in [-1, 1], not NaN"),
        ("robot.led = 1", "have no `led_actuator`"),
        ("robot.message = [0]", "a `message` is a list of 2 numbers in [0, 1], not of 1"),
        ("robot.message = [0, 7]", "a component of a message is in [0, 1], not 7"),
        ("robot.mode = 'shout'", "a `mode` is \"send\" or \"relay\""),
        ("robot.x = 1", "`x` of a robot cannot be changed here; `control` sets `left`"),
        ("robot.world.robots[1].left = 1", "for robot 0"),
        ("robot.sense('light')", "have no reading `light`; did you mean `light_sensor`?"),
        ("robot.sense(1)", "`sense` takes the name of a reading"),
        ("return 1", "returns an int; assign a robot's actions instead"),
        ("robot.world.lights[0].random()", "draws for itself only in `control`, `move` or `sense`"),
        ("[0 for i in range(999) for j in range(999) if False]", "does too much"),
    ] {
        let text = format!("def control(robot):\n    {body}\n{fitness}");
        let error = failure(&controlled(&text, 20));
        assert!(error.contains(reason), "{body}: {error}");
        assert!(
            error.contains(", for robot ") && error.ends_with(" of generation 3, trial 1)"),
            "{error}"
        );
    }
    for (body, reason) in [
        ("return 'away'", "`move` returns neither a place nor None: a point is"),
        ("return (math.inf, 0)", "a point is a thing or two finite numbers"),
        ("thing.x = 3", "`move` returns the new place"),
        ("return (0, thing.robots)", "a light has no `robots`"),
    ] {
        let mut config = with_script(
            experiment_d(),
            "t.star",
            &format!("def move(thing):\n    {body}\n{fitness}"),
        );
        *light(&mut config) = LightController::ScriptController {};
        let error = failure(&config);
        assert!(
            error.contains(reason) && error.contains(", for light 0 (in step 0"),
            "{body}: {error}"
        );
    }
    for (body, reason) in [
        ("world.robots[0].failed = 1", "`failed` is True or False, not an int"),
        ("world.robots[0].led = 1", "`react` sets `failed` and `carries` of robots"),
        ("world.step = 1", "`step` of the world cannot be changed here"),
        ("return True", "returns a bool; let it change things instead"),
    ] {
        let text = format!("def react(world):\n    {body}\n{fitness}");
        let error = failure(&with_script(experiment_a(), "t.star", &text));
        assert!(error.contains(reason), "{body}: {error}");
    }
}

#[test]
fn a_world_with_script_controllers_needs_their_functions() {
    let mut config = controlled("def fitness(world):\n    return 1", 10);
    *light(&mut config) = LightController::ScriptController {};
    let error = Simulation::compile(&config).unwrap_err().to_string();
    for function in ["control", "move"] {
        assert!(error.contains(&format!("t.star: has no function `{function}`, but")), "{error}");
    }
}
