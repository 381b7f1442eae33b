//! The experiments that the project ships.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{accept, read};
use experiment_file::{EncodingScheme, FitnessFunction, NeuronModel};

/// Every shipped file: its stem and its text.
pub(super) fn shipped() -> Vec<(String, String)> {
    files_of("../../configs")
}

/// The shipped experiments of spiking swarms.
pub(super) fn spiking() -> Vec<(String, String)> {
    files_of("../../configs/spiking")
}

/// Tasks of the thesis with the settings of its Python simulator.
fn original() -> Vec<(String, String)> {
    files_of("../../configs/original")
}

fn files_of(folder: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = entries.filter(|path| path.is_file()).collect();
    paths.sort();
    let text = |path: &PathBuf| fs::read_to_string(path).unwrap();
    let stem = |path: &PathBuf| path.file_stem().unwrap().to_str().unwrap().to_owned();
    paths.iter().map(|path| (stem(path), text(path))).collect()
}

#[test]
fn shipped_files_are_accepted_without_warnings_under_their_own_names() {
    for (stem, text) in shipped().into_iter().chain(spiking()).chain(original()) {
        let (config, warnings) = read(&text).unwrap();
        assert_eq!((config.name, warnings), (stem, vec![]));
    }
}

/// Three tasks are shipped with two spiking neuron models each. Trials and population are those of
/// the file with rate neurons.
#[test]
fn spiking_files_differ_from_rate_files_in_the_neurons_only() {
    let rate = shipped();
    let spiking = spiking();
    for task in ["leader_selection", "borderline", "light_follower"] {
        let find = |files: &[(String, String)], name: &str| {
            let (_, text) = files.iter().find(|(stem, _)| stem == name).expect(name);
            accept(text)
        };
        let expected = find(&rate, &format!("{task}_snes"));
        for (name, model) in [("lif", NeuronModel::Lif), ("adex", NeuronModel::AdEx)] {
            let config = find(&spiking, &format!("{task}_{name}"));
            assert_eq!(config.topology.neuron_model, model);
            assert_eq!(config.world, expected.world);
            let [ours, theirs] = [&config.algorithm, &expected.algorithm].map(|algorithm| {
                (
                    algorithm.fitness_function,
                    algorithm.population_size,
                    algorithm.num_evaluations,
                    algorithm.evaluation_steps,
                )
            });
            assert_eq!(ours, theirs);
        }
    }
    assert_eq!(spiking.len(), 8);
}

/// The files differ from the files of their tasks only in the network.
#[test]
fn encoders_and_plasticity_are_shipped() {
    let spiking = spiking();
    let find = |name: &str| {
        let (_, text) = spiking.iter().find(|(stem, _)| stem == name).expect(name);
        accept(text)
    };
    for (name, task) in [
        ("light_follower_lif_encoded", "light_follower_lif"),
        ("leader_selection_lif_plastic", "leader_selection_lif"),
    ] {
        assert_eq!(find(name).world, find(task).world);
    }
    let encoded = find("light_follower_lif_encoded").topology;
    let schemes: Vec<EncodingScheme> =
        encoded.encoding.values().map(|encoding| encoding.scheme).collect();
    use EncodingScheme::{Lif, PoissonRate, RankOrder};
    assert_eq!(schemes, [Lif, RankOrder, PoissonRate]);
    assert!(find("leader_selection_lif_plastic").topology.learning.unwrap().reward.is_some());
}

#[test]
fn every_task_is_shipped_for_the_ga_and_for_snes() {
    let shipped = shipped();
    let tasks = [
        ("leader_selection", FitnessFunction::IdentifyLeader, 10),
        ("borderline", FitnessFunction::IdentifyBorderline, 20),
        ("orientation_consensus", FitnessFunction::OrientationConsensus, 10),
        ("orientation_consensus_alignment", FitnessFunction::Alignment, 10),
        ("light_follower", FitnessFunction::GotoLight, 10),
        ("light_follower_thesis_sensors", FitnessFunction::GotoLight, 10),
    ];
    for (task, fitness, n_robots) in tasks {
        for algorithm in ["ga", "snes"] {
            let name = format!("{task}_{algorithm}");
            let (_, text) = shipped.iter().find(|(stem, _)| *stem == name).expect(&name);
            let config = accept(text);
            assert_eq!(config.algorithm.fitness_function, fitness);
            assert_eq!(
                config.robots().map(|(_, robot)| robot.num_instances).sum::<u32>(),
                n_robots
            );
        }
    }
    assert_eq!(shipped.len(), 2 * tasks.len() + 1);
}

/// Readers of a file thus see the constants without knowing the defaults.
#[test]
fn shipped_files_state_every_constant_of_sensors_and_actuators() {
    for (stem, text) in shipped().into_iter().chain(spiking()) {
        let file: Value = serde_json::from_str(&text).unwrap();
        let canonical: Value = serde_json::from_str(&accept(&text).to_canonical_json()).unwrap();
        for (name, object) in canonical["world"]["objects"].as_object().unwrap() {
            for part in ["sensors", "actuators", "initializers", "params"] {
                let stated = &file["world"]["objects"][name][part];
                assert_same_keys(&object[part], stated, &format!("{stem}: {name}.{part}"));
            }
        }
    }
}

fn assert_same_keys(expected: &Value, stated: &Value, place: &str) {
    let Some(expected) = expected.as_object() else {
        return;
    };
    for (key, inner) in expected {
        assert!(stated.get(key).is_some(), "{place}.{key} is not stated");
        assert_same_keys(inner, &stated[key], &format!("{place}.{key}"));
    }
}
