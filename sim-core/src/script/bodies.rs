//! What a script sees of bodies, and where it puts movables.

use std::rc::Rc;

use experiment_file::BlockedBy;
use task_script::{Meter, Object, Value};

use super::change::May;
use super::view::{Answer, Kind, NO_OBJECT, View, number, thing};
use crate::bodies::Pose;
use crate::torus::wrap_angle;
use crate::trial::Interior;

/// Work of comparing a movable with each thing where it may be put, in statements.
const PLACING: usize = 4;

impl<'a> View<'a> {
    /// Where a movable is.
    pub(super) fn pose(&self, movable: usize) -> Result<Pose, String> {
        let Interior { bodies, .. } = self.interior.as_deref().ok_or(NO_OBJECT)?;
        Ok(bodies.pose(bodies.loads().start + movable))
    }

    /// What a robot touches after the last step: robots, then movables, each by their numbers,
    /// then `None` for all walls and obstacles.
    pub(super) fn touches(&self, robot: usize, meter: &Rc<Meter>) -> Answer {
        let Some(Interior { bodies, .. }) = self.interior.as_deref() else {
            return Value::list(vec![], meter);
        };
        let bumps = bodies.bumps(robot);
        meter.work(bumps.len() / 4)?;
        let mut touched: Vec<usize> = bumps.iter().filter_map(|bump| bump.body).collect();
        touched.sort_unstable();
        touched.dedup();
        let n_robots = bodies.loads().start;
        let body = |body| match body {
            robot if robot < n_robots => thing(Kind::Robot, robot),
            load => thing(Kind::Movable, load - n_robots),
        };
        let fixture = bumps.iter().any(|bump| bump.body.is_none()).then_some(Value::Nothing);
        Value::list(touched.into_iter().map(body).chain(fixture).collect(), meter)
    }

    /// Whether a part of a wall or an obstacle is on the straight line between two places.
    pub(super) fn walls_between(
        &self,
        a: &Value,
        b: &Value,
        meter: &Rc<Meter>,
    ) -> Result<bool, String> {
        let (from, to) = (self.point(a)?, self.point(b)?);
        let Some(Interior { bodies, .. }) = self.interior.as_deref() else { return Ok(false) };
        meter.work(bodies.n_fixtures() / 4)?;
        Ok(!bodies.is_clear(from, to, BlockedBy::Walls, &[]))
    }

    /// The name of the object to which a thing belongs.
    pub(super) fn group(&self, thing: Object) -> Result<&'a str, String> {
        if Kind::of_object(thing) != Kind::Movable {
            return Ok(&self.objects(thing)?.site.name);
        }
        let number = thing.index as usize;
        let mut groups = self.world.room.iter().flat_map(|room| &room.movables);
        let group = groups.find(|group| group.members.contains(&number));
        Ok(&group.ok_or(NO_OBJECT)?.site.name)
    }

    /// `world.place(movable, place, heading)`: puts a movable at rest at a place, if it is free;
    /// returns whether it is. Without a heading, the movable keeps its own.
    pub(super) fn place(
        &mut self,
        movable: &Value,
        place: &Value,
        heading: Option<&Value>,
        meter: &Meter,
    ) -> Result<bool, String> {
        if !matches!(self.may, May::React) {
            return Err("only `react` puts movables elsewhere".into());
        }
        let what = |kind: &str| format!("`place` puts movables elsewhere, not {kind}");
        let Value::Object(object) = movable else {
            return Err(what(&format!("a {}", movable.kind())));
        };
        let (Kind::Movable, number) = (Kind::of_object(*object), object.index as usize) else {
            return Err(what(Kind::of_object(*object).name()));
        };
        let mut pose = Pose { position: self.point(place)?, ..self.pose(number)? };
        if let Some(heading) = heading {
            pose.heading = wrap_angle(finite(heading)?);
        }
        let (Some(room), Some(Interior { bodies, obstacles })) =
            (&self.world.room, self.interior.as_deref_mut())
        else {
            return Ok(false);
        };
        meter.work(PLACING * bodies.n_things())?;
        let load = bodies.loads().start + number;
        let is_free = room.put(bodies, obstacles, load, pose);
        self.swarm.moved |= is_free;
        Ok(is_free)
    }
}

/// A heading from a script.
fn finite(value: &Value) -> Result<f64, String> {
    let value = number(value)?;
    let is_finite = value.is_finite().then_some(value);
    is_finite.ok_or_else(|| format!("a heading is a finite number, not {value}"))
}
