//! Cursors over the syntax tree, for readers of one value or object.
//!
//! A reader never stops at a problem. It reports the problem and continues with a placeholder, so
//! that one pass finds all problems of a file.

use std::ops::RangeInclusive;
use std::str::FromStr;

use indexmap::IndexMap;
use jsonc_parser::ast::{self, Value};
use serde::Deserialize;

use crate::limits::{POSITIVE, QUANTITY};
use crate::report::{Excerpt, Message, Path, Report, check_name, suggestion, unknown_name};
use crate::variant::variant;
use crate::{NamedMap, ParameterValue, Seed, limits};

type Properties<'a> = IndexMap<&'a str, &'a Value<'a>>;

/// The result of reading a whole number.
enum Whole {
    Number(u64),
    /// Negative, or more than 64 bits.
    OutOfRange,
    Not,
}

/// Reads a whole number; as in JSON Schema, also `32.0` and `1e3`.
fn whole_number(text: &str) -> Whole {
    /// Largest number up to which every whole number is an f64.
    const EXACT_MAX: f64 = (1_u64 << 53) as f64;
    if let Ok(number) = text.parse() {
        return Whole::Number(number);
    }
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number.fract() != 0.0 => Whole::Not,
        Ok(number) if (0.0..=EXACT_MAX).contains(&number) => Whole::Number(number as u64),
        Ok(_) => Whole::OutOfRange,
        Err(_) => Whole::Not,
    }
}

/// One value of the file; or, after a problem, a silent placeholder.
pub(crate) struct Node<'a> {
    report: &'a Report<'a>,
    path: Path,
    value: Option<&'a Value<'a>>,
}

impl<'a> Node<'a> {
    pub(crate) fn root(report: &'a Report<'a>, value: &'a Value<'a>) -> Self {
        Self { report, path: Path::default(), value: Some(value) }
    }

    /// Reports a problem of this value.
    pub(crate) fn problem(&self, message: impl Message) {
        if self.value.is_some() {
            self.report.problem(&self.path, message);
        }
    }

    pub(crate) fn is_null(&self) -> bool {
        matches!(self.value, Some(Value::NullKeyword(_)))
    }

    /// The result of `read` on the value; `None` for null.
    pub(crate) fn or_null<T>(self, read: impl FnOnce(Self) -> T) -> Option<T> {
        if self.is_null() { None } else { Some(read(self)) }
    }

    pub(crate) fn is_string(&self) -> bool {
        matches!(self.value, Some(Value::StringLit(_)))
    }

    pub(crate) fn is_list(&self) -> bool {
        matches!(self.value, Some(Value::Array(_)))
    }

    pub(crate) fn is(&self, text: &str) -> bool {
        matches!(self.value, Some(Value::StringLit(literal)) if literal.value == text)
    }

    pub(crate) fn bool(self) -> bool {
        match self.value {
            Some(Value::BooleanLit(literal)) => literal.value,
            _ => self.wrong_type("true or false"),
        }
    }

    pub(crate) fn string(self) -> Option<&'a str> {
        match self.value {
            Some(Value::StringLit(literal)) => Some(&literal.value),
            _ => self.wrong_type("a string"),
        }
    }

    /// A string of any content, of bounded length.
    pub(crate) fn text(self, max_bytes: usize) -> String {
        let (report, path) = (self.report, self.path.clone());
        let text = self.string().unwrap_or_default();
        if text.len() > max_bytes {
            report.problem(&path, format!("has {} bytes, the limit is {max_bytes}", text.len()));
        }
        text.to_owned()
    }

    /// A string that is a name.
    pub(crate) fn name(self) -> String {
        let (report, path) = (self.report, self.path.clone());
        let Some(name) = self.string() else {
            return String::new();
        };
        if let Err(message) = check_name(name) {
            report.problem(&path, message);
        }
        name.to_owned()
    }

    /// One name, or a list of names.
    pub(crate) fn names(self) -> Vec<String> {
        if self.is_list() {
            self.list(1..=limits::ENTRIES).into_iter().map(Node::name).collect()
        } else {
            vec![self.name()]
        }
    }

    pub(crate) fn u64(self, range: RangeInclusive<u64>) -> u64 {
        let (min, max) = (*range.start(), *range.end());
        let Some(Value::NumberLit(literal)) = self.value else {
            self.wrong_type::<()>("a whole number");
            return min;
        };
        let found = Excerpt(literal.value);
        match whole_number(literal.value) {
            Whole::Number(number) if range.contains(&number) => return number,
            Whole::Not => self.problem(format!("expected a whole number, found {found}")),
            _ if min == max => self.problem(format!("must be {min}, is {found}")),
            _ => self.problem(format!("must be between {min} and {max}, is {found}")),
        }
        min
    }

    pub(crate) fn u32(self, range: RangeInclusive<u32>) -> u32 {
        let number = self.u64((*range.start()).into()..=(*range.end()).into());
        number.try_into().unwrap_or(*range.start())
    }

    /// A whole number of 64 bits. Programs that would round the number write its digits as text.
    pub(crate) fn seed(self) -> u64 {
        if !self.is_string() {
            return self.u64(0..=u64::MAX);
        }
        let (report, path) = (self.report, self.path.clone());
        let text = self.string().unwrap_or_default();
        let seed = Seed::from_digits(text).map(|Seed(seed)| seed);
        seed.unwrap_or_else(|| {
            let (max, found) = (u64::MAX, Excerpt(text));
            report.problem(&path, || format!("must be a whole number between 0 and {max}, or text of its digits; it is `{found}`"));
            0
        })
    }

    /// A number within a range. Messages describe the range `POSITIVE` as "positive".
    pub(crate) fn number(self, range: RangeInclusive<f64>) -> f64 {
        let (min, max) = (*range.start(), *range.end());
        let is_positive = range == POSITIVE;
        let placeholder = if is_positive { max } else { min };
        let Some(Value::NumberLit(literal)) = self.value else {
            self.wrong_type::<()>("a number");
            return placeholder;
        };
        match literal.value.parse::<f64>() {
            Ok(number) if range.contains(&number) => number,
            _ => {
                let must = if is_positive {
                    format!("be positive and at most {max}")
                } else if min == max {
                    format!("be {min}")
                } else {
                    format!("be between {min} and {max}")
                };
                self.problem(|| format!("must {must}, is {}", Excerpt(literal.value)));
                placeholder
            }
        }
    }

    /// A quantity > 0.
    pub(crate) fn positive(self) -> f64 {
        self.number(POSITIVE)
    }

    /// A quantity of either sign.
    pub(crate) fn quantity(self) -> f64 {
        self.number(QUANTITY)
    }

    /// A parameter of an unknown algorithm: a number or a name.
    pub(crate) fn parameter(self) -> ParameterValue {
        match self.value {
            Some(Value::StringLit(_)) => ParameterValue::Name(self.name()),
            Some(Value::NumberLit(literal)) => match literal.value.parse() {
                Ok(whole) => ParameterValue::Whole(whole),
                Err(_) => ParameterValue::Number(self.quantity()),
            },
            _ => {
                self.wrong_type::<()>("a number or a name");
                ParameterValue::Whole(0)
            }
        }
    }

    /// The variant of `T` that a string names. `unsupported`: names that only SpikeSwarmSim knows.
    pub(crate) fn variant<T: Deserialize<'a>>(self, unsupported: &[&str]) -> Option<T> {
        let (report, path) = (self.report, self.path.clone());
        let name = self.string()?;
        variant(name)
            .map_err(|error| {
                report.problem(&path, || unknown_name(name, error.expected, unsupported))
            })
            .ok()
    }

    /// A string that `T` parses.
    pub(crate) fn parsed<T: FromStr<Err: ToString>>(self) -> Option<T> {
        let (report, path) = (self.report, self.path.clone());
        let parsed = self.string()?.parse();
        parsed.map_err(|error: T::Err| report.problem(&path, error.to_string())).ok()
    }

    /// One of the given strings; for unions whose variants have parameters.
    pub(crate) fn one_of(
        self,
        expected: &[&'static str],
        unsupported: &[&str],
    ) -> Option<&'static str> {
        let (report, path) = (self.report, self.path.clone());
        let name = self.string()?;
        let found = expected.iter().find(|known| **known == name).copied();
        if found.is_none() {
            report.problem(&path, || unknown_name(name, expected, unsupported));
        }
        found
    }

    /// The elements of a list of bounded length.
    pub(crate) fn list(self, lengths: RangeInclusive<usize>) -> Vec<Node<'a>> {
        let Some(Value::Array(array)) = self.value else {
            return self.wrong_type("a list");
        };
        let n = array.elements.len();
        if !lengths.contains(&n) {
            let (min, max) = lengths.into_inner();
            let expected = if min == max { min.to_string() } else { format!("{min} to {max}") };
            self.problem(format!("expected a list of {expected} elements, found {n}"));
            return Vec::new();
        }
        let elements = array.elements.iter().enumerate();
        elements.map(|(i, element)| self.inner(self.path.index(i), Some(element))).collect()
    }

    /// An object with known keys. Keys that `read` asks for are known; all others are reported.
    pub(crate) fn object<T>(self, read: impl FnOnce(&mut Object<'a>) -> T) -> T {
        let properties = self.properties();
        self.read_object(properties, read)
    }

    /// An object with known keys; or a string, which stands for an object with
    /// nothing but this `name`.
    pub(crate) fn object_or_name<T>(self, read: impl FnOnce(&mut Object<'a>) -> T) -> T {
        match self.value {
            Some(name @ Value::StringLit(_)) => {
                self.read_object(Some(IndexMap::from([("name", name)])), read)
            }
            _ => self.object(read),
        }
    }

    fn read_object<T>(
        self,
        properties: Option<Properties<'a>>,
        read: impl FnOnce(&mut Object<'a>) -> T,
    ) -> T {
        let mut object = Object {
            report: self.report,
            path: self.path,
            is_silent: properties.is_none(),
            properties: properties.unwrap_or_default(),
            known: Vec::new(),
        };
        let result = read(&mut object);
        object.finish();
        result
    }

    /// An object whose keys are names that the file chooses.
    pub(crate) fn map<T>(
        self,
        min_entries: usize,
        mut read: impl FnMut(&str, Node<'a>) -> T,
    ) -> NamedMap<T> {
        let Some(properties) = self.properties() else {
            return NamedMap::new();
        };
        if properties.len() < min_entries {
            self.problem(format!("expected at least {min_entries} entry"));
        }
        let entries = properties.into_iter().map(|(name, value)| {
            let node = self.inner(self.path.key(name), Some(value));
            if let Err(message) = check_name(name) {
                node.problem(message);
            }
            (name.to_owned(), read(name, node))
        });
        entries.collect()
    }

    /// The properties of an object, the first of each name.
    fn properties(&self) -> Option<Properties<'a>> {
        let Some(Value::Object(ast::Object { properties, .. })) = self.value else {
            return self.wrong_type("an object");
        };
        let (n, limit) = (properties.len(), limits::ENTRIES);
        if n > limit {
            self.problem(format!("has {n} entries, the limit is {limit}"));
            return None;
        }
        let mut by_name = IndexMap::with_capacity(n);
        for property in properties {
            let name = property.name.as_str();
            if by_name.contains_key(name) {
                let path = self.path.key(name);
                self.report.problem_at(&path, property.range.start, "duplicate key");
            } else {
                by_name.insert(name, &property.value);
            }
        }
        Some(by_name)
    }

    /// Whether this is a list of two numbers, the larger one first.
    pub(crate) fn descends(&self) -> bool {
        let Some(Value::Array(array)) = self.value else { return false };
        let number = |element: &Value<'_>| match element {
            Value::NumberLit(literal) => literal.value.parse::<f64>().ok(),
            _ => None,
        };
        let numbers: Vec<_> = array.elements.iter().map(number).collect();
        matches!(numbers[..], [Some(low), Some(high)] if low > high)
    }

    /// A silent placeholder for this value.
    pub(crate) fn silent(&self) -> Self {
        self.inner(self.path.clone(), None)
    }

    fn inner(&self, path: Path, value: Option<&'a Value<'a>>) -> Self {
        Self { report: self.report, path, value }
    }

    fn wrong_type<T: Default>(&self, expected: &str) -> T {
        let found = match self.value {
            None => return T::default(),
            Some(Value::StringLit(_)) => "a string",
            Some(Value::NumberLit(_)) => "a number",
            Some(Value::BooleanLit(_)) => "true or false",
            Some(Value::Object(_)) => "an object",
            Some(Value::Array(_)) => "a list",
            Some(Value::NullKeyword(_)) => "null",
        };
        self.problem(format!("expected {expected}, found {found}"));
        T::default()
    }
}

/// The properties of one object; or, after a problem, a silent placeholder.
pub(crate) struct Object<'a> {
    report: &'a Report<'a>,
    path: Path,
    is_silent: bool,
    /// The properties that the reader has not asked for yet.
    properties: Properties<'a>,
    known: Vec<&'static str>,
}

impl<'a> Object<'a> {
    pub(crate) fn optional(&mut self, key: &'static str) -> Option<Node<'a>> {
        if !self.known.contains(&key) {
            self.known.push(key);
        }
        let value = self.properties.swap_remove(key)?;
        Some(Node { report: self.report, path: self.path.key(key), value: Some(value) })
    }

    /// Whether the file has a key that the reader has not asked for yet.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.properties.contains_key(key)
    }

    /// Whether the file has a value at the end of a path of keys that the reader has not asked for
    /// yet.
    pub(crate) fn has_within(&self, path: &[&str]) -> bool {
        let Some((first, rest)) = path.split_first() else { return false };
        let first = self.properties.get(first).copied();
        let property = |value: &'a Value<'a>, key: &&str| match value {
            Value::Object(object) => {
                let mut properties = object.properties.iter();
                properties
                    .find(|property| property.name.as_str() == *key)
                    .map(|property| &property.value)
            }
            _ => None,
        };
        rest.iter().fold(first, |value, key| property(value?, key)).is_some()
    }

    pub(crate) fn required(&mut self, key: &'static str) -> Node<'a> {
        self.optional(key).unwrap_or_else(|| {
            self.problem(key, || format!("missing key `{key}`"));
            Node { report: self.report, path: self.path.key(key), value: None }
        })
    }

    /// The value of an optional key, or its default.
    pub(crate) fn or<T>(
        &mut self,
        key: &'static str,
        default: T,
        read: impl FnOnce(Node<'a>) -> T,
    ) -> T {
        self.optional(key).map_or(default, read)
    }

    /// An optional object. A missing object counts as an empty one.
    pub(crate) fn inner<T>(
        &mut self,
        key: &'static str,
        read: impl FnOnce(&mut Object<'a>) -> T,
    ) -> T {
        if let Some(node) = self.optional(key) {
            return node.object(read);
        }
        read(&mut Object {
            report: self.report,
            path: self.path.key(key),
            is_silent: self.is_silent,
            properties: IndexMap::new(),
            known: Vec::new(),
        })
    }

    /// Refuses keys that only SpikeSwarmSim knows, as not supported.
    pub(crate) fn unsupported(&mut self, keys: &[&str]) {
        for key in keys {
            if self.properties.swap_remove(*key).is_some() {
                self.report.problem(&self.path.key(key), "not supported");
            }
        }
    }

    /// Accepts a key that has no effect here, with a warning that says why.
    pub(crate) fn ignored(&mut self, key: &'static str, why: &str) {
        if self.optional(key).is_some() {
            self.report.warning(&self.path.key(key), format!("ignored: {why}"));
        }
    }

    /// Accepts all remaining keys, because the known ones depend on an unreadable value.
    pub(crate) fn accept_rest(&mut self) {
        self.properties.clear();
    }

    /// Reports a problem of a key, whether the file has it or not.
    pub(crate) fn problem(&self, key: &str, message: impl Message) {
        if !self.is_silent {
            self.report.problem(&self.path.key(key), message);
        }
    }

    fn finish(self) {
        for name in self.properties.keys() {
            let message = || format!("unknown key; {}", suggestion(name, &self.known));
            self.report.problem(&self.path.key(name), message);
        }
    }
}
