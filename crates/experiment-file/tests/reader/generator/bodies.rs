//! Bodies: walls, things in the way, things to push.

use serde_json::{Value, json};

use super::{Dice, insert, object};

/// Gives bodies to the robots of a file. They start in a corner of the world, and everything else
/// stands elsewhere.
pub(super) fn add_bodies(dice: &mut Dice, world: &mut Value) {
    let corners = json!([[0, 0], [900, 0], [900, 250], [600, 260], [600, 500], [0, 500]]);
    let boundary = if dice.chance(0.5) { json!("walls") } else { corners };
    insert(world, "boundary", boundary);
    let objects = world["objects"].as_object_mut().unwrap();
    let mut has_wheels = false;
    let robots = objects.values_mut().filter(|object| object["type"] == "robot");
    for (number, robot) in (0_u8..).zip(robots) {
        has_wheels |= robot["actuators"].get("wheel_actuator").is_some();
        let low = f64::from(number) * 150.0;
        body(dice, robot);
        let params = match dice.below(3) {
            0 => {
                json!({"name": "random_uniform", "params": {"low": low + 20.0, "high": low + 140.0}})
            }
            1 => json!({"name": "random_circumference",
                "params": {"radius": 60, "center": [low + 80.0, low + 80.0]}}),
            _ => json!({"name": "random_graph",
                "params": {"max_rad": 90, "initial_pos": [low + 80.0, low + 80.0]}}),
        };
        insert(&mut robot["initializers"], "positions", params);
        if let Some(perturbations) = robot.get_mut("perturbations") {
            perturbations.as_object_mut().unwrap().remove("topology_switch");
        }
    }
    // The fastest robots need 27.
    let least = if has_wheels { 27 } else { 1 };
    let substeps = json!(least + dice.below(64 - least));
    let bodies = if has_wheels {
        json!({"substeps": substeps})
    } else {
        object(dice, [("substeps", substeps)])
    };
    let mut others =
        vec![("wall", json!({"type": "wall", "corners": [[400, 30], [500, 30], [420, 50]]}))];
    for (index, kind) in ["obstacle", "movable"].into_iter().enumerate() {
        let n = dice.die(4);
        let places: Vec<Value> = (0..n).map(|i| json!([350 + 50 * i, 350 + 60 * index])).collect();
        let mut initializers =
            json!({"positions": {"name": "fixed", "params": {"values": places}}});
        if dice.chance(0.5) {
            insert(&mut initializers, "orientations", json!({"name": "random_uniform"}));
        }
        let mut params = match dice.below(3) {
            0 => json!({}),
            1 => json!({"radius": dice.number(3.0, 15.0)}),
            _ if dice.chance(0.5) => json!({"corners": [[-9, -6], [9, -6], [9, 6], [-9, 6]]}),
            _ => json!({"corners": [[0, 8], [8, -8], [-8, -8]]}),
        };
        if kind == "movable" && dice.chance(0.5) {
            insert(&mut params, "mass", dice.number(0.1, 5.0));
            insert(&mut params, "friction", dice.number(0.0, 1.0));
        }
        let mut thing = json!({"type": kind, "num_instances": n, "initializers": initializers});
        if params != json!({}) {
            insert(&mut thing, "params", params);
        }
        others.push((kind, thing));
    }
    for (name, thing) in others {
        if dice.chance(0.6) {
            objects.insert(name.to_owned(), thing);
        }
    }
    insert(world, "bodies", bodies);
}

/// Gives a body and its sensors to a robot.
fn body(dice: &mut Dice, robot: &mut Value) {
    if dice.chance(0.3) {
        // Of the others, one is too fast and one too small for the substeps.
        let platform = dice.pick(&["e-puck2", "pogobot"]);
        insert(robot, "platform", json!(platform));
    }
    if dice.chance(0.5) {
        let [radius, mass, force] =
            [dice.number(3.0, 6.0), dice.number(0.05, 2.0), dice.number(0.1, 5.0)];
        let body = object(dice, [("radius", radius), ("mass", mass), ("push_force", force)]);
        insert(robot, "body", body);
    }
    let sensors = &mut robot["sensors"];
    for kind in ["light_sensor", "distance_sensor", "wireless_receiver"] {
        if sensors.get(kind).is_some() && dice.chance(0.5) {
            let by = dice.pick(&["nothing", "walls", "bodies"]);
            insert(&mut sensors[kind], "blocked_by", json!(by));
        }
    }
    if dice.chance(0.5) {
        let sees = match dice.below(3) {
            0 => json!("all"),
            1 => json!(dice.pick(&["robots", "walls", "objects"])),
            _ => json!(["objects", "robots"]),
        };
        let angles = if dice.chance(0.5) { json!([-0.5, 0, 0.5]) } else { json!(null) };
        let [range, sigma] = [dice.number(2.0, 50.0), dice.number(0.0, 0.1)];
        let mut sensor = object(dice, [("range", range), ("noise_sigma", sigma), ("sees", sees)]);
        if dice.chance(0.5) {
            insert(&mut sensor, "n_rays", json!(3));
            insert(&mut sensor, "angles", angles);
        }
        insert(sensors, "proximity_sensor", sensor);
    }
    if dice.chance(0.5) {
        let n_sectors = json!(dice.die(8));
        let sensor = object(dice, [("n_sectors", n_sectors)]);
        insert(sensors, "contact_sensor", sensor);
    }
}
