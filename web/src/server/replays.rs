//! Episodes for the player, simulated when they are asked for.

use std::sync::Arc;

use axum::{
    extract::State,
    http::{StatusCode, header::CONTENT_TYPE},
    response::{IntoResponse, Response},
};
use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use sim_core::{FINGERPRINT, Simulation, TrialSet};
use swarm_proto::v1::GetChampionResponse;

use super::{
    Shared,
    problem::{Path, Problem, Query},
};
use crate::{
    replay::{Episode, Replay},
    what_if::WhatIf,
};

/// The episode of the individual at an address, with what is to be different.
pub async fn replay(
    State(shared): State<Shared>,
    Path(address): Path<String>,
    Query(what_if): Query<WhatIf>,
) -> Result<Response, Problem> {
    let experiment = address.split('@').next().and_then(|id| id.parse().ok());
    let experiment = experiment.ok_or_else(|| Problem::bad(format!("`{address}` names nobody")))?;
    let individual = shared.archive.individual(&address).await?;
    let found = shared.archive.experiment(experiment).await?;
    let simulation = found.experiment.map(|it| it.simulation).unwrap_or_default();
    if simulation != FINGERPRINT {
        let why = format!("it was computed with \"{simulation}\", and this is \"{FINGERPRINT}\"");
        return Err(Problem::new(StatusCode::CONFLICT, why));
    }
    let stopping = || Problem::new(StatusCode::SERVICE_UNAVAILABLE, "the server stops");
    let permit = Arc::clone(&shared.replays).acquire_owned().await.map_err(|_| stopping())?;
    // Ends with the server, and when the browser goes away.
    let end = shared.shutdown.child_token();
    let _ended_with_the_request = end.clone().drop_guard();
    let simulating = tokio::task::spawn_blocking(move || {
        let _permit = permit;
        let keep_going = || !end.is_cancelled();
        simulate(&found.config_json, &individual, &address, &what_if, &keep_going)
    });
    let packed = simulating.await.map_err(|_| {
        Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "simulating panicked; please report this")
    })??;
    Ok(([(CONTENT_TYPE, "application/octet-stream")], packed).into_response())
}

fn simulate(
    config_json: &str,
    individual: &GetChampionResponse,
    address: &str,
    what_if: &WhatIf,
    keep_going: &dyn Fn() -> bool,
) -> Result<Vec<u8>, Problem> {
    let bad = |error: &dyn std::fmt::Display| Problem::bad(error.to_string());
    let (config, _) =
        ExperimentConfig::from_json(config_json, "", ALGORITHMS).map_err(|error| bad(&error))?;
    let config = what_if.apply(config).map_err(|error| bad(&error))?;
    let simulation = Simulation::compile(&config).map_err(|error| bad(&error))?;
    let generation = what_if.generation.unwrap_or(individual.generation);
    let episode = Episode {
        config: &config,
        simulation: &simulation,
        genotype: &individual.genotype,
        name: &name(address, individual),
        trial_set: TrialSet::Generation(generation),
        trial: what_if.trial,
    };
    let replay = Replay::simulate_while(&episode, keep_going);
    Ok(replay.map_err(|error| bad(&error))?.encode())
}

/// Who is at an address, for people.
fn name(address: &str, individual: &GetChampionResponse) -> String {
    let generation = individual.generation;
    match (address.split_once('@'), individual.individual) {
        (None, _) => format!("Champion of experiment {address}"),
        (Some((id, _)), Some(i)) => {
            format!("Individual {i} of generation {generation} of experiment {id}")
        }
        (Some((id, _)), None) => {
            format!("Mean of the distribution after generation {generation} of experiment {id}")
        }
    }
}
