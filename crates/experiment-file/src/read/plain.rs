//! Removes the extensions of JSON that files may use: comments, and commas after the last
//! element.

use std::borrow::Cow;

/// The same text with spaces in place of comments and trailing commas, so that everything else
/// keeps its line and its byte.
pub fn plain(text: &str) -> Cow<'_, str> {
    let bytes = text.as_bytes();
    let mut blanks = Vec::new();
    // A comma with only white space and comments after it so far.
    let mut comma = None;
    // The latest byte that is neither white space nor in a comment.
    let mut last = b'[';
    let mut at = 0;
    while at < bytes.len() {
        let end = match (bytes[at], bytes.get(at + 1)) {
            (b'"', _) => {
                (comma, last) = (None, b'"');
                end_of_string(bytes, at)
            }
            (b'/', Some(b'/')) => {
                let end = bytes[at..].iter().position(|&byte| byte == b'\n');
                let end = end.map_or(bytes.len(), |n| at + n);
                blanks.push(at..end);
                end
            }
            (b'/', Some(b'*')) => {
                let Some(n) = bytes[at + 2..].windows(2).position(|pair| pair == b"*/") else {
                    // The comment has no end, which the parser reports.
                    return Cow::Borrowed(text);
                };
                blanks.push(at..at + n + 4);
                at + n + 4
            }
            (byte, _) if byte.is_ascii_whitespace() => at + 1,
            (b',', _) => {
                comma = (!matches!(last, b'[' | b'{' | b',')).then_some(at);
                last = b',';
                at + 1
            }
            (byte, _) => {
                let comma = comma.take().filter(|_| matches!(byte, b']' | b'}'));
                blanks.extend(comma.map(|comma| comma..comma + 1));
                last = byte;
                at + 1
            }
        };
        at = end;
    }
    if blanks.is_empty() {
        return Cow::Borrowed(text);
    }
    let mut plain = bytes.to_vec();
    for byte in blanks.into_iter().flatten() {
        if !matches!(plain[byte], b'\n' | b'\r') {
            plain[byte] = b' ';
        }
    }
    Cow::Owned(String::from_utf8(plain).expect("whole characters became spaces"))
}

/// The position after the string that begins at `start`.
fn end_of_string(bytes: &[u8], start: usize) -> usize {
    let mut at = start + 1;
    while at < bytes.len() {
        match bytes[at] {
            b'"' => return at + 1,
            b'\\' => at += 2,
            _ => at += 1,
        }
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_trailing_commas_become_spaces_and_all_else_keeps_its_place() {
        for (text, expected) in [
            ("{\"a\": 1}", "{\"a\": 1}"),
            ("[1, 2,] // two\n", "[1, 2 ]       \n"),
            ("[1, /* ü */ 2]", "[1,          2]"),
            ("[1, // one,\n 2, /* last */\n]", "[1,        \n 2            \n]"),
            ("{\"a//b\": \"/* \\\" ,]\",}", "{\"a//b\": \"/* \\\" ,]\" }"),
        ] {
            assert_eq!(plain(text), expected);
            assert_eq!(plain(text).len(), text.len());
        }
        for kept in [
            "[1,, 2]",
            "[,1]",
            "[,]",
            "[1,,]",
            "{\"a\" / 1}",
            "/* without end ,]",
            "\"open ,]",
            "\"\\",
        ] {
            assert_eq!(plain(kept), kept);
        }
    }
}
