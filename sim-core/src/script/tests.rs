//! Scripts in episodes: the built-in tasks as scripts, to the same bits, and failures.

mod acting;
mod bodies;
mod sensing;

use determinism::Isa;
use determinism::random::TrialSet;
use experiment_file::{
    ExperimentConfig, FitnessFunction, LightController, ScriptConfig, TaskConfig,
};

use crate::simulation::{EvaluateError, Simulation};
use crate::testing::{experiment_a, experiment_b, experiment_c, experiment_d, genotype};

fn with_script(mut config: ExperimentConfig, name: &str, text: &str) -> ExperimentConfig {
    config.algorithm.fitness_function = FitnessFunction::Script;
    let script = ScriptConfig { name: name.into(), text: text.into() };
    config.task = Some(TaskConfig { script });
    config
}

const N_TRIALS: u32 = 2;

/// Fitness of some trials, and the measures of all steps.
fn measured(simulation: &Simulation) -> Vec<Vec<u64>> {
    let trials = (0..2_u64).map(|seed| {
        let genotype = genotype(simulation.genotype_len(), seed);
        let trial_set = TrialSet::Generation(seed);
        let values = simulation.measure_while(&genotype, trial_set, 0..N_TRIALS, &|| true);
        let values = values.unwrap().unwrap();
        let fitness = simulation.evaluate(&genotype, trial_set, 0..N_TRIALS).unwrap();
        assert_eq!(fitness[0], values[0], "measuring changes no fitness");
        values.into_iter().map(f64::to_bits).collect()
    });
    trials.collect()
}

#[test]
fn every_built_in_task_has_the_same_bits_as_a_script() {
    macro_rules! script {
        ($name:literal) => {
            include_str!(concat!("../../../configs/tasks/thesis/", $name, ".star"))
        };
    }
    let shipped = |function: FitnessFunction| match function {
        FitnessFunction::IdentifyLeader => (experiment_a(), script!("identify_leader")),
        FitnessFunction::IdentifyBorderline => (experiment_b(), script!("identify_borderline")),
        FitnessFunction::OrientationConsensus => (experiment_c(), script!("orientation_consensus")),
        FitnessFunction::Alignment => (experiment_c(), script!("alignment")),
        FitnessFunction::GotoLight => (experiment_d(), script!("goto_light")),
        FitnessFunction::Grouping => (experiment_d(), script!("grouping")),
        FitnessFunction::Script => unreachable!("scripts are compared with the other functions"),
    };
    let built_in =
        FitnessFunction::ALL.iter().filter(|function| **function != FitnessFunction::Script);
    for &function in built_in {
        let (mut config, text) = shipped(function);
        config.algorithm.fitness_function = function;
        config.algorithm.evaluation_steps = 130;
        let rust = Simulation::compile(&config).unwrap();
        let name = format!("{}.star", function.name());
        let script = Simulation::compile(&with_script(config, &name, text)).unwrap();
        let (rust_values, script_values) = (measured(&rust), measured(&script));
        // A script may lack measures; then the test compares only fitness.
        if script.measure_names().is_empty() {
            for (rust, script) in rust_values.iter().zip(&script_values) {
                let fitness: Vec<u64> =
                    rust.iter().step_by(rust.len() / N_TRIALS as usize).copied().collect();
                assert_eq!(script, &fitness, "{name}");
            }
        } else {
            assert_eq!(rust.measure_names(), script.measure_names());
            assert_eq!(rust_values, script_values, "{name}");
        }
        for isa in Isa::available() {
            assert_eq!(measured(&script.clone().with_isa(isa)), script_values, "{name} on {isa:?}");
        }
    }
}

/// The failure of an episode of experiment A with this script.
fn failure(text: &str) -> EvaluateError {
    let config = with_script(experiment_a(), "t.star", text);
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = vec![0.5; simulation.genotype_len()];
    simulation.evaluate(&genotype, TrialSet::Generation(3), 1..3).unwrap_err()
}

#[test]
fn a_failing_script_ends_its_item_with_file_line_and_reason() {
    for (body, reason) in [
        ("return 1 / (world.step - 5)", "division by zero"),
        ("return 'much'", "`fitness` returns a string, not a number"),
        ("return math.inf * (world.step - 5)", "numbers are finite and at most 1e100"),
        ("return sum(range(10)) if world.step < 5 else sum(range(3000000))", "does too much"),
        ("for i in range(6000): world.border() + world.border()", "does too much"),
        ("world.state[world.step] = range(15000)", "keeps too much"),
        ("for robot in world.robots: robot.led = 1", "cannot be changed here"),
        ("return world.robots[99].x", "there is no element 99 in a list of 10"),
    ] {
        let error = failure(&format!("def fitness(world):\n    {body}\n")).to_string();
        assert!(error.starts_with("t.star:") && error.contains(reason), "{body}: {error}");
        assert!(error.contains(" of generation 3, trial 1)"), "{error}");
    }
}

#[test]
fn a_script_is_stopped_in_the_middle_of_a_step_and_has_no_result() {
    let burn = "for i in range(1000):\n            for j in range(1000): x = sorted([j, i, 2, 1])";
    let text =
        format!("def fitness(world):\n    if world.step >= 3:\n        {burn}\n    return 1.0\n");
    let simulation = Simulation::compile(&with_script(experiment_a(), "t.star", &text)).unwrap();
    let genotype = vec![0.5; simulation.genotype_len()];
    let n_asked = std::cell::Cell::new(0);
    // Steps 0 to 3 begin, and so do the calls in them.
    let keep_going = || n_asked.replace(n_asked.get() + 1) < 20;
    let stopped = simulation.evaluate_while(&genotype, 0, 0..1, &keep_going);
    assert_eq!(stopped, Ok(None));
    assert!(n_asked.get() < 25, "asked {} times", n_asked.get());
    // A script that uses up its budget fails by itself, without being stopped.
    let failed = simulation.evaluate(&genotype, 0, 0..1).unwrap_err();
    assert!(failed.to_string().contains("does too much"), "{failed}");
}

#[test]
fn scripts_that_cannot_work_are_refused_with_all_mistakes() {
    for (text, expected) in [
        ("def fitnes(world): return 1", "t.star: has none of the functions `fitness`"),
        ("def fitness(): return 1", "t.star:1: `fitness` takes 1 argument, not 0"),
        ("def fitness(w): return w.robot", "no object has a `robot`; did you mean `robots`?"),
        ("def measures(w): return {'a': 1}", "has no function `fitness` or `final`"),
        ("def fitness(w): return 1\ndef measures(w): return 1", "`measures` returns other values"),
    ] {
        let config = with_script(experiment_a(), "t.star", text);
        let error = Simulation::compile(&config).unwrap_err();
        assert!(error.to_string().contains(expected), "{text}: {error}");
        assert!(error.problems.iter().all(|problem| problem.path == "task.script"));
    }
}

#[test]
fn final_may_compute_the_fitness_and_state_lasts_from_step_to_step() {
    let text = "def fitness(world):\n    world.state['n'] = world.state.get('n', 0) + 1\n\
                def final(state):\n    return state['n'] / 4";
    let config = with_script(experiment_a(), "t.star", text);
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = vec![0.5; simulation.genotype_len()];
    let n_steps = f64::from(simulation.n_steps());
    assert_eq!(simulation.evaluate(&genotype, 0, 0..3).unwrap(), [n_steps / 4.0; 3]);
}

#[test]
fn a_script_adds_measures_to_a_built_in_fitness() {
    let text = "def measures(world): return {'half': world.step / 2, 'leaders': -1}";
    let mut config = with_script(experiment_a(), "t.star", text);
    config.algorithm.fitness_function = FitnessFunction::IdentifyLeader;
    let simulation = Simulation::compile(&config).unwrap();
    assert_eq!(simulation.measure_names(), ["leaders", "one_leader", "half"]);
    let genotype = vec![0.5; simulation.genotype_len()];
    let mut halves = Vec::new();
    let observe = &mut |step: &crate::StepRecord| halves.push(step.measures["half"]);
    simulation.simulate(&genotype, TrialSet::Evaluation, 0, observe).unwrap();
    assert_eq!(halves[..3], [0.0, 0.5, 1.0]);
}

#[test]
fn scripts_have_their_own_draws_which_are_equal_for_every_genotype() {
    let text = "def fitness(world):\n    return world.random() + 0 * world.normal()";
    let simulation = Simulation::compile(&with_script(experiment_a(), "t.star", text)).unwrap();
    let [a, b] = [0.2, 0.8].map(|gene| {
        let genotype = vec![gene; simulation.genotype_len()];
        simulation.evaluate(&genotype, 0, 0..2).unwrap()
    });
    assert_eq!(a, b);
    assert_ne!(a[0], a[1]);
}

#[test]
fn scripts_see_the_state_of_the_world() {
    let mut config = experiment_d();
    let lights = config.world.objects.values_mut().find_map(|object| match object {
        experiment_file::ObjectConfig::LightSource(light) => Some(light),
        _ => None,
    });
    lights.unwrap().controller = LightController::Static {};
    let text = "\
def fitness(world):
    a = world.robots[0]
    light = world.lights[0]
    dx, dy = world.way(a, light)
    near = [robot.id for robot in a.neighbours(300)]
    also = [b.id for b in world.robots if b.id != a.id and a.distance(b) <= 300]
    if near != also:
        fail('neighbours', len(near), len(also))
    if abs(math.hypot(dx, dy) - a.distance(light)) > 1e-9:
        fail('way')
    if abs(world.turn(a.heading + a.bearing(light), world.angle(dx, dy))) > 1e-9:
        fail('bearing')
    if world.distance((a.x, a.y), [light.x, light.y]) != a.distance(light):
        fail('points')
    if world.distance((1, 1), (world.width - 1, 1)) != 2:
        fail('torus')
    if a.group == light.group or light.color != 'red' or world.steps < 300:
        fail('names', a.group, light.group, light.color)
    return a.distance(light)
";
    let simulation = Simulation::compile(&with_script(config, "t.star", text)).unwrap();
    let genotype = genotype(simulation.genotype_len(), 1);
    assert!(simulation.evaluate(&genotype, 0, 0..2).unwrap()[0] > 0.0);
}
