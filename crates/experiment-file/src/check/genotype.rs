//! Checks the genotype: every query matches something, no two queries match the same part, and
//! bounds and operators are valid.

use crate::report::{Path, Report};
use crate::{
    AlgorithmDescription, Domain, ExperimentConfig, GenotypeQuery, ParameterValue,
    PopulationConfig, TopologyConfig, limits,
};

use super::coverage::ParameterCoverage;

pub(super) fn check(
    config: &ExperimentConfig,
    algorithm: Option<&AlgorithmDescription>,
    report: &Report<'_>,
) {
    let populations = &config.algorithm.populations;
    let populations_path = Path::from(["algorithm", "populations"]);
    let n_queries: usize = populations.values().map(|population| population.objects.len()).sum();
    if n_queries > limits::QUERIES {
        let limit = limits::QUERIES;
        let message = || format!("has {n_queries} queries, the limit is {limit}");
        return report.conflict(&populations_path, &[], message);
    }
    let population_size = config.algorithm.population_size;
    let individuals_min = algorithm.map_or(1, |algorithm| algorithm.individuals_min);
    let path = Path::from(["algorithm", "population_size"]);
    if population_size >= individuals_min
        && let Some(advice) = algorithm.and_then(|algorithm| algorithm.advice(population_size))
    {
        report.warning(&path, advice);
    }
    if population_size < individuals_min {
        let message = || format!("this algorithm needs at least {individuals_min} individuals");
        report.conflict(&path, &[], message);
    }
    let mut coverage = ParameterCoverage::new(&config.topology);
    for (name, population) in populations {
        let path = populations_path.key(name);
        for (i, query) in population.objects.iter().enumerate() {
            coverage.claim(query, name, &path.key("objects").index(i), report);
        }
        bounds(population, &config.topology, &path, report);
        if let Some(algorithm) = algorithm {
            sizes(algorithm, population_size, population, &path, report);
        }
    }
}

/// Bounds are in order, and their decoded values are within the range of the parameter.
fn bounds(
    population: &PopulationConfig,
    topology: &TopologyConfig,
    path: &Path,
    report: &Report<'_>,
) {
    let [model, neurons, dt] =
        ["neuron_model", "neurons", "dt"].map(|key| Path::from(["topology", key]));
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
        if let GenotypeQuery::Delays(_) = query {
            let (low, high) = (*limits::DELAYS.start(), *limits::DELAYS.end());
            let is_delay = |bound: f64| (f64::from(low)..=f64::from(high)).contains(&bound);
            for (bound, path) in [(min, &min_path), (max, &max_path)] {
                if !is_delay(bound) {
                    report.conflict(path, &[&query_path], || {
                        format!("delays are from {low} to {high} substeps, not {bound}")
                    });
                }
            }
        }
        if let GenotypeQuery::Learning(_) = query {
            for (bound, path) in [(min, &min_path), (max, &max_path)] {
                let limit = limits::COEFFICIENT;
                if bound.abs() > limit {
                    report.conflict(path, &[&query_path], || {
                        format!("coefficients are from -{limit} to {limit}, not {bound}")
                    });
                }
            }
        }
        let GenotypeQuery::Neurons(name, _) = query else { continue };
        let Some(parameter) = topology.neuron_model.spec().parameter(name) else { continue };
        let Some(scale) = parameter.gene else { continue };
        let shown = |bound: f64| parameter.with_unit(format!("{name} = {}", scale.formula(bound)));
        let (lowest, highest) = (scale.value(min), scale.value(max));
        let (low, high) = (*parameter.range().start(), *parameter.range().end());
        if parameter.is_time_constant && lowest < topology.dt / 2.0 {
            report.conflict(&min_path, &[&dt, &model, &neurons, &query_path], || {
                format!("{} is below dt / 2: the network would be unstable", shown(min))
            });
        } else if lowest < low {
            report.conflict(&min_path, &[&model, &neurons, &query_path], || {
                format!("{} is below the limit of {}", shown(min), parameter.with_unit(low))
            });
        }
        if highest > high {
            report.conflict(&max_path, &[&model, &neurons, &query_path], || {
                format!("{} is above the limit of {}", shown(max), parameter.with_unit(high))
            });
        }
    }
}

/// Parameters that must be below the number of individuals.
fn sizes(
    algorithm: &AlgorithmDescription,
    population_size: u32,
    population: &PopulationConfig,
    path: &Path,
    report: &Report<'_>,
) {
    let size_path = Path::from(["algorithm", "population_size"]);
    for parameter in algorithm.parameters {
        let Some(value) = population.params.get(parameter) else {
            continue;
        };
        if let (Domain::BelowPopulationSize, ParameterValue::Whole(number)) =
            (parameter.domain, &value)
            && !parameter.domain.contains(&value, population_size)
        {
            let key = parameter.key;
            let path = path.key("params").key(key);
            let others = [&size_path, &Path::from(["algorithm", "name"])];
            report.conflict(&path, &others, || {
                format!("`{key}` {number} leaves no room in a population of {population_size}")
            });
        }
    }
}
