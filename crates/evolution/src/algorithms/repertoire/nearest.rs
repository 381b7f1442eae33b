//! Nearest neighbours among behaviours, by Euclidean distance.

use std::ops::Range;

use super::Evidence;

/// The squares of the smallest distances so far, ascending, so that the order of a search does not
/// decide their sum.
pub struct Nearest {
    k: usize,
    squares: Vec<f64>,
}

impl Nearest {
    /// None yet of `k`, at least 1.
    pub fn new(k: usize) -> Self {
        Self { k, squares: Vec::with_capacity(k + 1) }
    }

    /// The largest of `k` squares; infinite as long as there are fewer.
    fn limit(&self) -> f64 {
        if self.squares.len() < self.k { f64::INFINITY } else { self.squares[self.k - 1] }
    }

    /// Adds another one, unless `k` are smaller.
    pub fn add(&mut self, square: f64) {
        if self.squares.len() < self.k || square < self.limit() {
            let smaller = self.squares.iter().rposition(|known| *known <= square);
            self.squares.insert(smaller.map_or(0, |at| at + 1), square);
            self.squares.truncate(self.k);
        }
    }

    /// The mean distance; infinite if there is none.
    pub fn mean(&self) -> f64 {
        if self.squares.is_empty() {
            return f64::INFINITY;
        }
        let sum: f64 = self.squares.iter().map(|square| square.sqrt()).sum();
        sum / self.squares.len() as f64
    }
}

/// Behaviours in the order of the coordinate that tells most of them apart, so that a search ends
/// where no nearer one can follow.
pub struct Neighbours {
    /// The coordinates of all behaviours in that order; shape `[axis][rank]`.
    axes: Vec<Vec<f64>>,
    /// The axis of the order.
    widest: usize,
    /// The place in the pool of each rank, and the rank of each place.
    places: Vec<usize>,
    ranks: Vec<usize>,
}

/// Number of distances that a search computes at once.
const BLOCK: usize = 16;

impl Neighbours {
    /// The neighbours of everyone in a pool.
    pub fn new(pool: &[Evidence]) -> Self {
        let n_axes = pool.first().map_or(0, |own| own.point.len());
        let widest = widest(pool, n_axes);
        let along = |place: usize| pool[place].point.get(widest).copied().unwrap_or(0.0);
        let mut places: Vec<usize> = (0..pool.len()).collect();
        places.sort_by(|&a, &b| along(a).total_cmp(&along(b)));
        let mut ranks = vec![0; pool.len()];
        places.iter().enumerate().for_each(|(rank, &place)| ranks[place] = rank);
        let axis = |axis: usize| places.iter().map(|&place| pool[place].point[axis]).collect();
        Self { axes: (0..n_axes).map(axis).collect(), widest, places, ranks }
    }

    /// Mean distance from the individual at this place to the `k` nearest others that `counts`
    /// accepts by their places; to all of them, if they are fewer; infinite without any.
    pub fn distance(&self, place: usize, k: usize, counts: impl Fn(usize) -> bool) -> f64 {
        let (rank, n) = (self.ranks[place], self.places.len());
        let mut nearest = Nearest::new(k.min(n));
        let (mut low, mut high) = (rank, rank + 1);
        let (mut is_below, mut is_above) = (true, true);
        while is_below || is_above {
            // No distance is shorter than its part along a coordinate.
            is_below = low > 0 && !self.is_beyond(rank, low - 1, &nearest);
            if is_below {
                let start = low.saturating_sub(BLOCK);
                self.search(rank, start..low, &mut nearest, &counts);
                low = start;
            }
            is_above = high < n && !self.is_beyond(rank, high, &nearest);
            if is_above {
                let end = n.min(high + BLOCK);
                self.search(rank, high..end, &mut nearest, &counts);
                high = end;
            }
        }
        nearest.mean()
    }

    fn is_beyond(&self, rank: usize, other: usize, nearest: &Nearest) -> bool {
        let Some(along) = self.axes.get(self.widest) else { return false };
        let gap = along[other] - along[rank];
        gap * gap > nearest.limit()
    }

    /// Adds the distances to those with these ranks, at most [`BLOCK`].
    fn search(
        &self,
        rank: usize,
        ranks: Range<usize>,
        nearest: &mut Nearest,
        counts: &impl Fn(usize) -> bool,
    ) {
        let mut squares = [0.0; BLOCK];
        for axis in &self.axes {
            for (square, x) in squares.iter_mut().zip(&axis[ranks.clone()]) {
                *square += (x - axis[rank]) * (x - axis[rank]);
            }
        }
        let limit = nearest.limit();
        for (square, rank) in squares.into_iter().zip(ranks) {
            if square <= limit && counts(self.places[rank]) {
                nearest.add(square);
            }
        }
    }
}

/// The axis with the largest standard deviation within the grid, the first of equals.
fn widest(pool: &[Evidence], n_axes: usize) -> usize {
    let variance = |axis: usize| {
        let values = pool.iter().map(|individual| individual.point[axis].clamp(0.0, 1.0));
        let (sum, squares) = values.fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
        squares - sum * sum / pool.len() as f64
    };
    let variances: Vec<f64> = (0..n_axes).map(variance).collect();
    let largest = variances.iter().copied().fold(0.0, f64::max);
    variances.iter().position(|variance| *variance == largest).unwrap_or(0)
}

/// Squared Euclidean distance.
pub fn square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use determinism::random::{Purpose, Stream};

    use super::*;

    fn pool(n: usize, n_dims: usize) -> Vec<Evidence> {
        let mut rng = Stream::new(9, n as u64, n_dims as u64, Purpose::Evolution, 0);
        // Coarse, so that many coordinates and distances are equal.
        let mut coordinate = || (rng.uniform() * 12.0).floor() / 12.0;
        let mut individual = || Evidence {
            fitness: coordinate(),
            point: (0..n_dims).map(|_| coordinate()).collect(),
            cell: 0,
        };
        (0..n).map(|_| individual()).collect()
    }

    /// By all distances.
    fn naive(pool: &[Evidence], place: usize, k: usize) -> f64 {
        let own = &pool[place];
        let others =
            pool.iter().enumerate().filter(|(i, other)| *i != place && other.fitness > own.fitness);
        let mut squares: Vec<f64> =
            others.map(|(_, other)| square(&own.point, &other.point)).collect();
        squares.sort_by(f64::total_cmp);
        squares.truncate(k);
        let n = squares.len() as f64;
        if n == 0.0 { f64::INFINITY } else { squares.iter().map(|s| s.sqrt()).sum::<f64>() / n }
    }

    #[test]
    fn the_nearest_are_those_of_all_distances_to_the_bit() {
        for (n, n_dims) in [(1, 1), (2, 1), (60, 1), (200, 2), (200, 3), (100, 8)] {
            let pool = pool(n, n_dims);
            let neighbours = Neighbours::new(&pool);
            for (place, k) in (0..n).flat_map(|place| [1, 3, 15].map(|k| (place, k))) {
                let own = pool[place].fitness;
                let found = neighbours.distance(place, k, |other| pool[other].fitness > own);
                assert_eq!(found, naive(&pool, place, k), "{n} {n_dims} {place} {k}");
            }
        }
    }

    #[test]
    fn nobody_is_a_neighbour_of_itself_and_numbers_that_overflow_are_far() {
        let at = |x: f64| Evidence { fitness: 0.0, point: [x, 0.0].into_iter().collect(), cell: 0 };
        let pool = [at(0.0), at(0.0), at(f64::MAX), at(-f64::MAX), at(1.0)];
        let neighbours = Neighbours::new(&pool);
        let distance = |place, k| neighbours.distance(place, k, |_| true);
        assert_eq!([distance(0, 1), distance(0, 2), distance(4, 2)], [0.0, 0.5, 1.0]);
        // A stranger may ask for any number of neighbours.
        assert_eq!(distance(0, 1 << 60), distance(0, 4));
        assert_eq!([distance(2, 1), distance(0, 4)], [f64::INFINITY; 2]);
    }
}
