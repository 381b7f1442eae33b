//! `world`: the arena, its lights and ground areas, and where objects start.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{NamedMap, RobotConfig, limits, schema};

/// Of [`WorldConfig::height`] and [`WorldConfig::width`].
pub(super) const DEFAULT_WORLD_SIZE: f64 = 1000.0;

/// A flat torus and its objects.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("height, width"),
    transform = schema::ignored("world_delay, render_connections")
)]
pub struct WorldConfig {
    /// Height H (y axis), cm; default 1000.
    #[schemars(range(min = 1), extend("default" = DEFAULT_WORLD_SIZE))]
    pub height: f64,
    /// Width W (x axis), cm; default 1000.
    #[schemars(range(min = 1), extend("default" = DEFAULT_WORLD_SIZE))]
    pub width: f64,
    /// Robots, lights, ground areas; their order numbers the robots.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub objects: NamedMap<ObjectConfig>,
}

/// One kind of object.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
#[schemars(transform = schema::food_areas_and_nests)]
#[expect(clippy::large_enum_variant, reason = "a world has a handful of them")]
pub enum ObjectConfig {
    /// A swarm of equal robots.
    Robot(RobotConfig),
    /// Point lights.
    LightSource(LightSourceConfig),
    /// Coloured discs on the ground.
    GroundArea(GroundAreaConfig),
}

impl ObjectConfig {
    /// How many of them there are.
    pub fn num_instances(&self) -> u32 {
        match self {
            Self::Robot(robot) => robot.num_instances,
            Self::LightSource(light) => light.num_instances,
            Self::GroundArea(area) => area.num_instances,
        }
    }
}

/// Draws start values (section 5 of the simulation's specification).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "name", content = "params", rename_all = "snake_case")]
#[schemars(deny_unknown_fields)]
pub enum Initializer {
    /// Given values, one per object; a single one serves all.
    Fixed {
        /// Positions `[x, y]`, or headings `[theta]`.
        values: Vec<Vec<f64>>,
    },
    /// Independent uniform components.
    #[schemars(transform = schema::optional("low, high, size"))]
    RandomUniform {
        /// Lower bound, inclusive.
        low: f64,
        /// Upper bound, exclusive.
        high: f64,
        /// Components: 2 for positions, 1 for headings.
        size: u32,
    },
    /// Uniform on a circle.
    #[schemars(transform = schema::optional("radius, center"))]
    RandomCircumference {
        /// Radius, cm.
        radius: f64,
        /// Centre, cm.
        center: [f64; 2],
    },
    /// A connected, compact random geometric graph.
    #[schemars(transform = schema::optional("max_rad, initial_pos"))]
    RandomGraph {
        /// Scale of the graph, cm: beyond half of it from the centre, steps turn
        /// tangential.
        max_rad: f64,
        /// First robot, and centre, cm.
        initial_pos: [f64; 2],
    },
}

/// Point lights.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("controller, params"),
    transform = schema::ignored("positions, orientations")
)]
pub struct LightSourceConfig {
    /// Number of lights.
    #[schemars(range(min = 1, max = limits::STATIC_OBJECTS))]
    pub num_instances: u32,
    /// How they move.
    pub controller: LightController,
    /// Where they start.
    pub initializers: PositionInitializers,
    /// Physical properties.
    pub params: LightParams,
}

/// How a light moves.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "name", content = "params", rename_all = "snake_case")]
#[schemars(deny_unknown_fields, transform = schema::or_name_or_null)]
pub enum LightController {
    /// Stands still.
    #[schemars(transform = schema::optional(""))]
    Static {},
    /// Circles the centre of the world (Eq. 5.7-5.8).
    #[schemars(transform = schema::optional(""))]
    LightOrbitController(OrbitConfig),
    /// Flees from robots within 150 cm, 3 cm per step, until one is within 30 cm.
    #[schemars(transform = schema::optional(""))]
    LightPreyController {},
    /// Goes to random targets (section 6.4).
    #[schemars(transform = schema::optional(""))]
    LightRndPosController(RandomTargetsConfig),
    /// As the function `move` of the script of `task` says.
    #[schemars(transform = schema::optional(""))]
    ScriptController {},
}

/// A light's orbit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct OrbitConfig {
    /// Angle per step, radians; default 0.01.
    #[serde(skip_serializing_if = "is_angle_of_thesis")]
    #[schemars(range(min = 0))]
    pub angle_step: f64,
    /// What the radius grows by per step, cm; default null: a fiftieth of what it lacks
    /// (Eq. 5.7).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "schema::positive_or_null")]
    pub radius_step: Option<f64>,
    /// Radius in the end, cm; default 200.
    #[serde(skip_serializing_if = "is_radius_of_thesis")]
    #[schemars(range(min = 0))]
    pub radius: f64,
}

impl Default for OrbitConfig {
    fn default() -> Self {
        Self { angle_step: 0.01, radius_step: None, radius: 200.0 }
    }
}

/// Whether the canonical form leaves `angle_step` out.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_angle_of_thesis(angle_step: &f64) -> bool {
    *angle_step == OrbitConfig::default().angle_step
}

/// Whether the canonical form leaves `radius` out.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_radius_of_thesis(radius: &f64) -> bool {
    *radius == OrbitConfig::default().radius
}

/// A light's way to random targets.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::property("speed", schema::amount("Way per step, cm; default 3.")),
    transform = schema::property("step", schema::share(
        "alpha of Eq. 6.4: share of the remaining way covered per step, instead of `speed`."
    ))
)]
pub struct RandomTargetsConfig {
    /// Period at which the target is redrawn, steps; default 50.
    #[schemars(range(min = 1, max = limits::STEPS))]
    pub every: u32,
    /// Side of the square around the centre of the world that targets are drawn from, cm;
    /// default 200.
    #[serde(skip_serializing_if = "is_default_square")]
    #[schemars(range(min = 0))]
    pub square: f64,
    /// How fast it goes.
    #[serde(flatten)]
    #[schemars(skip)]
    pub pace: Pace,
}

/// How far a light goes in a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pace {
    /// So far, cm: it passes its target and turns back.
    Speed(f64),
    /// This share of the way that is left (alpha of Eq. 6.4).
    Step(f64),
}

impl Default for RandomTargetsConfig {
    fn default() -> Self {
        Self { every: 50, square: 200.0, pace: Pace::Speed(3.0) }
    }
}

/// Whether the canonical form leaves `square` out.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_default_square(square: &f64) -> bool {
    *square == RandomTargetsConfig::default().square
}

/// Start of a light or ground area.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::ignored("orientations"))]
pub struct PositionInitializers {
    /// Positions.
    pub positions: Initializer,
}

/// Physical properties of a light.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields, transform = schema::ignored("static"))]
pub struct LightParams {
    /// Reach, cm; default 80.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Colour; default "red".
    pub color: String,
}

impl Default for LightParams {
    fn default() -> Self {
        Self { range: 80.0, color: "red".to_owned() }
    }
}

/// Coloured discs on the ground.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("controller, params"),
    transform = schema::ignored("positions, orientations")
)]
pub struct GroundAreaConfig {
    /// Number of discs.
    #[schemars(range(min = 1, max = limits::STATIC_OBJECTS))]
    pub num_instances: u32,
    /// How they move; null: they do not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controller: Option<AreaController>,
    /// Where they are.
    pub initializers: PositionInitializers,
    /// Physical properties.
    pub params: GroundAreaParams,
}

/// How a ground area moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AreaController {
    /// As the function `move` of the script of `task` says.
    ScriptController,
}

/// Physical properties of a ground area.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct GroundAreaParams {
    /// Radius, cm; default 100.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Colour; default "black".
    pub color: String,
}

impl Default for GroundAreaParams {
    fn default() -> Self {
        Self { range: 100.0, color: "black".to_owned() }
    }
}
