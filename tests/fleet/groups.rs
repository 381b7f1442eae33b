//! Groups of runs: submitted as one, computed side by side, steered as one.

use std::collections::BTreeMap;

use harness::{CoordinatorProcess, Experiment, WorkerProcess, undisturbed};
use serde_json::Value;

/// The values of a key in all of a list of objects.
fn all(list: &Value, key: &str) -> Vec<Value> {
    list.as_array().unwrap().iter().map(|object| object[key].clone()).collect()
}

#[test]
fn runs_of_a_group_share_the_fleet_and_have_the_bits_of_runs_alone() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let experiment = Experiment::tiny(4);
    let path = experiment.path();
    let submit = |seeds| {
        let args = ["submit", path.to_str().unwrap(), "--group", "sizes", "--seeds", seeds];
        let set = ["--set", "algorithm.population_size=10,12"];
        coordinator.swarmctl(&[&args[..], &set[..]].concat()).expect_success().json()
    };
    let submitted = submit("7");
    assert_eq!(all(&submitted, "seed"), [7, 7]);
    let (ten, twelve) = ("algorithm.population_size=10", "algorithm.population_size=12");
    assert_eq!(all(&submitted, "variant"), [ten, twelve]);
    let more = submit("7..8");
    assert_eq!(all(&more, "seed"), [7, 8, 7, 8]);
    let ids = [&submitted[0]["id"], &submitted[1]["id"]];
    assert_eq!(
        [&more[0]["id"], &more[2]["id"]],
        ids,
        "existing experiments are not submitted again"
    );

    coordinator.swarmctl(&["watch", "--quiet", "sizes"]).expect_success();
    let listed = coordinator.swarmctl(&["list", "sizes"]).expect_success().json();
    assert_eq!(all(&listed, "state"), ["completed"; 4]);

    let history = coordinator.swarmctl(&["history", "sizes"]).expect_success().json();
    let mut runs: BTreeMap<u64, Vec<&Value>> = BTreeMap::new();
    for generation in history.as_array().unwrap() {
        runs.entry(generation["experiment"].as_u64().unwrap()).or_default().push(generation);
    }
    assert_eq!(runs.values().map(Vec::len).collect::<Vec<_>>(), [4; 4]);
    let at_ms = |generation: &Value| generation["completed_at_ms"].as_u64().unwrap();
    // These runs were submitted at once; the others may begin after their end.
    let at_once = ids.map(|id| &runs[&id.as_u64().unwrap()]);
    let last_to_begin = at_once.iter().map(|run| at_ms(run[0])).max().unwrap();
    let first_to_end = at_once.iter().map(|run| at_ms(run[3])).min().unwrap();
    assert!(last_to_begin <= first_to_end, "side by side: {history}");

    let digests: Vec<&str> = runs[&submitted[0]["id"].as_u64().unwrap()]
        .iter()
        .map(|generation| generation["digest"].as_str().unwrap())
        .collect();
    assert_eq!(digests, undisturbed(&experiment)[..4]);
}

#[test]
fn a_group_is_steered_as_one() {
    let coordinator = CoordinatorProcess::start();
    let path = Experiment::tiny(2);
    let path = path.path();
    let submit = ["submit", path.to_str().unwrap(), "--seeds", "1..3", "--group", "mine"];
    coordinator.swarmctl(&submit).expect_success();
    let states =
        |command: &[&str]| all(&coordinator.swarmctl(command).expect_success().json(), "state");
    assert_eq!(states(&["pause", "mine"]), ["paused"; 3]);
    coordinator.swarmctl(&["cancel", "2"]).expect_success();
    assert_eq!(states(&["resume", "mine"]), ["running"; 2], "one has ended");
    assert_eq!(states(&["cancel", "mine"]), ["cancelled"; 2]);
    assert_eq!(states(&["list", "mine"]), ["cancelled"; 3]);

    for (command, part) in [
        (["cancel", "mine"], "all experiments of group `mine` have ended"),
        (["history", "mein"], "no group or experiment is named `mein`; did you mean `mine`?"),
    ] {
        let outcome = coordinator.swarmctl(&command);
        assert_eq!(outcome.code, Some(3));
        assert!(outcome.stderr.contains(part), "{}", outcome.stderr);
    }
}
