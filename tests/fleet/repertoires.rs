//! Repertoires on a fleet: the same bits through kills and audits, proofs, forks, addresses.

use std::collections::BTreeSet;

use harness::{CoordinatorProcess, Experiment, WorkerProcess, swarmctl};
use serde_json::json;

use crate::determinism::assert_same_bits_through_kills;

/// Leader selection by an algorithm of repertoires, with two descriptors.
fn experiment(algorithm: &str, generations: u64) -> Experiment {
    Experiment::tiny(generations).edit(|file| {
        file["algorithm"]["name"] = json!(algorithm);
        file["algorithm"]["descriptors"] = json!([
            {"measure": "leaders", "range": [0, 5], "cells": 4},
            {"measure": "one_leader", "of": "end", "range": [0, 1], "cells": 2},
        ]);
        let populations = file["algorithm"]["populations"].as_object_mut().unwrap();
        populations.values_mut().for_each(|population| population["params"] = json!({}));
        if algorithm == "CMA-MAE" {
            // Its matrices have room for 500 genes.
            file["topology"]["synapses"].as_object_mut().unwrap().remove("H2-H2").unwrap();
        }
    })
}

#[test]
fn a_repertoire_has_the_same_bits_alone_and_on_a_fleet_that_is_killed_and_audited() {
    for algorithm in ["MAP-Elites", "novelty", "CMA-MAE", "sep-CMA-MAE"] {
        assert_same_bits_through_kills(&experiment(algorithm, 6), algorithm);
    }
}

#[test]
fn forks_continue_a_repertoire_and_cannot_change_its_descriptors() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let digest = |id: &str| {
        let history = coordinator.swarmctl(&["history", id]).expect_success().json();
        history.as_array().unwrap().last().unwrap()["digest"].clone()
    };
    let pairs = [("DNS", "1", "2"), ("novelty", "3", "4"), ("sep-CMA-MAE", "5", "6")];
    for (algorithm, parent, fork) in pairs {
        coordinator.watch(coordinator.submit(&experiment(algorithm, 4).path())).finish();
        let from = format!("{parent}@1");
        coordinator.swarmctl(&["fork", &from, "--generations", "4"]).expect_success();
        coordinator.watch(fork.parse().unwrap()).finish();
        assert_eq!(digest(parent), digest(fork), "{algorithm}");
    }
    let change = "algorithm.descriptors=[{\"measure\": \"leaders\", \"range\": [0, 1]}]";
    let refused = coordinator.swarmctl(&["fork", "1@1", "--set", change]);
    assert_eq!(refused.code, Some(2), "{refused:#?}");
    assert!(refused.stderr.contains("algorithm.descriptors: are part of the state of DNS"));
    let lineage = coordinator.swarmctl(&["lineage", "1@3/9", "--depth", "3"]).expect_success();
    let ancestors = lineage.json()["populations"][0]["ancestors"].as_array().unwrap().clone();
    assert!(ancestors.iter().any(|ancestor| ancestor["operator"] == "line"), "{ancestors:?}");
    // Individuals of distributions have no parents.
    let refused = coordinator.swarmctl(&["lineage", "5@3/9"]);
    assert_eq!(refused.code, Some(2), "{refused:#?}");
}

#[test]
fn elites_of_forks_have_the_address_of_their_birth() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    // Its repertoire has room for all individuals.
    coordinator.watch(coordinator.submit(&experiment("DNS", 4).path())).finish();
    for (from, seed, generations, id) in [("1@1", "2", "5", 2), ("2@3", "3", "6", 3)] {
        let fork = ["fork", from, "--seed", seed, "--generations", generations];
        coordinator.swarmctl(&fork).expect_success();
        coordinator.watch(id).finish();
    }
    let found = coordinator.swarmctl(&["repertoire", "3@4"]).expect_success().json();
    let individual =
        |address: &str| coordinator.swarmctl(&["individual", address]).expect_success().json();
    let mut experiments = BTreeSet::new();
    for elite in found["elites"].as_array().unwrap() {
        let address = elite["address"].as_str().unwrap();
        let (id, place) = address.split_once('@').unwrap();
        let (generation, _) = place.split_once('/').unwrap();
        let born = match generation.parse::<u64>().unwrap() {
            0 | 1 => "1",
            2 | 3 => "2",
            _ => "3",
        };
        assert_eq!(id, born, "{address}");
        if experiments.insert(id) {
            individual(address);
        }
        if elite["shown"] == true {
            let of_cell = format!("3@4/cell({},{})", elite["cell"][0], elite["cell"][1]);
            assert_eq!(individual(&of_cell), individual(address));
            coordinator.swarmctl(&["lineage", &of_cell]).expect_success();
        }
    }
    assert_eq!(experiments, BTreeSet::from(["1", "2", "3"]));
}

#[test]
fn elites_have_addresses_by_cell_and_a_repertoire_is_read_like_every_record() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    for experiment in [experiment("MAP-Elites", 4), Experiment::tiny(1)] {
        coordinator.watch(coordinator.submit(&experiment.path())).finish();
    }
    let found = coordinator.swarmctl(&["repertoire", "1"]).expect_success().json();
    let data_dir = coordinator.data_dir().to_str().unwrap();
    let read = swarmctl(["repertoire", "1", "--data-dir", data_dir]).expect_success().json();
    assert_eq!(read, found);
    assert_eq!(found["axes"][1]["name"], "one_leader_end");
    let elites = found["elites"].as_array().unwrap();
    assert!(found["corrected"]["coverage"].as_f64().unwrap() > 0.0);
    for elite in elites {
        assert!(elite["judged"]["fitness"].is_f64(), "{elite}");
        let cell = elite["cell"].as_array().unwrap();
        let address = format!("1@3/cell({},{})", cell[0], cell[1]);
        let genotype = |address: &str| {
            let individual = coordinator.swarmctl(&["individual", address]).expect_success();
            individual.json()["genotype"].clone()
        };
        // A cell of MAP-Elites has a single elite.
        assert_eq!(genotype(&address), genotype(elite["address"].as_str().unwrap()));
        coordinator.swarmctl(&["lineage", &address]).expect_success();
    }
    // Before the end, nothing is judged.
    let before = coordinator.swarmctl(&["repertoire", "1@2"]).expect_success().json();
    assert!(before["corrected"].is_null() && before["elites"][0]["judged"].is_null());
    let directory = tempfile::tempdir().unwrap();
    let map = directory.path().join("map.png");
    coordinator.swarmctl(&["repertoire", "1", "--to", map.to_str().unwrap()]).expect_success();
    assert!(std::fs::read(map).unwrap().starts_with(b"\x89PNG"));
    for (args, code, what) in [
        (["individual", "1@3/cell(9,9)"], 2, "cell(9,9) has no elite after generation 3"),
        (["repertoire", "2"], 2, "has no repertoire: SNES evolves none; MAP-Elites does"),
        (["repertoire", "1@9"], 3, "generation 9 of experiment 1 is not complete"),
    ] {
        let refused = coordinator.swarmctl(&args);
        assert_eq!(refused.code, Some(code), "{refused:#?}");
        assert!(refused.stderr.contains(what), "{}", refused.stderr);
    }
}
