//! Checks the task: its object can evolve, and its fitness can be measured.

use crate::fitness::Need;
use crate::report::{Path, Report, suggestion};
use crate::{
    ExperimentConfig, FitnessFunction, FitnessParams, NamedMap, ObjectConfig, RobotController,
};

pub(super) fn check(config: &ExperimentConfig, report: &Report<'_>) {
    evolvable_object(config, report);
    fitness(config, report);
    fitness_params(config, report);
}

/// Refuses constants of other fitness functions, which would have no effect.
fn fitness_params(config: &ExperimentConfig, report: &Report<'_>) {
    let function = config.algorithm.fitness_function;
    let (given, default) = (config.algorithm.fitness_params, FitnessParams::default());
    let of_alpha = function == FitnessFunction::IdentifyBorderline || config.task.is_some();
    let of_near = function == FitnessFunction::GotoLight;
    let path = Path::from(["algorithm", "fitness_params"]);
    for (key, is_used, is_given) in [
        ("alpha", of_alpha, given.alpha != default.alpha),
        ("near", of_near, given.near != default.near),
    ] {
        if is_given && !is_used {
            let others = [&Path::from(["algorithm", "fitness_function"]), &Path::from(["task"])];
            report.conflict(&path.key(key), &others, || {
                format!("`{}` has no such constant", function.name())
            });
        }
    }
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
            if robot.controller == RobotController::ScriptController {
                return report.warning(&object_path.key("controller"), || {
                    format!(
                        "the script controls `{name}`, whatever the genotype: `{name}` can be \
                         evaluated, but it does not evolve"
                    )
                });
            } else if robot.controller != RobotController::NeuralController {
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

/// Checks that the experiment meets the requirements of the fitness function.
fn fitness(config: &ExperimentConfig, report: &Report<'_>) {
    let path = Path::from(["algorithm", "fitness_function"]);
    let function = config.algorithm.fitness_function;
    for need in function.needs() {
        match *need {
            Need::OutputTo(actuator) => {
                let outputs = &config.topology.outputs;
                if !outputs.values().any(|output| output.actuator == actuator) {
                    let others = each(&Path::from(["topology", "outputs"]), outputs, "actuator");
                    report.conflict(&path, &each_ref(&others), || {
                        format!("needs an output to `{}`", actuator.name())
                    });
                }
            }
            Need::Light => {
                let objects = &config.world.objects;
                let is_light =
                    |object: &ObjectConfig| matches!(object, ObjectConfig::LightSource(_));
                if !objects.values().any(is_light) {
                    let others = each(&Path::from(["world", "objects"]), objects, "type");
                    report.conflict(
                        &path,
                        &each_ref(&others),
                        "needs a `light_source` in the world",
                    );
                }
            }
            Need::Script => {
                if config.task.is_none() {
                    report.conflict(&path, &[], "needs a `task` with a `script`");
                }
            }
            Need::StepsBeyond(first) => {
                let steps = config.algorithm.evaluation_steps;
                if steps <= first {
                    let steps_path = Path::from(["algorithm", "evaluation_steps"]);
                    report.conflict(&steps_path, &[&path], || {
                        let name = function.name();
                        format!("is {steps}, but `{name}` counts from step {first} on")
                    });
                }
            }
        }
    }
}

/// The place of a map's keys, and the places of one key in all of its entries.
fn each<T>(path: &Path, entries: &NamedMap<T>, key: &str) -> Vec<Path> {
    let of_entries = entries.keys().map(|name| path.key(name).key(key));
    of_entries.chain([path.keys()]).collect()
}

fn each_ref(paths: &[Path]) -> Vec<&Path> {
    paths.iter().collect()
}
