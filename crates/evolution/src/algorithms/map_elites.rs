//! MAP-Elites: the best individual of every cell of a grid of behaviours.
//!
//! Mouret, Clune: "Illuminating search spaces by mapping elites", arXiv 1504.04909 (2015). A cell
//! keeps a few individuals in depth (Flageat, Cully: "Fast and stable MAP-Elites in noisy domains
//! using Deep-Grid", ALIFE 2020): a lucky newcomer does not drive out the former elite, which
//! returns once evidence shows the luck.

use std::cmp::Ordering;

use experiment_file::{AlgorithmDescription, DEPTH, Keeps, LearnsFrom, Params, limits};
use serde::{Deserialize, Serialize};

use super::repertoire::{Evidence, ISO_SIGMA, LINE_SIGMA, REEVALUATED, Rule};

/// The best of every cell survive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapElites {
    /// Number of individuals that a cell keeps.
    depth: usize,
}

impl Rule for MapElites {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "MAP-Elites",
        title: "Multi-dimensional archive of phenotypic elites",
        learns: "elites of each cell",
        state: "elites d",
        keeps: Keeps::Repertoire,
        individuals_min: 2,
        learns_from: LearnsFrom::Descriptors,
        genes_max: None,
        parameters: &[REEVALUATED, ISO_SIGMA, LINE_SIGMA, DEPTH],
    };

    fn start(params: &Params, n_cells: usize) -> Self {
        let depth = params.value_of::<u32>(&DEPTH) as usize;
        Self { depth: depth.min(limits::ELITES as usize / n_cells).max(1) }
    }

    fn survivors(&self, pool: &[Evidence], _: usize) -> Vec<usize> {
        best_of_cells(pool, self.depth)
    }

    fn elites(&self, survivors: &[Evidence]) -> Vec<usize> {
        best_of_cells(survivors, 1)
    }
}

/// The `n` fittest of every cell, the first of equals, in ascending order of their places.
fn best_of_cells(pool: &[Evidence], n: usize) -> Vec<usize> {
    let n_cells = pool.iter().map(|individual| individual.cell + 1).max().unwrap_or(0);
    // The places of a cell follow each other in `order`, up to its end.
    let mut ends = vec![0; n_cells];
    pool.iter().for_each(|individual| ends[individual.cell] += 1);
    let mut sum = 0;
    ends.iter_mut().for_each(|end| {
        sum += *end;
        *end = sum - *end;
    });
    let mut order = vec![0; pool.len()];
    for (place, individual) in pool.iter().enumerate() {
        let end = &mut ends[individual.cell];
        order[*end] = place;
        *end += 1;
    }
    let mut stays = vec![true; pool.len()];
    let mut start = 0;
    for end in ends {
        let cell = &mut order[start..end];
        start = end;
        if cell.len() > n {
            // The sort is stable, so equal fitness keeps the order of the places.
            cell.sort_by(|&a, &b| {
                pool[b].fitness.partial_cmp(&pool[a].fitness).unwrap_or(Ordering::Equal)
            });
            cell[n..].iter().for_each(|&place| stays[place] = false);
        }
    }
    stays.iter().enumerate().filter(|(_, stays)| **stays).map(|(place, _)| place).collect()
}
