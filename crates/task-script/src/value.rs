//! The values of a script.

mod containers;

use std::cell::{Cell, RefCell};
use std::fmt;
use std::rc::Rc;

use crate::meter::{Meter, cost};

pub(crate) use self::containers::Holder;
use self::containers::State;
pub use self::containers::{Dict, List};

/// Most bytes of an element of a list.
pub(crate) const ELEMENT: usize = 2 * size_of::<Value>();
/// Most bytes of a list, dict or text without its content.
const OVERHEAD: usize = 160;
/// Largest nesting depth of lists to compare.
pub(crate) const COMPARED_DEPTH: usize = 16;

/// A value. Lists and dicts are shared, as in Python.
#[derive(Clone)]
pub enum Value {
    /// `None`.
    Nothing,
    /// `True` or `False`.
    Bool(bool),
    /// A whole number of 64 bits.
    Int(i64),
    /// A number of double precision.
    Float(f64),
    /// A text.
    Text(Rc<Text>),
    /// A list or a tuple.
    List(Rc<List>),
    /// A dict, which keeps the order of insertion.
    Dict(Rc<Dict>),
    /// An object of the host.
    Object(Object),
}

/// An object of the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Object {
    /// Its kind, an index of the [vocabulary](crate::Vocabulary).
    pub kind: u8,
    /// Its number among the objects of its kind.
    pub index: u32,
}

/// A text.
pub struct Text {
    text: String,
    meter: Rc<Meter>,
}

impl Drop for Text {
    fn drop(&mut self) {
        self.meter.release(OVERHEAD + self.text.len());
    }
}

impl Value {
    /// Makes a text.
    ///
    /// # Errors
    ///
    /// If too little memory or work is left.
    pub fn text(text: &str, meter: &Rc<Meter>) -> Result<Self, String> {
        meter.spend(cost::CONTAINER)?;
        meter.read(text.len())?;
        meter.take(OVERHEAD + text.len())?;
        Ok(Self::Text(Rc::new(Text { text: text.to_owned(), meter: Rc::clone(meter) })))
    }

    /// Makes a list.
    ///
    /// # Errors
    ///
    /// If too little memory or work is left.
    pub fn list(items: Vec<Self>, meter: &Rc<Meter>) -> Result<Self, String> {
        Self::sequence(items, false, meter)
    }

    /// Makes a tuple.
    ///
    /// # Errors
    ///
    /// If too little memory or work is left.
    pub fn tuple(items: Vec<Self>, meter: &Rc<Meter>) -> Result<Self, String> {
        Self::sequence(items, true, meter)
    }

    fn sequence(items: Vec<Self>, is_tuple: bool, meter: &Rc<Meter>) -> Result<Self, String> {
        meter.spend(cost::CONTAINER)?;
        meter.take(OVERHEAD + ELEMENT * items.len())?;
        let (items, meter) = (RefCell::new(items), Rc::clone(meter));
        Ok(Self::List(Rc::new(List { items, is_tuple, state: Cell::default(), meter })))
    }

    /// Makes an empty dict.
    ///
    /// # Errors
    ///
    /// If too little memory or work is left.
    pub fn dict(meter: &Rc<Meter>) -> Result<Self, String> {
        meter.spend(cost::CONTAINER)?;
        meter.take(OVERHEAD)?;
        let (entries, meter) = (RefCell::default(), Rc::clone(meter));
        Ok(Self::Dict(Rc::new(Dict { entries, state: Cell::default(), meter })))
    }

    /// The value as a float, if it is a number.
    #[inline]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Int(value) => Some(*value as f64),
            Self::Float(value) => Some(*value),
            _ => None,
        }
    }

    /// The text, if the value is one. A comparison with a few short names is free. Code that reads
    /// the whole text has to take the work of reading.
    pub fn as_text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(&text.text) } else { None }
    }

    /// The text, if the value is one; takes the work of one reading.
    pub(crate) fn read_text(&self) -> Result<Option<&str>, String> {
        let Self::Text(text) = self else { return Ok(None) };
        text.meter.read(text.text.len())?;
        Ok(Some(&text.text))
    }

    /// Whether the value counts as true in a condition: all values do except `None`, `False`, zero
    /// and empty ones.
    pub fn is_true(&self) -> bool {
        match self {
            Self::Nothing => false,
            Self::Bool(value) => *value,
            Self::Int(value) => *value != 0,
            Self::Float(value) => *value != 0.0,
            Self::Text(text) => !text.text.is_empty(),
            Self::List(list) => !list.is_empty(),
            Self::Dict(dict) => dict.len() > 0,
            Self::Object(_) => true,
        }
    }

    /// Its kind, for messages.
    pub fn kind(&self) -> &'static str {
        let with_article = self.kind_with_article();
        with_article.split_once(' ').map_or(with_article, |(_, kind)| kind)
    }

    /// Its kind with an article, for messages.
    pub fn kind_with_article(&self) -> &'static str {
        match self {
            Self::Nothing => "None",
            Self::Bool(_) => "a bool",
            Self::Int(_) => "an int",
            Self::Float(_) => "a float",
            Self::Text(_) => "a string",
            Self::List(list) if list.is_tuple => "a tuple",
            Self::List(_) => "a list",
            Self::Dict(_) => "a dict",
            Self::Object(_) => "a thing of the world",
        }
    }

    fn is_container(&self) -> bool {
        matches!(self, Self::List(_) | Self::Dict(_))
    }

    /// Makes all lists and dicts within the value immutable.
    pub fn freeze(&self) {
        let mut pending = vec![self.clone()];
        while let Some(value) = pending.pop() {
            let state = match &value {
                Self::List(list) => &list.state,
                Self::Dict(dict) => &dict.state,
                _ => continue,
            };
            if state.get().is_frozen {
                continue;
            }
            state.set(State { is_frozen: true, ..state.get() });
            // A list or dict freezes only once, so the work of making it covers the work here.
            match &value {
                Self::List(list) => pending.extend(list.items.borrow().iter().cloned()),
                Self::Dict(dict) => pending.extend(dict.entries.borrow().values().cloned()),
                _ => {}
            }
        }
    }

    /// `==`.
    pub(crate) fn equals(&self, other: &Self, meter: &Meter) -> Result<bool, String> {
        self.equals_within(other, meter, COMPARED_DEPTH)
    }

    fn equals_within(&self, other: &Self, meter: &Meter, depth: usize) -> Result<bool, String> {
        meter.work(1)?;
        Ok(match (self, other) {
            (Self::Nothing, Self::Nothing) => true,
            (Self::Bool(a), Self::Bool(b)) => a == b,
            (Self::Int(a), Self::Int(b)) => a == b,
            (Self::Text(a), Self::Text(b)) => {
                if a.text.len() != b.text.len() {
                    return Ok(false);
                }
                meter.read(a.text.len())?;
                a.text == b.text
            }
            (Self::Object(a), Self::Object(b)) => a == b,
            (Self::List(a), Self::List(b)) => {
                if Rc::ptr_eq(a, b) {
                    return Ok(true);
                }
                if a.len() != b.len() || a.is_tuple != b.is_tuple {
                    return Ok(false);
                }
                if depth == 0 {
                    return Err("lists nested this deep cannot be compared".into());
                }
                let (a, b) = (a.items.borrow(), b.items.borrow());
                for (a, b) in a.iter().zip(b.iter()) {
                    if !a.equals_within(b, meter, depth - 1)? {
                        return Ok(false);
                    }
                }
                true
            }
            (Self::Dict(a), Self::Dict(b)) if Rc::ptr_eq(a, b) => true,
            (Self::Dict(_), Self::Dict(_)) => return Err("dicts cannot be compared".into()),
            _ => match (self.number(), other.number()) {
                (Some(a), Some(b)) => a == b,
                _ => false,
            },
        })
    }
}

impl fmt::Debug for Value {
    /// Its kind and, if it is simple, the value, but no nested values.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Int(value) => write!(f, "{value}"),
            Self::Float(value) => write!(f, "{value:?}"),
            Self::Text(text) => write!(f, "{:?}", text.text),
            Self::Object(object) => write!(f, "{object:?}"),
            _ => f.write_str(self.kind()),
        }
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.text)
    }
}
