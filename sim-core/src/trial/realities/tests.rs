//! Every key of `pseudo_reality` does what it says.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use determinism::random::TrialSet;
use experiment_file::{
    BodiesConfig, BodyConfig, Boundary, Drawn, ExperimentConfig, Initializer, NeuronModel,
    PseudoRealityConfig, SensorQuery,
};

use crate::Mode;
use crate::simulation::Simulation;
use crate::testing::{
    experiment_a, experiment_a_spiking, experiment_c, experiment_d, genotype, robot,
};
use crate::torus::Vec2;
use crate::trial::Trial;

const NEUTRAL: fn() -> PseudoRealityConfig = PseudoRealityConfig::default;

fn simulation(mut config: ExperimentConfig, reality: PseudoRealityConfig) -> Simulation {
    robot(&mut config).perturbations.pseudo_reality = Some(reality);
    Simulation::compile(&config).unwrap()
}

fn trial(simulation: &Simulation, number: u32) -> Trial<'_> {
    Trial::new(simulation, TrialSet::Evaluation, number, &|| true).unwrap()
}

/// Robots with heading 0 in a line.
fn line(mut config: ExperimentConfig, n: u32, distance: f64) -> ExperimentConfig {
    config.world.width = 5000.0;
    let robot = robot(&mut config);
    robot.num_instances = n;
    let values = (0..n).map(|index| vec![100.0 + distance * f64::from(index), 500.0]).collect();
    robot.initializers.positions = Initializer::Fixed { values };
    robot.initializers.orientations = Initializer::Fixed { values: vec![vec![0.0]] };
    robot.perturbations = Default::default();
    config
}

/// One step in which all robots do the same.
fn step(trial: &mut Trial<'_>, number: u32, wheels: [f64; 2], led: u32) {
    trial.sense(number).unwrap();
    trial.swarm.wheels.fill(wheels);
    trial.swarm.leds.fill(led);
    trial.swarm.modes.fill(Mode::Send);
    trial.act(number).unwrap();
}

fn bits(simulation: &Simulation) -> Vec<u64> {
    let genotype = genotype(simulation.genotype_len(), 3);
    let fitness = simulation.evaluate(&genotype, TrialSet::Evaluation, 0..2).unwrap();
    fitness.into_iter().map(f64::to_bits).collect()
}

#[test]
fn the_neutral_reality_has_the_bits_of_none() {
    for mut config in
        [experiment_a(), experiment_a_spiking(NeuronModel::Lif), experiment_c(), experiment_d()]
    {
        config.algorithm.evaluation_steps = 120;
        let without = Simulation::compile(&config).unwrap();
        assert_eq!(bits(&simulation(config, NEUTRAL())), bits(&without));
    }
}

#[test]
fn every_trial_draws_its_reality_and_draws_it_again() {
    let reality = PseudoRealityConfig { wheel_gain: Drawn { low: 0.5, high: 1.5 }, ..NEUTRAL() };
    let simulation = simulation(experiment_c(), reality);
    let gain = |number| trial(&simulation, number).realities.unwrap().wheel_factors[0][0];
    let gains: Vec<f64> = (0..200).map(gain).collect();
    assert_eq!(gains, (0..200).map(gain).collect::<Vec<_>>());
    let mean = gains.iter().sum::<f64>() / 200.0;
    assert!((mean - 1.0).abs() < 0.08, "{mean}");
    let (low, high) = (gains.iter().copied().fold(9.0, f64::min), gains[0].max(gains[1]));
    assert!((0.5..0.53).contains(&low) && low < high, "{low} {high}");
}

#[test]
fn delayed_robots_do_later_what_others_do_now() {
    let decided = |step: u32| ([libm::sin(f64::from(step)), 0.3], step % 3);
    let path = |delay: u32| {
        let reality = PseudoRealityConfig { actuation_delay: Drawn::always(delay), ..NEUTRAL() };
        let simulation = simulation(line(experiment_c(), 2, 90.0), reality);
        let mut trial = trial(&simulation, 0);
        let steps = (0..20).map(|number| {
            let (wheels, led) = decided(number);
            step(&mut trial, number, wheels, led);
            (trial.swarm.positions[1], trial.swarm.headings[1], trial.swarm.leds[1])
        });
        steps.collect::<Vec<_>>()
    };
    let (now, late) = (path(0), path(3));
    assert_eq!(now[..17], late[3..]);
    let start = (Vec2::new(190.0, 500.0), 0.0, 0);
    assert!(late[..3].iter().all(|standing| *standing == start), "{late:?}");
}

/// The way of each of `n` robots that drive straight ahead for ten steps, and its turn.
fn ways(config: ExperimentConfig, reality: PseudoRealityConfig) -> Vec<(f64, f64)> {
    let simulation = simulation(config, reality);
    let mut trial = trial(&simulation, 0);
    let starts = trial.swarm.positions.clone();
    for number in 0..10 {
        step(&mut trial, number, [0.5, 0.5], 0);
        assert_eq!(trial.swarm.wheels[0], [0.5, 0.5], "records show what wheels are told");
    }
    let torus = &simulation.world.torus;
    let ends = trial.swarm.positions.iter().zip(&trial.swarm.headings);
    let ways = starts.iter().zip(ends).map(|(start, (end, heading))| {
        (torus.distance(*start, *end), if *heading > PI { heading - TAU } else { *heading })
    });
    ways.collect()
}

#[test]
fn half_the_gain_is_half_the_way_and_one_robot_may_be_slow() {
    let config = || line(experiment_c(), 5, 40.0);
    let whole = ways(config(), NEUTRAL());
    let half = ways(config(), PseudoRealityConfig { wheel_gain: Drawn::always(0.5), ..NEUTRAL() });
    for (whole, half) in whole.iter().zip(&half) {
        assert!((whole.0 - 2.0 * half.0).abs() < 1e-9 && half.1 == 0.0);
    }
    let one = PseudoRealityConfig { slow_robot: Drawn::always(0.0), ..NEUTRAL() };
    let standing = ways(config(), one).iter().filter(|way| way.0 == 0.0).count();
    assert_eq!(standing, 1);
    let skewed = PseudoRealityConfig { wheel_asymmetry: Drawn::always(0.1), ..NEUTRAL() };
    let turns: Vec<f64> = ways(config(), skewed).iter().map(|way| way.1).collect();
    // The difference of 10 cm/s x 0.5 x 10 % turns robots by at most 0.15 in 3.3 s.
    assert!(turns.iter().all(|turn| *turn != 0.0 && turn.abs() <= 0.151), "{turns:?}");
    assert!(turns.iter().any(|turn| *turn > 0.0) && turns.iter().any(|turn| *turn < 0.0));
}

#[test]
fn bodies_drive_by_the_same_gain() {
    let config = || {
        let mut config = line(experiment_c(), 3, 100.0);
        config.world.boundary = Boundary::Walls;
        config.world.bodies = Some(BodiesConfig::default());
        robot(&mut config).body = Some(BodyConfig::default());
        config
    };
    let whole = ways(config(), NEUTRAL());
    let half = ways(config(), PseudoRealityConfig { wheel_gain: Drawn::always(0.5), ..NEUTRAL() });
    for (whole, half) in whole.iter().zip(&half) {
        assert!(
            (whole.0 - 2.0 * half.0).abs() < 0.02 * whole.0 && whole.0 > 10.0,
            "{whole:?} {half:?}"
        );
    }
}

/// The share of robot-steps in which robots, in a line of this distance, hear something.
fn hearing(distance: f64, reality: PseudoRealityConfig) -> f64 {
    let simulation = simulation(line(experiment_a(), 8, distance), reality);
    let mut trial = trial(&simulation, 0);
    step(&mut trial, 0, [0.0; 2], 0);
    let mut n_heard = 0;
    for number in 1..101 {
        step(&mut trial, number, [0.0; 2], 0);
        n_heard += trial.swarm.received.iter().flatten().count();
        let messages = trial.swarm.received_messages.chunks_exact(2);
        let zeros = trial.swarm.received.iter().zip(messages).filter(|(frame, _)| frame.is_none());
        assert!(zeros.clone().all(|(_, message)| *message == [0.0; 2]));
    }
    f64::from(n_heard as u32) / 800.0
}

#[test]
fn the_radio_reaches_as_far_as_its_range() {
    let range = |factor| PseudoRealityConfig { radio_range: Drawn::always(factor), ..NEUTRAL() };
    // The range of the file is 100 cm.
    assert_eq!([49.0, 51.0].map(|distance| hearing(distance, range(0.5))), [1.0, 0.0]);
    assert_eq!([99.0, 101.0].map(|distance| hearing(distance, range(1.0))), [1.0, 0.0]);
    assert_eq!([149.0, 151.0].map(|distance| hearing(distance, range(1.5))), [1.0, 0.0]);
}

#[test]
fn frames_are_lost_as_often_as_the_file_says() {
    let loss = |share| PseudoRealityConfig { radio_loss: Drawn::always(share), ..NEUTRAL() };
    assert_eq!(hearing(90.0, loss(1.0)), 0.0);
    assert_eq!(hearing(90.0, loss(0.0)), 1.0);
    let heard = hearing(90.0, loss(0.3));
    assert!((heard - 0.7).abs() < 0.05, "{heard}");
}

#[test]
fn a_robot_whose_radio_is_askew_hears_in_another_sector() {
    let reality = PseudoRealityConfig { antenna_heading: Drawn::always(PI), ..NEUTRAL() };
    let simulation = simulation(line(experiment_a(), 2, 90.0), reality);
    let mut sectors = [0; 4];
    for number in 0..20 {
        let mut trial = trial(&simulation, number);
        step(&mut trial, 0, [0.0; 2], 0);
        step(&mut trial, 1, [0.0; 2], 0);
        let radios = &trial.realities.as_ref().unwrap().radios;
        let angle = radios[0].as_ref().unwrap().angle;
        // The other robot is straight ahead of the robot, so at -angle of its radio.
        let expected = (-angle / FRAC_PI_2).round().rem_euclid(4.0) as usize;
        let received = trial.swarm.received[0].unwrap();
        assert_eq!(received.sector, expected, "radio at {angle}");
        sectors[expected] += 1;
        // The robot believes in its own sectors.
        let direction = Vec2::unit(expected as f64 * FRAC_PI_2);
        assert_eq!(received.receiving_direction, direction);
    }
    assert!(sectors.iter().all(|n| *n > 0), "{sectors:?}");
}

/// Readings of all robots in many steps.
fn readings(query: SensorQuery, reality: PseudoRealityConfig) -> Vec<f64> {
    let simulation = simulation(line(experiment_d(), 10, 20.0), reality);
    let mut trial = trial(&simulation, 0);
    let group = &simulation.world.groups[0];
    let reading = *group.readings.iter().find(|(own, _)| *own == query).unwrap();
    let mut values = Vec::new();
    for number in 0..200 {
        step(&mut trial, number, [0.0; 2], 0);
        for robot in group.robots.clone().filter(|_| number > 0) {
            let senses = &trial.groups[0].senses;
            values.extend(senses.reading(reading, &group.robots, robot, &trial.swarm));
        }
    }
    values
}

#[test]
fn measured_values_have_the_gain_offset_and_noise_of_the_file() {
    for query in [SensorQuery::Light, SensorQuery::ReceiverSignal] {
        let reality = PseudoRealityConfig {
            sensor_gain: Drawn::always(0.0),
            sensor_offset: Drawn::always(0.5),
            sensor_noise: Drawn::always(0.05),
            ..NEUTRAL()
        };
        let values = readings(query, reality);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / n;
        assert!((mean - 0.5).abs() < 0.01, "{query:?}: {mean}");
        assert!((variance.sqrt() - 0.05).abs() < 0.005, "{query:?}: {variance}");
    }
    let whole = readings(SensorQuery::ReceiverSignal, NEUTRAL());
    let half = PseudoRealityConfig { sensor_gain: Drawn::always(0.5), ..NEUTRAL() };
    let half = readings(SensorQuery::ReceiverSignal, half);
    assert!(whole.iter().zip(&half).all(|(whole, half)| 0.5 * whole == *half && *whole > 0.0));
    let blind = PseudoRealityConfig { sensor_offset: Drawn::always(1.0), ..NEUTRAL() };
    let clipped = readings(SensorQuery::ReceiverSignal, blind);
    assert!(clipped.iter().all(|value| *value == 1.0));
}

#[test]
fn messages_directions_and_the_own_state_are_not_measured() {
    let reality = PseudoRealityConfig {
        sensor_gain: Drawn::always(0.3),
        sensor_offset: Drawn::always(0.2),
        sensor_noise: Drawn::always(0.1),
        ..NEUTRAL()
    };
    for query in [
        SensorQuery::ReceiverMessage,
        SensorQuery::ReceiverReceivingDirection,
        SensorQuery::ReceiverState,
    ] {
        assert_eq!(readings(query, reality), readings(query, NEUTRAL()), "{query:?}");
    }
}
