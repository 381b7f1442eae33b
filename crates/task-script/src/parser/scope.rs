//! The variables of a function, and where each is kept.

/// Variables by their names.
#[derive(Debug, Default)]
pub(super) struct Scope<'a> {
    variables: Vec<Entry<'a>>,
    /// Names of comprehensions and lambdas that are open, with their slots.
    inner: Vec<(&'a str, usize)>,
    /// How many of them hide what is outside: where the open ones begin.
    n_open: usize,
    n_locals: usize,
}

#[derive(Debug)]
struct Entry<'a> {
    name: &'a str,
    slot: usize,
    is_assigned: bool,
    /// Where it was seen first.
    line: u32,
}

/// A variable that was seen before.
pub(super) enum Variable {
    /// It was assigned, further up in the text.
    Known(usize),
    /// It was only read.
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

    /// The next parameter; false if there is one of this name.
    pub(super) fn declare_parameter(&mut self, name: &'a str) -> bool {
        let is_new = self.variables.iter().all(|entry| entry.name != name);
        let slot = self.slot();
        self.variables.push(Entry { name, slot, is_assigned: true, line: 0 });
        is_new
    }

    /// A name gets a value.
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

    /// A name is read that has no value so far.
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

    /// A comprehension or lambda begins: what is assigned from now on is its own. Returns
    /// what [`close`](Self::close) needs.
    pub(super) fn open(&mut self) -> usize {
        self.n_open += 1;
        self.inner.len()
    }

    /// It ends.
    pub(super) fn close(&mut self, mark: usize) {
        self.n_open -= 1;
        self.inner.truncate(mark);
    }

    /// Whether a comprehension or lambda is open.
    pub(super) fn is_inner(&self) -> bool {
        self.n_open > 0
    }

    /// Names that are read and have no value anywhere, with the line of the first reading.
    pub(super) fn never_assigned(&self) -> impl Iterator<Item = (&'a str, u32)> {
        let pending = self.variables.iter().filter(|entry| !entry.is_assigned);
        pending.map(|entry| (entry.name, entry.line))
    }

    /// Names that have a value somewhere.
    pub(super) fn assigned(&self) -> impl Iterator<Item = &'a str> {
        self.variables.iter().filter(|entry| entry.is_assigned).map(|entry| entry.name)
    }
}
