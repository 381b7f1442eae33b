//! The printed keys and numbers.

use serde_json::{Value, json};
use swarm_proto::v1::{ExperimentState, HeldOutFitness, JudgedFitness};

use super::*;

fn summary() -> GenerationSummary {
    GenerationSummary {
        generation: 11,
        best: 0.1 + 0.2,
        mean: f64::MIN_POSITIVE,
        min: -0.0,
        standard_deviation: 1.0 / 3.0,
        digest: "1a2b".into(),
        duration_ms: 250,
        episodes: 500,
        workers: 2,
        idle_share: 0.05,
    }
}

fn champion() -> GetChampionResponse {
    GetChampionResponse {
        experiment_id: 3,
        generation: 7,
        individual: Some(2),
        fitness: Some(1.25),
        held_out: None,
        judged: None,
        trial_fitness: vec![1.0, 1.5],
        genotype: vec![0.1, 1.0 / 3.0],
        network_json: r#"{"neurons":[{"tau":0.1}]}"#.into(),
    }
}

#[test]
fn a_generation_is_one_line_whose_numbers_read_back_exactly() {
    let summary = summary();
    let text = line(&GenerationLine::new(3, &summary));
    assert!(!text.contains('\n'));
    let value: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["experiment"], 3);
    assert_eq!(value["generation"], 11);
    assert_eq!(value["digest"], "1a2b");
    let bits = |key: &str| value[key].as_f64().unwrap().to_bits();
    assert_eq!(bits("best"), summary.best.to_bits());
    assert_eq!(bits("mean"), summary.mean.to_bits());
    assert_eq!(bits("min"), summary.min.to_bits());
    assert_eq!(bits("standard_deviation"), summary.standard_deviation.to_bits());
}

#[test]
fn a_seed_that_jq_would_round_is_text() {
    let experiment = |seed| Experiment { seed, ..Experiment::default() };
    let seed = |seed| {
        let experiment = experiment(seed);
        let listed = serde_json::to_value(ExperimentDocument::from(&experiment)).unwrap();
        let champion = champion();
        let champion = ChampionDocument::new(&experiment, &champion).unwrap();
        assert_eq!(listed["seed"], serde_json::to_value(champion).unwrap()["seed"]);
        listed["seed"].clone()
    };
    assert_eq!(seed(1 << 53), 1_u64 << 53);
    assert_eq!(seed((1 << 53) + 1), "9007199254740993");
}

#[test]
fn a_fitness_that_is_no_number_is_null() {
    let summary = GenerationSummary { min: f64::NAN, ..summary() };
    let value: Value = serde_json::from_str(&line(&GenerationLine::new(3, &summary))).unwrap();
    assert_eq!(value["min"], Value::Null);
}

#[test]
fn the_end_names_state_digest_and_champion() {
    let experiment = Experiment {
        id: 3,
        state: ExperimentState::Completed.into(),
        digest: "1a2b".into(),
        ..Experiment::default()
    };
    let champion = champion();
    let value = serde_json::to_value(EndLine::new(&experiment, Some(&champion))).unwrap();
    assert_eq!(
        value,
        json!({
            "experiment": 3,
            "state": "completed",
            "digest": "1a2b",
            "champion": {
                "judged": null,
                "selection": null,
                "fitness_when_chosen": 1.25,
                "generation": 7,
                "individual": 2,
            },
        })
    );
}

#[test]
fn judged_and_selection_fitness_stay_apart() {
    let held_out = HeldOutFitness { mean: 1.5, ci95: 0.125, trials: 50, generation: 9 };
    let judged = JudgedFitness { mean: 1.0, low: 0.75, high: 1.125, trials: 200, generation: 9 };
    let champion =
        GetChampionResponse { held_out: Some(held_out), judged: Some(judged), ..champion() };
    let value = serde_json::to_value(ChampionSummary::from(&champion)).unwrap();
    let judged = json!({"mean": 1.0, "ci95": [0.75, 1.125], "trials": 200, "generation": 9});
    assert_eq!(value["judged"], judged);
    assert_eq!(value["selection"], json!({"mean": 1.5, "trials": 50, "generation": 9}));
    assert_eq!(value["fitness_when_chosen"], 1.25);
}

#[test]
fn a_failure_before_the_first_generation_has_a_reason_and_no_champion() {
    let experiment = Experiment {
        id: 3,
        state: ExperimentState::Failed.into(),
        reason: "item 7 killed 3 workers".into(),
        ..Experiment::default()
    };
    let value = serde_json::to_value(EndLine::new(&experiment, None)).unwrap();
    let reason = "item 7 killed 3 workers";
    assert_eq!(
        value,
        json!({"experiment": 3, "state": "failed", "reason": reason, "digest": null, "champion": null})
    );
}

#[test]
fn a_champion_contains_its_network_and_its_experiment() {
    let champion = champion();
    let experiment = Experiment {
        name: "leader".into(),
        seed: 7,
        config_digest: "c0".repeat(32),
        simulation: "sim-core 1".into(),
        ..Experiment::default()
    };
    let document = ChampionDocument::new(&experiment, &champion).unwrap();
    let value = serde_json::to_value(document).unwrap();
    assert_eq!(value["name"], "leader");
    assert_eq!(value["seed"], 7);
    assert_eq!(value["config_digest"], "c0".repeat(32));
    assert_eq!(value["simulation"], "sim-core 1");
    assert_eq!(value["network"]["neurons"][0]["tau"], 0.1);
    assert_eq!(value["genotype"][1].as_f64().unwrap().to_bits(), (1.0f64 / 3.0).to_bits());
    let broken = GetChampionResponse { network_json: "{".into(), ..champion };
    assert!(ChampionDocument::new(&experiment, &broken).is_err());
}
