//! Numbers and tables as text of C, exact in every bit.

use sim_core::blueprint::Link;

/// A float in hexadecimal.
pub fn float(value: f32) -> String {
    format!("{}f", double(f64::from(value)))
}

/// A double in hexadecimal.
pub fn double(value: f64) -> String {
    let bits = value.to_bits();
    let sign = if value.is_sign_negative() { "-" } else { "" };
    let (exponent, fraction) = ((bits >> 52) & 0x7ff, bits & ((1 << 52) - 1));
    let digits = format!("{fraction:013x}");
    let digits = digits.trim_end_matches('0');
    let point = if digits.is_empty() { "" } else { "." };
    match exponent {
        0 if fraction == 0 => format!("{sign}0.0"),
        0 => format!("{sign}0x0{point}{digits}p-1022"),
        _ => format!("{sign}0x1{point}{digits}p{:+}", exponent as i64 - 1023),
    }
}

/// The smallest unsigned type for numbers up to `max`.
pub fn unsigned(max: usize) -> &'static str {
    match max {
        0..=0xff => "uint8_t",
        0x100..=0xffff => "uint16_t",
        _ => "uint32_t",
    }
}

/// Bytes of a number of the type [`unsigned`].
pub fn unsigned_len(max: usize) -> usize {
    match max {
        0..=0xff => 1,
        0x100..=0xffff => 2,
        _ => 4,
    }
}

/// A table of constants; without values, it has one zero, because C has no empty tables.
pub fn table(kind: &str, name: &str, shape: &str, values: &[String]) -> String {
    let mut text = format!("static const {kind} {name}{shape} = {{");
    let mut column = usize::MAX;
    let zero = ["0".to_owned()];
    for value in if values.is_empty() { &zero[..] } else { values } {
        if column > 96_usize.saturating_sub(value.len()) {
            text += "\n    ";
            column = 3;
        } else {
            text.push(' ');
        }
        text += value;
        text.push(',');
        column = column.saturating_add(value.len() + 2);
    }
    text + "\n};\n"
}

/// Floats.
pub fn floats(name: &str, values: impl IntoIterator<Item = f32>) -> String {
    let values: Vec<String> = values.into_iter().map(float).collect();
    table("float", name, "[]", &values)
}

/// Whole numbers.
pub fn numbers(name: &str, values: impl IntoIterator<Item = usize>) -> String {
    let values: Vec<usize> = values.into_iter().collect();
    let kind = unsigned(values.iter().copied().max().unwrap_or(0));
    let values: Vec<String> = values.iter().map(usize::to_string).collect();
    table(kind, name, "[]", &values)
}

/// Synapses in groups: the end of each group, the other side of each synapse, and its weight; with
/// plastic weights, its number.
pub fn links<'a>(
    prefix: &str,
    groups: impl Iterator<Item = &'a Vec<Link>> + Clone,
    is_plastic: bool,
) -> String {
    let mut end = 0;
    let ends = groups.clone().map(|group| {
        end += group.len();
        end
    });
    let all = groups.flatten();
    numbers(&format!("{prefix}_END"), ends)
        + &numbers(&format!("{prefix}_FROM"), all.clone().map(|link| link.other))
        + &if is_plastic {
            numbers(&format!("{prefix}_SYNAPSE"), all.map(|link| link.synapse))
        } else {
            floats(&format!("{prefix}_WEIGHT"), all.map(|link| link.weight))
        }
}

/// The weight of synapse `k` of a table of [`links`].
pub fn weight(prefix: &str, k: &str, is_plastic: bool) -> String {
    if is_plastic {
        format!("swarm->weight[{prefix}_SYNAPSE[{k}]]")
    } else {
        format!("{prefix}_WEIGHT[{k}]")
    }
}

/// Bytes of the tables of [`links`].
pub fn links_len<'a>(groups: impl Iterator<Item = &'a Vec<Link>> + Clone) -> usize {
    let n: usize = groups.clone().map(Vec::len).sum();
    let largest = groups.clone().flatten().map(|link| link.other).max().unwrap_or(0);
    groups.count() * unsigned_len(n) + n * (unsigned_len(largest) + 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_exact() {
        for (value, text) in [
            (1.0, "0x1p+0"),
            (-0.0, "-0.0"),
            (0.1, "0x1.999999999999ap-4"),
            (f64::MIN_POSITIVE / 4.0, "0x0.4p-1022"),
            (f64::MAX, "0x1.fffffffffffffp+1023"),
        ] {
            assert_eq!(double(value), text);
        }
        assert_eq!(float(0.1), "0x1.99999ap-4f");
        assert_eq!(float(f32::from_bits(1)), "0x1p-149f");
    }

    #[test]
    fn tables_have_short_lines_and_are_never_empty() {
        let text = numbers("T", 0..300);
        assert!(text.lines().all(|line| line.len() <= 100), "{text}");
        assert!(text.starts_with("static const uint16_t T[] = {\n    0, 1, "), "{text}");
        assert_eq!(floats("E", []), "static const float E[] = {\n    0,\n};\n");
    }
}
