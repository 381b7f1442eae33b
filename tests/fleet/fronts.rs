//! Fronts on a fleet: the same bits through kills and audits, proofs, forks, addresses.

use harness::{CoordinatorProcess, Experiment, WorkerProcess};
use serde_json::{Value, json};

use crate::determinism::assert_same_bits_through_kills;

/// Leader selection with few changes of the leader as a second aim.
fn experiment(generations: u64) -> Experiment {
    Experiment::tiny(generations).edit(|file| {
        file["algorithm"]["name"] = json!("NSGA-II");
        file["algorithm"]["aims"] = json!({"measure": "leaders", "direction": "minimise"});
        let populations = file["algorithm"]["populations"].as_object_mut().unwrap();
        populations.values_mut().for_each(|population| population["params"] = json!({}));
    })
}

#[test]
fn a_front_has_the_same_bits_alone_and_on_a_fleet_that_is_killed_and_audited() {
    assert_same_bits_through_kills(&experiment(6), "NSGA-II");
}

#[test]
fn forks_continue_a_front_and_cannot_change_its_aims() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    coordinator.watch(coordinator.submit(&experiment(4).path())).finish();
    let digest = |id: &str| {
        let history = coordinator.swarmctl(&["history", id]).expect_success().json();
        history.as_array().unwrap().last().unwrap()["digest"].clone()
    };
    coordinator.swarmctl(&["fork", "1@1", "--generations", "4"]).expect_success();
    coordinator.watch(2).finish();
    assert_eq!(digest("1"), digest("2"));
    let change = "algorithm.aims=[{\"measure\": \"leaders\", \"direction\": \"maximise\"}]";
    let refused = coordinator.swarmctl(&["fork", "1@1", "--set", change]);
    assert_eq!(refused.code, Some(2), "{refused:#?}");
    assert!(refused.stderr.contains("algorithm.aims: are part of the state of NSGA-II"));
    let lineage = coordinator.swarmctl(&["lineage", "1@3/9", "--depth", "3"]).expect_success();
    let ancestors = lineage.json()["populations"][0]["ancestors"].as_array().unwrap().clone();
    assert!(ancestors.iter().any(|ancestor| ancestor["operator"] == "crossover"), "{ancestors:?}");
}

#[test]
fn elites_of_a_front_are_judged_and_have_addresses() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    coordinator.watch(coordinator.submit(&experiment(4).path())).finish();
    coordinator.watch(coordinator.submit(&Experiment::tiny(1).path())).finish();
    let front = coordinator.swarmctl(&["front", "1"]).expect_success().json();
    let elites = front["elites"].as_array().unwrap();
    let on_it: Vec<&Value> = elites.iter().filter(|elite| elite["shown"] == true).collect();
    assert_eq!(front["figures"]["stay"], json!(on_it.len() as f64 / elites.len() as f64));
    let better = |a: &Value, b: &Value| {
        let of = |elite: &Value, key: &str| elite["judged"].pointer(key).unwrap().as_f64().unwrap();
        let (leaders, fitness) = ("/aims/leaders_mean", "/fitness");
        of(a, leaders) <= of(b, leaders) && of(a, fitness) > of(b, fitness)
    };
    assert!(on_it.iter().all(|b| !on_it.iter().any(|a| better(a, b))), "{front:#}");
    let address = on_it[0]["address"].as_str().unwrap();
    let individual = coordinator.swarmctl(&["individual", address]).expect_success().json();
    assert_eq!(individual["genotype"].as_array().unwrap().len(), {
        let first = coordinator.swarmctl(&["individual", "1@0/0"]).expect_success().json();
        first["genotype"].as_array().unwrap().len()
    });
    let volume = |reference: &str| {
        let args = ["front", "1", "--reference", reference];
        coordinator.swarmctl(&args).expect_success().json()["figures"]["hypervolume"].as_f64()
    };
    assert!(volume("-100,100").unwrap() > volume("-10,10").unwrap());
    let directory = tempfile::tempdir().unwrap();
    let figure = directory.path().join("front.png");
    coordinator.swarmctl(&["front", "1", "--to", figure.to_str().unwrap()]).expect_success();
    assert!(std::fs::read(figure).unwrap().starts_with(b"\x89PNG"));
    // Before the end, nothing is judged.
    let before = coordinator.swarmctl(&["front", "1@2"]).expect_success().json();
    assert!(before["figures"]["stay"].is_null() && before["elites"][0]["judged"].is_null());
    for (args, code, what) in [
        (
            &["front", "1", "--reference", "1"][..],
            2,
            "needs 2 finite numbers, for fitness, leaders; it has 1",
        ),
        (&["front", "2"], 2, "has no front: SNES evolves none; NSGA-II does"),
        (&["repertoire", "1"], 2, "has no repertoire: NSGA-II evolves none"),
        (&["front", "1@9"], 3, "generation 9 of experiment 1 is not complete"),
    ] {
        let refused = coordinator.swarmctl(args);
        assert_eq!(refused.code, Some(code), "{refused:#?}");
        assert!(refused.stderr.contains(what), "{}", refused.stderr);
    }
}
