//! The variables of a function, and their slots.

/// Variables by their names.
#[derive(Debug, Default)]
pub(super) struct Scope<'a> {
    variables: Vec<Entry<'a>>,
    /// Names of comprehensions and lambdas that are open, with their slots.
    inner: Vec<(&'a str, usize)>,
    /// Number of open comprehensions and lambdas.
    n_open: usize,
    n_locals: usize,
}

#[derive(Debug)]
struct Entry<'a> {
    name: &'a str,
    slot: usize,
    is_assigned: bool,
    /// Line of the first reading.
    line: u32,
}

/// A variable that occurred earlier in the text.
pub(super) enum Variable {
    /// A variable that was assigned.
    Known(usize),
    /// A variable that was only read.
    Pending(usize),
}

impl<'a> Scope<'a> {
    /// Slots of a frame.
    pub(super) fn n_locals(&self) -> usize {
        self.n_locals
    }

    fn slot(&mut self) -> usize {
        self.n_locals += 1;
        self.n_locals - 1
    }

    /// Declares the next parameter; false if the name exists already.
    pub(super) fn declare_parameter(&mut self, name: &'a str) -> bool {
        let is_new = self.variables.iter().all(|entry| entry.name != name);
        let slot = self.slot();
        self.variables.push(Entry { name, slot, is_assigned: true, line: 0 });
        is_new
    }

    /// Declares a name that gets a value.
    pub(super) fn assign(&mut self, name: &'a str) -> usize {
        if self.n_open > 0 {
            let slot = self.slot();
            self.inner.push((name, slot));
            return slot;
        }
        if let Some(entry) = self.variables.iter_mut().find(|entry| entry.name == name) {
            entry.is_assigned = true;
            return entry.slot;
        }
        let slot = self.slot();
        self.variables.push(Entry { name, slot, is_assigned: true, line: 0 });
        slot
    }

    /// Notes a name that is read without a value so far.
    pub(super) fn expect(&mut self, name: &'a str, line: u32) -> usize {
        let slot = self.slot();
        self.variables.push(Entry { name, slot, is_assigned: false, line });
        slot
    }

    pub(super) fn find(&self, name: &str) -> Option<Variable> {
        if let Some((_, slot)) = self.inner.iter().rev().find(|(inner, _)| *inner == name) {
            return Some(Variable::Known(*slot));
        }
        let entry = self.variables.iter().find(|entry| entry.name == name)?;
        Some(match entry.is_assigned {
            true => Variable::Known(entry.slot),
            false => Variable::Pending(entry.slot),
        })
    }

    /// Begins a comprehension or lambda, which owns the names declared until its end. Returns the
    /// mark for [`close`](Self::close).
    pub(super) fn open(&mut self) -> usize {
        self.n_open += 1;
        self.inner.len()
    }

    /// Ends a comprehension or lambda.
    pub(super) fn close(&mut self, mark: usize) {
        self.n_open -= 1;
        self.inner.truncate(mark);
    }

    /// Whether a comprehension or lambda is open.
    pub(super) fn is_inner(&self) -> bool {
        self.n_open > 0
    }

    /// Names that are read and never assigned, with the line of the first reading.
    pub(super) fn never_assigned(&self) -> impl Iterator<Item = (&'a str, u32)> {
        let pending = self.variables.iter().filter(|entry| !entry.is_assigned);
        pending.map(|entry| (entry.name, entry.line))
    }

    /// Names that are assigned somewhere.
    pub(super) fn assigned(&self) -> impl Iterator<Item = &'a str> {
        self.variables.iter().filter(|entry| entry.is_assigned).map(|entry| entry.name)
    }
}
