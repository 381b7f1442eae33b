//! Lights, distances, ground areas, noise, and inhibited stimuli.

use experiment_file::{
    BlockedBy, DistanceSensorConfig, ExperimentConfig, FitnessFunction, GroundAreaConfig,
    GroundAreaParams, GroundSensorConfig, InhibitedStimulus, Initializer, LightController,
    LightParams, LightSourceConfig, NeighborhoodSensorConfig, ObjectConfig, OrbitConfig,
    PlainSensorConfig, PositionInitializers, RandomTargetsConfig, SensorQuery,
    StimuliInhibitionConfig, StimulusConfig, SynapseGroupConfig, WholeReceiver,
};

use crate::assert_varied_agreement;
use crate::configs::{experiment_d, swarm_mut};
use crate::reference::Episode;

/// Experiment D with every sensor and without its perturbation, scored by all
/// headings and wheels.
pub fn all_sensors() -> ExperimentConfig {
    let mut config = experiment_d();
    config.algorithm.fitness_function = FitnessFunction::OrientationConsensus;
    config.algorithm.evaluation_steps = 60;
    let swarm = swarm_mut(&mut config);
    swarm.perturbations = Default::default();
    swarm.sensors.distance_sensor = Some(DistanceSensorConfig {
        n_sectors: 5,
        range: 60.0,
        decay_rho: 0.02,
        decay_phi: 0.7,
        noise_variance: 0.02,
        aperture: 0.8,
        blocked_by: BlockedBy::Nothing,
    });
    swarm.sensors.ground_sensor = Some(GroundSensorConfig { color: "black".into() });
    if let Some(light_sensor) = &mut swarm.sensors.light_sensor {
        light_sensor.decay_rho = 0.01;
    }
    for (name, n, sensor) in [
        ("I6", 5, SensorQuery::Distance),
        ("I7", 1, SensorQuery::Ground),
        ("I8", 2, SensorQuery::ReceiverSendingDirection),
    ] {
        config.topology.stimuli.insert(name.into(), StimulusConfig { n, sensor });
        config.topology.synapses.insert(
            format!("{name}-H1"),
            SynapseGroupConfig {
                pre: vec![name.into()],
                post: vec!["H1".into()],
                trainable: true,
                p: 1.0,
                transmitter: None,
            },
        );
    }
    let area = |color: &str, range, center| {
        ObjectConfig::GroundArea(GroundAreaConfig {
            controller: None,
            num_instances: 2,
            initializers: PositionInitializers {
                positions: Initializer::RandomCircumference { radius: 50.0, center },
            },
            params: GroundAreaParams { range, color: color.into() },
        })
    };
    config.world.objects.insert("black".into(), area("black", 30.0, [520.0, 480.0]));
    config.world.objects.insert("grey".into(), area("grey", 1000.0, [500.0, 500.0]));
    config
}

fn light(
    controller: LightController,
    color: &str,
    range: f64,
    positions: Initializer,
) -> ObjectConfig {
    ObjectConfig::LightSource(LightSourceConfig {
        num_instances: 2,
        controller,
        initializers: PositionInitializers { positions },
        params: LightParams { range, color: color.into() },
    })
}

fn random_targets(every: u32, speed: Option<f64>, step: Option<f64>) -> LightController {
    LightController::LightRndPosController(RandomTargetsConfig {
        every,
        speed,
        step,
        ..Default::default()
    })
}

fn fitness(episodes: &[Episode]) -> Vec<f64> {
    episodes.iter().map(|episode| episode.fitness).collect()
}

#[test]
fn every_sensor_agrees_with_and_without_noise() {
    let mut config = all_sensors();
    let noisy = assert_varied_agreement(&config);
    for Episode { witness, .. } in &noisy {
        assert!(witness.n_light > 0 && witness.n_distance > 0 && witness.n_ground > 0);
    }
    let sensors = &mut swarm_mut(&mut config).sensors;
    sensors.light_sensor.as_mut().unwrap().noise_variance = 0.0;
    let noisy_distance = assert_varied_agreement(&config);
    assert_ne!(fitness(&noisy), fitness(&noisy_distance));
    let sensors = &mut swarm_mut(&mut config).sensors;
    sensors.distance_sensor.as_mut().unwrap().noise_variance = 0.0;
    let silent = assert_varied_agreement(&config);
    assert_ne!(fitness(&noisy_distance), fitness(&silent));
    for Episode { witness, .. } in &silent {
        assert!(witness.n_light > 0 && witness.n_distance > 0 && witness.n_ground > 0);
    }
}

#[test]
fn food_areas_and_nests_are_sensed_as_ground_areas_of_their_colours() {
    let mut config = all_sensors();
    let ground = fitness(&assert_varied_agreement(&config));
    let sensors = &mut swarm_mut(&mut config).sensors;
    sensors.nest_sensor = Some(PlainSensorConfig {});
    sensors.food_area_sensor = Some(PlainSensorConfig {});
    for (sensor, color) in [(SensorQuery::Nest, "black"), (SensorQuery::FoodArea, "green")] {
        config.topology.stimuli["I7"].sensor = sensor;
        if let ObjectConfig::GroundArea(area) = &mut config.world.objects["black"] {
            area.params.color = color.into();
        }
        assert_eq!(fitness(&assert_varied_agreement(&config)), ground, "{color}");
    }
}

#[test]
fn robots_that_sense_positions_agree() {
    let mut config = all_sensors();
    let without = fitness(&assert_varied_agreement(&config));
    let sensors = &mut swarm_mut(&mut config).sensors;
    sensors.own_position_sensor = Some(PlainSensorConfig {});
    sensors.own_orientation_sensor = Some(PlainSensorConfig {});
    sensors.neighborhood_pos_sensor = Some(NeighborhoodSensorConfig { n_neighbors: 3 });
    for (stimulus, n, sensor) in [
        ("I6", 2, SensorQuery::OwnPosition),
        ("I7", 1, SensorQuery::OwnOrientation),
        ("I8", 9, SensorQuery::NeighborhoodPos),
    ] {
        config.topology.stimuli[stimulus] = StimulusConfig { n, sensor };
    }
    assert_ne!(fitness(&assert_varied_agreement(&config)), without);
    // With two robots, no robot has three others.
    swarm_mut(&mut config).num_instances = 2;
    assert_varied_agreement(&config);
}

#[test]
fn lights_on_every_path_agree() {
    let mut config = all_sensors();
    config.algorithm.evaluation_steps = 80;
    let alone = fitness(&assert_varied_agreement(&config));
    let lights = [
        ("still", LightController::Static {}, "blue", 90.0),
        ("wanderers", random_targets(20, Some(3.0), None), "red", 70.0),
        ("orbiters", LightController::LightOrbitController(OrbitConfig::default()), "red", 40.0),
    ];
    for (name, controller, color, range) in lights {
        let positions = Initializer::RandomUniform { low: 450.0, high: 550.0, size: 2 };
        config.world.objects.insert(name.into(), light(controller, color, range, positions));
    }
    let together = fitness(&assert_varied_agreement(&config));
    assert!(alone.iter().zip(&together).all(|(a, b)| a != b));
}

#[test]
fn robots_near_a_light_on_every_path_agree() {
    for controller in [
        LightController::Static {},
        LightController::LightPreyController {},
        LightController::LightOrbitController(OrbitConfig::default()),
        random_targets(30, None, Some(0.05)),
        random_targets(30, Some(4.0), None),
    ] {
        let mut config = experiment_d();
        config.algorithm.evaluation_steps = 200;
        if let ObjectConfig::LightSource(light) = &mut config.world.objects["light_red"] {
            light.controller = controller;
        }
        assert_varied_agreement(&config);
    }
}

#[test]
fn a_swarm_and_a_light_across_the_border_agree() {
    // The robots start across the border, and so does the light, which then
    // orbits around the centre of the world.
    let mut config = experiment_d();
    config.algorithm.evaluation_steps = 200;
    config.algorithm.fitness_function = FitnessFunction::OrientationConsensus;
    config.world.width = 800.0;
    config.world.height = 500.0;
    swarm_mut(&mut config).initializers.positions =
        Initializer::RandomUniform { low: -60.0, high: 60.0, size: 2 };
    if let ObjectConfig::LightSource(light) = &mut config.world.objects["light_red"] {
        light.initializers.positions = Initializer::Fixed { values: vec![vec![790.0, 495.0]] };
    }
    assert_varied_agreement(&config);
}

#[test]
fn inhibited_stimuli_agree() {
    let mut config = all_sensors();
    let whole = fitness(&assert_varied_agreement(&config));
    for stimuli in [
        InhibitedStimulus::Reading(SensorQuery::ReceiverMessage),
        InhibitedStimulus::Reading(SensorQuery::ReceiverSignal),
        InhibitedStimulus::Reading(SensorQuery::ReceiverReceivingDirection),
        InhibitedStimulus::Reading(SensorQuery::ReceiverSendingDirection),
        InhibitedStimulus::Reading(SensorQuery::ReceiverState),
        InhibitedStimulus::Reading(SensorQuery::Light),
        InhibitedStimulus::Reading(SensorQuery::Distance),
        InhibitedStimulus::Reading(SensorQuery::Ground),
        InhibitedStimulus::Receiver(WholeReceiver::WirelessReceiver),
    ] {
        for affected_robots in [3, 10] {
            swarm_mut(&mut config).perturbations.stimuli_inhibition =
                vec![StimuliInhibitionConfig { stimuli, affected_robots }];
            let episodes = assert_varied_agreement(&config);
            assert!(episodes.iter().any(|episode| episode.witness.n_inhibited > 0), "{stimuli:?}");
            assert_ne!(whole, fitness(&episodes), "{stimuli:?}");
        }
    }
    let inhibition =
        |stimuli, affected_robots| StimuliInhibitionConfig { stimuli, affected_robots };
    let light = InhibitedStimulus::Reading(SensorQuery::Light);
    let message = InhibitedStimulus::Reading(SensorQuery::ReceiverMessage);
    let inhibitions = [inhibition(light, 3), inhibition(message, 4), inhibition(light, 2)];
    swarm_mut(&mut config).perturbations.stimuli_inhibition = inhibitions[..2].to_vec();
    let two = assert_varied_agreement(&config);
    swarm_mut(&mut config).perturbations.stimuli_inhibition = inhibitions.to_vec();
    assert_ne!(fitness(&two), fitness(&assert_varied_agreement(&config)));
}
