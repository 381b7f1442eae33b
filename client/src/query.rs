//! The commands that ask one question: `list`, `cancel`, `champion`.

use swarm_proto::v1::GetChampionResponse;

use crate::{
    args::OutputFormat, connection::Connection, error::Error, json, progress::Progress, text,
};

/// `swarmctl list`
pub async fn list(connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
    let experiments = connection.experiments().await?;
    progress.print(&match progress.format() {
        OutputFormat::Text => text::table(&experiments),
        OutputFormat::Json => {
            let experiments: Vec<json::ExperimentDocument<'_>> =
                experiments.iter().map(Into::into).collect();
            json::document(&experiments)
        }
    })
}

/// `swarmctl cancel`
pub async fn cancel(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<(), Error> {
    let experiment = connection.cancel(experiment_id).await?;
    progress.print(&match progress.format() {
        OutputFormat::Text => text::cancelled(&experiment),
        OutputFormat::Json => json::document(&json::ExperimentDocument::from(&experiment)),
    })
}

/// `swarmctl champion`; JSON in any case.
pub async fn champion(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<(), Error> {
    let champion = connection.champion(experiment_id).await?;
    progress.print(&champion_document(&champion)?)
}

/// A champion as `champion` prints it and `run` stores it.
pub fn champion_document(champion: &GetChampionResponse) -> Result<String, Error> {
    let document = json::ChampionDocument::new(champion).map_err(|error| {
        Error::Internal(format!("the coordinator's network is not JSON: {error}"))
    })?;
    Ok(json::document(&document))
}

#[cfg(test)]
mod tests {
    use swarm_proto::v1::Experiment;

    use super::*;
    use crate::{
        fake_coordinator::{FakeCoordinator, Script},
        progress::tests::Captured,
    };

    #[tokio::test]
    async fn questions_have_answers_in_json_and_exit_codes() {
        let (fake, connection) = FakeCoordinator::serve(Script {
            experiment: Experiment { id: 3, name: "a".into(), ..Experiment::default() },
            ..Script::default()
        })
        .await;
        let captured = Captured::default();
        let mut progress = captured.progress(OutputFormat::Json);
        list(&connection, &mut progress).await.unwrap();
        let listed: serde_json::Value = serde_json::from_str(&captured.lines().join("\n")).unwrap();
        assert_eq!(listed[0]["name"], "a");

        assert_eq!(cancel(&connection, 9, &mut progress).await.unwrap_err().exit_code(), 3);
        cancel(&connection, 3, &mut progress).await.unwrap();

        let no_champion = champion(&connection, 3, &mut progress).await.unwrap_err();
        assert_eq!(no_champion.exit_code(), 3);
        fake.script(|script| {
            let network_json = "{}".into();
            script.champion = Some(GetChampionResponse { network_json, ..Default::default() });
        });
        champion(&connection, 3, &mut progress).await.unwrap();
    }
}
