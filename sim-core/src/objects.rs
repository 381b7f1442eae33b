//! Objects of the world as compiled: what the instances of one have in common.

use std::ops::Range;

use crate::initializers::Positions;
use crate::problems::Problems;

/// Where the instances of an object come from.
#[derive(Debug, Clone)]
pub(crate) struct Site {
    /// Name of the object.
    pub name: String,
    /// Index of the object.
    pub object: usize,
    /// Where its instances start.
    pub positions: Positions,
}

impl Site {
    /// The site of object number `object`; none if nothing can start there.
    pub fn new(
        object: usize,
        name: &str,
        positions: Result<Positions, String>,
        problems: &mut Problems,
    ) -> Option<Self> {
        match positions {
            Ok(positions) => Some(Self { name: name.to_owned(), object, positions }),
            Err(message) => {
                problems.add(format!("world.objects.{name}.initializers.positions"), message);
                None
            }
        }
    }
}

/// The lights, or the ground areas, of one object.
#[derive(Debug, Clone)]
pub(crate) struct StaticObjects {
    /// Where they come from.
    pub site: Site,
    /// Their numbers among all lights, or all ground areas.
    pub members: Range<usize>,
    /// Reach of a light, or radius of an area, cm.
    pub range: f64,
    /// Colour, by which sensors tell them apart.
    pub color: String,
    /// Whether a script moves them.
    pub by_script: bool,
}

/// Which lights and ground areas are on: sensors do not see the others.
#[derive(Debug, Clone)]
pub(crate) struct Switches {
    /// Per light.
    pub lights: Vec<bool>,
    /// Per ground area.
    pub areas: Vec<bool>,
}

impl StaticObjects {
    /// Numbers and ranges of all lights, or areas, of a colour.
    pub fn of_color(objects: &[Self], color: &str) -> impl Iterator<Item = (usize, f64)> {
        let objects = objects.iter().filter(move |objects| objects.color == color);
        objects.flat_map(|objects| objects.members.clone().map(|member| (member, objects.range)))
    }
}
