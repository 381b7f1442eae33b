//! The description of a bundle for machines: `ro-crate-metadata.json` in the vocabulary of
//! RO-Crate 1.3.

use serde_json::{Value, json};
use time::{OffsetDateTime, format_description::well_known::Rfc3339};

use super::{Bundle, BundleError, archive::File};

/// The file with the description.
pub const DESCRIPTION: &str = "ro-crate-metadata.json";

/// Describes a bundle that has these files.
pub fn describe(bundle: &Bundle, files: &[File]) -> String {
    let reference = |id: &str| json!({"@id": id});
    let references: Vec<Value> = files.iter().map(|file| reference(file.name)).collect();
    let ended = bundle.history.last().map_or(0, |latest| latest.completed_at_ms);
    let config: Value = serde_json::from_str(&bundle.config_json).unwrap_or_default();
    let name = config["name"].as_str().unwrap_or_default();
    let (n_generations, seed) = (bundle.history.len(), &config["seed"]);
    let mut graph = vec![
        json!({
            "@id": DESCRIPTION,
            "@type": "CreativeWork",
            "about": reference("./"),
            "conformsTo": reference("https://w3id.org/ro/crate/1.3"),
        }),
        json!({
            "@id": "./",
            "@type": "Dataset",
            "name": format!("{name}, seed {seed}"),
            "description": format!(
                "Controllers of a robot swarm, evolved over {n_generations} generations, with \
                 everything that is needed to compute them again and to check every bit: \
                 `swarmctl verify FILE`. The last link of the digest chain is {}.",
                bundle.manifest.digest
            ),
            "datePublished": rfc3339(ended),
            "license": "Chosen by whoever publishes this.",
            "hasPart": references,
            "mentions": reference("#evolution"),
        }),
        json!({
            "@id": "#swarmevo",
            "@type": "SoftwareApplication",
            "name": "swarmevo",
            "softwareVersion": bundle.manifest.program,
            "description": format!("Its simulation is \"{}\".", bundle.manifest.simulation),
        }),
        json!({
            "@id": "#evolution",
            "@type": "CreateAction",
            "name": "Evolution",
            "instrument": reference("#swarmevo"),
            "object": reference(files[1].name),
            "result": references[2..],
            "startTime": rfc3339(bundle.manifest.submitted_at_ms),
            "endTime": rfc3339(ended),
        }),
    ];
    graph.extend(files.iter().map(|file| {
        json!({
            "@id": file.name,
            "@type": "File",
            "name": file.name,
            "description": file.about,
            "encodingFormat": file.encoding,
            "contentSize": file.content.len().to_string(),
            "sha256": file.sha256(),
        })
    }));
    let document = json!({"@context": "https://w3id.org/ro/crate/1.3/context", "@graph": graph});
    serde_json::to_string_pretty(&document).expect("JSON serialises")
}

/// Checks that the files are those that a description has the digests of. It may say more
/// than this program writes: authors, a license.
pub fn check(description: &[u8], files: &[File]) -> Result<(), BundleError> {
    let malformed = |what: String| BundleError::Malformed { file: DESCRIPTION, what };
    let document: Value =
        serde_json::from_slice(description).map_err(|error| malformed(error.to_string()))?;
    let graph = document["@graph"].as_array();
    let graph = graph.ok_or_else(|| malformed("it has no list `@graph`".to_owned()))?;
    for file in files {
        let entity = graph.iter().find(|entity| entity["@id"] == file.name);
        let described = entity.and_then(|entity| entity["sha256"].as_str());
        if described != Some(&*file.sha256()) {
            return Err(BundleError::OtherFile(file.name));
        }
    }
    Ok(())
}

/// A time of milliseconds since 1970 UTC, to the second.
fn rfc3339(at_ms: u64) -> String {
    let time = OffsetDateTime::from_unix_timestamp((at_ms / 1000) as i64);
    let text = time.ok().and_then(|time| time.format(&Rfc3339).ok());
    text.unwrap_or_else(|| "9999-12-31T23:59:59Z".to_owned())
}
