//! Draws in pairs on both sides of a mean, and centred ranks, for algorithms that learn from
//! both.

use determinism::random::Stream;

use super::{draw_normal, draw_normals};

/// `n` vectors of `d` normals: e_0, -e_0, e_1, -e_1, ..., e_k ~ N(0, I). The last one of an odd
/// number is 0, the mean itself.
pub fn draw_pairs(n: usize, d: usize, rng: &mut Stream) -> Vec<Vec<f64>> {
    let mut normals = Vec::with_capacity(n);
    for e in draw_normals(n / 2, d, rng) {
        let mirrored = e.iter().map(|e| -e).collect();
        normals.extend([e, mirrored]);
    }
    normals.resize(n, vec![0.0; d]);
    normals
}

/// The vector of this index that [`draw_pairs`] draws from a stream at its beginning.
pub fn draw_of_pairs(index: usize, n: usize, d: usize, rng: &mut Stream) -> Vec<f64> {
    let is_mean = !n.is_multiple_of(2) && index + 1 == n;
    let mut e = if is_mean { vec![0.0; d] } else { draw_normal(index / 2, d, rng) };
    if !index.is_multiple_of(2) {
        e.iter_mut().for_each(|e| *e = -*e);
    }
    e
}

/// The rank of each individual, evenly spaced from 1/2 (best) to -1/2 (worst).
pub fn centred_ranks(ranking: &[usize]) -> Vec<f64> {
    let n = ranking.len();
    let mut ranks = vec![0.0; n];
    for (place, &individual) in ranking.iter().enumerate() {
        ranks[individual] = 0.5 - place as f64 / (n - 1) as f64;
    }
    ranks
}
