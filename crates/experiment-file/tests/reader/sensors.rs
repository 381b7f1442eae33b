//! Sensors that a script reads.

use super::values::TASK;
use super::{BASE, accept, refuse};
use experiment_file::ScriptSensorConfig;

#[test]
fn a_script_sensor_has_n_values_between_its_bounds_by_default_zero_and_one() {
    let mounted = |params: &str| {
        let sensors = r#""sensors": {"wireless_receiver": {}, "light_sensor": {}"#;
        BASE.replace(sensors, &format!(r#"{sensors}, "script_sensor": {params}"#))
            .replace(r#""sensor": "light_sensor""#, r#""sensor": "script_sensor""#)
            .replace(r#""world": {"#, TASK)
    };
    for (params, expected) in [
        (r#"{"n": 6}"#, ScriptSensorConfig { n: 6, low: 0.0, high: 1.0 }),
        (r#"{"n": 6, "low": -2, "high": 3}"#, ScriptSensorConfig { n: 6, low: -2.0, high: 3.0 }),
    ] {
        let config = accept(&mounted(params));
        let sensors = &config.robots().next().unwrap().1.sensors;
        assert_eq!(sensors.script_sensor, Some(expected));
    }
    for (params, problem) in [
        ("{}", "sensors.script_sensor: missing key `n`"),
        (r#"{"n": 0}"#, "sensors.script_sensor.n: must be between 1 and 360, is 0"),
        (r#"{"n": 361}"#, "sensors.script_sensor.n: must be between 1 and 360, is 361"),
        (r#"{"n": 5}"#, "LIGHT.n: is 6, but the reading of robot `bots` has length 5"),
        (r#"{"n": 6, "low": 1}"#, "sensors.script_sensor: `low` 1 is not below `high` 1"),
        (r#"{"n": 6, "high": 1e10}"#, "sensors.script_sensor.high: must be between -1000000000"),
        (r#"{"n": 6, "noise": 1}"#, "sensors.script_sensor.noise: unknown key"),
    ] {
        let error = refuse(&mounted(params));
        assert!(error.contains(problem), "{params}: {error}");
    }
    let error = refuse(&mounted(r#"{"n": 6}"#).replace(TASK, r#""world": {"#));
    let problem =
        "bots.sensors.script_sensor: needs a `task` whose `script` has a function `sense`";
    assert!(error.contains(problem), "{error}");
}
