//! Lists and dicts: shared, metered, and possibly parts of cycles.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::mem;
use std::rc::{Rc, Weak};

use indexmap::IndexMap;

use super::{ELEMENT, OVERHEAD, Value};
use crate::error::Outcome;
use crate::key::Key;
use crate::meter::{Meter, cost};

/// Most bytes of an entry of a dict.
const ENTRY: usize = 2 * (size_of::<(Key, Value)>() + 16);
/// A list or a tuple.
pub struct List {
    pub(super) items: RefCell<Vec<Value>>,
    pub(super) is_tuple: bool,
    pub(super) state: Cell<State>,
    pub(super) meter: Rc<Meter>,
}

/// A dict.
pub struct Dict {
    pub(super) entries: RefCell<IndexMap<Key, Value>>,
    pub(super) state: Cell<State>,
    pub(super) meter: Rc<Meter>,
}

#[derive(Clone, Copy, Default)]
pub(super) struct State {
    /// Whether it is immutable from now on.
    pub(super) is_frozen: bool,
    /// Whether the meter has noted it as a possible part of a cycle.
    pub(super) is_noted: bool,
}

/// A list or dict that may contain itself.
#[derive(Debug)]
pub(crate) enum Holder {
    List(Weak<List>),
    Dict(Weak<Dict>),
}

impl Holder {
    pub(crate) fn is_used(&self) -> bool {
        match self {
            Self::List(list) => list.strong_count() > 0,
            Self::Dict(dict) => dict.strong_count() > 0,
        }
    }

    pub(crate) fn empty(&self) {
        match self {
            Self::List(list) => list.upgrade().map(|list| bury(list.take())),
            Self::Dict(dict) => dict.upgrade().map(|dict| bury(dict.take())),
        };
    }
}

/// Drops values, however deep they are nested.
fn bury(mut values: Vec<Value>) {
    while let Some(value) = values.pop() {
        match value {
            Value::List(list) => {
                if let Some(list) = Rc::into_inner(list) {
                    values.append(&mut list.take());
                }
            }
            Value::Dict(dict) => {
                if let Some(dict) = Rc::into_inner(dict) {
                    values.append(&mut dict.take());
                }
            }
            _ => {}
        }
    }
}

impl Drop for List {
    fn drop(&mut self) {
        bury(self.take());
        self.meter.release(OVERHEAD);
    }
}

impl Drop for Dict {
    fn drop(&mut self) {
        bury(self.take());
        self.meter.release(OVERHEAD);
    }
}

impl List {
    fn take(&self) -> Vec<Value> {
        let items = mem::take(&mut *self.items.borrow_mut());
        self.meter.release(ELEMENT * items.len());
        items
    }

    /// A copy of its elements. Each element costs the work of a statement.
    ///
    /// # Errors
    ///
    /// If too little work is left.
    pub fn items(&self) -> Result<Vec<Value>, String> {
        self.meter.work(self.len())?;
        Ok(self.items.borrow().clone())
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.items.borrow().len()
    }

    /// Whether it has no elements.
    pub fn is_empty(&self) -> bool {
        self.items.borrow().is_empty()
    }

    /// The element at `index`; `None` if it does not exist.
    pub fn get(&self, index: usize) -> Option<Value> {
        self.items.borrow().get(index).cloned()
    }

    pub(crate) fn is_tuple(&self) -> bool {
        self.is_tuple
    }

    fn check_mutable(&self) -> Result<(), String> {
        if self.is_tuple {
            Err("a tuple cannot be changed; use a list, `[...]`".into())
        } else if self.state.get().is_frozen {
            Err("this list cannot be changed: it is a constant of the script, or the host's".into())
        } else {
            Ok(())
        }
    }

    /// Inserts an element before number `index`.
    pub(crate) fn insert(self: &Rc<Self>, index: usize, value: Value) -> Outcome<()> {
        self.check_mutable()?;
        self.meter.take(ELEMENT)?;
        self.note(&value);
        let mut items = self.items.borrow_mut();
        let index = index.min(items.len());
        items.insert(index, value);
        Ok(())
    }

    /// Replaces an element, which must exist.
    pub(crate) fn set(self: &Rc<Self>, index: usize, value: Value) -> Outcome<()> {
        self.check_mutable()?;
        self.note(&value);
        let old = mem::replace(&mut self.items.borrow_mut()[index], value);
        drop(old);
        Ok(())
    }

    /// Removes an element, which must exist.
    pub(crate) fn remove(&self, index: usize) -> Outcome<Value> {
        self.check_mutable()?;
        let value = self.items.borrow_mut().remove(index);
        self.meter.release(ELEMENT);
        Ok(value)
    }

    pub(crate) fn clear(&self) -> Outcome<()> {
        self.check_mutable()?;
        bury(self.take());
        Ok(())
    }

    fn note(self: &Rc<Self>, value: &Value) {
        let state = self.state.get();
        if value.is_container() && !state.is_noted {
            self.state.set(State { is_noted: true, ..state });
            self.meter.note(Holder::List(Rc::downgrade(self)));
        }
    }
}

impl Dict {
    fn take(&self) -> Vec<Value> {
        let entries = mem::take(&mut *self.entries.borrow_mut());
        self.meter.release(entries.keys().map(|key| ENTRY + key.bytes()).sum());
        entries.into_values().collect()
    }

    pub(crate) fn len(&self) -> usize {
        self.entries.borrow().len()
    }

    /// The value of a key that is a text.
    pub fn get_text(&self, key: &str) -> Option<Value> {
        self.entries.borrow().get(&Key::Text(key.to_owned())).cloned()
    }

    /// Converts a value to a key of this dict.
    pub(crate) fn key(&self, value: &Value) -> Result<Key, String> {
        Key::new(value, &self.meter)
    }

    pub(crate) fn get(&self, key: &Key) -> Result<Option<Value>, String> {
        self.pay_for(key)?;
        Ok(self.entries.borrow().get(key).cloned())
    }

    /// Takes the work of finding a key.
    fn pay_for(&self, key: &Key) -> Result<(), String> {
        self.meter.spend(cost::ENTRY + key.bytes() / cost::BYTES)
    }

    pub(crate) fn set(self: &Rc<Self>, key: Key, value: Value) -> Outcome<()> {
        self.check_mutable()?;
        self.pay_for(&key)?;
        let state = self.state.get();
        if value.is_container() && !state.is_noted {
            self.state.set(State { is_noted: true, ..state });
            self.meter.note(Holder::Dict(Rc::downgrade(self)));
        }
        let mut entries = self.entries.borrow_mut();
        if !entries.contains_key(&key) {
            self.meter.take(ENTRY + key.bytes())?;
        }
        let old = entries.insert(key, value);
        drop(entries);
        drop(old);
        Ok(())
    }

    /// Removes an entry; later ones move up.
    pub(crate) fn remove(&self, key: &Key) -> Outcome<Option<Value>> {
        self.check_mutable()?;
        self.meter.work(self.len() / 8)?;
        self.pay_for(key)?;
        let value = self.entries.borrow_mut().shift_remove(key);
        if value.is_some() {
            self.meter.release(ENTRY + key.bytes());
        }
        Ok(value)
    }

    pub(crate) fn clear(&self) -> Outcome<()> {
        self.check_mutable()?;
        bury(self.take());
        Ok(())
    }

    /// Copies of its keys. Each key costs the work of a statement.
    pub(crate) fn keys(&self) -> Result<Vec<Key>, String> {
        self.meter.work(self.len())?;
        let entries = self.entries.borrow();
        self.meter.read(entries.keys().map(Key::bytes).sum())?;
        Ok(entries.keys().cloned().collect())
    }

    fn check_mutable(&self) -> Result<(), String> {
        if self.state.get().is_frozen {
            return Err("this dict cannot be changed: it is a constant of the script".into());
        }
        Ok(())
    }
}

impl fmt::Debug for List {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "list of {}", self.len())
    }
}

impl fmt::Debug for Dict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "dict of {}", self.len())
    }
}
