//! Checks bodies: which keys need which, what fits between the walls, how far robots drive.

mod shapes;

use crate::geometry::{Point, contains, inner_radius, is_convex, meets_circle, meets_square};
use crate::report::{Path, Report};
use crate::{
    BlockedBy, BodyInitializers, Boundary, ExperimentConfig, Initializer, ObjectConfig,
    RobotConfig, Shape, WorldConfig, limits,
};

pub(super) fn check(config: &ExperimentConfig, report: &Report<'_>) {
    let places = Places::new();
    let checks = Checks { world: &config.world, report, places: &places };
    let has_sound_boundary = checks.boundary();
    for (name, object) in &config.world.objects {
        let path = places.objects.key(name);
        checks.shape(object, &path);
        if let ObjectConfig::Robot(robot) = object {
            checks.rays(robot, &path);
        }
        match (&config.world.bodies, object) {
            (None, _) => checks.without_bodies(object, &path),
            (Some(bodies), ObjectConfig::Robot(robot)) => {
                checks.speed(bodies.substeps, name, robot, &path);
                checks.perturbations(robot, &path);
            }
            _ => {}
        }
    }
    if has_sound_boundary && let Some(outline) = config.world.outline() {
        for (name, object) in &config.world.objects {
            checks.between_walls(&outline, object, &places.objects.key(name));
        }
    }
}

/// What the checks rely on.
struct Checks<'a> {
    world: &'a WorldConfig,
    report: &'a Report<'a>,
    places: &'a Places,
}

/// Places of `world`.
struct Places {
    bodies: Path,
    boundary: Path,
    width: Path,
    height: Path,
    objects: Path,
}

impl Places {
    fn new() -> Self {
        let place = |key| Path::from(["world", key]);
        Self {
            bodies: place("bodies"),
            boundary: place("boundary"),
            width: place("width"),
            height: place("height"),
            objects: place("objects"),
        }
    }
}

impl Checks<'_> {
    /// Bodies need walls, and walls bodies. Returns whether there are walls of a sound shape.
    fn boundary(&self) -> bool {
        let Places { bodies, boundary, .. } = self.places;
        match (&self.world.bodies, &self.world.boundary) {
            (Some(_), Boundary::Torus) => self.report.conflict(
                bodies,
                &[boundary],
                "needs walls, but `world.boundary` is `torus`; make it `walls` or a list of \
                 corners",
            ),
            (None, Boundary::Walls | Boundary::Polygon(_)) => self.needs_bodies(boundary),
            _ => {}
        }
        match &self.world.boundary {
            Boundary::Torus => false,
            Boundary::Walls => true,
            Boundary::Polygon(corners) => {
                let is_within = self.within_world(corners, boundary);
                self.polygon(corners, boundary) && is_within
            }
        }
    }

    fn needs_bodies(&self, path: &Path) {
        let others = [&self.places.bodies];
        self.report.conflict(
            path,
            &others,
            "needs `world.bodies`, without which robots are points",
        );
    }

    fn without_bodies(&self, object: &ObjectConfig, path: &Path) {
        let robot = match object {
            ObjectConfig::Wall(_) | ObjectConfig::Obstacle(_) | ObjectConfig::Movable(_) => {
                return self.needs_bodies(&path.key("type"));
            }
            ObjectConfig::LightSource(_) | ObjectConfig::GroundArea(_) => return,
            ObjectConfig::Robot(robot) => robot,
        };
        let sensors = path.key("sensors");
        let light = robot.sensors.light_sensor.as_ref().map(|sensor| sensor.blocked_by);
        let distance = robot.sensors.distance_sensor.as_ref().map(|sensor| sensor.blocked_by);
        let receiver = robot.sensors.wireless_receiver.as_ref().map(|port| port.blocked_by);
        let blocks = |by: Option<BlockedBy>| by.is_some_and(|by| by != BlockedBy::Nothing);
        for (needs, path) in [
            (robot.body.is_some(), path.key("body")),
            (robot.sensors.proximity_sensor.is_some(), sensors.key("proximity_sensor")),
            (robot.sensors.contact_sensor.is_some(), sensors.key("contact_sensor")),
            (blocks(light), sensors.key("light_sensor").key("blocked_by")),
            (blocks(distance), sensors.key("distance_sensor").key("blocked_by")),
            (blocks(receiver), sensors.key("wireless_receiver").key("blocked_by")),
        ] {
            if needs {
                self.needs_bodies(&path);
            }
        }
    }

    /// Each ray of a proximity sensor has an angle.
    fn rays(&self, robot: &RobotConfig, path: &Path) {
        let Some(sensor) = &robot.sensors.proximity_sensor else { return };
        let Some(angles) = &sensor.angles else { return };
        let path = path.key("sensors").key("proximity_sensor");
        let (n, n_rays) = (angles.len(), sensor.n_rays);
        if n != n_rays as usize {
            self.report.conflict(&path.key("angles"), &[&path.key("n_rays")], || {
                format!("has {n} angles, but `n_rays` is {n_rays}")
            });
        }
    }

    fn perturbations(&self, robot: &RobotConfig, path: &Path) {
        if robot.perturbations.topology_switch.is_some() {
            let path = path.key("perturbations").key("topology_switch");
            self.report.conflict(
                &path,
                &[&self.places.bodies],
                "draws positions anew, where bodies may stand already; remove `topology_switch` \
                 or `world.bodies`",
            );
        }
    }

    /// In a substep, robots drive less than what could lead them through something.
    fn speed(&self, substeps: u32, name: &str, robot: &RobotConfig, path: &Path) {
        let (Some(wheels), Some(body)) = (&robot.actuators.wheel_actuator, &robot.body) else {
            return;
        };
        let mut narrowest = (body.radius, "the radius of its body".to_owned());
        for (name, object) in &self.world.objects {
            let ObjectConfig::Movable(movable) = object else { continue };
            let radius = match movable.params.shape() {
                Shape::Disc(radius) => radius,
                Shape::Polygon(corners) if is_convex(&corners) => inner_radius(&corners),
                // The checks of shapes refuse it.
                Shape::Polygon(_) => continue,
            };
            if radius < narrowest.0 {
                narrowest = (radius, format!("the inner radius of `{name}`"));
            }
        }
        let (radius, what) = narrowest;
        let reality = robot.perturbations.pseudo_reality;
        let factor = reality.map_or(1.0, |reality| reality.wheel_factor_max());
        let step = wheels.max_speed * factor * wheels.step_duration;
        let is_slow = |substeps: u32| step / f64::from(substeps) <= radius / 2.0;
        if is_slow(substeps) {
            return;
        }
        let (way, radius) = (rounded(step / f64::from(substeps)), rounded(radius));
        let remedy = match (substeps..=limits::SUBSTEPS).find(|&substeps| is_slow(substeps)) {
            Some(enough) => format!("set `world.bodies.substeps` to {enough} or more"),
            None => format!(
                "not even {} substeps are enough, so make `max_speed` or `step_duration` smaller",
                limits::SUBSTEPS
            ),
        };
        let others =
            [&path.key("actuators").key("wheel_actuator"), &path.key("body"), &self.places.objects];
        self.report.conflict(&self.places.bodies.key("substeps"), &others, || {
            format!(
                "robot `{name}` drives up to {way} cm in a substep, more than half of {radius} cm, \
                 {what}; {remedy}"
            )
        });
    }

    /// Robots, obstacles and movables start between the walls, and have the room.
    fn between_walls(&self, outline: &[Point], object: &ObjectConfig, path: &Path) {
        let (positions, radius, place) = match object {
            ObjectConfig::Robot(robot) => {
                let radius = robot.body.map(|body| body.radius);
                (&robot.initializers.positions, radius, path.key("body").key("radius"))
            }
            ObjectConfig::Obstacle(obstacle) => {
                let BodyInitializers { positions, .. } = &obstacle.initializers;
                (positions, obstacle.params.radius, path.key("params").key("radius"))
            }
            ObjectConfig::Movable(movable) => {
                let BodyInitializers { positions, .. } = &movable.initializers;
                (positions, movable.params.radius, path.key("params").key("radius"))
            }
            ObjectConfig::Wall(_) | ObjectConfig::LightSource(_) | ObjectConfig::GroundArea(_) => {
                return;
            }
        };
        let extent = |axis: usize| {
            let of_axis = outline.iter().map(|corner| corner[axis]);
            of_axis.clone().fold(f64::MIN, f64::max) - of_axis.fold(f64::MAX, f64::min)
        };
        let room = extent(0).min(extent(1));
        if let Some(radius) = radius.filter(|radius| 2.0 * radius > room) {
            self.walls_conflict(
                &place,
                format!("a disc of radius {radius} cm does not fit between"),
            );
        }
        self.start(outline, positions, &path.key("initializers").key("positions").key("params"));
    }

    /// Some start positions lie between the walls; given ones all do.
    fn start(&self, outline: &[Point], positions: &Initializer, path: &Path) {
        match positions {
            Initializer::Fixed { values } => {
                for (index, value) in values.iter().enumerate() {
                    if let [x, y] = value[..]
                        && !contains(outline, [x, y])
                    {
                        let path = path.key("values").index(index);
                        self.walls_conflict(&path, format!("[{x}, {y}] is outside"));
                    }
                }
            }
            Initializer::RandomUniform { low, high, .. } => {
                if !meets_square(outline, *low, *high) {
                    let what = format!("every place from {low} to {high} is outside");
                    self.walls_conflict(&path.key("low"), what);
                }
            }
            Initializer::RandomCircumference { radius, center } => {
                if !meets_circle(outline, *center, *radius) {
                    let [x, y] = center;
                    let what = format!("the circle of {radius} cm around [{x}, {y}] is outside");
                    self.walls_conflict(&path.key("radius"), what);
                }
            }
            Initializer::RandomGraph { initial_pos, .. } => {
                if !contains(outline, *initial_pos) {
                    let [x, y] = initial_pos;
                    self.walls_conflict(&path.key("initial_pos"), format!("[{x}, {y}] is outside"));
                }
            }
        }
    }

    /// Something is not between the walls.
    fn walls_conflict(&self, path: &Path, what: String) {
        let Places { boundary, width, height, .. } = self.places;
        self.report.conflict(path, &[boundary, width, height], || {
            format!("{what} the walls of `world.boundary`")
        });
    }
}

/// As people read a length.
fn rounded(length: f64) -> f64 {
    (length * 1000.0).round() / 1000.0
}
