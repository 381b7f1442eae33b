//! Novelty search: whoever behaves like nobody before enters the archive, whatever its fitness.
//!
//! Lehman, Stanley: "Abandoning objectives: evolution through the search for novelty alone",
//! Evolutionary Computation 19(2), 2011. The archive has a fixed number of places. The most novel
//! of a generation enter it, as in Doncieux et al.: "Novelty search makes evolvability inevitable",
//! GECCO 2020, unless their novelty is below a threshold, as in the first paper.

use experiment_file::{AlgorithmDescription, ELITES, Keeps, LearnsFrom, Parameter, Params};
use serde::{Deserialize, Serialize};

use super::repertoire::{Evidence, ISO_SIGMA, LINE_SIGMA, Neighbours, REEVALUATED, Rule};

/// The most novel survive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Novelty {
    n_elites: usize,
    n_nearest: usize,
    added: f64,
    threshold: f64,
}

const NEIGHBOURS: Parameter = Parameter::whole(
    "neighbours",
    [1, 100],
    15,
    "Number of nearest neighbours to which novelty is the mean distance, k",
);
const ADDED: Parameter = Parameter::unit(
    "added",
    0.1,
    "Largest share of the new individuals of a generation that enter the archive, the most novel \
     first; rounded up, and at least one",
);
const THRESHOLD: Parameter = Parameter::amount(
    "threshold",
    0.0,
    "Least novelty that enters the archive, in ranges of the descriptors",
);

/// Parts of distances that are computed and ranked in a nanosecond, in two passes.
const DISTANCES_PER_NS: u64 = 1;

impl Rule for Novelty {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "novelty",
        title: "Novelty search",
        learns: "elites unlike all others",
        state: "elites d",
        keeps: Keeps::Repertoire,
        individuals_min: 2,
        learns_from: LearnsFrom::Descriptors,
        genes_max: None,
        parameters: &[REEVALUATED, ISO_SIGMA, LINE_SIGMA, ELITES, NEIGHBOURS, ADDED, THRESHOLD],
    };

    fn start(params: &Params, _: usize) -> Self {
        Self {
            n_elites: params.value_of::<u32>(&ELITES) as usize,
            n_nearest: params.value_of::<u32>(&NEIGHBOURS) as usize,
            added: params.value_of(&ADDED),
            threshold: params.value_of(&THRESHOLD),
        }
    }

    /// Novelty is measured by archive and generation together, and by the archive alone if that has
    /// too many. At least one enters, or the archive would stay empty.
    fn survivors(&self, pool: &[Evidence], n_kept: usize) -> Vec<usize> {
        let n_new = pool.len() - n_kept;
        let n_added = ((self.added * n_new as f64).ceil() as usize).max(1);
        let neighbours = Neighbours::new(pool);
        let novelty = |place: usize| self.novelty(&neighbours, place);
        let new = (n_kept..pool.len()).map(|place| (novelty(place), place));
        let mut new: Vec<(f64, usize)> =
            new.filter(|(novelty, _)| *novelty >= self.threshold || n_kept == 0).collect();
        most_novel(&mut new, n_added);
        let mut survivors: Vec<usize> =
            (0..n_kept).chain(new.into_iter().map(|(_, place)| place)).collect();
        survivors.sort_unstable();
        if survivors.len() > self.n_elites {
            let archive: Vec<Evidence> = survivors.iter().map(|&place| pool[place]).collect();
            let mut ranked: Vec<(f64, usize)> =
                self.merits(&archive).into_iter().flatten().zip(survivors).collect();
            most_novel(&mut ranked, self.n_elites);
            survivors = ranked.into_iter().map(|(_, place)| place).collect();
            survivors.sort_unstable();
        }
        survivors
    }

    /// A generation measures the novelty of a pool twice, in the worst case by all distances.
    fn search_ns(&self, n_pool: u64, n_axes: u64) -> u64 {
        n_pool.saturating_mul(n_pool).saturating_mul(n_axes) / DISTANCES_PER_NS
    }

    /// The more novel of two becomes a parent.
    fn merits(&self, kept: &[Evidence]) -> Option<Vec<f64>> {
        let neighbours = Neighbours::new(kept);
        Some((0..kept.len()).map(|place| self.novelty(&neighbours, place)).collect())
    }
}

impl Novelty {
    fn novelty(&self, neighbours: &Neighbours, place: usize) -> f64 {
        neighbours.distance(place, self.n_nearest, |_| true)
    }
}

/// Keeps the `n` most novel places, the first of equals.
fn most_novel(places: &mut Vec<(f64, usize)>, n: usize) {
    places.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    places.truncate(n);
}
