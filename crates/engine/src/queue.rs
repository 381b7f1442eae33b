//! Items that wait for a worker, in the order of assignment.

use std::{
    collections::{VecDeque, vec_deque},
    mem,
};

use super::item::Item;

/// Queued items, and the sum of their trials.
#[derive(Debug, Default)]
pub struct Queue {
    items: VecDeque<Item>,
    n_trials: usize,
}

impl Queue {
    /// Number of items.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether the queue is empty.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Number of trials of all items.
    pub fn n_trials(&self) -> usize {
        self.n_trials
    }

    /// The items.
    pub fn iter(&self) -> vec_deque::Iter<'_, Item> {
        self.items.iter()
    }

    /// Adds an item at the front.
    pub fn push_front(&mut self, item: Item) {
        self.n_trials += item.trials.len();
        self.items.push_front(item);
    }

    /// Adds an item at the back.
    pub fn push_back(&mut self, item: Item) {
        self.n_trials += item.trials.len();
        self.items.push_back(item);
    }

    /// Replaces each item by some of its parts.
    pub fn divide(&mut self, parts: impl Fn(Item) -> Vec<Item>) {
        *self = mem::take(&mut self.items).into_iter().flat_map(parts).collect();
    }

    /// Takes at most `n_trials` trials from the beginning of the first item. The remainder stays
    /// at the front.
    pub fn pop_front(&mut self, n_trials: usize) -> Option<Item> {
        let item = self.items.pop_front()?;
        let (item, rest) = self.split(item, n_trials);
        if let Some(rest) = rest {
            self.items.push_front(rest);
        }
        Some(item)
    }

    /// Like [`Self::pop_front`], but remainders wait while an item of `whole` trials is at the
    /// front. Then the last remainder goes first. So a worker gets whole items, and not pieces that
    /// are each a call of its own. A piece that returns to the front goes last.
    pub fn pop_whole_first(&mut self, n_trials: usize, whole: usize) -> Option<Item> {
        let is_whole = self.items.front()?.trials.len() == whole;
        let item = if is_whole { self.items.pop_front() } else { self.items.pop_back() }?;
        let (item, rest) = self.split(item, n_trials);
        self.items.extend(rest);
        Some(item)
    }

    /// Splits an item that was taken out: at most its first `n_trials` trials, and the remainder.
    fn split(&mut self, mut item: Item, n_trials: usize) -> (Item, Option<Item>) {
        let mut rest = None;
        if n_trials < item.trials.len() {
            let middle = item.trials.start + n_trials as u32;
            rest = Some(Item { trials: middle..item.trials.end, ..item.clone() });
            item.trials.end = middle;
        }
        self.n_trials -= item.trials.len();
        (item, rest)
    }
}

impl FromIterator<Item> for Queue {
    fn from_iter<I: IntoIterator<Item = Item>>(items: I) -> Self {
        let items: VecDeque<Item> = items.into_iter().collect();
        let n_trials = items.iter().map(|item| item.trials.len()).sum();
        Self { items, n_trials }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;

    fn item(individual: u32, trials: Range<u32>) -> Item {
        Item { individual, trials }
    }

    fn queue() -> Queue {
        (0..3).map(|individual| item(individual, 0..5)).collect()
    }

    #[test]
    fn the_rest_of_an_item_is_next() {
        let mut queue = queue();
        assert_eq!(queue.pop_front(3), Some(item(0, 0..3)));
        assert_eq!((queue.len(), queue.n_trials()), (3, 12));
        assert_eq!(queue.pop_front(5), Some(item(0, 3..5)));
        assert_eq!(queue.pop_front(5), Some(item(1, 0..5)));
    }

    #[test]
    fn whole_items_go_before_remainders_and_the_last_remainder_goes_first() {
        let mut queue = queue();
        let mut pop = |n_trials| queue.pop_whole_first(n_trials, 5);
        assert_eq!([pop(4), pop(5)], [Some(item(0, 0..4)), Some(item(1, 0..5))]);
        assert_eq!(pop(2), Some(item(2, 0..2)));
        assert_eq!([pop(2), pop(5)], [Some(item(2, 2..4)), Some(item(2, 4..5))]);
        assert_eq!([pop(5), pop(5)], [Some(item(0, 4..5)), None]);
        assert_eq!(queue.n_trials(), 0);
    }
}
