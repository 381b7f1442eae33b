//! Rows of small swarms.

use std::{fs, path::Path};

use sim_core::Simulation;

use super::*;
use crate::experiment_file::tests::quickstart;

const ALL: &[ExtraColumns] = &[ExtraColumns::Neurons, ExtraColumns::Frames, ExtraColumns::Targets];

/// The quickstart, shorter, with more objects before its own.
fn config(objects: &str) -> ExperimentConfig {
    let text = fs::read_to_string(quickstart()).unwrap();
    let text = text
        .replace("\"evaluation_steps\": 100", "\"evaluation_steps\": 30")
        .replace("\"objects\": {", &format!("\"objects\": {{ {objects}"));
    ExperimentConfig::from_json(&text, "", evolution::ALGORITHMS).unwrap().0
}

/// Heading and rows of the first trial, and the records behind them.
fn trace(config: &ExperimentConfig) -> (Vec<Vec<String>>, Vec<StepRecord>) {
    let experiment = Simulation::compile(config).unwrap();
    let genotype = vec![0.6; experiment.genotype_len()];
    let (mut rows, mut records) = (Rows::new(Vec::new(), config, &experiment, ALL), Vec::new());
    let mut observe = |record: &StepRecord| {
        rows.write(4, record).unwrap();
        records.push(record.clone());
    };
    experiment.simulate(&genotype, 0, 0, &mut observe).unwrap();
    let text = String::from_utf8(rows.out).unwrap();
    let cells = |line: &str| line.split(',').map(String::from).collect();
    (text.lines().map(cells).collect(), records)
}

#[test]
fn every_robot_has_a_row_in_every_step_and_numbers_read_back_exactly() {
    let (rows, records) = trace(&config(""));
    let (heading, rows) = rows.split_first().unwrap();
    assert_eq!(rows.len(), 30 * 5);
    let column = |name: &str| heading.iter().position(|cell| cell == name).unwrap();
    let mut n_received = 0;
    for (row, (step, robot)) in rows.iter().zip((0..30).flat_map(|s| (0..5).map(move |r| (s, r)))) {
        assert_eq!(row.len(), heading.len());
        let text = |name: &str| row[column(name)].as_str();
        let bits = |name: &str| text(name).parse::<f64>().unwrap().to_bits();
        let record = &records[step].robots[robot];
        assert_eq!(row[..4], ["4".to_owned(), step.to_string(), robot.to_string(), "robot".into()]);
        assert_eq!(bits("x_cm"), record.position.x.to_bits());
        assert_eq!(bits("heading_rad"), record.heading.to_bits());
        assert_eq!(bits("message_1"), record.message[1].to_bits());
        assert_eq!(bits("stimulus_message_1"), record.stimuli[1].to_bits());
        assert_eq!(bits("stimulus_direction_0"), record.stimuli[3].to_bits());
        assert_eq!(text("led"), record.led.to_string());
        let originator = record.received.map(|frame| frame.originator.to_string());
        assert_eq!(text("frame_originator"), originator.unwrap_or_default());
        assert_eq!(bits("neuron_H1_0"), record.activity[0].to_bits());
        let emitter = record.received.map(|frame| frame.emitter.to_string());
        assert_eq!(text("frame_emitter"), emitter.unwrap_or_default());
        assert_eq!(text("led_target"), "", "no task of this file says who should shine");
        n_received += usize::from(record.received.is_some());
        let fitness = records[step].fitness.map(number).unwrap_or_default();
        assert_eq!(text("step_fitness"), fitness);
        assert_eq!(bits("metric_one_leader"), records[step].measures["one_leader"].to_bits());
    }
    assert!(n_received > 0);
}

#[test]
fn robots_with_other_controllers_have_columns_of_their_own_and_lights_have_places() {
    let (rows, records) = trace(&config(
        r#"
        "follower": {
            "type": "robot", "num_instances": 1, "controller": "braitenberg_light_follower",
            "sensors": {"light_sensor": {"n_sectors": 2}},
            "actuators": {"wheel_actuator": {}},
            "initializers": {
                "positions": {"name": "fixed", "params": {"values": [[500, 500]]}},
                "orientations": {"name": "fixed", "params": {"values": [[0]]}}
            }
        },
        "lamp": {
            "type": "light_source", "num_instances": 1, "controller": null,
            "initializers": {"positions": {"name": "fixed", "params": {"values": [[510, 490]]}}},
            "params": {"range": 100, "color": "red"}
        },"#,
    ));
    let heading = &rows[0];
    let at = |row: &[String], name: &str| {
        row[heading.iter().position(|cell| cell == name).unwrap()].clone()
    };
    let (robot, follower) = (&rows[2], &rows[1]);
    assert_eq!(at(follower, "object"), "follower");
    assert_eq!(at(follower, "stimulus_light_sensor_1"), number(records[0].robots[0].stimuli[1]));
    assert_eq!(at(follower, "stimulus_message_0"), "");
    assert_eq!(at(robot, "stimulus_light_sensor_1"), "");
    assert_eq!(at(robot, "light_0_x_cm"), "510.0");
    assert_eq!(at(robot, "light_0_y_cm"), "490.0");
}

#[test]
fn measures_that_begin_late_have_a_column_from_the_first_step() {
    let mut text: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(quickstart()).unwrap()).unwrap();
    let script = "def fitness(world):\n    return 1\n\ndef measures(world):\n    return \
                  {\"late\": 1 if world.step == 2 else None, \"now\": world.step}\n";
    text["task"] = serde_json::json!({"script": {"name": "late.star", "text": script}});
    text["algorithm"].as_object_mut().unwrap().remove("fitness_function");
    text["algorithm"]["evaluation_steps"] = 3.into();
    let (config, _) =
        ExperimentConfig::from_json(&text.to_string(), "", evolution::ALGORITHMS).unwrap();
    let (rows, _) = trace(&config);
    let column = |name: &str| rows[0].iter().position(|cell| cell == name).unwrap();
    for row in &rows[1..] {
        assert_eq!(row.len(), rows[0].len());
        let step: f64 = row[column("step")].parse().unwrap();
        assert_eq!(row[column("metric_late")], if step == 2.0 { "1.0" } else { "" });
        assert_eq!(row[column("metric_now")], format!("{step:?}"));
    }
}

#[test]
fn names_cannot_break_rows() {
    assert_eq!(quoted("robot"), "robot");
    assert_eq!(quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
}

#[test]
fn a_failure_is_reported_at_the_end() {
    let full = Path::new("/dev/full");
    if full.exists() {
        let config = config("");
        let experiment = Simulation::compile(&config).unwrap();
        let mut trace =
            Trace::create(full, &config, &experiment, &[], Overwrite::default()).unwrap();
        let genotype = vec![0.5; experiment.genotype_len()];
        experiment.simulate(&genotype, 0, 0, &mut |record| trace.record(0, record)).unwrap();
        assert!(trace.finish().unwrap_err().to_string().starts_with("cannot write /dev/full: "));
    }
}

#[test]
fn spiking_neurons_have_voltages() {
    let file = quickstart().with_file_name("spiking/leader_selection_lif.json");
    let mut text: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    text["algorithm"]["evaluation_steps"] = 2.into();
    let (config, _) =
        ExperimentConfig::from_json(&text.to_string(), "", evolution::ALGORITHMS).unwrap();
    let (rows, records) = trace(&config);
    let column = rows[0].iter().position(|cell| cell == "voltage_OUT_LED_1").unwrap();
    let voltage = records[0].robots[0].voltages[25];
    assert_eq!(rows[1][column].parse::<f64>().unwrap().to_bits(), voltage.to_bits());
    assert_eq!(records[0].robots[0].voltages.len(), 26);
}
