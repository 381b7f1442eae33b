//! Lineages of individuals; and submissions of existing experiments.

use harness::{CoordinatorProcess, Experiment, WorkerProcess, swarmctl};
use serde_json::{Value, json};

#[test]
fn a_lineage_names_parents_that_have_the_genes() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let ga = Experiment::tiny(4).edit(|file| {
        file["algorithm"]["name"] = json!("GA");
        let populations = file["algorithm"]["populations"].as_object_mut().unwrap();
        let params = json!({"crossover_operator": "uniform"});
        populations.values_mut().for_each(|population| population["params"] = params.clone());
    });
    let ids = [&ga, &Experiment::tiny(1)].map(|experiment| coordinator.submit(&experiment.path()));
    for id in ids {
        coordinator.watch(id).finish();
    }
    let genes = |address: &str| -> Vec<u64> {
        let found = coordinator.swarmctl(&["individual", address]).expect_success().json();
        let genes = found["genotype"].as_array().unwrap().iter();
        genes.map(|gene| gene.as_f64().unwrap().to_bits()).collect()
    };
    let lineage = ["lineage", "1@3/8", "--depth", "9"];
    let found = coordinator.swarmctl(&lineage).expect_success().json();
    let data_dir = coordinator.data_dir().to_str().unwrap();
    let read = [&lineage[..], &["--data-dir", data_dir]].concat();
    assert_eq!(swarmctl(read).expect_success().json(), found);
    let ancestors = found["populations"][0]["ancestors"].as_array().unwrap();
    let focal = genes("1@3/8");
    assert_eq!(ancestors[0]["genes"], focal.len());
    let mut n_first = 0;
    for ancestor in ancestors {
        let generation = ancestor["generation"].as_u64().unwrap();
        let own = genes(&format!("1@{generation}/{}", ancestor["individual"]));
        let n_common = own.iter().zip(&focal).filter(|(a, b)| a == b).count() as u64;
        assert!(n_common >= ancestor["genes"].as_u64().unwrap(), "{ancestor}");
        n_first += u64::from(generation == 0);
        assert_eq!(ancestor["operator"] == "first", generation == 0);
        for parent in ancestor["parents"].as_array().unwrap() {
            let of = genes(&format!("1@{}/{}", generation - 1, parent["individual"]));
            let n_common = own.iter().zip(&of).filter(|(a, b)| a == b).count() as u64;
            assert!(n_common >= parent["genes"].as_u64().unwrap(), "{ancestor}");
        }
    }
    assert!(n_first > 0);
    for (id, has_distribution) in [("1", false), ("2", true)] {
        let moved = coordinator.swarmctl(&["history", id, "--dynamics"]).expect_success().json();
        let moved = moved.as_array().unwrap();
        assert_eq!(moved.len(), if has_distribution { 1 } else { 4 });
        for of in moved {
            assert_eq!(of["mean_step"].as_f64().is_some_and(|step| step > 0.0), has_distribution);
            assert_eq!(of["deviation_median"].as_f64().is_some(), has_distribution);
            assert!(
                of["rank_correlation"].as_f64().is_none_or(|correlation| correlation.abs() <= 1.0)
            );
        }
    }
    for (address, code, what) in [
        ("1@3", 2, "is not an individual"),
        ("1@3/10", 2, "has no individual 10"),
        ("1@4/0", 3, "generation 4 of experiment 1 is not complete"),
        ("2@0/0", 2, "its individuals have no parents"),
    ] {
        let refused = coordinator.swarmctl(&["lineage", address]);
        assert_eq!(refused.code, Some(code), "{refused:#?}");
        assert!(refused.stderr.contains(what), "{}", refused.stderr);
    }
}

#[test]
fn an_identical_experiment_is_named_and_answers_at_once() {
    let coordinator = CoordinatorProcess::start();
    let workers = WorkerProcess::start_many(&coordinator, 2);
    let experiment = Experiment::tiny(2);
    let path = experiment.path();
    let submit = |args: &[&str]| {
        let submitted = coordinator.swarmctl(&[&["submit", path.to_str().unwrap()], args].concat());
        submitted.expect_success()
    };
    let id = |outcome: &harness::Outcome| outcome.json()["id"].as_u64().unwrap();
    assert_eq!(submit(&["--reuse"]).stderr, "", "there is none yet");
    coordinator.watch(1).finish();
    drop(workers);
    let again = submit(&["--reuse"]);
    assert_eq!((id(&again), again.json()["state"].clone()), (1, Value::from("completed")));
    assert!(again.stderr.contains("experiment 1 has the same file"), "{}", again.stderr);
    let anew = submit(&[]);
    assert_eq!(id(&anew), 2);
    assert!(anew.stderr.contains("`--reuse` returns that one"), "{}", anew.stderr);
    assert_eq!(id(&submit(&["--reuse", "--seed", "8"])), 3);
    assert_eq!(id(&submit(&["--reuse", "--generations", "3"])), 4);
    assert_eq!(id(&submit(&["--reuse"])), 1, "the completed one goes before the unfinished one");
}
