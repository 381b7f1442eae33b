//! Whole episodes, seen from outside.

use std::f64::consts::TAU;

use crate::testing::*;
use crate::torus::{Torus, Vec2, angular_difference};
use crate::{EpisodeSummary, Isa, Mode, Simulation, StepRecord};
use experiment_file::{
    ActuatorQuery, DistanceSensorConfig, ExperimentConfig, GroundAreaConfig, GroundAreaParams,
    GroundSensorConfig, InhibitedStimulus, Initializer, LeaderFailureConfig, LightController,
    ObjectConfig, PositionInitializers, RobotController, SensorQuery, StimuliInhibitionConfig,
    StimulusConfig, SynapseGroupConfig, TopologySwitchConfig, UncontrollableRotationConfig,
    WholeReceiver,
};

const TORUS: Torus = Torus::new(1000.0, 1000.0);

fn experiments() -> [ExperimentConfig; 4] {
    [experiment_a(), experiment_b(), experiment_c(), experiment_d()]
}

/// The episode of a random genotype.
fn watch(config: &ExperimentConfig, seed: u64, trial: u32) -> (Vec<StepRecord>, EpisodeSummary) {
    let simulation = Simulation::compile(config).unwrap();
    let genotype = genotype(simulation.genotype_len(), seed);
    let mut steps = Vec::new();
    let summary =
        simulation.simulate(&genotype, 0, trial, &mut |step| steps.push(step.clone())).unwrap();
    assert_eq!(steps.len(), config.algorithm.evaluation_steps as usize);
    (steps, summary)
}

/// The inputs that carry a reading.
fn inputs(config: &ExperimentConfig, sensor: SensorQuery) -> std::ops::Range<usize> {
    let mut first = 0;
    for stimulus in config.topology.stimuli.values() {
        let end = first + stimulus.n as usize;
        if stimulus.sensor == sensor {
            return first..end;
        }
        first = end;
    }
    panic!("no stimulus carries {sensor:?}");
}

/// Adds a stimulus of `n` values that drives H1.
fn add_stimulus(config: &mut ExperimentConfig, name: &str, n: u32, sensor: SensorQuery) {
    config.topology.stimuli.insert(name.into(), StimulusConfig { n, sensor });
    let group = SynapseGroupConfig {
        pre: vec![name.into()],
        post: vec!["H1".into()],
        trainable: true,
        p: 1.0,
        transmitter: None,
    };
    config.topology.synapses.insert(format!("{name}-H1"), group);
}

#[test]
fn watching_and_other_trials_change_no_bit() {
    for (mut config, seed) in experiments().into_iter().zip(0..) {
        config.algorithm.evaluation_steps = 150;
        let simulation = Simulation::compile(&config).unwrap();
        let genotype = genotype(simulation.genotype_len(), seed);
        let together = simulation.evaluate(&genotype, 3, 0..5).unwrap();
        for trial in [0, 4] {
            let alone = simulation.evaluate(&genotype, 3, trial..trial + 1).unwrap()[0];
            let watched = simulation.simulate(&genotype, 3, trial, &mut |_| {}).unwrap().fitness;
            let expected = together[trial as usize].to_bits();
            assert_eq!((alone.to_bits(), watched.to_bits()), (expected, expected));
        }
    }
}

#[test]
fn every_trial_has_its_fitness_in_order() {
    let mut config = experiment_a();
    (config.algorithm.evaluation_steps, config.algorithm.num_evaluations) = (30, 60);
    let simulation = Simulation::compile(&config).unwrap();
    let genotype = genotype(simulation.genotype_len(), 18);
    let together = simulation.evaluate(&genotype, 0, 1..60).unwrap();
    let alone =
        (1..60).map(|trial| simulation.evaluate(&genotype, 0, trial..trial + 1).unwrap()[0]);
    assert_eq!(together, alone.collect::<Vec<_>>());
    assert!(together.iter().any(|&fitness| fitness > 0.0));
}

#[test]
fn fitness_is_the_mean_of_the_steps_that_count() {
    for config in &experiments() {
        let (steps, summary) = watch(config, 1, 0);
        let counted: Vec<f64> = steps.iter().filter_map(|step| step.fitness).collect();
        let mean = counted.iter().sum::<f64>() / counted.len() as f64;
        assert!((summary.fitness - mean).abs() < 1e-12);
        for (name, mean) in &summary.measures {
            let sum: f64 = steps.iter().map(|step| step.measures[name]).sum();
            assert!((sum / steps.len() as f64 - mean).abs() < 1e-9, "{name}");
        }
    }
}

#[test]
fn everything_is_finite_and_in_range() {
    for config in experiments() {
        let simulation = Simulation::compile(&config).unwrap();
        let d = simulation.genotype_len();
        for genes in [vec![0.0; d], vec![1.0; d], genotype(d, 9)] {
            let mut check = |step: &StepRecord| {
                for robot in &step.robots {
                    assert!((0.0..1000.0).contains(&robot.position.x));
                    assert!((0.0..1000.0).contains(&robot.position.y));
                    assert!((0.0..TAU).contains(&robot.heading));
                    assert!(robot.wheels.iter().all(|wheel| (-1.0..=1.0).contains(wheel)));
                    assert!(robot.stimuli.iter().all(|value| (-1.0..=1.0).contains(value)));
                }
                assert!(step.fitness.unwrap_or(0.0).is_finite());
                assert!(step.measures.values().all(|value| value.is_finite()));
            };
            let summary = simulation.simulate(&genes, 0, 0, &mut check).unwrap();
            assert!((0.0..=5.0).contains(&summary.fitness));
        }
    }
}

#[test]
fn robots_without_use_of_wheels_never_move() {
    for config in [experiment_a(), experiment_b()] {
        let (steps, _) = watch(&config, 2, 1);
        for pair in steps.windows(2) {
            for (before, after) in pair[0].robots.iter().zip(&pair[1].robots) {
                assert_eq!((before.position, before.heading), (after.position, after.heading));
            }
        }
    }
    let (steps, _) = watch(&experiment_c(), 2, 1);
    let turned = |k: usize| steps[k].robots[0].heading != steps[0].robots[0].heading;
    assert!((1..600).any(turned));
    for step in &steps {
        for (start, robot) in steps[0].robots.iter().zip(&step.robots) {
            assert_eq!(start.position, robot.position, "turning in place");
        }
    }
}

#[test]
fn messages_are_symbols_and_frames_obey_the_protocol() {
    let mut n_relayed = 0;
    for seed in 0..5 {
        let config = experiment_a();
        let (steps, _) = watch(&config, seed, 0);
        let state = inputs(&config, SensorQuery::ReceiverState);
        for (k, step) in steps.iter().enumerate() {
            for (index, robot) in step.robots.iter().enumerate() {
                for level in &robot.message {
                    assert!([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].contains(level));
                }
                if k < 10 {
                    assert_eq!(robot.mode, Mode::Send);
                }
                let mode = if k == 0 { Mode::Send } else { steps[k - 1].robots[index].mode };
                assert_eq!(robot.stimuli[state.clone()], [f64::from(mode == Mode::Send)]);
                let Some(received) = robot.received else {
                    assert_eq!(robot.stimuli[..2], [0.0; 2]);
                    continue;
                };
                assert!(k > 0, "nothing is on the air before the first step");
                assert_ne!(received.originator, index);
                assert!((1..10).contains(&received.hops));
                assert!(received.sector < 4 && received.signal > 0.0);
                n_relayed += usize::from(received.hops > 1);
                // The message was sent `hops` steps ago.
                let sent = &steps[k - received.hops as usize].robots[received.originator];
                assert_eq!(sent.mode, Mode::Send);
                let heard = sent.message.iter().map(|&level| f64::from(level as f32));
                assert!(robot.stimuli[..2].iter().copied().eq(heard));
            }
        }
    }
    assert!(n_relayed > 100, "{n_relayed}");
}

#[test]
fn a_leader_fails_and_relays_after_its_time() {
    const N: usize = 3;
    let mut config = experiment_a();
    robot(&mut config).num_instances = N as u32;
    robot(&mut config).perturbations.leader_failure =
        Some(LeaderFailureConfig { time_to_failure: 2 });
    let mut n_faulty = 0;
    for seed in 0..20 {
        let (steps, _) = watch(&config, seed, 0);
        let mut faulty = [false; N];
        let mut term = (usize::MAX, 0);
        for step in &steps {
            let on: Vec<usize> = (0..N).filter(|&r| step.robots[r].led > 0).collect();
            for (robot, _) in faulty.iter().enumerate().filter(|(_, faulty)| **faulty) {
                assert_eq!((step.robots[robot].led, step.robots[robot].mode), (0, Mode::Relay));
            }
            term = match on[..] {
                [leader] if leader == term.0 => (leader, term.1 + 1),
                [leader] => (leader, 1),
                _ => (usize::MAX, 0),
            };
            if term.1 == 2 {
                faulty[term.0] = true;
                term = (usize::MAX, 0);
                n_faulty += 1;
            }
        }
    }
    assert!(n_faulty > 5, "{n_faulty}");
}

#[test]
fn inhibited_light_is_exactly_zero_for_eight_of_ten() {
    let config = experiment_d();
    let light = inputs(&config, SensorQuery::Light);
    let photosensitive = |trial| {
        let (steps, summary) = watch(&config, 0, trial);
        assert_eq!(summary.measures.len(), 6);
        let sees = |robot: usize| {
            let mut stimuli = steps.iter().flat_map(|s| &s.robots[robot].stimuli[light.clone()]);
            stimuli.any(|&value| value != 0.0)
        };
        (0..10).filter(|&robot| sees(robot)).collect::<Vec<_>>()
    };
    let (first, second) = (photosensitive(0), photosensitive(1));
    assert_eq!((first.len(), second.len()), (2, 2));
    assert_ne!(first, second);
}

#[test]
fn the_radio_of_a_deaf_network_still_receives() {
    let mut config = experiment_a();
    let receiver = WholeReceiver::WirelessReceiver;
    robot(&mut config).perturbations.stimuli_inhibition = vec![StimuliInhibitionConfig {
        stimuli: InhibitedStimulus::Receiver(receiver),
        affected_robots: 10,
    }];
    let (steps, _) = watch(&config, 0, 0);
    let robots = || steps.iter().flat_map(|step| &step.robots);
    assert!(robots().all(|robot| robot.stimuli == [0.0; 5]));
    assert!(robots().filter(|robot| robot.received.is_some()).count() > 1000);
}

#[test]
fn a_switch_of_topology_draws_new_places_and_new_targets() {
    let mut config = experiment_b();
    let switch = TopologySwitchConfig { every: 100 };
    robot(&mut config).perturbations.topology_switch = Some(switch);
    let (steps, _) = watch(&config, 0, 0);
    let positions =
        |k: usize| steps[k].robots.iter().map(|robot| robot.position).collect::<Vec<_>>();
    let mut topologies = vec![positions(0)];
    for k in 1..300 {
        if k % 100 == 0 {
            topologies.push(positions(k));
        }
        assert_eq!(positions(k), *topologies.last().unwrap(), "step {k}");
    }
    topologies.dedup();
    assert_eq!(topologies.len(), 3);
    for (k, step) in steps.iter().enumerate() {
        let border = crate::border::of_swarm(&TORUS, &positions(k), 100.0, 15.0);
        let right = border.iter().zip(&step.robots).filter(|(at, robot)| **at == (robot.led > 0));
        assert_eq!(step.measures["accuracy"], right.count() as f64 / 20.0, "step {k}");
    }
}

#[test]
fn uncontrollable_robots_turn_to_their_targets() {
    let mut config = experiment_c();
    robot(&mut config).perturbations.uncontrollable_rotation = Some(UncontrollableRotationConfig {
        affected_robots: 4,
        start: 200,
        targets: vec![1.0, 4.0],
        switch_at: 400,
        speed: 0.3,
    });
    let (steps, _) = watch(&config, 0, 0);
    let holds = |robot: usize, k: usize, target: f64| {
        angular_difference(steps[k].robots[robot].heading, target) <= 0.15
    };
    let affected: Vec<usize> =
        (0..10).filter(|&robot| holds(robot, 399, 1.0) && holds(robot, 599, 4.0)).collect();
    assert_eq!(affected.len(), 4);
    for (k, step) in steps.iter().enumerate().skip(200) {
        for &robot in &affected {
            let wheels = step.robots[robot].wheels;
            assert!(wheels == [0.3, -0.3] || wheels == [0.0, 0.0], "step {k}: {wheels:?}");
        }
    }
}

#[test]
fn ground_and_neighbours_reach_the_network() {
    let mut config = experiment_a();
    add_stimulus(&mut config, "ground", 1, SensorQuery::Ground);
    add_stimulus(&mut config, "near", 4, SensorQuery::Distance);
    let robot = robot(&mut config);
    robot.num_instances = 2;
    robot.sensors.ground_sensor = Some(GroundSensorConfig { color: "black".into() });
    robot.sensors.distance_sensor =
        Some(DistanceSensorConfig { noise_variance: 0.0, ..Default::default() });
    robot.initializers.positions =
        Initializer::Fixed { values: vec![vec![100.0, 100.0], vec![150.0, 100.0]] };
    robot.initializers.orientations = Initializer::Fixed { values: vec![vec![0.0]] };
    let area = |color: &str, x: f64| {
        ObjectConfig::GroundArea(GroundAreaConfig {
            controller: None,
            num_instances: 1,
            initializers: PositionInitializers {
                positions: Initializer::Fixed { values: vec![vec![x, 100.0]] },
            },
            params: GroundAreaParams { range: 30.0, color: color.into() },
        })
    };
    config.world.objects.insert("nest".into(), area("black", 80.0));
    config.world.objects.insert("trap".into(), area("white", 150.0));
    let ground = inputs(&config, SensorQuery::Ground);
    let near = inputs(&config, SensorQuery::Distance);
    let (steps, _) = watch(&config, 0, 0);
    for step in steps {
        let [first, second] = &step.robots[..] else { panic!() };
        assert_eq!(first.stimuli[ground.clone()], [1.0]);
        assert_eq!(second.stimuli[ground.clone()], [0.0]);
        let nearness = f64::from(libm::exp(-2.5) as f32);
        assert_eq!(first.stimuli[near.clone()][0], nearness);
        assert_eq!(second.stimuli[near.clone()][2], nearness);
    }
}

/// Experiment D with a resting light, and a second group of robots that follow the light without
/// a network and transmit.
fn with_followers() -> ExperimentConfig {
    let mut config = experiment_d();
    let mut followers = robot(&mut config).clone();
    followers.controller = RobotController::BraitenbergLightFollower;
    followers.num_instances = 3;
    followers.perturbations = Default::default();
    followers.initializers.positions = Initializer::Fixed {
        values: vec![vec![440.0, 500.0], vec![500.0, 430.0], vec![540.0, 540.0]],
    };
    let sensor = followers.sensors.light_sensor.as_mut().unwrap();
    (sensor.noise_variance, sensor.decay_rho) = (0.0, 0.01);
    config.world.objects.insert("followers".into(), ObjectConfig::Robot(followers));
    let Some(ObjectConfig::LightSource(light)) = config.world.objects.get_mut("light_red") else {
        panic!("experiment D has a light")
    };
    light.controller = LightController::Static {};
    light.params.range = 300.0;
    config
}

#[test]
fn vehicles_come_to_the_light() {
    let (steps, _) = watch(&with_followers(), 0, 0);
    for robot in 10..13 {
        let distance =
            |k: usize| TORUS.distance(steps[k].robots[robot].position, steps[k].lights[0]);
        assert!(distance(0) > 50.0);
        let nearest = (0..1000).map(distance).fold(f64::INFINITY, f64::min);
        assert!(nearest < 20.0, "robot {robot}: {nearest}");
    }
}

#[test]
fn objects_share_one_ether_but_one_of_them_is_evaluated() {
    let config = with_followers();
    let (steps, _) = watch(&config, 0, 0);
    let between = |from: std::ops::Range<usize>, to: std::ops::Range<usize>| {
        let receivers = steps.iter().flat_map(|step| &step.robots[to.clone()]);
        receivers
            .filter_map(|robot| robot.received)
            .filter(|f| from.contains(&f.originator))
            .count()
    };
    assert!(between(10..13, 0..10) > 100);
    assert!(between(0..10, 10..13) > 100);
    for step in &steps {
        let near = |r: usize| TORUS.distance(step.robots[r].position, step.lights[0]) <= 80.0;
        let share = (0..10).filter(|&robot| near(robot)).count() as f64 / 10.0;
        assert!((step.fitness.unwrap() - share).abs() < 1e-12);
    }
}

#[test]
fn fitness_uses_the_positions_of_lights_during_the_step() {
    let (steps, _) = watch(&experiment_d(), 0, 0);
    let center = Vec2::new(500.0, 500.0);
    assert!(TORUS.distance(steps[0].lights[0], center) < 1.0 + 1e-9, "not moved yet");
    assert!(TORUS.distance(steps[1].lights[0], center) > 3.9);
}

#[test]
fn a_single_robot_hears_no_frame() {
    for mut config in experiments() {
        let robot = robot(&mut config);
        robot.num_instances = 1;
        robot.perturbations = Default::default();
        let (steps, summary) = watch(&config, 0, 0);
        assert!(steps.iter().all(|step| step.robots[0].received.is_none()));
        assert!(summary.fitness.is_finite());
    }
}

#[test]
fn robots_may_be_mute_deaf_or_both() {
    for (mute, deaf) in [(true, false), (false, true), (true, true)] {
        let mut config = experiment_d();
        config.topology.stimuli.retain(|name, _| !deaf || name == "I5");
        config
            .topology
            .synapses
            .retain(|_, group| !deaf || !group.pre[0].starts_with('I') || group.pre[0] == "I5");
        config
            .topology
            .outputs
            .retain(|_, output| !mute || output.actuator == ActuatorQuery::Wheels);
        let robot = robot(&mut config);
        if mute {
            robot.actuators.wireless_transmitter = None;
        }
        if deaf {
            robot.sensors.wireless_receiver = None;
        }
        let (steps, _) = watch(&config, 0, 0);
        assert!(steps.iter().flat_map(|step| &step.robots).all(|robot| robot.received.is_none()));
    }
}

/// If the bits of the same files change, the format of runs has changed: raise the number in
/// `FINGERPRINT`, and state the reason in the commit.
#[test]
fn fitness_bits_are_fixed_on_every_instruction_set() {
    for isa in Isa::available() {
        let bits: Vec<[u64; 2]> = experiments()
            .into_iter()
            .map(|config| {
                let simulation = Simulation::compile(&config).unwrap().with_isa(isa);
                let genotype = genotype(simulation.genotype_len(), 18);
                let fitness = simulation.evaluate(&genotype, 1, 0..2).unwrap();
                [fitness[0].to_bits(), fitness[1].to_bits()]
            })
            .collect();
        assert_eq!(bits, GOLDEN, "{isa}: {bits:#x?}");
    }
}

const GOLDEN: [[u64; 2]; 4] = [
    [0x3f35_d867_c3ec_e2a6, 0x3f50_624d_d2f1_a9fd],
    [0x3fc2_4fa4_fa4f_a4fa, 0x3fb9_4567_89ab_cdf1],
    [0x3f5e_a980_181e_e330, 0x3f60_a42f_000c_e289],
    [0x3f9b_22d0_e560_41a9, 0x3f9c_91d1_4e3b_cd55],
];

#[test]
fn fitness_bits_do_not_depend_on_how_trials_are_split_into_items() {
    for mut config in experiments() {
        config.algorithm.evaluation_steps = 40;
        for isa in Isa::available() {
            let simulation = Simulation::compile(&config).unwrap().with_isa(isa);
            let genotype = genotype(simulation.genotype_len(), 4);
            let bits = |trials: std::ops::Range<u32>| -> Vec<u64> {
                let fitness = simulation.evaluate(&genotype, 2, trials).unwrap();
                fitness.into_iter().map(f64::to_bits).collect()
            };
            let whole = bits(0..5);
            for splits in [&[1, 2, 3, 4, 5][..], &[2, 5], &[4, 5], &[1, 4, 5]] {
                let mut first = 0;
                let mut parts = Vec::new();
                for &end in splits {
                    parts.extend(bits(first..end));
                    first = end;
                }
                assert_eq!(parts, whole, "{}, {isa}, {splits:?}", config.name);
            }
        }
    }
}
