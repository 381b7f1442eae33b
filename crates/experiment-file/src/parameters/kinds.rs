//! Types whose variants each have parameters. In a file, a value of such a type is an object with
//! the name of the variant and its `params`.

use schemars::{Schema, SchemaGenerator, json_schema};
use serde::Serializer;
use serde::ser::SerializeMap as _;
use serde_json::{Value, json};

use super::read::{Given, table};
use super::{Params, Table, object};
use crate::node;
use crate::semantics::Semantics;

/// A type whose variants each have parameters.
pub trait Kinds: Sized {
    /// The key of the variant's name.
    const TAG: &'static str;
    /// The variants.
    const KINDS: &'static [Kind];

    /// The variant of this name. `params` has all of its parameters.
    fn from_params(name: &str, params: &Params) -> Option<Self>;

    /// The name of the variant, and its parameters in the canonical form.
    fn to_params(&self) -> (&'static str, Params);
}

/// A variant.
#[derive(Debug)]
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// Its description, in sentences.
    pub meaning: &'static str,
    /// Its parameters.
    pub table: Table,
    /// The schema of the type of the parameters, if they have a type of their own.
    pub(crate) schema: &'static [fn(&mut SchemaGenerator) -> Schema],
}

/// The variants that a place in a file accepts.
pub(crate) struct Choice<'a> {
    /// Their names.
    pub names: Vec<&'static str>,
    /// Names of SpikeSwarmSim that are refused as not supported.
    pub unsupported: &'a [&'a str],
    /// The variant if the file names none; `None` if the file has to name one.
    pub default: Option<&'static str>,
}

impl<'a> Choice<'a> {
    /// Any variant.
    pub(crate) fn any<T: Kinds>(unsupported: &'a [&'a str]) -> Self {
        let names = T::KINDS.iter().map(|kind| kind.name).collect();
        Self { names, unsupported, default: None }
    }
}

/// Reads a variant; `None` if its name is unreadable.
pub(crate) fn read_kind<T: Kinds>(
    o: &mut node::Object<'_>,
    choice: &Choice<'_>,
    semantics: Semantics,
    given: &Given<'_>,
) -> Option<T> {
    let named = |node: node::Node<'_>| node.one_of(&choice.names, choice.unsupported);
    let name = match choice.default {
        Some(default) => o.or(T::TAG, Some(default), named),
        None => named(o.required(T::TAG)),
    };
    let Some(kind) = T::KINDS.iter().find(|kind| Some(kind.name) == name) else {
        o.accept_rest();
        return None;
    };
    T::from_params(kind.name, &o.inner("params", |o| table(o, &kind.table, semantics, given)))
}

pub(crate) fn serialize_kind<T: Kinds, S: Serializer>(
    value: &T,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let (name, params) = value.to_params();
    let mut map = serializer.serialize_map(Some(2))?;
    map.serialize_entry(T::TAG, name)?;
    map.serialize_entry("params", &params)?;
    map.end()
}

pub(crate) fn kinds_schema<T: Kinds>(meaning: &str, generator: &mut SchemaGenerator) -> Schema {
    let variants = T::KINDS.iter().map(|kind| {
        let needs_params = kind.table.parameters.iter().any(|parameter| parameter.is_required());
        let required = if needs_params { json!([T::TAG, "params"]) } else { json!([T::TAG]) };
        json!({
            "type": "object",
            "description": kind.meaning.trim(),
            "properties": {
                (T::TAG): {"type": "string", "const": kind.name},
                "params": match kind.schema {
                    [schema] => schema(generator),
                    _ => object(&kind.table, "", generator),
                },
            },
            "required": required,
            "additionalProperties": false,
        })
    });
    let variants: Vec<Value> = variants.collect();
    json_schema!({"description": meaning.trim(), "oneOf": variants})
}

/// Declares a type whose variants each have parameters: fields, declared as in `parameters!`, or a
/// type of parameters. A row ends with the variant's name in files. The function after `then` adds
/// other notations of variants to the schema.
macro_rules! kinds {
    (
        $(#[doc = $doc:literal])*
        $(#[derive($derive:ident)])?
        pub enum $name:ident by $tag:literal $(then $transform:path)? {$(
            $(#[doc = $kind_doc:literal])*
            $variant:ident
            $(($inner:ty))?
            $({$(
                $(#[doc = $meaning:literal])*
                $field:ident: $type:ty =
                    $make:ident($($arg:expr),* $(,)?)
                    $(.$with:ident($($with_arg:expr),* $(,)?))*,
            )*})?
            $(ignored($ignored:literal: $why:literal))?
            = $key:literal,
        )*}
        $(checked { $($checked:expr),* })?
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, PartialEq $(, $derive)?)]
        pub enum $name {$(
            $(#[doc = $kind_doc])*
            $variant $(($inner))? $({$($(#[doc = $meaning])* $field: $type,)*})?,
        )*}

        impl $name {
            const CHECKED: &'static [$crate::Parameter] = &[$($($checked),*)?];
        }

        impl $crate::Kinds for $name {
            const TAG: &'static str = $tag;
            const KINDS: &'static [$crate::parameters::Kind] = &[$($crate::parameters::Kind {
                name: $key,
                meaning: concat!($($kind_doc),*),
                table: $crate::parameters::kind_table!(
                    [$(type $inner)? $(
                        $($crate::Parameter::$make(
                            stringify!($field),
                            $($arg,)*
                            concat!($($meaning),*),
                        )$(.$with($($with_arg),*))*,)*
                        ;
                    )?]
                    [$((&[$ignored], $why))?]
                    [Self::CHECKED]
                ),
                schema: &[$(|generator| generator.subschema_for::<$inner>())?],
            },)*];

            fn from_params(name: &str, _params: &$crate::Params) -> Option<Self> {
                match name {
                    $($key => Some(Self::$variant
                        $((<$inner as $crate::Parameters>::from_params(_params)))?
                        $({$($field: _params.of_key(stringify!($field)),)*})?
                    ),)*
                    _ => None,
                }
            }

            fn to_params(&self) -> (&'static str, $crate::Params) {
                let _of = |kind: &str, key: &str| {
                    let kind = Self::KINDS.iter().find(|known| known.name == kind);
                    kind.expect("a variant's name").table.find(key)
                };
                match self {
                    $(Self::$variant
                        $(($crate::parameters::bind!(_inner $inner)))?
                        $({$($field,)*})?
                    => {
                        let params = $crate::Params::default()
                            $($(.with_canonical(_of($key, stringify!($field)), $field.clone()))*)?;
                        $(let params: $crate::Params = {
                            let _ = params;
                            <$inner as $crate::Parameters>::to_params(_inner)
                        };)?
                        ($key, params)
                    })*
                }
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                $crate::parameters::serialize_kind(self, serializer)
            }
        }

        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            #[allow(unused_mut, reason = "only a type with `then` changes the schema")]
            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                let mut schema =
                    $crate::parameters::kinds_schema::<Self>(concat!($($doc),*), generator);
                $($transform(&mut schema);)?
                schema
            }
        }
    };
}

/// The table of a variant: that of its type of parameters, or that of its fields.
macro_rules! kind_table {
    ([type $inner:ty] [$($ignored:expr)?] [$checked:expr]) => {
        <$inner as $crate::Parameters>::TABLE
    };
    ([$($parameter:expr,)* ;] [$($ignored:expr)?] [$checked:expr]) => {
        $crate::parameters::Table {
            parameters: &[$($parameter),*],
            ignored: &[$($ignored)?],
            checked: $checked,
        }
    };
}

/// Replaces a type by a name, for patterns.
macro_rules! bind {
    ($name:ident $type:ty) => {
        $name
    };
}

pub(crate) use {bind, kind_table, kinds};
