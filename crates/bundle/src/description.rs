//! The description of a bundle for machines: `ro-crate-metadata.json` in the vocabulary of
//! RO-Crate 1.3.

use std::fmt;

use serde::{
    Deserialize, Deserializer,
    de::{IgnoredAny, MapAccess, SeqAccess, Visitor},
};
use serde_json::{Value, json};
use time::{OffsetDateTime, format_description::well_known::Rfc3339};

use super::{Bundle, BundleError, archive::File, files};

/// The file with the description.
pub const DESCRIPTION: &str = "ro-crate-metadata.json";

/// Largest size of the description, bytes. This program writes about 4 KiB; publishers may add to
/// it.
pub const LEN_MAX: u64 = 4 << 20;

/// Length of the longest text that matters, bytes: a SHA-256 has 64.
const SHORT_LEN_MAX: usize = 64;

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

/// Checks that the files have the digests in the description. The description may contain more
/// than this program writes, such as authors and a license.
///
/// # Errors
///
/// If the description cannot be read, or if a file is missing in it or has another digest.
pub fn check(description: &[u8], files: &[File]) -> Result<(), BundleError> {
    let document: Document = serde_json::from_slice(description)
        .map_err(|error| BundleError::malformed(DESCRIPTION, &error))?;
    for file in files {
        let entity = document.graph.0.iter().find(|entity| entity.id.0 == file.name);
        if entity.is_none_or(|entity| entity.sha256.0 != file.sha256()) {
            return Err(BundleError::OtherFile(file.name));
        }
    }
    Ok(())
}

/// The part of a description that this program reads. A stranger's description may list millions of
/// entities of any kind.
#[derive(Deserialize)]
struct Document {
    #[serde(rename = "@graph")]
    graph: Graph,
}

/// The entities that may be files of a bundle. Their number is at most that of the files of a
/// bundle.
struct Graph(Vec<Entity>);

#[derive(Deserialize)]
struct Entity {
    #[serde(rename = "@id", default)]
    id: Short,
    #[serde(default)]
    sha256: Short,
}

/// A text that may be a file name or a digest; any other value counts as empty.
#[derive(Default)]
struct Short(String);

impl<'de> Deserialize<'de> for Graph {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(GraphVisitor)
    }
}

struct GraphVisitor;

impl<'de> Visitor<'de> for GraphVisitor {
    type Value = Graph;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list `@graph`")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entities: A) -> Result<Graph, A::Error> {
        let names = files::all().map(|file| file.name);
        let mut found: Vec<Entity> = Vec::new();
        while let Some(entity) = entities.next_element::<Entity>()? {
            let is_new = !found.iter().any(|before| before.id.0 == entity.id.0);
            if is_new && names.contains(&&*entity.id.0) {
                found.push(entity);
            }
        }
        Ok(Graph(found))
    }
}

impl<'de> Deserialize<'de> for Short {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ShortVisitor)
    }
}

struct ShortVisitor;

impl<'de> Visitor<'de> for ShortVisitor {
    type Value = Short;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("any value")
    }

    fn visit_str<E>(self, text: &str) -> Result<Short, E> {
        Ok(if text.len() > SHORT_LEN_MAX { Short::default() } else { Short(text.to_owned()) })
    }

    fn visit_bool<E>(self, _: bool) -> Result<Short, E> {
        Ok(Short::default())
    }

    fn visit_i64<E>(self, _: i64) -> Result<Short, E> {
        Ok(Short::default())
    }

    fn visit_u64<E>(self, _: u64) -> Result<Short, E> {
        Ok(Short::default())
    }

    fn visit_f64<E>(self, _: f64) -> Result<Short, E> {
        Ok(Short::default())
    }

    fn visit_unit<E>(self) -> Result<Short, E> {
        Ok(Short::default())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Short, A::Error> {
        while list.next_element::<IgnoredAny>()?.is_some() {}
        Ok(Short::default())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Short, A::Error> {
        while object.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(Short::default())
    }
}

/// Formats milliseconds since 1970 UTC, to the second.
fn rfc3339(at_ms: u64) -> String {
    let time = OffsetDateTime::from_unix_timestamp((at_ms / 1000) as i64);
    let text = time.ok().and_then(|time| time.format(&Rfc3339).ok());
    text.unwrap_or_else(|| "9999-12-31T23:59:59Z".to_owned())
}
