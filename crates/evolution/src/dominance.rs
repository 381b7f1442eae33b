//! Who is better in several aims at once: ranks by dominance, and the room that an individual has.
//!
//! Deb, Pratap, Agarwal, Meyarivan: "A fast and elitist multiobjective genetic algorithm: NSGA-II",
//! IEEE Transactions on Evolutionary Computation 6 (2002). The ranks are those of the paper; they
//! are found by binary search among the fronts (Zhang et al.: "An efficient approach to
//! nondominated sorting", ibid. 19 (2015)), of which only those members are searched that no
//! other one beats in second and third cost.
//!
//! An individual is a list of *costs*, one per aim, of which less is better. They are finite and
//! have no negative zero ([`costs`](crate::front::costs)).

use std::{cmp::Ordering, collections::BTreeMap};

/// The fronts, best first, each with its members in ascending order: those that only members of
/// earlier fronts dominate. n individuals take O(n log² n).
///
/// # Panics
///
/// If an individual has more than three costs.
pub fn fronts(costs: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..costs.len()).collect();
    // No individual dominates an earlier one of this order.
    order.sort_by(|&a, &b| lexicographic(&costs[a], &costs[b]));
    let mut fronts: Vec<Vec<usize>> = Vec::new();
    let mut stairs: Vec<Stairs> = Vec::new();
    let mut place = 0;
    for (nth, &i) in order.iter().enumerate() {
        let is_equal = nth > 0 && lexicographic(&costs[order[nth - 1]], &costs[i]).is_eq();
        // Equals dominate each other as little as those who dominate them differ.
        if !is_equal {
            let later = Later::new(&costs[i]);
            // Whoever is dominated by a member of a front is also dominated by one of each front
            // before.
            place = stairs.partition_point(|stairs| stairs.is_below(later));
            if place == stairs.len() {
                stairs.push(Stairs::default());
                fronts.push(Vec::new());
            }
            stairs[place].add(later);
        }
        fronts[place].push(i);
    }
    fronts.iter_mut().for_each(|front| front.sort_unstable());
    fronts
}

/// The second and the third cost of an individual, 0 if there is none, as numbers of their order.
#[derive(Debug, Clone, Copy)]
struct Later {
    second: i64,
    third: i64,
}

impl Later {
    fn new(costs: &[f64]) -> Self {
        assert!(costs.len() <= 3, "experiments have at most three aims");
        let [second, third] = [1, 2].map(|nth| ordered(costs.get(nth).copied().unwrap_or(0.0)));
        Self { second, third }
    }
}

/// A number whose order is the total order of `x`.
fn ordered(x: f64) -> i64 {
    let bits = x.to_bits().cast_signed();
    bits ^ (bits >> 63).cast_unsigned().wrapping_shr(1).cast_signed()
}

/// The members of a front that no other one beats in second and third cost: the third cost of each
/// by its second cost. The larger the second, the smaller the third.
#[derive(Debug, Default)]
struct Stairs {
    steps: BTreeMap<i64, i64>,
}

impl Stairs {
    /// Whether a member is at least as good in both costs. Its first cost is then at least as good,
    /// too, because it came earlier.
    fn is_below(&self, later: Later) -> bool {
        let nearest = self.steps.range(..=later.second).next_back();
        nearest.is_some_and(|(_, third)| *third <= later.third)
    }

    /// Adds a member that no earlier one dominates.
    fn add(&mut self, later: Later) {
        while let Some((&second, _)) =
            self.steps.range(later.second..).next().filter(|(_, third)| **third >= later.third)
        {
            self.steps.remove(&second);
        }
        self.steps.insert(later.second, later.third);
    }
}

fn lexicographic(a: &[f64], b: &[f64]) -> Ordering {
    let mut pairs = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
    pairs.find(|ordering| ordering.is_ne()).unwrap_or(Ordering::Equal)
}

/// The crowding distance of each member of a front: the distance between its neighbours on both
/// sides, as a share of the front's extent, added up over the aims. The members at the ends of an
/// aim have infinitely much room, and so have two or fewer.
pub fn crowding(costs: &[Vec<f64>], front: &[usize]) -> Vec<f64> {
    let n = front.len();
    if n <= 2 {
        return vec![f64::INFINITY; n];
    }
    let mut room = vec![0.0; n];
    (0..costs[front[0]].len()).for_each(|aim| {
        // Halves, because the difference of two finite numbers may be infinite.
        let halves: Vec<f64> = front.iter().map(|&member| 0.5 * costs[member][aim]).collect();
        add_room(&halves, &mut room);
    });
    room
}

/// Adds the room of each member in one aim, from its cost.
fn add_room(costs: &[f64], room: &mut [f64]) {
    let mut order: Vec<usize> = (0..costs.len()).collect();
    order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    let [first, last] = [order[0], order[order.len() - 1]];
    let extent = costs[last] - costs[first];
    // All members are alike in this aim.
    if extent == 0.0 {
        return;
    }
    room[first] = f64::INFINITY;
    room[last] = f64::INFINITY;
    for three in order.windows(3) {
        let [below, own, above] = [three[0], three[1], three[2]].map(|member| costs[member]);
        room[three[1]] += (own - below) / extent + (above - own) / extent;
    }
}

/// The ranks and the room of all individuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Standing {
    /// Index of the front of each individual.
    pub rank: Vec<usize>,
    /// Crowding distance of each individual in its front.
    pub room: Vec<f64>,
}

impl Standing {
    /// The standing of individuals with these costs.
    pub fn new(costs: &[Vec<f64>]) -> Self {
        let mut standing = Self { rank: vec![0; costs.len()], room: vec![0.0; costs.len()] };
        for (rank, front) in fronts(costs).iter().enumerate() {
            for (&i, room) in front.iter().zip(crowding(costs, front)) {
                standing.rank[i] = rank;
                standing.room[i] = room;
            }
        }
        standing
    }

    /// Whether individual `a` is better than `b`: of a lower rank, or with more room in the same
    /// front.
    pub fn is_better(&self, a: usize, b: usize) -> bool {
        match self.rank[a].cmp(&self.rank[b]) {
            Ordering::Less => true,
            Ordering::Equal => self.room[a] > self.room[b],
            Ordering::Greater => false,
        }
    }

    /// The `n` best individuals, the first of equals, in ascending order.
    pub fn best(&self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.rank.len()).collect();
        order.sort_by(|&a, &b| {
            let by_rank = self.rank[a].cmp(&self.rank[b]);
            by_rank.then(self.room[b].total_cmp(&self.room[a])).then(a.cmp(&b))
        });
        order.truncate(n);
        order.sort_unstable();
        order
    }
}

#[cfg(test)]
mod tests {
    use determinism::random::{Purpose, Stream};

    use super::*;

    /// Whether `a` is at least as good as `b` in every aim, and better in one.
    fn dominates(a: &[f64], b: &[f64]) -> bool {
        let is_worse = a.iter().zip(b).any(|(a, b)| a > b);
        !is_worse && a.iter().zip(b).any(|(a, b)| a < b)
    }

    /// Ranks by the definition.
    fn by_definition(costs: &[Vec<f64>]) -> Vec<usize> {
        let mut rank = vec![usize::MAX; costs.len()];
        for front in 0.. {
            let left: Vec<usize> = (0..costs.len()).filter(|&i| rank[i] >= front).collect();
            if left.is_empty() {
                break;
            }
            for &i in &left {
                if !left.iter().any(|&other| dominates(&costs[other], &costs[i])) {
                    rank[i] = front;
                }
            }
        }
        rank
    }

    #[test]
    fn ranks_follow_their_definition_also_with_ties() {
        let mut rng = Stream::new(5, 0, 0, Purpose::Evolution, 0);
        for n_aims in [1, 2, 3] {
            for n in [0, 1, 2, 40] {
                // Coarse values, so that many are equal.
                let mut value = || rng.below(6) as f64 - 2.0;
                let costs: Vec<Vec<f64>> =
                    (0..n).map(|_| (0..n_aims).map(|_| value()).collect()).collect();
                assert_eq!(Standing::new(&costs).rank, by_definition(&costs), "{costs:?}");
            }
        }
    }

    #[test]
    fn a_state_with_numbers_that_no_run_has_is_no_panic() {
        let mut costs = vec![vec![0.0, f64::NAN]; 50];
        costs.extend((0..50).map(|i| vec![f64::from(i % 7), f64::INFINITY]));
        let standing = Standing::new(&costs);
        assert_eq!(standing.best(30).len(), 30);
    }

    #[test]
    fn extremes_have_room_and_the_rest_as_much_as_between_their_neighbours() {
        let costs = [[0.0, 9.0], [1.0, 3.0], [2.0, 1.0], [4.0, 0.0]].map(Vec::from);
        let expected = [f64::INFINITY, 2.0 / 4.0 + 8.0 / 9.0, 3.0 / 4.0 + 3.0 / 9.0, f64::INFINITY];
        for (found, expected) in crowding(&costs, &[0, 1, 2, 3]).into_iter().zip(expected) {
            assert!(found == expected || (found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }

    #[test]
    fn numbers_of_any_size_have_an_order() {
        let huge = f64::MAX;
        let costs = [[-huge, huge], [0.0, 0.0], [huge, -huge], [1.0, -1.0]].map(Vec::from);
        let standing = Standing::new(&costs);
        assert_eq!(standing.rank, [0; 4]);
        assert!(standing.room.iter().all(|room| !room.is_nan()), "{standing:?}");
        assert_eq!(standing.best(2), [0, 2]);
    }

    #[test]
    fn equals_stay_in_the_order_in_which_they_came() {
        let standing = Standing::new(&vec![vec![1.0, 2.0]; 5]);
        assert_eq!(standing.best(3), [0, 1, 2]);
        assert!(!standing.is_better(0, 1) && !standing.is_better(1, 0));
    }
}
