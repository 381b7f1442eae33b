//! The descriptors of an experiment, or the values of its aims, by the places of their measures.

use crate::problems::Problems;
use crate::record::MeasureName;
use experiment_file::{LearntMeasure, Summarises, suggestion};

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
    descriptors: Vec<LearntMeasure<'_>>,
    names: &[MeasureName],
    problems: &mut Problems,
) -> Vec<Descriptor> {
    let mut compiled = Vec::new();
    for LearntMeasure { path, measure, summarises } in descriptors {
        match names.iter().find(|name| name.as_ref() == measure) {
            Some(name) => {
                compiled.push(Descriptor { measure: name.clone(), summarises });
            }
            None => {
                let known: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
                problems.add(
                    path,
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
