//! Places in an experiment file.

use std::rc::Rc;
use std::{fmt, iter};

use super::Excerpt;

/// A place in the file, from the root. It is cheap to extend, because every value has a place.
#[derive(Clone, Default)]
pub(crate) struct Path(Option<Rc<Step>>);

struct Step {
    parent: Path,
    segment: Segment,
}

#[derive(Clone, PartialEq)]
pub(super) enum Segment {
    /// The value of a key of an object.
    Key(String),
    /// An element of a list, from 0.
    Index(usize),
    /// The set of keys of a map.
    Keys,
}

impl Path {
    /// The value of `key` in the object at this place.
    pub(crate) fn key(&self, key: &str) -> Self {
        self.join(Segment::Key(key.to_owned()))
    }

    /// The element number `index` of the list at this place.
    pub(crate) fn index(&self, index: usize) -> Self {
        self.join(Segment::Index(index))
    }

    /// The set of keys of the map at this place, for checks that rely on the keys but not on the
    /// values.
    pub(crate) fn keys(&self) -> Self {
        self.join(Segment::Keys)
    }

    pub(super) fn join(&self, segment: Segment) -> Self {
        Self(Some(Rc::new(Step { parent: self.clone(), segment })))
    }

    /// The segments, from the root.
    pub(super) fn segments(&self) -> Vec<&Segment> {
        let steps = iter::successors(self.0.as_deref(), |step| step.parent.0.as_deref());
        let mut segments: Vec<_> = steps.map(|step| &step.segment).collect();
        segments.reverse();
        segments
    }

    /// Whether one of the two places contains the other.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.segments().into_iter().zip(other.segments()).all(|(a, b)| a == b)
    }
}

impl<const N: usize> From<[&str; N]> for Path {
    fn from(keys: [&str; N]) -> Self {
        keys.into_iter().fold(Self::default(), |path, key| path.key(key))
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, segment) in self.segments().into_iter().enumerate() {
            match segment {
                Segment::Key(key) if i == 0 => write!(f, "{}", Excerpt(key))?,
                Segment::Key(key) => write!(f, ".{}", Excerpt(key))?,
                Segment::Index(index) => write!(f, "[{index}]")?,
                Segment::Keys => {}
            }
        }
        Ok(())
    }
}
