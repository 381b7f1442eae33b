//! Crossover and mutation that keep genes in \[0, 1\], as in the authors' program for NSGA-II.
//!
//! Deb, Agrawal: "Simulated binary crossover for continuous search space", Complex Systems 9
//! (1995); Deb, Goyal: "A combined genetic adaptive search (GeneAS) for engineering design",
//! Computer Science and Informatics 26 (1996), for the mutation. The distributions end at the
//! bounds.

use determinism::random::Stream;

/// Probability that a gene of a crossed pair is crossed.
const GENE_PROB: f64 = 0.5;
/// Genes closer than this are not crossed.
const CLOSE: f64 = 1e-14;

/// Crosses two parents, who become their children: per gene, both children lie symmetrically around
/// the parents' mean, apart from the bounds. `eta`: distribution index.
pub fn simulated_binary(first: &mut [f64], second: &mut [f64], eta: f64, rng: &mut Stream) {
    for (a, b) in first.iter_mut().zip(second) {
        if !rng.bernoulli(GENE_PROB) || (*a - *b).abs() <= CLOSE {
            continue;
        }
        let (low, high) = (a.min(*b), a.max(*b));
        let (sum, distance) = (low + high, high - low);
        let u = rng.uniform();
        let [to_low, to_high] = [low, 1.0 - high].map(|room| reach(room / distance, eta));
        let spread_low = spread(u, to_low, eta);
        // Far from both bounds, both spreads are the same.
        let spread_high = if to_low == to_high { spread_low } else { spread(u, to_high, eta) };
        let children = [0.5 * (sum - spread_low * distance), 0.5 * (sum + spread_high * distance)];
        let [below, above] = children.map(|gene| gene.clamp(0.0, 1.0));
        (*a, *b) = if rng.bernoulli(0.5) { (below, above) } else { (above, below) };
    }
}

/// Twice the probability that a spread stays within the bound: 2 - beta^-(eta + 1). `room`:
/// distance of the parent from the bound, relative to the distance of the parents.
fn reach(room: f64, eta: f64) -> f64 {
    2.0 - power(1.0 + 2.0 * room, -(eta + 1.0))
}

/// The spread of a child, relative to that of the parents, for a uniform draw.
fn spread(u: f64, reach: f64, eta: f64) -> f64 {
    let share = u * reach;
    let base = if share <= 1.0 { share } else { 1.0 / (2.0 - share) };
    power(base, 1.0 / (eta + 1.0))
}

/// A power of a number from 0 on; faster than `pow`, which is exact to the last bit.
fn power(base: f64, exponent: f64) -> f64 {
    libm::exp(exponent * libm::log(base))
}

/// Mutates every gene with this probability, by a polynomial distribution. `eta`: distribution
/// index.
pub fn mutate(genes: &mut [f64], probability: f64, eta: f64, rng: &mut Stream) {
    for gene in genes {
        if rng.bernoulli(probability) {
            let u = rng.uniform();
            let root = |base: f64| power(base, 1.0 / (eta + 1.0));
            let change = if u <= 0.5 {
                let at_bound = power(1.0 - *gene, eta + 1.0);
                root(2.0 * u + (1.0 - 2.0 * u) * at_bound) - 1.0
            } else {
                let at_bound = power(*gene, eta + 1.0);
                1.0 - root(2.0 * (1.0 - u) + 2.0 * (u - 0.5) * at_bound)
            };
            *gene = (*gene + change).clamp(0.0, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use determinism::random::Purpose;

    use super::*;
    use crate::tests::ks_statistic;

    fn rng() -> Stream {
        Stream::new(2, 0, 0, Purpose::Evolution, 0)
    }

    /// Distribution of a spread beta that ends at `bound`: (eta + 1)/2 beta^eta up to 1, (eta +
    /// 1)/2 beta^-(eta + 2) beyond, divided by the whole up to the bound.
    fn spread_cdf(beta: f64, eta: f64, bound: f64) -> f64 {
        let free = |beta: f64| match beta <= 1.0 {
            true => libm::pow(beta, eta + 1.0) / 2.0,
            false => 1.0 - libm::pow(beta, -(eta + 1.0)) / 2.0,
        };
        (free(beta) / free(bound)).min(1.0)
    }

    #[test]
    fn children_spread_as_the_paper_says_and_stay_within_bounds() {
        let (low, high, eta) = (0.05, 0.55, 2.0);
        let mut rng = rng();
        let mut spreads = [Vec::new(), Vec::new()];
        let mut n_kept = 0;
        for _ in 0..40_000 {
            let (mut a, mut b) = ([low], [high]);
            simulated_binary(&mut a, &mut b, eta, &mut rng);
            let (below, above) = (a[0].min(b[0]), a[0].max(b[0]));
            assert!((0.0..=1.0).contains(&below) && (0.0..=1.0).contains(&above));
            match (below, above) == (low, high) {
                true => n_kept += 1,
                false => {
                    spreads[0].push((low + high - 2.0 * below) / (high - low));
                    spreads[1].push((2.0 * above - low - high) / (high - low));
                }
            }
        }
        assert!((f64::from(n_kept) / 40_000.0 - 0.5).abs() < 0.01, "half of the genes: {n_kept}");
        let bounds = [1.0 + 2.0 * low / (high - low), 1.0 + 2.0 * (1.0 - high) / (high - low)];
        for (spreads, bound) in spreads.into_iter().zip(bounds) {
            let statistic = ks_statistic(spreads, |beta| spread_cdf(beta, eta, bound));
            assert!(statistic < 1.95, "{statistic}");
        }
    }

    #[test]
    fn either_child_may_have_the_smaller_gene() {
        let mut rng = rng();
        let smaller = (0..2000).filter(|_| {
            let (mut a, mut b) = ([0.2; 1], [0.8; 1]);
            simulated_binary(&mut a, &mut b, 20.0, &mut rng);
            a[0] < b[0]
        });
        // Half of the genes are not crossed, and half of the others stay in order.
        assert!((smaller.count() as f64 / 2000.0 - 0.75).abs() < 0.04);
    }

    #[test]
    fn equal_parents_have_equal_children() {
        let (mut a, mut b) = ([0.25; 9], [0.25; 9]);
        simulated_binary(&mut a, &mut b, 20.0, &mut rng());
        assert_eq!((a, b), ([0.25; 9], [0.25; 9]));
    }

    #[test]
    fn mutations_are_polynomial_and_end_at_the_bounds() {
        let (gene, eta) = (0.2, 3.0);
        let mut rng = rng();
        let mutated: Vec<f64> = (0..20_000)
            .map(|_| {
                let mut genes = [gene];
                mutate(&mut genes, 1.0, eta, &mut rng);
                genes[0]
            })
            .collect();
        assert!(mutated.iter().all(|gene| (0.0..=1.0).contains(gene)));
        // Half goes down and half up, each with the density (1 - |change|)^eta up to the bound.
        let free = |change: f64| 1.0 - libm::pow(1.0 - change, eta + 1.0);
        let cdf = |value: f64| match value < gene {
            true => 0.5 * (1.0 - free(gene - value) / free(gene)),
            false => 0.5 + 0.5 * free(value - gene) / free(1.0 - gene),
        };
        let statistic = ks_statistic(mutated, cdf);
        assert!(statistic < 1.95, "{statistic}");
    }

    #[test]
    fn as_many_genes_mutate_as_asked() {
        let mut genes = vec![0.5; 20_000];
        mutate(&mut genes, 0.1, 20.0, &mut rng());
        let share = genes.iter().filter(|gene| **gene != 0.5).count() as f64 / 20_000.0;
        assert!((share - 0.1).abs() < 0.01, "{share}");
    }
}
