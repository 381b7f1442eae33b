//! Restarts of CMA-ES.

use serde::Deserialize;
use serde_json::json;

use super::*;
use crate::{
    Checkpoint, Evolution, Genotype, Setup, algorithms::Algorithm, distribution::stream_of,
};

const D: usize = 2;

fn setup(restarts: &str) -> Setup {
    let params = Params::default().with("restarts", restarts);
    Setup { params, population_size: 6, ..Setup::new("CMA-ES", D) }
}

fn state(evolution: &Evolution) -> &RestartingCmaEs {
    match &evolution.populations[0] {
        Algorithm::RestartingCmaEs(state) => state,
        other => panic!("{other:?}"),
    }
}

/// A function with 10^d maxima in the cube; the highest is 0.
fn height(genes: &[f64]) -> f64 {
    let wave = |gene: &f64| {
        let x = 10.24 * (gene - 0.65);
        x * x + 10.0 - 10.0 * libm::cos(std::f64::consts::TAU * x)
    };
    -genes.iter().map(wave).sum::<f64>()
}

fn step(evolution: &mut Evolution) {
    let asked = evolution.ask();
    let fitness: Vec<Vec<f64>> = asked.genotypes.iter().map(|genes| vec![height(genes)]).collect();
    evolution.tell(asked, &fitness).unwrap();
}

/// The state after each generation.
fn states(restarts: &str, n_generations: usize) -> Vec<RestartingCmaEs> {
    let mut evolution = setup(restarts).start().unwrap();
    let after = |_| {
        step(&mut evolution);
        state(&evolution).clone()
    };
    (0..n_generations).map(after).collect()
}

/// Width, whether it is short, deviation at the start, generations: of each run that has ended.
fn runs(states: &[RestartingCmaEs]) -> Vec<(u32, bool, f64, u64)> {
    let begins = |pair: &&[RestartingCmaEs]| pair[1].n_restarts > pair[0].n_restarts;
    let mut runs = Vec::new();
    let mut first = (1, true, 0.2);
    for pair in states.windows(2).filter(begins) {
        runs.push((first.0, first.1, first.2, pair[0].n_of_run + 1));
        first = (pair[1].width, pair[1].is_short, pair[1].run.deviations().unwrap()[0]);
    }
    runs
}

#[test]
fn until_its_first_restart_a_run_has_the_genotypes_of_one_without_restarts() {
    let mut plain = setup("none").start().unwrap();
    let mut restarting = setup("ipop").start().unwrap();
    while state(&restarting).n_restarts == 0 {
        assert_eq!(plain.ask().genotypes, restarting.ask().genotypes);
        step(&mut plain);
        step(&mut restarting);
    }
    assert!(matches!(plain.populations[0], Algorithm::CmaEs(_)));
    assert!(plain.n_generations() > 20);
    assert_ne!(plain.ask().genotypes, restarting.ask().genotypes);
}

#[test]
fn ipop_doubles_the_individuals_and_starts_anywhere_with_the_first_deviation() {
    let states = states("ipop", 3000);
    let runs = runs(&states);
    assert!(runs.len() >= 4, "{runs:?}");
    for (k, (width, _, sigma, n_generations)) in runs.iter().enumerate() {
        assert_eq!((*width, *sigma), (1 << k, 0.2), "{runs:?}");
        assert_eq!(n_generations % u64::from(*width), 0, "runs end with an iteration");
    }
    let restarted = |pair: &&[RestartingCmaEs]| pair[1].n_restarts > pair[0].n_restarts;
    let means: Vec<&[f64]> =
        states.windows(2).filter(restarted).map(|pair| pair[1].mean().unwrap()).collect();
    let genes = means.concat();
    assert!(genes.iter().all(|gene| (0.0..1.0).contains(gene)));
    assert!(genes.iter().any(|gene| *gene < 0.3) && genes.iter().any(|gene| *gene > 0.7));
}

#[test]
fn bipop_alternates_by_the_generations_that_each_kind_has_used() {
    let states = states("bipop", 6000);
    let runs = runs(&states);
    let ([mut n_short, mut n_long], mut long_width) = ([0_u64; 2], 1);
    for (k, &(width, is_short, sigma, n_generations)) in runs.iter().enumerate() {
        assert_eq!(is_short, k == 0 || n_short < n_long, "{k} {runs:?}");
        if is_short {
            assert!(width <= (long_width / 2).max(1) && (0.002..=0.2).contains(&sigma), "{runs:?}");
            let is_within = n_generations <= (n_long / 2).next_multiple_of(width.into());
            assert!(k == 0 || is_within, "{k} {runs:?}");
            n_short += n_generations;
        } else {
            long_width *= 2;
            assert_eq!((width, sigma), (long_width, 0.2), "{runs:?}");
            n_long += n_generations;
        }
    }
    assert!(long_width >= 8 && runs.iter().filter(|run| run.1).count() >= 5, "{runs:?}");
}

/// By the paper: floor((long_width/2)^(u^2)) generations, and `sigma_init` 10^(-2 u').
#[test]
fn a_short_run_has_the_width_and_the_deviation_of_its_draws() {
    for (long_width, u, expected) in [(2, 0.9, 1), (8, 0.5, 1), (8, 0.9, 3), (64, 0.99, 29)] {
        let mut state = states("bipop", 1).remove(0);
        (state.long_width, state.n_of_long) = (long_width, 1000);
        state.restart(&[0.25, 0.75, u, 0.5], 6);
        assert_eq!((state.width, state.is_short, state.n_max), (expected, true, 500));
        assert_eq!(state.mean().unwrap(), [0.25, 0.75]);
        assert!((state.deviations().unwrap()[1] - 0.02).abs() < 1e-15);
    }
}

#[test]
fn an_iteration_of_several_generations_learns_as_one_generation_of_all_their_individuals() {
    let mut state = states("ipop", 1).remove(0);
    state.width = 3;
    let mut whole = state.run.clone();
    for iteration in 0..12 {
        let draw = |part: u64| state.sample(6, &mut stream_of(1, 3 * iteration + part, 0));
        let samples = [0, 1, 2].map(draw);
        let genotypes: Vec<Genotype> =
            samples.iter().flat_map(|sample| sample.genotypes.iter().cloned()).collect();
        let fitness: Vec<f64> = genotypes.iter().map(|genes| height(genes)).collect();
        for (sample, fitness) in samples.iter().zip(fitness.chunks(6)) {
            assert_eq!(state.run, whole, "a part of an iteration teaches nothing");
            state.learn(sample, &ranking(fitness), fitness);
        }
        let all = |part: fn(&Sample) -> &Vec<Vec<f64>>| {
            samples.each_ref().map(part).map(Vec::clone).concat()
        };
        let (normals, steps) = (all(|sample| &sample.normals), all(|sample| &sample.steps));
        let sample = Sample { steps, ..Sample::new(genotypes, normals) };
        whole.learn(&sample, &ranking(&fitness), &fitness);
    }
    assert_eq!((&state.run, state.n_restarts), (&whole, 0));
}

#[test]
fn every_restart_is_news_with_its_reason_and_flat_fitness_is_one() {
    let mut state = states("ipop", 1).remove(0);
    let mut news = Vec::new();
    for generation in 1..=40 {
        let sample = state.sample(6, &mut stream_of(1, generation, 0));
        state.learn(&sample, &[0, 1, 2, 3, 4, 5], &[0.5; 6]);
        news.extend(state.news().map(|news| (generation, news)));
    }
    let first = "CMA-ES begins run 2, because in the previous one fitness no longer differs; each \
                 iteration takes 2 generations";
    // The latest 20 iterations decide, of the second run at least ten, of two generations each.
    let found: Vec<u64> = news.iter().map(|(generation, _)| *generation).collect();
    assert_eq!((&found[..], news[0].1.as_str()), (&[20, 40][..], first));
}

#[test]
fn iterations_stay_within_their_bounds() {
    assert_eq!([1, 2, 256].map(|width| width_after(width, 100)), [2, 4, 512]);
    assert_eq!(width_after(512, 100), 512);
    assert_eq!(width_after(8, 65_536), 16);
    assert_eq!([width_after(8, 65_537), width_after(1, 1 << 40)], [8, 1]);
}

/// Any state continues from its keyframe, also within an iteration and with the seed and the size
/// of a fork.
#[test]
fn a_state_within_an_iteration_continues_from_its_keyframe() {
    let mut evolution = setup("bipop").start().unwrap();
    let mut n_within = 0;
    for _ in 0..600 {
        step(&mut evolution);
        n_within += usize::from(state(&evolution).n_gathered > 0);
    }
    assert!(n_within > 100);
    while state(&evolution).n_gathered == 0 {
        step(&mut evolution);
    }
    let checkpoint = Checkpoint { keyframe: evolution.keyframe(), ..Checkpoint::default() };
    let mut restored = Evolution::restore(&checkpoint).unwrap();
    let mut wider = Evolution { population_size: 9, seed: 5, ..restored.clone() };
    for _ in 0..200 {
        step(&mut evolution);
        step(&mut restored);
        step(&mut wider);
    }
    assert_eq!(evolution, restored);
    assert_eq!(wider.ask().genotypes.len(), 9);
}

#[derive(Deserialize)]
struct Stopped {
    genes: usize,
    runs: Vec<StoppedRun>,
}

#[derive(Deserialize)]
struct StoppedRun {
    fitness: Vec<Vec<f64>>,
    verdict: Verdict,
}

#[test]
fn runs_end_where_those_of_the_package_cma_end() {
    let Stopped { genes, runs } =
        serde_json::from_str(include_str!("../../../tests/fixtures/stopping.json")).unwrap();
    for run in runs {
        let mut progress = Progress::new();
        let verdict = |fitness: &Vec<f64>| {
            progress.add(genes, fitness, &ranking(fitness));
            progress.verdict(genes, fitness.len())
        };
        let verdicts: Vec<Verdict> = run.fitness.iter().map(verdict).collect();
        let (last, before) = verdicts.split_last().unwrap();
        assert_eq!(*last, run.verdict);
        assert!(before.iter().all(|verdict| *verdict == Verdict::GoOn), "{last:?} {before:?}");
    }
}

#[test]
fn narrow_and_ill_conditioned_distributions_end_a_run() {
    let progress = Progress::new();
    let verdict = |sigma| progress.verdict_on(&CmaEs::from_mean(vec![0.5; 3], sigma));
    assert_eq!([2e-9, 0.9e-9].map(verdict), [Verdict::GoOn, Verdict::Narrow]);

    let condition = |variance: f64| {
        let cumulation = json!({"sigma": 0.1, "p_sigma": [0, 0], "p_c": [0, 0], "n_updates": 0});
        let run = json!({
            "mean": [0.5, 0.5],
            "covariance": [[1], [0, variance]],
            "cumulation": cumulation
        });
        progress.verdict_on(&serde_json::from_value(run).unwrap())
    };
    assert_eq!([1.1e-14, 0.9e-14].map(condition), [Verdict::GoOn, Verdict::Condition]);
}

#[test]
fn restarts_find_an_optimum_among_many_that_one_run_misses() {
    let missing = |restarts: &str| {
        let setup = Setup { population_size: 10, n_genes: 5, ..setup(restarts) };
        let mut evolution = setup.start().unwrap();
        for _ in 0..3000 {
            step(&mut evolution);
        }
        -evolution.champion().unwrap().fitness().unwrap()
    };
    let [none, ipop, bipop] = ["none", "ipop", "bipop"].map(missing);
    assert!(none > 0.9 && ipop < 1e-9 && bipop < 1e-9, "{none} {ipop} {bipop}");
}
