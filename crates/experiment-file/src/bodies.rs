//! Bodies: the boundary of the arena, walls, things that stand in the way, things that robots push.

use schemars::{JsonSchema, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::DefaultValue::{Null, Required};
use crate::geometry::counter_clockwise;
use crate::parameters::{Variants, list, parameters, points, points_schema, variants};
use crate::{Domain, Initializer, ParameterValue, WorldConfig, limits, schema};

/// What is at the edge of the world.
#[derive(Debug, Clone, PartialEq)]
pub enum Boundary {
    /// Nothing: whoever leaves on one side comes back on the opposite one.
    Torus,
    /// Walls along the edge of the rectangle `width` x `height`.
    Walls,
    /// Walls along the edge of a simple polygon in that rectangle: its corners `[x, y]`, cm, in
    /// either order.
    Polygon(Vec<[f64; 2]>),
}

impl WorldConfig {
    /// The corners of the arena, cm, counter-clockwise; `None` of a torus, which has none.
    pub fn outline(&self) -> Option<Vec<[f64; 2]>> {
        let (width, height) = (self.width, self.height);
        match &self.boundary {
            Boundary::Torus => None,
            Boundary::Walls => Some(vec![[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]),
            Boundary::Polygon(corners) => Some(counter_clockwise(corners)),
        }
    }
}

const TORUS: &str = "torus";
const WALLS: &str = "walls";

/// `world.boundary`
pub(crate) const BOUNDARY: &Variants = &Variants {
    names: || &[TORUS, WALLS],
    read: |node| {
        if node.is_list() {
            Some(points(node, 3..=limits::CORNERS).into())
        } else {
            node.one_of(&[TORUS, WALLS], &[]).map(Into::into)
        }
    },
    schema: |_| {
        let corners = points_schema(3, limits::CORNERS);
        json_schema!({"anyOf": [{"enum": [TORUS, WALLS]}, corners]})
    },
};

impl From<Boundary> for ParameterValue {
    fn from(boundary: Boundary) -> Self {
        match boundary {
            Boundary::Torus => TORUS.into(),
            Boundary::Walls => WALLS.into(),
            Boundary::Polygon(corners) => corners.into(),
        }
    }
}

impl TryFrom<ParameterValue> for Boundary {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        match value {
            ParameterValue::Name(name) if name == TORUS => Ok(Self::Torus),
            ParameterValue::Name(name) if name == WALLS => Ok(Self::Walls),
            value => value.try_into().map(Self::Polygon),
        }
    }
}

/// Radii of bodies, cm.
const RADII: [f64; 2] = [*limits::BODY_RADII.start(), *limits::BODY_RADII.end()];
/// Masses of bodies, kg.
const MASSES: [f64; 2] = [*limits::MASSES.start(), *limits::MASSES.end()];

parameters! {
    /// How bodies move.
    #[derive(Copy)]
    pub struct BodiesConfig: Default {
        /// Steps of the physics in an environment step. With more, faster robots cannot pass
        /// through each other.
        substeps: u32 = whole([1, limits::SUBSTEPS], 4),
        /// Version of the physics, on which every bit of a result depends.
        format: u32 = whole([1, 1], 1),
    }

    /// The body of a robot: a disc.
    #[derive(Copy)]
    pub struct BodyConfig: Default {
        /// Radius, cm.
        radius: f64 = between(RADII, 3.5),
        /// Mass, kg.
        mass: f64 = between(MASSES, 0.15),
        /// Largest force that its wheels exert, N.
        push_force: f64 = between([0.001, 10_000.0], 0.5),
    }

    /// A line of walls without thickness, which blocks robots and movables.
    pub struct WallConfig {
        /// Its corners `[x, y]` in the world, cm.
        corners: Vec<[f64; 2]> = of(Domain::Points(2, limits::CORNERS), Required),
    }

    /// Shape of an obstacle.
    pub struct ObstacleParams: Default {
        /// Radius of a disc, cm.
        radius: Option<f64> = between(RADII, 10.0),
        /// In place of `radius`, the corners `[x, y]` of a simple polygon around the obstacle's own
        /// position, in either order, cm.
        corners: Option<Vec<[f64; 2]>> =
            of(Domain::Points(3, limits::CORNERS), Null).instead_of("radius"),
    }

    /// Shape, mass and friction of a movable.
    pub struct MovableParams: Default {
        /// Radius of a disc, cm.
        radius: Option<f64> = between(RADII, 10.0),
        /// In place of `radius`, the corners `[x, y]` of a convex polygon, in either order, cm. The
        /// polygon's centre of mass is at the movable's position.
        corners: Option<Vec<[f64; 2]>> =
            of(Domain::Points(3, limits::MOVABLE_CORNERS), Null).instead_of("radius"),
        /// Mass, kg.
        mass: f64 = between(MASSES, 0.5),
        /// Friction with the ground, as a share of the weight: whoever pushes with less force does
        /// not move it.
        friction: f64 = between([0.0, 10.0], 0.3),
    }
}

/// The shape of an obstacle or a movable, around its own position.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A disc of this radius, cm.
    Disc(f64),
    /// The corners of a polygon, cm, counter-clockwise.
    Polygon(Vec<[f64; 2]>),
}

impl ObstacleParams {
    /// Its shape.
    pub fn shape(&self) -> Shape {
        shape(self.radius, self.corners.as_deref())
    }
}

impl MovableParams {
    /// Its shape.
    pub fn shape(&self) -> Shape {
        shape(self.radius, self.corners.as_deref())
    }
}

fn shape(radius: Option<f64>, corners: Option<&[[f64; 2]]>) -> Shape {
    match corners {
        Some(corners) => Shape::Polygon(counter_clockwise(corners)),
        None => Shape::Disc(radius.expect("there is a radius where there are no corners")),
    }
}

/// Start of an obstacle or a movable.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("orientations"))]
pub struct BodyInitializers {
    /// Where they are at the start.
    pub positions: Initializer,
    /// Angles by which they are turned; default 0: as `corners` has them.
    pub orientations: Initializer,
}

/// Things that stand in the way.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("params"))]
pub struct ObstacleConfig {
    /// Number of obstacles.
    #[schemars(range(min = 1, max = limits::OBSTACLES))]
    pub num_instances: u32,
    /// Where they stand.
    pub initializers: BodyInitializers,
    /// Shape.
    pub params: ObstacleParams,
}

/// Things that robots push.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("params"))]
pub struct MovableConfig {
    /// Number of movables.
    #[schemars(range(min = 1, max = limits::OBSTACLES))]
    pub num_instances: u32,
    /// Where they start.
    pub initializers: BodyInitializers,
    /// Shape, mass and friction.
    pub params: MovableParams,
}

/// What stops light or frames, or hides a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BlockedBy {
    /// Nothing.
    Nothing,
    /// The boundary, walls and obstacles.
    Walls,
    /// These, movables, and robots other than the two ends.
    Bodies,
}

variants! {
    BlockedBy, unsupported: &[];
}

/// What a proximity sensor meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sees {
    /// Other robots.
    pub robots: bool,
    /// The boundary and walls.
    pub walls: bool,
    /// Obstacles and movables.
    pub objects: bool,
}

impl Sees {
    /// The parts by their names in the file.
    const NAMES: [&str; 3] = ["robots", "walls", "objects"];

    fn parts(self) -> [bool; 3] {
        [self.robots, self.walls, self.objects]
    }
}

const ALL: &str = "all";
const NAMES_OF_SEES: [&str; 4] = [ALL, "robots", "walls", "objects"];

/// `sees`
pub(crate) const SEES: &Variants = &Variants {
    names: || &[ALL],
    read: |node| {
        if !node.is_list() {
            return node.one_of(&NAMES_OF_SEES, &[]).map(Into::into);
        }
        let mut names: Vec<String> = Vec::new();
        for node in node.list(1..=NAMES_OF_SEES.len()) {
            if let Some(name) = names.iter().find(|name| node.is(name)) {
                node.problem(format!("names `{name}` twice"));
                return None;
            }
            names.push(node.one_of(&NAMES_OF_SEES, &[])?.to_owned());
        }
        Some(names.into())
    },
    schema: |_| {
        let name = json!({"enum": NAMES_OF_SEES});
        json_schema!({"anyOf": [name, list(name.clone(), 1, NAMES_OF_SEES.len())]})
    },
};

impl From<Sees> for ParameterValue {
    /// `"all"`, a name, or a list in a fixed order.
    fn from(sees: Sees) -> Self {
        let seen = Sees::NAMES.into_iter().zip(sees.parts()).filter(|(_, is_seen)| *is_seen);
        let names: Vec<&str> = seen.map(|(name, _)| name).collect();
        match names[..] {
            [name] => name.into(),
            [_, _, _] => ALL.into(),
            _ => Self::Names(names.into_iter().map(str::to_owned).collect()),
        }
    }
}

impl TryFrom<ParameterValue> for Sees {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        let names = match value {
            ParameterValue::Name(name) => vec![name],
            value => Vec::<String>::try_from(value)?,
        };
        let [robots, walls, objects] =
            Self::NAMES.map(|part| names.iter().any(|name| name == part || name == ALL));
        Ok(Self { robots, walls, objects })
    }
}
