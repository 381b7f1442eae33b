//! Keys whose defaults differ between thesis and SpikeSwarmSim: each alone, and all
//! together.

use experiment_file::{
    Activation, DecodingConfig, ExperimentConfig, InitialRates, LightController, ObjectConfig,
    OrbitConfig,
};

use crate::assert_varied_agreement;
use crate::configs::{experiment_c, experiment_d, swarm_mut, transmitter_mut};

type Change = fn(&mut ExperimentConfig);

/// Changes an experiment, and asserts that simulator and reference agree on it, and that its
/// fitness has changed.
fn assert_agreement_after(experiment: &ExperimentConfig, changes: &[Change]) {
    let before = assert_varied_agreement(experiment);
    let mut changed = experiment.clone();
    changes.iter().for_each(|change| change(&mut changed));
    let after = assert_varied_agreement(&changed);
    let differ = before.iter().zip(&after).any(|(a, b)| (a.fitness - b.fitness).abs() > 1e-4);
    assert!(differ, "nothing changed");
}

/// Experiment C with robots that also relay, with a fitness that depends on every bit of a
/// heading.
fn turning_swarm() -> ExperimentConfig {
    let mut config = experiment_c();
    config.algorithm.evaluation_steps = 40;
    config.topology.decoding["outC"] = DecodingConfig::ThresholdDecoding { stochastic: true };
    config
}

const OF_NETWORKS: [Change; 3] = [
    |config| config.topology.bias_in_gain = false,
    |config| config.topology.initial_rates = InitialRates::Zero,
    |config| config.topology.motor_tau = Some(0.5),
];

const OF_RADIOS: [Change; 2] = [
    |config| transmitter_mut(config).sending_steps = 3,
    |config| transmitter_mut(config).initial_frame = true,
];

#[test]
fn keys_of_networks_and_radios_agree_alone_and_together() {
    let config = turning_swarm();
    for change in OF_NETWORKS.into_iter().chain(OF_RADIOS) {
        assert_agreement_after(&config, &[change]);
    }
    assert_agreement_after(&config, &OF_NETWORKS);
    assert_agreement_after(&config, &OF_RADIOS);
}

#[test]
fn keys_of_rates_agree_for_tanh() {
    let mut config = turning_swarm();
    config.topology.ensembles["H1"].activation = Some(Activation::Tanh);
    assert_agreement_after(&config, &OF_NETWORKS);
}

#[test]
fn keys_of_lights_and_of_their_sensors_agree() {
    let mut config = experiment_d();
    config.algorithm.evaluation_steps = 150;
    let swarm = swarm_mut(&mut config);
    swarm.perturbations = Default::default();
    let sensor = swarm.sensors.light_sensor.as_mut().unwrap();
    (sensor.decay_rho, sensor.noise_variance) = (0.005, 0.0);
    let orbit: Change = |config| {
        if let ObjectConfig::LightSource(light) = &mut config.world.objects["light_red"] {
            let orbit =
                OrbitConfig { angle_step: 0.013, radius_step: Some(1.0), ..Default::default() };
            light.controller = LightController::LightOrbitController(orbit);
        }
    };
    let aperture: Change = |config| {
        swarm_mut(config).sensors.light_sensor.as_mut().unwrap().aperture = 1.2;
    };
    assert_agreement_after(&config, &[orbit]);
    assert_agreement_after(&config, &[aperture]);
}
