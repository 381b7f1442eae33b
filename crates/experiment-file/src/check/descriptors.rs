//! Checks the descriptors: the algorithm learns from them, and they span a grid.

use crate::report::{Path, Report};
use crate::{
    AlgorithmDescription, DescriptorConfig, ExperimentConfig, Keeps, LearnsFrom, Summarises, limits,
};

/// An example for messages.
const EXAMPLE: &str =
    r#""descriptors": [{"measure": "turning", "range": [0, 1], "cells": 32}, ...]"#;

pub(super) fn check(
    config: &ExperimentConfig,
    algorithm: Option<&AlgorithmDescription>,
    report: &Report<'_>,
) {
    let descriptors = &config.algorithm.descriptors;
    let path = Path::from(["algorithm", "descriptors"]);
    if let Some(algorithm) = algorithm {
        fit(config, algorithm, &path, report);
        single_population(config, algorithm, report);
    }
    for (i, descriptor) in descriptors.iter().enumerate() {
        let path = path.index(i);
        let [low, high] = descriptor.range;
        if low >= high {
            let message = || format!("ends at {high}, not above its beginning {low}");
            report.conflict(&path.key("range"), &[], message);
        }
    }
    let measures: Vec<_> = descriptors.iter().map(|of| (&of.measure, of.summarises)).collect();
    distinct(&measures, &path, "a descriptor", report);
    let n_cells = DescriptorConfig::n_cells(descriptors);
    if n_cells > limits::ELITES.into() {
        let limit = limits::ELITES;
        let message = || format!("the grid has {n_cells} cells, the limit is {limit}");
        report.conflict(&path, &[], message);
    }
}

/// Refuses a measure that is in a list at `path` twice.
pub(super) fn distinct(
    measures: &[(&String, Summarises)],
    path: &Path,
    what: &str,
    report: &Report<'_>,
) {
    for (i, measure) in measures.iter().enumerate() {
        if measures[..i].contains(measure) {
            let path = path.index(i);
            let message = || format!("`{}` is {what} already", measure.0);
            report.conflict(&path.key("measure"), &[&path.key("of")], message);
        }
    }
}

/// Algorithm and descriptors belong together.
fn fit(
    config: &ExperimentConfig,
    algorithm: &AlgorithmDescription,
    path: &Path,
    report: &Report<'_>,
) {
    let name = algorithm.name;
    let name_path = Path::from(["algorithm", "name"]);
    if algorithm.learns_from != LearnsFrom::Descriptors {
        if !config.algorithm.descriptors.is_empty() {
            report.conflict(path, &[&name_path], || {
                format!("{name} knows no descriptors; remove them, or take `MAP-Elites` or `DNS`")
            });
        }
        return;
    }
    if config.algorithm.descriptors.is_empty() {
        report.conflict(&name_path, &[path], || {
            format!("{name} evolves behaviours that differ; say in what, for instance {EXAMPLE}")
        });
    }
}

/// Elites of a repertoire or of a front are whole robots.
fn single_population(
    config: &ExperimentConfig,
    algorithm: &AlgorithmDescription,
    report: &Report<'_>,
) {
    let name = algorithm.name;
    let name_path = Path::from(["algorithm", "name"]);
    let n_populations = config.algorithm.populations.len();
    if algorithm.keeps == Keeps::Repertoire && n_populations > 1 {
        let populations = Path::from(["algorithm", "populations"]);
        report.conflict(&populations, &[&name_path], || {
            format!(
                "{name} evolves a single population, not {n_populations}, because an elite is a \
                 whole robot; move all `objects` into one population"
            )
        });
    }
}
