//! Experiments whose files differ only in the order of their keys: they are different
//! experiments.

use std::cmp::Reverse;

use evolution::Digest;
use experiment_file::ExperimentConfig;
use serde_json::Value;
use swarm_proto::v1::{Experiment, ExperimentState, ListExperimentsRequest};

use crate::{connection::Connection, text};

/// Maximum number of files that are compared with those of a submission.
const COMPARED_MAX: usize = 16;

/// Explains why a submission is computed again if the file of an earlier experiment differs only
/// in the order of its keys. Names the first such experiment.
pub async fn remark(connection: &Connection, submitted: &[Experiment]) -> Option<String> {
    let first = submitted.first()?;
    // The submission succeeded, even if this remark fails.
    let states = [ExperimentState::Completed, ExperimentState::Running, ExperimentState::Paused];
    let states = states.map(Into::into).to_vec();
    let wanted = ListExperimentsRequest { states, ..Default::default() };
    let mut earlier = connection.list(wanted).await.ok()?;
    earlier.retain(|experiment| may_be_reordered(experiment, first));
    if earlier.is_empty() {
        return None;
    }
    earlier.sort_by_key(|experiment| Reverse(experiment.id));
    let file = without_order(&connection.stored(first.id).await.ok()?.1)?;
    for other in earlier.iter().take(COMPARED_MAX) {
        if without_order(&connection.stored(other.id).await.ok()?.1)? == file {
            return Some(format!(
                "{} has this file with its keys in another order; the order of ensembles, \
                 synapses and objects is the order of genes and random draws, so experiment {} is \
                 computed separately",
                text::title(other),
                first.id
            ));
        }
    }
    None
}

/// Whether an experiment could have the same file as a later one, except for the order.
fn may_be_reordered(earlier: &Experiment, later: &Experiment) -> bool {
    earlier.id < later.id
        && (&earlier.name, earlier.seed) == (&later.name, later.seed)
        && earlier.config_digest != later.config_digest
        && earlier.forked_from.is_none()
}

/// The content of a file in canonical form, without the order of its keys, and without the length
/// of the run, which no digest covers.
fn without_order(config_json: &str) -> Option<Value> {
    let config = ExperimentConfig::from_canonical_json(config_json).ok()?;
    serde_json::to_value(Digest::covered(config)).ok()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::json;

    use super::{super::tests::one_world::output, *};
    use crate::{
        experiment_file::tests::quickstart,
        place::{Intent, Place},
    };

    /// The text of the quickstart with its objects' keys in reverse order.
    fn reversed(text: &str) -> String {
        fn write(value: &Value) -> String {
            match value {
                Value::Object(map) => {
                    let entries =
                        map.iter().map(|(key, value)| (json!(key).to_string(), write(value)));
                    let mut entries: Vec<_> = entries.collect();
                    entries.sort();
                    let entries = entries.iter().rev().map(|(key, value)| format!("{key}:{value}"));
                    format!("{{{}}}", entries.collect::<Vec<_>>().join(","))
                }
                other => other.to_string(),
            }
        }
        write(&serde_json::from_str(text).unwrap())
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_reordered_file_is_remarked_on_and_another_file_is_not() {
        let temporary = tempfile::tempdir().unwrap();
        let data = temporary.path().join("data");
        let text = fs::read_to_string(quickstart()).unwrap();
        let longer = text.replace("\"evaluation_steps\": 100", "\"evaluation_steps\": 99");
        assert_ne!(longer, text);
        for (index, text) in [&text, &longer, &reversed(&text)].into_iter().enumerate() {
            let file = temporary.path().join(format!("{index}.json"));
            fs::write(&file, text).unwrap();
            let line = format!("run {} --generations {}", file.display(), index + 1);
            output(&line, &["--data-dir", data.to_str().unwrap()]).await;
        }
        let place = Place::Directory { path: data, is_found: false };
        let connection = Connection::to(place, Intent::Submit).await.unwrap();
        let mut experiments = connection.experiments().await.unwrap();
        experiments.sort_by_key(|experiment| experiment.id);
        let [first, longer, reordered] = &experiments[..] else { panic!("{experiments:?}") };
        for other in [first, longer] {
            assert_eq!(remark(&connection, std::slice::from_ref(other)).await, None);
        }
        let said = remark(&connection, std::slice::from_ref(reordered)).await.unwrap();
        connection.close().await;
        let expected = "experiment 1 (quickstart) has this file with its keys in another order";
        assert!(said.starts_with(expected) && said.contains("so experiment 3 is"), "{said}");
    }
}
