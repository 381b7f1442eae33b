//! Groups of experiments: runs that belong together, such as one file with several seeds.

use crate::limits::{KEY_LEN_MAX, TEXT_LEN_MAX};

/// Where an experiment belongs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Membership {
    /// The group's name; see [`check_name`].
    pub group: String,
    /// What is particular about this run among those of the group, its seed aside, such as
    /// `algorithm.population_size=50`; empty if nothing is. At most [`TEXT_LEN_MAX`] bytes.
    pub variant: String,
}

impl Membership {
    /// A place in a group, or what is wrong with it.
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

/// Whether a group can have this name: letters, digits, `-` and `_`, so that it is no path
/// and no address, and not digits alone, so that it is no experiment's number.
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
