//! How an evolutionary algorithm describes itself to the experiment file.
//!
//! An algorithm states its name, its parameters with their domains and defaults,
//! and its limits once, as an [`AlgorithmDescription`], next to its code in the
//! crate `evolution`. The reader, the JSON Schema, the checks and the table in
//! `docs/algorithms.md` all follow from the list of descriptions, which is an
//! argument of [`ExperimentConfig::from_json`](crate::ExperimentConfig::from_json).
//! So this crate knows no algorithm, and who only simulates needs none.

mod params;
mod schema;

use std::fmt;

use crate::limits;

pub use params::{AlgorithmParams, ParameterValue};
pub(crate) use schema::describe_algorithms;

/// What an experiment file may say about an algorithm, and what follows from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlgorithmDescription {
    /// Its name in the file, such as `"SNES"`.
    pub name: &'static str,
    /// Its name in words, as in "Separable natural evolution strategy".
    pub title: &'static str,
    /// What it adapts from generation to generation.
    pub learns: &'static str,
    /// Numbers that it keeps between generations, in terms of the genes d and the
    /// individuals P.
    pub state: &'static str,
    /// Of which order that is, for estimates of memory.
    pub keeps: Keeps,
    /// Fewest individuals per generation, at least 1.
    pub individuals_min: u32,
    /// How it makes use of the individuals of a generation.
    pub learns_from: LearnsFrom,
    /// Most genes of all populations together; none: no limit of its own.
    pub genes_max: Option<u64>,
    /// In the order of the canonical form.
    pub parameters: &'static [Parameter],
}

/// The largest of what an algorithm keeps between generations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keeps {
    /// A few vectors of genes.
    Vectors,
    /// A matrix with a row and a column per gene.
    Matrix,
    /// A population.
    Population,
}

/// How an algorithm makes use of the individuals of a generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LearnsFrom {
    /// Of their ranks.
    Ranks,
    /// Of their ranks, individuals being drawn in pairs, on both sides of the mean.
    Pairs,
}

/// So few individuals teach an algorithm next to nothing.
const FEW_INDIVIDUALS: u32 = 4;

/// One key of `params`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Its key in the file.
    pub key: &'static str,
    /// The values that it may have.
    pub domain: Domain,
    /// Its value where the file has none.
    pub default: DefaultValue,
    /// What it is, as a sentence without its full stop.
    pub meaning: &'static str,
}

/// The values that a parameter may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// A number above 0: from 1 / [`limits::MAGNITUDE`] to [`limits::MAGNITUDE`].
    Positive,
    /// A number in this closed interval.
    Between(f64, f64),
    /// A whole number in this closed interval.
    Whole(u32, u32),
    /// A whole number, at least 0 and below `population_size`.
    BelowPopulationSize,
    /// One of these names.
    OneOf {
        /// The names that are accepted.
        names: &'static [&'static str],
        /// Names of the original simulator that are refused as not supported.
        unsupported: &'static [&'static str],
    },
}

/// The value of a parameter where the file has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DefaultValue {
    /// This number.
    Number(f64),
    /// This whole number.
    Whole(u32),
    /// This name.
    Name(&'static str),
    /// The algorithm computes it by this formula, for instance from the number of
    /// genes d. The canonical form leaves the key out.
    Formula(&'static str),
}

impl AlgorithmDescription {
    /// The description of this name, if there is one.
    pub fn find<'a>(descriptions: &'a [Self], name: &str) -> Option<&'a Self> {
        descriptions.iter().find(|description| description.name == name)
    }

    /// What speaks against a population of this size, if it is accepted at all.
    pub fn advice(&self, population_size: u32) -> Option<String> {
        let name = self.name;
        match population_size {
            0 => None,
            1 => Some(format!(
                "with a single individual, {name} never learns, as there is nobody to compare it \
                 with; take {FEW_INDIVIDUALS} individuals or more"
            )),
            size if size < FEW_INDIVIDUALS => Some(format!(
                "{size} individuals teach {name} next to nothing; take {FEW_INDIVIDUALS} or more"
            )),
            size if self.learns_from == LearnsFrom::Pairs && size % 2 == 1 => Some(format!(
                "{name} draws individuals in pairs, and of {size} the last one is the mean itself, \
                 which teaches nothing; take {} or {}",
                size - 1,
                size + 1
            )),
            _ => None,
        }
    }

    /// Whether the algorithm has a parameter of this key.
    pub fn has(&self, key: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter.key == key)
    }
}

impl Parameter {
    /// A number above 0.
    pub const fn positive(key: &'static str, default: f64, meaning: &'static str) -> Self {
        Self { key, domain: Domain::Positive, default: DefaultValue::Number(default), meaning }
    }

    /// A number above 0 whose default the algorithm computes by `formula`.
    pub const fn computed(key: &'static str, formula: &'static str, meaning: &'static str) -> Self {
        Self { key, domain: Domain::Positive, default: DefaultValue::Formula(formula), meaning }
    }

    /// A number from 0 to [`limits::MAGNITUDE`].
    pub const fn amount(key: &'static str, default: f64, meaning: &'static str) -> Self {
        Self::between(key, [0.0, limits::MAGNITUDE], default, meaning)
    }

    /// A number in \[0, 1\]: a probability or the value of a gene.
    pub const fn unit(key: &'static str, default: f64, meaning: &'static str) -> Self {
        Self::between(key, [0.0, 1.0], default, meaning)
    }

    /// A standard deviation of genes: above 0 and at most 1.
    pub const fn deviation(key: &'static str, default: f64, meaning: &'static str) -> Self {
        Self::between(key, [1.0 / limits::MAGNITUDE, 1.0], default, meaning)
    }

    /// A number in a closed interval.
    pub const fn between(
        key: &'static str,
        [min, max]: [f64; 2],
        default: f64,
        meaning: &'static str,
    ) -> Self {
        let domain = Domain::Between(min, max);
        Self { key, domain, default: DefaultValue::Number(default), meaning }
    }

    /// A whole number in a closed interval.
    pub const fn whole(
        key: &'static str,
        [min, max]: [u32; 2],
        default: u32,
        meaning: &'static str,
    ) -> Self {
        let domain = Domain::Whole(min, max);
        Self { key, domain, default: DefaultValue::Whole(default), meaning }
    }

    /// A whole number below `population_size`.
    pub const fn below_population_size(
        key: &'static str,
        default: u32,
        meaning: &'static str,
    ) -> Self {
        let domain = Domain::BelowPopulationSize;
        Self { key, domain, default: DefaultValue::Whole(default), meaning }
    }

    /// One of `names`, the first of which is the default; `unsupported` are names
    /// of the original simulator that are refused as such.
    pub const fn one_of(
        key: &'static str,
        names: &'static [&'static str],
        unsupported: &'static [&'static str],
        meaning: &'static str,
    ) -> Self {
        let domain = Domain::OneOf { names, unsupported };
        Self { key, domain, default: DefaultValue::Name(names[0]), meaning }
    }
}

impl Domain {
    /// Whether `value` lies in the domain, in a population of this size.
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
    /// As in "must be ...".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Positive => write!(f, "positive and at most {}", limits::MAGNITUDE),
            Self::Between(min, max) => write!(f, "between {min} and {max}"),
            Self::Whole(min, max) => write!(f, "a whole number between {min} and {max}"),
            Self::BelowPopulationSize => f.write_str("a whole number below the population size"),
            Self::OneOf { names, .. } => write!(f, "one of `{}`", names.join("`, `")),
        }
    }
}

impl DefaultValue {
    /// The value; none if the algorithm computes it.
    pub fn value(self) -> Option<ParameterValue> {
        match self {
            Self::Number(number) => Some(ParameterValue::Number(number)),
            Self::Whole(number) => Some(ParameterValue::Whole(number)),
            Self::Name(name) => Some(ParameterValue::Name(name.to_owned())),
            Self::Formula(_) => None,
        }
    }
}
