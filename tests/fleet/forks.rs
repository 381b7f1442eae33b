//! Experiments that continue the state of another one.

use harness::{CoordinatorProcess, Experiment, WorkerProcess, swarmctl};
use serde_json::Value;

fn digests(coordinator: &CoordinatorProcess, id: u64) -> Vec<Value> {
    let history = coordinator.swarmctl(&["history", &id.to_string()]).expect_success().json();
    history.as_array().unwrap().iter().map(|row| row["digest"].clone()).collect()
}

fn fork(coordinator: &CoordinatorProcess, args: &[&str]) -> Value {
    coordinator.swarmctl(&[&["fork"], args].concat()).expect_success().json()
}

#[test]
fn a_fork_shares_the_past_of_its_parent_and_without_changes_its_future() {
    let mut coordinator = CoordinatorProcess::start();
    let workers = WorkerProcess::start_many(&coordinator, 2);
    let parent = coordinator.submit(&Experiment::tiny(5).path());
    let of_parent = coordinator.watch(parent).finish();
    drop(workers);

    // Forks that were stopped before their first own generation continue.
    let same = fork(&coordinator, &["1@2", "--name", "the same"]);
    assert_eq!(
        same["forked_from"]["changes"][0],
        "name: \"leader_selection_snes\" -> \"the same\""
    );
    let smaller = ["1@2", "--set", "world.objects.robotA.num_instances=4"];
    let smaller = fork(&coordinator, &smaller);
    let reseeded = fork(&coordinator, &["1@2", "--seed", "99", "--generations", "4"]);
    coordinator.process.kill();
    coordinator.restart();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let ids = [&same, &smaller, &reseeded].map(|experiment| experiment["id"].as_u64().unwrap());
    let ends = ids.map(|id| coordinator.watch(id).finish());

    let expected = digests(&coordinator, parent);
    assert_eq!(digests(&coordinator, ids[0]), expected);
    assert_eq!(ends[0].last["digest"], of_parent.last["digest"], "champion and judgement, too");
    assert_eq!(ends[0].last["champion"], of_parent.last["champion"]);
    for id in &ids[1..] {
        let found = digests(&coordinator, *id);
        assert_eq!(found[..3], expected[..3]);
        assert_ne!(found[3], expected[3]);
    }

    // The state is the same, so a change of the swarm changes no genotype.
    let genotypes = |address: &str| {
        let population = coordinator.swarmctl(&["individual", address]).expect_success().json();
        let individuals = population["individuals"].as_array().unwrap().clone();
        individuals.iter().map(|individual| individual["genotype"].clone()).collect::<Vec<_>>()
    };
    let [_, smaller, reseeded] = ids;
    assert_eq!(genotypes(&format!("{smaller}@3")), genotypes("1@3"));
    assert_ne!(genotypes(&format!("{reseeded}@3")), genotypes("1@3"));
    let shared = coordinator.swarmctl(&["individual", &format!("{smaller}@1/0")]);
    assert_eq!(shared.code, Some(3), "{shared:#?}");
    assert!(shared.stderr.contains("ask for 1@1"), "{}", shared.stderr);

    let listed = coordinator.swarmctl(&["list"]).expect_success().json();
    let origin = &listed[2]["forked_from"];
    assert_eq!((&origin["experiment"], &origin["generation"]), (&1.into(), &2.into()));
    let change = "world.objects.robotA.num_instances: 10 -> 4";
    assert_eq!(origin["changes"], Value::from(vec![change]));
    refusals(&coordinator);
    let data_dir = coordinator.data_dir().to_str().unwrap();
    swarmctl(["doctor", "--data-dir", data_dir]).expect_success();
}

fn refusals(coordinator: &CoordinatorProcess) {
    for (args, code, what) in [
        (&["1@9"][..], 3, "generation 9 of experiment 1 is not complete"),
        (&["1@2/3"], 2, "is no generation"),
        (&["7@0"], 3, "there is no experiment 7"),
        (&["1@2", "--set", "algorithm.name=xNES"], 2, "algorithm.name: is xNES"),
        (&["1@2", "--generations", "3"], 2, "algorithm.generations: is 3, but 3 are done"),
        (&["1@2", "--set", "topology.ensembles.H1.n=9"], 2, "genes, but those of the state"),
        (&["1@2", "--set", "algorithm.populations.p1.params.eta_mu=0.5"], 2, "p1.params"),
        (&["1@2", "--set", "nonsense"], 2, "expected PATH=VALUE"),
    ] {
        let refused = coordinator.swarmctl(&[&["fork"], args].concat());
        assert_eq!(refused.code, Some(code), "{refused:#?}");
        assert!(refused.stderr.contains(what), "{args:?}: {}", refused.stderr);
    }
    let listed = coordinator.swarmctl(&["list"]).expect_success().json();
    assert_eq!(listed.as_array().unwrap().len(), 4, "nothing was created");
}
