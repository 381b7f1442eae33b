//! Items that wait for a worker, in the order in which they are given out.

use std::{
    collections::{VecDeque, vec_deque},
    mem,
};

use super::item::Item;

/// Items, and how many trials they have.
#[derive(Debug, Default)]
pub struct Queue {
    items: VecDeque<Item>,
    n_trials: usize,
}

impl Queue {
    /// Items.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Trials of all items.
    pub fn n_trials(&self) -> usize {
        self.n_trials
    }

    /// The items.
    pub fn iter(&self) -> vec_deque::Iter<'_, Item> {
        self.items.iter()
    }

    /// Adds an item before all others.
    pub fn push_front(&mut self, item: Item) {
        self.n_trials += item.trials.len();
        self.items.push_front(item);
    }

    /// Adds an item behind all others.
    pub fn push_back(&mut self, item: Item) {
        self.n_trials += item.trials.len();
        self.items.push_back(item);
    }

    /// Replaces each item by some of its parts.
    pub fn divide(&mut self, parts: impl Fn(Item) -> Vec<Item>) {
        *self = mem::take(&mut self.items).into_iter().flat_map(parts).collect();
    }

    /// Takes at most `n_trials` trials, the first ones, of the first item. The rest is first then.
    pub fn pop_front(&mut self, n_trials: usize) -> Option<Item> {
        let item = self.items.pop_front()?;
        let (item, rest) = self.split(item, n_trials);
        if let Some(rest) = rest {
            self.items.push_front(rest);
        }
        Some(item)
    }

    /// The same, but rests wait until no item of `whole` trials is first, and the last rest is
    /// taken first then: whoever is given whole items does not get them in pieces, each a call of
    /// its own.
    pub fn pop_whole_first(&mut self, n_trials: usize, whole: usize) -> Option<Item> {
        let is_whole = self.items.front()?.trials.len() == whole;
        let item = if is_whole { self.items.pop_front() } else { self.items.pop_back() }?;
        let (item, rest) = self.split(item, n_trials);
        self.items.extend(rest);
        Some(item)
    }

    /// At most `n_trials` trials, the first ones, of an item that was taken out, and the rest.
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
    fn whole_items_go_before_rests_and_of_these_the_last_goes_first() {
        let mut queue = queue();
        let mut pop = |n_trials| queue.pop_whole_first(n_trials, 5);
        assert_eq!([pop(4), pop(5)], [Some(item(0, 0..4)), Some(item(1, 0..5))]);
        assert_eq!(pop(2), Some(item(2, 0..2)));
        assert_eq!([pop(2), pop(5)], [Some(item(2, 2..4)), Some(item(2, 4..5))]);
        assert_eq!([pop(5), pop(5)], [Some(item(0, 4..5)), None]);
        assert_eq!(queue.n_trials(), 0);
    }
}
