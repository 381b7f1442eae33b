//! Evolves an experiment with a number of episodes that a rule spends on trials of individuals, and
//! prints the judged champion:
//!
//! ```sh
//! cargo run --release -p sim-core --example budgets -- configs/borderline_snes.json growing 0 12500
//! ```
//!
//! The arguments are an experiment file, a rule, a seed, and the number of episodes that select.
//! `results/budgets.py` makes all runs of the table in docs/notebook/2026-11-algorithms.md.
//! Episodes that select and judge the champion come on top, and their number is the same for all
//! rules.

use std::{cmp::Ordering, env, error::Error, fs, ops::Range};

use determinism::random::TrialSet;
use evolution::{ALGORITHMS, Evolution, Population};
use experiment_file::ExperimentConfig;
use sim_core::Simulation;

/// How episodes are spent.
enum Rule {
    /// Every individual meets this number of trials.
    Fixed(u32),
    /// One trial in the first 43 of 125 parts of the episodes, then two in 42 parts, then five.
    Growing,
    /// Every individual meets one trial, and the better half meets four more.
    Race,
    /// The number of trials grows while a second evaluation changes ranks, and shrinks otherwise.
    Uncertainty(Uncertainty),
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = env::args().skip(1).collect();
    let [file, rule, seed, n_episodes] = &args[..] else {
        return Err("usage: budgets FILE RULE SEED EPISODES".into());
    };
    let mut rule = match rule.as_str() {
        "five" => Rule::Fixed(5),
        "one" => Rule::Fixed(1),
        "growing" => Rule::Growing,
        "race" => Rule::Race,
        "uncertainty" => Rule::Uncertainty(Uncertainty { n_trials: 1.0, changes: 0.0 }),
        _ => return Err("the rules are five, one, growing, race and uncertainty".into()),
    };
    let (mut config, _) = ExperimentConfig::from_json(&fs::read_to_string(file)?, "", ALGORITHMS)?;
    config.seed = seed.parse()?;
    run(&config, &mut rule, n_episodes.parse()?)
}

/// The trials of one generation or of one comparison of candidates.
struct Trials<'a> {
    simulation: &'a Simulation,
    set: TrialSet,
}

impl Trials<'_> {
    /// The fitness of individuals in a range of trials.
    fn fitness<'g>(
        &self,
        genotypes: impl IntoIterator<Item = &'g Vec<f64>>,
        trials: Range<u32>,
    ) -> Vec<Vec<f64>> {
        let evaluate = |genotype: &Vec<f64>| {
            let fitness = self.simulation.evaluate(genotype, self.set, trials.clone());
            fitness.expect("the world has room for all robots")
        };
        genotypes.into_iter().map(evaluate).collect()
    }
}

fn run(
    config: &ExperimentConfig,
    rule: &mut Rule,
    n_episodes: usize,
) -> Result<(), Box<dyn Error>> {
    let simulation = Simulation::compile(config)?;
    let trials = |set| Trials { simulation: &simulation, set };
    let mut evolution =
        Evolution::new(config, simulation.population_segments(), sim_core::FINGERPRINT);
    let mut n_spent = 0;
    loop {
        let generation = evolution.ask();
        let genotypes = Population::clone(&generation.genotypes);
        let trials = trials(generation.index.into());
        let (fitness, n_more) =
            rule.evaluate(&genotypes, &trials, n_spent as f64 / n_episodes as f64);
        n_spent += n_more;
        if n_spent > n_episodes {
            break;
        }
        evolution.tell(generation, &fitness)?;
    }
    let mut round = evolution.reevaluation().ok_or("too few episodes for a generation")?;
    while !round.is_over() {
        let candidates = round.genotypes();
        let block = 0..config.algorithm.champion_trials;
        let fitness = trials(round.trial_set()).fitness(&*candidates, block);
        round.learn(&fitness);
    }
    evolution.set_champion(&round);
    let judgement = evolution.judgement().expect("there is a champion");
    let judges = 0..config.algorithm.judgement_trials;
    let fitness = trials(judgement.trial_set()).fitness(&*judgement.genotypes(), judges);
    let (champion, _) = judgement.decide(&fitness);
    let judged = champion.judged.ok_or("the champion has no finite fitness")?;
    println!("{},{},{}", judged.mean.get(), judged.low.get(), judged.high.get());
    Ok(())
}

impl Rule {
    /// The fitness of a generation, and the number of its episodes. `spent`: the share of the
    /// episodes that earlier generations took.
    fn evaluate(
        &mut self,
        genotypes: &[Vec<f64>],
        trials: &Trials<'_>,
        spent: f64,
    ) -> (Vec<Vec<f64>>, usize) {
        let fixed = |n: u32| (trials.fitness(genotypes, 0..n), genotypes.len() * n as usize);
        match self {
            Self::Fixed(n) => fixed(*n),
            // The little subtracted keeps rounding from moving a boundary.
            Self::Growing => fixed(match spent + 1e-9 {
                spent if spent < 43.0 / 125.0 => 1,
                spent if spent < 85.0 / 125.0 => 2,
                _ => 5,
            }),
            Self::Race => race(genotypes, trials),
            Self::Uncertainty(rule) => rule.evaluate(genotypes, trials),
        }
    }
}

/// The better half of one trial is ranked by five, above the others, which are ranked by one.
fn race(genotypes: &[Vec<f64>], trials: &Trials<'_>) -> (Vec<Vec<f64>>, usize) {
    let mut fitness = trials.fitness(genotypes, 0..1);
    let mut order: Vec<usize> = (0..genotypes.len()).collect();
    order.sort_by(|&a, &b| fitness[b][0].total_cmp(&fitness[a][0]));
    let (better, others) = order.split_at(genotypes.len() / 2);
    let more = trials.fitness(better.iter().map(|&i| &genotypes[i]), 1..5);
    for (&i, more) in better.iter().zip(more) {
        fitness[i].extend(more);
    }
    // Algorithms see ranks only.
    let lowest = better.iter().map(|&i| mean(&fitness[i])).fold(f64::INFINITY, f64::min);
    let highest = others.iter().map(|&i| fitness[i][0]).fold(f64::NEG_INFINITY, f64::max);
    others.iter().for_each(|&i| fitness[i][0] -= (highest - lowest).max(0.0) + 1.0);
    (fitness, genotypes.len() + 4 * better.len())
}

/// Hansen, Niederberger, Guzzella, Koumoutsakos: "A method for handling uncertainty in evolutionary
/// optimization", IEEE Transactions on Evolutionary Computation 13(1), 2009, section III, with
/// trials in place of the time of an evaluation. A tenth of the individuals meets as many further
/// trials. All individuals meet the same trials here, so these have to be made as difficult as the
/// first ones.
struct Uncertainty {
    /// Trials per individual, rounded when used.
    n_trials: f64,
    /// How far ranks change beyond the limit, with a fading memory.
    changes: f64,
}

impl Uncertainty {
    const SHARE: f64 = 0.1;
    const THETA: f64 = 0.5;
    const MEMORY: f64 = 0.3;
    const FACTOR: f64 = 1.5;
    const TRIALS_MAX: f64 = 20.0;

    fn evaluate(&mut self, genotypes: &[Vec<f64>], trials: &Trials<'_>) -> (Vec<Vec<f64>>, usize) {
        let n = self.n_trials.round() as u32;
        let n_again = (Self::SHARE * genotypes.len() as f64).round() as usize;
        let mut fitness = trials.fitness(genotypes, 0..n);
        let mut again = trials.fitness(&genotypes[..n_again], n..2 * n);
        let difference = |i: usize| mean(&again[i]) - mean(&fitness[i]);
        let difficulty = (0..n_again).map(difference).sum::<f64>() / n_again as f64;
        again.iter_mut().flatten().for_each(|value| *value -= difficulty);
        let first: Vec<f64> = fitness.iter().map(|trials| mean(trials)).collect();
        let second: Vec<f64> = again.iter().map(|trials| mean(trials)).collect();
        let change = rank_changes(&first, &second, Self::THETA);
        self.changes += Self::MEMORY * (change - self.changes);
        let factor = if self.changes > 0.0 { Self::FACTOR } else { 1.0 / Self::FACTOR };
        self.n_trials = (self.n_trials * factor).clamp(1.0, Self::TRIALS_MAX);
        for (trials, more) in fitness.iter_mut().zip(again) {
            trials.extend(more);
        }
        (fitness, (genotypes.len() + n_again) * n as usize)
    }
}

/// By how much a second evaluation changed the ranks of the first individuals, beyond the change
/// that is accepted: the percentile 50 `theta` of the changes that random ranks would have.
fn rank_changes(first: &[f64], second: &[f64], theta: f64) -> f64 {
    let n = first.len();
    // The values that were not computed again count twice.
    let values: Vec<f64> =
        first.iter().chain(second).chain(&first[second.len()..]).copied().collect();
    let mut order: Vec<usize> = (0..2 * n).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]).then(a.cmp(&b)));
    let mut ranks = vec![0; 2 * n];
    order.iter().enumerate().for_each(|(rank, &i)| ranks[i] = rank as i64);
    let limit = |own: i64, other: i64| {
        let own = own + 1 - i64::from(own > other);
        let mut changes: Vec<f64> =
            (1..2 * n as i64).map(|rank| (rank - own).abs() as f64).collect();
        changes.sort_by(f64::total_cmp);
        let place = theta * 0.5 * (changes.len() - 1) as f64;
        let (low, high) = (changes[place.floor() as usize], changes[place.ceil() as usize]);
        low + place.fract() * (high - low)
    };
    let change = |i: usize| {
        let (old, new) = (ranks[i], ranks[n + i]);
        let between = match old.cmp(&new) {
            Ordering::Equal => 0,
            _ => (old - new).abs() - 1,
        };
        2.0 * between as f64 - limit(old, new) - limit(new, old)
    };
    (0..second.len()).map(change).sum::<f64>() / second.len() as f64
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
