//! Configurations for tests: the experiments of the thesis, to be varied.

use crate::config::*;

/// Experiment A (leader selection) as in the thesis, chapter 5.
pub(crate) fn experiment_a() -> ExperimentConfig {
    ExperimentConfig {
        name: "A".into(),
        seed: 0,
        topology: topology(
            &[
                ("I1", 2, SensorQuery::ReceiverMessage),
                ("I2", 1, SensorQuery::ReceiverState),
                ("I3", 2, SensorQuery::ReceiverReceivingDirection),
            ],
            ("OUT_LED", 1, ActuatorQuery::Led),
        ),
        algorithm: AlgorithmConfig {
            name: AlgorithmName::Snes,
            evolvable_object: "robotA".into(),
            population_size: 100,
            generations: 1000,
            evaluation_steps: 300,
            num_evaluations: 5,
            fitness_function: FitnessFunction::IdentifyLeader,
            target_fitness: None,
            populations: [("p4".into(), population())].into(),
        },
        world: WorldConfig {
            height: 1000.0,
            width: 1000.0,
            objects: [("robotA".into(), ObjectConfig::Robot(robot_a()))].into(),
        },
    }
}

/// Experiment B (borderline identification).
pub(crate) fn experiment_b() -> ExperimentConfig {
    let mut config = experiment_a();
    config.algorithm.fitness_function = FitnessFunction::IdentifyBorderline;
    let robot = robot(&mut config);
    robot.num_instances = 20;
    robot.perturbations.leader_failure = None;
    config
}

/// Experiment C (orientation consensus).
pub(crate) fn experiment_c() -> ExperimentConfig {
    let mut config = experiment_a();
    config.topology = topology(
        &[
            ("I1", 2, SensorQuery::ReceiverMessage),
            ("I2", 2, SensorQuery::ReceiverSendingDirection),
            ("I3", 2, SensorQuery::ReceiverReceivingDirection),
            ("I4", 1, SensorQuery::ReceiverState),
        ],
        ("OUT_WHEEL", 1, ActuatorQuery::Wheels),
    );
    config.algorithm.fitness_function = FitnessFunction::OrientationConsensus;
    config.algorithm.evaluation_steps = 600;
    let robot = robot(&mut config);
    robot.perturbations.leader_failure = None;
    robot.actuators.led_actuator = None;
    robot.actuators.wheel_actuator = Some(wheels());
    config
}

/// Experiment D (light follower), with the sensor noise of Table 3.2.
pub(crate) fn experiment_d() -> ExperimentConfig {
    let mut config = experiment_a();
    config.topology = topology(
        &[
            ("I1", 2, SensorQuery::ReceiverMessage),
            ("I2", 2, SensorQuery::ReceiverReceivingDirection),
            ("I3", 1, SensorQuery::ReceiverState),
            ("I4", 1, SensorQuery::ReceiverSignal),
            ("I5", 6, SensorQuery::Light),
        ],
        ("OUT_WHEEL", 2, ActuatorQuery::Wheels),
    );
    config.algorithm.fitness_function = FitnessFunction::GotoLight;
    config.algorithm.evaluation_steps = 1000;
    let robot = robot(&mut config);
    robot.sensors.light_sensor = Some(light_sensor());
    robot.actuators.led_actuator = None;
    robot.actuators.wheel_actuator = Some(wheels());
    robot.initializers.positions = Initializer::RandomUniform { low: 400.0, high: 600.0, size: 2 };
    robot.perturbations = PerturbationsConfig {
        stimuli_inhibition: Some(StimuliInhibitionConfig {
            stimuli: InhibitedStimulus::Reading(SensorQuery::Light),
            affected_robots: 8,
        }),
        ..Default::default()
    };
    let light = LightSourceConfig {
        num_instances: 1,
        controller: LightController::LightOrbitController {},
        initializers: PositionInitializers {
            positions: Initializer::RandomCircumference { radius: 1.0, center: [500.0, 500.0] },
        },
        params: LightParams { range: 80.0, color: "red".into() },
    };
    config.world.objects.insert("light".into(), ObjectConfig::LightSource(light));
    config
}

/// Network of the thesis: stimuli to H1, H1 to H2 and to the motor, H2 to message
/// and mode, with feedback.
fn topology(
    stimuli: &[(&str, u32, SensorQuery)],
    (motor, n_motor, actuator): (&str, u32, ActuatorQuery),
) -> TopologyConfig {
    let ensemble =
        |n| EnsembleConfig { n, activation: Activation::Sigmoid, params: NeuronParams::default() };
    let wheels = actuator == ActuatorQuery::Wheels;
    let motor_ensemble = EnsembleConfig {
        activation: if wheels { Activation::Tanh } else { Activation::Sigmoid },
        ..ensemble(n_motor)
    };
    let motor_decoding = if wheels {
        DecodingConfig::IdentityDecoding {}
    } else {
        DecodingConfig::ThresholdDecoding { stochastic: true }
    };
    let output = |ensemble: &str, actuator| OutputConfig { ensemble: ensemble.into(), actuator };
    let group = |pre: &str, post: &str, p| {
        let group = SynapseGroupConfig {
            pre: vec![pre.into()],
            post: vec![post.into()],
            trainable: true,
            p,
        };
        (format!("{pre}-{post}"), group)
    };
    let mut synapses: NamedMap<_> =
        stimuli.iter().map(|(name, _, _)| group(name, "H1", 1.0)).collect();
    synapses.extend([
        group("H1", "H1", 0.7),
        group("H2", "H2", 0.7),
        group("H1", "H2", 1.0),
        group("H1", motor, 1.0),
        group("H2", "OUT_COMM", 1.0),
        group("H2", "OUT_STATE", 1.0),
        group("OUT_COMM", "H1", 0.85),
        group(motor, "H1", 0.85),
        group("OUT_STATE", "H1", 0.85),
        group("OUT_COMM", "OUT_COMM", 1.0),
        group("OUT_COMM", "OUT_STATE", 1.0),
        group("OUT_STATE", "OUT_COMM", 1.0),
    ]);
    TopologyConfig {
        dt: 0.1,
        time_scale: 20,
        seed: 821,
        stimuli: stimuli
            .iter()
            .map(|&(name, n, sensor)| (name.into(), StimulusConfig { n, sensor }))
            .collect(),
        ensembles: [
            ("H1".into(), ensemble(10)),
            ("H2".into(), ensemble(10)),
            ("OUT_COMM".into(), ensemble(2)),
            ("OUT_STATE".into(), ensemble(1)),
            (motor.into(), motor_ensemble),
        ]
        .into(),
        outputs: [
            ("message".into(), output("OUT_COMM", ActuatorQuery::Message)),
            ("motor".into(), output(motor, actuator)),
            ("mode".into(), output("OUT_STATE", ActuatorQuery::Mode)),
        ]
        .into(),
        synapses,
        decoding: [
            ("message".into(), DecodingConfig::IdentityDecoding {}),
            ("motor".into(), motor_decoding),
            ("mode".into(), DecodingConfig::ThresholdDecoding { stochastic: false }),
        ]
        .into(),
    }
}

fn population() -> PopulationConfig {
    let neurons = |parameter| GenotypeQuery::Neurons(parameter, EnsembleSelector::All);
    PopulationConfig {
        objects: vec![
            GenotypeQuery::Weights(SynapseSelector::All),
            neurons(NeuronParameter::Bias),
            neurons(NeuronParameter::Tau),
            neurons(NeuronParameter::Gain),
        ],
        max_vals: vec![3.0, 1.5, 0.75, 5.0],
        min_vals: vec![-3.0, -1.5, -1.0, 0.05],
        params: AlgorithmParams::Snes(SnesParams {
            eta_mu: 1.0,
            eta_sigma: None,
            mu_init: 0.5,
            sigma_init: 0.2,
        }),
    }
}

fn robot_a() -> RobotConfig {
    RobotConfig {
        num_instances: 10,
        controller: RobotController::NeuralController,
        sensors: SensorsConfig { wireless_receiver: Some(receiver()), ..Default::default() },
        actuators: ActuatorsConfig {
            led_actuator: Some(LedActuatorConfig {}),
            wireless_transmitter: Some(transmitter()),
            ..Default::default()
        },
        initializers: RobotInitializers {
            positions: Initializer::RandomGraph { max_rad: 100.0, initial_pos: [500.0, 500.0] },
            orientations: Initializer::RandomUniform {
                low: 0.0,
                high: std::f64::consts::TAU,
                size: 1,
            },
        },
        perturbations: PerturbationsConfig {
            leader_failure: Some(LeaderFailureConfig { time_to_failure: 50 }),
            ..Default::default()
        },
        params: RobotParams { trainable: true },
    }
}

/// The receiver of the thesis.
pub(crate) fn receiver() -> WirelessReceiverConfig {
    WirelessReceiverConfig {
        n_sectors: 4,
        range: 100.0,
        msg_length: 2,
        max_hops: 10,
        decay_rho: 0.05,
        decay_phi: 1.0,
    }
}

/// The transmitter of the thesis.
pub(crate) fn transmitter() -> WirelessTransmitterConfig {
    WirelessTransmitterConfig {
        range: 100.0,
        msg_length: 2,
        quantize: true,
        n_symbols: 16,
        beta: 100.0,
    }
}

/// The wheels of the thesis.
pub(crate) fn wheels() -> WheelActuatorConfig {
    WheelActuatorConfig { max_speed: 10.0, axle_length: 11.0, step_duration: 0.33 }
}

/// The light sensor of Table 3.2.
pub(crate) fn light_sensor() -> LightSensorConfig {
    LightSensorConfig {
        n_sectors: 6,
        range: 80.0,
        color: "red".into(),
        decay_rho: 0.05,
        decay_phi: 1.0,
        noise_variance: 0.1,
    }
}

/// The distance sensor of Table 3.2.
pub(crate) fn distance_sensor() -> DistanceSensorConfig {
    DistanceSensorConfig {
        n_sectors: 4,
        range: 60.0,
        decay_rho: 0.05,
        decay_phi: 1.0,
        noise_variance: 0.1,
    }
}

/// The first robots of a configuration.
pub(crate) fn robot(config: &mut ExperimentConfig) -> &mut RobotConfig {
    match config.world.objects.values_mut().next() {
        Some(ObjectConfig::Robot(robot)) => robot,
        other => panic!("not a robot: {other:?}"),
    }
}

/// A reproducible genotype.
pub(crate) fn genotype(len: usize, seed: u64) -> Vec<f64> {
    use crate::random::{Purpose, Stream};
    let mut stream = Stream::new(seed, 0, 0, Purpose::Evolution, 0);
    (0..len).map(|_| stream.uniform()).collect()
}
