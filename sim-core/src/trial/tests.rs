//! The phases of a step: hearing, readings and messages of robots.

use super::*;
use crate::communication::FrameOrigin;
use crate::testing::{experiment_a, robot};
use experiment_file::{ExperimentConfig, Initializer, SendingDirection};
use std::f64::consts::FRAC_PI_2;

/// Number of first steps in which all robots send.
const SENDING_STEPS: u32 = 10;

/// Robots with heading 0 in a line, 90 cm apart: each hears its neighbours.
fn line(n: u32) -> ExperimentConfig {
    let mut config = experiment_a();
    config.world.width = 5000.0;
    let robot = robot(&mut config);
    robot.num_instances = n;
    let values = (0..n).map(|index| vec![100.0 + 90.0 * f64::from(index), 500.0]).collect();
    robot.initializers.positions = Initializer::Fixed { values };
    robot.initializers.orientations = Initializer::Fixed { values: vec![vec![0.0]] };
    robot.perturbations.leader_failure = None;
    config
}

/// Gives robots' networks the sending direction instead of the receiving direction.
fn observe_sending_direction(config: &mut ExperimentConfig) {
    let mut stimuli = config.topology.stimuli.values_mut();
    let direction = stimuli
        .find(|stimulus| stimulus.sensor == SensorQuery::ReceiverReceivingDirection)
        .unwrap();
    direction.sensor = SensorQuery::ReceiverSendingDirection;
}

/// One step in which robots use these modes and this message.
fn step(trial: &mut Trial<'_>, modes: &[Mode], message: [f64; 2]) {
    trial.sense(SENDING_STEPS).unwrap();
    trial.swarm.modes.copy_from_slice(modes);
    for own in trial.swarm.messages.chunks_exact_mut(2) {
        own.copy_from_slice(&message);
    }
    trial.act(SENDING_STEPS).unwrap();
}

#[test]
fn a_frame_crosses_a_line_one_hop_per_step_and_dies_at_max_hops() {
    let mut config = line(14);
    observe_sending_direction(&mut config);
    let simulation = Simulation::compile(&config).unwrap();
    let mut trial = Trial::new(&simulation, TrialSet::Generation(0), 0, &|| true).unwrap();
    let mut modes = [Mode::Relay; 14];
    modes[0] = Mode::Send;
    step(&mut trial, &modes, [1.0, 0.0]);
    for hop in 1..30 {
        step(&mut trial, &[Mode::Relay; 14], [0.0, 1.0]);
        assert_eq!(trial.swarm.received[0], None, "a frame came home after {hop} hops");
        for robot in hop + 1..14 {
            assert_eq!(trial.swarm.received[robot], None, "step {hop}, robot {robot}");
        }
        if hop > 9 {
            assert!(trial.swarm.received.iter().all(Option::is_none), "step {hop}");
            continue;
        }
        let received = trial.swarm.received[hop].unwrap();
        let origin =
            FrameOrigin { originator: 0, hops: hop as u32, sending_direction: Vec2::new(1.0, 0.0) };
        assert_eq!(received.origin, origin);
        assert_eq!(received.sector, 2);
        assert!((received.receiving_direction.x + 1.0).abs() < 1e-15);
        assert!((received.signal() - libm::exp(-0.05 * 90.0)).abs() < 1e-15);
        assert_eq!(trial.swarm.received_messages[2 * hop..2 * hop + 2], [1.0, 0.0]);
    }
}

#[test]
fn the_sending_direction_is_that_of_the_emitter_or_of_the_originator() {
    for (whose, expected) in
        [(SendingDirection::Emitter, (0.0, -1.0)), (SendingDirection::Originator, (1.0, 0.0))]
    {
        // Robot 1 looks along y and relays robot 0's frame to robot 2, on its right.
        let mut config = line(3);
        observe_sending_direction(&mut config);
        let robot = robot(&mut config);
        robot.sensors.wireless_receiver.as_mut().unwrap().sending_direction = whose;
        let headings = [0.0, FRAC_PI_2, 0.0].map(|heading| vec![heading]);
        robot.initializers.orientations = Initializer::Fixed { values: headings.to_vec() };
        let simulation = Simulation::compile(&config).unwrap();
        let mut trial = Trial::new(&simulation, TrialSet::Generation(0), 0, &|| true).unwrap();
        for _ in 0..3 {
            step(&mut trial, &[Mode::Send, Mode::Relay, Mode::Relay], [1.0, 0.0]);
        }
        let received = trial.swarm.received[2].unwrap();
        assert_eq!(received.origin.hops, 2);
        let direction = received.sending_direction;
        assert!((direction.x - expected.0).abs() < 1e-15, "{direction:?}");
        assert!((direction.y - expected.1).abs() < 1e-15, "{direction:?}");
    }
}

#[test]
fn nothing_is_heard_in_the_first_step_and_everyone_sends_in_the_first_ten() {
    let simulation = Simulation::compile(&line(2)).unwrap();
    let mut trial = Trial::new(&simulation, TrialSet::Generation(0), 0, &|| true).unwrap();
    for step in 0..12 {
        trial.sense(step).unwrap();
        // On the air: the frames of step - 1.
        let heard = (1..=10).contains(&step);
        assert_eq!(trial.swarm.received[0].is_some(), heard, "step {step}");
        trial.swarm.modes.fill(Mode::Relay);
        trial.act(step).unwrap();
    }
}

#[test]
fn robots_may_be_heard_from_the_first_step_on_and_send_for_longer() {
    let mut config = line(2);
    observe_sending_direction(&mut config);
    let transmitter = &mut robot(&mut config).actuators.wireless_transmitter;
    let transmitter = transmitter.as_mut().unwrap();
    (transmitter.initial_frame, transmitter.sending_steps) = (true, 11);
    let simulation = Simulation::compile(&config).unwrap();
    let mut trial = Trial::new(&simulation, TrialSet::Generation(0), 0, &|| true).unwrap();
    for step in 0..13 {
        trial.sense(step).unwrap();
        let received = trial.swarm.received[0];
        assert_eq!(received.is_some(), step <= 11, "step {step}");
        if step == 0 {
            assert_eq!(trial.swarm.received_messages, [0.0; 4]);
            let received = received.unwrap();
            assert_eq!((received.origin.originator, received.origin.hops), (1, 1));
            assert!((received.sending_direction.x + 1.0).abs() < 1e-15);
        }
        trial.swarm.modes.fill(Mode::Relay);
        trial.act(step).unwrap();
    }
}

#[test]
fn receivers_without_a_frame_read_zero_and_their_own_mode() {
    let mut config = line(2);
    observe_sending_direction(&mut config);
    let simulation = Simulation::compile(&config).unwrap();
    let mut trial = Trial::new(&simulation, TrialSet::Generation(0), 0, &|| true).unwrap();
    let read_value = |trial: &Trial<'_>, query, value| {
        let mut row = [7.0; 2];
        trial.groups[0].senses.write(query, value, 0..2, &trial.swarm, &mut row);
        row[0]
    };
    let read = |trial: &Trial<'_>, query| [0, 1].map(|value| read_value(trial, query, value));
    trial.sense(0).unwrap();
    assert_eq!(read_value(&trial, SensorQuery::ReceiverState, 0), 1.0);
    assert_eq!(read(&trial, SensorQuery::ReceiverMessage), [0.0; 2]);
    assert_eq!(read_value(&trial, SensorQuery::ReceiverSignal, 0), 0.0);
    assert_eq!(read(&trial, SensorQuery::ReceiverReceivingDirection), [0.0; 2]);
    assert_eq!(read(&trial, SensorQuery::ReceiverSendingDirection), [0.0; 2]);
    trial.swarm.messages.copy_from_slice(&[0.0, 0.0, 1.0, 0.0]);
    trial.act(0).unwrap();
    trial.swarm.modes[0] = Mode::Relay;
    trial.sense(1).unwrap();
    assert_eq!(read_value(&trial, SensorQuery::ReceiverState, 0), 0.0);
    assert_eq!(read(&trial, SensorQuery::ReceiverMessage), [1.0, 0.0]);
    assert_eq!(read_value(&trial, SensorQuery::ReceiverSignal, 0), libm::exp(-4.5) as f32);
    assert_eq!(read(&trial, SensorQuery::ReceiverReceivingDirection), [1.0, 0.0]);
    let sent = read(&trial, SensorQuery::ReceiverSendingDirection);
    assert!((sent[0] + 1.0).abs() < 1e-7 && sent[1].abs() < 1e-7, "{sent:?}");
}

#[test]
fn the_choice_is_uniform_among_the_sectors_with_a_valid_frame() {
    let simulation = Simulation::compile(&line(3)).unwrap();
    let mut trial = Trial::new(&simulation, TrialSet::Generation(0), 0, &|| true).unwrap();
    step(&mut trial, &[Mode::Send; 3], [0.0; 2]);
    let mut from_right = 0;
    for _ in 0..2000 {
        step(&mut trial, &[Mode::Send; 3], [0.0; 2]);
        from_right += usize::from(trial.swarm.received[1].unwrap().sector == 0);
    }
    assert!((900..1100).contains(&from_right), "{from_right}");
    step(&mut trial, &[Mode::Send, Mode::Send, Mode::Relay], [0.0; 2]);
    for _ in 0..20 {
        // Robot 2 relays robot 1's message: robot 1 can accept only robot 0's frames.
        step(&mut trial, &[Mode::Send, Mode::Send, Mode::Relay], [0.0; 2]);
        assert_eq!(trial.swarm.received[1].unwrap().sector, 2);
    }
}
