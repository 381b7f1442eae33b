//! Measures the effect of f32 networks on fitness: 200 genotypes per experiment, with the
//! simulator and with the reference, which computes in f64 throughout.
//!
//! A trajectory follows its reference until a number falls on the other side of a threshold or a
//! draw; from then on, it is another sample of the same process. So single values may differ, but
//! their distribution must not.

#[allow(dead_code, unused_imports, reason = "the tests need more of it")]
#[path = "../tests/configs/mod.rs"]
mod configs;
#[allow(dead_code, unused_imports, reason = "the tests need more of it")]
#[path = "../tests/reference/mod.rs"]
mod reference;

use determinism::random::{Purpose, Stream};
use sim_core::Simulation;

use configs::{experiment_a, experiment_b, experiment_c, experiment_d};

const N_GENOTYPES: u64 = 200;
/// Differences below this are rounding, not another trajectory.
const SAME_TRAJECTORY: f64 = 1e-5;

fn main() {
    println!(
        "{:4} {:>16} {:>20} {:>20} {:>22} {:>12}",
        "", "same trajectory", "mean (f32 network)", "mean (f64)", "mean difference", "correlation"
    );
    for config in [experiment_a(), experiment_b(), experiment_c(), experiment_d()] {
        let simulation = Simulation::compile(&config).expect("the configuration is valid");
        let fitness: Vec<(f64, f64)> = (0..N_GENOTYPES)
            .map(|seed| {
                let mut stream = Stream::new(seed, 0, 0, Purpose::Evolution, 0);
                let n_genes = simulation.genotype_len();
                let genotype: Vec<f64> = (0..n_genes).map(|_| stream.uniform()).collect();
                let fitness =
                    simulation.evaluate(&genotype, seed, 0..1).expect("the genotype is valid");
                (fitness[0], reference::run(&config, &genotype, seed, 0).fitness)
            })
            .collect();
        let same = fitness.iter().filter(|(a, b)| (a - b).abs() < SAME_TRAJECTORY).count();
        let (single, double): (Vec<f64>, Vec<f64>) = fitness.iter().copied().unzip();
        let differences: Vec<f64> = fitness.iter().map(|(a, b)| a - b).collect();
        println!(
            "{:4} {:>10} of {N_GENOTYPES} {:>20.6} {:>20.6} {:>11.6} +- {:.6} {:>12.6}",
            config.name,
            same,
            mean(&single),
            mean(&double),
            mean(&differences),
            standard_error(&differences),
            correlation(&single, &double),
        );
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn covariance(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).sum::<f64>() / a.len() as f64
}

fn standard_error(values: &[f64]) -> f64 {
    (covariance(values, values) / (values.len() - 1) as f64).sqrt()
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    covariance(a, b) / (covariance(a, a) * covariance(b, b)).sqrt()
}
