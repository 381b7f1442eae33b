//! Names of experiment files as names in C, whatever characters they have.

use std::collections::BTreeSet;

/// Words that cannot be, or should not be, the name of a member: keywords of C and C++, and names
/// that headers define as macros.
const RESERVED: &[&str] = &[
    "alignas",
    "alignof",
    "and",
    "and_eq",
    "asm",
    "assert",
    "auto",
    "bitand",
    "bitor",
    "bool",
    "break",
    "case",
    "catch",
    "char",
    "class",
    "compl",
    "concept",
    "const",
    "const_cast",
    "consteval",
    "constexpr",
    "constinit",
    "continue",
    "decltype",
    "default",
    "delete",
    "do",
    "double",
    "dynamic_cast",
    "else",
    "enum",
    "errno",
    "explicit",
    "export",
    "extern",
    "false",
    "far",
    "float",
    "for",
    "friend",
    "goto",
    "huge",
    "i386",
    "if",
    "inline",
    "int",
    "interface",
    "linux",
    "long",
    "mutable",
    "namespace",
    "near",
    "new",
    "noexcept",
    "not",
    "not_eq",
    "nullptr",
    "offsetof",
    "operator",
    "or",
    "or_eq",
    "private",
    "protected",
    "public",
    "register",
    "reinterpret_cast",
    "requires",
    "restrict",
    "return",
    "short",
    "signed",
    "sizeof",
    "static",
    "static_assert",
    "static_cast",
    "stderr",
    "stdin",
    "stdout",
    "struct",
    "switch",
    "template",
    "this",
    "throw",
    "true",
    "try",
    "typedef",
    "typeid",
    "typename",
    "union",
    "unix",
    "unsigned",
    "using",
    "virtual",
    "void",
    "volatile",
    "wchar_t",
    "while",
    "xor",
    "xor_eq",
];

/// Longest name, so that the suffix of an equal one stays within the 31 characters that C99
/// distinguishes.
const LONGEST: usize = 26;

/// A different C identifier for each name, as near to the name as possible. A name without lower
/// case would look like a macro, so it becomes lower case.
pub fn identifiers<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let unique = |name: &str| {
        let plain = identifier(name);
        let numbered = (2..).map(|number| format!("{plain}_{number}"));
        let mut candidates = std::iter::once(plain.clone()).chain(numbered);
        candidates.find(|candidate| taken.insert(candidate.clone())).unwrap_or(plain)
    };
    names.into_iter().map(unique).collect()
}

fn identifier(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let mut identifier: String = name.chars().map(plain).take(LONGEST).collect();
    if !identifier.contains(|c: char| c.is_ascii_lowercase()) {
        identifier.make_ascii_lowercase();
    }
    // Names that begin with an underscore are reserved in C.
    let identifier = identifier.trim_start_matches('_').to_owned();
    if !identifier.starts_with(|c: char| c.is_ascii_lowercase() || c.is_ascii_uppercase()) {
        return format!("n{identifier}");
    }
    match RESERVED.binary_search(&&*identifier) {
        Ok(_) => identifier + "_",
        Err(_) => identifier,
    }
}

/// A name for a comment, a string or a page: it can neither end them nor hide anything in them.
pub fn shown(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || " _-.,:()@+".contains(c);
    name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reserved_words_are_in_order() {
        assert!(RESERVED.is_sorted());
    }

    #[test]
    fn names_become_identifiers() {
        let names =
            ["light", "I1", "OUT_LED", "größe", "2nd", "", "for", "_x", "光", "a*/b", "??/"];
        let expected =
            ["light", "i1", "out_led", "gr__e", "n2nd", "n", "for_", "x", "n_2", "a__b", "n_3"];
        let mut expected = expected.map(str::to_owned);
        // What remains of a name without letters.
        (expected[8], expected[10]) = ("n_2".into(), "n_3".into());
        assert_eq!(identifiers(names), expected);
    }

    #[test]
    fn equal_names_get_numbers() {
        assert_eq!(
            identifiers(["a b", "a-b", "a_b", "a_b_2"]),
            ["a_b", "a_b_2", "a_b_3", "a_b_2_2"]
        );
        let long = "x".repeat(200);
        let names: Vec<String> = (0..300).map(|number| format!("{long}{number}")).collect();
        let unique: BTreeSet<String> =
            identifiers(names.iter().map(String::as_str)).into_iter().collect();
        assert_eq!(unique.len(), 300);
        assert!(unique.iter().all(|name| name.len() <= 31));
    }

    #[test]
    fn comments_stay_comments() {
        assert_eq!(shown("a*/b\n`c` ??/ größe \u{202e}"), "a__b__c_ ___ größe _");
    }
}
