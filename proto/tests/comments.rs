//! The proto files are the manual of every client that is not `swarmctl`.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::BTreeMap;

use prost::Message as _;
use prost_types::{DescriptorProto, FileDescriptorProto, FileDescriptorSet};
use swarm_proto::FILE_DESCRIPTOR_SET;

// Numbers of the fields of `descriptor.proto` that lead to an element.
const FILE_MESSAGES: i32 = 4;
const FILE_ENUMS: i32 = 5;
const FILE_SERVICES: i32 = 6;
const MESSAGE_FIELDS: i32 = 2;
const MESSAGE_NESTED: i32 = 3;
const MESSAGE_ENUMS: i32 = 4;
const MESSAGE_ONEOFS: i32 = 8;
const ENUM_VALUES: i32 = 2;
const SERVICE_METHODS: i32 = 2;

/// Names of a file's elements, with the paths to them.
type Elements = Vec<(String, Vec<i32>)>;

/// The elements of a list, each with its path.
fn children<'a, T>(
    path: &'a [i32],
    list: i32,
    elements: &'a [T],
) -> impl Iterator<Item = (Vec<i32>, &'a T)> {
    elements.iter().zip(0..).map(move |(element, i)| ([path, &[list, i]].concat(), element))
}

fn add_message(elements: &mut Elements, scope: &str, path: &[i32], message: &DescriptorProto) {
    let scope = format!("{scope}.{}", message.name());
    elements.push((scope.clone(), path.to_vec()));
    for (path, field) in children(path, MESSAGE_FIELDS, &message.field) {
        elements.push((format!("{scope}.{}", field.name()), path));
    }
    for (path, oneof) in children(path, MESSAGE_ONEOFS, &message.oneof_decl) {
        // The compiler adds oneofs with `_` for optional fields; the file does not mention them.
        if !oneof.name().starts_with('_') {
            elements.push((format!("{scope}.{}", oneof.name()), path));
        }
    }
    for (path, nested) in children(path, MESSAGE_NESTED, &message.nested_type) {
        // The compiler adds messages for the entries of maps, too.
        if !nested.options.as_ref().is_some_and(|options| options.map_entry()) {
            add_message(elements, &scope, &path, nested);
        }
    }
    for (path, nested) in children(path, MESSAGE_ENUMS, &message.enum_type) {
        elements.push((format!("{scope}.{}", nested.name()), path.clone()));
        for (path, value) in children(&path, ENUM_VALUES, &nested.value) {
            elements.push((format!("{scope}.{}", value.name()), path));
        }
    }
}

fn elements(file: &FileDescriptorProto) -> Elements {
    let mut elements = Elements::new();
    let scope = file.package();
    for (path, message) in children(&[], FILE_MESSAGES, &file.message_type) {
        add_message(&mut elements, scope, &path, message);
    }
    for (path, enumeration) in children(&[], FILE_ENUMS, &file.enum_type) {
        elements.push((format!("{scope}.{}", enumeration.name()), path.clone()));
        for (path, value) in children(&path, ENUM_VALUES, &enumeration.value) {
            elements.push((format!("{scope}.{}", value.name()), path));
        }
    }
    for (path, service) in children(&[], FILE_SERVICES, &file.service) {
        elements.push((format!("{scope}.{}", service.name()), path.clone()));
        for (path, method) in children(&path, SERVICE_METHODS, &service.method) {
            elements.push((format!("{scope}.{}/{}", service.name(), method.name()), path));
        }
    }
    elements
}

/// The comment above every element of the protocol; empty if there is none.
fn comments() -> Vec<(String, String)> {
    let set = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).unwrap();
    let mut comments = Vec::new();
    for file in &set.file {
        let info = file.source_code_info.as_ref().unwrap();
        let above: BTreeMap<&[i32], &str> = info
            .location
            .iter()
            .map(|location| (&*location.path, location.leading_comments()))
            .collect();
        let comment_of = |path: &[i32]| above.get(path).copied().unwrap_or_default().to_owned();
        comments.extend(elements(file).into_iter().map(|(name, path)| (name, comment_of(&path))));
    }
    assert!(comments.len() > 200, "{} elements are too few", comments.len());
    comments
}

#[test]
fn everything_has_a_comment() {
    let bare: Vec<String> = comments()
        .into_iter()
        .filter_map(|(name, comment)| comment.trim().is_empty().then_some(name))
        .collect();
    assert!(bare.is_empty(), "no comment above {bare:#?}");
}

#[test]
fn quantities_say_their_unit() {
    let units = [
        ("_ms", "illiseconds"),
        ("_us", "microseconds"),
        ("_per_second", "per second"),
        ("_share", "0 to 1"),
    ];
    for (name, comment) in comments() {
        for (suffix, unit) in units {
            let is_told = !name.ends_with(suffix) || comment.contains(unit);
            assert!(is_told, "the comment of {name} does not say `{unit}`: {comment}");
        }
    }
}
