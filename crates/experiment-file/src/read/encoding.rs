//! Reads `topology.encoding`.

use super::node::Object;
use crate::encoding::DEFAULT_FIELD;
use crate::parameters::{self, Choice};
use crate::report::suggestion;
use crate::semantics::Semantics;
use crate::{EncodingConfig, EncodingScheme, NamedMap, ReceptiveField, StimulusConfig};

const IDENTITY: &str = "IdentityEncoding";
const SCHEMES: [&str; 4] = [IDENTITY, "LIF_Encoding", "PoissonRateCoding", "RankOrderCoding"];
/// The encoders; stimuli that act unchanged have none.
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

/// `None` for the identity, or if the entry is unreadable.
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
    // The values of a node far from its centre and at it.
    let values = match scheme {
        EncodingScheme::RankOrder => [1.0, f64::from(time_scale)],
        EncodingScheme::Lif | EncodingScheme::PoissonRate => [0.0, 1.0],
    };
    let [min_val, max_val] = values;
    let given = [("min_val", min_val.into()), ("max_val", max_val.into())];
    let choice = Choice { default: Some(DEFAULT_FIELD), ..Choice::any::<ReceptiveField>(&[]) };
    let field = |o: &mut Object<'_>| parameters::read_kind(o, &choice, Semantics::Thesis, &given);
    let field = o.inner("receptive_field", field);
    Some(EncodingConfig { scheme, receptive_field: field.unwrap_or(ReceptiveField::Identity {}) })
}
