//! Labels, by which people find experiments.

use std::collections::BTreeMap;

/// Most labels of one experiment.
pub const LABELS_MAX: usize = 32;
/// Most bytes of a label's key.
const KEY_LEN_MAX: usize = 63;
/// Most bytes of a label's value.
const VALUE_LEN_MAX: usize = 256;

/// The labels of an experiment, by their keys.
pub type Labels = BTreeMap<String, String>;

/// Checks the labels of an experiment; the error describes the first invalid one.
pub fn check(labels: &Labels) -> Result<(), String> {
    labels.iter().try_for_each(|(key, value)| check_label(key, value))?;
    match labels.len() {
        n if n > LABELS_MAX => Err(format!("{n} labels are more than {LABELS_MAX}")),
        _ => Ok(()),
    }
}

fn check_label(key: &str, value: &str) -> Result<(), String> {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./".contains(c);
    if key.is_empty() || key.len() > KEY_LEN_MAX || !key.chars().all(is_plain) {
        Err(format!(
            "`{}` cannot be the key of a label: a key has 1 to {KEY_LEN_MAX} bytes, letters, \
             digits, - _ . and / only",
            key.escape_debug()
        ))
    } else if value.len() > VALUE_LEN_MAX || value.chars().any(char::is_control) {
        Err(format!(
            "the value of label `{key}` has more than {VALUE_LEN_MAX} bytes, or control characters"
        ))
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(pairs: &[(&str, &str)]) -> Labels {
        pairs.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect()
    }

    #[test]
    fn keys_are_plain_and_values_one_line() {
        check(&labels(&[("user/größe-2.x_y", ""), ("a", "any text = of one line")])).unwrap();
        for key in ["", "a b", "a=b", "a\n", &"k".repeat(64)] {
            assert!(!check(&labels(&[(key, "")])).unwrap_err().contains('\n'), "{key:?}");
        }
        for value in ["a\nb", &"v".repeat(257)] {
            check(&labels(&[("a", value)])).unwrap_err();
        }
    }

    #[test]
    fn the_number_of_labels_is_bounded() {
        let many = |n: usize| (0..n).map(|i| (format!("k{i}"), String::new())).collect();
        check(&many(LABELS_MAX)).unwrap();
        check(&many(LABELS_MAX + 1)).unwrap_err();
    }
}
