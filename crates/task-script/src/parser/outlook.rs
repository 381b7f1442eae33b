//! Static knowledge of functions: their names, before the parser reaches them, and the keys of
//! the dicts that they return.

use super::Parser;
use crate::code::{Expr, Op, Stmt, StmtKind};
use crate::lexer::{Kind, Token};

impl<'a> Parser<'a> {
    /// Finds the names of functions and constants, so that their order does not matter.
    pub(super) fn look_ahead(&mut self) {
        let mut n_blocks = 0;
        let mut is_line_start = true;
        for (index, token) in self.tokens.iter().enumerate() {
            let next = |n| self.tokens.get(index + n).map(|token: &Token<'a>| &token.kind);
            match token.kind {
                Kind::Indent => n_blocks += 1,
                Kind::Dedent => n_blocks -= 1,
                Kind::Name("def") if n_blocks == 0 && is_line_start => {
                    if let Some(Kind::Name(name)) = next(1) {
                        let parameters = self.tokens[index..].iter().skip(3);
                        let parameters =
                            parameters.take_while(|token| token.kind != Kind::Operator(")"));
                        let n =
                            parameters.filter(|token| matches!(token.kind, Kind::Name(_))).count();
                        self.signatures.push((name, n));
                    }
                }
                Kind::Name(name)
                    if n_blocks == 0
                        && is_line_start
                        && next(1) == Some(&Kind::Operator("="))
                        && !self.globals.contains(&name) =>
                {
                    self.globals.push(name);
                }
                _ => {}
            }
            is_line_start = matches!(token.kind, Kind::Newline | Kind::Dedent | Kind::Indent);
        }
    }

    /// The literal keys of the dicts that a body returns, if it returns nothing else.
    pub(super) fn returned_keys(&self, body: &[Stmt]) -> Option<Vec<String>> {
        let mut keys = Vec::new();
        for statement in body {
            match &statement.kind {
                StmtKind::Return(Some(Expr { op: Op::Dict(entries), .. })) => {
                    for (key, _) in entries {
                        let Op::Text(text) = key.op else { return None };
                        add_new(&mut keys, vec![self.texts[text].clone()]);
                    }
                }
                StmtKind::Return(_) => return None,
                StmtKind::If(conditions, otherwise) => {
                    let blocks = conditions.iter().map(|(_, block)| block);
                    for block in blocks.chain([otherwise]) {
                        add_new(&mut keys, self.returned_keys(block)?);
                    }
                }
                StmtKind::For(_, _, block) => add_new(&mut keys, self.returned_keys(block)?),
                _ => {}
            }
        }
        Some(keys)
    }
}

fn add_new(keys: &mut Vec<String>, more: Vec<String>) {
    for key in more {
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
}
