//! The address of a trial, which determines its random numbers and start positions.

use determinism::random::{Purpose, Stream, TrialSet};
use task_script::ScriptError;

use crate::bodies::{Furnished, NoPlace, Room};
use crate::objects::{Site, StaticObjects};
use crate::simulation::EvaluateError;
use crate::torus::{Torus, Vec2};
use crate::world::World;

/// The address of a trial.
#[derive(Debug, Clone, Copy)]
pub(super) struct Address {
    pub seed: u64,
    pub trial_set: TrialSet,
    pub trial: u32,
}

impl Address {
    /// The random stream of an object for a purpose.
    pub fn stream(self, purpose: Purpose, number: usize) -> Stream {
        self.numbered_stream(purpose, number as u64)
    }

    /// The random stream of this number for a purpose. The number may exceed those of objects.
    pub fn numbered_stream(self, purpose: Purpose, number: u64) -> Stream {
        Stream::new(self.seed, self.trial_set, self.trial.into(), purpose, number)
    }

    /// One stream for each of `n` robots, or lights.
    pub fn streams(self, purpose: Purpose, n: usize) -> Vec<Stream> {
        (0..n).map(|number| self.stream(purpose, number)).collect()
    }

    /// The failure of a script in a step of this trial.
    pub fn failed(self, error: ScriptError, step: u32) -> EvaluateError {
        EvaluateError::Script { error, step, trial_set: self.trial_set, trial: self.trial }
    }

    /// Draws the positions of an object's instances.
    pub fn place(
        self,
        site: &Site,
        torus: &Torus,
        stream: &mut Stream,
    ) -> Result<Vec<Vec2>, EvaluateError> {
        site.positions.draw(torus, stream).map_err(|unplaceable| EvaluateError::Unplaceable {
            object: site.name.clone(),
            index: unplaceable.index,
            trial_set: self.trial_set,
            trial: self.trial,
        })
    }

    /// Draws where all bodies of a room start.
    pub fn furnish(self, room: &Room, world: &World) -> Result<Furnished, EvaluateError> {
        let crews = world.groups.iter().map(|group| (&group.site, &group.headings, group.chassis));
        let crews: Vec<_> = crews.collect();
        let stream = |purpose, object| self.stream(purpose, object);
        room.furnish(&world.torus, &crews, stream).map_err(|NoPlace { site, index }| {
            EvaluateError::Unplaceable {
                object: site.name.clone(),
                index,
                trial_set: self.trial_set,
                trial: self.trial,
            }
        })
    }

    /// Draws the positions of lights or ground areas.
    pub fn place_static_objects(
        self,
        objects: &[StaticObjects],
        torus: &Torus,
    ) -> Result<Vec<Vec2>, EvaluateError> {
        let mut positions = Vec::new();
        for StaticObjects { site, .. } in objects {
            let mut stream = self.stream(Purpose::Positions, site.object);
            positions.extend(self.place(site, torus, &mut stream)?);
        }
        Ok(positions)
    }
}
