//! Lines of sight: how far it is to the first thing in a direction, and whether anything is
//! between two places.

use super::collision::Segment;
use super::shape::{Polygon, Shape, sides};
use super::{Bodies, Fixture, Form};
use crate::torus::Vec2;
use experiment_file::{BlockedBy, Sees};

/// The part of a line from `from` on, `way` being its whole length.
#[derive(Debug, Clone, Copy)]
struct Ray {
    from: Vec2,
    way: Vec2,
}

/// The near things that a robot's rays may meet. It serves all rays of the robot.
pub(crate) struct Sight<'a> {
    bodies: &'a Bodies,
    fixtures: Vec<&'a Fixture>,
    /// Robots and loads.
    movers: Vec<usize>,
}

impl Bodies {
    /// What is within `range` of a robot's centre and of the kinds that its sensor sees.
    /// `robots`: those that may be near.
    pub fn sight(
        &self,
        robot: usize,
        range: f64,
        sees: Sees,
        robots: impl Iterator<Item = usize>,
    ) -> Sight<'_> {
        let Vec2 { x, y } = self.bodies[robot].position;
        let near = |number: &usize| {
            let (low, high) = self.bounds[*number];
            let is_seen = if self.fixtures[*number].is_wall { sees.walls } else { sees.objects };
            is_seen
                && x + range >= low.x
                && x - range <= high.x
                && y + range >= low.y
                && y - range <= high.y
        };
        let fixtures = (0..self.fixtures.len()).filter(near).map(|i| &self.fixtures[i]).collect();
        let loads = self.loads().filter(|_| sees.objects);
        let movers = robots.filter(|_| sees.robots).chain(loads).collect();
        Sight { bodies: self, fixtures, movers }
    }

    /// Whether nothing of these kinds is between two places. `ends`: robots that do not count.
    pub fn is_clear(&self, from: Vec2, to: Vec2, blocked_by: BlockedBy, ends: &[usize]) -> bool {
        let ray = Ray { from, way: to - from };
        let is_past_fixtures =
            || !self.fixtures.iter().any(|fixture| ray.until_fixture(fixture).is_some());
        let is_past_movers = || {
            let is_between = |body: &usize| self.bodies[*body].is_present && !ends.contains(body);
            let mut movers = (0..self.bodies.len()).filter(is_between);
            !movers.any(|body| self.meets(&ray, body).is_some())
        };
        match blocked_by {
            BlockedBy::Nothing => true,
            BlockedBy::Walls => is_past_fixtures(),
            BlockedBy::Bodies => is_past_fixtures() && is_past_movers(),
        }
    }

    fn meets(&self, ray: &Ray, body: usize) -> Option<f64> {
        let body = &self.bodies[body];
        // In the body's own frame.
        let local = Ray {
            from: (ray.from - body.position).unrotated(body.axis),
            way: ray.way.unrotated(body.axis),
        };
        match &body.shape {
            Shape::Disc(radius) => local.until_disc(Vec2::default(), *radius),
            Shape::Polygon(polygon) => local.until_polygon(polygon),
        }
    }
}

impl Sight<'_> {
    /// The part of `way` up to the first thing; `None` if there is none. From inside of a polygon,
    /// its far side is seen: begin at a robot's centre, as its rim may be in what it touches.
    pub fn along(&self, from: Vec2, way: Vec2) -> Option<f64> {
        let ray = Ray { from, way };
        let fixtures = self.fixtures.iter().filter_map(|fixture| ray.until_fixture(fixture));
        let movers = self.movers.iter().filter_map(|&body| self.bodies.meets(&ray, body));
        fixtures.chain(movers).min_by(f64::total_cmp)
    }
}

impl Ray {
    fn until_fixture(&self, fixture: &Fixture) -> Option<f64> {
        match &fixture.form {
            Form::Segment(Segment { from, to, .. }) => self.until_segment(*from, *to),
            Form::Disc(centre, shape) => self.until_disc(*centre, shape.reach()),
        }
    }

    /// The part of the way to a segment, from 0 to 1.
    fn until_segment(&self, from: Vec2, to: Vec2) -> Option<f64> {
        let along = to - from;
        let cross = self.way.cross(along);
        if cross == 0.0 {
            return None; // parallel
        }
        let apart = from - self.from;
        let (part, share) = (apart.cross(along) / cross, apart.cross(self.way) / cross);
        ((0.0..=1.0).contains(&part) && (0.0..=1.0).contains(&share)).then_some(part)
    }

    fn until_disc(&self, centre: Vec2, radius: f64) -> Option<f64> {
        let apart = centre - self.from;
        let length = self.way.dot(self.way);
        let middle = apart.dot(self.way) / length;
        let half = middle * middle - (apart.dot(apart) - radius * radius) / length;
        if half < 0.0 {
            return None;
        }
        let part = middle - half.sqrt();
        let is_inside = apart.dot(apart) < radius * radius;
        if is_inside { Some(0.0) } else { (0.0..=1.0).contains(&part).then_some(part) }
    }

    fn until_polygon(&self, polygon: &Polygon) -> Option<f64> {
        let parts = sides(&polygon.corners).filter_map(|(from, to)| self.until_segment(from, to));
        parts.min_by(f64::total_cmp)
    }
}
