//! Types whose fields are parameters.

use schemars::{JsonSchema, Schema, SchemaGenerator};

use super::read::Given;
use super::{Parameter, ParameterValue, Params};
use crate::node::Node;
use crate::semantics::Semantics;

/// The keys that an object of parameters may have.
#[derive(Debug, Clone, Copy)]
pub struct Table {
    /// The parameters, in the order of the canonical form.
    pub parameters: &'static [Parameter],
    /// Keys without effect, and why they have none.
    pub(crate) ignored: &'static [(&'static [&'static str], &'static str)],
    /// Keys without effect whose values are checked.
    pub(crate) checked: &'static [Parameter],
}

/// A type whose fields are parameters: its table, and the conversions from and to parameters.
pub trait Parameters: Sized + JsonSchema + 'static {
    /// The keys that an object of these parameters may have.
    const TABLE: Table;

    /// Such an object as the value of a parameter.
    const OBJECT: &'static Nested = &Nested {
        read: |node, semantics, given| {
            node.object(|o| super::read::table(o, &Self::TABLE, semantics, given))
        },
        absent: |semantics| super::read::absent::<Self>(semantics),
        schema: |generator| generator.subschema_for::<Self>(),
    };

    /// The value with these parameters. `params` has all of them.
    fn from_params(params: &Params) -> Self;

    /// Its parameters in the canonical form.
    fn to_params(&self) -> Params;
}

/// The variants of a type, as values of a parameter.
#[derive(Debug)]
pub struct Variants {
    pub(crate) names: fn() -> &'static [&'static str],
    pub(crate) read: fn(Node<'_>) -> Option<ParameterValue>,
    pub(crate) schema: fn(&mut SchemaGenerator) -> Schema,
}

/// An object of parameters, as the value of a parameter.
#[derive(Debug)]
pub struct Nested {
    pub(super) read: fn(Node<'_>, Semantics, &Given<'_>) -> Params,
    /// The parameters of an empty object.
    pub(super) absent: fn(Semantics) -> Params,
    pub(super) schema: fn(&mut SchemaGenerator) -> Schema,
}

impl Table {
    /// The parameter of a key.
    ///
    /// # Panics
    ///
    /// If the table lacks the key, which cannot happen, because tables and types are declared
    /// together.
    pub(crate) fn find(&self, key: &str) -> &'static Parameter {
        self.parameters.iter().find(|parameter| parameter.key == key).expect("a field's key")
    }
}

/// Declares types whose fields are parameters. A row has the field, its key in the file if that
/// differs, its type, and the constructor of its [`Parameter`] without key and meaning. With `:
/// Default`, the type implements `Default` by the defaults of its parameters. `parts` are fields
/// that the reader fills in itself, beginning with their `Default`; each has its schema.
macro_rules! parameters {
    ($(
        $(#[doc = $doc:literal])*
        $(#[derive($derive:ident)])?
        pub struct $name:ident $(: $default:ident)? $(then $transform:path)? {
            $(
                $(#[doc = $meaning:literal])*
                $field:ident $(as $key:literal)?: $type:ty =
                    $make:ident($($arg:expr),* $(,)?)
                    $(.$with:ident($($with_arg:expr),* $(,)?))*,
            )*
        }
        $(ignored { $($($ignored:literal),*: $why:literal;)* })?
        $(checked { $($checked:expr),* })?
        $(parts {$(
            $(#[doc = $part_meaning:literal])*
            $part:ident $(as $part_key:literal)?: $part_type:ty =
                $need:ident($part_schema:expr) $(unless $absent:path)?;
        )*})?
    )*) => {$(
        $(#[doc = $doc])*
        #[derive(Debug, Clone, PartialEq $(, $derive)?)]
        pub struct $name {
            $(
                $(#[doc = $meaning])*
                pub $field: $type,
            )*
            $($(
                $(#[doc = $part_meaning])*
                pub $part: $part_type,
            )*)?
        }

        impl $crate::Parameters for $name {
            const TABLE: $crate::parameters::Table = $crate::parameters::Table {
                parameters: &[$(
                    $crate::Parameter::$make(
                        $crate::parameters::key!($field $($key)?),
                        $($arg,)*
                        concat!($($meaning),*),
                    )$(.$with($($with_arg),*))*,
                )*],
                ignored: &[$($((&[$($ignored),*], $why),)*)?],
                checked: &[$($($checked),*)?],
            };

            fn from_params(_params: &$crate::Params) -> Self {
                Self {
                    $($field: _params.of_key($crate::parameters::key!($field $($key)?)),)*
                    $($($part: Default::default(),)*)?
                }
            }

            fn to_params(&self) -> $crate::Params {
                let _of = |key| <Self as $crate::Parameters>::TABLE.find(key);
                $crate::Params::default()$(.with_canonical(
                    _of($crate::parameters::key!($field $($key)?)),
                    self.$field.clone(),
                ))*
            }
        }

        impl From<$name> for $crate::ParameterValue {
            fn from(value: $name) -> Self {
                $crate::Parameters::to_params(&value).into()
            }
        }

        impl TryFrom<$crate::ParameterValue> for $name {
            type Error = $crate::ParameterValue;

            fn try_from(value: $crate::ParameterValue) -> Result<Self, Self::Error> {
                Ok($crate::Parameters::from_params(&value.try_into()?))
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(None)?;
                for (key, value) in $crate::Parameters::to_params(self).iter() {
                    serde::ser::SerializeMap::serialize_entry(&mut map, key, value)?;
                }
                $($(if !(false $(|| $absent(&self.$part))?) {
                    let key = $crate::parameters::key!($part $($part_key)?);
                    serde::ser::SerializeMap::serialize_entry(&mut map, key, &self.$part)?;
                })*)?
                serde::ser::SerializeMap::end(map)
            }
        }

        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                let mut _schema = $crate::parameters::object(
                    &<Self as $crate::Parameters>::TABLE,
                    concat!($($doc),*),
                    generator,
                );
                $($(
                    let _part: fn(&mut schemars::SchemaGenerator) -> schemars::Schema =
                        $part_schema;
                    $crate::parameters::add_part(
                        &mut _schema,
                        $crate::parameters::key!($part $($part_key)?),
                        concat!($($part_meaning),*),
                        stringify!($need) == "required",
                        _part(generator),
                    );
                )*)?
                $($transform(&mut _schema);)?
                _schema
            }
        }

        $(
            impl $default for $name {
                fn default() -> Self {
                    $crate::semantics::Semantics::Thesis.defaults()
                }
            }
        )?
    )*};
}

/// The key of a field.
macro_rules! key {
    ($field:ident) => {
        stringify!($field)
    };
    ($field:ident $key:literal) => {
        $key
    };
}

/// Makes the variants of a type, whose names `serde` knows, values of parameters. `unsupported`:
/// names of SpikeSwarmSim that are refused as not supported.
macro_rules! variants {
    ($($name:ident, unsupported: $unsupported:expr;)*) => {$(
        impl $name {
            /// Its variants by their names.
            pub(crate) const VARIANTS: &'static $crate::parameters::Variants =
                &$crate::parameters::Variants {
                    names: || $crate::variant::names::<Self>(),
                    read: |node| Some(node.variant::<Self>($unsupported)?.into()),
                    schema: |generator| generator.subschema_for::<Self>(),
                };
        }

        impl From<$name> for $crate::ParameterValue {
            fn from(value: $name) -> Self {
                match serde_json::to_value(value) {
                    Ok(serde_json::Value::String(name)) => Self::Name(name),
                    _ => Self::Null,
                }
            }
        }

        impl TryFrom<$crate::ParameterValue> for $name {
            type Error = $crate::ParameterValue;

            fn try_from(value: $crate::ParameterValue) -> Result<Self, Self::Error> {
                match &value {
                    $crate::ParameterValue::Name(name) => {
                        $crate::variant::variant(name).map_err(|_| value)
                    }
                    _ => Err(value),
                }
            }
        }
    )*};
}

pub(crate) use {key, parameters, variants};
