//! The genotype: queries that match something, once; their bounds; operators.

use crate::report::{Path, Report};
use crate::{
    AlgorithmConfig, AlgorithmParams, ExperimentConfig, GenotypeQuery, NeuronParameter,
    PopulationConfig, limits,
};

use super::coverage::Coverage;

pub(super) fn check(config: &ExperimentConfig, report: &Report<'_>) {
    let populations = &config.algorithm.populations;
    let populations_path = Path::from(["algorithm", "populations"]);
    let n_queries: usize = populations.values().map(|population| population.objects.len()).sum();
    if n_queries > limits::QUERIES {
        let limit = limits::QUERIES;
        let message = || format!("has {n_queries} queries, the limit is {limit}");
        return report.conflict(&populations_path, &[], message);
    }
    let mut coverage = Coverage::new(&config.topology);
    for (name, population) in populations {
        let path = populations_path.key(name);
        for (i, query) in population.objects.iter().enumerate() {
            coverage.claim(query, name, &path.key("objects").index(i), report);
        }
        bounds(population, config.topology.dt, &path, report);
        operators(&config.algorithm, population, &path, report);
    }
}

fn bounds(population: &PopulationConfig, dt: f64, path: &Path, report: &Report<'_>) {
    let bounds = population.min_vals.iter().zip(&population.max_vals);
    for (i, (query, (&min, &max))) in population.objects.iter().zip(bounds).enumerate() {
        let query_path = path.key("objects").index(i);
        let min_path = path.key("min_vals").index(i);
        let max_path = path.key("max_vals").index(i);
        if max <= min {
            report.conflict(&max_path, &[&min_path, &query_path], || {
                format!("the maximum {max} of `{query}` is not above its minimum {min}")
            });
        }
        if !matches!(query, GenotypeQuery::Neurons(NeuronParameter::Tau, _)) {
            continue;
        }
        // The bounds of tau are exponents.
        let (shortest, longest) = (2.0 * libm::exp10(min), 2.0 * libm::exp10(max));
        if shortest < dt / 2.0 {
            let dt_path = Path::from(["topology", "dt"]);
            report.conflict(&min_path, &[&dt_path, &query_path], || {
                format!("tau = 2 * 10^{min} s is below dt / 2: the network would be unstable")
            });
        }
        if longest > limits::MAGNITUDE {
            let limit = limits::MAGNITUDE;
            let message = || format!("tau = 2 * 10^{max} s is above the limit of {limit} s");
            report.conflict(&max_path, &[&query_path], message);
        }
    }
}

fn operators(
    algorithm: &AlgorithmConfig,
    population: &PopulationConfig,
    path: &Path,
    report: &Report<'_>,
) {
    let size = algorithm.population_size;
    let size_path = Path::from(["algorithm", "population_size"]);
    match &population.params {
        AlgorithmParams::Ga(params) if params.num_elite >= size => {
            let path = path.key("params").key("num_elite");
            let others = [&size_path, &Path::from(["algorithm", "name"])];
            report.conflict(&path, &others, || {
                let num_elite = params.num_elite;
                format!("`num_elite` {num_elite} leaves no room in a population of {size}")
            });
        }
        AlgorithmParams::CmaEs(_) | AlgorithmParams::OpenAiEs(_) if size < 2 => {
            report.conflict(&size_path, &[], "this algorithm needs at least 2 individuals");
        }
        _ => {}
    }
}
