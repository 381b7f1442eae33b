//! Values in the wrong unit: accepted, with a warning that names the place and the unit.

use super::{BASE, edited, read};

/// The warnings of a valid text, as people see them.
fn warnings(text: &str) -> Vec<String> {
    let (_, warnings) = read(text).unwrap_or_else(|error| panic!("{error}\nin\n{text}"));
    warnings.iter().map(ToString::to_string).collect()
}

/// Asserts that [`BASE`] with one passage replaced has one warning: at this place, about this unit.
fn doubted(from: &str, to: &str, path: &str, likely: &str) {
    let warnings = warnings(&edited(from, to));
    let [warning] = &warnings[..] else { panic!("{to}: {warnings:#?}") };
    assert!(warning.contains(&format!(": {path}: ")), "{to}: {warning}");
    assert!(warning.ends_with(&format!("; {likely}?")), "{to}: {warning}");
}

const POSITIONS: &str = r#""positions": {"name": "random_graph"}}"#;
const CM_FOR_M: &str = "m instead of cm";
const CM_FOR_MM: &str = "mm instead of cm";
const DEGREES: &str = "degrees instead of radians";

/// Start positions by this initialiser.
fn positions(name: &str, params: &str) -> String {
    format!(r#""positions": {{"name": "{name}", "params": {params}}}}}"#)
}

/// Headings by this initialiser.
fn orientations(name: &str, params: &str) -> String {
    let positions = POSITIONS.strip_suffix('}').unwrap();
    format!(r#"{positions}, "orientations": {{"name": "{name}", "params": {params}}}}}"#)
}

#[test]
fn a_file_in_the_right_units_has_no_warning() {
    assert!(warnings(BASE).is_empty());
    for to in [
        positions("random_uniform", r#"{"low": 0, "high": 1000}"#),
        positions("fixed", r#"{"values": [[0, 0], [0, 1000], [1000, 0], [500, 500]]}"#),
        positions("random_circumference", r#"{"radius": 500}"#),
        orientations("random_uniform", r#"{"low": -3.15, "high": 3.15}"#),
        orientations("fixed", r#"{"values": [[6.2832]]}"#),
    ] {
        assert_eq!(warnings(&edited(POSITIONS, &to)), [""; 0], "{to}");
    }
}

#[test]
fn positions_outside_the_world_and_crowded_robots_are_doubted() {
    let at = "world.objects.bots.initializers.positions.params";
    for (name, params, key, likely) in [
        ("random_uniform", r#"{"low": 0, "high": 10000}"#, "high", CM_FOR_MM),
        ("random_uniform", r#"{"low": -1, "high": 900}"#, "low", CM_FOR_MM),
        ("random_uniform", r#"{"low": 0, "high": 1}"#, "high", CM_FOR_M),
        ("fixed", r#"{"values": [[0, 0], [0, 9], [1500, 9], [9, 9]]}"#, "values[2]", CM_FOR_MM),
        ("fixed", r#"{"values": [[0, 0], [0, 0.5], [1, 0], [0.5, 1]]}"#, "values", CM_FOR_M),
        ("fixed", r#"{"values": [[5, 5]]}"#, "values", CM_FOR_M),
        ("random_circumference", r#"{"radius": 1.3}"#, "radius", CM_FOR_M),
        ("random_circumference", r#"{"radius": 1300}"#, "radius", CM_FOR_MM),
        ("random_circumference", r#"{"center": [5000, 5]}"#, "center", CM_FOR_MM),
        ("random_graph", r#"{"max_rad": 3000}"#, "max_rad", CM_FOR_MM),
        ("random_graph", r#"{"max_rad": 0.3}"#, "max_rad", CM_FOR_M),
        ("random_graph", r#"{"initial_pos": [-5, 5]}"#, "initial_pos", CM_FOR_MM),
    ] {
        doubted(POSITIONS, &positions(name, params), &format!("{at}.{key}"), likely);
    }
    let lamp = "world.objects.lamp.initializers.positions.params.values[0]";
    doubted("[[500, 500]]", "[[5000, 500]]", lamp, CM_FOR_MM);
}

#[test]
fn angles_in_degrees_are_doubted() {
    let at = "world.objects.bots.initializers.orientations.params";
    for (name, params, key) in [
        ("random_uniform", r#"{"low": 0, "high": 360}"#, "high"),
        ("random_uniform", r#"{"low": -180, "high": 3}"#, "low"),
        ("fixed", r#"{"values": [[0], [90], [180], [270]]}"#, "values[1]"),
    ] {
        doubted(POSITIONS, &orientations(name, params), &format!("{at}.{key}"), DEGREES);
    }
    let orbit = r#"{"name": "light_orbit_controller", "params": {"angle_step": 1}}"#;
    let path = "world.objects.lamp.controller.params.angle_step";
    doubted(r#""controller": null"#, &format!(r#""controller": {orbit}"#), path, DEGREES);
    let rotation = r#""uncontrollable_rotation": {"start": 9, "targets": [1, 90]}"#;
    let path = "world.objects.bots.perturbations.uncontrollable_rotation.targets[1]";
    doubted(r#""stimuli_inhibition": {"affected_robots": 2}"#, rotation, path, DEGREES);
}

#[test]
fn lengths_in_other_units_than_cm_are_doubted() {
    let sensors = r#""wireless_receiver": {}, "light_sensor": {}"#;
    for (key, value, likely) in [
        ("range", "1001", CM_FOR_MM),
        ("range", "3", CM_FOR_M),
        ("decay_rho", "5", "per m instead of per cm"),
    ] {
        for sensor in ["wireless_receiver", "light_sensor"] {
            let to = sensors.replace(
                &format!(r#""{sensor}": {{}}"#),
                &format!(r#""{sensor}": {{"{key}": {value}}}"#),
            );
            let path = format!("world.objects.bots.sensors.{sensor}.{key}");
            doubted(sensors, &to, &path, likely);
        }
    }
    let at = "world.objects.bots.actuators";
    for (key, value, likely) in [
        ("max_speed", "130", "mm/s instead of cm/s"),
        ("max_speed", "0.13", "m/s instead of cm/s"),
        ("axle_length", "53", CM_FOR_MM),
        ("axle_length", "0.053", CM_FOR_M),
        ("step_duration", "100", "ms instead of s"),
    ] {
        // A fast robot drives farther in a step than its sensors reach, which gives further
        // warnings.
        let to = format!(r#""wheel_actuator": {{"{key}": {value}}}"#);
        let warnings = warnings(&edited(r#""wheel_actuator": {}"#, &to));
        let path = format!("{at}.wheel_actuator.{key}: ");
        let of_it: Vec<_> = warnings.iter().filter(|warning| warning.contains(&path)).collect();
        assert!(
            matches!(of_it[..], [warning] if warning.ends_with(&format!("; {likely}?"))),
            "{warnings:?}"
        );
    }
    let transmitter = r#""wireless_transmitter": {"range": 5000}"#;
    let path = format!("{at}.wireless_transmitter.range");
    doubted(r#""wireless_transmitter": {}"#, transmitter, &path, CM_FOR_MM);
    for (side, likely) in [("10", CM_FOR_M), ("20000", CM_FOR_MM)] {
        let to = format!("\"world\": {{\n    \"width\": {side}, ");
        let warnings = warnings(&edited("\"world\": {\n", &to));
        let of_it = warnings.iter().find(|warning| warning.contains(": world.width: ")).unwrap();
        assert!(of_it.ends_with(&format!("; {likely}?")), "{of_it}");
    }
    let lamp = r#""params": {"range": 2000}, "controller": null"#;
    doubted(r#""controller": null"#, lamp, "world.objects.lamp.params.range", CM_FOR_MM);
    let near = r#""fitness_function": "goto_light", "fitness_params": {"near": 0.8}"#;
    let path = "algorithm.fitness_params.near";
    doubted(r#""fitness_function": "goto_light""#, near, path, CM_FOR_M);
}

#[test]
fn times_longer_than_a_trial_are_doubted() {
    let exponent = "the time constant itself instead of its exponent";
    let bound = "algorithm.populations.neurons.max_vals[1]";
    doubted("[1.5, 0.75]", "[1.5, 4]", bound, exponent);
    let model = r#""neuron_model": "rate_model""#;
    let to = format!(r#"{model}, "motor_tau": 500"#);
    doubted(model, &to, "topology.motor_tau", "ms instead of s");
    let wheels = r#""OUT_WHEELS": {"n": 2, "#;
    let to = format!(r#"{wheels}"params": {{"tau": 2000}}, "#);
    let path = "topology.ensembles.OUT_WHEELS.params.tau";
    doubted(wheels, &to, path, "ms instead of s");
    for (perturbation, key, value) in [
        ("topology_switch", "every", 200),
        ("leader_failure", "time_to_failure", 5000),
        ("uncontrollable_rotation", "start", 200),
    ] {
        let to = format!(r#""{perturbation}": {{"{key}": {value}}}"#);
        let path = format!("world.objects.bots.perturbations.{perturbation}.{key}");
        let from = r#""stimuli_inhibition": {"affected_robots": 2}"#;
        doubted(from, &to, &path, "ms instead of steps");
    }
}

#[test]
fn seconds_and_volts_of_spiking_neurons_are_doubted() {
    let lif = include_str!("../../../../configs/spiking/leader_selection_lif.json");
    assert!(warnings(lif).is_empty());
    let mut file: serde_json::Value = serde_json::from_str(lif).unwrap();
    let ensemble = file["topology"]["ensembles"].as_object().unwrap().keys().next().unwrap();
    let ensemble = ensemble.clone();
    file["algorithm"]["populations"] = serde_json::json!({
        "network": {"objects": ["synapses:weights:all"], "min_vals": -3, "max_vals": 3}
    });
    file["topology"]["ensembles"][&ensemble]["params"] =
        serde_json::json!({"thresh": -0.05, "v_rest": -0.065, "tau": 20});
    let found = warnings(&file.to_string());
    for parameter in ["thresh", "v_rest"] {
        let path = format!("topology.ensembles.{ensemble}.params.{parameter}: ");
        let of_it = found.iter().find(|warning| warning.contains(&path)).unwrap();
        assert!(of_it.ends_with("; V instead of mV?"), "{of_it}");
    }
    assert_eq!(found.len(), 2, "{found:?}");
}
