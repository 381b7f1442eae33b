//! The neuron models, and the keys of each in experiment files.
//!
//! A model has its parameters, queries and costs in a [`NeuronModelSpec`]. The reader, the JSON
//! Schema, the queries of the genotype, the budget and the canonical form all follow from it, and
//! so does the decoding of genes in `sim-core`. To add a model, add a file beside `rate`, a
//! variant of [`NeuronModel`] here, and the model's dynamics in `sim-core`.

mod adex;
mod exp_lif;
mod izhikevich;
mod lif;
mod morris_lecar;
mod rate;

use std::borrow::Cow;
use std::fmt;
use std::ops::RangeInclusive;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};
use serde_json::json;

use super::{Activation, NamedMap};
use crate::{Domain, Parameter, ParameterValue, Variants, parameters};

/// How the neurons of a network work; all of them have the same model.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum NeuronModel {
    /// Continuous-time recurrent neural network of rate neurons (CTRNN).
    #[default]
    Rate,
    /// Leaky integrate and fire.
    Lif,
    /// Exponential integrate and fire (Fourcaud-Trocme et al. 2003).
    ExpLif,
    /// Adaptive exponential integrate and fire (Brette and Gerstner 2005).
    AdEx,
    /// Izhikevich 2003.
    Izhikevich,
    /// Morris and Lecar 1981.
    MorrisLecar,
}

/// Voltages of spiking neurons, mV.
pub(super) const VOLTAGE: [f64; 2] = [-200.0, 200.0];
/// Time constants of spiking neurons, ms.
pub(super) const TIME: [f64; 2] = [0.01, 10_000.0];

/// The specification of a neuron model: its keys in experiment files, and its costs.
#[derive(Debug)]
pub struct NeuronModelSpec {
    /// Its names in files; the canonical form uses the first.
    pub names: &'static [&'static str],
    /// Whether its neurons emit spikes. Then times are ms and voltages mV; otherwise times
    /// are seconds and neurons have activities.
    pub is_spiking: bool,
    /// The parameters of a neuron, in the order of the canonical form.
    pub parameters: &'static [NeuronParameter],
    /// The default activation function of an ensemble; `None` for a model whose neurons have
    /// none.
    pub activation: Option<Activation>,
    /// Number of values that a worker keeps per neuron and robot, for the budget.
    pub states_per_neuron: u64,
    /// Operations per neuron and network substep, for the budget; a synapse has 1.
    pub operations_per_neuron: u64,
}

/// A parameter of a model's neurons.
#[derive(Debug, Clone, Copy)]
pub struct NeuronParameter {
    /// Its key, domain and default in files.
    pub parameter: Parameter,
    /// Other names in queries.
    pub aliases: &'static [&'static str],
    /// The scale of a gene's bounds; `None` if the parameter cannot evolve.
    pub gene: Option<GeneScale>,
    /// Whether an Euler step longer than twice its value makes the network diverge.
    pub is_time_constant: bool,
}

/// Converts a number between a query's `min_vals` and `max_vals` to a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GeneScale {
    /// The number itself.
    Linear,
    /// `factor` * 10^number.
    PowerOfTen {
        /// The value that 0 stands for.
        factor: f64,
    },
}

impl NeuronModel {
    /// Every model.
    pub const ALL: [Self; 6] =
        [Self::Rate, Self::Lif, Self::ExpLif, Self::AdEx, Self::Izhikevich, Self::MorrisLecar];

    /// Its specification.
    pub fn spec(self) -> &'static NeuronModelSpec {
        match self {
            Self::Rate => &rate::SPEC,
            Self::Lif => &lif::SPEC,
            Self::ExpLif => &exp_lif::SPEC,
            Self::AdEx => &adex::SPEC,
            Self::Izhikevich => &izhikevich::SPEC,
            Self::MorrisLecar => &morris_lecar::SPEC,
        }
    }

    /// Whether its neurons emit spikes.
    pub fn is_spiking(self) -> bool {
        self.spec().is_spiking
    }

    /// The name in the canonical form.
    pub fn name(self) -> &'static str {
        self.spec().names[0]
    }

    /// The `params` of an ensemble that sets none: every parameter with its default.
    pub fn default_params(self) -> NamedMap<f64> {
        let parameters = self.spec().parameters.iter();
        parameters.map(|parameter| (parameter.name().to_owned(), parameter.default())).collect()
    }

    /// The names of all models.
    pub(super) fn names() -> Vec<&'static str> {
        Self::ALL.iter().flat_map(|model| model.spec().names).copied().collect()
    }

    /// The model of this name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.spec().names.contains(&name))
    }

    /// Models by their names.
    pub(crate) const VARIANTS: &'static Variants = &Variants {
        names: || &["rate_model"],
        read: |node| Some(node.one_of(&Self::names(), &[])?.into()),
        schema: |generator| generator.subschema_for::<Self>(),
    };
}

impl NeuronModelSpec {
    /// The parameter of this name.
    pub fn parameter(&self, name: &str) -> Option<&NeuronParameter> {
        self.parameters.iter().find(|parameter| parameter.name() == name)
    }

    /// The parameters' keys, domains and defaults in files.
    pub(super) fn table(&self) -> Vec<Parameter> {
        self.parameters.iter().map(|parameter| parameter.parameter).collect()
    }

    /// The parameters that a query can name.
    pub fn evolvable(&self) -> impl Iterator<Item = &NeuronParameter> {
        self.parameters.iter().filter(|parameter| parameter.gene.is_some())
    }
}

/// Every parameter that a query can name, of all models. A name that several models share appears
/// once.
pub(super) fn evolvable_parameters() -> Vec<&'static NeuronParameter> {
    let mut found: Vec<&NeuronParameter> = Vec::new();
    for parameter in NeuronModel::ALL.iter().flat_map(|model| model.spec().evolvable()) {
        if found.iter().all(|other| other.name() != parameter.name()) {
            found.push(parameter);
        }
    }
    found
}

impl GeneScale {
    /// The value that a number stands for.
    pub fn value(self, number: f64) -> f64 {
        match self {
            Self::Linear => number,
            Self::PowerOfTen { factor } => factor * libm::pow(10.0, number),
        }
    }

    /// The conversion of a number to a value, for people.
    pub(super) fn formula(self, number: f64) -> String {
        match self {
            Self::Linear => number.to_string(),
            Self::PowerOfTen { factor } => format!("{factor} * 10^{number}"),
        }
    }
}

impl From<NeuronModel> for ParameterValue {
    fn from(model: NeuronModel) -> Self {
        model.name().into()
    }
}

impl TryFrom<ParameterValue> for NeuronModel {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        let ParameterValue::Name(name) = &value else { return Err(value) };
        Self::named(name).ok_or(value)
    }
}

impl Serialize for NeuronModel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl JsonSchema for NeuronModel {
    fn schema_name() -> Cow<'static, str> {
        "NeuronModel".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "How the neurons of the network work.",
            "enum": Self::names(),
        })
    }
}

/// Schema of an ensemble's `params`: the parameters of one of the models.
pub(super) fn params_schema(generator: &mut SchemaGenerator) -> Schema {
    let activation = generator.subschema_for::<Activation>();
    let of_model = |model: NeuronModel| {
        let spec = model.spec();
        let mut properties = parameters::properties(&spec.table(), &mut SchemaGenerator::default());
        if spec.activation.is_some() {
            let mut activation = activation.clone().to_value();
            activation["description"] = json!("The same as `activation` beside `params`.");
            properties.insert("activation".to_owned(), activation);
        }
        json_schema!({
            "type": "object",
            "title": model.name(),
            "properties": properties,
            "additionalProperties": false,
        })
    };
    json_schema!({"anyOf": NeuronModel::ALL.map(of_model)})
}

impl NeuronParameter {
    /// A parameter that evolves, whose genes are on the scale of its values.
    const fn linear(
        name: &'static str,
        unit: &'static str,
        default: f64,
        range: [f64; 2],
        meaning: &'static str,
    ) -> Self {
        Self {
            parameter: Parameter::between(name, range, default, meaning).measured(unit),
            aliases: &[],
            gene: Some(GeneScale::Linear),
            is_time_constant: false,
        }
    }

    /// A time constant that evolves, ms.
    const fn time_constant(name: &'static str, default: f64, meaning: &'static str) -> Self {
        let linear = Self::linear(name, "ms", default, TIME, meaning);
        Self { is_time_constant: true, ..linear }
    }

    /// The substeps after a spike in which a neuron takes no current.
    const fn refractory_substeps(default: u32) -> Self {
        let meaning = "Substeps after a spike in which the neuron takes no current";
        let parameter = Parameter::whole("time_refrac", [0, 1_000], default, meaning);
        Self { parameter, aliases: &[], gene: None, is_time_constant: false }
    }

    /// Its name in `params` and in queries.
    pub fn name(&self) -> &'static str {
        self.parameter.key
    }

    /// Its value if neither the file nor a gene states one.
    pub fn default(&self) -> f64 {
        self.parameter.default.value().and_then(|value| value.number()).unwrap_or_default()
    }

    /// Range of its values, from a file or from a gene.
    pub fn range(&self) -> RangeInclusive<f64> {
        match self.parameter.domain {
            Domain::Between(min, max) => min..=max,
            Domain::Whole(min, max) => min.into()..=max.into(),
            _ => f64::MIN..=f64::MAX,
        }
    }

    /// Whether its values are whole numbers.
    pub fn is_whole(&self) -> bool {
        matches!(self.parameter.domain, Domain::Whole(..))
    }

    /// A value with its unit.
    pub fn with_unit(&self, value: impl fmt::Display) -> String {
        let unit = self.parameter.unit;
        if unit.is_empty() { value.to_string() } else { format!("{value} {unit}") }
    }
}
