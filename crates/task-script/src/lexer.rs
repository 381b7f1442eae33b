//! From text to tokens: names, literals, operators, and the ends and indentation of lines.

use crate::error::{Fault, Outcome, shortened};

/// A token and the line where it starts.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Token<'a> {
    pub(crate) kind: Kind<'a>,
    pub(crate) line: u32,
}

/// The kind of a token.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind<'a> {
    /// A name or a keyword.
    Name(&'a str),
    Int(i64),
    Float(f64),
    Text(String),
    Operator(&'static str),
    /// End of a line outside brackets.
    Newline,
    /// The next line is indented further.
    Indent,
    /// The next line ends a block.
    Dedent,
    End,
}

/// Longer ones first.
const OPERATORS: [&str; 30] = [
    "//=", "==", "!=", "<=", ">=", "+=", "-=", "*=", "/=", "%=", "//", "**", "(", ")", "[", "]",
    "{", "}", ",", ":", ".", "=", "+", "-", "*", "/", "%", "<", ">", ";",
];

/// Largest nesting depth of blocks.
const BLOCKS: usize = 20;

/// All tokens of a text; the last one is [`Kind::End`].
pub(crate) fn tokens(text: &str) -> Outcome<Vec<Token<'_>>> {
    let mut lexer = Lexer { text, at: 0, line: 1, brackets: 0, indents: vec![0], tokens: vec![] };
    lexer.run()?;
    Ok(lexer.tokens)
}

struct Lexer<'a> {
    text: &'a str,
    /// Place in the text, bytes.
    at: usize,
    line: u32,
    /// Number of open brackets; line ends within brackets are ignored.
    brackets: usize,
    /// Indentation of the open blocks, spaces.
    indents: Vec<usize>,
    tokens: Vec<Token<'a>>,
}

impl<'a> Lexer<'a> {
    fn run(&mut self) -> Outcome<()> {
        let mut is_line_start = true;
        loop {
            if is_line_start && self.brackets == 0 {
                self.indentation()?;
            }
            is_line_start = false;
            self.skip(|c| c == ' ' || c == '\r');
            let Some(c) = self.rest().chars().next() else { break };
            match c {
                '\n' => {
                    if self.brackets == 0 {
                        self.end_of_line();
                    }
                    self.at += 1;
                    self.line += 1;
                    is_line_start = true;
                }
                '#' => self.skip(|c| c != '\n'),
                '\\' if self.rest().starts_with("\\\n") => {
                    self.at += 2;
                    self.line += 1;
                }
                '\t' => return Err(self.fault("a tab; indent with spaces")),
                '"' | '\'' => self.string(c)?,
                '0'..='9' => self.number()?,
                '_' | 'a'..='z' | 'A'..='Z' => {
                    let start = self.at;
                    self.skip(|c| c == '_' || c.is_ascii_alphanumeric());
                    self.push(Kind::Name(&self.text[start..self.at]));
                }
                '.' if self.rest()[1..].starts_with(|c: char| c.is_ascii_digit()) => {
                    self.number()?;
                }
                _ => self.operator(c)?,
            }
        }
        if self.brackets > 0 {
            return Err(self.fault("a bracket is not closed"));
        }
        self.end_of_line();
        for _ in 1..self.indents.len() {
            self.push(Kind::Dedent);
        }
        self.push(Kind::End);
        Ok(())
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn skip(&mut self, matches: impl Fn(char) -> bool) {
        let rest = self.rest();
        self.at += rest.find(|c| !matches(c)).unwrap_or(rest.len());
    }

    fn push(&mut self, kind: Kind<'a>) {
        self.tokens.push(Token { kind, line: self.line });
    }

    fn fault(&self, message: impl Into<String>) -> Fault {
        Fault::new(self.line, message)
    }

    fn end_of_line(&mut self) {
        let last = self.tokens.last().map(|token| &token.kind);
        if !matches!(last, None | Some(Kind::Newline | Kind::Indent | Kind::Dedent)) {
            self.push(Kind::Newline);
        }
    }

    /// Opens and closes blocks, at the start of a line that is not empty.
    fn indentation(&mut self) -> Outcome<()> {
        let rest = self.rest();
        let width = rest.len() - rest.trim_start_matches(' ').len();
        if rest[width..].starts_with('\t') {
            return Err(self.fault("a tab; indent with spaces"));
        }
        if matches!(rest[width..].chars().next(), None | Some('\n' | '\r' | '#')) {
            return Ok(());
        }
        let current = *self.indents.last().expect("the outermost block never closes");
        if width > current {
            if self.indents.len() > BLOCKS {
                return Err(self.fault(format!("more than {BLOCKS} nested blocks")));
            }
            self.indents.push(width);
            self.push(Kind::Indent);
        }
        while width < *self.indents.last().expect("the outermost block never closes") {
            self.indents.pop();
            self.push(Kind::Dedent);
        }
        if width != *self.indents.last().expect("the outermost block never closes") {
            return Err(self.fault("the indentation matches no open block"));
        }
        Ok(())
    }

    fn number(&mut self) -> Outcome<()> {
        let start = self.at;
        self.skip(|c| c.is_ascii_digit());
        let mut is_float = false;
        if self.rest().starts_with('.') {
            is_float = true;
            self.at += 1;
            self.skip(|c| c.is_ascii_digit());
        }
        if self.rest().starts_with(['e', 'E']) {
            is_float = true;
            self.at += 1;
            if self.rest().starts_with(['+', '-']) {
                self.at += 1;
            }
            self.skip(|c| c.is_ascii_digit());
        }
        self.skip(|c| c == '_' || c.is_ascii_alphanumeric());
        let text = &self.text[start..self.at];
        let kind = if is_float {
            text.parse().ok().filter(|number: &f64| number.is_finite()).map(Kind::Float)
        } else {
            text.parse().ok().map(Kind::Int)
        };
        match kind {
            Some(kind) => self.push(kind),
            None => return Err(self.fault(format!("`{}` is not a number", shortened(text)))),
        }
        Ok(())
    }

    fn string(&mut self, quote: char) -> Outcome<()> {
        let line = self.line;
        let triple = quote.to_string().repeat(3);
        let end = if self.rest().starts_with(&triple) { triple } else { quote.to_string() };
        self.at += end.len();
        let mut value = String::new();
        loop {
            if self.rest().starts_with(&end) {
                self.at += end.len();
                break;
            }
            let mut chars = self.rest().chars();
            let c = match chars.next() {
                None => return Err(Fault::new(line, "a string is not closed")),
                Some('\n') if end.len() == 1 => {
                    return Err(Fault::new(line, "a string is not closed in its line"));
                }
                Some('\\') => {
                    self.at += 1;
                    match chars.next() {
                        Some('n') => '\n',
                        Some(c @ ('\\' | '"' | '\'')) => c,
                        _ => {
                            return Err(
                                self.fault(r#"after a backslash, expected `n`, `\` or a quote"#)
                            );
                        }
                    }
                }
                Some(c) => c,
            };
            let width = match self.rest().chars().next() {
                Some(written) => written.len_utf8(),
                None => 0,
            };
            if self.rest().starts_with('\n') {
                self.line += 1;
            }
            self.at += width;
            value.push(c);
        }
        self.tokens.push(Token { kind: Kind::Text(value), line });
        Ok(())
    }

    fn operator(&mut self, c: char) -> Outcome<()> {
        let known = OPERATORS.into_iter().find(|operator| self.rest().starts_with(operator));
        let Some(operator) = known else {
            return Err(self.fault(format!("`{}` has no meaning here", shortened(&c.to_string()))));
        };
        match operator {
            "(" | "[" | "{" => self.brackets += 1,
            ")" | "]" | "}" if self.brackets == 0 => {
                return Err(self.fault(format!("`{operator}` closes nothing")));
            }
            ")" | "]" | "}" => self.brackets -= 1,
            _ => {}
        }
        self.at += operator.len();
        self.push(Kind::Operator(operator));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Kind::{Dedent, End, Float, Indent, Int, Name, Newline, Operator, Text};

    fn kinds(text: &str) -> Vec<Kind<'_>> {
        tokens(text).unwrap().into_iter().map(|token| token.kind).collect()
    }

    #[test]
    fn blocks_open_and_close_and_brackets_join_lines() {
        let text = "if a:\n    b = [1,\n2.5e1]  # c\n\n\nd";
        let expected = [
            Name("if"),
            Name("a"),
            Operator(":"),
            Newline,
            Indent,
            Name("b"),
            Operator("="),
            Operator("["),
            Int(1),
            Operator(","),
            Float(25.0),
            Operator("]"),
            Newline,
            Dedent,
            Name("d"),
            Newline,
            End,
        ];
        assert_eq!(kinds(text), expected);
        assert_eq!(tokens(text).unwrap()[14].line, 6);
    }

    #[test]
    fn strings_have_escapes_and_may_span_lines() {
        assert_eq!(kinds(r#"'a\'\n'"#)[0], Text("a'\n".into()));
        assert_eq!(kinds("\"\"\"a\n\"b\" \"\"\"\nc")[0], Text("a\n\"b\" ".into()));
        assert_eq!(tokens("'''a\nb'''\nc").unwrap()[2].line, 3);
    }

    #[test]
    fn invalid_tokens_are_refused_with_their_line() {
        for (text, line) in [
            ("a\n$", 2),
            ("'a", 1),
            ("\n'a\n'", 2),
            ("(\n(", 2),
            (")", 1),
            ("\ta", 1),
            ("if a:\n  b\n c", 3),
            ("1e999", 1),
            ("99999999999999999999", 1),
            ("1x", 1),
            (r"'\x'", 1),
        ] {
            let error = tokens(text).unwrap_err().into_error("");
            assert_eq!(error.line, line, "{text:?}: {}", error.message);
        }
    }
}
