//! What the elites of a front are worth: who stays on it, and the volume that it dominates.
//!
//! Luck helps individuals on to a front in every aim, so the front of the evidence is optimistic.
//! The judgement at the end of a run evaluates every elite on trials that selected nothing. The
//! corrected front has the elites that no other one dominates by judged values.

use experiment_file::Direction;

use super::{EliteReport, End, Evolution, dominance::fronts, hypervolume::hypervolume};

/// The elites of a front: kept individuals that no other one dominates by the evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Front<'a> {
    /// The aims beside fitness.
    pub aims: Vec<Direction>,
    /// The elites, in the order in which they came. Their descriptors are the values of the aims,
    /// and they have no cell.
    pub elites: Vec<EliteReport<'a>>,
}

/// The figures of a front.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontFigures {
    /// The volume that the shown elites dominate, up to the reference point.
    pub hypervolume: f64,
    /// The reference point: fitness, and then the aims.
    pub reference: Vec<f64>,
    /// Share of the elites that no other one dominates by judged values; `None` without a
    /// judgement.
    pub stay: Option<f64>,
}

/// Values as costs, of which less is better: one for fitness and for each aim, and no negative
/// zero, so that their total order is that of the numbers.
pub(crate) fn costs(fitness: f64, descriptors: &[f64], aims: &[Direction]) -> Vec<f64> {
    let cost = |(nth, aim): (usize, &Direction)| {
        let value = descriptors.get(nth).copied().unwrap_or(f64::NAN);
        match aim {
            Direction::Maximise => -value,
            Direction::Minimise => value,
        }
    };
    let of_aims = aims.iter().enumerate().map(cost);
    [-fitness].into_iter().chain(of_aims).map(|cost| cost + 0.0).collect()
}

impl Evolution {
    /// The elites of the present front; `None` without one. `end`: the judgement after this
    /// generation, if it is the last of a run.
    pub fn front(&self, end: &End) -> Option<Front<'_>> {
        let aims = self.behaviours()?.aims();
        (!aims.is_empty()).then(|| Front { aims: aims.to_vec(), elites: self.reports(end) })
    }
}

impl<'a> Front<'a> {
    /// Whether the elites are judged, so that judged values count.
    pub fn is_judged(&self) -> bool {
        self.elites.iter().any(|elite| elite.judged.is_some())
    }

    /// The elites on the front, by their places: those that no other one dominates by judged
    /// values, or all of them before the judgement.
    pub fn shown(&self) -> Vec<usize> {
        let costs = self.counted();
        let places: Vec<usize> = (0..costs.len()).filter(|&i| costs[i].is_some()).collect();
        let costs: Vec<Vec<f64>> = costs.into_iter().flatten().collect();
        let first = fronts(&costs).into_iter().next().unwrap_or_default();
        first.into_iter().map(|i| places[i]).collect()
    }

    /// The figures of the values that count. `reference`: the point up to which volume counts,
    /// fitness first; by default the worst value of each aim among all elites. `None` if no elite
    /// has values that count.
    pub fn figures(&self, reference: Option<&[f64]>) -> Option<FrontFigures> {
        let costs: Vec<Vec<f64>> = self.counted().into_iter().flatten().collect();
        let worst = costs.iter().cloned().reduce(|worst, costs| {
            worst.into_iter().zip(costs).map(|(worst, cost)| worst.max(cost)).collect()
        })?;
        let corner = reference.map_or(worst, |of| self.costs(of[0], &of[1..]));
        let n_staying = self.is_judged().then(|| self.shown().len());
        Some(FrontFigures {
            hypervolume: hypervolume(&costs, &corner),
            reference: self.values(&corner),
            stay: n_staying.map(|n| n as f64 / self.elites.len() as f64),
        })
    }

    /// The costs of each elite by the values that count: judged ones, if there are any.
    fn counted(&self) -> Vec<Option<Vec<f64>>> {
        let is_judged = self.is_judged();
        let costs = |elite: &EliteReport<'_>| match &elite.judged {
            Some(judged) => Some(self.costs(judged.fitness, &judged.descriptors)),
            None if is_judged => None,
            None => Some(self.costs(elite.fitness, &elite.descriptors)),
        };
        self.elites.iter().map(costs).collect()
    }

    fn costs(&self, fitness: f64, descriptors: &[f64]) -> Vec<f64> {
        costs(fitness, descriptors, &self.aims)
    }

    /// The values of costs.
    fn values(&self, costs: &[f64]) -> Vec<f64> {
        // Zero without a sign, for people.
        self.costs(costs[0], &costs[1..]).iter().map(|value| value + 0.0).collect()
    }
}
