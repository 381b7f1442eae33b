//! Lists, dicts and comprehensions.

use super::Parser;
use crate::code::{Clause, Expr, Op, Target};
use crate::error::Outcome;
use crate::lexer::Kind;

impl Parser<'_> {
    pub(super) fn list(&mut self, line: u32) -> Outcome<Expr> {
        if self.accept("]") {
            return self.expr(line, Op::List(Vec::new()));
        }
        if let Some((clauses, value)) = self.comprehension("]", Self::expression)? {
            return self.expr(line, Op::ListOf(Box::new(value), clauses));
        }
        let mut values = Vec::new();
        while !self.accept("]") {
            values.push(self.expression()?);
            if !self.accept(",") {
                self.expect("]")?;
                break;
            }
        }
        self.expr(line, Op::List(values))
    }

    pub(super) fn dict(&mut self, line: u32) -> Outcome<Expr> {
        fn entry(parser: &mut Parser<'_>) -> Outcome<(Expr, Expr)> {
            let key = parser.expression()?;
            parser.expect(":")?;
            Ok((key, parser.expression()?))
        }
        if self.accept("}") {
            return self.expr(line, Op::Dict(Vec::new()));
        }
        if let Some((clauses, value)) = self.comprehension("}", |parser| entry(parser))? {
            return self.expr(line, Op::DictOf(Box::new(value), clauses));
        }
        let mut entries = Vec::new();
        while !self.accept("}") {
            entries.push(entry(self)?);
            if !self.accept(",") {
                self.expect("}")?;
                break;
            }
        }
        self.expr(line, Op::Dict(entries))
    }

    /// Parses a comprehension: its clauses, and the value before them. Returns `None` if the
    /// brackets contain no `for`.
    fn comprehension<T>(
        &mut self,
        close: &'static str,
        value: impl Fn(&mut Self) -> Outcome<T>,
    ) -> Outcome<Option<(Vec<Clause>, T)>> {
        let Some(clauses_at) = self.comprehension_clauses() else { return Ok(None) };
        let value_at = std::mem::replace(&mut self.at, clauses_at);
        let mark = self.scope.open();
        let mut clauses = Vec::new();
        loop {
            if self.accept_word("for") {
                // The list is evaluated before the variable has a value.
                let target_at = self.at;
                while !matches!(self.kind(), Kind::Name("in") | Kind::End) {
                    self.at += 1;
                }
                if !self.accept_word("in") {
                    return Err(self.fault("expected `in`"));
                }
                let list = self.clause()?;
                let after = std::mem::replace(&mut self.at, target_at);
                let target = self.targets()?;
                if !self.accept_word("in") {
                    return Err(self.fault(format!("expected `in`, found {}", self.found())));
                }
                if matches!(target, Target::Index(_) | Target::Attribute(..)) {
                    return Err(self.fault("expected a name after `for`"));
                }
                self.at = after;
                clauses.push(Clause::For(target, list));
            } else if self.accept_word("if") {
                clauses.push(Clause::If(self.clause()?));
            } else {
                break;
            }
        }
        self.expect(close)?;
        let end = std::mem::replace(&mut self.at, value_at);
        let value = value(self)?;
        if self.at != clauses_at {
            return Err(self.fault(format!("expected `for`, found {}", self.found())));
        }
        self.scope.close(mark);
        self.at = end;
        Ok(Some((clauses, value)))
    }

    /// The list or condition of a clause: a nested expression, which ends before `if`.
    fn clause(&mut self) -> Outcome<Expr> {
        self.deeper()?;
        let value = self.any_of()?;
        self.depth -= 1;
        Ok(value)
    }

    /// The index of the first clause, if these brackets contain a comprehension.
    fn comprehension_clauses(&self) -> Option<usize> {
        let mut n_brackets = 0;
        for (index, token) in self.tokens.iter().enumerate().skip(self.at) {
            match token.kind {
                Kind::Operator("(" | "[" | "{") => n_brackets += 1,
                Kind::Operator(")" | "]" | "}") if n_brackets == 0 => return None,
                Kind::Operator(")" | "]" | "}") => n_brackets -= 1,
                Kind::Operator(",") if n_brackets == 0 => return None,
                Kind::Name("for") if n_brackets == 0 => return Some(index),
                _ => {}
            }
        }
        None
    }
}
