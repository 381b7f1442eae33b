//! The meaning of files of SpikeSwarmSim: its defaults, its constants, and keys that
//! concern only it.

use std::f64::consts::PI;

use super::validator::is_valid;
use super::values::lamp;
use super::{BASE, accept, defaults, edited, read};
use evolution::ALGORITHMS;
use experiment_file::{
    ExperimentConfig, InitialRates, LightController, OrbitConfig, RobotController,
    SendingDirection, WirelessReceiverConfig, json_schema,
};

/// The base experiment with the defaults of SpikeSwarmSim, and edits of it.
fn original(edits: &[(&str, &str)]) -> ExperimentConfig {
    let name = r#""name": "base","#;
    let text = edited(name, r#""name": "base", "semantics": "original","#);
    let text = text.replace(r#""light_sensor": {}"#, r#""light_sensor": {"n_sectors": 6}"#);
    let text = text.replace("\"controller\": null", "\"controller\": \"light_orbit_controller\"");
    let edit = |text: String, (from, to): &(&str, &str)| {
        assert_eq!(text.matches(from).count(), 1, "{from:?} must occur once");
        text.replace(from, to)
    };
    accept(&edits.iter().fold(text, edit))
}

#[test]
fn semantics_of_the_original_change_defaults() {
    let config = original(&[]);
    let topology = &config.topology;
    assert!(!topology.bias_in_gain);
    assert_eq!((topology.initial_rates, topology.motor_tau), (InitialRates::Zero, Some(0.5)));
    let (_, bots) = config.robots().next().unwrap();
    let light = bots.sensors.light_sensor.as_ref().unwrap();
    let expected = (100.0, 0.005, 0.0, PI / 2.0);
    assert_eq!((light.range, light.decay_rho, light.noise_variance, light.aperture), expected);
    let receiver = bots.sensors.wireless_receiver.as_ref().unwrap();
    let expected = (2, 100.0, 0.005, SendingDirection::Originator);
    let WirelessReceiverConfig { n_sectors, range, decay_rho, sending_direction, .. } = *receiver;
    assert_eq!((n_sectors, range, decay_rho, sending_direction), expected);
    let transmitter = bots.actuators.wireless_transmitter.as_ref().unwrap();
    assert_eq!((transmitter.sending_steps, transmitter.initial_frame), (11, true));
    assert_eq!(lamp(&config).params.range, 150.0);
    let orbit = OrbitConfig { angle_step: 0.013, radius_step: Some(1.0), ..Default::default() };
    assert_eq!(lamp(&config).controller, LightController::LightOrbitController(orbit));
    // The canonical form has the values without the key `semantics`.
    let canonical = config.to_canonical_json();
    assert!(!canonical.contains("semantics"));
    assert_eq!(accept(&canonical), config);
    let file: serde_json::Value = serde_json::from_str(&canonical).unwrap();
    assert!(is_valid(&json_schema(ALGORITHMS), &file));
}

#[test]
fn stated_values_hold_under_any_semantics() {
    let thesis = edited(r#""name": "base","#, r#""name": "base", "semantics": "thesis","#);
    assert_eq!(accept(&thesis), accept(BASE));
    let distance = r#""distance_sensor": {"n_sectors": 4, "range": 60, "decay_rho": 0.05,
        "noise_variance": 0.1, "aperture": 3.141592653589793}"#;
    let text =
        BASE.replace(r#""light_sensor": {}"#, &format!(r#""light_sensor": {{}}, {distance}"#));
    let text = text.replace("\"controller\": null", "\"controller\": \"light_orbit_controller\"");
    let config = original(&[
        (
            r#""neuron_model": "rate_model","#,
            r#""bias_in_gain": true, "initial_rates": "activation", "motor_tau": null,"#,
        ),
        (
            r#""wireless_receiver": {}, "light_sensor": {"n_sectors": 6}"#,
            &format!(
                r#""wireless_receiver": {{"n_sectors": 4, "decay_rho": 0.05,
                "sending_direction": "emitter"}}, "light_sensor": {{"n_sectors": 6, "range": 80,
                "decay_rho": 0.05, "noise_variance": 0.1, "aperture": 3.141592653589793}},
                {distance}"#
            ),
        ),
        (
            r#""wireless_transmitter": {}"#,
            r#""wireless_transmitter": {"sending_steps": 10, "initial_frame": false}"#,
        ),
        (
            r#""controller": "light_orbit_controller""#,
            r#""params": {"range": 80}, "controller": {"name": "light_orbit_controller",
            "params": {"angle_step": 0.01, "radius_step": null}}"#,
        ),
    ]);
    assert_eq!(config, accept(&text));
}

#[test]
fn constants_of_the_original_are_translated() {
    let sensors = r#""light_sensor": {}"#;
    let config = accept(&edited(sensors, r#""light_sensor": {"noise_sigma": 0.5}"#));
    let (_, bots) = config.robots().next().unwrap();
    assert_eq!(bots.sensors.light_sensor.as_ref().unwrap().noise_variance, 0.25);
    let wheels = r#""wheel_actuator": {}"#;
    let config = accept(&edited(wheels, r#""wheel_actuator": {"dt": 1.65, "min_thresh": 0.0}"#));
    let (_, bots) = config.robots().next().unwrap();
    assert!((bots.actuators.wheel_actuator.as_ref().unwrap().step_duration - 0.33).abs() < 1e-12);
    let controller = r#""controller": "neural_controller","#;
    let vehicle = r#"{"type": "robot", "num_instances": 1, "controller": "Braitenberg2",
        "sensors": {"light_sensor": {}}, "actuators": {"wheel_actuator": {}},
        "initializers": {"positions": {"name": "random_uniform"}}}"#;
    let config = accept(&edited(r#""lamp": {"#, &format!(r#""car": {vehicle}, "lamp": {{"#)));
    let cars: Vec<_> = config.robots().map(|(_, robot)| robot.controller).collect();
    assert_eq!(
        cars,
        [RobotController::NeuralController, RobotController::BraitenbergLightFollower]
    );
    assert!(BASE.contains(controller));
}

#[test]
fn keys_that_concern_only_the_original_are_ignored_with_a_warning_each() {
    let name = r#""name": "base","#;
    let text = edited(name, r#""name": "base", "num_processes": 8, "render": true,"#)
        .replace(r#""name": "GA""#, r#""name": "SNES""#)
        .replace(
            r#""objects": {"#,
            r#""world_delay": 1, "render_connections": false, "objects": {"#,
        )
        .replace(r#""type": "light_source""#, r#""type": "light_source", "positions": "random""#);
    let (config, warnings) = read(&text).unwrap();
    let paths: Vec<&str> = warnings.iter().map(|warning| warning.path.as_str()).collect();
    assert_eq!(
        paths,
        [
            "num_processes",
            "render",
            "algorithm.populations.neurons.num_elite",
            "world.world_delay",
            "world.render_connections",
            "world.objects.lamp.positions",
        ]
    );
    assert_eq!(
        warnings[2].to_string(),
        "line 46: algorithm.populations.neurons.num_elite: ignored: only the genetic algorithm \
         has it"
    );
    assert_eq!(config.algorithm.name, "SNES");
    let params = &config.algorithm.populations["neurons"].params;
    assert_eq!(*params, defaults("SNES"));
}
