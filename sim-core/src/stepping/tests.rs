//! Steps with given actions, with replaced stimuli, and with silent agents.

use super::*;
use crate::testing::{experiment_a, experiment_a_spiking, genotype, robot};
use experiment_file::{
    Drawn, EncodingConfig, EncodingScheme, ExperimentConfig, GenotypeQuery, InhibitedStimulus,
    LearningConfig, LinearField, NeuronModel, PseudoRealityConfig, ReceptiveField, RewardConfig,
    SensorQuery, StimuliInhibitionConfig, StimulusSelector,
};

/// Leader selection with LIF neurons that learn; one stimulus has random spikes.
fn experiment_a_plastic() -> ExperimentConfig {
    let mut config = experiment_a_spiking(NeuronModel::Lif);
    let receptive_field = ReceptiveField::Linear(LinearField { n_neurons: 3 });
    let encoding = EncodingConfig { scheme: EncodingScheme::PoissonRate, receptive_field };
    config.topology.encoding.insert("I1".to_owned(), encoding);
    config.topology.learning = Some(LearningConfig {
        learning_rate: 1.0,
        max_weight: 300.0,
        a: 500.0,
        b: 0.0,
        c: -20.0,
        d: 0.0,
        synapses: vec!["I1-H1".to_owned(), "H1-H1".to_owned()],
        reward: Some(RewardConfig { delay: 5, discount: 0.9 }),
    });
    let population = &mut config.algorithm.populations[0];
    population.objects.push(GenotypeQuery::Encoders(StimulusSelector::All));
    population.min_vals.push(0.0);
    population.max_vals.push(5_000.0);
    config
}

#[test]
fn stepping_with_the_network_of_a_genotype_gives_the_bits_of_its_simulation() {
    let mut elsewhere = experiment_a();
    robot(&mut elsewhere).perturbations.pseudo_reality = Some(PseudoRealityConfig {
        actuation_delay: Drawn { low: 1, high: 5 },
        sensor_noise: Drawn::always(0.1),
        radio_loss: Drawn { low: 0.1, high: 0.5 },
        ..Default::default()
    });
    for config in [experiment_a(), experiment_a_plastic(), elsewhere] {
        assert_stepping_gives_the_bits(&Simulation::compile(&config).unwrap());
    }
}

fn assert_stepping_gives_the_bits(simulation: &Simulation) {
    let genotype = genotype(simulation.genotype_len(), 3);
    let trial_set = TrialSet::Generation(4);
    let mut stepper = Stepper::new(simulation, trial_set, 2..5).unwrap();
    let mut policy = stepper.policy(&genotype).unwrap();
    let (mut fitness, mut stimuli) = (Vec::new(), Vec::new());
    for _ in 0..simulation.n_steps() {
        stimuli.push(stepper.stimuli());
        let actions = stepper.decide(&mut policy);
        fitness.push(stepper.step(&actions).unwrap());
    }
    assert_eq!(stepper.fitness(), simulation.evaluate(&genotype, trial_set, 2..5).unwrap());
    let width = stepper.n_inputs();
    let n_values = stepper.agents().len() * width;
    simulation
        .simulate(&genotype, trial_set, 3, &mut |record| {
            let step = record.step as usize;
            assert_eq!(record.fitness, fitness[step][1], "step {step}");
            let expected = record.robots.iter().flat_map(|robot| &robot.stimuli);
            let actual = &stimuli[step][n_values..2 * n_values];
            assert!(
                expected.eq(actual
                    .iter()
                    .map(|&value| f64::from(value))
                    .collect::<Vec<_>>()
                    .iter())
            );
        })
        .unwrap();
    let actions = stepper.decide(&mut policy);
    assert_eq!(stepper.step(&actions), Err(StepError::Over(simulation.n_steps())));
}

#[test]
fn agents_decide_by_the_stimuli_that_the_caller_sets() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let genotype = genotype(simulation.genotype_len(), 3);
    let episode = |changed: Option<f32>| {
        let mut stepper = Stepper::new(&simulation, TrialSet::Evaluation, 0..2).unwrap();
        let mut policy = stepper.policy(&genotype).unwrap();
        let mut course = Vec::new();
        for step in 0..30 {
            let mut stimuli = stepper.stimuli();
            if let Some(value) = changed.filter(|_| step == 12) {
                stimuli.fill(value);
            }
            stepper.set_stimuli(&stimuli).unwrap();
            assert_eq!(stepper.stimuli(), stimuli);
            course.push(stepper.decide(&mut policy));
            stepper.step(&course[step]).unwrap();
        }
        course
    };
    let (as_it_was, otherwise) = (episode(None), episode(Some(1.0)));
    assert_eq!(as_it_was[..12], otherwise[..12]);
    assert_ne!(as_it_was[12], otherwise[12]);

    let mut stepper = Stepper::new(&simulation, TrialSet::Evaluation, 0..2).unwrap();
    let before = stepper.stimuli();
    let short = stepper.set_stimuli(&before[1..]);
    assert!(matches!(short, Err(StepError::Length { what: "stimuli", .. })));
    let mut wrong = vec![0.5; before.len()];
    wrong[7] = f32::NAN;
    assert!(matches!(stepper.set_stimuli(&wrong), Err(StepError::Range { index: 7, .. })));
    assert_eq!(stepper.stimuli(), before);
}

#[test]
fn inhibited_stimuli_stay_zero_when_the_caller_sets_stimuli() {
    let mut config = experiment_a();
    robot(&mut config).perturbations.stimuli_inhibition = vec![StimuliInhibitionConfig {
        stimuli: InhibitedStimulus::Reading(SensorQuery::ReceiverState),
        affected_robots: 4,
    }];
    let simulation = Simulation::compile(&config).unwrap();
    let mut stepper = Stepper::new(&simulation, TrialSet::Evaluation, 0..2).unwrap();
    let given = vec![0.5; stepper.stimuli().len()];
    stepper.set_stimuli(&given).unwrap();
    let zeros = stepper.stimuli().iter().filter(|value| **value == 0.0).count();
    assert_eq!(zeros, 2 * 4);
}

#[test]
fn a_silent_robot_is_unheard_in_the_next_step_only() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let genotype = genotype(simulation.genotype_len(), 3);
    let mut stepper = Stepper::new(&simulation, TrialSet::Evaluation, 0..2).unwrap();
    let mut policy = stepper.policy(&genotype).unwrap();
    let (n_agents, n_inputs) = (stepper.agents().len(), stepper.n_inputs());
    let stimuli = &simulation.world.groups[0].stimuli;
    let direction =
        stimuli.iter().find(|(query, _)| *query == SensorQuery::ReceiverReceivingDirection);
    let direction = direction.unwrap().1.clone();
    for step in 0..9 {
        let mut silent = vec![false; 2 * n_agents];
        if step == 4 {
            silent[..n_agents].fill(true);
        }
        stepper.silence(&silent).unwrap();
        let actions = stepper.decide(&mut policy);
        stepper.step(&actions).unwrap();
        assert!(stepper.sent().iter().all(|sent| *sent), "all robots send in the first steps");
        // Every robot has a neighbour, so every robot hears a frame.
        for (index, stimuli) in stepper.stimuli().chunks_exact(n_inputs).enumerate() {
            let hears = stimuli[direction.clone()].iter().any(|value| *value != 0.0);
            assert_eq!(hears, step != 4 || index >= n_agents, "{index}, after step {step}");
        }
    }
    let short = stepper.silence(&[true]);
    assert!(matches!(short, Err(StepError::Length { what: "silence flags", .. })));
}

#[test]
fn actions_that_do_not_fit_are_refused_and_no_step_is_taken() {
    let simulation = Simulation::compile(&experiment_a()).unwrap();
    let mut stepper = Stepper::new(&simulation, TrialSet::Evaluation, 0..1).unwrap();
    let mut policy = stepper.policy(&genotype(simulation.genotype_len(), 1)).unwrap();
    let actions = stepper.decide(&mut policy);
    let mut short = actions.clone();
    short.leds.pop();
    assert!(matches!(stepper.step(&short), Err(StepError::Length { what: "LEDs", .. })));
    for value in [f64::NAN, -0.1, 1.1] {
        let mut wrong = actions.clone();
        wrong.messages[1] = value;
        let refused = stepper.step(&wrong).unwrap_err();
        assert!(matches!(refused, StepError::Range { index: 1, .. }), "{refused}");
    }
    assert_eq!(stepper.n_steps_done(), 0);
    assert!(stepper.step(&actions).is_ok());
}
