//! Counts and limits the work per call and the memory of a script.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use crate::value::Holder;

/// The costs of operations, in units of about three nanoseconds. `value` and `key` charge the
/// length of a text, list or dict for reading all of it; other modules cannot read it directly.
pub(crate) mod cost {
    /// A statement, an iteration, a call, or an element that a function visits.
    pub const STATEMENT: u64 = 64;
    /// A step in the evaluation of an expression.
    pub const OPERATION: usize = 2;
    /// Making a list, dict or text.
    pub const CONTAINER: usize = 16;
    /// Finding an entry of a dict by its key.
    pub const ENTRY: usize = 16;
    /// A function such as the sine.
    pub const FUNCTION: usize = 32;
    /// Bytes of text to copy, compare or hash per unit.
    pub const BYTES: usize = 8;
}

/// Units of work between two questions to the host: a few milliseconds.
const PATIENCE: u64 = 1 << 20;

/// The limits of a script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Work per call, in statements. A statement, an iteration, a call, and an element that a
    /// function visits count as one. Operations within a statement, and the texts that they copy,
    /// compare or hash, count by their duration.
    pub work: u64,
    /// Bytes that its lists, dicts and texts may take at any time.
    pub memory: usize,
}

/// The work and memory used so far.
#[derive(Debug)]
pub struct Meter {
    limits: Limits,
    /// Remaining work of the call, in units.
    work_left: Cell<u64>,
    /// Remaining work at which to ask the host again.
    next_question: Cell<u64>,
    memory: Cell<usize>,
    /// Lists and dicts that may be part of a cycle, and their number after the last removal of
    /// unused entries.
    holders: RefCell<(Vec<Holder>, usize)>,
}

impl Meter {
    pub(crate) fn new(limits: Limits) -> Rc<Self> {
        let meter = Self {
            limits,
            work_left: Cell::default(),
            next_question: Cell::default(),
            memory: Cell::default(),
            holders: RefCell::default(),
        };
        meter.refill();
        Rc::new(meter)
    }

    /// Begins a call, with full work.
    pub(crate) fn refill(&self) {
        self.work_left.set(self.limits.work.saturating_mul(cost::STATEMENT));
        self.ask_later();
    }

    /// Takes the work of `statements` statements.
    ///
    /// # Errors
    ///
    /// If too little work is left.
    #[inline]
    pub fn work(&self, statements: usize) -> Result<(), String> {
        self.take_units((statements as u64).saturating_mul(cost::STATEMENT))
    }

    /// Takes units of work; a statement has [`cost::STATEMENT`].
    #[inline]
    pub(crate) fn spend(&self, units: usize) -> Result<(), String> {
        self.take_units(units as u64)
    }

    /// Takes the work of reading a text once.
    #[inline]
    pub(crate) fn read(&self, bytes: usize) -> Result<(), String> {
        self.spend(bytes / cost::BYTES)
    }

    #[inline]
    fn take_units(&self, units: u64) -> Result<(), String> {
        match self.work_left.get().checked_sub(units) {
            Some(left) => {
                self.work_left.set(left);
                Ok(())
            }
            None => Err(self.too_much()),
        }
    }

    #[cold]
    fn too_much(&self) -> String {
        format!(
            "the script does too much: more than {} statements, iterations and calls in one step, or as much \
             work within them",
            self.limits.work
        )
    }

    /// Whether it is time to ask the host again.
    #[inline]
    pub(crate) fn is_question_due(&self) -> bool {
        self.work_left.get() <= self.next_question.get()
    }

    /// Schedules the next question to the host.
    pub(crate) fn ask_later(&self) {
        // At zero work, the call fails before it would ask.
        self.next_question.set(self.work_left.get().saturating_sub(PATIENCE));
    }

    /// Fails if there is no room for this many bytes, before they are allocated.
    pub(crate) fn check_room(&self, bytes: usize) -> Result<(), String> {
        self.take(bytes)?;
        self.release(bytes);
        Ok(())
    }

    /// Takes memory; fails if too little is left.
    pub(crate) fn take(&self, bytes: usize) -> Result<(), String> {
        let memory = self.memory.get().saturating_add(bytes);
        if memory > self.limits.memory {
            return Err(format!(
                "the script keeps too much: more than {} KiB in lists, dicts and texts",
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

    /// Notes a list or dict that may contain itself, for [`take_apart`](Self::take_apart).
    pub(crate) fn note(&self, holder: Holder) {
        let (holders, n_used) = &mut *self.holders.borrow_mut();
        holders.push(holder);
        if holders.len() > 2 * *n_used + 64 {
            holders.retain(Holder::is_used);
            *n_used = holders.len();
        }
    }

    /// Empties the lists and dicts that may contain themselves, which frees them.
    pub(crate) fn take_apart(&self) {
        let (holders, _) = std::mem::take(&mut *self.holders.borrow_mut());
        for holder in holders {
            holder.empty();
        }
    }
}
