//! Turns tokens into code: statements and names here, expressions in `expression.rs`.

mod containers;
mod depth;
mod expression;
mod outlook;
mod scope;

use experiment_file::suggestion;

use crate::code::{Binary, Expr, Function, Op, Stmt, StmtKind, Target};
use crate::error::{Fault, Outcome, shortened};
use crate::lexer::{Kind, Token, tokens};
use crate::{Program, Vocabulary};
use scope::{Scope, Variable};

/// Words of Python that scripts lack, with their replacement.
const REFUSED: [(&str, &str); 14] = [
    ("while", "there is no `while`; a `for` over `range(n)` with `break` does the same"),
    ("import", "a script imports nothing; `math` is there already"),
    ("from", "a script imports nothing; `math` is there already"),
    ("load", "a script loads nothing"),
    ("class", "there are no classes; use a dict"),
    ("global", "constants of the script cannot change; keep what changes in `state`"),
    ("try", "there are no exceptions"),
    ("raise", "there are no exceptions; `fail(\"...\")` ends the experiment"),
    ("with", "there is no `with`"),
    ("is", "there is no `is`; use `==`"),
    ("assert", "there is no `assert`; `fail(\"...\")` ends the experiment"),
    ("del", "there is no `del`; use `pop`"),
    ("yield", "there are no generators; return a list"),
    ("print", "nothing can be printed; return a measure instead"),
];

const KEYWORDS: [&str; 18] = [
    "and", "break", "continue", "def", "elif", "else", "for", "if", "in", "lambda", "not", "or",
    "pass", "return", "True", "False", "None", "math",
];

/// Most problems to report per script.
const PROBLEMS: usize = 20;

/// Compiles a text. Reports all unknown names, but only the first syntax error.
pub(crate) fn parse(text: &str, vocabulary: &Vocabulary) -> Result<Program, Vec<Fault>> {
    let tokens = tokens(text).map_err(|fault| vec![fault])?;
    let mut parser = Parser::new(&tokens, vocabulary);
    let parsed = parser.module();
    let mut problems = parser.problems;
    problems.extend(parsed.err());
    if !problems.is_empty() {
        return Err(problems);
    }
    Ok(Program {
        file: String::new(),
        functions: parser.functions,
        start: parser.start,
        n_start_locals: parser.scope.n_locals(),
        n_globals: parser.globals.len(),
        texts: parser.texts,
    })
}

struct Parser<'a> {
    tokens: &'a [Token<'a>],
    at: usize,
    vocabulary: &'a Vocabulary,
    /// Names of all functions of the text, with their numbers of parameters.
    signatures: Vec<(&'a str, usize)>,
    /// Names of all constants of the text.
    globals: Vec<&'a str>,
    functions: Vec<Function>,
    start: Vec<Stmt>,
    texts: Vec<String>,
    scope: Scope<'a>,
    /// Whether the parser is in a function.
    in_function: bool,
    n_loops: usize,
    /// Number of open expressions.
    depth: u16,
    problems: Vec<Fault>,
}

impl<'a> Parser<'a> {
    fn new(tokens: &'a [Token<'a>], vocabulary: &'a Vocabulary) -> Self {
        let mut parser = Self {
            tokens,
            at: 0,
            vocabulary,
            signatures: Vec::new(),
            globals: Vec::new(),
            functions: Vec::new(),
            start: Vec::new(),
            texts: Vec::new(),
            scope: Scope::default(),
            in_function: false,
            n_loops: 0,
            depth: 0,
            problems: Vec::new(),
        };
        parser.look_ahead();
        parser
    }

    fn kind(&self) -> &'a Kind<'a> {
        &self.tokens[self.at].kind
    }

    fn line(&self) -> u32 {
        self.tokens[self.at].line
    }

    fn fault(&self, message: impl Into<String>) -> Fault {
        Fault::new(self.line(), message)
    }

    /// Notes a problem, and continues reading.
    fn problem(&mut self, line: u32, message: impl Into<String>) {
        if self.problems.len() < PROBLEMS {
            self.problems.push(Fault::new(line, message));
        }
    }

    /// Notes an unknown name, with a suggestion. A suggestion compares the name with all known
    /// names, so only reported names get one.
    fn unknown(&mut self, line: u32, what: &str, name: &str, known: impl Fn(&Self) -> Vec<&str>) {
        if self.problems.len() < PROBLEMS {
            let suggestion = suggestion(name, &known(self));
            self.problem(line, format!("{what} `{}`; {suggestion}", shortened(name)));
        }
    }

    /// Takes an operator, if it is next.
    fn accept(&mut self, operator: &'static str) -> bool {
        let is_next = *self.kind() == Kind::Operator(operator);
        self.at += usize::from(is_next);
        is_next
    }

    /// Takes a keyword, if it is next.
    fn accept_word(&mut self, word: &str) -> bool {
        let is_next = matches!(self.kind(), Kind::Name(name) if *name == word);
        self.at += usize::from(is_next);
        is_next
    }

    fn expect(&mut self, operator: &'static str) -> Outcome<()> {
        if self.accept(operator) {
            return Ok(());
        }
        Err(self.fault(format!("expected `{operator}`, found {}", self.found())))
    }

    /// Describes the next token.
    fn found(&self) -> String {
        match self.kind() {
            Kind::Name(name) => format!("`{}`", shortened(name)),
            Kind::Int(value) => format!("`{value}`"),
            Kind::Float(value) => format!("`{value}`"),
            Kind::Text(_) => "a string".into(),
            Kind::Operator(operator) => format!("`{operator}`"),
            Kind::Newline => "the end of the line".into(),
            Kind::Indent => "an indented line".into(),
            Kind::Dedent | Kind::End => "the end of the block".into(),
        }
    }

    /// A name that the script chooses.
    fn own_name(&mut self) -> Outcome<&'a str> {
        let Kind::Name(name) = *self.kind() else {
            return Err(self.fault(format!("expected a name, found {}", self.found())));
        };
        if let Some((_, advice)) = REFUSED.iter().find(|(word, _)| *word == name) {
            return Err(self.fault(*advice));
        }
        if KEYWORDS.contains(&name) || crate::code::Builtin::named(name).is_some() {
            return Err(self.fault(format!("`{name}` is taken; choose another name")));
        }
        self.at += 1;
        Ok(name)
    }

    fn module(&mut self) -> Outcome<()> {
        while *self.kind() != Kind::End {
            if self.accept_word("def") {
                self.function()?;
                continue;
            }
            let line = self.line();
            let statement = self.simple_line()?;
            for statement in statement {
                match statement.kind {
                    StmtKind::Assign(..) => self.start.push(statement),
                    // A docstring.
                    StmtKind::Expr(Expr { op: Op::Text(_), .. }) | StmtKind::Pass => {}
                    _ => {
                        let message =
                            "outside functions, only constants are allowed: `NAME = value`";
                        return Err(Fault::new(line, message));
                    }
                }
            }
        }
        let scope = std::mem::take(&mut self.scope);
        self.report_unknown(&scope);
        self.scope = scope;
        Ok(())
    }

    fn function(&mut self) -> Outcome<()> {
        let line = self.line();
        let name = self.own_name()?;
        if self.globals.contains(&name) || self.functions.iter().any(|other| other.name == name) {
            self.problem(line, format!("`{name}` is defined twice"));
        }
        self.expect("(")?;
        let outer = std::mem::take(&mut self.scope);
        self.in_function = true;
        let mut n_parameters = 0;
        while !self.accept(")") {
            let line = self.line();
            let parameter = self.own_name()?;
            if !self.scope.declare_parameter(parameter) {
                self.problem(line, format!("the parameter `{parameter}` occurs twice"));
            }
            n_parameters += 1;
            if !self.accept(",") {
                self.expect(")")?;
                break;
            }
        }
        let body = self.block()?;
        self.in_function = false;
        let scope = std::mem::replace(&mut self.scope, outer);
        self.report_unknown(&scope);
        let returned_keys = self.returned_keys(&body);
        let n_locals = scope.n_locals();
        let name = name.to_owned();
        self.functions.push(Function { name, line, n_parameters, n_locals, body, returned_keys });
        Ok(())
    }

    /// Reports unknown names that are read.
    fn report_unknown(&mut self, scope: &Scope<'a>) {
        for (name, line) in scope.never_assigned() {
            match REFUSED.iter().find(|(word, _)| *word == name) {
                Some((_, advice)) => self.problem(line, *advice),
                None => {
                    self.unknown(line, "unknown name", name, |parser| parser.known_names(scope))
                }
            }
        }
    }

    /// The names that an expression may use.
    fn known_names(&self, scope: &Scope<'a>) -> Vec<&'a str> {
        let functions = self.signatures.iter().map(|(name, _)| *name);
        let builtins = crate::code::Builtin::NAMES.iter().copied();
        let own = scope.assigned().chain(self.globals.iter().copied());
        own.chain(functions).chain(builtins).chain(["True", "False", "None", "math"]).collect()
    }

    /// `:` and the statements after it, in this line or in an indented block.
    fn block(&mut self) -> Outcome<Vec<Stmt>> {
        self.expect(":")?;
        if *self.kind() != Kind::Newline {
            return self.simple_line();
        }
        self.at += 1;
        if *self.kind() != Kind::Indent {
            return Err(self.fault("expected an indented block"));
        }
        self.at += 1;
        let mut block = Vec::new();
        while *self.kind() != Kind::Dedent {
            self.statement(&mut block)?;
        }
        self.at += 1;
        Ok(block)
    }

    fn statement(&mut self, block: &mut Vec<Stmt>) -> Outcome<()> {
        let line = self.line();
        if self.accept_word("if") {
            let mut conditions = vec![(self.expression()?, self.block()?)];
            while self.accept_word("elif") {
                conditions.push((self.expression()?, self.block()?));
            }
            let otherwise = if self.accept_word("else") { self.block()? } else { Vec::new() };
            block.push(Stmt { line, kind: StmtKind::If(conditions, otherwise) });
        } else if self.accept_word("for") {
            let target = self.targets()?;
            if !self.accept_word("in") {
                return Err(self.fault(format!("expected `in`, found {}", self.found())));
            }
            let list = self.expression_list()?;
            self.n_loops += 1;
            let body = self.block()?;
            self.n_loops -= 1;
            block.push(Stmt { line, kind: StmtKind::For(target, list, body) });
        } else if self.accept_word("def") {
            return Err(Fault::new(line, "a function cannot contain another one"));
        } else {
            block.append(&mut self.simple_line()?);
        }
        Ok(())
    }

    /// Statements separated by `;`, to the end of the line.
    fn simple_line(&mut self) -> Outcome<Vec<Stmt>> {
        let mut statements = Vec::new();
        loop {
            let line = self.line();
            let kind = self.simple_statement()?;
            statements.push(Stmt { line, kind });
            let is_more = self.accept(";");
            if *self.kind() == Kind::Newline {
                self.at += 1;
                return Ok(statements);
            }
            if !is_more {
                return Err(
                    self.fault(format!("expected the end of the line, found {}", self.found()))
                );
            }
        }
    }

    fn simple_statement(&mut self) -> Outcome<StmtKind> {
        if let Kind::Name(word) = self.kind()
            && let Some((_, advice)) = REFUSED.iter().find(|(refused, _)| refused == word)
        {
            return Err(self.fault(*advice));
        }
        if self.accept_word("pass") {
            return Ok(StmtKind::Pass);
        }
        for (word, kind) in [("break", StmtKind::Break), ("continue", StmtKind::Continue)] {
            if self.accept_word(word) {
                if self.n_loops == 0 {
                    return Err(self.fault(format!("`{word}` belongs in a `for`")));
                }
                return Ok(kind);
            }
        }
        if self.accept_word("return") {
            if !self.in_function {
                return Err(self.fault("`return` belongs in a function"));
            }
            let is_empty = matches!(self.kind(), Kind::Newline | Kind::Operator(";"));
            return Ok(StmtKind::Return(if is_empty {
                None
            } else {
                Some(self.expression_list()?)
            }));
        }
        let start = self.at;
        // The left side of an assignment declares names; reading a name does not.
        if self.is_assignment() {
            let target = self.targets()?;
            self.expect("=")?;
            let value = self.expression_list()?;
            if let Kind::Operator("=") = self.kind() {
                return Err(self.fault("only one `=` per line"));
            }
            return Ok(StmtKind::Assign(target, value));
        }
        let value = self.expression_list()?;
        const MODIFY: [(&str, Binary); 6] = [
            ("+=", Binary::Add),
            ("-=", Binary::Subtract),
            ("*=", Binary::Multiply),
            ("/=", Binary::Divide),
            ("//=", Binary::FloorDivide),
            ("%=", Binary::Remainder),
        ];
        for (operator, binary) in MODIFY {
            if *self.kind() == Kind::Operator(operator) {
                let after = self.at + 1;
                self.at = start;
                let target = self.target()?;
                self.at = after;
                return Ok(StmtKind::Modify(target, binary, self.expression_list()?));
            }
        }
        Ok(StmtKind::Expr(value))
    }

    /// Whether this line has a `=` outside brackets.
    fn is_assignment(&self) -> bool {
        let mut n_brackets = 0;
        for token in &self.tokens[self.at..] {
            match token.kind {
                Kind::Operator("(" | "[" | "{") => n_brackets += 1,
                Kind::Operator(")" | "]" | "}") => n_brackets -= 1,
                Kind::Operator("=") if n_brackets == 0 => return true,
                Kind::Operator(";") if n_brackets == 0 => return false,
                Kind::Newline | Kind::End => return false,
                _ => {}
            }
        }
        false
    }

    /// One target, or several, to which a value is unpacked.
    fn targets(&mut self) -> Outcome<Target> {
        let first = self.target()?;
        if *self.kind() != Kind::Operator(",") {
            return Ok(first);
        }
        let mut targets = vec![first];
        while self.accept(",") {
            if matches!(self.kind(), Kind::Operator("=") | Kind::Name("in")) {
                break;
            }
            targets.push(self.target()?);
        }
        Ok(Target::Unpack(targets))
    }

    fn target(&mut self) -> Outcome<Target> {
        for (open, close) in [("(", ")"), ("[", "]")] {
            if self.accept(open) {
                self.deeper()?;
                let target = self.targets()?;
                self.depth -= 1;
                self.expect(close)?;
                return Ok(target);
            }
        }
        let (start, line) = (self.at, self.line());
        if let Kind::Name(name) = *self.kind()
            && !matches!(self.tokens[self.at + 1].kind, Kind::Operator("." | "[" | "("))
        {
            self.own_name()?;
            return Ok(self.declare(name, line));
        }
        self.at = start;
        let place = self.operand()?;
        match place.op {
            Op::Index(place) => Ok(Target::Index(place)),
            Op::Attribute(thing, name) => Ok(Target::Attribute(thing, name)),
            _ => Err(Fault::new(line, "nothing can be assigned to this")),
        }
    }

    /// Declares a name that gets a value.
    fn declare(&mut self, name: &'a str, line: u32) -> Target {
        let is_shared = self.signatures.iter().any(|(function, _)| *function == name)
            || (self.in_function && self.globals.contains(&name));
        if is_shared {
            let message =
                format!("`{name}` is a constant or function of the script; choose another name");
            self.problem(line, message);
        }
        if !self.in_function
            && !self.scope.is_inner()
            && let Some(global) = self.globals.iter().position(|global| *global == name)
        {
            return Target::Global(global);
        }
        Target::Local(self.scope.assign(name))
    }

    /// The value of a name.
    fn variable(&mut self, name: &'a str, line: u32) -> Op {
        match self.scope.find(name) {
            Some(Variable::Known(slot)) => return Op::Local(slot),
            Some(Variable::Pending(slot)) if self.in_function => return Op::Local(slot),
            _ => {}
        }
        if let Some(global) = self.globals.iter().position(|global| *global == name) {
            return Op::Global(global);
        }
        if self.signatures.iter().any(|(function, _)| *function == name) {
            self.problem(line, format!("`{name}` is a function: call it, `{name}(...)`"));
            return Op::Nothing;
        }
        // In a loop, the assignment may follow further down.
        Op::Local(self.scope.expect(name, line))
    }

    /// Begins an expression within another one.
    fn deeper(&mut self) -> Outcome<()> {
        self.depth += 1;
        if self.depth > crate::code::DEPTH {
            return Err(self.fault("too many nested expressions; use variables"));
        }
        Ok(())
    }
}
