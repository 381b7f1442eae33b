//! Groups of experiments: runs that belong together, such as one file with several seeds.

use crate::limits::{KEY_LEN_MAX, TEXT_LEN_MAX};

/// The membership of an experiment in a group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Membership {
    /// The group's name; see [`check_name`].
    pub group: String,
    /// The values, apart from the seed, in which this run differs from others of the group, such
    /// as `algorithm.population_size=50`; empty if none. At most [`TEXT_LEN_MAX`] bytes.
    pub variant: String,
}

impl Membership {
    /// A membership; or the mistake in its names.
    pub fn new(group: &str, variant: &str) -> Result<Self, String> {
        check_name(group)?;
        if variant.len() > TEXT_LEN_MAX || variant.chars().any(char::is_control) {
            return Err(format!(
                "a variant has at most {TEXT_LEN_MAX} bytes and no control characters"
            ));
        }
        Ok(Self { group: group.to_owned(), variant: variant.to_owned() })
    }
}

/// Checks the name of a group. It has letters, digits, `-` and `_`, so that it differs from paths
/// and addresses. At least one character is not a digit, so that it differs from an experiment's
/// number.
pub fn check_name(name: &str) -> Result<(), String> {
    let is_plain = |c: char| c.is_alphanumeric() || "-_".contains(c);
    if name.len() > KEY_LEN_MAX || !name.chars().all(is_plain) {
        Err(format!(
            "`{}` cannot name a group: a name has at most {KEY_LEN_MAX} bytes, letters, digits, \
             - and _ only",
            name.escape_debug()
        ))
    } else if name.chars().all(|c| c.is_ascii_digit()) {
        Err(format!("`{name}` cannot name a group: a name has a letter in it"))
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_groups_are_neither_numbers_nor_paths_nor_addresses() {
        for name in ["leader_selection_snes", "größe-2", "2x"] {
            check_name(name).unwrap();
        }
        for name in ["", "7", "a.csv", "./a", "a/b", "3@7", "a b", "a\n", &"a".repeat(129)] {
            assert!(!check_name(name).unwrap_err().contains('\n'), "{name}");
        }
        Membership::new("a", "algorithm.sigma=0.1; seed").unwrap();
        Membership::new("a", "x\ny").unwrap_err();
        Membership::new("a", &"x".repeat(513)).unwrap_err();
    }
}
