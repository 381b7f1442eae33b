//! Reads `world`: the arena, lights, ground areas, start values.

use super::node::{Node, Object};
use super::robot::robot;
use crate::semantics::Semantics;
use crate::world::DEFAULT_WORLD_SIZE;
use crate::{
    GroundAreaConfig, GroundAreaParams, Initializer, LightController, LightParams,
    LightSourceConfig, ObjectConfig, OrbitConfig, Pace, PositionInitializers, RandomTargetsConfig,
    WorldConfig, limits,
};

pub(super) fn world(o: &mut Object<'_>, semantics: Semantics) -> WorldConfig {
    for key in ["world_delay", "render_connections"] {
        o.ignored(key, "it concerns the original simulator's window");
    }
    let size = |node: Node<'_>| node.number(1.0..=limits::MAGNITUDE);
    let height = o.or("height", DEFAULT_WORLD_SIZE, size);
    let width = o.or("width", DEFAULT_WORLD_SIZE, size);
    let center = [width / 2.0, height / 2.0];
    let objects =
        o.required("objects").map(1, |_, node| node.object(|o| object(o, center, semantics)));
    WorldConfig { height, width, objects }
}

fn object(o: &mut Object<'_>, center: [f64; 2], semantics: Semantics) -> ObjectConfig {
    const KNOWN: [&str; 5] = ["robot", "light_source", "ground_area", "food_area", "nest"];
    for key in ["positions", "orientations"] {
        o.ignored(key, "`initializers` say where objects start");
    }
    match o.required("type").one_of(&KNOWN, &[]) {
        Some("robot") => ObjectConfig::Robot(robot(o, center, semantics)),
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
    let default: LightParams = semantics.defaults();
    LightSourceConfig {
        num_instances: o.required("num_instances").u32(1..=limits::STATIC_OBJECTS),
        controller: o
            .or("controller", LightController::Static {}, |node| light_controller(node, semantics)),
        initializers: position_initializers(o, center),
        params: o.inner("params", |o| {
            o.ignored("static", "`controller` says how a light moves");
            LightParams {
                range: o.or("range", default.range, Node::positive),
                color: o.or("color", default.color, Node::name),
            }
        }),
    }
}

/// A name, an object of `name` and `params`, or null for none.
fn light_controller(node: Node<'_>, semantics: Semantics) -> LightController {
    const KNOWN: [&str; 5] = [
        "static",
        "light_orbit_controller",
        "light_prey_controller",
        "light_rnd_pos_controller",
        "script_controller",
    ];
    if node.is_null() {
        return LightController::Static {};
    }
    node.object_or_name(|o| {
        let Some(name) = o.required("name").one_of(&KNOWN, &[]) else {
            o.accept_rest();
            return LightController::Static {};
        };
        o.inner("params", |o| match name {
            "light_orbit_controller" => {
                LightController::LightOrbitController(orbit(o, semantics.defaults()))
            }
            "light_rnd_pos_controller" => LightController::LightRndPosController(random_targets(o)),
            "light_prey_controller" => LightController::LightPreyController {},
            "script_controller" => LightController::ScriptController {},
            _ => LightController::Static {},
        })
    })
}

fn orbit(o: &mut Object<'_>, default: OrbitConfig) -> OrbitConfig {
    OrbitConfig {
        angle_step: o.or("angle_step", default.angle_step, Node::amount),
        radius_step: o.or("radius_step", default.radius_step, |node| node.or_null(Node::positive)),
        radius: o.or("radius", default.radius, Node::amount),
    }
}

fn random_targets(o: &mut Object<'_>) -> RandomTargetsConfig {
    let default = RandomTargetsConfig::default();
    let speed = o.optional("speed");
    let step = o.optional("step");
    if let (Some(_), Some(step)) = (&speed, &step) {
        step.problem("`speed` says the same");
    }
    let speed = speed.map(|node| Pace::Speed(node.amount()));
    let step = step.map(|node| Pace::Step(node.probability()));
    RandomTargetsConfig {
        every: o.or("every", default.every, |node| node.u32(1..=limits::STEPS)),
        square: o.or("square", default.square, Node::amount),
        pace: speed.or(step).unwrap_or(default.pace),
    }
}

/// `color`: of food areas and nests, which have no other one.
fn ground_area(o: &mut Object<'_>, center: [f64; 2], color: Option<&str>) -> GroundAreaConfig {
    /// Radius of the original's areas, cm.
    const RANGE: f64 = 150.0;
    let default = match color {
        Some(color) => GroundAreaParams { range: RANGE, color: color.to_owned() },
        None => GroundAreaParams::default(),
    };
    GroundAreaConfig {
        num_instances: o.required("num_instances").u32(1..=limits::STATIC_OBJECTS),
        controller: o.or("controller", None, |node| {
            let read = |o: &mut Object<'_>| o.required("name").variant(&[]);
            if node.is_null() { None } else { node.object_or_name(read) }
        }),
        initializers: position_initializers(o, center),
        params: o.inner("params", |o| GroundAreaParams {
            range: o.or("range", default.range, Node::positive),
            color: match color {
                Some(color) => color.to_owned(),
                None => o.or("color", default.color, Node::name),
            },
        }),
    }
}

fn position_initializers(o: &mut Object<'_>, center: [f64; 2]) -> PositionInitializers {
    o.required("initializers").object(|o| {
        o.ignored("orientations", "only robots have a heading");
        PositionInitializers { positions: positions(o.required("positions"), center) }
    })
}

/// `center`: of the world, the default centre of arrangements.
pub(super) fn positions(node: Node<'_>, center: [f64; 2]) -> Initializer {
    const KNOWN: [&str; 4] = ["fixed", "random_uniform", "random_circumference", "random_graph"];
    node.object(|o| {
        let Some(name) = o.required("name").one_of(&KNOWN, &["grid_graph"]) else {
            o.accept_rest();
            return Initializer::Fixed { values: vec![vec![0.0; 2]] };
        };
        o.inner("params", |o| match name {
            "fixed" => fixed(o, 2),
            "random_uniform" => random_uniform(o, 2, 100.0, 900.0),
            "random_circumference" => Initializer::RandomCircumference {
                radius: o.or("radius", 130.0, Node::amount),
                center: o.or("center", center, Node::pair),
            },
            _ => Initializer::RandomGraph {
                max_rad: o.or("max_rad", 300.0, Node::positive),
                initial_pos: o.or("initial_pos", center, Node::pair),
            },
        })
    })
}

/// Headings; by default uniform on the circle.
pub(super) fn orientations(node: Option<Node<'_>>) -> Initializer {
    const FULL_TURN: f64 = std::f64::consts::TAU;
    let Some(node) = node else {
        return Initializer::RandomUniform { low: 0.0, high: FULL_TURN, size: 1 };
    };
    node.object(|o| {
        let Some(name) = o.required("name").one_of(&["fixed", "random_uniform"], &[]) else {
            o.accept_rest();
            return Initializer::Fixed { values: vec![vec![0.0]] };
        };
        o.inner("params", |o| match name {
            "fixed" => fixed(o, 1),
            _ => random_uniform(o, 1, 0.0, FULL_TURN),
        })
    })
}

fn fixed(o: &mut Object<'_>, n_components: usize) -> Initializer {
    const MAX: usize = limits::ROBOTS as usize;
    let vector = |node: Node<'_>| -> Vec<f64> {
        node.list(n_components..=n_components).into_iter().map(Node::quantity).collect()
    };
    let values = o.required("values").list(1..=MAX);
    Initializer::Fixed { values: values.into_iter().map(vector).collect() }
}

fn random_uniform(o: &mut Object<'_>, n_components: u32, low: f64, high: f64) -> Initializer {
    Initializer::RandomUniform {
        low: o.or("low", low, Node::quantity),
        high: o.or("high", high, Node::quantity),
        size: o.or("size", n_components, |node| node.u32(n_components..=n_components)),
    }
}
