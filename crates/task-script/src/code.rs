//! The executable form of a script: a tree with numbers instead of names.

/// A name of the host, as index in the [`Vocabulary`](crate::Vocabulary).
pub type Name = u16;

/// An expression.
#[derive(Debug)]
pub(crate) struct Expr {
    pub(crate) line: u32,
    /// Nesting depth of its expressions; at most [`DEPTH`].
    pub(crate) depth: u16,
    pub(crate) op: Op,
}

/// Largest nesting depth of expressions, so that their execution takes little stack.
pub(crate) const DEPTH: u16 = 50;

#[derive(Debug)]
pub(crate) enum Op {
    Nothing,
    Bool(bool),
    Int(i64),
    Float(f64),
    /// Number of a literal.
    Text(usize),
    Local(usize),
    Global(usize),
    List(Vec<Expr>),
    Tuple(Vec<Expr>),
    Dict(Vec<(Expr, Expr)>),
    ListOf(Box<Expr>, Vec<Clause>),
    DictOf(Box<(Expr, Expr)>, Vec<Clause>),
    Not(Box<Expr>),
    Negative(Box<Expr>),
    Positive(Box<Expr>),
    Binary(Binary, Box<(Expr, Expr)>),
    And(Box<(Expr, Expr)>),
    Or(Box<(Expr, Expr)>),
    /// Condition, value if true, value if false.
    If(Box<(Expr, Expr, Expr)>),
    Attribute(Box<Expr>, Name),
    Index(Box<(Expr, Expr)>),
    Slice(Box<(Expr, Option<Expr>, Option<Expr>)>),
    /// A function of the script, by its number.
    Call(usize, Vec<Expr>),
    Builtin(Builtin, Vec<Expr>),
    /// `sorted`, `min` or `max` of a list, by a key.
    Order(Box<Order>),
    Method(Box<Expr>, Called, Vec<Expr>),
}

/// Binary operators that evaluate both operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    FloorDivide,
    Remainder,
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    In,
    NotIn,
}

impl Binary {
    /// The operator in the text of a script.
    pub(crate) fn symbol(self) -> &'static str {
        match self {
            Self::Add => "+",
            Self::Subtract => "-",
            Self::Multiply => "*",
            Self::Divide => "/",
            Self::FloorDivide => "//",
            Self::Remainder => "%",
            Self::Equal => "==",
            Self::NotEqual => "!=",
            Self::Less => "<",
            Self::LessOrEqual => "<=",
            Self::Greater => ">",
            Self::GreaterOrEqual => ">=",
            Self::In => "in",
            Self::NotIn => "not in",
        }
    }
}

/// Part of a comprehension.
#[derive(Debug)]
pub(crate) enum Clause {
    For(Target, Expr),
    If(Expr),
}

/// The target of an assignment.
#[derive(Debug)]
pub(crate) enum Target {
    Local(usize),
    Global(usize),
    Unpack(Vec<Target>),
    Index(Box<(Expr, Expr)>),
    Attribute(Box<Expr>, Name),
}

/// A request to order a list by keys.
#[derive(Debug)]
pub(crate) struct Order {
    pub(crate) which: Which,
    pub(crate) list: Expr,
    pub(crate) key: Option<ElementKey>,
    /// Whether the largest element comes first.
    pub(crate) reverse: Option<Expr>,
}

/// The requested elements of the order: the first, the last or all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Which {
    First,
    Last,
    All,
}

/// The key that orders elements.
#[derive(Debug)]
pub(crate) enum ElementKey {
    Function(usize),
    /// `lambda`: the slot of its argument, and the value.
    Lambda(usize, Expr),
}

/// The method of a call, by its name: one of lists and dicts, one of the host's objects, or both.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Called {
    pub(crate) container: Option<Method>,
    pub(crate) host: Option<Name>,
}

/// Makes an enum and its names from one row per name.
macro_rules! names {
    ($(#[$doc:meta])* $kind:ident { $($name:literal = $variant:ident,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum $kind { $($variant),* }

        impl $kind {
            pub(crate) const NAMES: &[&str] = &[$($name),*];

            pub(crate) fn named(name: &str) -> Option<Self> {
                match name {
                    $($name => Some(Self::$variant),)*
                    _ => None,
                }
            }

            pub(crate) fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

names! {
    /// Methods of lists and dicts.
    Method {
        "append" = Append,
        "clear" = Clear,
        "extend" = Extend,
        "get" = Get,
        "index" = Index,
        "insert" = Insert,
        "items" = Items,
        "keys" = Keys,
        "pop" = Pop,
        "values" = Values,
    }
}

names! {
    /// Functions that every script has.
    Builtin {
        "abs" = Abs,
        "all" = All,
        "any" = Any,
        "bool" = Bool,
        "enumerate" = Enumerate,
        "fail" = Fail,
        "float" = Float,
        "int" = Int,
        "len" = Len,
        "list" = List,
        "max" = Max,
        "min" = Min,
        "range" = Range,
        "reversed" = Reversed,
        "sorted" = Sorted,
        "sum" = Sum,
        "zip" = Zip,
        "math.acos" = Acos,
        "math.asin" = Asin,
        "math.atan" = Atan,
        "math.atan2" = Atan2,
        "math.ceil" = Ceil,
        "math.cos" = Cos,
        "math.exp" = Exp,
        "math.floor" = Floor,
        "math.hypot" = Hypot,
        "math.log" = Log,
        "math.pow" = Pow,
        "math.sin" = Sin,
        "math.sqrt" = Sqrt,
        "math.tan" = Tan,
    }
}

/// A statement.
#[derive(Debug)]
pub(crate) struct Stmt {
    pub(crate) line: u32,
    pub(crate) kind: StmtKind,
}

#[derive(Debug)]
pub(crate) enum StmtKind {
    Expr(Expr),
    Assign(Target, Expr),
    Modify(Target, Binary, Expr),
    /// Conditions with their blocks, and the block of `else`.
    If(Vec<(Expr, Vec<Stmt>)>, Vec<Stmt>),
    For(Target, Expr, Vec<Stmt>),
    Return(Option<Expr>),
    Break,
    Continue,
    Pass,
}

/// A function.
#[derive(Debug)]
pub(crate) struct Function {
    pub(crate) name: String,
    pub(crate) line: u32,
    pub(crate) n_parameters: usize,
    /// Number of slots of its frame, parameters first.
    pub(crate) n_locals: usize,
    pub(crate) body: Vec<Stmt>,
    /// The keys of the dict with literal keys that it returns; `None` if it also returns other
    /// values.
    pub(crate) returned_keys: Option<Vec<String>>,
}
