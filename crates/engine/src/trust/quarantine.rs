//! Workers that are proved faulty, and get no items until an operator readmits them.

use std::{collections::BTreeMap, num::NonZeroU64};

use super::super::Introduction;

/// Most names in quarantine. Beyond them, a faulty worker gets nothing until it reconnects, and
/// then items again.
const N_MAX: usize = 4096;

/// The faulty workers, by name, because a restarted worker still runs on the same machine.
#[derive(Debug, Default)]
pub struct Quarantine {
    by_name: BTreeMap<String, Entry>,
}

#[derive(Debug)]
struct Entry {
    /// Recognises its process if it reconnects under another name.
    process: Option<NonZeroU64>,
    reason: String,
}

impl Quarantine {
    /// Adds a worker; returns whether it is new and there was room.
    pub fn add(&mut self, name: &str, process: Option<NonZeroU64>, reason: &str) -> bool {
        let is_added = !self.by_name.contains_key(name) && self.by_name.len() < N_MAX;
        if is_added {
            let entry = Entry { process, reason: reason.to_owned() };
            self.by_name.insert(name.to_owned(), entry);
        }
        is_added
    }

    /// Lets a worker out of quarantine; returns whether it was there.
    pub fn remove(&mut self, name: &str) -> bool {
        self.by_name.remove(name).is_some()
    }

    /// Why a worker is in quarantine, if it is.
    pub fn reason(&self, introduction: &Introduction) -> Option<&str> {
        self.entry(introduction).map(|(_, entry)| &*entry.reason)
    }

    /// The name under which a worker is in quarantine, if it is; operators readmit it by this
    /// name.
    pub fn name(&self, introduction: &Introduction) -> Option<&str> {
        self.entry(introduction).map(|(name, _)| &**name)
    }

    fn entry(&self, introduction: &Introduction) -> Option<(&String, &Entry)> {
        let is_its = |(_, entry): &(&String, &Entry)| {
            entry.process.is_some() && entry.process == introduction.process
        };
        let by_name = self.by_name.get_key_value(&*introduction.name);
        by_name.or_else(|| self.by_name.iter().find(is_its))
    }

    /// The names and the reasons.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.by_name.iter().map(|(name, entry)| (&**name, &*entry.reason))
    }
}
