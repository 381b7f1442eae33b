//! The descriptors of an experiment, by the places of their measures.

use crate::problems::Problems;
use crate::record::MeasureName;
use experiment_file::{DescriptorConfig, Summarises, suggestion};

/// A descriptor of a trial.
#[derive(Debug, Clone)]
pub(crate) struct Descriptor {
    /// The measure.
    pub measure: MeasureName,
    /// Which value of a trial counts.
    pub summarises: Summarises,
}

/// Finds the measures of descriptors. `names`: those of the task.
pub(crate) fn compile(
    descriptors: &[DescriptorConfig],
    names: &[MeasureName],
    problems: &mut Problems,
) -> Vec<Descriptor> {
    let mut compiled = Vec::new();
    for (i, descriptor) in descriptors.iter().enumerate() {
        let DescriptorConfig { measure, summarises, .. } = descriptor;
        match names.iter().find(|name| *name == measure) {
            Some(name) => {
                compiled.push(Descriptor { measure: name.clone(), summarises: *summarises });
            }
            None => {
                let known: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
                problems.add(
                    format!("algorithm.descriptors[{i}].measure"),
                    match known[..] {
                        [] => format!(
                            "the task has no measures, so none is named `{measure}`; a function \
                             `measures` of the script defines them"
                        ),
                        _ => format!(
                            "the task has no measure `{measure}`; {}",
                            suggestion(measure, &known)
                        ),
                    },
                );
            }
        }
    }
    compiled
}
