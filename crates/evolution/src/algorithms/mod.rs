//! The evolutionary algorithms, behind one interface: draw a generation, learn from its fitness.
//!
//! An algorithm is one file and one row of the registry below. The file of an algorithm that learns
//! from fitness implements [`Strategy`] and [`Described`]. The file of an algorithm that evolves a
//! repertoire of different behaviours implements [`Rule`](repertoire::Rule), or [`Behaviours`] if
//! it varies them in its own way; that of one that evolves a front implements [`Behaviours`]. Its
//! names, parameters and limits in experiment files, in their JSON Schema, in `docs/keys.md` and in
//! `docs/algorithms.md` follow from its description.

mod bounded;
mod cma_es;
mod cma_mae;
mod cumulation;
mod dns;
mod ga;
mod linalg;
mod map_elites;
mod novelty;
mod nsga2;
mod openai_es;
mod pairs;
mod parameters;
mod pgpe;
mod repertoire;
mod restarts;
mod sep_cma_es;
mod snes;
mod stopping;
mod xnes;

use std::iter;

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, Direction, Keeps, Params};
use serde::{Deserialize, Serialize};

use super::{Birth, Evaluations, Genotype, Population};
use cma_mae::Annealing;
#[cfg(test)]
pub use repertoire::Elite;
use repertoire::Repertoire;
pub use repertoire::{Axis, Behaviours};

/// What depends on the kind of an algorithm: a strategy, a front, or a repertoire of some part of
/// its own.
macro_rules! kind {
    (state: $state:ty) => { $state };
    (state: $state:ty, Front) => { $state };
    (state: $part:ty, $repertoire:ident) => { $repertoire<$part> };
    (description: $state:ty) => { <$state as Described>::DESCRIPTION };
    (description: $state:ty, Front) => { <$state>::DESCRIPTION };
    (description: $part:ty, $repertoire:ident) => { $repertoire::<$part>::DESCRIPTION };
    (start: $state:ty, $params:ident, $d:ident, $beside:ident) => {
        Described::start($params, $d)
    };
    (start: $state:ty, $params:ident, $d:ident, $beside:ident, Front) => {
        <$state>::start($params, $d, &$beside.aims)
    };
    (start: $part:ty, $params:ident, $d:ident, $beside:ident, $repertoire:ident) => {
        $repertoire::start($params, $d, &$beside.axes)
    };
    (name: $state:ident) => { Kind::Strategy($state) };
    (name: $state:ident, $kind:ident) => { Kind::Behaviours($state) };
    (learn: $state:ident, $lesson:ident) => {
        $state.learn($lesson.sample, $lesson.ranking, $lesson.fitness)
    };
    (learn: $state:ident, $lesson:ident, $repertoire:ident) => {
        $state.learn($lesson.generation, $lesson.sample, $lesson.told)
    };
}

/// What an algorithm learns from beside fitness; empty for those that learn from fitness alone.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BesideFitness {
    /// The grid of descriptors, for algorithms that evolve a repertoire.
    pub axes: Vec<Axis>,
    /// The aims beside fitness, for algorithms that evolve a front.
    pub aims: Vec<Direction>,
}

/// Declares the algorithms: the state of each, its description, its start. Those `in` a repertoire
/// learn from fitness and descriptors, those `in Front` from fitness and aims, all others from
/// fitness. A *form* is another state of a described algorithm, which its parameters choose. Append
/// groups, because the place of a row is part of the format of keyframes.
macro_rules! registry {
    ($(
        described { $($(#[$doc:meta])* $module:ident::$name:ident $(in $repertoire:ident)?,)* }
        forms { $($(#[$form_doc:meta])* $form_module:ident::$form:ident,)* }
    )*) => {
        /// The algorithms, each with its state. A variant's place is part of the format of
        /// keyframes.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub enum Algorithm {$(
            $($(#[$doc])* $name(kind!(state: $module::$name $(, $repertoire)?)),)*
            $($(#[$form_doc])* $form($form_module::$form),)*
        )*}

        /// The descriptions of all algorithms, for the reader of experiment files.
        pub static ALGORITHMS: &[AlgorithmDescription] =
            &[$($(kind!(description: $module::$name $(, $repertoire)?),)*)*];

        impl Algorithm {
            /// The algorithm of this name before its first generation; `None` if no algorithm has
            /// this name. `d`: number of genes of the population, at least 1.
            pub fn new(name: &str, params: &Params, d: usize, beside: &BesideFitness) -> Option<Self> {
                $($(if name == <$form_module::$form as Form>::DESCRIPTION.name
                    && let Some(form) = Form::start(params, d)
                {
                    return Some(Self::$form(form));
                })*)*
                $($(if name == kind!(description: $module::$name $(, $repertoire)?).name {
                    return Some(Self::$name(kind!(
                        start: $module::$name, params, d, beside $(, $repertoire)?
                    )));
                })*)*
                None
            }

            /// The largest part of its state between generations.
            pub fn keeps(&self) -> Keeps {
                match self {$(
                    $(Self::$name(_) => {
                        kind!(description: $module::$name $(, $repertoire)?).keeps
                    })*
                    $(Self::$form(_) => <$form_module::$form as Form>::DESCRIPTION.keeps,)*
                )*}
            }

            /// Learns from a generation that [`sample`](Self::sample) drew from this state.
            pub fn learn(&mut self, lesson: &Lesson<'_>) {
                match self {$(
                    $(Self::$name(state) => kind!(learn: state, lesson $(, $repertoire)?),)*
                    $(Self::$form(state) => kind!(learn: state, lesson),)*
                )*}
            }

            fn kind(&self) -> Kind<'_> {
                match self {$(
                    $(Self::$name(state) => kind!(name: state $(, $repertoire)?),)*
                    $(Self::$form(state) => kind!(name: state),)*
                )*}
            }
        }
    };
}

/// An evaluated generation.
#[derive(Debug, Clone, Copy)]
pub struct Lesson<'a> {
    /// Its index.
    pub generation: u64,
    /// Its draws.
    pub sample: &'a Sample,
    /// Indices of the individuals, best first, those without finite fitness last (see
    /// [`ranking`](super::ranking::ranking)).
    pub ranking: &'a [usize],
    /// Mean fitness of each individual; at least one is finite.
    pub fitness: &'a [f64],
    /// Its trials.
    pub told: Evaluations<'a>,
}

registry! {
    described {
        /// Genetic algorithm.
        ga::Ga,
        /// Separable natural evolution strategy.
        snes::Snes,
        /// Exponential natural evolution strategy.
        xnes::Xnes,
        /// Covariance matrix adaptation.
        cma_es::CmaEs,
        /// Covariance matrix adaptation with a diagonal matrix.
        sep_cma_es::SepCmaEs,
        /// OpenAI's evolution strategy.
        openai_es::OpenAiEs,
        /// Policy gradients with ClipUp.
        pgpe::Pgpe,
        /// The best of every cell of a grid.
        map_elites::MapElites in Repertoire,
        /// Those far from all that are fitter.
        dns::Dns in Repertoire,
    }
    forms {
        /// CMA-ES that restarts.
        restarts::RestartingCmaEs,
    }

    described {
        /// Those unlike all others.
        novelty::Novelty in Repertoire,
        /// Emitters with full covariances.
        cma_mae::CmaMae in Annealing,
        /// Emitters with diagonal covariances.
        cma_mae::SepCmaMae in Annealing,
    }
    forms {}

    described {
        /// Those that no other one dominates.
        nsga2::Nsga2 in Front,
    }
    forms {}
}

/// An algorithm by what it learns from.
enum Kind<'a> {
    Strategy(&'a dyn Strategy),
    Behaviours(&'a dyn Behaviours),
}

/// The draws of an algorithm for one generation.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Genes of each individual, within \[0, 1\]; shape `[individual][gene]`.
    pub genotypes: Population,
    /// The standard normal draws behind each individual, for algorithms that learn from them;
    /// otherwise empty.
    pub normals: Vec<Vec<f64>>,
    /// The correlated normals, for algorithms that learn from both; otherwise empty.
    pub steps: Vec<Vec<f64>>,
    /// Uniform draws for decisions after the generation, for algorithms that make some; otherwise
    /// empty.
    pub uniforms: Vec<f64>,
}

impl Sample {
    /// Individuals and the normals behind them.
    pub fn new(genotypes: Vec<Genotype>, normals: Vec<Vec<f64>>) -> Self {
        let genotypes = genotypes.into();
        Self { genotypes, normals, steps: Vec::new(), uniforms: Vec::new() }
    }
}

/// The draws of a distribution, as in [`Sample`].
#[derive(Default)]
pub struct Draws {
    /// See [`Sample::genotypes`].
    pub genotypes: Vec<Genotype>,
    /// See [`Sample::normals`].
    pub normals: Vec<Vec<f64>>,
    /// See [`Sample::steps`].
    pub steps: Vec<Vec<f64>>,
}

impl From<Draws> for Sample {
    fn from(Draws { genotypes, normals, steps }: Draws) -> Self {
        Self { steps, ..Self::new(genotypes, normals) }
    }
}

/// An algorithm between two generations. Its state is plain numbers; a restored state draws and
/// learns the same bits.
pub trait Strategy {
    /// Number of genes of an individual.
    fn n_genes(&self) -> usize;

    /// The mean of the distribution, if the algorithm has one.
    fn mean(&self) -> Option<&[f64]> {
        None
    }

    /// The standard deviation of every gene, before clipping or mirroring to \[0, 1\], if the
    /// algorithm has a distribution.
    fn deviations(&self) -> Option<Vec<f64>> {
        None
    }

    /// Draws `population_size` individuals. A pure function of the state and
    /// the stream.
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample;

    /// Whether [`individual`](Self::individual) returns individuals.
    fn draws_one_by_one(&self) -> bool {
        false
    }

    /// The individual of this index, below `population_size`, in the sample that
    /// [`sample`](Self::sample) draws from the same stream; `None` if the algorithm cannot draw
    /// an individual without the others.
    fn individual(
        &self,
        _index: usize,
        _population_size: usize,
        _rng: &mut Stream,
    ) -> Option<Genotype> {
        None
    }

    /// The births of the individuals that [`sample`](Self::sample) draws from the same stream;
    /// `None` if they have no parents.
    fn births(&self, _population_size: usize, _rng: &mut Stream) -> Option<Vec<Birth>> {
        None
    }

    /// Learns from a generation that [`sample`](Self::sample) drew from this
    /// state.
    ///
    /// `fitness`: one value per individual; at least one is finite. `ranking`: indices of the
    /// individuals, best first, those without finite fitness last (see
    /// [`ranking`](super::ranking::ranking)).
    fn learn(&mut self, sample: &Sample, ranking: &[usize], fitness: &[f64]);

    /// Number of random numbers that the state keeps of earlier generations.
    fn n_kept(&self) -> usize {
        0
    }

    /// What people should know of the latest generation that the algorithm learnt from, as a
    /// sentence without a full stop.
    fn news(&self) -> Option<String> {
        None
    }
}

/// The description of an algorithm for experiment files.
pub trait Described: Strategy {
    /// Its name, parameters and limits.
    const DESCRIPTION: AlgorithmDescription;

    /// Its state before the first generation, over `d` genes (at least 1).
    /// `params` lie in the domains of the description.
    fn start(params: &Params, d: usize) -> Self;
}

/// Another state of a described algorithm.
pub trait Form: Strategy + Sized {
    /// The description of the algorithm.
    const DESCRIPTION: AlgorithmDescription;

    /// Its state before the first generation, as [`Described::start`]; `None` if `params` choose
    /// the described state itself.
    fn start(params: &Params, d: usize) -> Option<Self>;
}

impl Algorithm {
    /// Number of genes of an individual.
    pub fn n_genes(&self) -> usize {
        match self.kind() {
            Kind::Strategy(strategy) => strategy.n_genes(),
            Kind::Behaviours(behaviours) => behaviours.n_genes(),
        }
    }

    /// The mean of its distribution as a genotype, if it has one.
    pub fn mean(&self) -> Option<Genotype> {
        let mean = self.strategy()?.mean()?;
        Some(mean.iter().map(|&gene| mirror(gene)).collect())
    }

    /// See [`Strategy::deviations`].
    pub fn deviations(&self) -> Option<Vec<f64>> {
        self.strategy()?.deviations()
    }

    /// Draws `population_size` individuals. A pure function of the state and the stream.
    pub fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        match self.kind() {
            Kind::Strategy(strategy) => strategy.sample(population_size, rng),
            Kind::Behaviours(behaviours) => behaviours.sample(population_size, rng),
        }
    }

    /// See [`Strategy::draws_one_by_one`].
    pub fn draws_one_by_one(&self) -> bool {
        self.strategy().is_some_and(Strategy::draws_one_by_one)
    }

    /// See [`Strategy::individual`].
    pub fn individual(
        &self,
        index: usize,
        population_size: usize,
        rng: &mut Stream,
    ) -> Option<Genotype> {
        self.strategy()?.individual(index, population_size, rng)
    }

    /// See [`Strategy::births`].
    pub fn births(&self, population_size: usize, rng: &mut Stream) -> Option<Vec<Birth>> {
        match self.kind() {
            Kind::Strategy(strategy) => strategy.births(population_size, rng),
            Kind::Behaviours(behaviours) => behaviours.births(population_size, rng),
        }
    }

    /// Its repertoire or its front, if it has one.
    pub fn behaviours(&self) -> Option<&dyn Behaviours> {
        match self.kind() {
            Kind::Strategy(_) => None,
            Kind::Behaviours(behaviours) => Some(behaviours),
        }
    }

    /// Whether its state may be that of a run: see [`Behaviours::is_sound`].
    pub fn is_sound(&self) -> bool {
        self.behaviours().is_none_or(Behaviours::is_sound)
    }

    fn strategy(&self) -> Option<&dyn Strategy> {
        match self.kind() {
            Kind::Strategy(strategy) => Some(strategy),
            Kind::Behaviours(_) => None,
        }
    }

    /// See [`Strategy::n_kept`].
    pub fn n_kept(&self) -> usize {
        self.strategy().map_or(0, Strategy::n_kept)
    }

    /// See [`Strategy::news`].
    pub fn news(&self) -> Option<String> {
        self.strategy()?.news()
    }
}

/// `n` vectors of `d` independent standard normals, in this order.
fn draw_normals(n: usize, d: usize, rng: &mut Stream) -> Vec<Vec<f64>> {
    let vector = || {
        let mut vector = vec![0.0; d];
        rng.fill_normal(&mut vector);
        vector
    };
    iter::repeat_with(vector).take(n).collect()
}

/// The vector of this index that [`draw_normals`] draws from a stream at its beginning.
fn draw_normal(index: usize, d: usize, rng: &mut Stream) -> Vec<f64> {
    rng.seek(index as u64 * d as u64);
    let mut vector = vec![0.0; d];
    rng.fill_normal(&mut vector);
    vector
}

/// `x` in \[0, 1\], by reflection at both ends.
fn mirror(x: f64) -> f64 {
    let x = x.abs();
    let x = x - 2.0 * (x / 2.0).floor();
    if x > 1.0 { 2.0 - x } else { x }
}

/// e^x, but at most [`f64::MAX`]: with a very large learning rate, the exponential
/// would overflow to infinity, and 0 * infinity is NaN.
fn finite_exp(x: f64) -> f64 {
    libm::exp(x).min(f64::MAX)
}

#[cfg(test)]
mod tests {
    use super::mirror;

    #[test]
    fn mirroring_reflects_at_both_ends_as_often_as_needed() {
        for (x, expected) in [
            (0.0, 0.0),
            (0.25, 0.25),
            (1.0, 1.0),
            (1.25, 0.75),
            (-0.25, 0.25),
            (2.25, 0.25),
            (-1.25, 0.75),
            (1001.25, 0.75),
        ] {
            assert_eq!(mirror(x), expected, "{x}");
        }
        for x in [1e300, -1e300, 1.0f64.next_up(), 0.0f64.next_down()] {
            assert!((0.0..=1.0).contains(&mirror(x)), "{x}");
        }
    }
}
