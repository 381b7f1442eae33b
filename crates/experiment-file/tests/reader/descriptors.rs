//! Descriptors, and the algorithms that learn from them.

use super::*;
use experiment_file::{DescriptorConfig, Summarises};

/// The second population of [`BASE`].
const SECOND: &str = r#",
      "neurons": {"objects": ["neurons:bias:all", "neurons:tau:H"],
        "max_vals": [1.5, 0.75], "min_vals": [-1.5, -1], "num_elite": 2}"#;

/// [`BASE`] with one population by another algorithm, with these descriptors.
fn with(name: &str, descriptors: &str) -> String {
    let named = format!(r#""name": "{name}", {descriptors}"#);
    assert!(BASE.contains(SECOND));
    edited(r#""name": "GA","#, &named).replace(SECOND, "")
}

const ORDER: &str = r#"{"measure": "order", "of": "end", "range": [-1, 1], "cells": 32}"#;

#[test]
fn a_descriptor_needs_no_list_and_has_defaults() {
    let of_one = accept(&with("DNS", r#""descriptors": {"measure": "order", "range": [0, 2]},"#));
    let expected = DescriptorConfig {
        measure: "order".to_owned(),
        summarises: Summarises::Mean,
        range: [0.0, 2.0],
        cells: 32,
    };
    assert_eq!(of_one.algorithm.descriptors, [expected]);
    let two = format!(r#""descriptors": [{ORDER}, {{"measure": "speed", "range": [0, 1]}}],"#);
    let of_two = accept(&with("MAP-Elites", &two));
    assert_eq!(of_two.algorithm.descriptors[0].summarises, Summarises::End);
    for config in [of_one, of_two] {
        let canonical = config.to_canonical_json();
        assert_eq!(accept(&canonical), config, "{canonical}");
        assert_eq!(ExperimentConfig::from_canonical_json(&canonical).unwrap(), config);
    }
}

#[test]
fn files_without_descriptors_do_not_mention_them() {
    assert!(!accept(BASE).to_canonical_json().contains("descriptors"));
}

#[test]
fn descriptors_and_algorithm_belong_together() {
    let problem = refuse(&with("GA", &format!(r#""descriptors": {ORDER},"#)));
    assert!(problem.contains("GA knows no descriptors; remove them, or take"), "{problem}");
    let problem = refuse(&with("MAP-Elites", ""));
    assert!(
        problem.contains("MAP-Elites evolves behaviours that differ; say in what"),
        "{problem}"
    );
}

#[test]
fn a_repertoire_has_a_single_population() {
    let named = format!(r#""name": "DNS", "descriptors": {ORDER},"#);
    let problem = refuse(&edited(r#""name": "GA","#, &named));
    assert!(
        problem.contains(
            "algorithm.populations: DNS evolves a single population, not 2, because an elite is a \
             whole robot; move all `objects` into one population"
        ),
        "{problem}"
    );
}

#[test]
fn ranges_grids_and_costs_are_checked_together() {
    let twice = ORDER.replace("[-1, 1]", "[1, 1]");
    let problems = refuse(&with("DNS", &format!(r#""descriptors": [{twice}, {ORDER}],"#)));
    assert!(problems.contains("descriptors[0].range: ends at 1, not above its beginning 1"));
    assert!(problems.contains("descriptors[1].measure: `order` is a descriptor already"));
    let other = ORDER.replace("order", "speed").replace("32", "513");
    let problem = refuse(&with("DNS", &format!(r#""descriptors": [{ORDER}, {other}],"#)));
    assert!(problem.contains("the grid has 16416 cells, the limit is 16384"), "{problem}");
    let fine = ORDER.replace("32", "16384");
    let long = with("MAP-Elites", &format!(r#""judgement_trials": 1000, "descriptors": {fine},"#));
    let problem = refuse(&long);
    assert!(problem.contains("16384000 trials that judge all elites are more than"), "{problem}");
}

#[test]
fn distances_between_behaviours_are_limited() {
    for (name, is_refused) in [("DNS", true), ("novelty", true), ("MAP-Elites", false)] {
        let three = format!(
            "{ORDER}, {}, {}",
            ORDER.replace("end", "mean"),
            ORDER.replace("order", "speed")
        );
        let file = with(name, &format!(r#""descriptors": [{three}],"#));
        let file = file.replace(r#""population_size": 20"#, r#""population_size": 90000"#);
        assert!(file.contains("90000"), "{file}");
        let problems = ExperimentConfig::from_json(&file, "", ALGORITHMS)
            .err()
            .map_or(String::new(), |error| error.to_string());
        let found = problems.contains("distances between behaviours per generation");
        assert_eq!(found, is_refused, "{name}: {problems}");
    }
}
