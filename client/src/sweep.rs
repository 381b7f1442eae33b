//! Sweeps: the runs of one experiment file with several seeds and values.

use std::{collections::BTreeSet, fmt, str::FromStr};

use clap::Args;
use clap_complete::ArgValueCompleter;
use experiment_file::{ConfigError, ExperimentConfig, Problem};
use indexmap::IndexMap;
use model::group::Membership;
use sha2::{Digest as _, Sha256};
use swarm_proto::v1::SubmitExperimentRequest;

use crate::{
    args::{ExperimentArgs, Label},
    change::{Change, SetArg},
    complete,
    error::{Code, Error},
    experiment_file::{ExperimentFile, Overrides, random_request_id},
    interrupt, json,
};

/// Maximum number of runs of one sweep: the limit of a coordinator for unfinished
/// experiments.
const RUNS_MAX: usize = model::limits::UNFINISHED_MAX;

/// Options that turn one experiment file into several runs.
#[derive(Debug, Clone, Default, Args)]
pub struct SweepArgs {
    /// Run the experiment once with each of these seeds, as a group of runs. `0..4` means
    /// five seeds, both ends included.
    #[arg(long, value_name = "FIRST..LAST|S,...", conflicts_with = "seed")]
    pub seeds: Option<Seeds>,
    #[command(flatten)]
    pub set: SetArg,
    /// Name of the group [default: the name of the experiment, if there are several runs]
    #[arg(long, value_name = "NAME", add = ArgValueCompleter::new(complete::groups))]
    pub group: Option<String>,
}

/// A set of seeds, in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds(Vec<u64>);

impl FromStr for Seeds {
    type Err = String;

    /// Reads `3`, `0..4`, `1,5,8..9`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut seeds = BTreeSet::new();
        for part in text.split(',') {
            let number = |text: &str| -> Result<u64, String> {
                text.trim()
                    .parse()
                    .map_err(|_| format!("`{part}` is neither a seed nor FIRST..LAST"))
            };
            let (first, last) = match part.split_once("..") {
                Some((first, last)) => (number(first)?, number(last)?),
                None => (number(part)?, number(part)?),
            };
            if last < first {
                return Err(format!("`{part}` ends before it begins"));
            }
            if last - first >= RUNS_MAX as u64 {
                return Err(format!("`{part}` has more than {RUNS_MAX} seeds"));
            }
            seeds.extend(first..=last);
            if seeds.len() > RUNS_MAX {
                return Err(format!("more than {RUNS_MAX} seeds"));
            }
        }
        Ok(Self(seeds.into_iter().collect()))
    }
}

impl fmt::Display for Seeds {
    /// Writes what [`Seeds::from_str`] reads, such as `1,5..9`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The seeds ascend, so the first of two is below the maximum.
        let spans = self.0.chunk_by(|seed, next| seed + 1 == *next);
        for (i, span) in spans.enumerate() {
            let separator = if i == 0 { "" } else { "," };
            match span {
                [first, .., last] => write!(f, "{separator}{first}..{last}")?,
                rest => rest.iter().try_for_each(|seed| write!(f, "{separator}{seed}"))?,
            }
        }
        Ok(())
    }
}

/// One run of a sweep, checked.
#[derive(Debug)]
pub struct SweepRun {
    pub file: ExperimentFile,
    pub request: SubmitExperimentRequest,
}

impl SweepRun {
    /// The group that it belongs to, if any.
    pub fn group(&self) -> Option<&str> {
        Some(&*self.request.group).filter(|group| !group.is_empty())
    }
}

/// All runs that the arguments request, or every mistake in them. A single run belongs to
/// a group only if the arguments name the group or a set of seeds.
pub fn runs(args: &ExperimentArgs) -> Result<Vec<SweepRun>, Error> {
    let file = args.file()?;
    let invalid = |error: ConfigError| file.invalid(&error);
    let overrides = args.overrides();
    let seeds: Vec<Option<u64>> = match &args.sweep.seeds {
        Some(Seeds(seeds)) => seeds.iter().copied().map(Some).collect(),
        None => vec![overrides.seed],
    };
    let variants = variants(&args.sweep.set.set, RUNS_MAX / seeds.len())?;
    let is_group = args.sweep.group.is_some() || args.sweep.seeds.is_some() || variants.len() > 1;
    let mut runs = Vec::new();
    // A problem of several variants is reported once.
    let mut problems: IndexMap<String, (Problem, Vec<&str>)> = IndexMap::new();
    for variant in &variants {
        let checked = file.changed(&variant.changes).and_then(|file| {
            let config = file.check(&overrides)?.config;
            Ok((file, config))
        });
        match checked {
            Err(error) => {
                for problem in error.problems {
                    let same = problems.entry(problem.to_string());
                    same.or_insert_with(|| (problem, Vec::new())).1.push(&variant.name);
                }
            }
            Ok((file, config)) => {
                for &seed in &seeds {
                    let overrides = Overrides { seed, ..overrides };
                    let mut request = file.request(&overrides, random_request_id("submit"));
                    let labels = args.labels.iter().cloned();
                    request.labels = labels.map(|Label { key, value }| (key, value)).collect();
                    if is_group {
                        let config = overrides.apply(config.clone()).map_err(invalid)?;
                        join(&mut request, &config, args.sweep.group.as_deref(), &variant.name)?;
                    }
                    runs.push(SweepRun { file: file.clone(), request });
                }
            }
        }
    }
    if !interrupt::goes_on() {
        return Err(interrupt::error());
    }
    if !problems.is_empty() {
        let problems = problems.into_values().map(|(mut problem, names)| {
            // A problem of a changed value names the value.
            let mut changes = variants.iter().flat_map(|variant| &variant.changes);
            let is_of_value = changes.any(|change| change.path == problem.path);
            if names.len() < variants.len() && !is_of_value {
                problem.message += &format!(" (with {})", first_few(&names));
            }
            problem
        });
        return Err(invalid(ConfigError { problems: problems.collect() }));
    }
    Ok(runs)
}

/// The first names, and the number of further ones.
fn first_few(names: &[&str]) -> String {
    match names {
        [first, _, _, ..] => format!("{first} and {} others", names.len() - 1),
        few => few.join(" and "),
    }
}

/// Turns a request into that of a run of a group: repeating the request returns the
/// existing run.
fn join(
    request: &mut SubmitExperimentRequest,
    config: &ExperimentConfig,
    group: Option<&str>,
    variant: &str,
) -> Result<(), Error> {
    let group = group.unwrap_or(&config.name);
    Membership::new(group, variant)
        .map_err(|problem| format!("{problem}; name it with --group"))
        .map_err(|problem| Error::at(Code::BadArgument, "--group", problem))?;
    let (simulation, config) = (sim_core::FINGERPRINT, config.to_canonical_json());
    let identity = json::line(&[group, simulation, &config]);
    let digest: [u8; 16] = Sha256::digest(identity)[..16].try_into().expect("it has 32");
    request.request_id = format!("group-{:032x}", u128::from_be_bytes(digest));
    (request.group, request.variant) = (group.to_owned(), variant.to_owned());
    Ok(())
}

/// A combination of values.
#[derive(Debug, Clone, Default, PartialEq)]
struct Variant {
    /// The changes that differ between variants; empty if there is one variant.
    name: String,
    changes: Vec<Change>,
}

/// All combinations of the values of `--set`, or the problems of each.
fn variants(set: &[String], n_max: usize) -> Result<Vec<Variant>, Error> {
    let (mut axes, mut problems) = (Vec::new(), Vec::new());
    for text in set {
        match Change::parse_axes(text) {
            Ok(of_text) => axes.extend(of_text),
            Err(problem) => problems.push(format!("--set {problem}")),
        }
    }
    for (i, axis) in axes.iter().enumerate() {
        let path = &axis[0].path;
        if axes[..i].iter().any(|other| other[0].path == *path) {
            problems.push(format!("--set {path} is given twice"));
        }
        if path == "seed" {
            problems.push("--set seed: give --seeds instead".to_owned());
        }
    }
    if !problems.is_empty() {
        return Err(Error::at(Code::BadArgument, "--set", problems.join("\n")));
    }
    let mut variants = vec![Variant::default()];
    for axis in &axes {
        let with = |variant: &Variant, change: &Change| {
            let mut variant = variant.clone();
            if axis.len() > 1 {
                let separator = if variant.name.is_empty() { "" } else { "; " };
                variant.name += &format!("{separator}{change}");
            }
            variant.changes.push(change.clone());
            variant
        };
        if variants.len() * axis.len() > n_max {
            let message = format!("these are more than {RUNS_MAX} runs, the maximum of a group");
            return Err(Error::at(Code::BadArgument, "--set", message));
        }
        variants = variants
            .iter()
            .flat_map(|variant| axis.iter().map(move |change| with(variant, change)))
            .collect();
    }
    Ok(variants)
}

#[cfg(test)]
mod tests;
