//! Repertoires: elites that behave differently. All algorithms of repertoires vary, evaluate again
//! and pool evidence in the same way; a [`Rule`] decides which behaviours stay.
//!
//! Variation by *iso+line*: Vassiliades, Mouret: "Discovering the elite hypervolume by leveraging
//! interspecies correlation", GECCO 2018. Evaluations again: the trials of one generation are lucky
//! for some individuals, which would keep their places forever. So a share of every generation are
//! elites that meet its trials, too, those with the fewest trials first (adaptive sampling; Flageat
//! et al.: "Extract-QD framework", arXiv 2502.06585). All trials of an elite's life count.

mod elite;
pub mod kept;
mod nearest;

use determinism::{
    Isa,
    random::Stream,
    simd::{Simd, WithSimd},
};
use experiment_file::{AlgorithmDescription, Direction, Parameter, Params, limits};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

pub use elite::{Axis, Elite, Evidence};
pub use nearest::{Nearest, Neighbours, square};

use self::kept::Family;
use super::Sample;
use crate::{Birth, Evaluations, Genotype};

/// Share of a generation that are elites.
pub const REEVALUATED: Parameter = Parameter::between(
    "reevaluated",
    [0.0, 0.9],
    0.25,
    "Share of each generation that consists of elites, evaluated again; 0 for tasks without chance",
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

    /// The survivors of a pool, by their places in it, in ascending order. The `n_kept` that have
    /// been in the repertoire before come first, in the order in which they came.
    fn survivors(&self, pool: &[Evidence], n_kept: usize) -> Vec<usize>;

    /// The elites among the survivors; the others are in reserve.
    fn elites(&self, survivors: &[Evidence]) -> Vec<usize> {
        (0..survivors.len()).collect()
    }

    /// By what the better of two elites, drawn uniformly, becomes a parent; `None` if each elite
    /// that is drawn does.
    fn merits(&self, _kept: &[Evidence]) -> Option<Vec<f64>> {
        None
    }

    /// Time of its decisions in a generation, ns, if it is longer than that of drawing.
    fn search_ns(&self, _n_pool: u64, _n_axes: u64) -> u64 {
        0
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
    /// See [`Rule::DESCRIPTION`].
    pub const DESCRIPTION: AlgorithmDescription = R::DESCRIPTION;

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

    /// Number of individuals that the next generation evaluates again.
    pub fn n_again(&self, population_size: usize) -> usize {
        kept::n_again(&self.kept, self.reevaluated, population_size)
    }

    /// The individuals that the next generation evaluates again, for variation of another kind.
    pub fn evaluated_again(&self, population_size: usize) -> Vec<&Elite> {
        let elites = self.rule.elites(&self.evidence());
        self.again(population_size, &elites).into_iter().map(|i| &self.kept[i]).collect()
    }

    /// The places of these individuals: those with the fewest trials, elites before the reserve.
    fn again(&self, population_size: usize, elites: &[usize]) -> Vec<usize> {
        kept::again(&self.kept, self.n_again(population_size), elites)
    }

    /// The first generation, U(0, 1)^d. Later ones have elites to evaluate again, and then
    /// children. Parents are named by their places.
    fn draw(&self, population_size: usize, rng: &mut Stream) -> Vec<(Genotype, Family)> {
        if self.kept.is_empty() {
            let mut genes = || (0..self.d).map(|_| rng.uniform()).collect();
            return (0..population_size).map(|_| (genes(), Family::None)).collect();
        }
        let evidence = self.evidence();
        let elites = self.rule.elites(&evidence);
        let merits = self.rule.merits(&evidence);
        let again = self.again(population_size, &elites);
        let n_children = population_size - again.len();
        let mut drawn: Vec<(Genotype, Family)> = Vec::with_capacity(population_size);
        drawn.extend(again.iter().map(|&i| (self.kept[i].genotype.clone(), Family::Again(i))));
        for _ in 0..n_children {
            let [a, b] = [(); 2].map(|()| parent(&elites, merits.as_deref(), rng));
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
        let iso_sigma = self.iso_sigma;
        Isa::best().run(Line { child: &mut child, a, b, iso_sigma, along });
        child
    }
}

/// Makes a child of normals.
struct Line<'a> {
    child: &'a mut [f64],
    a: &'a [f64],
    b: &'a [f64],
    iso_sigma: f64,
    along: f64,
}

impl WithSimd for Line<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for ((gene, a), b) in self.child.iter_mut().zip(self.a).zip(self.b) {
            *gene = (a + self.iso_sigma * *gene + self.along * (b - a)).clamp(0.0, 1.0);
        }
    }
}

/// One of the elites: drawn uniformly, or the one of more merit of two that are.
fn parent(elites: &[usize], merits: Option<&[f64]>, rng: &mut Stream) -> usize {
    let mut draw = || elites[rng.below(elites.len())];
    match merits {
        None => draw(),
        Some(merits) => {
            let (a, b) = (draw(), draw());
            if merits[b] > merits[a] { b } else { a }
        }
    }
}

/// What evolution needs of a repertoire, whatever its rule, or of a front.
pub trait Behaviours {
    /// Number of genes of an individual.
    fn n_genes(&self) -> usize;

    /// Number of individuals that it keeps: elites and others.
    fn n_kept(&self) -> usize;

    /// Number of matrices with a row and a column per gene that it keeps.
    fn n_matrices(&self) -> usize {
        0
    }

    /// The axes of the grid of a repertoire; none of a front.
    fn axes(&self) -> &[Axis] {
        &[]
    }

    /// The aims of a front beside fitness; none of a repertoire.
    fn aims(&self) -> &[Direction] {
        &[]
    }

    /// Number of descriptors of a trial.
    fn n_descriptors(&self) -> usize {
        self.axes().len() + self.aims().len()
    }

    /// The elites, in the order in which they came.
    fn elites(&self) -> Vec<&Elite>;

    /// Whether its parts fit each other and the limits. A state of a run does; one that a stranger
    /// made may claim sizes that would exhaust memory or time.
    fn is_sound(&self) -> bool;

    /// Time to ask for and tell a generation beyond that per gene, ns.
    fn search_ns(&self, _population_size: u64) -> u64 {
        0
    }

    /// Draws `population_size` individuals. A pure function of the state and the stream.
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample;

    /// The births of the individuals that [`sample`](Self::sample) draws from the same stream;
    /// `None` if they have no parents.
    fn births(&self, population_size: usize, rng: &mut Stream) -> Option<Vec<Birth>>;

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

    fn is_sound(&self) -> bool {
        let is_axis = |axis: &Axis| axis.low < axis.high && axis.n_cells > 0;
        let n_cells = |n: u64, axis: &Axis| n.saturating_mul(axis.n_cells.into());
        (1..=limits::DESCRIPTORS).contains(&self.axes.len())
            && self.axes.iter().all(is_axis)
            && self.axes.iter().fold(1, n_cells) <= limits::ELITES.into()
            && self.kept.len() <= limits::ELITES as usize
            && kept::fit(&self.kept, self.d, self.axes.len())
    }

    fn search_ns(&self, population_size: u64) -> u64 {
        self.rule.search_ns(self.kept.len() as u64 + population_size, self.axes.len() as u64)
    }

    fn elites(&self) -> Vec<&Elite> {
        let elites = self.rule.elites(&self.evidence());
        elites.into_iter().map(|elite| &self.kept[elite]).collect()
    }

    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let drawn = self.draw(population_size, rng).into_iter();
        Sample::new(drawn.map(|(genes, _)| genes).collect(), Vec::new())
    }

    fn births(&self, population_size: usize, rng: &mut Stream) -> Option<Vec<Birth>> {
        Some(kept::births(&self.kept, self.draw(population_size, rng)))
    }

    fn learn(&mut self, generation: u64, sample: &Sample, told: Evaluations<'_>) {
        let evidence = self.evidence();
        let again = self.again(sample.genotypes.len(), &self.rule.elites(&evidence));
        let Self { axes, rule, kept, .. } = self;
        let results = kept::Results { generation, genotypes: &sample.genotypes, told };
        let view = |elite: &Elite| elite.evidence(axes);
        let survivors = |pool: &[Evidence], n_kept| rule.survivors(pool, n_kept);
        kept::learn(kept, evidence, &again, &results, view, survivors);
    }
}
