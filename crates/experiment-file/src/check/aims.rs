//! Checks the aims: the algorithm learns from them, and its front is within its limit.

use super::descriptors::distinct;
use crate::report::{Path, Report};
use crate::{AlgorithmDescription, ExperimentConfig, LearnsFrom, limits};

/// An example for messages.
const EXAMPLE: &str = r#""aims": {"measure": "turning", "direction": "minimise"}"#;

pub(super) fn check(
    config: &ExperimentConfig,
    algorithm: Option<&AlgorithmDescription>,
    report: &Report<'_>,
) {
    let aims = &config.algorithm.aims;
    let path = Path::from(["algorithm", "aims"]);
    if let Some(algorithm) = algorithm {
        fit(config, algorithm, &path, report);
    }
    let measures: Vec<_> = aims.iter().map(|aim| (&aim.measure, aim.summarises)).collect();
    distinct(&measures, &path, "an aim", report);
}

/// Algorithm and aims belong together.
fn fit(
    config: &ExperimentConfig,
    algorithm: &AlgorithmDescription,
    path: &Path,
    report: &Report<'_>,
) {
    let name = algorithm.name;
    let name_path = Path::from(["algorithm", "name"]);
    if algorithm.learns_from != LearnsFrom::Aims {
        if !config.algorithm.aims.is_empty() {
            report.conflict(path, &[&name_path], || {
                format!("{name} knows no aims beside fitness; remove them, or take `NSGA-II`")
            });
        }
        return;
    }
    if config.algorithm.aims.is_empty() {
        report.conflict(&name_path, &[path], || {
            format!("{name} needs an aim beside fitness, for instance {EXAMPLE}")
        });
    }
    let (size, limit) = (config.algorithm.population_size, limits::ELITES);
    if size > limit {
        let size_path = Path::from(["algorithm", "population_size"]);
        report.conflict(&size_path, &[&name_path], || {
            format!("is {size}, but {name} takes at most {limit}, because a front may have as many elites")
        });
    }
}
