//! What the elites of a repertoire are worth: the figures of a repertoire.
//!
//! The fitness by which an elite got its place is optimistic, because luck took part in the choice,
//! and luck may have shown a behaviour that is not its own. The judgement at the end of a run
//! evaluates every elite on trials that selected nothing. The corrected repertoire has each elite
//! in the cell of its judged behaviour. If several are in a cell, the evidence of the run decides
//! between them, so that the judgement still selects nothing.

use std::collections::BTreeMap;

use super::{Axis, End, Evolution, algorithms::Behaviours};

/// The elites of a repertoire on the grid of its descriptors.
#[derive(Debug, Clone, PartialEq)]
pub struct Repertoire<'a> {
    /// The axes of the grid.
    pub axes: Vec<Axis>,
    /// The elites, in the order in which they came.
    pub elites: Vec<EliteReport<'a>>,
}

/// An elite.
#[derive(Debug, Clone, PartialEq)]
pub struct EliteReport<'a> {
    /// Its genes.
    pub genotype: &'a [f64],
    /// The generation of its birth.
    pub generation: u64,
    /// Its index in that generation.
    pub individual: u32,
    /// Index of its cell on every axis.
    pub cell: Vec<u32>,
    /// Mean fitness over all trials of its life, optimistic.
    pub fitness: f64,
    /// Mean descriptors over these trials.
    pub descriptors: Vec<f64>,
    /// Number of these trials.
    pub n_trials: u64,
    /// Its judgement; `None` before the end of a run, or if a number is not finite.
    pub judged: Option<JudgedElite>,
}

/// The means of an elite over trials that selected nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedElite {
    /// Mean fitness.
    pub fitness: f64,
    /// Mean descriptors.
    pub descriptors: Vec<f64>,
    /// Index of the cell of these descriptors on every axis.
    pub cell: Vec<u32>,
}

/// The figures of a corrected repertoire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corrected {
    /// The judged fitness of all cells, added up.
    pub qd_score: f64,
    /// Share of the cells that have an elite.
    pub coverage: f64,
    /// Share of the elites whose judged behaviour is in the cell of their evidence.
    pub stay: f64,
}

impl Evolution {
    /// The repertoire or the front, if the algorithm has one.
    pub(crate) fn behaviours(&self) -> Option<&dyn Behaviours> {
        let [only] = &self.populations[..] else { return None };
        only.behaviours()
    }

    /// Number of descriptors that [`tell`](Self::tell) expects per trial: the values of descriptors
    /// or of aims.
    pub fn n_descriptors(&self) -> usize {
        self.behaviours().map_or(0, Behaviours::n_descriptors)
    }

    /// The elites of the present repertoire; `None` without one. `end`: the judgement after this
    /// generation, if it is the last of a run.
    pub fn elites(&self, end: &End) -> Option<Repertoire<'_>> {
        let axes = self.behaviours()?.axes();
        (!axes.is_empty()).then(|| Repertoire { axes: axes.to_vec(), elites: self.reports(end) })
    }

    /// The elites of a repertoire or of a front, in the order in which they came.
    pub(crate) fn reports(&self, end: &End) -> Vec<EliteReport<'_>> {
        let Some(behaviours) = self.behaviours() else { return Vec::new() };
        let axes = behaviours.axes();
        let cell = |descriptors: &[f64]| -> Vec<u32> {
            axes.iter().zip(descriptors).map(|(axis, &value)| axis.cell(value)).collect()
        };
        let n_values = 1 + behaviours.n_descriptors();
        let elites = behaviours.elites();
        let judged = |nth: usize| {
            let values = end.elites.get(nth).filter(|_| end.elites.len() == elites.len())?;
            let trials = values.chunks_exact(n_values);
            let n_trials = trials.len() as f64;
            let mut sums = vec![0.0; n_values];
            for trial in trials {
                sums.iter_mut().zip(trial).for_each(|(sum, value)| *sum += value);
            }
            let means: Vec<f64> = sums.into_iter().map(|sum| sum / n_trials).collect();
            let descriptors = means[1..].to_vec();
            let is_finite = means.iter().all(|mean| mean.is_finite());
            is_finite.then(|| JudgedElite {
                fitness: means[0],
                cell: cell(&descriptors),
                descriptors,
            })
        };
        let reports = elites.iter().enumerate().map(|(nth, elite)| EliteReport {
            genotype: &elite.genotype,
            generation: elite.generation,
            individual: elite.individual,
            cell: cell(&elite.descriptors()),
            fitness: elite.fitness(),
            descriptors: elite.descriptors(),
            n_trials: elite.n_trials,
            judged: judged(nth),
        });
        reports.collect()
    }
}

impl<'a> Repertoire<'a> {
    /// The elite of every cell that has one, by evidence; in the order of the cells.
    pub fn by_cell(&self) -> Vec<&EliteReport<'a>> {
        self.fittest(|elite| Some(&elite.cell[..]))
    }

    /// The elite of every cell that has one, by judged behaviour; in the order of the cells.
    pub fn corrected(&self) -> Vec<&EliteReport<'a>> {
        self.fittest(|elite| elite.judged.as_ref().map(|judged| &judged.cell[..]))
    }

    /// The corrected figures; `None` without a judgement.
    pub fn figures(&self) -> Option<Corrected> {
        let judged: Vec<(&[u32], &JudgedElite)> = self
            .elites
            .iter()
            .filter_map(|elite| Some((&elite.cell[..], elite.judged.as_ref()?)))
            .collect();
        let n_staying = judged.iter().filter(|(cell, judged)| **cell == judged.cell[..]).count();
        let n_cells: f64 = self.axes.iter().map(|axis| f64::from(axis.n_cells)).product();
        let corrected = self.corrected();
        let fitness = corrected.iter().filter_map(|elite| elite.judged.as_ref());
        (!judged.is_empty()).then(|| Corrected {
            qd_score: fitness.map(|judged| judged.fitness).sum(),
            coverage: corrected.len() as f64 / n_cells,
            stay: n_staying as f64 / self.elites.len() as f64,
        })
    }

    /// The fittest elite of each cell by evidence, the first of equals.
    fn fittest<'b>(
        &'b self,
        cell: impl Fn(&'b EliteReport<'a>) -> Option<&'b [u32]>,
    ) -> Vec<&'b EliteReport<'a>> {
        let mut best: BTreeMap<&[u32], &EliteReport<'a>> = BTreeMap::new();
        for elite in &self.elites {
            let Some(cell) = cell(elite) else { continue };
            let so_far = best.entry(cell).or_insert(elite);
            if elite.fitness > so_far.fitness {
                *so_far = elite;
            }
        }
        best.into_values().collect()
    }
}
