//! Reads `world`: the arena, lights, ground areas, things in the way, start values.

use super::node::{Node, Object};
use super::robot::robot;
use crate::parameters::{self, Choice};
use crate::semantics::Semantics;
use crate::{
    BodyInitializers, GroundAreaConfig, GroundAreaParams, Initializer, LightController,
    LightSourceConfig, MovableConfig, NamedAreaParams, ObjectConfig, ObstacleConfig,
    ParameterValue, PositionInitializers, WorldConfig, limits,
};

pub(super) fn world(o: &mut Object<'_>, semantics: Semantics) -> WorldConfig {
    let world: WorldConfig = parameters::read(o, semantics, &[]);
    let center = [world.width / 2.0, world.height / 2.0];
    let has_bodies = world.bodies.is_some();
    let read = |o: &mut Object<'_>| object(o, center, has_bodies, semantics);
    let objects = o.required("objects").map(1, |_, node| node.object(read));
    WorldConfig { objects, ..world }
}

fn object(
    o: &mut Object<'_>,
    center: [f64; 2],
    has_bodies: bool,
    semantics: Semantics,
) -> ObjectConfig {
    const KNOWN: [&str; 8] = [
        "robot",
        "light_source",
        "ground_area",
        "food_area",
        "nest",
        "wall",
        "obstacle",
        "movable",
    ];
    let kind = o.required("type").one_of(&KNOWN, &[]);
    if !matches!(kind, Some("wall" | "obstacle" | "movable")) {
        for key in ["positions", "orientations"] {
            o.ignored(key, "`initializers` determine where objects start");
        }
    }
    match kind {
        Some("robot") => ObjectConfig::Robot(robot(o, center, has_bodies, semantics)),
        Some("wall") => ObjectConfig::Wall(parameters::read(o, semantics, &[])),
        Some("obstacle") => ObjectConfig::Obstacle(ObstacleConfig {
            num_instances: o.required("num_instances").u32(1..=limits::OBSTACLES),
            initializers: body_initializers(o, center),
            params: parameters::inner(o, "params", semantics, &[]),
        }),
        Some("movable") => ObjectConfig::Movable(MovableConfig {
            num_instances: o.required("num_instances").u32(1..=limits::OBSTACLES),
            initializers: body_initializers(o, center),
            params: parameters::inner(o, "params", semantics, &[]),
        }),
        Some("light_source") => ObjectConfig::LightSource(light_source(o, center, semantics)),
        Some("food_area") => ObjectConfig::GroundArea(ground_area(o, center, Some("green"))),
        Some("nest") => ObjectConfig::GroundArea(ground_area(o, center, Some("black"))),
        Some(_) => ObjectConfig::GroundArea(ground_area(o, center, None)),
        None => {
            o.accept_rest();
            ObjectConfig::GroundArea(GroundAreaConfig {
                num_instances: 1,
                controller: None,
                initializers: PositionInitializers {
                    positions: Initializer::Fixed { values: vec![vec![0.0; 2]] },
                },
                params: GroundAreaParams::default(),
            })
        }
    }
}

fn light_source(o: &mut Object<'_>, center: [f64; 2], semantics: Semantics) -> LightSourceConfig {
    LightSourceConfig {
        num_instances: o.required("num_instances").u32(1..=limits::STATIC_OBJECTS),
        controller: o
            .or("controller", LightController::Static {}, |node| light_controller(node, semantics)),
        initializers: position_initializers(o, center),
        params: parameters::inner(o, "params", semantics, &[]),
    }
}

/// Reads a controller of lights: a name, an object of `name` and `params`, or null.
fn light_controller(node: Node<'_>, semantics: Semantics) -> LightController {
    let choice = Choice::any::<LightController>(&[]);
    let read = |o: &mut Object<'_>| parameters::read_kind(o, &choice, semantics, &[]);
    node.or_null(|node| node.object_or_name(read)).flatten().unwrap_or(LightController::Static {})
}

/// Reads a ground area. `color`: the fixed colour of food areas and nests.
fn ground_area(o: &mut Object<'_>, center: [f64; 2], color: Option<&str>) -> GroundAreaConfig {
    GroundAreaConfig {
        num_instances: o.required("num_instances").u32(1..=limits::STATIC_OBJECTS),
        controller: o.or("controller", None, |node| {
            let read = |o: &mut Object<'_>| o.required("name").variant(&[]);
            if node.is_null() { None } else { node.object_or_name(read) }
        }),
        initializers: position_initializers(o, center),
        params: match color {
            None => parameters::inner(o, "params", Semantics::Thesis, &[]),
            Some(color) => {
                let NamedAreaParams { range } =
                    parameters::inner(o, "params", Semantics::Thesis, &[]);
                GroundAreaParams { range, color: color.to_owned() }
            }
        },
    }
}

fn position_initializers(o: &mut Object<'_>, center: [f64; 2]) -> PositionInitializers {
    o.required("initializers").object(|o| {
        o.ignored("orientations", "only robots have a heading");
        PositionInitializers { positions: positions(o.required("positions"), center) }
    })
}

fn body_initializers(o: &mut Object<'_>, center: [f64; 2]) -> BodyInitializers {
    o.required("initializers").object(|o| BodyInitializers {
        positions: positions(o.required("positions"), center),
        orientations: o
            .optional("orientations")
            .map_or(Initializer::Fixed { values: vec![vec![0.0]] }, |node| {
                orientations(Some(node))
            }),
    })
}

/// Reads start positions. `center`: the centre of the world, which is the default centre of
/// arrangements.
pub(super) fn positions(node: Node<'_>, center: [f64; 2]) -> Initializer {
    let choice = Choice::any::<Initializer>(&["grid_graph"]);
    let centers = [("center", center.into()), ("initial_pos", center.into())];
    let given = [&of_components(2, 100.0, 900.0)[..], &centers].concat();
    let read = |o: &mut Object<'_>| parameters::read_kind(o, &choice, Semantics::Thesis, &given);
    node.object(read).unwrap_or(Initializer::Fixed { values: vec![vec![0.0; 2]] })
}

/// Reads headings; by default uniform on the circle.
pub(super) fn orientations(node: Option<Node<'_>>) -> Initializer {
    const FULL_TURN: f64 = std::f64::consts::TAU;
    let Some(node) = node else {
        return Initializer::RandomUniform { low: 0.0, high: FULL_TURN, size: 1 };
    };
    let names = vec!["fixed", "random_uniform"];
    let choice = Choice { names, unsupported: &[], default: None };
    let given = of_components(1, 0.0, FULL_TURN);
    let read = |o: &mut Object<'_>| parameters::read_kind(o, &choice, Semantics::Thesis, &given);
    node.object(read).unwrap_or(Initializer::Fixed { values: vec![vec![0.0]] })
}

/// Defaults for values with `n` components.
fn of_components(n: u32, low: f64, high: f64) -> [(&'static str, ParameterValue); 4] {
    let values = vec![vec![0.0; n as usize]];
    [("values", values.into()), ("low", low.into()), ("high", high.into()), ("size", n.into())]
}
