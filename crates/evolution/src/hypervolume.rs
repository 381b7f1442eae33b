//! The hypervolume of a front: the volume that its members dominate, up to a reference point.
//!
//! Zitzler, Thiele: "Multiobjective optimization using evolutionary algorithms: a comparative case
//! study", PPSN V (1998). Exact, for two or three aims.

/// The volume between these individuals and the reference point. `costs`: less is better; numbers
/// after the third are ignored, because experiments have at most three aims.
pub fn hypervolume(costs: &[Vec<f64>], reference: &[f64]) -> f64 {
    let mut points: Vec<[f64; 3]> = costs
        .iter()
        .filter(|costs| costs.iter().zip(reference).all(|(cost, reference)| cost < reference))
        .map(|costs| point(costs))
        .collect();
    let [x, y, z] = point(reference);
    // Of two aims, the third cost is 0, and the depth of the only slice is 1.
    let end = if reference.len() < 3 { 1.0 } else { z };
    points.sort_by(|a, b| a[2].total_cmp(&b[2]));
    let mut stairs = Stairs { steps: Vec::new(), area: 0.0, corner: [x, y] };
    let mut volume = 0.0;
    for (i, &[x, y, z]) in points.iter().enumerate() {
        stairs.add([x, y]);
        let next = points.get(i + 1).map_or(end, |next| next[2]);
        volume += stairs.area * (next - z);
    }
    // Near the largest number, areas are infinite, and no number in slices without depth: `min`
    // returns the largest number in both cases.
    volume.min(f64::MAX)
}

fn point(costs: &[f64]) -> [f64; 3] {
    [0, 1, 2].map(|aim| costs.get(aim).copied().unwrap_or(0.0))
}

/// The area that points dominate in the plane.
struct Stairs {
    /// Points that no other one dominates, by ascending first cost, so by descending second cost.
    steps: Vec<[f64; 2]>,
    area: f64,
    corner: [f64; 2],
}

impl Stairs {
    fn add(&mut self, [x, y]: [f64; 2]) {
        let place = self.steps.partition_point(|step| step[0] <= x);
        let above = place.checked_sub(1).map_or(self.corner[1], |before| self.steps[before][1]);
        if above <= y {
            return;
        }
        // A point of the same first cost is dominated, too.
        let first = self.steps.partition_point(|step| step[0] < x);
        let last = first + self.steps[first..].partition_point(|step| step[1] >= y);
        let end = self.steps.get(last).map_or(self.corner[0], |after| after[0]);
        let mut above = first.checked_sub(1).map_or(self.corner[1], |i| self.steps[i][1]);
        let mut left = x;
        for &[right, below] in &self.steps[first..last] {
            self.area += (right - left) * (above - y);
            (left, above) = (right, below);
        }
        self.area += (end - left) * (above - y);
        self.steps.splice(first..last, [[x, y]]);
    }
}

#[cfg(test)]
mod tests {
    use determinism::random::{Purpose, Stream};

    use super::*;

    #[test]
    fn boxes_add_up_without_their_overlap() {
        let two = [[1.0, 3.0], [2.0, 1.0], [3.0, 3.0], [5.0, 0.0]].map(Vec::from);
        // Widths 3 and 2 up to the corner (4, 4), without what they share.
        assert_eq!(hypervolume(&two, &[4.0, 4.0]), 3.0 + 4.0);
        let cubes = [[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]].map(Vec::from);
        assert_eq!(hypervolume(&cubes, &[2.0; 3]), 4.0);
        assert_eq!(hypervolume(&[], &[4.0, 4.0]), 0.0);
    }

    #[test]
    fn volumes_of_the_largest_numbers_are_numbers() {
        let huge = f64::MAX;
        for n_aims in [2, 3] {
            let costs = [[-huge, 1.0, 0.5], [1.0, -huge, 0.5], [0.0, 0.0, -huge]];
            let costs = costs.map(|costs| costs[..n_aims].to_vec());
            let volume = hypervolume(&costs, &vec![huge; n_aims]);
            assert!(volume > 0.0 && volume.is_finite(), "{volume}");
        }
    }

    #[test]
    fn volumes_agree_with_a_count_of_cells() {
        let mut rng = Stream::new(6, 0, 0, Purpose::Evolution, 0);
        for n_aims in [2, 3] {
            for n in 1..12 {
                let costs: Vec<Vec<f64>> =
                    (0..n).map(|_| (0..n_aims).map(|_| rng.below(7) as f64).collect()).collect();
                let cells = (0..6_u32.pow(n_aims)).filter(|cell| {
                    let place = |aim: u32| f64::from(cell / 6_u32.pow(aim) % 6);
                    let covers = |costs: &Vec<f64>| (0..).zip(costs).all(|(i, c)| *c <= place(i));
                    costs.iter().any(covers)
                });
                let reference = vec![6.0; n_aims as usize];
                assert_eq!(hypervolume(&costs, &reference), cells.count() as f64, "{costs:?}");
            }
        }
    }
}
