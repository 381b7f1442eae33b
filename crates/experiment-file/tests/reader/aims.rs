//! Aims beside fitness, and the algorithm that learns from them.

use super::*;
use experiment_file::{AimConfig, Direction, Summarises};

/// The second population of [`BASE`].
const SECOND: &str = r#",
      "neurons": {"objects": ["neurons:bias:all", "neurons:tau:H"],
        "max_vals": [1.5, 0.75], "min_vals": [-1.5, -1], "num_elite": 2}"#;

/// [`BASE`] with one population by another algorithm, with these keys.
fn with(name: &str, keys: &str) -> String {
    let named = format!(r#""name": "{name}", {keys}"#);
    assert!(BASE.contains(SECOND));
    edited(r#""name": "GA","#, &named).replace(SECOND, "")
}

const TURNING: &str = r#"{"measure": "turning", "of": "end", "direction": "minimise"}"#;

#[test]
fn an_aim_needs_no_list_and_files_without_aims_do_not_mention_them() {
    let aims = r#""aims": {"measure": "speed", "direction": "maximise"},"#;
    let of_one = accept(&with("NSGA-II", aims));
    let expected = AimConfig {
        measure: "speed".to_owned(),
        summarises: Summarises::Mean,
        direction: Direction::Maximise,
    };
    assert_eq!(of_one.algorithm.aims, [expected]);
    let two = format!(r#""aims": [{TURNING}, {{"measure": "x", "direction": "maximise"}}],"#);
    let of_two = accept(&with("NSGA-II", &two));
    assert_eq!(of_two.algorithm.aims[0].direction, Direction::Minimise);
    let paths: Vec<String> = of_two.algorithm.learnt_measures().map(|learnt| learnt.path).collect();
    assert_eq!(paths, ["algorithm.aims[0].measure", "algorithm.aims[1].measure"]);
    for config in [of_one, of_two] {
        let canonical = config.to_canonical_json();
        assert_eq!(accept(&canonical), config, "{canonical}");
        assert_eq!(ExperimentConfig::from_canonical_json(&canonical).unwrap(), config);
    }
    assert!(!accept(BASE).to_canonical_json().contains("aims"));
}

#[test]
fn parameters_of_a_front_have_the_defaults_of_its_paper() {
    let config = accept(&with("NSGA-II", &format!(r#""aims": {TURNING},"#)));
    let params = &config.algorithm.populations.values().next().unwrap().params;
    let canonical: Vec<String> =
        params.iter().map(|(key, value)| format!("{key} {value}")).collect();
    let expected = ["reevaluated 0.25", "crossover_prob 0.9", "eta_c 20", "eta_m 20"];
    for entry in expected {
        assert!(canonical.contains(&entry.to_owned()), "{entry}: {canonical:?}");
    }
}

#[test]
fn all_mistakes_of_aims_are_reported_at_once() {
    let descriptor = r#"{"measure": "order", "range": [0, 1]}"#;
    let keys = format!(r#""aims": [{TURNING}, {TURNING}], "descriptors": {descriptor},"#);
    let named = format!(r#""name": "NSGA-II", {keys}"#);
    let file = edited(r#""name": "GA","#, &named)
        .replace(r#""population_size": "#, r#""population_size": 200"#);
    let problems = refuse(&file);
    for expected in [
        "algorithm.aims[1].measure: `turning` is an aim already",
        "algorithm.descriptors: NSGA-II knows no descriptors",
        "algorithm.populations: NSGA-II evolves a single population, not 2",
        "but NSGA-II takes at most 16384",
    ] {
        assert!(problems.contains(expected), "{expected}: {problems}");
    }
}

#[test]
fn aims_and_algorithm_belong_together() {
    let problem = refuse(&with("GA", &format!(r#""aims": {TURNING},"#)));
    assert!(problem.contains("GA knows no aims beside fitness; remove them, or take `NSGA-II`"));
    let problem = refuse(&with("NSGA-II", ""));
    assert!(problem.contains("NSGA-II needs an aim beside fitness, for instance"), "{problem}");
    let three = format!(r#""aims": [{TURNING}, {TURNING}, {TURNING}],"#);
    assert!(refuse(&with("NSGA-II", &three)).contains("algorithm.aims"));
    let unknown = TURNING.replace("minimise", "least");
    let problem = refuse(&with("NSGA-II", &format!(r#""aims": {unknown},"#)));
    assert!(
        problem.contains("algorithm.aims[0].direction")
            || problem.contains("algorithm.aims.direction"),
        "{problem}"
    );
    assert!(problem.contains("`maximise`, `minimise`"), "{problem}");
}

#[test]
fn trials_that_judge_a_front_are_limited() {
    let keys = format!(r#""judgement_trials": 1000, "aims": {TURNING},"#);
    let file =
        with("NSGA-II", &keys).replace(r#""population_size": "#, r#""population_size": 120"#);
    let problem = refuse(&file);
    assert!(problem.contains("trials that judge all elites are more than"), "{problem}");
}
