//! The experiments of chapter 5 as plain values.

use std::f64::consts::{PI, TAU};

use experiment_file::*;
use indexmap::IndexMap;

/// Experiment A, leader selection (section 5.1).
pub fn experiment_a() -> ExperimentConfig {
    ExperimentConfig {
        name: "A".into(),
        seed: 0,
        topology: topology(
            &[
                ("I1", 2, SensorQuery::ReceiverMessage),
                ("I2", 1, SensorQuery::ReceiverState),
                ("I3", 2, SensorQuery::ReceiverReceivingDirection),
            ],
            Motor {
                name: "OUT_LED",
                n: 1,
                activation: Activation::Sigmoid,
                actuator: ActuatorQuery::Led,
                decoding: DecodingConfig::ThresholdDecoding { stochastic: true },
                is_recurrent: false,
            },
        ),
        algorithm: algorithm(FitnessFunction::IdentifyLeader, 300),
        world: world([("robotA", ObjectConfig::Robot(leader_robots()))]),
        task: None,
    }
}

/// Experiment B, borderline identification (section 5.2): as A with another fitness and 20 robots
/// that do not fail.
pub fn experiment_b() -> ExperimentConfig {
    let mut config = experiment_a();
    config.name = "B".into();
    config.algorithm.fitness_function = FitnessFunction::IdentifyBorderline;
    let swarm = swarm_mut(&mut config);
    swarm.num_instances = 20;
    swarm.perturbations = PerturbationsConfig::default();
    config
}

/// Experiment C, orientation consensus (section 5.3).
pub fn experiment_c() -> ExperimentConfig {
    let stimuli = [
        ("I1", 2, SensorQuery::ReceiverMessage),
        ("I2", 2, SensorQuery::ReceiverSendingDirection),
        ("I3", 2, SensorQuery::ReceiverReceivingDirection),
        ("I4", 1, SensorQuery::ReceiverState),
    ];
    let mut robots = leader_robots();
    robots.actuators.led_actuator = None;
    robots.actuators.wheel_actuator = Some(wheels());
    robots.perturbations = PerturbationsConfig::default();
    ExperimentConfig {
        name: "C".into(),
        seed: 0,
        topology: topology(&stimuli, wheel_neurons(1)),
        algorithm: algorithm(FitnessFunction::OrientationConsensus, 600),
        world: world([("robotA", ObjectConfig::Robot(robots))]),
        task: None,
    }
}

/// Experiment D, light follower (section 5.4), with the sensor noise of Table
/// 3.2.
pub fn experiment_d() -> ExperimentConfig {
    let stimuli = [
        ("I1", 2, SensorQuery::ReceiverMessage),
        ("I2", 2, SensorQuery::ReceiverReceivingDirection),
        ("I3", 1, SensorQuery::ReceiverState),
        ("I4", 1, SensorQuery::ReceiverSignal),
        ("I5", 6, SensorQuery::Light),
    ];
    let mut robots = leader_robots();
    robots.sensors.light_sensor = Some(LightSensorConfig {
        n_sectors: 6,
        range: 80.0,
        color: "red".into(),
        decay_rho: 0.05,
        decay_phi: 1.0,
        noise_variance: 0.1,
        aperture: PI,
        blocked_by: BlockedBy::Nothing,
    });
    robots.actuators.led_actuator = None;
    robots.actuators.wheel_actuator = Some(wheels());
    robots.initializers.positions = Initializer::RandomUniform { low: 400.0, high: 600.0, size: 2 };
    robots.perturbations = PerturbationsConfig {
        stimuli_inhibition: vec![StimuliInhibitionConfig {
            stimuli: InhibitedStimulus::Reading(SensorQuery::Light),
            affected_robots: 8,
        }],
        ..Default::default()
    };
    let light = LightSourceConfig {
        num_instances: 1,
        controller: LightController::LightOrbitController(OrbitConfig::default()),
        initializers: PositionInitializers {
            positions: Initializer::RandomCircumference { radius: 1.0, center: [500.0, 500.0] },
        },
        params: LightParams { range: 80.0, color: "red".into() },
    };
    ExperimentConfig {
        name: "D".into(),
        seed: 0,
        topology: topology(&stimuli, wheel_neurons(2)),
        algorithm: algorithm(FitnessFunction::GotoLight, 1000),
        world: world([
            ("robotA", ObjectConfig::Robot(robots)),
            ("light_red", ObjectConfig::LightSource(light)),
        ]),
        task: None,
    }
}

fn world<const N: usize>(objects: [(&str, ObjectConfig); N]) -> WorldConfig {
    WorldConfig {
        height: 1000.0,
        width: 1000.0,
        boundary: Boundary::Torus,
        bodies: None,
        objects: named(objects),
    }
}

fn wheels() -> WheelActuatorConfig {
    WheelActuatorConfig { max_speed: 10.0, axle_length: 11.0, step_duration: 0.33 }
}

fn wheel_neurons(n: u32) -> Motor {
    Motor {
        name: "OUT_MOT",
        n,
        activation: Activation::Tanh,
        actuator: ActuatorQuery::Wheels,
        decoding: DecodingConfig::IdentityDecoding {},
        is_recurrent: true,
    }
}

fn leader_robots() -> RobotConfig {
    RobotConfig {
        num_instances: 10,
        controller: RobotController::NeuralController,
        sensors: SensorsConfig { wireless_receiver: Some(receiver()), ..Default::default() },
        actuators: ActuatorsConfig {
            led_actuator: Some(LedActuatorConfig {}),
            wireless_transmitter: Some(transmitter()),
            ..Default::default()
        },
        body: None,
        initializers: RobotInitializers {
            positions: Initializer::RandomGraph { max_rad: 100.0, initial_pos: [500.0, 500.0] },
            orientations: Initializer::RandomUniform { low: 0.0, high: TAU, size: 1 },
        },
        perturbations: PerturbationsConfig {
            leader_failure: Some(LeaderFailureConfig { time_to_failure: 50 }),
            ..Default::default()
        },
        params: RobotParams { trainable: true },
    }
}

/// The motor ensemble beside message and mode.
struct Motor {
    name: &'static str,
    n: u32,
    activation: Activation,
    actuator: ActuatorQuery,
    decoding: DecodingConfig,
    is_recurrent: bool,
}

/// Figures 5.1, 5.3 and 5.4 with Tables 5.1 and 5.2.
fn topology(stimuli: &[(&str, u32, SensorQuery)], motor: Motor) -> TopologyConfig {
    let ensemble = |n, activation| EnsembleConfig {
        n,
        activation: Some(activation),
        params: NeuronModel::Rate.default_params(),
    };
    let output = |ensemble: &str, actuator| OutputConfig { ensemble: ensemble.into(), actuator };
    let mut groups: Vec<(&str, &str, f64)> =
        stimuli.iter().map(|&(name, ..)| (name, "H1", 1.0)).collect();
    groups.extend([
        ("H1", "H1", 0.7),
        ("H2", "H2", 0.7),
        ("H1", "H2", 1.0),
        ("H1", motor.name, 1.0),
        ("H2", "OUT_COMM", 1.0),
        ("H2", "OUT_ST", 1.0),
        ("OUT_COMM", "H1", 0.85),
        (motor.name, "H1", 0.85),
        ("OUT_ST", "H1", 0.85),
        ("OUT_COMM", "OUT_COMM", 1.0),
        ("OUT_COMM", "OUT_ST", 1.0),
        ("OUT_ST", "OUT_COMM", 1.0),
    ]);
    if motor.is_recurrent {
        groups.push((motor.name, motor.name, 1.0));
    }
    TopologyConfig {
        dt: 0.1,
        time_scale: 20,
        seed: 821,
        neuron_model: NeuronModel::Rate,
        bias_in_gain: true,
        initial_rates: InitialRates::Activation,
        motor_tau: None,
        synapse_model: SynapseModel::Static,
        synapse_params: None,
        encoding: NamedMap::new(),
        learning: None,
        stimuli: stimuli
            .iter()
            .map(|&(name, n, sensor)| (name.to_owned(), StimulusConfig { n, sensor }))
            .collect(),
        ensembles: named([
            ("H1", ensemble(10, Activation::Sigmoid)),
            ("H2", ensemble(10, Activation::Sigmoid)),
            ("OUT_COMM", ensemble(2, Activation::Sigmoid)),
            ("OUT_ST", ensemble(1, Activation::Sigmoid)),
            (motor.name, ensemble(motor.n, motor.activation)),
        ]),
        outputs: named([
            ("outA", output("OUT_COMM", ActuatorQuery::Message)),
            ("outB", output(motor.name, motor.actuator)),
            ("outC", output("OUT_ST", ActuatorQuery::Mode)),
        ]),
        synapses: groups
            .into_iter()
            .map(|(pre, post, p)| {
                let group = SynapseGroupConfig {
                    pre: vec![pre.into()],
                    post: vec![post.into()],
                    trainable: true,
                    p,
                    transmitter: None,
                };
                (format!("{pre}-{post}"), group)
            })
            .collect(),
        decoding: named([
            ("outA", DecodingConfig::IdentityDecoding {}),
            ("outB", motor.decoding),
            ("outC", DecodingConfig::ThresholdDecoding { stochastic: false }),
        ]),
    }
}

fn algorithm(fitness_function: FitnessFunction, evaluation_steps: u32) -> AlgorithmConfig {
    AlgorithmConfig {
        descriptors: Vec::new(),
        aims: Vec::new(),
        name: "SNES".into(),
        evolvable_object: "robotA".into(),
        population_size: 100,
        generations: 1000,
        evaluation_steps,
        num_evaluations: 5,
        fitness_function,
        fitness_params: FitnessParams::default(),
        target_fitness: None,
        champion_every: 10,
        champion_trials: 50,
        judgement_trials: 200,
        populations: named([(
            "p1",
            PopulationConfig {
                objects: vec![
                    GenotypeQuery::Weights(SynapseSelector::All),
                    GenotypeQuery::Neurons("bias", EnsembleSelector::All),
                    GenotypeQuery::Neurons("tau", EnsembleSelector::All),
                    GenotypeQuery::Neurons("gain", EnsembleSelector::All),
                ],
                max_vals: vec![3.0, 1.5, 0.75, 5.0],
                min_vals: vec![-3.0, -1.5, -1.0, 0.05],
                params: Params::default(),
            },
        )]),
    }
}

fn receiver() -> WirelessReceiverConfig {
    WirelessReceiverConfig {
        n_sectors: 4,
        range: 100.0,
        msg_length: 2,
        max_hops: 10,
        decay_rho: 0.05,
        decay_phi: 1.0,
        sending_direction: SendingDirection::Emitter,
        blocked_by: BlockedBy::Nothing,
    }
}

fn transmitter() -> WirelessTransmitterConfig {
    WirelessTransmitterConfig {
        range: 100.0,
        msg_length: 2,
        quantize: true,
        n_symbols: 16,
        beta: 100.0,
        sending_steps: 10,
        initial_frame: false,
    }
}

/// The first swarm of the world.
pub fn swarm_mut(config: &mut ExperimentConfig) -> &mut RobotConfig {
    config
        .world
        .objects
        .values_mut()
        .find_map(
            |object| if let ObjectConfig::Robot(robots) = object { Some(robots) } else { None },
        )
        .expect("every experiment has robots")
}

/// The receiver of the first swarm.
pub fn receiver_mut(config: &mut ExperimentConfig) -> &mut WirelessReceiverConfig {
    let sensors = &mut swarm_mut(config).sensors;
    sensors.wireless_receiver.as_mut().expect("every experiment has the radio")
}

/// The transmitter of the first swarm.
pub fn transmitter_mut(config: &mut ExperimentConfig) -> &mut WirelessTransmitterConfig {
    let actuators = &mut swarm_mut(config).actuators;
    actuators.wireless_transmitter.as_mut().expect("every experiment has the radio")
}

/// Sets the message length of receiver, transmitter and network.
pub fn set_msg_length(config: &mut ExperimentConfig, msg_length: u32) {
    config.topology.stimuli["I1"].n = msg_length;
    config.topology.ensembles["OUT_COMM"].n = msg_length;
    receiver_mut(config).msg_length = msg_length;
    transmitter_mut(config).msg_length = msg_length;
}

fn named<T, const N: usize>(entries: [(&str, T); N]) -> NamedMap<T> {
    entries.into_iter().map(|(name, value)| (name.to_owned(), value)).collect::<IndexMap<_, _>>()
}
