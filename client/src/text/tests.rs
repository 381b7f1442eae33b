//! Sentences for people.

use std::slice;

use super::*;

fn summary(generation: u64) -> GenerationSummary {
    GenerationSummary {
        generation,
        best: 1.2344,
        mean: 0.4561,
        min: 0.0,
        digest: "1a2b3c4d5e6f7a8b".into(),
        duration_ms: 500,
        episodes: 617,
        ..GenerationSummary::default()
    }
}

fn experiment(state: ExperimentState) -> Experiment {
    Experiment {
        id: 3,
        name: "leader".into(),
        state: state.into(),
        generations_done: 12,
        generations: 40,
        seed: 7,
        algorithm: "SNES".into(),
        population_size: 100,
        genotype_len: 455,
        latest: Some(summary(11)),
        champion_fitness: Some(2.0),
        digest: "1a2b3c4d5e6f7a8b".into(),
        ..Experiment::default()
    }
}

#[test]
fn commands_in_a_text_get_the_option_that_names_their_place() {
    let at = |text| in_place(text, "--data-dir d");
    assert_eq!(
        at("it is paused; continue it with: swarmctl resume 3"),
        "it is paused; continue it with: swarmctl resume 3 --data-dir d"
    );
    assert_eq!(
        at("`swarmctl list` shows all: `swarmctl watch 3` ends\nask: swarmctl explain 3"),
        "`swarmctl list --data-dir d` shows all: `swarmctl watch 3 --data-dir d` ends\n\
         ask: swarmctl explain 3 --data-dir d"
    );
    assert_eq!(
        at("delete those first: swarmctl delete 4; swarmctl delete 3"),
        "delete those first: swarmctl delete 4 --data-dir d; swarmctl delete 3 --data-dir d"
    );
    for text in
        ["`run` has none", "see: swarmctl list --coordinator h", "no `swarmctl list", "swarmctl"]
    {
        assert_eq!(at(text), text);
    }
}

#[test]
fn an_empty_list_of_events_says_why() {
    let numbered = |id, last_sequence| Experiment { id, last_sequence, ..Experiment::default() };
    let [five, none] = [numbered(1, 5), numbered(2, 0)];
    assert_eq!(no_events(&[], 1), "there are no experiments yet, and so no events");
    assert_eq!(
        no_events(slice::from_ref(&five), 6),
        "experiment 1 has no event 6 yet; its last one is 5"
    );
    assert_eq!(no_events(&[five, none.clone()], 6), "no experiment has an event 6 yet");
    assert_eq!(no_events(&[none], 1), "there are no events yet");
}

#[test]
fn large_numbers_have_three_digits_and_a_unit() {
    let texts = [0.0, 999.0, 57_600.0, 1.5e9].map(large_number);
    assert_eq!(texts, ["0", "999", "57.60 thousand", "1.50 billion"]);
}

#[test]
fn a_round_says_what_it_evaluates() {
    let evaluation = Round { generation: 3, episodes: 500, episodes_left: 380, ..Round::default() };
    assert_eq!(round(&evaluation), "generation 3: 120 of 500 episodes");
    let held_out = Round { held_out: true, ..evaluation.clone() };
    assert_eq!(round(&held_out), "candidates of generation 3: 120 of 500 episodes");
    let judgement = Round { judgement: true, ..evaluation };
    assert_eq!(round(&judgement), "judging the champion: 120 of 500 episodes");
}

#[test]
fn a_generation_is_one_line() {
    assert_eq!(
        generation(&summary(11), 40),
        "12/40  generation 11  best 1.234  mean 0.456  min 0.000  1234 episodes/s"
    );
    assert!(generation(&summary(0), 100).starts_with("  1/100  generation   0  "));
}

#[test]
fn names_and_reasons_stay_on_their_line_and_in_their_order() {
    let name = "a\nexperiment 4 (b) completed\u{202e}".to_owned();
    let reason = "\u{1b}[2J".to_owned();
    let named = Experiment { name, reason, ..experiment(ExperimentState::Failed) };
    assert_eq!(
        state_line(&named),
        r"experiment 3 (a\u000aexperiment 4 (b) completed\u202e) failed after 12 of 40 generations: \u001b[2J"
    );
}

#[test]
fn a_generation_without_duration_has_a_finite_speed() {
    let summary = GenerationSummary { duration_ms: 0, ..summary(0) };
    assert!(generation(&summary, 1).contains("617000 episodes/s"));
}

#[test]
fn the_end_has_state_fitness_champion_and_digest() {
    let champion = GetChampionResponse {
        generation: 6,
        individual: Some(4),
        fitness: Some(2.0),
        held_out: Some(HeldOutFitness { mean: 1.5, ci95: 0.25, trials: 50, generation: 11 }),
        judged: Some(JudgedFitness {
            mean: 1.25,
            low: 1.0,
            high: 1.375,
            trials: 200,
            generation: 11,
        }),
        ..GetChampionResponse::default()
    };
    let text = end(&experiment(ExperimentState::Completed), Some(0.5), Some(&champion), true);
    assert_eq!(
        text,
        "experiment 3 (leader) completed after 12 of 40 generations\n  \
         best of the first generation  0.500000\n  \
         mean of the last generation   0.456100\n  \
         champion                      1.250000, 95 % 1.000000 to 1.375000, on 200 new trials (individual 4 of generation 6)\n  \
         champion, optimistic          1.500000 on the 50 trials that selected it\n  \
         digest                        1a2b3c4d5e6f7a8b"
    );
    let unjudged = GetChampionResponse { judged: None, held_out: None, ..champion };
    let text = end(&experiment(ExperimentState::Cancelled), None, Some(&unjudged), false);
    assert!(text.contains("champion                      not judged (individual 4"), "{text}");
    assert!(text.contains("champion, optimistic          2.000000 in its generation"), "{text}");
}

#[test]
fn cancelling_an_ended_experiment_says_so() {
    let text = cancelled(&experiment(ExperimentState::Completed));
    assert!(text.ends_with("completed after 12 of 40 generations; nothing to cancel"), "{text}");
    let text = cancelled(&experiment(ExperimentState::Cancelled));
    assert!(text.ends_with("cancelled after 12 of 40 generations"), "{text}");
}

#[test]
fn commands_survive_a_shell() {
    let args = ["swarmctl", "run", "my file's.json", "", "--seed=7"].map(String::from);
    assert_eq!(shell_command(args), r"swarmctl run 'my file'\''s.json' '' --seed=7");
}
