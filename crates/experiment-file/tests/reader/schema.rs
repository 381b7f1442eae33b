//! The schema and the reader agree, as far as a schema can.

use serde_json::{Value, json};

use super::generated::n_files;
use super::generator::{Dice, damage, experiment};
use super::shipped::shipped;
use super::validator::{is_valid, problems};
use super::{BASE, edited, read};
use evolution::ALGORITHMS;
use experiment_file::json_schema;

fn schema() -> Value {
    json_schema(ALGORITHMS)
}

fn base(from: &str, to: &str) -> Value {
    serde_json::from_str(&edited(from, to)).unwrap()
}

#[test]
fn shipped_files_and_their_canonical_forms_fit_the_schema() {
    let schema = schema();
    for (stem, text) in shipped() {
        let canonical = super::accept(&text).to_canonical_json();
        for text in [text, canonical] {
            let file = serde_json::from_str(&text).unwrap();
            assert_eq!(problems(&schema, &file), [""; 0], "{stem}");
        }
    }
}

#[test]
fn unknown_keys_missing_keys_and_wrong_types_do_not_fit_the_schema() {
    let schema = schema();
    assert!(is_valid(&schema, &serde_json::from_str(BASE).unwrap()));
    for (from, to) in [
        (r#""name": "base","#, r#""nane": "base","#),
        (r#""generations": 10,"#, ""),
        (r#""generations": 10"#, r#""generations": "10""#),
        (r#""generations": 10"#, r#""generations": 0"#),
        (r#""name": "GA""#, r#""name": "GAA""#),
        (r#""num_elite": 2"#, r#""num_elites": 2"#),
        (r#""neurons:tau:H""#, r#""neuron:tau:H""#),
        (r#""H": {"n": 4}"#, r#""H": {"n": 4, "tau": 1}"#),
        (r#""p": 0.5"#, r#""p": 1.5"#),
        (r#""pre": ["MSG", "LIGHT"]"#, r#""pre": 3"#),
        (r#"{"scheme": "ThresholdDecoding"}"#, r#"{"scheme": "FirstSpike"}"#),
        (r#"{"scheme": "ThresholdDecoding"}"#, r#"{"scheme": "ThresholdDecoding", "p": 1}"#),
        (r#""wheel_actuator": {}}"#, r#""wheel_actuator": {"speed": 1}}"#),
        (r#""wheel_actuator": {}}"#, r#""wheel_actuator": null}"#),
        (r#""name": "random_graph""#, r#""name": "random_graph", "params": {"radius": 1}"#),
        (r#""num_instances": 4"#, r#""num_instances": 4, "colour": "red""#),
        (r#""num_instances": 1"#, r#""num_instances": 1, "sensors": {}"#),
        (r#""type": "light_source""#, r#""type": "lamp""#),
        (r#""controller": null"#, r#""controller": "orbit""#),
        (r#""values": [[500, 500]]"#, r#""value": [[500, 500]]"#),
        (r#""affected_robots": 2"#, r#""affected_robots": "some""#),
    ] {
        assert!(!is_valid(&schema, &base(from, to)), "{to}");
    }
}

/// Every accepted file fits the schema, so the reader refuses every file that does not fit.
#[test]
fn accepted_files_fit_the_schema() {
    let schema = schema();
    let (mut n_refused_by_both, mut n_refused_by_reader) = (0, 0);
    for index in 0..(4 * n_files()).min(2_000) {
        let mut dice = Dice::new(index);
        let mut file = experiment(&mut dice);
        if index % 4 != 0 {
            damage(&mut dice, &mut file);
        }
        match read(&file.to_string()) {
            Ok(_) => assert_eq!(problems(&schema, &file), [""; 0], "{file}"),
            Err(_) => {
                n_refused_by_reader += 1;
                n_refused_by_both += u32::from(!is_valid(&schema, &file));
            }
        }
    }
    assert!(
        n_refused_by_both * 2 > n_refused_by_reader,
        "{n_refused_by_both} of {n_refused_by_reader}"
    );
}

#[test]
fn the_schema_carries_descriptions_and_defaults() {
    let schema = json_schema(ALGORITHMS);
    let receiver = &schema["$defs"]["WirelessReceiverConfig"]["properties"]["n_sectors"];
    assert_eq!(receiver["default"], json!(4));
    assert_eq!(receiver["description"], json!("Number of sectors around the robot; default 4."));
}
