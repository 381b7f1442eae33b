//! `world`: the arena, its lights and ground areas, and where objects start.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    BOUNDARY, BodiesConfig, Boundary, MovableConfig, NamedMap, ObstacleConfig, RobotConfig,
    WallConfig, limits, schema,
};
use crate::DefaultValue::{Depends, Name, Null, Number, Required};
use crate::parameters::{kinds, parameters};
use crate::{DefaultValue, Domain};

parameters! {
    /// The arena and its objects.
    pub struct WorldConfig {
        /// Height H (y axis), cm.
        height: f64 = between([1.0, limits::MAGNITUDE], 1000.0),
        /// Width W (x axis), cm.
        width: f64 = between([1.0, limits::MAGNITUDE], 1000.0),
        /// What is at the edge of the world: nothing, as on a torus; walls along the rectangle; or
        /// walls through the corners `[x, y]` of a simple polygon in it, cm.
        boundary: Boundary = of(Domain::Variant(BOUNDARY), Name("torus")).recent(),
        /// Makes bodies of robots, which then block each other and push movables. Needs a
        /// `boundary` of walls.
        bodies: Option<BodiesConfig> = optional(BodiesConfig::OBJECT),
    }
    ignored {
        "world_delay", "render_connections": "it concerns the original simulator's window";
    }
    parts {
        /// Robots, lights, ground areas, walls, obstacles and movables, by names that you choose.
        /// Their order numbers the robots.
        objects: NamedMap<ObjectConfig> = required(schema::map::<ObjectConfig>);
    }
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
    /// A line of walls, which blocks robots and movables.
    Wall(WallConfig),
    /// Discs or polygons that stand in the way.
    Obstacle(ObstacleConfig),
    /// Discs or convex polygons that robots push.
    Movable(MovableConfig),
}

impl ObjectConfig {
    /// Number of objects.
    pub fn num_instances(&self) -> u32 {
        match self {
            Self::Robot(robot) => robot.num_instances,
            Self::LightSource(light) => light.num_instances,
            Self::GroundArea(area) => area.num_instances,
            Self::Wall(_) => 1,
            Self::Obstacle(obstacle) => obstacle.num_instances,
            Self::Movable(movable) => movable.num_instances,
        }
    }
}

kinds! {
    /// How start values are drawn: positions on the torus, or headings, which take `fixed` and
    /// `random_uniform` only.
    pub enum Initializer by "name" {
        /// Given values, one per object; a single one serves all.
        Fixed {
            /// Positions `[x, y]`, or headings `[theta]`.
            values: Vec<Vec<f64>> = of(Domain::Vectors(limits::ROBOTS as usize), Required),
        } = "fixed",
        /// Independent uniform components.
        RandomUniform {
            /// Lower bound, inclusive.
            low: f64 = of(Domain::QUANTITY, Depends("100, of headings 0")),
            /// Upper bound, exclusive.
            high: f64 = of(Domain::QUANTITY, Depends("900, of headings 2 pi")),
            /// Components: 2 for positions, 1 for headings.
            size: u32 = of(Domain::Certain, DefaultValue::Certain),
        } = "random_uniform",
        /// Uniform on a circle.
        RandomCircumference {
            /// Radius of the circle, cm.
            radius: f64 = amount(130.0),
            /// Centre of the circle, cm.
            center: [f64; 2] = of(Domain::Numbers(2, 2), Depends(CENTRE)),
        } = "random_circumference",
        /// A connected, compact random geometric graph.
        RandomGraph {
            /// Scale of the graph, cm. At more than half this distance from the centre, steps
            /// become tangential.
            max_rad: f64 = positive(300.0),
            /// Position of the first robot and centre of the graph, cm.
            initial_pos: [f64; 2] = of(Domain::Numbers(2, 2), Depends(CENTRE)),
        } = "random_graph",
    }
}

const CENTRE: &str = "the centre of the world";

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
    /// How they move; default null: they stand still.
    pub controller: LightController,
    /// Start positions.
    pub initializers: PositionInitializers,
    /// Reach and colour.
    pub params: LightParams,
}

kinds! {
    /// How a light moves.
    pub enum LightController by "name" then schema::or_name_or_null {
        /// Stands still.
        Static {} = "static",
        /// Circles the centre of the world (Eq. 5.7-5.8).
        LightOrbitController(OrbitConfig) = "light_orbit_controller",
        /// Flees from robots within 150 cm, by 3 cm per step, until a robot is within 30 cm.
        LightPreyController {} = "light_prey_controller",
        /// Goes to random targets (section 6.4).
        LightRndPosController(RandomTargetsConfig) = "light_rnd_pos_controller",
        /// The function `move` of the script of `task` moves it.
        ScriptController {} = "script_controller",
    }
}

parameters! {
    /// A light's orbit.
    #[derive(Copy)]
    pub struct OrbitConfig: Default {
        /// Angle per step, radians.
        angle_step: f64 = amount(0.01).original(Number(0.013)).recent(),
        /// Growth of the radius per step, cm.
        radius_step: Option<f64> = positive(0.0)
            .null()
            .shown("null: a fiftieth of the missing length (Eq. 5.7)")
            .original(Number(1.0))
            .recent(),
        /// Final radius, cm.
        radius: f64 = amount(200.0).recent(),
    }

    /// A light's way to random targets.
    #[derive(Copy)]
    pub struct RandomTargetsConfig: Default {
        /// Period at which the target is drawn anew, steps.
        every: u32 = whole([1, limits::STEPS], 50),
        /// Side of the square from which targets are drawn, cm. Its centre is the centre of the
        /// world.
        square: f64 = amount(200.0).recent(),
        /// Distance per step, cm. The light passes its target and turns back.
        speed: Option<f64> = amount(3.0),
        /// alpha of Eq. 6.4: share of the remaining distance that the light covers per step. It
        /// replaces `speed`.
        step: Option<f64> = of(Domain::Between(0.0, 1.0), Null).instead_of("speed"),
    }

    /// Physical properties of a light.
    pub struct LightParams: Default {
        /// Reach, cm. No sensor sees the light from beyond it.
        range: f64 = positive(80.0).original(Number(150.0)),
        /// Colour, which sensors of the same colour see.
        color: String = text("red"),
    }
    ignored { "static": "`controller` determines how a light moves"; }

    /// Physical properties of a ground area.
    pub struct GroundAreaParams: Default {
        /// Radius, cm.
        range: f64 = positive(100.0),
        /// Colour, which sensors of the same colour see.
        color: String = text("black"),
    }

    /// Physical properties of a food area or a nest of the original.
    pub struct NamedAreaParams {
        /// Radius, cm.
        range: f64 = positive(150.0),
    }
}

/// Start of a light or ground area.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::ignored("orientations"))]
pub struct PositionInitializers {
    /// Start positions.
    pub positions: Initializer,
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
    /// How they move; default null: they do not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controller: Option<AreaController>,
    /// Start positions.
    pub initializers: PositionInitializers,
    /// Radius and colour.
    pub params: GroundAreaParams,
}

/// How a ground area moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AreaController {
    /// The function `move` of the script of `task` moves it.
    ScriptController,
}
