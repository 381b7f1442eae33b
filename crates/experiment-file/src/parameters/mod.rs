//! Declares each parameter once, as a [`Parameter`] with its key, its allowed values, its default
//! and its meaning. The reader, the refusals, the canonical form, the JSON Schema and the tables of
//! the documentation follow from these declarations.
//!
//! A kind with its own type declares that type with `parameters!`, one field per parameter. The
//! parameters of an algorithm are a plain table, because this crate knows no algorithm.

mod kinds;
mod read;
mod schema;
mod typed;
mod value;

use std::fmt;

use crate::limits;

pub(crate) use kinds::{Choice, bind, kind_table, kinds, kinds_schema, read_kind, serialize_kind};
pub use kinds::{Kind, Kinds};
pub(crate) use read::{Given, Keys, defaults, inner, optional, params, points, read, within};
pub(crate) use schema::{add_part, list, object, points_schema, properties};
pub use typed::{Nested, Parameters, Table, Variants};
pub(crate) use typed::{key, parameters, variants};
pub use value::{ParameterValue, Params};

/// One key of a file.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its key in the file.
    pub key: &'static str,
    /// The allowed values.
    pub domain: Domain,
    /// Its value if the file has none.
    pub default: DefaultValue,
    /// Its description. [`description`](Self::description) adds the default to the first sentence.
    pub meaning: &'static str,
    /// Its unit, if programs need it; otherwise `meaning` has the unit.
    pub unit: &'static str,
    /// Its default under the semantics of SpikeSwarmSim, if that differs.
    pub(crate) original: Option<Original>,
    /// The default for people, if that is more than the value.
    default_text: &'static str,
    /// Another key for the same quantity.
    also: Option<Also>,
    /// The key of an earlier parameter that this one replaces: at most one of the two has a value.
    instead_of: Option<&'static str>,
    /// Whether null is allowed, which stands for no value.
    is_nullable: bool,
    /// Whether the canonical form omits the default. This holds for parameters that are newer than
    /// the format, so that older files keep their digests.
    is_recent: bool,
    /// Whether the canonical form omits the key if the value is 0.
    is_absent_at_zero: bool,
}

/// The values that a parameter may have.
#[derive(Debug, Clone, Copy)]
pub enum Domain {
    /// A number above 0: from 1 / [`limits::MAGNITUDE`] to [`limits::MAGNITUDE`].
    Positive,
    /// A number in this closed interval.
    Between(f64, f64),
    /// A whole number in this closed interval.
    Whole(u32, u32),
    /// A whole number, at least 0 and below `population_size`.
    BelowPopulationSize,
    /// A whole number up to this one, or `"all"`, which is the default.
    WholeOrAll(u32),
    /// One of these names.
    OneOf {
        /// The names that are accepted.
        names: &'static [&'static str],
        /// Names of SpikeSwarmSim that are refused as not supported.
        unsupported: &'static [&'static str],
    },
    /// The name of a variant of a type.
    Variant(&'static Variants),
    /// A whole number of 64 bits, or a text of its digits.
    Seed,
    /// Any name.
    Text,
    /// True or false.
    Switch,
    /// A list of numbers, with its smallest and its largest length.
    Numbers(usize, usize),
    /// A list of at most this many lists of numbers. Other parts of the file determine the length
    /// of each.
    Vectors(usize),
    /// A list of points `[x, y]`, with its smallest and its largest length.
    Points(usize, usize),
    /// The only whole number that other parts of the file allow.
    Certain,
    /// A number in this closed interval, or a range `[low, high]` in it.
    Drawn(f64, f64),
    /// A whole number in this closed interval, or a range `[low, high]` in it.
    DrawnWhole(u32, u32),
    /// A name, or a list of them.
    Names,
    /// An object of parameters.
    Object(&'static Nested),
    /// Such an object, or a list of at most this many.
    Objects(&'static Nested, usize),
}

/// The value of a parameter if the file has none.
#[derive(Debug, Clone, Copy)]
pub enum DefaultValue {
    /// This number.
    Number(f64),
    /// This whole number.
    Whole(u32),
    /// This name.
    Name(&'static str),
    /// True or false.
    Switch(bool),
    /// These numbers.
    Numbers(&'static [f64]),
    /// No value: null if the parameter allows it, otherwise no key.
    Null,
    /// The algorithm computes the value by this formula, for instance from the number of genes d.
    /// The canonical form omits the key.
    Formula(&'static str),
    /// The value depends on other parts of the file, as this text describes.
    Depends(&'static str),
    /// The object without any key.
    Empty,
    /// The only value that other parts of the file allow.
    Certain,
    /// No default: a file must have the key.
    Required,
}

/// The default of SpikeSwarmSim.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Original {
    /// This value.
    Value(DefaultValue),
    /// A number that follows from earlier parameters.
    From(fn(&Params) -> f64),
}

/// A second key for the quantity of a parameter, with another scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Also {
    /// Its key.
    pub key: &'static str,
    /// Its largest number. The smallest is 0 or, if the parameter is positive, just above 0.
    pub max: f64,
    /// Its description.
    pub meaning: &'static str,
    /// Converts its number to the value of the parameter.
    pub value: fn(f64) -> f64,
}

/// A row per constructor of a [`Parameter`]: its arguments between key and meaning, the domain
/// and the default.
macro_rules! constructors {
    ($(
        $(#[$doc:meta])*
        $vis:vis $name:ident($($arg:ident: $type:ty),*) = $domain:expr, $default:expr;
    )*) => {
        impl Parameter {$(
            $(#[$doc])*
            $vis const fn $name(key: &'static str, $($arg: $type,)* meaning: &'static str) -> Self {
                Self {
                    key,
                    domain: $domain,
                    default: $default,
                    meaning,
                    unit: "",
                    original: None,
                    default_text: "",
                    also: None,
                    instead_of: None,
                    is_nullable: false,
                    is_recent: false,
                    is_absent_at_zero: false,
                }
            }
        )*}
    };
}

constructors! {
    /// A parameter of any domain.
    pub of(domain: Domain, default: DefaultValue) = domain, default;
    /// A number above 0.
    pub positive(default: f64) = Domain::Positive, DefaultValue::Number(default);
    /// A number above 0 whose default the algorithm computes by `formula`.
    pub computed(formula: &'static str) = Domain::Positive, DefaultValue::Formula(formula);
    /// A number from 0 to [`limits::MAGNITUDE`].
    pub amount(default: f64) =
        Domain::Between(0.0, limits::MAGNITUDE), DefaultValue::Number(default);
    /// A number of either sign, up to [`limits::MAGNITUDE`].
    pub quantity(default: f64) = Domain::QUANTITY, DefaultValue::Number(default);
    /// A number in \[0, 1\]: a probability or the value of a gene.
    pub unit(default: f64) = Domain::Between(0.0, 1.0), DefaultValue::Number(default);
    /// A standard deviation of genes: above 0 and at most 1.
    pub deviation(default: f64) =
        Domain::Between(1.0 / limits::MAGNITUDE, 1.0), DefaultValue::Number(default);
    /// A number in a closed interval.
    pub between(range: [f64; 2], default: f64) =
        Domain::Between(range[0], range[1]), DefaultValue::Number(default);
    /// A whole number in a closed interval.
    pub whole(range: [u32; 2], default: u32) =
        Domain::Whole(range[0], range[1]), DefaultValue::Whole(default);
    /// A number in a closed interval, or a range from which each trial draws.
    pub(crate) drawn(range: [f64; 2], default: f64) =
        Domain::Drawn(range[0], range[1]), DefaultValue::Number(default);
    /// A whole number in a closed interval, or a range from which each trial draws.
    pub(crate) drawn_whole(range: [u32; 2], default: u32) =
        Domain::DrawnWhole(range[0], range[1]), DefaultValue::Whole(default);
    /// A whole number below `population_size`.
    pub below_population_size(default: u32) =
        Domain::BelowPopulationSize, DefaultValue::Whole(default);
    /// One of `names`, the first of which is the default. `unsupported`: names of SpikeSwarmSim
    /// that are refused as not supported.
    pub one_of(names: &'static [&'static str], unsupported: &'static [&'static str]) =
        Domain::OneOf { names, unsupported }, DefaultValue::Name(names[0]);
    /// A name, for instance of a colour.
    pub(crate) text(default: &'static str) = Domain::Text, DefaultValue::Name(default);
    /// True or false.
    pub(crate) switch(default: bool) = Domain::Switch, DefaultValue::Switch(default);
    /// An object of parameters, or none if the file has no such key.
    pub(crate) optional(object: &'static Nested) = Domain::Object(object), DefaultValue::Null;
}

/// A row per way to change a [`Parameter`]: the fields that it sets.
macro_rules! setters {
    ($(
        $(#[$doc:meta])*
        $vis:vis $name:ident($($arg:ident: $type:ty),*) = $($field:ident: $value:expr),*;
    )*) => {
        impl Parameter {$(
            $(#[$doc])*
            $vis const fn $name(self, $($arg: $type),*) -> Self {
                Self { $($field: $value,)* ..self }
            }
        )*}
    };
}

setters! {
    /// The same with a unit.
    pub(crate) measured(unit: &'static str) = unit: unit;
    /// The same with another default under the semantics of SpikeSwarmSim.
    pub(crate) original(default: DefaultValue) = original: Some(Original::Value(default));
    /// The same with a default under the semantics of SpikeSwarmSim that follows from earlier
    /// parameters.
    pub(crate) original_from(default: fn(&Params) -> f64) = original: Some(Original::From(default));
    /// The same with this text for the default.
    pub(crate) shown(text: &'static str) = default_text: text;
    /// The same with a second key for its quantity.
    pub(crate) also(also: Also) = also: Some(also);
    /// The same as a replacement of an earlier parameter.
    pub(crate) instead_of(key: &'static str) = instead_of: Some(key);
    /// The same, with null allowed.
    pub(crate) or_null() = is_nullable: true;
    /// The same, with null allowed, which is then the default.
    pub(crate) null() = is_nullable: true, default: DefaultValue::Null;
    /// The same, omitted from the canonical form if it has its default.
    pub recent() = is_recent: true;
    /// The same, omitted from the canonical form if it is 0.
    pub(crate) unless_zero() = is_absent_at_zero: true;
}

impl Parameter {
    /// Whether the canonical form omits the key for this value.
    pub(crate) fn is_left_out(&self, value: &ParameterValue) -> bool {
        let is_default = || self.default.value().as_ref() == Some(value);
        let is_none = match value {
            ParameterValue::Null => !self.is_nullable,
            ParameterValue::Objects(objects) => objects.is_empty(),
            ParameterValue::Object(object) => self.is_recent && object.iter().next().is_none(),
            ParameterValue::Whole(0) => self.is_absent_at_zero,
            _ => false,
        };
        self.is_recent && is_default() || is_none
    }

    /// One or more sentences, with the default at the end of the first.
    pub fn description(&self) -> String {
        let text = self.meaning.trim().trim_end_matches('.');
        let starts = |at: &usize| text[at + 2..].starts_with(char::is_uppercase);
        let end = text.match_indices(". ").map(|(at, _)| at).find(starts);
        let (first, rest) = end.map_or((text, ""), |end| text.split_at(end));
        let unit = if self.unit.is_empty() { "" } else { ", " };
        let default = self.default_text().map_or(String::new(), |text| format!("; default {text}"));
        format!("{first}{unit}{}{default}{rest}.", self.unit)
    }

    fn default_text(&self) -> Option<String> {
        if !self.default_text.is_empty() {
            return Some(self.default_text.to_owned());
        }
        Some(match self.default {
            DefaultValue::Number(number) => number.to_string(),
            DefaultValue::Whole(number) => number.to_string(),
            DefaultValue::Name(name) if matches!(self.domain, Domain::Text) => format!("{name:?}"),
            DefaultValue::Name(name) => format!("`{name}`"),
            DefaultValue::Switch(switch) => switch.to_string(),
            DefaultValue::Numbers(numbers) => format!("{numbers:?}"),
            DefaultValue::Null if self.is_nullable => "null".to_owned(),
            DefaultValue::Formula(text) | DefaultValue::Depends(text) if !text.is_empty() => {
                text.to_owned()
            }
            _ => return None,
        })
    }
}

impl Domain {
    /// A number of either sign.
    pub const QUANTITY: Self = Self::Between(-limits::MAGNITUDE, limits::MAGNITUDE);

    /// Whether `value` lies in the domain, in a population of this size. Only for domains of
    /// parameters of algorithms.
    pub fn contains(&self, value: &ParameterValue, population_size: u32) -> bool {
        match (*self, value) {
            (Self::Positive, &ParameterValue::Number(x)) => {
                (limits::MAGNITUDE.recip()..=limits::MAGNITUDE).contains(&x)
            }
            (Self::Between(min, max), &ParameterValue::Number(x)) => (min..=max).contains(&x),
            (Self::Whole(min, max), &ParameterValue::Whole(n)) => (min..=max).contains(&n),
            (Self::BelowPopulationSize, &ParameterValue::Whole(n)) => n < population_size,
            (Self::OneOf { names, .. }, ParameterValue::Name(name)) => {
                names.contains(&name.as_str())
            }
            _ => false,
        }
    }
}

impl fmt::Display for Domain {
    /// Completes "must be ...". Only for domains of parameters of algorithms.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Positive => write!(f, "positive and at most {}", limits::MAGNITUDE),
            Self::Between(min, max) => write!(f, "between {min} and {max}"),
            Self::Whole(min, max) => write!(f, "a whole number between {min} and {max}"),
            Self::BelowPopulationSize => f.write_str("a whole number below the population size"),
            Self::OneOf { names, .. } => write!(f, "one of `{}`", names.join("`, `")),
            _ => f.write_str("of its kind"),
        }
    }
}

impl DefaultValue {
    /// The value; `None` if something else determines it.
    pub fn value(self) -> Option<ParameterValue> {
        match self {
            Self::Number(number) => Some(ParameterValue::Number(number)),
            Self::Whole(number) => Some(ParameterValue::Whole(number)),
            Self::Name(name) => Some(ParameterValue::Name(name.to_owned())),
            Self::Switch(switch) => Some(ParameterValue::Switch(switch)),
            Self::Numbers(numbers) => Some(ParameterValue::Numbers(numbers.to_vec())),
            Self::Null => Some(ParameterValue::Null),
            _ => None,
        }
    }
}
