//! Checks the shapes of the boundary, walls, obstacles and movables.

use super::{Checks, Places};
use crate::geometry::{Flaw, Point, flaw_of_line, flaw_of_polygon, length, reflex_corner};
use crate::report::Path;
use crate::{ObjectConfig, limits};

impl Checks<'_> {
    pub(super) fn shape(&self, object: &ObjectConfig, path: &Path) {
        let of_params = path.key("params").key("corners");
        match object {
            ObjectConfig::Wall(wall) => {
                let path = path.key("corners");
                self.within_world(&wall.corners, &path);
                if let Some(flaw) = flaw_of_line(&wall.corners) {
                    self.flawed(flaw, &path);
                }
            }
            ObjectConfig::Obstacle(obstacle) => {
                if let Some(corners) = &obstacle.params.corners {
                    self.within_reach(corners, &of_params);
                    self.polygon(corners, &of_params);
                }
            }
            ObjectConfig::Movable(movable) => {
                let Some(corners) = &movable.params.corners else { return };
                self.within_reach(corners, &of_params);
                if self.polygon(corners, &of_params)
                    && let Some(corner) = reflex_corner(corners)
                {
                    let message = "the polygon turns inwards here, but a movable has to be convex";
                    self.report.conflict(&of_params.index(corner), &[&of_params], message);
                }
            }
            ObjectConfig::Robot(_) | ObjectConfig::LightSource(_) | ObjectConfig::GroundArea(_) => {
            }
        }
    }

    /// Whether the corners are those of a simple polygon.
    pub(super) fn polygon(&self, corners: &[Point], path: &Path) -> bool {
        let flaw = flaw_of_polygon(corners);
        if let Some(flaw) = flaw {
            self.flawed(flaw, path);
        }
        flaw.is_none()
    }

    fn flawed(&self, flaw: Flaw, path: &Path) {
        let least = limits::EDGE_MIN;
        let (corner, message) = match flaw {
            Flaw::ShortEdge(edge) => {
                (edge, format!("the next corner is less than {least} cm from here"))
            }
            Flaw::Crossing(edge, other) => {
                let message =
                    format!("the edge that begins here crosses the one that begins at [{other}]");
                (edge, message)
            }
            Flaw::Narrow(corner, edge) => {
                let message =
                    format!("is less than {least} cm from the edge that begins at [{edge}]");
                (corner, message)
            }
        };
        self.report.conflict(&path.index(corner), &[path], message);
    }

    /// Whether corners that stand in the world lie in its rectangle.
    pub(super) fn within_world(&self, corners: &[Point], path: &Path) -> bool {
        let (width, height) = (self.world.width, self.world.height);
        let is_outside =
            |[x, y]: Point| !(0.0..=width).contains(&x) || !(0.0..=height).contains(&y);
        self.no_corner(corners, path, is_outside, |[x, y]| {
            format!("[{x}, {y}] is outside the world, which is {width} by {height} cm")
        })
    }

    /// Corners around an object's own position are not farther from it than the world is long.
    fn within_reach(&self, corners: &[Point], path: &Path) {
        let diagonal = length([self.world.width, self.world.height]);
        let is_outside = |corner| length(corner) > diagonal;
        self.no_corner(corners, path, is_outside, |[x, y]| {
            format!("[{x}, {y}] is farther from the object's position than the world is long")
        });
    }

    /// Whether no corner is refused; reports those that are.
    fn no_corner(
        &self,
        corners: &[Point],
        path: &Path,
        is_refused: impl Fn(Point) -> bool,
        message: impl Fn(Point) -> String,
    ) -> bool {
        let Places { width, height, .. } = self.places;
        let mut is_sound = true;
        for (index, &corner) in
            corners.iter().enumerate().filter(|(_, corner)| is_refused(**corner))
        {
            self.report.conflict(&path.index(index), &[width, height], || message(corner));
            is_sound = false;
        }
        is_sound
    }
}
