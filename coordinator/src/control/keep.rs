//! Housekeeping of experiments: delete, archive, label.

use crate::{
    ids::ExperimentId,
    labels::{self, Labels},
    queries,
    store::ExperimentRecord,
};

use super::{Control, ControlError};

impl Control {
    /// Deletes an experiment that has ended. Returns its last state, and the number of free bytes
    /// in the database.
    pub async fn delete(&self, id: ExperimentId) -> Result<(ExperimentRecord, u64), ControlError> {
        let experiment = self.ended(id, "delete").await?;
        let n_bytes = self.store.try_write(move |store| store.delete(id)).await?;
        Ok((experiment, n_bytes))
    }

    /// Marks an experiment that has ended as archived, or removes the mark. Returns the
    /// experiment, and the size of its fitness log in bytes.
    pub async fn archive(
        &self,
        id: ExperimentId,
        is_archived: bool,
    ) -> Result<(ExperimentRecord, u64), ControlError> {
        self.ended(id, "archive").await?;
        self.store.try_write(move |store| store.set_archived(id, is_archived)).await?;
        let n_bytes = self.store.read(move |store| store.log_len(id)).await?;
        Ok((self.find(id).await?, n_bytes))
    }

    /// Adds, changes and removes labels of an experiment.
    pub async fn label(
        &self,
        id: ExperimentId,
        set: Labels,
        remove: Vec<String>,
    ) -> Result<ExperimentRecord, ControlError> {
        self.check_and_write(move |store| {
            let mut labels = queries::experiment(store, id)?.record.labels;
            labels.retain(|key, _| !remove.contains(key));
            labels.extend(set);
            labels::check(&labels).map_err(ControlError::Invalid)?;
            Ok(store.set_labels(id, &labels)?)
        })
        .await?;
        self.find(id).await
    }

    /// An experiment, if it has ended. `what`: the verb for the error message.
    async fn ended(&self, id: ExperimentId, what: &str) -> Result<ExperimentRecord, ControlError> {
        let experiment = self.find(id).await?;
        match experiment.state.is_unfinished() {
            false => Ok(experiment),
            true => Err(ControlError::NotNow(format!(
                "experiment {id} has not ended; to {what} it, end it first: swarmctl cancel {id}"
            ))),
        }
    }
}
