//! Forks: the data that they share with their parents, and the changes that they refuse.

use experiment_file::{AimConfig, Summarises};

use super::*;

const SIMULATION: &str = "test";

fn parent(name: &str) -> ExperimentConfig {
    config(name, 6, &["a", "b"])
}

/// After four generations and a re-evaluation.
fn after_four(config: &ExperimentConfig) -> Evolution {
    let mut evolution = Evolution::new(config, &segments(&[2, 3]), SIMULATION);
    for _ in 0..4 {
        step(&mut evolution);
    }
    let n_candidates = evolution.reevaluation().unwrap().candidates().len();
    let fitness: Vec<f64> = (0..n_candidates).map(|i| i as f64).collect();
    choose(&mut evolution, &fitness);
    evolution
}

fn forked(parent: &ExperimentConfig, child: &ExperimentConfig) -> Result<Evolution, ForkError> {
    let segments = segments(&[2, 3]);
    let (parent_simulation, simulation) = (SIMULATION, SIMULATION);
    let fork = Fork { parent, parent_simulation, child, segments: &segments, simulation };
    after_four(parent).fork(&fork)
}

#[test]
fn a_fork_that_changes_nothing_has_the_digests_of_its_parent() {
    for algorithm in by_fitness() {
        let parent = parent(algorithm.name);
        let mut child = parent.clone();
        child.name = "another name".to_owned();
        child.algorithm.generations = 99;
        let (mut original, mut fork) = (after_four(&parent), forked(&parent, &child).unwrap());
        assert_eq!(fork, original, "{}", algorithm.name);
        for _ in 0..3 {
            assert_eq!(step(&mut fork).digest, step(&mut original).digest, "{}", algorithm.name);
        }
    }
}

#[test]
fn the_origin_and_the_changes_of_a_fork_enter_its_digests() {
    let parent = parent("SNES");
    let change = |change: fn(&mut ExperimentConfig)| {
        let mut child = parent.clone();
        change(&mut child);
        forked(&parent, &child).unwrap()
    };
    let unchanged = change(|_| ());
    let forks = [
        change(|config| config.seed += 1),
        change(|config| config.world.height = 500.0),
        change(|config| config.algorithm.num_evaluations = 7),
        change(|config| config.algorithm.population_size = 9),
    ];
    let digests = forks.iter().chain([&unchanged]).map(|fork| fork.digest().to_string());
    assert_eq!(digests.collect::<std::collections::BTreeSet<_>>().len(), 5);
    // A fresh run of the same file has another link, too.
    let mut other = parent.clone();
    other.world.height = 500.0;
    assert_ne!(forks[1].digest(), Digest::of_config(&other, SIMULATION));

    assert_ne!(forks[0].ask().genotypes, unchanged.ask().genotypes, "another seed");
    assert_eq!(forks[1].ask().genotypes, unchanged.ask().genotypes, "the state is the same");
    assert_eq!(forks[3].ask().genotypes.len(), 9);
    let has_champion: Vec<bool> = forks.iter().map(|fork| fork.champion().is_some()).collect();
    assert_eq!(has_champion, [true, false, true, true], "only of the same task");
}

#[test]
fn impossible_changes_are_refused_by_name_and_all_at_once() {
    let parent = parent("SNES");
    let mut child = config("xNES", 6, &["a", "b"]);
    child.algorithm.generations = 4;
    let params = Params::default().with("eta_mu", 0.5);
    child.algorithm.populations.get_mut("b").unwrap().params = params;
    let segments = segments(&[2, 4]);
    let (parent_simulation, simulation) = (SIMULATION, SIMULATION);
    let fork =
        Fork { parent: &parent, parent_simulation, child: &child, segments: &segments, simulation };
    let problems = after_four(&parent).fork(&fork).unwrap_err().problems;
    let places: Vec<&str> =
        problems.iter().map(|problem| problem.split(':').next().unwrap()).collect();
    assert_eq!(
        places,
        [
            "algorithm.name",
            "algorithm.generations",
            "algorithm.populations.b.params",
            "algorithm.populations.b",
        ]
    );
    let error = forked(&parent, &config("SNES", 6, &["a", "c"])).unwrap_err().to_string();
    assert!(error.starts_with("algorithm.populations: are a, c"), "{error}");
}

#[test]
fn a_fork_of_another_version_of_the_simulation_begins_without_a_champion() {
    let parent = parent("SNES");
    let segments = segments(&[2, 3]);
    let fork = Fork {
        parent: &parent,
        parent_simulation: SIMULATION,
        child: &parent,
        segments: &segments,
        simulation: "test 2",
    };
    let fork = after_four(&parent).fork(&fork).unwrap();
    assert_eq!(fork.champion(), None);
    assert_ne!(fork.digest(), after_four(&parent).digest());
}

#[test]
fn a_fork_of_elites_keeps_the_task_of_their_evidence() {
    let mut parent = config("NSGA-II", 6, &["a"]);
    parent.algorithm.aims = vec![AimConfig {
        measure: "turning".to_owned(),
        summarises: Summarises::Mean,
        direction: Direction::Minimise,
    }];
    let segments = segments(&[3]);
    let start = Evolution::new(&parent, &segments, SIMULATION);
    let forked = |child: &ExperimentConfig, simulation| {
        let fork = Fork {
            parent: &parent,
            parent_simulation: SIMULATION,
            child,
            segments: &segments,
            simulation,
        };
        start.clone().fork(&fork).map_err(|error| error.to_string())
    };
    let mut longer = parent.clone();
    longer.algorithm.generations = 99;
    longer.algorithm.num_evaluations = 7;
    assert!(forked(&longer, SIMULATION).is_ok());
    let mut wider = parent.clone();
    wider.world.height = 500.0;
    for refusal in [forked(&wider, SIMULATION), forked(&parent, "test 2")] {
        let refusal = refusal.unwrap_err();
        assert!(refusal.contains("a fork cannot change the task"), "{refusal}");
    }
}
