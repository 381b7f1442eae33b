//! What a script may use: work per call, and memory.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use crate::value::Holder;

/// What operations cost, in units of some three nanoseconds. Whoever reads all of a text,
/// list or dict pays for its length; `value` and `key` give access to them only so.
pub(crate) mod cost {
    /// A statement, an iteration, a call, or an element that a function goes through.
    pub const STATEMENT: u64 = 64;
    /// A step in the evaluation of an expression.
    pub const OPERATION: usize = 2;
    /// A list, dict or text that is made.
    pub const CONTAINER: usize = 16;
    /// An entry of a dict that is found by its key.
    pub const ENTRY: usize = 16;
    /// A function such as the sine.
    pub const FUNCTION: usize = 32;
    /// Bytes of texts that are copied, compared or hashed for one unit.
    pub const BYTES: usize = 8;
}

/// Units of work after which the host is asked whether to go on: a few milliseconds.
const PATIENCE: u64 = 1 << 20;

/// What a script may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Work per call, in statements: a statement, an iteration, a call and an element that a
    /// function goes through count as one; operations within a statement, and the texts that
    /// they copy, compare or hash, by what they take.
    pub work: u64,
    /// Bytes that its lists, dicts and texts may take at any time.
    pub memory: usize,
}

/// How much of it is used.
#[derive(Debug)]
pub struct Meter {
    limits: Limits,
    /// Work that the call may still do, in units.
    work_left: Cell<u64>,
    /// The host is asked whether to go on when so little is left.
    next_question: Cell<u64>,
    memory: Cell<usize>,
    /// Those that may be part of a cycle, and how many there were when it was last seen who
    /// is still in use.
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

    /// A call begins.
    pub(crate) fn refill(&self) {
        self.work_left.set(self.limits.work.saturating_mul(cost::STATEMENT));
        self.ask_later();
    }

    /// Takes the work of so many statements; fails if there is not so much left.
    #[inline]
    pub fn work(&self, statements: usize) -> Result<(), String> {
        self.take_units((statements as u64).saturating_mul(cost::STATEMENT))
    }

    /// Takes units of work, of which a statement has [`cost::STATEMENT`].
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
            "does too much: more than {} statements, iterations and calls in one step, or as much \
             work within them",
            self.limits.work
        )
    }

    /// Whether so much work has been done since the host was asked that it is asked again.
    #[inline]
    pub(crate) fn is_question_due(&self) -> bool {
        self.work_left.get() <= self.next_question.get()
    }

    /// The host was asked.
    pub(crate) fn ask_later(&self) {
        // The last question of a call is the one at zero, which never comes.
        self.next_question.set(self.work_left.get().saturating_sub(PATIENCE));
    }

    /// Fails if there is no room for so many bytes, before anything is made that takes them.
    pub(crate) fn check_room(&self, bytes: usize) -> Result<(), String> {
        self.take(bytes)?;
        self.release(bytes);
        Ok(())
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
