//! The task: what evolves, and whether its fitness can be measured.

use crate::report::{Path, Report, suggestion};
use crate::{
    ActuatorQuery, ExperimentConfig, FitnessFunction, NamedMap, ObjectConfig, RobotController,
};

/// Steps that `alignment` does not count.
const ALIGNMENT_SETTLING_STEPS: u32 = 100;

pub(super) fn check(config: &ExperimentConfig, report: &Report<'_>) {
    evolvable_object(config, report);
    fitness(config, report);
}

fn evolvable_object(config: &ExperimentConfig, report: &Report<'_>) {
    let name = &config.algorithm.evolvable_object;
    let path = Path::from(["algorithm", "evolvable_object"]);
    let object_path = Path::from(["world", "objects", name]);
    let problem = match config.world.objects.get(name) {
        None => {
            return report.conflict(&path, &[&Path::from(["world", "objects"]).keys()], || {
                let robots: Vec<&str> = config.robots().map(|(name, _)| name).collect();
                format!("no object is named `{name}`; {}", suggestion(name, &robots))
            });
        }
        Some(ObjectConfig::Robot(robot)) => {
            if robot.controller != RobotController::NeuralController {
                "has no `neural_controller`, so nothing of it can evolve"
            } else if !robot.params.trainable {
                "is not `trainable`"
            } else {
                return;
            }
        }
        Some(_) => "is not a robot",
    };
    report.conflict(&path, &[&object_path], || format!("`{name}` {problem}"));
}

fn fitness(config: &ExperimentConfig, report: &Report<'_>) {
    let algorithm = Path::from(["algorithm"]);
    let path = algorithm.key("fitness_function");
    let needs_output_to = |actuator: ActuatorQuery, name: &str| {
        let outputs = &config.topology.outputs;
        if !outputs.values().any(|output| output.actuator == actuator) {
            let others = each(&Path::from(["topology", "outputs"]), outputs, "actuator");
            report.conflict(&path, &each_ref(&others), || format!("needs an output to `{name}`"));
        }
    };
    match config.algorithm.fitness_function {
        FitnessFunction::IdentifyLeader | FitnessFunction::IdentifyBorderline => {
            needs_output_to(ActuatorQuery::Led, "led_actuator");
        }
        FitnessFunction::OrientationConsensus | FitnessFunction::Alignment => {
            needs_output_to(ActuatorQuery::Wheels, "wheel_actuator");
        }
        FitnessFunction::GotoLight => {
            let objects = &config.world.objects;
            let is_light = |object: &ObjectConfig| matches!(object, ObjectConfig::LightSource(_));
            if !objects.values().any(is_light) {
                let others = each(&Path::from(["world", "objects"]), objects, "type");
                report.conflict(&path, &each_ref(&others), "needs a `light_source` in the world");
            }
        }
        FitnessFunction::Grouping => {}
    }
    let steps = config.algorithm.evaluation_steps;
    if config.algorithm.fitness_function == FitnessFunction::Alignment
        && steps <= ALIGNMENT_SETTLING_STEPS
    {
        report.conflict(&algorithm.key("evaluation_steps"), &[&path], || {
            format!("is {steps}, but `alignment` counts from step {ALIGNMENT_SETTLING_STEPS} on")
        });
    }
}

/// The names of a map's entries, and one key of each.
fn each<T>(path: &Path, entries: &NamedMap<T>, key: &str) -> Vec<Path> {
    let of_entries = entries.keys().map(|name| path.key(name).key(key));
    of_entries.chain([path.keys()]).collect()
}

fn each_ref(paths: &[Path]) -> Vec<&Path> {
    paths.iter().collect()
}
