//! The priority of an experiment, which determines its share of the fleet.

/// Weight in the sharing of the fleet: an experiment of priority 200 gets twice the workers' time
/// of one of priority 100, while both have queued items. Every experiment gets some time, even
/// with the smallest weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Priority(u32);

impl Priority {
    /// Largest weight; the smallest is 1.
    pub const MAX: u32 = 1000;

    /// A priority; `None` outside 1..=[`MAX`](Self::MAX).
    pub fn new(weight: u32) -> Option<Self> {
        (1..=Self::MAX).contains(&weight).then_some(Self(weight))
    }

    /// The weight.
    pub fn weight(self) -> u32 {
        self.0
    }
}

impl Default for Priority {
    fn default() -> Self {
        Self(100)
    }
}
