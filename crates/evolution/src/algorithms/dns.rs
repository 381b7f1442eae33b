//! Dominated novelty search: individuals compete with those that are fitter and behave alike.
//!
//! Bahlous-Boldi, Faldor, Grillotti, Janmohamed, Coiffard, Spector, Cully: "Dominated novelty
//! search: rethinking local competition in quality-diversity", GECCO 2025. There is no grid: the
//! repertoire has a fixed number of places.

use experiment_file::{AlgorithmDescription, ELITES, Keeps, LearnsFrom, Parameter, Params};
use serde::{Deserialize, Serialize};

use super::repertoire::{
    Evidence, ISO_SIGMA, LINE_SIGMA, Nearest, Neighbours, REEVALUATED, Rule, square,
};

/// Those far from all that are fitter survive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Dns {
    n_elites: usize,
    n_nearest: usize,
}

const NEAREST: Parameter = Parameter::whole(
    "nearest",
    [1, 100],
    3,
    "Number of nearest fitter individuals that an individual competes with, k",
);

impl Rule for Dns {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "DNS",
        title: "Dominated novelty search",
        learns: "elites far from fitter ones",
        state: "elites d",
        keeps: Keeps::Repertoire,
        individuals_min: 2,
        learns_from: LearnsFrom::Descriptors,
        genes_max: None,
        parameters: &[REEVALUATED, ISO_SIGMA, LINE_SIGMA, ELITES, NEAREST],
    };

    fn start(params: &Params, _: usize) -> Self {
        Self {
            n_elites: params.value_of::<u32>(&ELITES) as usize,
            n_nearest: params.value_of::<u32>(&NEAREST) as usize,
        }
    }

    fn survivors(&self, pool: &[Evidence], _: usize) -> Vec<usize> {
        let neighbours = Neighbours::new(pool);
        let mut by_fitness: Vec<usize> = (0..pool.len()).collect();
        by_fitness.sort_by(|&a, &b| pool[b].fitness.total_cmp(&pool[a].fitness));
        let distance = |place: usize| {
            let own = &pool[place];
            let is_fitter = |other: usize| pool[other].fitness > own.fitness;
            let n_fitter = by_fitness.partition_point(|&other| is_fitter(other));
            if n_fitter > FEW {
                return neighbours.distance(place, self.n_nearest, is_fitter);
            }
            let mut nearest = Nearest::new(self.n_nearest);
            for &fitter in &by_fitness[..n_fitter] {
                nearest.add(square(&own.point, &pool[fitter].point));
            }
            nearest.mean()
        };
        let mut order: Vec<(f64, usize)> = (0..pool.len()).map(distance).zip(0..).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut survivors: Vec<usize> =
            order.into_iter().take(self.n_elites).map(|(_, i)| i).collect();
        survivors.sort_unstable();
        survivors
    }
}

/// Number of fitter individuals up to which a search among all takes longer.
const FEW: usize = 128;
