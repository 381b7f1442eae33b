//! Patterns for the names of experiments, by which a worker chooses them.

use std::fmt;

use wildmatch::WildMatch;

/// A pattern of experiments' names: `*` stands for any text, `?` for one character. The empty
/// pattern matches every name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NamePattern(Option<WildMatch>);

impl NamePattern {
    /// Parses a pattern.
    pub fn new(text: &str) -> Self {
        Self((!text.is_empty()).then(|| WildMatch::new(text)))
    }

    /// Whether it matches a name.
    pub fn matches(&self, name: &str) -> bool {
        self.0.as_ref().is_none_or(|pattern| pattern.matches(name))
    }
}

impl fmt::Display for NamePattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.as_ref().map_or(Ok(()), |pattern| write!(f, "{pattern}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_matches_whole_names() {
        for (pattern, name, matches) in [
            ("", "anything", true),
            ("alice-*", "alice-leader", true),
            ("alice-*", "bob-alice-leader", false),
            ("leader", "leader_selection", false),
            ("*_ga", "leader_selection_ga", true),
            ("seed-?", "seed-7", true),
            ("seed-?", "seed-17", false),
        ] {
            assert_eq!(NamePattern::new(pattern).matches(name), matches, "{pattern} {name}");
            assert_eq!(NamePattern::new(pattern).to_string(), pattern);
        }
    }
}
