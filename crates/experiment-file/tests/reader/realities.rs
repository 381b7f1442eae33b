//! `pseudo_reality`: numbers and ranges, and the answers to what is neither.

use super::{BASE, accept, edited, refuse};
use experiment_file::{Drawn, ExperimentConfig, PseudoRealityConfig};

fn base_with(reality: &str) -> String {
    edited(
        r#""perturbations": {"stimuli_inhibition""#,
        &format!(r#""perturbations": {{"pseudo_reality": {reality}, "stimuli_inhibition""#),
    )
}

fn reality_of(config: &ExperimentConfig) -> Option<PseudoRealityConfig> {
    config.robots().next().unwrap().1.perturbations.pseudo_reality
}

#[test]
fn a_file_without_pseudo_reality_says_nothing_of_it() {
    let config = accept(BASE);
    assert_eq!(reality_of(&config), None);
    assert!(!config.to_canonical_json().contains("pseudo_reality"));
}

#[test]
fn keys_are_numbers_or_ranges_and_neutral_by_default() {
    let config = accept(&base_with(
        r#"{"wheel_gain": [0.8, 1.25], "actuation_delay": [0, 3], "radio_loss": 0.1}"#,
    ));
    let expected = PseudoRealityConfig {
        wheel_gain: Drawn { low: 0.8, high: 1.25 },
        actuation_delay: Drawn { low: 0, high: 3 },
        radio_loss: Drawn::always(0.1),
        ..Default::default()
    };
    assert_eq!(reality_of(&config), Some(expected));
    let canonical = config.to_canonical_json();
    assert_eq!(accept(&canonical), config);
    for part in [r#""wheel_gain":[0.8,1.25]"#, r#""actuation_delay":[0,3]"#, r#""format":1"#] {
        assert!(canonical.contains(part), "{part} in {canonical}");
    }
    assert_eq!(reality_of(&accept(&base_with("{}"))), Some(PseudoRealityConfig::default()));
}

#[test]
fn a_range_of_one_number_is_the_number() {
    let canonical = |reality: &str| accept(&base_with(reality)).to_canonical_json();
    let number = canonical(r#"{"wheel_gain": 0.9, "actuation_delay": 2}"#);
    assert_eq!(canonical(r#"{"wheel_gain": [0.9, 0.9], "actuation_delay": [2, 2]}"#), number);
}

#[test]
fn all_mistakes_are_named_at_once() {
    let answer = refuse(&base_with(
        r#"{"wheel_gain": [1.2, 0.8], "actuation_delay": [0.5, 51], "radio_loss": 2,
            "sensor_gain": [1], "sensor_noise": "much", "antenna": 1, "slow_robot": [0.5, 7]}"#,
    ));
    let place = "world.objects.bots.perturbations.pseudo_reality.";
    for expected in [
        "wheel_gain: the range ends below its beginning; expected [low, high]",
        "actuation_delay[0]: expected a whole number, found 0.5",
        "actuation_delay[1]: must be between 0 and 50, is 51",
        "radio_loss: must be between 0 and 1, is 2",
        "sensor_gain: expected a list of 2 elements, found 1",
        "sensor_noise: expected a number, found a string",
        "slow_robot[1]: must be between 0 and 1, is 7",
    ] {
        assert!(answer.contains(&format!("{place}{expected}")), "{expected}\nin\n{answer}");
    }
    assert!(answer.contains("antenna_heading"), "{answer}");
    assert_eq!(answer.lines().count(), 8, "{answer}");
}

#[test]
fn bodies_of_faster_robots_need_more_substeps() {
    let arena = edited("\"world\": {\n", "\"world\": {\"boundary\": \"walls\", \"bodies\": {},\n");
    accept(&arena);
    let faster = |reality: &str| {
        arena.replace(
            r#""perturbations": {"#,
            &format!(r#""perturbations": {{"pseudo_reality": {reality}, "#),
        )
    };
    accept(&faster(r#"{"wheel_gain": [0.5, 2]}"#));
    let answer = refuse(&faster(r#"{"wheel_gain": [0.5, 4], "wheel_asymmetry": 0.5}"#));
    assert!(answer.contains("drives up to 4.125 cm in a substep"), "{answer}");
}
