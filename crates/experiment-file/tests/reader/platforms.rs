//! Platforms: their numbers become defaults, which a file can still set.

use experiment_file::{PLATFORMS, Platform};
use serde_json::Value;

use super::{accept, edited, refuse};

/// An experiment file in a world with bodies, whose robots have these keys, further sensors and
/// wheels.
fn file(keys: &str, sensors: &str, wheels: &str) -> String {
    let world = "\"world\": {\"boundary\": \"walls\", \"bodies\": {\"substeps\": 64},";
    edited("\"world\": {", world)
        .replace("\"type\": \"robot\",", &format!("\"type\": \"robot\", {keys}"))
        .replace("\"light_sensor\": {}}", &format!("\"light_sensor\": {{}}, {sensors}}}"))
        .replace("\"wheel_actuator\": {}", &format!("\"wheel_actuator\": {wheels}"))
        .replace(
            "\"LIGHT\": {\"n\": 6, \"sensor\": \"light_sensor\"}",
            "\"LIGHT\": {\"n\": 1, \"sensor\": \"wireless_receiver:signal\"}",
        )
}

const SENSORS: &str = r#""distance_sensor": {}, "proximity_sensor": {}"#;

/// The robot in the canonical form of a file, which reads back to the same.
fn robot(text: &str) -> Value {
    let config = accept(text);
    let canonical = config.to_canonical_json();
    assert_eq!(accept(&canonical), config);
    let canonical: Value = serde_json::from_str(&canonical).unwrap();
    canonical["world"]["objects"]["bots"].clone()
}

fn at(robot: &Value, key: &str) -> Value {
    robot.pointer(&format!("/{}", key.replace('.', "/"))).unwrap_or(&Value::Null).clone()
}

fn named(platform: &str) -> String {
    format!("\"platform\": \"{platform}\",")
}

#[test]
fn the_canonical_form_has_the_numbers_of_the_platform_in_place_of_its_name() {
    let plain = robot(&file("", SENSORS, "{}"));
    for Platform { name, facts, unknown } in PLATFORMS {
        let robot = robot(&file(&named(name), SENSORS, "{}"));
        assert_eq!(robot["platform"], Value::Null);
        let mut expected = plain.clone();
        for fact in *facts {
            let value = serde_json::to_value(fact.value.value().unwrap()).unwrap();
            assert_eq!(at(&robot, fact.key), value, "{name}: {}", fact.key);
            let (parent, key) = fact.key.rsplit_once('.').unwrap();
            let parent = format!("/{}", parent.replace('.', "/"));
            expected.pointer_mut(&parent).unwrap()[key] = value;
        }
        assert_eq!(robot, expected, "{name} changes nothing else");
        for key in *unknown {
            assert!(!at(&plain, key).is_null(), "{name}: {key} is no key");
            assert!(facts.iter().all(|fact| fact.key != *key), "{name}: {key} is known");
        }
    }
}

#[test]
fn a_platform_mounts_nothing() {
    let robot = robot(&file(&named("e-puck2"), "\"contact_sensor\": {}", "{}"));
    let sensors: Vec<&String> = robot["sensors"].as_object().unwrap().keys().collect();
    assert_eq!(sensors, ["contact_sensor", "light_sensor", "wireless_receiver"]);
}

#[test]
fn keys_of_the_file_win() {
    let body = format!("{} \"body\": {{\"mass\": 0.2}},", named("e-puck2"));
    let robot = robot(&file(&body, r#""proximity_sensor": {"range": 4}"#, r#"{"max_speed": 5}"#));
    for (key, value) in [
        ("body.mass", 0.2),
        ("body.radius", 3.5),
        ("sensors.proximity_sensor.range", 4.0),
        ("actuators.wheel_actuator.max_speed", 5.0),
        ("actuators.wheel_actuator.axle_length", 5.3),
    ] {
        assert_eq!(at(&robot, key), value, "{key}");
    }
}

#[test]
fn another_number_of_rays_puts_them_evenly_around_the_robot() {
    let angles = |sensor: &str| {
        let sensors = format!("\"proximity_sensor\": {sensor}");
        at(&robot(&file(&named("e-puck2"), &sensors, "{}")), "sensors.proximity_sensor.angles")
    };
    assert_eq!(angles("{\"n_rays\": 8}").as_array().unwrap().len(), 8);
    for even in ["{\"n_rays\": 5}", "{\"angles\": null}", "{\"n_rays\": 5, \"angles\": null}"] {
        assert_eq!(angles(even), Value::Null, "{even}");
    }
    assert_eq!(angles("{\"n_rays\": 1, \"angles\": [0.5]}"), serde_json::json!([0.5]));
    let sensors = "\"proximity_sensor\": {\"n_rays\": 2, \"angles\": [0.5]}";
    let problems = refuse(&file(&named("e-puck2"), sensors, "{}"));
    assert!(problems.ends_with("has 1 angles, but `n_rays` is 2"), "{problems}");
}

#[test]
fn robots_that_are_points_have_the_wheels_and_the_radio_of_their_platform() {
    let robot =
        robot(&edited("\"type\": \"robot\",", "\"type\": \"robot\", \"platform\": \"pogobot\","));
    assert_eq!(at(&robot, "actuators.wireless_transmitter.range"), 8.0);
    assert_eq!(robot["body"], Value::Null);
}

#[test]
fn a_misspelt_platform_gets_a_suggestion() {
    let refused = |platform: &str| refuse(&file(platform, SENSORS, "{}"));
    let place = "line 52: world.objects.bots.platform:";
    let expected = format!("{place} unknown name `epuck2`; did you mean `e-puck2`?");
    assert_eq!(refused("\"platform\": \"epuck2\","), expected);
    let expected =
        format!("{place} unknown name `pr2`; known: `e-puck2`, `khepera4`, `kilobot`, `pogobot`");
    assert_eq!(refused("\"platform\": \"pr2\","), expected);
    let expected = format!("{place} expected a string, found a number");
    assert_eq!(refused("\"platform\": 4,"), expected);
}
