//! Where everything in a trial is before its first step.

use determinism::random::{Purpose, Stream, TrialSet};

use super::address::Address;
use super::interior::Interior;
use crate::bodies::Furnished;
use crate::record::RoomRecord;
use crate::simulation::{EvaluateError, Simulation};
use crate::torus::Vec2;
use crate::world::World;

/// Start positions of all objects, drawn at random.
pub(super) struct Starts {
    /// Per robot.
    pub positions: Vec<Vec2>,
    /// Per robot.
    pub headings: Vec<f64>,
    /// The stream of each group's positions, for the draws that may follow.
    pub streams: Vec<Stream>,
    pub lights: Vec<Vec2>,
    pub areas: Vec<Vec2>,
    /// `None` in a world without bodies.
    pub interior: Option<Interior>,
}

impl Starts {
    pub fn draw(address: Address, world: &World) -> Result<Self, EvaluateError> {
        let mut positions = Vec::with_capacity(world.n_robots());
        let mut headings = Vec::with_capacity(world.n_robots());
        let sites = world.groups.iter().map(|group| group.site.object);
        let mut streams: Vec<_> =
            sites.map(|object| address.stream(Purpose::Positions, object)).collect();
        let interior = match &world.room {
            Some(room) => {
                let Furnished { bodies, obstacles, robots } = address.furnish(room, world)?;
                positions.extend(robots.iter().flatten().map(|pose| pose.position));
                headings.extend(robots.iter().flatten().map(|pose| pose.heading));
                Some(Interior { bodies, obstacles })
            }
            None => {
                for (group, stream) in world.groups.iter().zip(&mut streams) {
                    positions.extend(address.place(&group.site, &world.torus, stream)?);
                    let mut orientations = address.stream(Purpose::Orientations, group.site.object);
                    headings.extend(group.headings.draw(&mut orientations));
                }
                None
            }
        };
        let lights = address.place_static_objects(&world.lights, &world.torus)?;
        let areas = address.place_static_objects(&world.areas, &world.torus)?;
        Ok(Self { positions, headings, streams, lights, areas, interior })
    }
}

/// Draws the start positions of all objects of a trial; fails where [`Trial::new`] does.
///
/// [`Trial::new`]: super::Trial::new
pub(crate) fn try_places(
    simulation: &Simulation,
    trial_set: TrialSet,
    trial: u32,
) -> Result<(), EvaluateError> {
    let address = Address { seed: simulation.seed, trial_set, trial };
    Starts::draw(address, &simulation.world).map(drop)
}

/// The room of a trial; `None` in a world without bodies.
pub(crate) fn room(
    simulation: &Simulation,
    trial_set: TrialSet,
    trial: u32,
) -> Result<Option<RoomRecord>, EvaluateError> {
    let address = Address { seed: simulation.seed, trial_set, trial };
    let Some(room) = &simulation.world.room else { return Ok(None) };
    Ok(Some(room.record(address.furnish(room, &simulation.world)?)))
}
