//! Files of SpikeSwarmSim, accepted unchanged. The files are not part of the project: without them,
//! these tests report that and pass. Files of our own with all of their keys are tested everywhere.

use std::{collections::BTreeSet, env, fs, io::Write as _};

use serde_json::{Value, json};

use super::{defaults, read};
use experiment_file::{ExperimentConfig, FitnessFunction};

/// The default folder of the files, which `SWARM_REFERENCE` replaces.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference");
const SHIPPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs");

/// The text of a file of SpikeSwarmSim, if it is there.
fn text(file: &str) -> Option<String> {
    let folder = env::var("SWARM_REFERENCE").unwrap_or_else(|_| FOLDER.to_owned());
    let path = format!("{folder}/{file}");
    let text = fs::read_to_string(&path);
    if text.is_err() {
        // Bypasses the capture of a test's output, because `.ci/run` lists these lines.
        let _ = std::io::stderr().write_all(format!("\nSKIPPED: {path} is absent\n").as_bytes());
    }
    text.ok()
}

/// The configuration, and the paths of its warnings.
fn accepted(text: &str) -> (ExperimentConfig, Vec<String>) {
    let (config, warnings) = read(text).unwrap_or_else(|error| panic!("{error}"));
    (config, warnings.into_iter().map(|warning| warning.path).collect())
}

fn reference(file: &str) -> Option<(ExperimentConfig, Vec<String>)> {
    text(file).map(|text| accepted(&text))
}

/// A shipped file rewritten with the keys of SpikeSwarmSim.
fn in_the_manner_of_the_original(file: &str) -> Value {
    let text = fs::read_to_string(format!("{SHIPPED}/{file}")).unwrap();
    let mut file: Value = serde_json::from_str(&text).unwrap();
    let name = file.as_object_mut().unwrap().remove("name").unwrap();
    file["checkpoint_file"] = name;
    file["num_processes"] = json!(1);
    file["render"] = json!(false);
    file["world"]["world_delay"] = json!(1);
    file["world"]["render_connections"] = json!(true);
    for ensemble in file["topology"]["ensembles"].as_object_mut().unwrap().values_mut() {
        *ensemble = json!({"n": ensemble["n"], "params": {}});
    }
    if let Some(light) = file["world"]["objects"].get_mut("light_red") {
        light["positions"] = json!("random");
        let params = json!({"radius": 1, "center": [500, 500]});
        light["initializers"]["positions"] =
            json!({"name": "random_circumference", "params": params});
    }
    file
}

/// All keys of a file, except names that its author chooses.
fn keys(file: &Value) -> BTreeSet<String> {
    const MAPS_OF_NAMES: [&str; 8] = [
        "stimuli",
        "encoding",
        "ensembles",
        "outputs",
        "synapses",
        "decoding",
        "populations",
        "objects",
    ];
    fn add(value: &Value, are_names: bool, keys: &mut BTreeSet<String>) {
        match value {
            Value::Object(fields) => {
                for (key, value) in fields {
                    if !are_names {
                        keys.insert(key.clone());
                    }
                    add(value, !are_names && MAPS_OF_NAMES.contains(&&**key), keys);
                }
            }
            Value::Array(items) => items.iter().for_each(|item| add(item, false, keys)),
            _ => {}
        }
    }
    let mut found = BTreeSet::new();
    add(file, false, &mut found);
    found
}

#[test]
fn keys_of_the_original_are_accepted_and_ineffective_ones_are_named() {
    let general = ["num_processes", "render", "world.world_delay", "world.render_connections"];
    let of_light = ["world.objects.light_red.positions"];
    for (ours, theirs, more) in [
        ("leader_selection_snes.json", "experimentA_SNES_ctrnn.json", &[][..]),
        ("light_follower_ga.json", "experimentD_GA_ctrnn.json", &of_light),
    ] {
        let file = in_the_manner_of_the_original(ours);
        let (config, warnings) = accepted(&file.to_string());
        let expected: BTreeSet<&str> = general.iter().chain(more).copied().collect();
        assert_eq!(warnings.iter().map(String::as_str).collect::<BTreeSet<_>>(), expected);
        assert!(ours.starts_with(&config.name), "{}", config.name);
        if let Some(text) = text(theirs) {
            let theirs = keys(&serde_json::from_str(&text).unwrap());
            let ours = keys(&file);
            assert!(ours.is_superset(&theirs), "{:?}", &theirs - &ours);
        }
    }
}

#[test]
fn experiment_a_is_accepted_unchanged() {
    let Some((config, warnings)) = reference("experimentA_SNES_ctrnn.json") else {
        return;
    };
    let ignored = ["num_processes", "render", "world.world_delay", "world.render_connections"];
    assert_eq!(warnings, ignored);
    assert_eq!(config.name, "chk_experimentA_SNES_ctrnn");
    assert_eq!(config.algorithm.fitness_function, FitnessFunction::IdentifyLeader);
    let population = &config.algorithm.populations["p4"];
    assert_eq!(population.params, defaults("SNES"));
    assert_eq!(config.topology.synapses.len(), 15);
}

#[test]
fn experiment_d_is_accepted_unchanged() {
    let Some((config, warnings)) = reference("experimentD_GA_ctrnn.json") else {
        return;
    };
    let ignored =
        ["world.world_delay", "world.render_connections", "world.objects.light_red.positions"];
    assert_eq!(warnings, ignored);
    assert_eq!(config.algorithm.fitness_function, FitnessFunction::GotoLight);
    let population = &config.algorithm.populations["p1"];
    assert_eq!(population.params, defaults("GA"));
}
