//! Reads parameters.

use std::ops::RangeInclusive;

use super::{DefaultValue, Domain, Original, Parameter, ParameterValue, Parameters, Params, Table};
use crate::node::{Node, Object};
use crate::semantics::Semantics;
use crate::{Drawn, limits};

/// Defaults, by key, of parameters whose default depends on other parts of the file. The keys of an
/// object within are paths, as in `body.radius`.
pub(crate) type Given<'a> = [(&'a str, ParameterValue)];

/// The same defaults for the keys of the object at `key`.
pub(crate) fn within<'a>(given: &Given<'a>, key: &str) -> Vec<(&'a str, ParameterValue)> {
    let inner = |path: &'a str| path.strip_prefix(key)?.strip_prefix('.');
    given.iter().map(|(path, value)| (inner(path).unwrap_or(path), value.clone())).collect()
}

/// A place in a file that may have the keys of parameters.
pub(crate) trait Keys<'a> {
    /// The value of a key, if the file has it.
    fn optional(&mut self, key: &'static str) -> Option<Node<'a>>;

    /// The value of a key that the file must have.
    fn required(&mut self, key: &'static str) -> Node<'a>;

    /// Reports a problem of a key.
    fn problem(&self, key: &str, message: String);
}

impl<'a> Keys<'a> for Object<'a> {
    fn optional(&mut self, key: &'static str) -> Option<Node<'a>> {
        self.optional(key)
    }

    fn required(&mut self, key: &'static str) -> Node<'a> {
        self.required(key)
    }

    fn problem(&self, key: &str, message: String) {
        self.problem(key, message);
    }
}

/// Reads the parameters of a type. `given`: defaults that depend on other parts of the file.
pub(crate) fn read<T: Parameters>(
    o: &mut Object<'_>,
    semantics: Semantics,
    given: &Given<'_>,
) -> T {
    T::from_params(&table(o, &T::TABLE, semantics, given))
}

/// Reads the parameters of a table, and the keys that it accepts beside them.
pub(super) fn table(
    o: &mut Object<'_>,
    table: &Table,
    semantics: Semantics,
    given: &Given<'_>,
) -> Params {
    for &(keys, why) in table.ignored {
        keys.iter().for_each(|key| o.ignored(key, why));
    }
    for parameter in table.checked {
        o.optional(parameter.key).map(|node| parameter.value(node, semantics, given));
    }
    params(o, table.parameters, semantics, given)
}

/// An object of parameters, if the file has the key.
pub(crate) fn optional<T: Parameters>(
    o: &mut Object<'_>,
    key: &'static str,
    semantics: Semantics,
    given: &Given<'_>,
) -> Option<T> {
    o.optional(key).map(|node| node.object(|o| read(o, semantics, given)))
}

/// An object of parameters. A missing object counts as an empty one.
pub(crate) fn inner<T: Parameters>(
    o: &mut Object<'_>,
    key: &'static str,
    semantics: Semantics,
    given: &Given<'_>,
) -> T {
    o.inner(key, |o| read(o, semantics, given))
}

/// Reads parameters from any place that may have their keys.
pub(crate) fn params<'a>(
    keys: &mut impl Keys<'a>,
    parameters: &[Parameter],
    semantics: Semantics,
    given: &Given<'_>,
) -> Params {
    let mut params = Params::default();
    let mut stated = Vec::new();
    for parameter in parameters {
        let found = parameter.find(keys, semantics, given);
        if found.is_some() {
            stated.push(parameter.key);
            match parameter.instead_of {
                Some(other) if stated.contains(&other) => {
                    keys.problem(parameter.key, format!("`{other}` states the same quantity"));
                }
                Some(other) => params.set(other, ParameterValue::Null),
                None => {}
            }
        }
        if let Some(value) = found.or_else(|| parameter.absent(&params, semantics, given)) {
            params.set(parameter.key, value);
        }
    }
    params
}

/// The value of an empty object.
pub(crate) fn defaults<T: Parameters>(semantics: Semantics) -> T {
    T::from_params(&absent::<T>(semantics))
}

/// The parameters of an empty object.
pub(super) fn absent<T: Parameters>(semantics: Semantics) -> Params {
    let mut params = Params::default();
    for parameter in T::TABLE.parameters {
        if let Some(value) = parameter.absent(&params, semantics, &[]) {
            params.set(parameter.key, value);
        }
    }
    params
}

impl Parameter {
    /// The value in the file, under either key.
    fn find<'a>(
        &self,
        keys: &mut impl Keys<'a>,
        semantics: Semantics,
        given: &Given<'_>,
    ) -> Option<ParameterValue> {
        let value = |node: Node<'_>| self.value(node, semantics, given);
        let is_given = given.iter().any(|(key, _)| *key == self.key);
        if self.is_required() && !is_given {
            return value(keys.required(self.key));
        }
        let also = self.also.and_then(|also| Some((also, keys.optional(also.key)?)));
        let found = keys.optional(self.key);
        let Some((also, node)) = also else {
            return found.and_then(value);
        };
        if found.is_some() {
            node.problem(format!("`{}` states the same quantity", self.key));
        }
        let number = match self.domain {
            Domain::Positive => node.positive(),
            _ => node.number(0.0..=also.max),
        };
        match found {
            Some(found) => value(found),
            None => Some(ParameterValue::Number((also.value)(number))),
        }
    }

    /// The value if the file has neither key.
    fn absent(
        &self,
        params: &Params,
        semantics: Semantics,
        given: &Given<'_>,
    ) -> Option<ParameterValue> {
        if let Some((_, value)) = given.iter().find(|(key, _)| *key == self.key) {
            return Some(value.clone());
        }
        match self.original.filter(|_| semantics == Semantics::Original) {
            Some(Original::Value(default)) => default.value(),
            Some(Original::From(default)) => Some(ParameterValue::Number(default(params))),
            None => match (self.default, self.domain) {
                (DefaultValue::Empty, Domain::Object(object)) => {
                    Some((object.absent)(semantics).into())
                }
                (default, _) => default.value(),
            },
        }
    }

    /// The value at a place in the file; `None` if it stands for the default.
    fn value(
        &self,
        node: Node<'_>,
        semantics: Semantics,
        given: &Given<'_>,
    ) -> Option<ParameterValue> {
        let own = || given.iter().find(|(key, _)| *key == self.key).map(|(_, value)| value);
        if self.is_nullable && node.is_null() {
            return Some(ParameterValue::Null);
        }
        Some(match self.domain {
            Domain::Positive => node.positive().into(),
            Domain::Between(min, max) => node.number(min..=max).into(),
            Domain::Seed => ParameterValue::Long(node.seed()),
            Domain::Whole(min, max) => node.u32(min..=max).into(),
            // Its bound depends on another key, so `check` compares the two.
            Domain::BelowPopulationSize => node.u32(0..=limits::POPULATION).into(),
            Domain::WholeOrAll(_) if node.is_string() => {
                node.one_of(&["all"], &[]);
                return None;
            }
            Domain::WholeOrAll(max) => node.u32(0..=max).into(),
            Domain::OneOf { names, unsupported } => {
                node.one_of(names, unsupported).unwrap_or(names[0]).into()
            }
            Domain::Variant(variants) => {
                (variants.read)(node).unwrap_or_else(|| (variants.names)()[0].into())
            }
            Domain::Text => ParameterValue::Name(node.name()),
            Domain::Switch => ParameterValue::Switch(node.bool()),
            Domain::Numbers(min, max) => {
                let mut numbers = numbers(node, min..=max);
                numbers.resize(numbers.len().max(min), 0.0);
                ParameterValue::Numbers(numbers)
            }
            Domain::Vectors(max) => {
                let n = match own() {
                    Some(ParameterValue::Vectors(vectors)) => vectors.first().map_or(1, Vec::len),
                    _ => 1,
                };
                let vectors = node.list(1..=max).into_iter().map(|node| numbers(node, n..=n));
                ParameterValue::Vectors(vectors.collect())
            }
            Domain::Points(min, max) => {
                let mut points = points(node, min..=max);
                points.resize(points.len().max(min), [0.0; 2]);
                points.into()
            }
            Domain::Certain => {
                let n = match own() {
                    Some(&ParameterValue::Whole(n)) => n,
                    _ => 0,
                };
                node.u32(n..=n).into()
            }
            Domain::Drawn(min, max) => drawn(node, |node| node.number(min..=max)).into(),
            Domain::DrawnWhole(min, max) => drawn(node, |node| node.u32(min..=max)).into(),
            Domain::Names => ParameterValue::Names(node.names()),
            Domain::Object(object) => {
                (object.read)(node, semantics, &within(given, self.key)).into()
            }
            Domain::Objects(object, max) => {
                let nodes = if node.is_list() { node.list(1..=max) } else { vec![node] };
                let one = |node| (object.read)(node, semantics, given);
                ParameterValue::Objects(nodes.into_iter().map(one).collect())
            }
        })
    }
}

/// Points `[x, y]`.
pub(crate) fn points(node: Node<'_>, lengths: RangeInclusive<usize>) -> Vec<[f64; 2]> {
    let point = |node| numbers(node, 2..=2).try_into().unwrap_or_default();
    node.list(lengths).into_iter().map(point).collect()
}

/// A number, or a range.
fn drawn<T: Copy + PartialOrd>(node: Node<'_>, read: impl Fn(Node<'_>) -> T) -> Drawn<T> {
    if !node.is_list() {
        return Drawn::always(read(node));
    }
    if node.descends() {
        node.problem("the range ends below its beginning; expected [low, high]");
    }
    let placeholder = node.silent();
    let ends: Vec<T> = node.list(2..=2).into_iter().map(&read).collect();
    match ends[..] {
        [low, high] if low <= high => Drawn { low, high },
        [low, _] => Drawn::always(low),
        _ => Drawn::always(read(placeholder)),
    }
}

fn numbers(node: Node<'_>, lengths: RangeInclusive<usize>) -> Vec<f64> {
    node.list(lengths).into_iter().map(Node::quantity).collect()
}
