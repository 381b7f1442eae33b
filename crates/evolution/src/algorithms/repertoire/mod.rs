//! Repertoires: elites that behave differently. All algorithms of repertoires vary, evaluate again
//! and pool evidence in the same way; a [`Rule`] decides which behaviours stay.
//!
//! Variation by *iso+line*: Vassiliades, Mouret: "Discovering the elite hypervolume by leveraging
//! interspecies correlation", GECCO 2018. Evaluations again: the trials of one generation are lucky
//! for some individuals, which would keep their places forever. So a share of every generation are
//! elites that meet its trials, too, those with the fewest trials first (adaptive sampling; Flageat
//! et al.: "Extract-QD framework", arXiv 2502.06585). All trials of an elite's life count.

mod elite;

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, Parameter, Params};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

pub use elite::{Axis, Elite, Evidence};

use super::Sample;
use crate::{Birth, Evaluations, Genotype, Parents};

/// Share of a generation that are elites.
pub const REEVALUATED: Parameter = Parameter::between(
    "reevaluated",
    [0.0, 0.9],
    0.25,
    "Share of each generation that are elites, evaluated again; 0 for tasks without chance",
);
/// Width of the variation in all directions.
pub const ISO_SIGMA: Parameter =
    Parameter::unit("iso_sigma", 0.01, "Standard deviation of the variation of every gene");
/// Width of the variation along the line of two elites.
pub const LINE_SIGMA: Parameter = Parameter::unit(
    "line_sigma",
    0.2,
    "Standard deviation of the variation along the line through two elites, relative to their \
     distance",
);

/// Decides which behaviours stay in a repertoire: the part in which the algorithms differ.
pub trait Rule: Sized {
    /// Name, parameters and limits of the algorithm.
    const DESCRIPTION: AlgorithmDescription;

    /// The rule with parameters in the domains of the description. `n_cells`: number of cells of
    /// the grid.
    fn start(params: &Params, n_cells: usize) -> Self;

    /// The survivors of a pool, by their places in it, in ascending order. Those that have been in
    /// the repertoire before come first, in the order in which they came.
    fn survivors(&self, pool: &[Evidence]) -> Vec<usize>;

    /// The elites among the survivors; the others are in reserve.
    fn elites(&self, survivors: &[Evidence]) -> Vec<usize> {
        (0..survivors.len()).collect()
    }
}

/// A repertoire between two generations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Repertoire<R> {
    d: usize,
    axes: Vec<Axis>,
    reevaluated: f64,
    iso_sigma: f64,
    line_sigma: f64,
    rule: R,
    /// Elites and reserve, in the order in which they came.
    kept: Vec<Elite>,
}

impl<R: Rule> Repertoire<R> {
    /// An empty repertoire, over `d` genes and the grid of these axes.
    pub fn start(params: &Params, d: usize, axes: &[Axis]) -> Self {
        Self {
            d,
            axes: axes.to_vec(),
            reevaluated: params.value_of(&REEVALUATED),
            iso_sigma: params.value_of(&ISO_SIGMA),
            line_sigma: params.value_of(&LINE_SIGMA),
            rule: R::start(params, axes.iter().map(|axis| axis.n_cells as usize).product()),
            kept: Vec::new(),
        }
    }

    fn evidence(&self) -> Vec<Evidence> {
        self.kept.iter().map(|elite| elite.evidence(&self.axes)).collect()
    }

    /// The kept individuals that the next generation evaluates again: those with the fewest trials,
    /// elites before the reserve.
    fn again(&self, population_size: usize, elites: &[usize]) -> Vec<usize> {
        let wanted = (self.reevaluated * population_size as f64).round() as usize;
        let n = wanted.min(self.kept.len()).min(population_size - 1);
        let mut is_reserve = vec![true; self.kept.len()];
        elites.iter().for_each(|&elite| is_reserve[elite] = false);
        let mut order: Vec<usize> = (0..self.kept.len()).collect();
        order.sort_by_key(|&i| (self.kept[i].n_trials, is_reserve[i], i));
        order.truncate(n);
        order
    }

    /// The first generation, U(0, 1)^d. Later ones have elites to evaluate again, and then children.
    /// Parents are named by their places.
    fn draw(&self, population_size: usize, rng: &mut Stream) -> Vec<(Genotype, Family)> {
        if self.kept.is_empty() {
            let mut genes = || (0..self.d).map(|_| rng.uniform()).collect();
            return (0..population_size).map(|_| (genes(), Family::None)).collect();
        }
        let elites = self.rule.elites(&self.evidence());
        let again = self.again(population_size, &elites);
        let n_children = population_size - again.len();
        let mut drawn: Vec<(Genotype, Family)> = Vec::with_capacity(population_size);
        drawn.extend(again.iter().map(|&i| (self.kept[i].genotype.clone(), Family::Again(i))));
        for _ in 0..n_children {
            let [a, b] = [(); 2].map(|()| elites[rng.below(elites.len())]);
            drawn.push((self.child(a, b, rng), Family::Line(a, b)));
        }
        drawn
    }

    /// a + iso_sigma e + line_sigma z (b - a), e ~ N(0, I), z ~ N(0, 1), clipped to \[0, 1\].
    fn child(&self, a: usize, b: usize, rng: &mut Stream) -> Genotype {
        let [a, b] = [a, b].map(|parent| &self.kept[parent].genotype);
        let along = self.line_sigma * rng.normal();
        let mut child = vec![0.0; self.d];
        rng.fill_normal(&mut child);
        for ((gene, a), b) in child.iter_mut().zip(a).zip(b) {
            *gene = (a + self.iso_sigma * *gene + along * (b - a)).clamp(0.0, 1.0);
        }
        child
    }
}

/// The parents of an individual, by their places in the repertoire.
#[derive(Clone, Copy)]
enum Family {
    None,
    Again(usize),
    Line(usize, usize),
}

/// What evolution needs of a repertoire, whatever its rule.
pub trait Behaviours {
    /// Number of genes of an individual.
    fn n_genes(&self) -> usize;

    /// Number of individuals that it keeps: elites and reserve.
    fn n_kept(&self) -> usize;

    /// The axes of the grid.
    fn axes(&self) -> &[Axis];

    /// The elites, in the order in which they came.
    fn elites(&self) -> Vec<&Elite>;

    /// Draws `population_size` individuals. A pure function of the state and the stream.
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample;

    /// The births of the individuals that [`sample`](Self::sample) draws from the same stream.
    fn births(&self, population_size: usize, rng: &mut Stream) -> Vec<Birth>;

    /// Learns from a generation that [`sample`](Self::sample) drew from this state. An individual
    /// stays out, or leaves, if a number of its trials is not finite.
    fn learn(&mut self, generation: u64, sample: &Sample, told: Evaluations<'_>);
}

impl<R: Rule + Serialize + DeserializeOwned> Behaviours for Repertoire<R> {
    fn n_genes(&self) -> usize {
        self.d
    }

    fn n_kept(&self) -> usize {
        self.kept.len()
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn elites(&self) -> Vec<&Elite> {
        let elites = self.rule.elites(&self.evidence());
        elites.into_iter().map(|elite| &self.kept[elite]).collect()
    }

    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let drawn = self.draw(population_size, rng).into_iter();
        Sample::new(drawn.map(|(genes, _)| genes).collect(), Vec::new())
    }

    fn births(&self, population_size: usize, rng: &mut Stream) -> Vec<Birth> {
        let birth = |(child, family): (Genotype, Family)| {
            let born = |place: usize| self.kept[place].born();
            let (parents, places) = match family {
                Family::None => (Parents::None, vec![]),
                Family::Again(a) => (Parents::Again(born(a)), vec![a]),
                Family::Line(a, b) => (Parents::Line(born(a), born(b)), vec![a, b]),
            };
            let genes: Vec<&Genotype> =
                places.iter().map(|&place| &self.kept[place].genotype).collect();
            Birth::new(parents, &child, &genes)
        };
        self.draw(population_size, rng).into_iter().map(birth).collect()
    }

    fn learn(&mut self, generation: u64, sample: &Sample, told: Evaluations<'_>) {
        let rows = told.fitness.iter().zip(told.descriptors).enumerate();
        let elites = self.rule.elites(&self.evidence());
        let again = match self.kept.is_empty() {
            true => Vec::new(),
            false => self.again(sample.genotypes.len(), &elites),
        };
        for (&place, (_, (fitness, descriptors))) in again.iter().zip(rows.clone()) {
            self.kept[place].add(fitness, descriptors);
        }
        self.kept.retain(Elite::is_finite);
        let newcomer = |(i, (fitness, descriptors)): (usize, (&Vec<f64>, &Vec<f64>))| {
            let mut elite = Elite::new(generation, i as u32, self.axes.len());
            elite.add(fitness, descriptors);
            elite.is_finite().then_some(elite)
        };
        let newcomers: Vec<Elite> = rows.skip(again.len()).filter_map(newcomer).collect();
        let mut pool = self.evidence();
        pool.extend(newcomers.iter().map(|elite| elite.evidence(&self.axes)));
        let survivors = self.rule.survivors(&pool);
        let mut stays = vec![false; pool.len()];
        survivors.iter().for_each(|&place| stays[place] = true);
        let (of_kept, of_newcomers) = stays.split_at(self.kept.len());
        let mut of_kept = of_kept.iter();
        self.kept.retain(|_| of_kept.next() == Some(&true));
        let stay = newcomers.into_iter().zip(of_newcomers).filter(|(_, stays)| **stays);
        self.kept.extend(stay.map(|(mut elite, _)| {
            elite.genotype.clone_from(&sample.genotypes[elite.individual as usize]);
            elite
        }));
    }
}
