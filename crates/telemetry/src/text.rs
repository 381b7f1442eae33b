//! Makes text from strangers fit for a terminal and a log.

use std::{
    borrow::Cow,
    fmt::Write as _,
    io::{self, Write},
};

/// Whether a character is not printable: it moves the cursor, changes the order of text, or is
/// invisible. (Unicode's categories Cc, Cf, Zl and Zp.)
pub fn is_unprintable(c: char) -> bool {
    c.is_control() || is_format(c)
}

fn is_format(c: char) -> bool {
    matches!(c,
        '\u{ad}' | '\u{600}'..='\u{605}' | '\u{61c}' | '\u{6dd}' | '\u{70f}' | '\u{890}'
        | '\u{891}' | '\u{8e2}' | '\u{180e}' | '\u{200b}'..='\u{200f}'
        | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}'
        | '\u{fff9}'..='\u{fffb}' | '\u{110bd}' | '\u{110cd}' | '\u{13430}'..='\u{1343f}'
        | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}' | '\u{e0001}'..='\u{e007f}')
}

/// Text with unprintable characters escaped as in JSON (`\u202e`). So text stays on its
/// line, in the order in which it is read.
pub fn escape(text: &str) -> Cow<'_, str> {
    escape_if(text, is_unprintable)
}

/// The same for lines of text: line ends and tabs stay, and JSON stays the same JSON.
pub fn escape_lines(text: &str) -> Cow<'_, str> {
    escape_if(text, |c| !matches!(c, '\n' | '\t') && is_unprintable(c))
}

/// From this number on, numbers are written with an exponent.
const PLAIN_MAX: f64 = 1e7;

/// A number with this many decimals. Beyond ten million it has an exponent, so that it is never
/// long.
pub fn number(value: f64, decimals: usize) -> String {
    match value.is_finite() && value.abs() >= PLAIN_MAX {
        true => format!("{value:.decimals$e}"),
        false => format!("{value:.decimals$}"),
    }
}

/// Writes one or more lines to standard error. Ignores errors, because there is no other place to
/// report them.
pub fn report(text: &str) {
    let _ = writeln!(io::stderr(), "{}", escape_lines(text));
}

fn escape_if(text: &str, is_unfit: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_unfit) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_unfit(c) {
            for unit in c.encode_utf16(&mut [0; 2]) {
                write!(escaped, "\\u{unit:04x}").expect("writing to a string never fails");
            }
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

/// Writes log lines with all unprintable characters escaped; the log itself escapes only control
/// characters. Each write is a whole line.
#[derive(Debug)]
pub struct EscapingWriter<W>(pub W);

impl<W: Write> Write for EscapingWriter<W> {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        match std::str::from_utf8(line) {
            Ok(text) => self.0.write_all(escape_if(text, is_format).as_bytes())?,
            Err(_) => self.0.write_all(line)?,
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unprintable_characters_are_escaped_and_text_stays() {
        let plain = "größe 漢字 \"a\" \\ =1+1";
        assert!(matches!(escape(plain), Cow::Borrowed(text) if text == plain));
        let name = "a\u{202e}b\u{1b}[2J\r\n\u{2028}\u{e0041}c\u{9b}";
        assert_eq!(escape(name), r"a\u202eb\u001b[2J\u000d\u000a\u2028\udb40\udc41c\u009b");
        assert_eq!(escape_lines("a\nb\t\u{feff}"), "a\nb\t\\ufeff");
    }

    #[test]
    fn lines_of_a_log_keep_their_colours() {
        let mut written = Vec::new();
        EscapingWriter(&mut written).write_all("\u{1b}[31mname=\u{202e}x\n".as_bytes()).unwrap();
        assert_eq!(written, b"\x1b[31mname=\\u202ex\n");
    }

    #[test]
    fn a_number_is_never_long() {
        for (value, expected) in [
            (0.0, "0.000"),
            (-1.2345, "-1.234"),
            (9_999_999.0, "9999999.000"),
            (-9e98, "-9.000e98"),
            (f64::MAX, "1.798e308"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(value, 3), expected);
        }
        for exponent in -308..=308 {
            let value: f64 = format!("-1.234567891e{exponent}").parse().unwrap();
            assert!(number(value, 6).len() <= 15, "{value:e}");
        }
    }
}
