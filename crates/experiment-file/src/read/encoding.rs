//! Reads `topology.encoding`.

use super::node::{Node, Object};
use crate::report::suggestion;
use crate::{
    EncodingConfig, EncodingScheme, GaussianField, LinearField, NamedMap, ReceptiveField,
    SlopedField, StimulusConfig, limits,
};

const IDENTITY: &str = "IdentityEncoding";
const SCHEMES: [&str; 4] = [IDENTITY, "LIF_Encoding", "PoissonRateCoding", "RankOrderCoding"];
const FIELDS: [&str; 6] = [
    "identity_receptive_field",
    "gaussian_receptive_field",
    "triangular_receptive_field",
    "conic_receptive_field",
    "parabolic_receptive_field",
    "linear_receptive_field",
];

/// The encoders; stimuli that act as they are have none.
pub(super) fn encodings(
    o: &mut Object<'_>,
    stimuli: &NamedMap<StimulusConfig>,
    time_scale: u32,
) -> NamedMap<EncodingConfig> {
    let Some(node) = o.optional("encoding") else { return NamedMap::new() };
    let entries = node.map(0, |name, node| {
        if !stimuli.is_empty() && !stimuli.contains_key(name) {
            let names: Vec<_> = stimuli.keys().collect();
            node.problem(|| format!("no stimulus has this name; {}", suggestion(name, &names)));
        }
        node.object(|o| encoding(o, time_scale))
    });
    entries.into_iter().filter_map(|(name, entry)| Some((name, entry?))).collect()
}

/// None of the identity, or of what is unreadable.
fn encoding(o: &mut Object<'_>, time_scale: u32) -> Option<EncodingConfig> {
    let scheme = match o.required("scheme").one_of(&SCHEMES, &[]) {
        Some("LIF_Encoding") => EncodingScheme::Lif,
        Some("PoissonRateCoding") => EncodingScheme::PoissonRate,
        Some("RankOrderCoding") => EncodingScheme::RankOrder,
        Some(_) => {
            o.ignored("receptive_field", "`IdentityEncoding` has none");
            return None;
        }
        None => {
            o.accept_rest();
            return None;
        }
    };
    // What a node yields far from its centre and there.
    let values = match scheme {
        EncodingScheme::RankOrder => [1.0, f64::from(time_scale)],
        EncodingScheme::Lif | EncodingScheme::PoissonRate => [0.0, 1.0],
    };
    let receptive_field = o.inner("receptive_field", |o| receptive_field(o, values));
    Some(EncodingConfig { scheme, receptive_field })
}

fn receptive_field(o: &mut Object<'_>, values: [f64; 2]) -> ReceptiveField {
    let name = o.or("name", Some("gaussian_receptive_field"), |node| node.one_of(&FIELDS, &[]));
    let Some(name) = name else {
        o.accept_rest();
        return ReceptiveField::Identity {};
    };
    o.inner("params", |o| match name {
        "identity_receptive_field" => ReceptiveField::Identity {},
        "linear_receptive_field" => ReceptiveField::Linear(LinearField { n_neurons: n_neurons(o) }),
        "gaussian_receptive_field" => ReceptiveField::Gaussian(GaussianField {
            sigma: o.or("sigma", 6.0, steepness),
            n_neurons: n_neurons(o),
            min_stim: o.or("min_stim", 0.0, value),
            max_stim: o.or("max_stim", 1.0, value),
            min_val: o.or("min_val", values[0], value),
            max_val: o.or("max_val", values[1], value),
            inverted: o.or("inverted", false, Node::bool),
        }),
        name => {
            let field = SlopedField {
                slope: o.or("slope", 5.0, steepness),
                n_neurons: n_neurons(o),
                min_stim: o.or("min_stim", 0.0, value),
                max_stim: o.or("max_stim", 1.0, value),
                min_val: o.or("min_val", values[0], value),
                max_val: o.or("max_val", values[1], value),
                inverted: o.or("inverted", false, Node::bool),
            };
            match name {
                "triangular_receptive_field" => ReceptiveField::Triangular(field),
                "conic_receptive_field" => ReceptiveField::Conic(field),
                _ => ReceptiveField::Parabolic(field),
            }
        }
    })
}

fn n_neurons(o: &mut Object<'_>) -> u32 {
    o.or("n_neurons", 1, |node| node.u32(1..=limits::FIELD_NODES))
}

fn steepness(node: Node<'_>) -> f64 {
    node.number(0.0..=limits::STEEPNESS)
}

fn value(node: Node<'_>) -> f64 {
    node.number(-limits::FIELD_VALUE..=limits::FIELD_VALUE)
}
