//! Explains the present activity of an experiment, or why it waits, from the engine and the
//! store.

use engine::JobActivity;

use crate::{
    driver::DriverEvent,
    ids::ExperimentId,
    memory::Shortage,
    queries::{self, QueryError},
    store::{Event, ExperimentRecord},
};

use super::{Control, ControlError};

/// The present activity of an experiment, or the reason why it waits.
#[derive(Debug)]
pub struct Explanation {
    /// The experiment.
    pub experiment: ExperimentRecord,
    /// The fleet's work for it.
    pub activity: JobActivity,
    /// The missing memory, if it waits for memory.
    pub shortage: Option<Shortage>,
    /// Its latest notices, oldest first.
    pub notices: Vec<Event>,
    /// Why the latest write failed, if it did.
    pub store_trouble: Option<String>,
    /// Why this program cannot compute it, if it cannot.
    pub incompatible: Option<String>,
}

impl Control {
    /// Explains an experiment.
    pub async fn explain(&self, id: ExperimentId) -> Result<Explanation, ControlError> {
        self.find(id).await?;
        let (activity, shortage) =
            self.ask(|reply| DriverEvent::ActivityRequested(id, reply)).await?;
        let read = self.store.read(move |store| {
            let experiment = queries::experiment(store, id)?;
            let notices = queries::latest_notices(store, &experiment)?;
            Ok::<_, QueryError>((experiment, notices))
        });
        let (experiment, notices) = read.await?;
        Ok(Explanation {
            incompatible: queries::incompatibility(&experiment),
            store_trouble: self.store.trouble(),
            experiment: experiment.record,
            activity,
            shortage,
            notices,
        })
    }
}
