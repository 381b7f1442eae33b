//! What a script may use: work per call, and memory.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use crate::value::Holder;

/// What a script may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Units of work per call: one for each statement, iteration and call, and one for each
    /// element that a function goes through.
    pub work: u64,
    /// Bytes that its lists, dicts and texts may take at any time.
    pub memory: usize,
}

/// How much of it is used.
#[derive(Debug)]
pub struct Meter {
    limits: Limits,
    /// Work that the call may still do.
    work_left: Cell<u64>,
    memory: Cell<usize>,
    /// Those that may be part of a cycle, and how many there were when it was last seen who
    /// is still in use.
    holders: RefCell<(Vec<Holder>, usize)>,
}

impl Meter {
    pub(crate) fn new(limits: Limits) -> Rc<Self> {
        let (work_left, memory) = (Cell::new(limits.work), Cell::new(0));
        Rc::new(Self { limits, work_left, memory, holders: RefCell::default() })
    }

    /// A call begins.
    pub(crate) fn refill(&self) {
        self.work_left.set(self.limits.work);
    }

    /// Takes units of work; fails if there are not so many left.
    #[inline]
    pub fn work(&self, units: usize) -> Result<(), String> {
        match self.work_left.get().checked_sub(units as u64) {
            Some(left) => {
                self.work_left.set(left);
                Ok(())
            }
            None => Err(format!(
                "does too much: more than {} statements, iterations and calls in one step",
                self.limits.work
            )),
        }
    }

    /// Takes memory; fails if there is not so much left.
    pub(crate) fn take(&self, bytes: usize) -> Result<(), String> {
        let memory = self.memory.get().saturating_add(bytes);
        if memory > self.limits.memory {
            return Err(format!(
                "keeps too much: more than {} KiB in lists, dicts and texts",
                self.limits.memory / 1024
            ));
        }
        self.memory.set(memory);
        Ok(())
    }

    pub(crate) fn release(&self, bytes: usize) {
        self.memory.set(self.memory.get().saturating_sub(bytes));
    }

    /// Bytes in use.
    #[cfg(test)]
    pub(crate) fn memory(&self) -> usize {
        self.memory.get()
    }

    /// Notes what may hold itself, so that it can be taken apart in the end.
    pub(crate) fn note(&self, holder: Holder) {
        let (holders, n_used) = &mut *self.holders.borrow_mut();
        holders.push(holder);
        if holders.len() > 2 * *n_used + 64 {
            holders.retain(Holder::is_used);
            *n_used = holders.len();
        }
    }

    /// Takes apart what may hold itself.
    pub(crate) fn take_apart(&self) {
        let (holders, _) = std::mem::take(&mut *self.holders.borrow_mut());
        for holder in holders {
            holder.empty();
        }
    }
}
