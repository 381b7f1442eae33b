//! The schema generates `docs/keys.md`: every key of a file, by its place.

mod description;
mod parts;
mod schema;
mod values;

use std::{collections::BTreeSet, fmt::Write as _, fs};

use evolution::ALGORITHMS;
use experiment_file::{ExperimentConfig, json_schema};
use harness::workspace_file;

use super::expect_page;
use parts::{GROUPS, INTRODUCTION, Section};
use schema::{Key, Schema, Variant};

const PAGE: &str = "docs/keys.md";
const GUIDE: &str = "docs/experiment-files.md";

/// The page, and the addresses in it.
#[derive(Default)]
struct Page {
    text: String,
    anchors: BTreeSet<String>,
}

impl Page {
    fn write(schema: &Schema) -> String {
        let mut page = Self { text: INTRODUCTION.to_owned(), ..Self::default() };
        for group in GROUPS {
            page.line(&format!("- [{}](#{})", group.title, slug(group.title)));
        }
        for group in GROUPS {
            page.heading("##", group.title);
            if !group.text.is_empty() {
                page.line(&format!("\n{}", group.text));
            }
            for section in group.sections {
                page.section(schema, section);
            }
        }
        page.text
    }

    fn section(&mut self, schema: &Schema, section: &Section) {
        if !section.heading.is_empty() {
            self.heading("###", section.heading);
        }
        let variants = schema.variants(section);
        let meaning = schema.meaning(section);
        if !meaning.is_empty() {
            self.line(&format!("\n{meaning}"));
        }
        if let Some(form) = schema.form(section) {
            self.line(&format!("\n{form}"));
        }
        if section.is_apart {
            for variant in &variants {
                self.heading("####", &variant.label);
                self.keys(section, std::slice::from_ref(variant));
            }
        } else {
            self.names(section, &variants);
            self.keys(section, &variants);
        }
    }

    /// A row for each name that the section allows.
    fn names(&mut self, section: &Section, variants: &[Variant]) {
        if variants.iter().all(|variant| variant.meaning.is_empty()) {
            return;
        }
        self.line("\n| name | |\n|---|---|");
        for Variant { label, meaning, .. } in variants {
            let name = self.anchored(&format!("{}.{label}", section.place()), label);
            self.line(&format!("| {name} | {meaning} |"));
        }
    }

    /// A row for each key, and a sentence on keys without effect.
    fn keys(&mut self, section: &Section, variants: &[Variant]) {
        let keys = merged(variants.iter().flat_map(|variant| &variant.keys));
        if !keys.is_empty() {
            self.line("\n| key | values | default | |\n|---|---|---|---|");
        }
        for key in keys {
            let is_of_all = key.of.len() == variants.len();
            let place = match key.of.first() {
                Some(of) if section.is_apart || !is_of_all => format!("{}.{of}", section.place()),
                _ => section.place(),
            };
            let name = self.anchored(&format!("{place}.{}", key.name), &key.name);
            let of = if is_of_all { String::new() } else { format!("{}: ", owners(&key.of)) };
            let Key { values, default, meaning, .. } = &key;
            self.line(&format!("| {name} | {values} | {default} | {of}{meaning} |"));
        }
        let ignored = variants.iter().flat_map(|variant| &variant.ignored);
        let mut by_owner: Vec<(Vec<String>, Vec<String>)> = Vec::new();
        for Key { name, of, .. } in merged(ignored) {
            match by_owner.iter_mut().find(|(owners, _)| *owners == of) {
                Some((_, names)) => names.push(name),
                None => by_owner.push((of, vec![name])),
            }
        }
        for (owners, names) in by_owner {
            let of = if owners.len() == variants.len() {
                String::new()
            } else {
                format!(" in {}", code(&owners))
            };
            self.line(&format!("\nAccepted and ignored{of}: {}.", code(&names)));
        }
    }

    fn heading(&mut self, level: &str, title: &str) {
        assert!(self.anchors.insert(slug(title)), "two headings {title}");
        self.line(&format!("\n{level} {title}"));
    }

    /// A name that links to itself.
    fn anchored(&mut self, anchor: &str, name: &str) -> String {
        assert!(self.anchors.insert(anchor.to_owned()), "two keys {anchor}");
        format!("<a id=\"{anchor}\" href=\"#{anchor}\">`{name}`</a>")
    }

    fn line(&mut self, line: &str) {
        let _ = writeln!(self.text, "{line}");
    }
}

/// Keys in the order of their names. Keys that differ only in their owners become one.
fn merged<'a>(keys: impl Iterator<Item = &'a Key>) -> Vec<Key> {
    let mut merged: Vec<Key> = Vec::new();
    for key in keys {
        match merged.iter_mut().find(|other| other.is_same(key)) {
            Some(other) => other.of.extend_from_slice(&key.of),
            None => merged.push(key.clone()),
        }
    }
    merged.sort_by(|a, b| a.name.cmp(&b.name));
    merged
}

/// Names of variants, without an ending that all of several names share.
fn owners(names: &[String]) -> String {
    const ENDING: &str = "_receptive_field";
    let short: Option<Vec<&str>> = names.iter().map(|name| name.strip_suffix(ENDING)).collect();
    short.filter(|short| short.len() > 1).map_or_else(|| code(names), |short| short.join(", "))
}

fn code(names: &[String]) -> String {
    format!("`{}`", names.join("`, `"))
}

/// The name of a heading in addresses, on code hosts and on the site.
fn slug(heading: &str) -> String {
    let lower = heading.to_lowercase();
    let kept = lower.chars().filter(|c| c.is_alphanumeric() || " _-".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn the_page_on_keys_agrees_with_the_schema() {
    let expected = Page::write(&Schema::new(json_schema(ALGORITHMS)));
    expect_page(PAGE, &expected);
}

#[test]
fn the_page_on_keys_has_every_key_of_the_schema() {
    let schema = Schema::new(json_schema(ALGORITHMS));
    let page = Page::write(&schema);
    let keys = schema.all_keys();
    assert!(keys.len() > 150, "{keys:?}");
    let missing: Vec<&String> =
        keys.iter().filter(|key| !page.contains(&format!("`{key}`"))).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn the_file_of_the_guide_is_valid() {
    let page = fs::read_to_string(workspace_file(GUIDE)).unwrap();
    let (_, rest) = page.split_once("```json\n{\n  \"world\"").expect("the page has a whole file");
    let (file, _) = rest.split_once("\n```").unwrap();
    let text = format!("{{\n  \"world\"{file}");
    let (_, warnings) = ExperimentConfig::from_json(&text, "phototaxis", ALGORITHMS).unwrap();
    assert_eq!(warnings, []);
}
