//! What all algorithms do that keep elites: they evaluate some again, and pool the evidence.

use super::Elite;
use crate::{Birth, Evaluations, Genotype, Parents};

/// Whether kept individuals have this many genes and descriptors, and have met a trial.
pub fn fit(kept: &[Elite], d: usize, n_descriptors: usize) -> bool {
    kept.iter().all(|elite| {
        elite.genotype.len() == d
            && elite.n_descriptors() == n_descriptors
            && elite.n_trials > 0
            && elite.is_finite()
    })
}

/// Number of kept individuals that the next generation evaluates again: this share of it.
pub fn n_again(kept: &[Elite], share: f64, population_size: usize) -> usize {
    let wanted = (share * population_size as f64).round() as usize;
    wanted.min(kept.len()).min(population_size - 1)
}

/// The places of `n` kept individuals to evaluate again: those with the fewest trials, elites
/// before the others.
pub fn again(kept: &[Elite], n: usize, elites: &[usize]) -> Vec<usize> {
    let mut is_reserve = vec![true; kept.len()];
    elites.iter().for_each(|&elite| is_reserve[elite] = false);
    let key = |i: usize| (kept[i].n_trials, is_reserve[i], i);
    let mut order: Vec<_> = (0..kept.len()).map(key).collect();
    if n < order.len() {
        order.select_nth_unstable(n);
        order.truncate(n);
    }
    order.sort_unstable();
    order.into_iter().map(|(_, _, i)| i).collect()
}

/// The parents of an individual, by their places among the kept ones.
#[derive(Debug, Clone, Copy)]
pub enum Family {
    /// No parents, in the first generation.
    None,
    /// A kept individual, evaluated again.
    Again(usize),
    /// A point near the line through two, closest to the first.
    Line(usize, usize),
    /// One, mutated.
    Mutated(usize),
    /// Two, crossed and mutated.
    Crossed(usize, usize),
}

/// The births of drawn individuals.
pub fn births(kept: &[Elite], drawn: Vec<(Genotype, Family)>) -> Vec<Birth> {
    let birth = |(child, family): (Genotype, Family)| {
        let born = |place: usize| kept[place].born();
        let (parents, places) = match family {
            Family::None => (Parents::None, vec![]),
            Family::Again(a) => (Parents::Again(born(a)), vec![a]),
            Family::Line(a, b) => (Parents::Line(born(a), born(b)), vec![a, b]),
            Family::Mutated(a) => (Parents::Mutated(born(a)), vec![a]),
            Family::Crossed(a, b) => (Parents::Crossed(born(a), born(b)), vec![a, b]),
        };
        let genes: Vec<&Genotype> = places.iter().map(|&place| &kept[place].genotype).collect();
        Birth::new(parents, &child, &genes)
    };
    drawn.into_iter().map(birth).collect()
}

/// A generation with its results.
pub struct Results<'a> {
    pub generation: u64,
    pub genotypes: &'a [Genotype],
    pub told: Evaluations<'a>,
}

/// Learns from a generation whose first individuals are those of the places `again`. Kept
/// individuals and newcomers are one pool, in the order in which they came. `views` are the kept
/// ones as `view` sees them, which looks again at those that change; `survivors` gets the views of
/// the pool and the number of those that were kept before, and returns the places of those that
/// stay. Whoever has a number that is not finite stays out, or leaves.
pub fn learn<V>(
    kept: &mut Vec<Elite>,
    mut views: Vec<V>,
    again: &[usize],
    results: &Results<'_>,
    view: impl Fn(&Elite) -> V,
    survivors: impl FnOnce(&[V], usize) -> Vec<usize>,
) {
    let Results { generation, genotypes, told } = *results;
    let rows = told.fitness.iter().zip(told.descriptors).enumerate();
    for (&place, (_, (fitness, descriptors))) in again.iter().zip(rows.clone()) {
        kept[place].add(fitness, descriptors);
        views[place] = view(&kept[place]);
    }
    let stays: Vec<bool> = kept.iter().map(Elite::is_finite).collect();
    retain(kept, &stays);
    retain(&mut views, &stays);
    let newcomer = |(i, (fitness, descriptors)): (usize, (&Vec<f64>, &Vec<f64>))| {
        let n_descriptors = descriptors.len() / fitness.len().max(1);
        let mut elite = Elite::new(generation, i as u32, n_descriptors);
        elite.add(fitness, descriptors);
        elite.is_finite().then_some(elite)
    };
    let n_before = kept.len();
    kept.extend(rows.skip(again.len()).filter_map(newcomer));
    views.extend(kept[n_before..].iter().map(view));
    let mut stays = vec![false; kept.len()];
    survivors(&views, n_before).into_iter().for_each(|place| stays[place] = true);
    for (elite, _) in kept.iter_mut().zip(&stays).skip(n_before).filter(|(_, stays)| **stays) {
        elite.genotype.clone_from(&genotypes[elite.individual as usize]);
    }
    retain(kept, &stays);
}

/// Keeps the items that stay.
fn retain<T>(items: &mut Vec<T>, stays: &[bool]) {
    let mut stays = stays.iter();
    items.retain(|_| stays.next() == Some(&true));
}
