//! The nesting depth of expressions.

use crate::code::{Clause, ElementKey, Expr, Op};

/// The depth of the deepest operand.
pub(super) fn within(op: &Op) -> u16 {
    fn deepest<'e>(of: impl IntoIterator<Item = &'e Expr>) -> u16 {
        of.into_iter().map(|expr| expr.depth).max().unwrap_or(0)
    }
    // Every clause is executed within the one before it, and the value within the last one.
    let comprehension = |value: u16, clauses: &[Clause]| {
        let lists = clauses.iter().map(|clause| match clause {
            Clause::For(_, expr) | Clause::If(expr) => expr.depth,
        });
        let n_clauses = u16::try_from(clauses.len()).unwrap_or(u16::MAX);
        lists.max().unwrap_or(0).max(value).saturating_add(n_clauses)
    };
    match op {
        Op::List(of) | Op::Tuple(of) | Op::Call(_, of) | Op::Builtin(_, of) => deepest(of),
        Op::Dict(of) => of.iter().map(|(key, value)| key.depth.max(value.depth)).max().unwrap_or(0),
        Op::ListOf(of, over) => comprehension(of.depth, over),
        Op::DictOf(of, over) => comprehension(of.0.depth.max(of.1.depth), over),
        Op::Not(of) | Op::Negative(of) | Op::Positive(of) | Op::Attribute(of, _) => of.depth,
        Op::Binary(_, of) | Op::And(of) | Op::Or(of) | Op::Index(of) => of.0.depth.max(of.1.depth),
        Op::If(of) => of.0.depth.max(of.1.depth).max(of.2.depth),
        Op::Slice(of) => of.0.depth.max(deepest(of.1.iter().chain(&of.2))),
        Op::Order(of) => {
            let key = match &of.key {
                Some(ElementKey::Lambda(_, expr)) => expr.depth,
                _ => 0,
            };
            of.list.depth.max(key).max(deepest(&of.reverse))
        }
        Op::Method(of, _, arguments) => of.depth.max(deepest(arguments)),
        Op::Nothing
        | Op::Bool(_)
        | Op::Int(_)
        | Op::Float(_)
        | Op::Text(_)
        | Op::Local(_)
        | Op::Global(_) => 0,
    }
}
