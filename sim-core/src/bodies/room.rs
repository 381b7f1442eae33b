//! The room of a world with bodies, and where its bodies start: never on each other.

use std::ops::Range;

use super::collision::Segment;
use super::shape::{Shape, contains, sides};
use super::{Bodies, Chassis, Fixture, Form, Load, Pose};
use crate::initializers::{Headings, Positions};
use crate::objects::Site;
use crate::problems::Problems;
use crate::record::{Outline, RoomRecord};
use crate::torus::{Torus, Vec2};
use determinism::random::{Purpose, Stream};
use experiment_file as file;

/// Most places that are drawn for an object.
const N_DRAWS_MAX: usize = 1_000;
/// Most comparisons of a place with a thing that may be there, in a trial: some seconds.
const N_COMPARISONS_MAX: usize = 1_000_000_000;
/// Most times that all objects of an arrangement are drawn together.
const N_ARRANGEMENTS_MAX: usize = 100;

/// Walls, and what all trials have in the room.
#[derive(Debug, Clone)]
pub(crate) struct Room {
    /// Corners of the boundary, counter-clockwise, cm.
    pub outline: Vec<Vec2>,
    /// Boundary and walls.
    walls: Vec<Fixture>,
    /// Obstacles, object by object.
    pub obstacles: Vec<Things>,
    /// Movables, object by object.
    pub movables: Vec<Things>,
    n_substeps: u32,
    /// Duration of a step of the robots, s.
    step_duration: f64,
    /// Largest radius of a robot, cm.
    pub largest_radius: f64,
}

/// The equal things of an object.
#[derive(Debug, Clone)]
pub(crate) struct Things {
    pub site: Site,
    /// Their numbers among all obstacles, or all movables.
    pub members: Range<usize>,
    headings: Headings,
    /// Shape in the object's own frame.
    pub outline: Contour,
    /// Properties of those that can be pushed.
    load: Option<Load>,
}

/// A disc's radius, or the corners of a polygon about its place, counter-clockwise; cm.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Contour {
    /// A disc.
    Disc(f64),
    /// A polygon.
    Polygon(Vec<Vec2>),
}

impl Contour {
    fn new(shape: &file::Shape) -> Self {
        match shape {
            file::Shape::Disc(radius) => Self::Disc(*radius),
            file::Shape::Polygon(corners) => Self::Polygon(points(corners)),
        }
    }

    /// The convex shape, about its centre of mass.
    fn shape(&self) -> Shape {
        match self {
            Self::Disc(radius) => Shape::Disc(*radius),
            Self::Polygon(corners) => Shape::polygon(corners),
        }
    }

    /// The same at a place.
    fn placed(&self, pose: Pose) -> Outline {
        match self {
            Self::Disc(radius) => Outline::Disc { center: pose.position, radius: *radius },
            Self::Polygon(corners) => {
                let axis = Vec2::unit(pose.heading);
                let corners = corners.iter().map(|corner| pose.position + corner.rotated(axis));
                Outline::Polygon(corners.collect())
            }
        }
    }
}

impl Outline {
    fn contains(&self, place: Vec2) -> bool {
        match self {
            Self::Disc { center, radius } => (*center - place).norm() < *radius,
            Self::Polygon(corners) => contains(corners, place),
        }
    }

    fn fixtures(&self) -> Vec<Fixture> {
        let fixture = |form| Fixture { form, is_wall: false };
        match self {
            Self::Disc { center, radius } => {
                vec![fixture(Form::Disc(*center, Shape::Disc(*radius)))]
            }
            Self::Polygon(corners) => sides(corners)
                .map(|(from, to)| fixture(Form::Segment(Segment { from, to, inner: None })))
                .collect(),
        }
    }
}

/// A trial's room, and where its robots are.
pub(crate) struct Furnished {
    pub bodies: Bodies,
    /// Obstacles in their order.
    pub obstacles: Vec<Outline>,
    /// Poses of robots, group by group.
    pub robots: Vec<Vec<Pose>>,
}

/// An object that found no place in a trial.
pub(crate) struct NoPlace<'a> {
    pub site: &'a Site,
    pub index: usize,
}

/// Robots to place: their site, headings and body.
pub(crate) type Crew<'a> = (&'a Site, &'a Headings, Chassis);

impl Room {
    /// Compiles walls, obstacles and movables; `None` in a world without bodies.
    pub fn compile(config: &file::WorldConfig, problems: &mut Problems) -> Option<Self> {
        let file::BodiesConfig { substeps, .. } = config.bodies?;
        let outline = points(&config.outline()?);
        let is_rectangle = config.boundary == file::Boundary::Walls;
        let mut room = Self {
            walls: sides(&outline)
                .map(|(from, to)| {
                    // Of a polygon, the far side of a wall may be in the room, too.
                    let inner = is_rectangle.then(|| (to - from).unit_or_zero().turned_left());
                    wall(from, to, inner)
                })
                .collect(),
            outline,
            obstacles: Vec::new(),
            movables: Vec::new(),
            n_substeps: substeps,
            step_duration: 0.0,
            largest_radius: 0.0,
        };
        for (index, (name, object)) in config.objects.iter().enumerate() {
            match object {
                file::ObjectConfig::Wall(line) => {
                    let corners = points(&line.corners);
                    let lines = corners.windows(2).map(|ends| wall(ends[0], ends[1], None));
                    room.walls.extend(lines);
                }
                file::ObjectConfig::Obstacle(obstacle) => {
                    let (n, outline) =
                        (obstacle.num_instances, Contour::new(&obstacle.params.shape()));
                    let starts = &obstacle.initializers;
                    let members = following(&room.obstacles, n);
                    let things = Things::new(index, name, members, starts, outline, None, problems);
                    room.obstacles.extend(things);
                }
                file::ObjectConfig::Movable(movable) => {
                    let outline = Contour::new(&movable.params.shape());
                    let file::MovableParams { mass, friction, .. } = movable.params;
                    let load = Load { shape: outline.shape(), mass, friction };
                    let (n, starts) = (movable.num_instances, &movable.initializers);
                    let members = following(&room.movables, n);
                    let load = Some(load);
                    let things = Things::new(index, name, members, starts, outline, load, problems);
                    room.movables.extend(things);
                }
                file::ObjectConfig::Robot(robot) => {
                    let radius = robot.body.unwrap_or_default().radius;
                    room.largest_radius = room.largest_radius.max(radius);
                    if let Some(wheels) = &robot.actuators.wheel_actuator {
                        let (own, others) = (wheels.step_duration, room.step_duration);
                        if others != 0.0 && own != others {
                            problems.add(
                                format!("world.objects.{name}.actuators.wheel_actuator.step_duration"),
                                format!("is {own}, but {others} of other robots; bodies share their steps"),
                            );
                        }
                        room.step_duration = own;
                    }
                }
                file::ObjectConfig::LightSource(_) | file::ObjectConfig::GroundArea(_) => {}
            }
        }
        Some(room)
    }

    /// The parts of a trial's room that do not move, and the shapes of those that do.
    pub fn record(&self, furnished: Furnished) -> RoomRecord {
        let Furnished { bodies, obstacles, .. } = furnished;
        let ends = |wall: &Fixture| match wall.form {
            Form::Segment(Segment { from, to, .. }) => Some([from, to]),
            Form::Disc(..) => None,
        };
        // The boundary is first.
        let walls = &self.walls[self.outline.len()..];
        RoomRecord {
            boundary: self.outline.clone(),
            walls: walls.iter().filter_map(ends).collect(),
            obstacles,
            movables: bodies.loads().map(|load| bodies.outline(load)).collect(),
            radii: (0..bodies.loads().start).map(|robot| bodies.radius(robot)).collect(),
        }
    }

    /// Whether a place is within the boundary and in no obstacle.
    fn has_ground_at(&self, place: Vec2, obstacles: &[Outline]) -> bool {
        contains(&self.outline, place) && !obstacles.iter().any(|obstacle| obstacle.contains(place))
    }

    /// Number of all movables.
    pub fn n_movables(&self) -> usize {
        self.movables.last().map_or(0, |things| things.members.end)
    }

    /// Puts a body at rest elsewhere, if it is in the room there and overlaps nothing; returns
    /// whether it did.
    pub fn put(&self, bodies: &mut Bodies, obstacles: &[Outline], body: usize, pose: Pose) -> bool {
        self.has_ground_at(pose.position, obstacles) && bodies.put(body, pose)
    }

    /// Draws where everything starts: obstacles, then movables, then robots, each where it
    /// overlaps nothing that is there. `stream`: of a purpose and an object.
    pub fn furnish<'a>(
        &'a self,
        torus: &Torus,
        crews: &[Crew<'a>],
        stream: impl Fn(Purpose, usize) -> Stream,
    ) -> Result<Furnished, NoPlace<'a>> {
        let mut placing = Placing {
            room: self,
            torus,
            bodies: Bodies::new(self.walls.clone(), 1, 1.0),
            solids: Vec::new(),
            n_comparisons: 0,
        };
        let streams = |site: &Site| {
            [Purpose::Positions, Purpose::Orientations].map(|purpose| stream(purpose, site.object))
        };
        for things in &self.obstacles {
            // They may overlap each other and walls.
            let poses = placing.place(&things.site, &things.headings, streams, |_, pose| {
                contains(&self.outline, pose.position)
            })?;
            for pose in poses {
                let placement = things.outline.placed(pose);
                placing.bodies.add_fixtures(placement.fixtures());
                placing.solids.push(placement);
            }
        }
        let mut loads = Vec::new();
        for things in &self.movables {
            let Some(load) = &things.load else { continue };
            let poses =
                placing.place(&things.site, &things.headings, streams, |placing, pose| {
                    placing.has_room_for(&load.shape, pose)
                })?;
            // Each overlaps nothing that was there before, and none of its own kind.
            loads.extend(poses.into_iter().map(|pose| (load, pose)));
        }
        let mut robots = Vec::new();
        for &(site, headings, chassis) in crews {
            let shape = Shape::Disc(chassis.radius);
            robots.push(placing.place(site, headings, streams, |placing, pose| {
                placing.has_room_for(&shape, pose)
            })?);
        }
        let Placing { bodies: placed, solids, .. } = placing;
        let mut bodies = Bodies::new(placed.into_fixtures(), self.n_substeps, self.step_duration);
        for (&(_, _, chassis), poses) in crews.iter().zip(&robots) {
            poses.iter().for_each(|&pose| bodies.add_robot(&chassis, pose));
        }
        for (load, pose) in loads {
            bodies.add_load(load, pose);
        }
        Ok(Furnished { bodies, obstacles: solids, robots })
    }
}

impl Things {
    fn new(
        index: usize,
        name: &str,
        members: Range<usize>,
        starts: &file::BodyInitializers,
        outline: Contour,
        load: Option<Load>,
        problems: &mut Problems,
    ) -> Option<Self> {
        let n = members.len();
        let site = Site::new(index, name, Positions::new(&starts.positions, n), problems)?;
        match Headings::new(&starts.orientations, n) {
            Ok(headings) => Some(Self { site, members, headings, outline, load }),
            Err(message) => {
                problems.add(format!("world.objects.{name}.initializers.orientations"), message);
                None
            }
        }
    }
}

/// Numbers of `n` more things.
fn following(things: &[Things], n: u32) -> Range<usize> {
    let first = things.last().map_or(0, |things| things.members.end);
    first..first + n as usize
}

/// What is placed so far.
struct Placing<'a> {
    room: &'a Room,
    torus: &'a Torus,
    /// Fixtures, and everything else that must not be overlapped, as bodies.
    bodies: Bodies,
    solids: Vec<Outline>,
    n_comparisons: usize,
}

impl Placing<'_> {
    /// Draws places for the instances of an object, and takes those that are free.
    fn place<'b>(
        &mut self,
        site: &'b Site,
        headings: &Headings,
        streams: impl Fn(&Site) -> [Stream; 2],
        is_free: impl Fn(&mut Self, Pose) -> bool,
    ) -> Result<Vec<Pose>, NoPlace<'b>> {
        let [mut positions, mut orientations] = streams(site);
        let headings = headings.draw(&mut orientations);
        let n_before = self.bodies.n_bodies();
        let mut index = 0;
        for _ in 0..N_ARRANGEMENTS_MAX {
            self.bodies.truncate(n_before);
            let drawn = site.positions.draw(self.torus, &mut positions);
            let drawn = drawn.map_err(|unplaceable| NoPlace { site, index: unplaceable.index })?;
            let mut poses = Vec::with_capacity(drawn.len());
            for (&heading, position) in headings.iter().zip(drawn) {
                let mut pose = Pose { position, heading };
                let mut n_draws = 1;
                let found = loop {
                    if is_free(self, pose) {
                        break true;
                    }
                    match site.positions.draw_one(self.torus, &mut positions) {
                        Some(position)
                            if n_draws < N_DRAWS_MAX && self.n_comparisons < N_COMPARISONS_MAX =>
                        {
                            pose.position = position;
                        }
                        _ => break false,
                    }
                    n_draws += 1;
                };
                if !found {
                    break;
                }
                poses.push(pose);
            }
            if poses.len() == headings.len() {
                return Ok(poses);
            }
            index = index.max(poses.len());
            if !site.positions.is_arrangement() || self.n_comparisons >= N_COMPARISONS_MAX {
                break;
            }
        }
        Err(NoPlace { site, index })
    }

    /// Whether a body is in the room and overlaps nothing; then it stays there.
    fn has_room_for(&mut self, shape: &Shape, pose: Pose) -> bool {
        self.n_comparisons += self.bodies.n_things();
        let is_free = self.room.has_ground_at(pose.position, &self.solids)
            && self.bodies.is_free(shape, pose);
        if is_free {
            self.bodies.add_load(&Load { shape: shape.clone(), mass: 1.0, friction: 0.0 }, pose);
        }
        is_free
    }
}

fn wall(from: Vec2, to: Vec2, inner: Option<Vec2>) -> Fixture {
    Fixture { form: Form::Segment(Segment { from, to, inner }), is_wall: true }
}

fn points(corners: &[[f64; 2]]) -> Vec<Vec2> {
    corners.iter().map(|&[x, y]| Vec2::new(x, y)).collect()
}

#[cfg(test)]
mod tests;
