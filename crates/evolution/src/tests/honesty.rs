//! The judgement of a champion is unbiased, and its interval covers the truth as often as it
//! claims: a small version of `sim-core/examples/champion_figure.rs`.

use std::ops::Range;

use determinism::random::{Purpose, Stream, TrialSet};

use super::*;

/// Fitness in \[0, 1\] of individuals that differ in skill: near 0 in one trial of 25.
fn fitness(seed: u64, genotype: &[f64], trial_set: TrialSet, trials: Range<u64>) -> Vec<f64> {
    let trial_fitness = |trial| {
        let mut stream = Stream::new(seed, trial_set, trial, Purpose::Reception, 0);
        let (luck, fails) = (stream.uniform(), stream.uniform() < 0.04);
        if fails { 0.05 * luck } else { skill(genotype) * (1.0 - 0.3 * luck * luck * luck) }
    };
    trials.map(trial_fitness).collect()
}

fn skill(genotype: &[f64]) -> f64 {
    (1.0 - genotype.iter().map(|gene| (gene - 0.3) * (gene - 0.3)).sum::<f64>()).max(0.0)
}

/// The expectation of that fitness over all possible trials.
fn worth(genotype: &[f64]) -> f64 {
    0.04 * 0.05 / 2.0 + 0.96 * skill(genotype) * (1.0 - 0.3 / 4.0)
}

/// The champion of a run, with its judgement.
fn champion_of_a_run(seed: u64) -> Champion {
    let mut evolution = Setup { seed, ..Setup::new("SNES", 5) }.start().unwrap();
    let evaluate = |genotypes: &[Genotype], trial_set, n_trials| -> Vec<Vec<f64>> {
        genotypes.iter().map(|genes| fitness(seed, genes, trial_set, 0..n_trials)).collect()
    };
    for _ in 0..3 {
        for _ in 0..3 {
            let generation = evolution.ask();
            let values = evaluate(&generation.genotypes, generation.index.into(), 3);
            evolution.tell(generation, &values).unwrap();
        }
        let mut round = evolution.reevaluation().unwrap();
        while !round.is_over() {
            round.learn(&evaluate(&round.genotypes(), round.trial_set(), 20));
        }
        evolution.set_champion(&round);
    }
    let judgement = evolution.judgement().unwrap();
    let values = evaluate(&judgement.genotypes(), judgement.trial_set(), 200);
    judgement.decide(&values).0
}

#[test]
fn the_judgement_of_champions_is_unbiased_and_selection_is_optimistic() {
    let champions: Vec<Champion> = (0..200).map(champion_of_a_run).collect();
    let errors = |claim: fn(&Champion) -> f64| -> (f64, f64) {
        let errors: Vec<f64> =
            champions.iter().map(|champion| claim(champion) - worth(&champion.genotype)).collect();
        let HeldOut { mean, ci95, .. } = HeldOut::from_values(&errors, 0).unwrap();
        (mean.get(), ci95.get())
    };
    let (error, ci95) = errors(|champion| champion.judged.unwrap().mean.get());
    assert!(error.abs() < ci95, "{error} +- {ci95}");
    let (error, ci95) = errors(|champion| champion.held_out.unwrap().mean.get());
    assert!(error > ci95, "the selecting mean is optimistic: {error} +- {ci95}");

    let is_covered = |champion: &&Champion| {
        let Judged { low, high, .. } = champion.judged.unwrap();
        (low.get()..=high.get()).contains(&worth(&champion.genotype))
    };
    let n_covered = champions.iter().filter(is_covered).count();
    // 95 %, within two standard errors.
    assert!((184..=196).contains(&n_covered), "{n_covered} of 200");
}
