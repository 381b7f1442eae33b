//! Compiled objects of the world: the data that the instances of an object share.

use std::ops::Range;

use crate::initializers::Positions;
use crate::problems::Problems;

/// An object of the world, as the place of its instances.
#[derive(Debug, Clone)]
pub(crate) struct Site {
    /// Name of the object.
    pub name: String,
    /// Index of the object.
    pub object: usize,
    /// The start positions of its instances.
    pub positions: Positions,
}

impl Site {
    /// The site of object number `object`; `None` if its initialiser has a mistake.
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
    /// Their object.
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

/// Whether lights and ground areas are on. Sensors do not see objects that are off.
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
