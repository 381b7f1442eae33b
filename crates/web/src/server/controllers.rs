//! The controller of an individual in C, as a ZIP archive, with an episode recorded on request.

use axum::{
    extract::State,
    http::{
        StatusCode,
        header::{CONTENT_DISPOSITION, CONTENT_TYPE},
    },
    response::{IntoResponse as _, Response},
};
use controller_c::{About, Episodes, ExportError};
use evolution::Digest;
use replay::WhatIf;
use sim_core::{FINGERPRINT, TrialSet};

use super::{
    Shared,
    problem::{Path, Problem},
    replays::{Subject, stopping, work},
};

/// Largest size of a recorded episode, bytes.
const LEN_MAX: usize = 64_000_000;

/// The files of the controller of the genotype at an address. The archive has one folder.
pub async fn controller(
    State(shared): State<Shared>,
    Path(address): Path<String>,
) -> Result<Response, Problem> {
    let subject = Subject::find(&shared, &address).await?;
    let name = format!("controller-{}", address.replace(|c: char| !c.is_alphanumeric(), "-"));
    let folder = name.clone();
    let packed = work(&shared, move |keep_going| pack(&subject, &folder, keep_going)).await?;
    let disposition = format!("attachment; filename=\"{name}.zip\"");
    let headers = [(CONTENT_TYPE, "application/zip".into()), (CONTENT_DISPOSITION, disposition)];
    Ok((headers, packed).into_response())
}

fn pack(
    subject: &Subject,
    folder: &str,
    keep_going: &dyn Fn() -> bool,
) -> Result<Vec<u8>, Problem> {
    let (config, simulation) = subject.compile(&WhatIf::default())?;
    let about = About {
        experiment: config.name.clone(),
        genotype: subject.name.clone(),
        config_digest: Digest::of_config(&config, FINGERPRINT).to_string(),
    };
    let trial_set = TrialSet::Generation(subject.individual.generation);
    let episodes = Episodes { trial_set, trials: 0..1, len_max: LEN_MAX, keep_going };
    let genotype = &subject.individual.genotype;
    let controller = controller_c::export(&simulation, genotype, episodes, &about);
    let controller = controller.map_err(|error| match error {
        ExportError::Stopped => stopping(),
        ExportError::TooLong { .. } => {
            Problem::bad(format!("{error}; `swarmctl export-controller` has more room"))
        }
        _ => Problem::bad(error.to_string()),
    })?;
    let names: Vec<_> =
        controller.files.iter().map(|(name, _)| format!("{folder}/{name}")).collect();
    let contents = controller.files.iter().map(|(_, content)| &**content);
    bundle::pack(names.iter().map(String::as_str).zip(contents))
        .map_err(|error| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string()))
}
