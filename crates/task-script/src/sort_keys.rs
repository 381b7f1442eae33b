//! The order of `sorted`.

use std::cmp::Ordering;

use crate::builtins;
use crate::error::Outcome;
use crate::value::Value;

/// Keys with a total order, which sorting needs: only numbers, or only texts.
pub struct Keys {
    are_texts: bool,
    /// Bytes of all texts.
    pub n_bytes: usize,
}

impl Keys {
    /// The keys of values to sort.
    ///
    /// # Errors
    ///
    /// If the keys have no order.
    pub fn from_keyed(keyed: &[(Value, Value)]) -> Outcome<Self> {
        let Some((first, _)) = keyed.first() else {
            return Ok(Self { are_texts: false, n_bytes: 0 });
        };
        let are_texts = first.as_text().is_some();
        let mut n_bytes = 0;
        for (key, _) in keyed {
            match (key.as_text(), key.number()) {
                (Some(text), _) if are_texts => n_bytes += text.len(),
                (_, Some(number)) if !are_texts && !number.is_nan() => {}
                // A single one needs no order.
                _ if keyed.len() == 1 => {}
                _ => return Err(builtins::without_order(first, key)),
            }
        }
        Ok(Self { are_texts, n_bytes })
    }

    /// The order of two keys.
    pub fn order(&self, a: &Value, b: &Value) -> Ordering {
        if self.are_texts {
            return a.as_text().cmp(&b.as_text());
        }
        let number = |value: &Value| value.number().unwrap_or_default();
        // Compares as floats, and equal floats as whole numbers, because beyond 2^53 several
        // whole numbers become the same float.
        let exact = |value: &Value| match value {
            Value::Int(value) => i128::from(*value),
            other => number(other) as i128,
        };
        let order = number(a).partial_cmp(&number(b)).unwrap_or(Ordering::Equal);
        order.then_with(|| exact(a).cmp(&exact(b)))
    }
}
