//! One key of experiment files, as the JSON Schema describes it.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Number, Value};

use super::suggestion;

/// Stands for a name that the file chooses.
const NAME: &str = "NAME";
/// Keys of an alternative that hold its name.
const TAGS: [&str; 2] = ["type", "name"];
/// The description of keys without effect.
const IGNORED: &str = "Accepted and ignored.";
/// Most paths that a search for a misplaced key visits.
const PATHS_MAX: usize = 10_000;
/// Most places of a misplaced key in a message.
const PLACES_MAX: usize = 3;

/// One key of experiment files.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct KeyFacts {
    /// The place in the file; empty for the whole file.
    pub key: String,
    /// Whether the object above must have it; false for the whole file.
    pub required: bool,
    /// The key, or its first alternative.
    #[serde(flatten)]
    pub facts: Alternative,
    /// Different descriptions of the same key in other alternatives.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<Alternative>,
    /// The keys below it, each with a sentence. NAME stands for a name of your choice.
    pub below: BTreeMap<String, String>,
    /// Those of them that must be there, in every alternative.
    pub required_below: Vec<String>,
}

/// What the schema says about a key.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct Alternative {
    /// The kinds of objects or algorithms that have this key; empty for all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub of: Vec<String>,
    /// The meaning, with the unit.
    pub description: String,
    /// Types of JSON values; empty for any.
    pub types: Vec<String>,
    /// The allowed texts or constants, each with its meaning, if not all values are allowed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<Allowed>,
    /// The least number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum: Option<Number>,
    /// All numbers are greater than this one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exclusive_minimum: Option<Number>,
    /// The greatest number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum: Option<Number>,
    /// The least number of elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_items: Option<u64>,
    /// The greatest number of elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_items: Option<u64>,
    /// The value of a file without the key; the description names defaults that depend on others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default: Option<Value>,
}

/// A value that a key may have.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Allowed {
    /// The value.
    pub value: Value,
    /// Its meaning; may be empty.
    pub meaning: String,
}

/// The error that no file has a key. Its text names similar keys.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnknownKey(String);

/// A place in the schema, and the alternative that it belongs to.
#[derive(Debug, Clone)]
struct Candidate<'a> {
    of: Vec<String>,
    at: &'a Value,
    is_required: bool,
}

/// Says what a schema of experiment files says about a key, such as `algorithm.population_size` or
/// `world.objects.NAME.num_instances`. Any name may stand for NAME.
pub fn explain_key(schema: &Value, key: &str) -> Result<KeyFacts, UnknownKey> {
    let mut found = vec![Candidate { of: Vec::new(), at: schema, is_required: true }];
    let mut path: Vec<&str> = Vec::new();
    for name in key.split('.').filter(|name| !name.is_empty()) {
        let below = below(schema, &found);
        let next: Vec<Candidate<'_>> = below
            .iter()
            .filter(|(known, _)| *known == name)
            .map(|(_, candidate)| candidate.clone())
            .collect();
        let next = match next.is_empty() {
            true => named(&below),
            false => next,
        };
        if next.is_empty() {
            return Err(unknown(schema, &path, name, &below, key));
        }
        found = next;
        path.push(name);
    }
    Ok(facts(schema, path.join("."), &found))
}

/// The candidates for a name that the file chooses.
fn named<'a>(below: &[(&'a str, Candidate<'a>)]) -> Vec<Candidate<'a>> {
    let named = below.iter().filter(|(known, _)| *known == NAME);
    named.map(|(_, candidate)| candidate.clone()).collect()
}

fn facts(schema: &Value, key: String, found: &[Candidate<'_>]) -> KeyFacts {
    let mut alternatives: Vec<Alternative> = Vec::new();
    for Candidate { of, at, .. } in found {
        let described = alternative(schema, at);
        let is_same = |other: &&mut Alternative| {
            described == Alternative { of: Vec::new(), ..(**other).clone() }
        };
        match alternatives.iter_mut().find(is_same) {
            // One that belongs to no alternative belongs to all.
            Some(same) if same.of.is_empty() || of.is_empty() => same.of.clear(),
            Some(same) => same.of.extend(of.iter().cloned()),
            None => alternatives.push(Alternative { of: of.clone(), ..described }),
        }
    }
    // Keys without effect in some algorithms are no alternatives.
    if alternatives.iter().any(|other| other.description != IGNORED) {
        alternatives.retain(|other| other.description != IGNORED);
    }
    let is_tag = |other: &Alternative| other.description.is_empty() && other.values.len() == 1;
    if alternatives.len() > 1 && alternatives.iter().all(is_tag) {
        alternatives = vec![tag(alternatives)];
    }
    let mut below_it: BTreeMap<String, String> = BTreeMap::new();
    let mut required_below = Vec::new();
    for (name, candidate) in below(schema, found) {
        let about = first_sentence(&alternative(schema, candidate.at).description);
        let is_known = below_it.get(name).is_some_and(|known| known != IGNORED_SHORT);
        if !is_known {
            below_it.insert(name.to_owned(), about);
        }
        if candidate.is_required && candidate.of.is_empty() && !required_below.contains(&name) {
            required_below.push(name);
        }
    }
    below_it.retain(|_, about| about != IGNORED_SHORT);
    let is_required = !key.is_empty() && found.iter().all(|candidate| candidate.is_required);
    let mut alternatives = alternatives.into_iter();
    KeyFacts {
        key,
        required: is_required,
        facts: alternatives.next().unwrap_or_default(),
        others: alternatives.collect(),
        below: below_it,
        required_below: required_below.into_iter().map(str::to_owned).collect(),
    }
}

/// The key that chooses among alternatives: one description with all their names.
fn tag(alternatives: Vec<Alternative>) -> Alternative {
    let values = alternatives.iter().flat_map(|other| other.values.clone()).collect();
    let types = alternatives.into_iter().next().map(|first| first.types).unwrap_or_default();
    let description = "Chooses which other keys there are.".to_owned();
    Alternative { description, types, values, ..Alternative::default() }
}

/// The first sentence of [`IGNORED`].
const IGNORED_SHORT: &str = "Accepted and ignored";

fn alternative(schema: &Value, at: &Value) -> Alternative {
    let mut found = Alternative::default();
    for (_, form) in forms(schema, at) {
        if found.description.is_empty()
            && let Some(text) = form["description"].as_str()
        {
            found.description = text.split_whitespace().collect::<Vec<_>>().join(" ");
        }
        let types = match &form["type"] {
            Value::String(one) => vec![one.as_str()],
            Value::Array(several) => several.iter().filter_map(Value::as_str).collect(),
            _ => Vec::new(),
        };
        for kind in types {
            if !found.types.iter().any(|known| known == kind) {
                found.types.push(kind.to_owned());
            }
        }
        let number = |key: &str| form[key].as_number().cloned();
        found.minimum = found.minimum.or_else(|| number("minimum"));
        found.exclusive_minimum = found.exclusive_minimum.or_else(|| number("exclusiveMinimum"));
        found.maximum = found.maximum.or_else(|| number("maximum"));
        found.min_items = found.min_items.or(form["minItems"].as_u64());
        found.max_items = found.max_items.or(form["maxItems"].as_u64());
        found.default = found.default.or_else(|| form.get("default").cloned());
        found.values.extend(allowed(form));
    }
    found
}

/// The constants among which a value is chosen.
fn allowed(form: &Value) -> Vec<Allowed> {
    let constant = |value: &Value, meaning: &Value| Allowed {
        value: value.clone(),
        meaning: meaning.as_str().unwrap_or_default().to_owned(),
    };
    let listed = form["enum"].as_array().into_iter().flatten();
    let mut found: Vec<Allowed> = listed.map(|value| constant(value, &Value::Null)).collect();
    if let Some(value) = form.get("const") {
        found.push(constant(value, &form["description"]));
    }
    // An object is chosen by its type or its name.
    let tags = TAGS.iter().filter_map(|tag| form["properties"][tag].get("const"));
    found.extend(tags.map(|value| constant(value, &form["description"])));
    found
}

/// A schema, and all that it refers to or chooses from, each with the name of its alternative.
fn forms<'a>(schema: &'a Value, at: &'a Value) -> Vec<(Option<&'a str>, &'a Value)> {
    let mut found = vec![(label(at), at)];
    if let Some(name) = at["$ref"].as_str().and_then(|address| address.strip_prefix("#/$defs/")) {
        found.extend(forms(schema, &schema["$defs"][name]));
    }
    for choice in ["oneOf", "anyOf", "allOf"].iter().filter_map(|kind| at[kind].as_array()) {
        found.extend(choice.iter().flat_map(|choice| forms(schema, choice)));
    }
    found
}

/// The name of an alternative among objects.
fn label(form: &Value) -> Option<&str> {
    // The title of the whole file is no alternative.
    if form["$defs"].is_object() {
        return None;
    }
    let tag = TAGS.iter().find_map(|tag| form["properties"][tag]["const"].as_str());
    form["title"].as_str().filter(|_| form["properties"].is_object()).or(tag)
}

/// The keys below some places. A list is transparent: the keys of its elements are below it.
fn below<'a>(schema: &'a Value, places: &[Candidate<'a>]) -> Vec<(&'a str, Candidate<'a>)> {
    let mut found = Vec::new();
    for place in places {
        for (label, form) in forms(schema, place.at) {
            let of: Vec<String> = match label {
                Some(label) => vec![label.to_owned()],
                None => place.of.clone(),
            };
            let required = form["required"].as_array();
            let is_required =
                |name: &str| required.is_some_and(|names| names.iter().any(|key| key == name));
            for (name, at) in form["properties"].as_object().into_iter().flatten() {
                let is_required = is_required(name);
                found.push((name.as_str(), Candidate { of: of.clone(), at, is_required }));
            }
            let entries = &form["additionalProperties"];
            if entries.is_object() {
                let is_required = false;
                found.push((NAME, Candidate { of: of.clone(), at: entries, is_required }));
            }
            if form["items"].is_object() {
                let element = Candidate { of, at: &form["items"], is_required: false };
                found.extend(below(schema, &[element]));
            }
        }
    }
    found
}

/// The first sentence of a text, without its full stop.
fn first_sentence(text: &str) -> String {
    text.split(". ").next().unwrap_or_default().trim_end_matches('.').to_owned()
}

fn unknown(
    schema: &Value,
    path: &[&str],
    name: &str,
    below: &[(&str, Candidate<'_>)],
    key: &str,
) -> UnknownKey {
    let above = if path.is_empty() { "a file".to_owned() } else { format!("`{}`", path.join(".")) };
    let mut known: Vec<&str> = below.iter().map(|(name, _)| *name).collect();
    known.sort_unstable();
    known.dedup();
    if known.is_empty() {
        return UnknownKey(format!("{above} has no keys below it"));
    }
    let name = crate::report::Excerpt(name);
    let message = format!("{above} has no key `{name}`");
    let elsewhere = places_of(schema, key.rsplit('.').next().unwrap_or(key));
    let near = suggestion(name.0, &known);
    UnknownKey(match &elsewhere[..] {
        [] => format!("{message}; {near}"),
        _ if near.starts_with("did you mean") => format!("{message}; {near}"),
        places => format!("{message}; did you mean {}?", Places(places)),
    })
}

struct Places<'a>(&'a [String]);

impl fmt::Display for Places<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown: Vec<String> =
            self.0.iter().take(PLACES_MAX).map(|place| format!("`{place}`")).collect();
        f.write_str(&shown.join(" or "))
    }
}

/// The places of a key of this name, wherever it is, the nearest to the top first.
fn places_of(schema: &Value, name: &str) -> Vec<String> {
    let top = Candidate { of: Vec::new(), at: schema, is_required: true };
    let mut queue = std::collections::VecDeque::from([(String::new(), top)]);
    let mut found: Vec<String> = Vec::new();
    let mut n_visited = 0;
    while let Some((path, place)) = queue.pop_front() {
        n_visited += 1;
        if n_visited > PATHS_MAX || found.len() > PLACES_MAX {
            break;
        }
        for (key, candidate) in below(schema, &[place]) {
            if alternative_is_ignored(candidate.at) {
                continue;
            }
            let path = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
            if key == name && !found.contains(&path) {
                found.push(path.clone());
            }
            queue.push_back((path, candidate));
        }
    }
    found
}

fn alternative_is_ignored(at: &Value) -> bool {
    at["description"] == IGNORED
}
