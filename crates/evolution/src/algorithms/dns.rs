//! Dominated novelty search: individuals compete with those that are fitter and behave alike.
//!
//! Bahlous-Boldi, Faldor, Grillotti, Janmohamed, Coiffard, Spector, Cully: "Dominated novelty
//! search: rethinking local competition in quality-diversity", GECCO 2025. There is no grid: the
//! repertoire has a fixed number of places.

use experiment_file::{AlgorithmDescription, ELITES, Keeps, LearnsFrom, Parameter, Params};
use serde::{Deserialize, Serialize};

use super::repertoire::{Evidence, ISO_SIGMA, LINE_SIGMA, REEVALUATED, Rule};

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

    fn survivors(&self, pool: &[Evidence]) -> Vec<usize> {
        let distances = pool.iter().map(|own| self.distance(own, pool));
        let mut order: Vec<(f64, usize)> = distances.zip(0..).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut survivors: Vec<usize> =
            order.into_iter().take(self.n_elites).map(|(_, i)| i).collect();
        survivors.sort_unstable();
        survivors
    }
}

impl Dns {
    /// Mean distance to the nearest fitter individuals; infinite if none is fitter.
    fn distance(&self, own: &Evidence, pool: &[Evidence]) -> f64 {
        let fitter = pool.iter().filter(|other| other.fitness > own.fitness);
        let mut squares: Vec<f64> = fitter.map(|other| square(&own.point, &other.point)).collect();
        if squares.is_empty() {
            return f64::INFINITY;
        }
        let k = self.n_nearest.min(squares.len());
        squares.select_nth_unstable_by(k - 1, f64::total_cmp);
        squares.truncate(k);
        // Summed in an order that no selection algorithm decides.
        squares.sort_by(f64::total_cmp);
        squares.iter().map(|square| square.sqrt()).sum::<f64>() / k as f64
    }
}

/// Squared Euclidean distance.
fn square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}
