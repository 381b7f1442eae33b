//! Mutation: genes change at random.

use determinism::random::Stream;
use experiment_file::{DefaultValue, Domain, Parameter, ParameterValue, Params};
use serde::{Deserialize, Serialize};

/// A mutation operator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Mutation {
    /// g + N(0, sigma^2) (Eq. 2.12).
    Gaussian {
        /// Standard deviation.
        sigma: f64,
    },
    /// U(0, 1), whatever the gene was.
    Uniform,
    /// 1 - g, which turns 0 into 1 and 1 into 0.
    BitFlip,
    /// One of 0, 1/n, ..., (n - 1)/n, equally likely, whatever the gene was.
    Categorical {
        /// n.
        categories: u32,
    },
}

/// Chooses among the variants of [`Mutation`], in their order.
pub const OPERATOR: Parameter = Parameter::one_of(
    "mutation_operator",
    &["gaussian", "uniform", "bitflip", "categorical"],
    &[],
    "How a gene mutates",
);
/// Its default is sqrt(0.3), Table 3.4 of the thesis.
pub const SIGMA: Parameter = Parameter::amount(
    "mutation_sigma",
    0.547_722_557_505_166_1,
    "Standard deviation of `gaussian` mutation. The default is sqrt(0.3)",
);

/// If the bounds of a parameter differ by the number of categories, its values are whole numbers.
/// The canonical form omits the default, because digests of older runs lack this key.
pub const CATEGORIES: Parameter = Parameter::of(
    "mutation_categories",
    Domain::Whole(2, 1_000_000),
    DefaultValue::Formula("2"),
    "Number of values of a gene that `categorical` mutation chooses from",
);

impl Mutation {
    /// The configured operator.
    pub fn new(params: &Params) -> Self {
        match params.value_of::<String>(&OPERATOR).as_str() {
            "gaussian" => Self::Gaussian { sigma: params.value_of(&SIGMA) },
            "uniform" => Self::Uniform,
            "bitflip" => Self::BitFlip,
            "categorical" => Self::Categorical {
                categories: match params.get(&CATEGORIES) {
                    Some(ParameterValue::Whole(categories)) => categories,
                    _ => 2,
                },
            },
            other => unreachable!("`{other}` is none of the names in the domain"),
        }
    }

    /// Mutates each gene with probability `p`; the result may lie outside
    /// \[0, 1\].
    pub fn mutate(self, genotype: &mut [f64], p: f64, rng: &mut Stream) {
        for gene in genotype {
            if rng.bernoulli(p) {
                match self {
                    Self::Gaussian { sigma } => *gene += sigma * rng.normal(),
                    Self::Uniform => *gene = rng.uniform(),
                    Self::BitFlip => *gene = 1.0 - *gene,
                    Self::Categorical { categories } => {
                        let category = rng.below(categories as usize);
                        *gene = category as f64 / f64::from(categories);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use determinism::random::Purpose;

    use super::*;

    const N: usize = 100_000;

    fn mutated(mutation: Mutation, p: f64) -> Vec<f64> {
        let mut genes = vec![0.5; N];
        mutation.mutate(&mut genes, p, &mut Stream::new(4, 0, 0, Purpose::Evolution, 0));
        genes.retain(|&gene| gene != 0.5);
        genes
    }

    fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
        values.clone().sum::<f64>() / values.count() as f64
    }

    #[test]
    fn each_gene_mutates_with_the_given_probability() {
        let mutations = [
            Mutation::Gaussian { sigma: 0.5 },
            Mutation::Uniform,
            // With an odd number, 0.5 is no category, so every mutation changes the gene.
            Mutation::Categorical { categories: 7 },
        ];
        for mutation in mutations {
            for p in [0.0, 0.05, 0.5, 1.0] {
                let share = mutated(mutation, p).len() as f64 / N as f64;
                assert!((share - p).abs() < 0.006, "{mutation:?} {p}: {share}");
            }
        }
    }

    #[test]
    fn gaussian_mutation_has_its_mean_and_variance() {
        let sigma = 0.3_f64.sqrt();
        let genes = mutated(Mutation::Gaussian { sigma }, 1.0);
        let change = genes.iter().map(|gene| gene - 0.5);
        assert!(mean(change.clone()).abs() < 0.006);
        let variance = mean(change.clone().map(|x| x * x));
        let kurtosis = mean(change.map(|x| x * x * x * x)) / (variance * variance);
        assert!((variance - 0.3).abs() < 0.006, "{variance}");
        assert!((kurtosis - 3.0).abs() < 0.1, "{kurtosis}");
    }

    #[test]
    fn flipped_bits_are_bits_and_two_flips_restore_them() {
        let mut genes = [0.0, 1.0, 0.25];
        let mut rng = Stream::new(4, 0, 0, Purpose::Evolution, 0);
        Mutation::BitFlip.mutate(&mut genes, 1.0, &mut rng);
        assert_eq!(genes, [1.0, 0.0, 0.75]);
        Mutation::BitFlip.mutate(&mut genes, 1.0, &mut rng);
        assert_eq!(genes, [0.0, 1.0, 0.25]);
        Mutation::BitFlip.mutate(&mut genes, 0.0, &mut rng);
        assert_eq!(genes, [0.0, 1.0, 0.25]);
    }

    /// Bounds 2 and 7 turn the categories into the whole numbers from 2 to 6, as in the original.
    #[test]
    fn categories_are_equally_likely_and_exclude_the_upper_bound() {
        let genes = mutated(Mutation::Categorical { categories: 5 }, 1.0);
        let mut counts = [0_i32; 5];
        for gene in &genes {
            let value = 2.0 + 5.0 * gene;
            assert!((value - value.round()).abs() < 1e-12, "{value}");
            counts[value.round() as usize - 2] += 1;
        }
        // Five standard deviations.
        assert!(counts.iter().all(|count| (count - N as i32 / 5).abs() < 633), "{counts:?}");
    }

    #[test]
    fn uniform_mutation_forgets_the_gene() {
        let genes = mutated(Mutation::Uniform, 1.0);
        assert!(genes.iter().all(|gene| (0.0..1.0).contains(gene)));
        let mut counts = [0.0; 10];
        genes.iter().for_each(|gene| counts[(gene * 10.0) as usize] += 1.0);
        let expected = genes.len() as f64 / 10.0;
        let chi_squared: f64 =
            counts.iter().map(|count| (count - expected) * (count - expected) / expected).sum();
        assert!(chi_squared < 27.9, "9 degrees of freedom, p = 0.001: {chi_squared}");
    }
}
