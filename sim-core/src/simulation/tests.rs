//! What a compiled experiment returns, and the calls that it refuses.

use super::*;
use crate::testing::{experiment_a, genotype, robot};
use experiment_file::{
    AimConfig, DescriptorConfig, Direction, GenotypeQuery, ScriptConfig, Summarises,
    SynapseSelector, TaskConfig,
};

#[test]
fn the_genotype_of_experiment_a_has_about_455_genes() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let d = simulation.genotype_len();
    assert!((445..=465).contains(&d), "{d}");
    assert_eq!(simulation.population_segments(), std::slice::from_ref(&(0..d)));
    assert!(simulation.uncovered_parameters().is_empty());
}

#[test]
fn measuring_changes_no_fitness_and_gives_the_measures_of_watching() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let genotype = genotype(simulation.genotype_len(), 2);
    let trial_set = TrialSet::Evaluation;
    let n_values = simulation.values_per_trial();
    assert_eq!(n_values, 1 + 300 * 2);
    let measure = |trials| {
        let measured = simulation.measure_while(&genotype, trial_set, trials, &|| true);
        measured.unwrap().unwrap()
    };
    // These are more trials than fit side by side.
    let together = measure(0..40);
    let fitness = simulation.evaluate(&genotype, trial_set, 0..40).unwrap();
    assert_eq!(together.len(), 40 * n_values);
    for (trial, row) in together.chunks_exact(n_values).enumerate() {
        assert_eq!(row[0].to_bits(), fitness[trial].to_bits());
    }
    assert_eq!(measure(31..33), together[31 * n_values..33 * n_values]);
    let mut watched = Vec::<f64>::new();
    let observe = &mut |step: &StepRecord| watched.extend(step.measures.values());
    simulation.simulate(&genotype, trial_set, 31, observe).unwrap();
    assert_eq!(watched, together[31 * n_values + 1..32 * n_values]);
    let stopped = simulation.measure_while(&genotype, trial_set, 0..1, &|| false);
    assert_eq!(stopped, Ok(None));
}

#[test]
fn trials_of_evaluations_differ_from_those_of_generations() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let genotype = genotype(simulation.genotype_len(), 2);
    let start = |trial_set: TrialSet| {
        let mut positions = Vec::new();
        let observe = &mut |step: &StepRecord| {
            positions.extend(step.robots.iter().map(|robot| robot.position));
        };
        simulation.simulate(&genotype, trial_set, 0, observe).unwrap();
        positions
    };
    assert_ne!(start(TrialSet::Evaluation), start(TrialSet::Generation(0)));
    assert_ne!(start(TrialSet::Evaluation), start(TrialSet::HeldOut { generation: 0, block: 0 }));
}

#[test]
fn an_evaluation_stops_when_keep_going_returns_false() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let genotype = genotype(simulation.genotype_len(), 1);
    let n_asked = std::cell::Cell::new(0);
    let keep_going = || n_asked.replace(n_asked.get() + 1) < 7;
    assert_eq!(simulation.evaluate_while(&genotype, 0, 0..2, &keep_going), Ok(None));
    assert_eq!(n_asked.get(), 8, "asked before every step");
    let whole = simulation.evaluate(&genotype, 0, 0..2).unwrap();
    assert_eq!(simulation.evaluate_while(&genotype, 0, 0..2, &|| true), Ok(Some(whole)));
}

#[test]
fn a_trial_does_not_depend_on_the_trials_beside_it() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    for seed in 0..3 {
        let genotype = genotype(simulation.genotype_len(), seed);
        let together = simulation.evaluate(&genotype, 7, 0..5).unwrap();
        for trial in 0..5 {
            let alone = simulation.evaluate(&genotype, 7, trial..trial + 1).unwrap();
            assert_eq!(alone[0].to_bits(), together[trial as usize].to_bits());
        }
    }
}

#[test]
fn fitness_varies_with_genotype_generation_and_trial_only() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let mut seen = Vec::new();
    for seed in 0..20 {
        let genotype = genotype(simulation.genotype_len(), seed);
        let fitness = simulation.evaluate(&genotype, 0, 0..5).unwrap();
        assert_eq!(fitness, simulation.evaluate(&genotype, 0, 0..5).unwrap());
        assert!(fitness.iter().all(|f| (0.0..=2.45).contains(f)), "{fitness:?}");
        seen.push(fitness);
    }
    seen.sort_by(|a, b| a.partial_cmp(b).unwrap());
    seen.dedup();
    assert!(seen.len() > 5, "{seen:?}");
}

#[test]
fn genotypes_and_trials_are_checked() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let d = simulation.genotype_len();
    let mut genes = vec![0.5; d];
    let short = simulation.evaluate(&genes[1..], 0, 0..1);
    assert_eq!(short, Err(EvaluateError::GenotypeLength { expected: d, actual: d - 1 }));
    for trials in [0..0, 1000..1001, 0..1001] {
        let expected = EvaluateError::Trials { trials: trials.clone() };
        assert_eq!(simulation.evaluate(&genes, 0, trials), Err(expected));
    }
    genes[3] = 1.5;
    let outside = simulation.network_json(&genes);
    assert_eq!(outside, Err(EvaluateError::GeneOutOfRange { index: 3, value: 1.5 }));
    genes[3] = f64::NAN;
    assert!(simulation.evaluate(&genes, 0, 0..1).is_err());
}

#[test]
fn a_world_without_room_is_an_error_of_the_configuration() {
    let mut config = experiment_a();
    (config.world.width, config.world.height) = (100.0, 100.0);
    robot(&mut config).num_instances = 50;
    let error = Simulation::compile(&config).unwrap_err();
    assert_eq!(error.problems[0].path, "world.objects.robotA.initializers.positions");
}

#[test]
fn all_problems_are_reported_at_once() {
    let mut config = experiment_a();
    config.algorithm.evolvable_object = "robotB".into();
    config.topology.synapses[0].pre = vec!["nobody".into()];
    config.algorithm.populations[0].objects =
        vec![GenotypeQuery::Weights(SynapseSelector::Named("nothing".into()))];
    let error = Simulation::compile(&config).unwrap_err();
    let paths: Vec<&str> = error.problems.iter().map(|problem| &*problem.path).collect();
    assert_eq!(
        paths,
        [
            "topology.synapses.I1-H1",
            "algorithm.populations.p1.objects",
            "algorithm.evolvable_object",
        ]
    );
}

#[test]
fn the_network_can_be_read() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let d = simulation.genotype_len();
    let json = simulation.network_json(&vec![0.5; d]).unwrap();
    assert_eq!(json["neurons"].as_array().unwrap().len(), 24);
    assert_eq!(json["synapses"].as_array().unwrap().len(), d - 3 * 24);
    assert_eq!(json["synapses"][0]["weight"], 0.0);
    assert_eq!(json["synapses"][0]["pre"]["input"], 0);
    assert_eq!(json["neurons"][0]["bias"], 0.0);
    assert_eq!(json["neurons"][0]["activation"], "sigmoid");
    assert_eq!(json["stimuli"][2]["sensor"], "wireless_receiver:receiving_direction");
}

/// Descriptors of a fitness function and of a script.
fn described() -> ExperimentConfig {
    let mut config = experiment_a();
    let script =
        "def measures(world):\n    return {'late': world.step if world.step > 297 else None}";
    config.task =
        Some(TaskConfig { script: ScriptConfig { name: "late.star".into(), text: script.into() } });
    let descriptor = |measure: &str, summarises| DescriptorConfig {
        measure: measure.to_owned(),
        summarises,
        range: [0.0, 1.0],
        cells: 4,
    };
    config.algorithm.descriptors = vec![
        descriptor("one_leader", Summarises::Mean),
        descriptor("leaders", Summarises::End),
        descriptor("late", Summarises::Mean),
    ];
    config
}

#[test]
fn descriptors_are_means_and_last_values_of_the_measures() {
    let simulation = Simulation::compile(&described()).unwrap();
    assert_eq!(simulation.n_descriptors(), 3);
    let genotype = genotype(simulation.genotype_len(), 2);
    let describe = |trials| {
        let described = simulation.describe_while(&genotype, 5, trials, &|| true);
        described.unwrap().unwrap()
    };
    let together = describe(0..40);
    let fitness = simulation.evaluate(&genotype, 5, 0..40).unwrap();
    for (trial, row) in (0..).zip(together.chunks_exact(4)) {
        assert_eq!(row[0].to_bits(), fitness[trial as usize].to_bits());
        let mut last = f64::NAN;
        let observe = &mut |step: &StepRecord| last = step.measures["leaders"];
        let watched = simulation.simulate(&genotype, 5, trial, observe).unwrap();
        assert_eq!(row[1].to_bits(), watched.measures["one_leader"].to_bits());
        assert_eq!(row[2..], [last, 298.5]);
    }
    assert_eq!(describe(31..33), together[31 * 4..33 * 4]);
    let stopped = simulation.describe_while(&genotype, 5, 0..1, &|| false);
    assert_eq!(stopped, Ok(None));
}

#[test]
fn a_trial_without_a_measure_has_a_nan_of_certain_bits() {
    let mut config = described();
    config.task.as_mut().unwrap().script.text =
        "def measures(world):\n    return {'late': 1 if world.step > 999 else None}".into();
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = genotype(simulation.genotype_len(), 2);
    let row = simulation.describe_while(&genotype, 5, 0..1, &|| true).unwrap().unwrap();
    assert_eq!(row[3].to_bits(), f64::NAN.to_bits());
}

#[test]
fn a_descriptor_of_an_unknown_measure_is_refused_with_the_known_ones() {
    let mut config = described();
    config.algorithm.descriptors[1].measure = "leader".to_owned();
    let refused = Simulation::compile(&config).unwrap_err().to_string();
    assert_eq!(
        refused,
        "algorithm.descriptors[1].measure: the task has no measure `leader`; did you mean `leaders`?"
    );
}

#[test]
fn the_values_of_aims_are_those_of_descriptors_of_the_same_measures() {
    let mut config = described();
    let expected = Simulation::compile(&config).unwrap();
    let descriptors = std::mem::take(&mut config.algorithm.descriptors);
    let aim = |descriptor: DescriptorConfig| AimConfig {
        measure: descriptor.measure,
        summarises: descriptor.summarises,
        direction: Direction::Minimise,
    };
    config.algorithm.aims = descriptors.into_iter().map(aim).collect();
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = genotype(simulation.genotype_len(), 2);
    let describe = |of: &Simulation| of.describe_while(&genotype, 5, 0..3, &|| true);
    assert_eq!(describe(&simulation), describe(&expected));
    config.algorithm.aims[2].measure = "later".to_owned();
    let refused = Simulation::compile(&config).unwrap_err().to_string();
    assert!(refused.starts_with("algorithm.aims[2].measure: the task has no measure `later`"));
}
