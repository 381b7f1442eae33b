//! Bodies: their keys and their defaults, and the answers to worlds that make no sense.

use super::{BASE, accept, edited, read, refuse};
use experiment_file::{
    BlockedBy, BodiesConfig, BodyConfig, Boundary, ExperimentConfig, Initializer, MovableConfig,
    ObjectConfig, ObstacleConfig, Sees, Shape,
};

/// [`BASE`] with walls around it and bodies in it, in the same lines.
fn arena() -> String {
    edited("\"world\": {\n", "\"world\": {\"boundary\": \"walls\", \"bodies\": {},\n")
}

/// The arena with passages replaced.
fn arena_with(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(arena(), |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from:?} must occur once");
        text.replace(from, to)
    })
}

/// An edit that adds an object, in the line of the lamp.
fn thing(object: &str) -> (&'static str, String) {
    ("\"lamp\": {", format!("\"thing\": {object}, \"lamp\": {{"))
}

fn arena_and(object: &str) -> String {
    let (from, to) = thing(object);
    arena_with(&[(from, &to)])
}

fn obstacle(params: &str) -> String {
    format!(
        r#"{{"type": "obstacle", "num_instances": 1, "initializers": {{"positions":
        {{"name": "fixed", "params": {{"values": [[100, 100]]}}}}}}, "params": {params}}}"#
    )
    .replace('\n', " ")
}

fn movable(params: &str) -> String {
    obstacle(params).replace("obstacle", "movable")
}

fn bots(config: &ExperimentConfig) -> &experiment_file::RobotConfig {
    config.robots().next().unwrap().1
}

/// Reads a text, and its canonical form to the same.
fn accept_twice(text: &str) -> ExperimentConfig {
    let config = accept(text);
    let canonical = config.to_canonical_json();
    assert_eq!(accept(&canonical), config);
    assert_eq!(accept(&canonical).to_canonical_json(), canonical);
    config
}

#[test]
fn a_world_without_bodies_is_a_torus_of_points_and_says_nothing_of_them() {
    let config = accept(BASE);
    assert_eq!((&config.world.boundary, config.world.bodies), (&Boundary::Torus, None));
    assert_eq!((config.world.outline(), bots(&config).body), (None, None));
    let canonical = config.to_canonical_json();
    for key in ["boundary", "bodies", "body", "blocked_by", "proximity", "contact"] {
        assert!(!canonical.contains(&format!("\"{key}")), "{key}");
    }
    for (from, to) in [
        ("\"world\": {\n", "\"world\": {\"boundary\": \"torus\",\n"),
        ("\"light_sensor\": {}", "\"light_sensor\": {\"blocked_by\": \"nothing\"}"),
        ("\"wireless_receiver\": {}", "\"wireless_receiver\": {\"blocked_by\": \"nothing\"}"),
    ] {
        assert_eq!(accept(&edited(from, to)).to_canonical_json(), canonical);
    }
}

#[test]
fn with_bodies_every_robot_has_one() {
    let config = accept_twice(&arena());
    assert_eq!(config.world.boundary, Boundary::Walls);
    assert_eq!(config.world.bodies, Some(BodiesConfig { substeps: 4, format: 1 }));
    let body = BodyConfig { radius: 3.5, mass: 0.15, push_force: 0.5 };
    assert_eq!(bots(&config).body, Some(body));
    let square = [[0.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0], [0.0, 1000.0]];
    assert_eq!(config.world.outline().as_deref(), Some(&square[..]));
    let canonical = config.to_canonical_json();
    assert!(
        canonical.contains(r#""boundary":"walls","bodies":{"substeps":4,"format":1},"objects""#)
    );
    assert!(canonical.contains(r#""body":{"radius":3.5,"mass":0.15,"push_force":0.5}"#));
    let stated =
        arena_with(&[("\"sensors\": {\"wire", "\"body\": {\"mass\": 0.15}, \"sensors\": {\"wire")]);
    assert_eq!(accept(&stated).to_canonical_json(), canonical);
}

#[test]
fn a_boundary_may_be_a_polygon_in_either_order() {
    let corners = [[0.0, 0.0], [1000.0, 0.0], [1000.0, 1000.0]];
    for order in ["[[0, 0], [1000, 0], [1000, 1000]]", "[[1000, 1000], [1000, 0], [0, 0]]"] {
        let position =
            ("\"random_graph\"", "\"random_graph\", \"params\": {\"initial_pos\": [600, 300]}");
        let text =
            arena_with(&[("\"boundary\": \"walls\"", &format!("\"boundary\": {order}")), position]);
        assert_eq!(accept_twice(&text).world.outline().as_deref(), Some(&corners[..]));
    }
}

#[test]
fn obstacles_and_movables_are_discs_or_polygons() {
    let object = |text: &str| accept_twice(&arena_and(text)).world.objects["thing"].clone();
    let obstacle_of = |params: &str| match object(&obstacle(params)) {
        ObjectConfig::Obstacle(obstacle) => obstacle,
        other => panic!("{other:?}"),
    };
    let ObstacleConfig { num_instances, initializers, params } = obstacle_of("{}");
    assert_eq!((num_instances, params.shape()), (1, Shape::Disc(10.0)));
    assert_eq!(initializers.orientations, Initializer::Fixed { values: vec![vec![0.0]] });
    assert_eq!(obstacle_of(r#"{"radius": 2}"#).params.shape(), Shape::Disc(2.0));
    let clockwise = obstacle_of(r#"{"corners": [[0, 9], [5, 0], [0, 0]]}"#).params.shape();
    assert_eq!(clockwise, Shape::Polygon(vec![[0.0, 0.0], [5.0, 0.0], [0.0, 9.0]]));
    let movable_of = |params: &str| match object(&movable(params)) {
        ObjectConfig::Movable(movable) => movable,
        other => panic!("{other:?}"),
    };
    let MovableConfig { params, .. } = movable_of("{}");
    assert_eq!((params.shape(), params.mass, params.friction), (Shape::Disc(10.0), 0.5, 0.3));
    let ObjectConfig::Wall(wall) = object(r#"{"type": "wall", "corners": [[1, 2], [3, 4]]}"#)
    else {
        panic!()
    };
    assert_eq!(wall.corners, [[1.0, 2.0], [3.0, 4.0]]);
}

#[test]
fn sensors_of_bodies_have_their_readings_and_what_they_see() {
    let sensors = |sensors: &str| {
        let text = arena_with(&[("\"light_sensor\": {}", &format!("\"light_sensor\": {sensors}"))]);
        bots(&accept_twice(&text)).sensors.clone()
    };
    let mounted =
        sensors(r#"{"blocked_by": "walls"}, "contact_sensor": {}, "proximity_sensor": {}"#);
    assert_eq!(mounted.light_sensor.unwrap().blocked_by, BlockedBy::Walls);
    let distance = |config: &str| sensors(&format!(r#"{{}}, "distance_sensor": {config}"#));
    let blocked_by = |config: &str| distance(config).distance_sensor.unwrap().blocked_by;
    assert_eq!(blocked_by(r#"{"blocked_by": "bodies"}"#), BlockedBy::Bodies);
    assert_eq!(blocked_by("{}"), BlockedBy::Nothing);
    assert_eq!(mounted.contact_sensor.unwrap().n_sectors, 4);
    let proximity = mounted.proximity_sensor.unwrap();
    assert_eq!((proximity.n_rays, proximity.range, proximity.angles), (8, 10.0, None));
    let [all, robots] = [[true; 3], [true, false, false]].map(|[robots, walls, objects]| Sees {
        robots,
        walls,
        objects,
    });
    for (sees, expected) in [
        (r#""all""#, all),
        (r#"["objects", "walls", "robots"]"#, all),
        (r#""robots""#, robots),
        (r#"["robots"]"#, robots),
        (r#"["robots", "all"]"#, all),
        (r#"["objects", "robots"]"#, Sees { objects: true, ..robots }),
    ] {
        let mounted = sensors(&format!(r#"{{}}, "proximity_sensor": {{"sees": {sees}}}"#));
        assert_eq!(mounted.proximity_sensor.unwrap().sees, expected, "{sees}");
    }
}

#[test]
fn everything_that_needs_bodies_says_so() {
    let text = BASE
        .replace("\"world\": {\n", "\"world\": {\"boundary\": \"walls\",\n")
        .replace("\"wireless_receiver\": {}", "\"wireless_receiver\": {\"blocked_by\": \"walls\"}")
        .replace(
            "\"light_sensor\": {}",
            r#""light_sensor": {"blocked_by": "bodies"}, "distance_sensor": {"blocked_by": "walls"},
            "proximity_sensor": {}, "contact_sensor": {}"#.replace('\n', " ").as_str(),
        )
        .replace("\"actuators\": {", "\"body\": {}, \"actuators\": {")
        .replace(
            "\"lamp\": {",
            &format!(
                r#""wall": {{"type": "wall", "corners": [[1, 1], [2, 2]]}}, "stone": {}, "box": {}, "lamp": {{"#,
                obstacle("{}"),
                movable("{}")
            ),
        );
    let problems = refuse(&text);
    let places: Vec<&str> = problems
        .lines()
        .map(|line| {
            let place =
                line.strip_suffix(": needs `world.bodies`, without which robots are points");
            place.unwrap_or_else(|| panic!("{line}"))
        })
        .collect();
    assert_eq!(
        places,
        [
            "line 49: world.boundary",
            "line 55: world.objects.bots.sensors.wireless_receiver.blocked_by",
            "line 55: world.objects.bots.sensors.light_sensor.blocked_by",
            "line 55: world.objects.bots.sensors.distance_sensor.blocked_by",
            "line 55: world.objects.bots.sensors.proximity_sensor",
            "line 55: world.objects.bots.sensors.contact_sensor",
            "line 56: world.objects.bots.body",
            "line 60: world.objects.wall.type",
            "line 60: world.objects.stone.type",
            "line 60: world.objects.box.type",
        ]
    );
}

#[test]
fn one_mistake_has_one_answer() {
    let mut differ = Vec::new();
    for (from, to, expected) in MISTAKES {
        let problems = refuse(&arena_with(&[(from, to)]));
        if problems != *expected {
            differ.push(format!("{to}\n  {problems}\n  {expected}"));
        }
    }
    for (object, expected) in THINGS {
        let object = object
            .replace("OBSTACLE", r#""type": "obstacle", "num_instances": 1"#)
            .replace("MOVABLE", r#""type": "movable", "num_instances": 1"#)
            .replace("AT", r#""initializers": {"positions": {"name": "fixed", "params": {"values": [[100, 100]]}}}"#);
        let problems = refuse(&arena_and(&object));
        let expected = format!("line 60: world.objects.thing{expected}");
        if problems != expected {
            differ.push(format!("{object}\n  {problems}\n  {expected}"));
        }
    }
    assert!(differ.is_empty(), "{}", differ.join("\n"));
}

const WALLS: &str = r#""boundary": "walls""#;
const BODIES: &str = r#""bodies": {}"#;
const ACTUATORS: &str = r#""actuators": {"#;
const LIGHT: &str = r#""light_sensor": {}"#;
const START: &str = r#"{"name": "random_graph"}"#;

/// Edits of the arena, each with the exact message that it gets.
#[rustfmt::skip]
const MISTAKES: &[(&str, &str, &str)] = &[
    // Which keys need which.
    (WALLS, r#""boundary": "torus""#,
     "line 49: world.bodies: needs walls, but `world.boundary` is `torus`; make it `walls` or a list of corners"),
    (r#""bodies": {},"#, "",
     "line 49: world.boundary: needs `world.bodies`, without which robots are points"),
    (r#""perturbations": {"#, r#""perturbations": {"topology_switch": {}, "#,
     "line 58: world.objects.bots.perturbations.topology_switch: draws positions anew, where bodies may stand already; remove `topology_switch` or `world.bodies`"),
    // Boundary.
    (WALLS, r#""boundary": "wall""#,
     "line 49: world.boundary: unknown name `wall`; did you mean `walls`?"),
    (WALLS, r#""boundary": 1"#,
     "line 49: world.boundary: expected a string, found a number"),
    (WALLS, r#""boundary": [[0, 0], [9, 9]]"#,
     "line 49: world.boundary: expected a list of 3 to 64 elements, found 2"),
    (WALLS, r#""boundary": [[0, 0], [1000, 0, 5], [1000, 1000]]"#,
     "line 49: world.boundary[1]: expected a list of 2 elements, found 3"),
    (WALLS, r#""boundary": [[0, 0], [1000, 1000], [1000, 0], [0, 1000]]"#,
     "line 49: world.boundary[0]: the edge that begins here crosses the one that begins at [2]"),
    (WALLS, r#""boundary": [[0, 0], [2000, 0], [1000, 1000], [-1, 1000]]"#,
     "line 49: world.boundary[1]: [2000, 0] is outside the world, which is 1000 by 1000 cm\n\
      line 49: world.boundary[3]: [-1, 1000] is outside the world, which is 1000 by 1000 cm"),
    (WALLS, r#""boundary": [[0, 0], [1000, 0], [500, 0.001]]"#,
     "line 49: world.boundary[2]: is less than 0.01 cm from the edge that begins at [0]"),
    (WALLS, r#""boundary": [[0, 0], [1000, 0], [1000, 0], [1000, 1000]]"#,
     "line 49: world.boundary[1]: the next corner is less than 0.01 cm from here"),
    // Bodies.
    (BODIES, r#""bodies": true"#,
     "line 49: world.bodies: expected an object, found true or false"),
    (BODIES, r#""bodies": null"#,
     "line 49: world.bodies: expected an object, found null"),
    (BODIES, r#""bodies": {"substeps": 0}"#,
     "line 49: world.bodies.substeps: must be between 1 and 64, is 0"),
    (BODIES, r#""bodies": {"substep": 4}"#,
     "line 49: world.bodies.substep: unknown key; did you mean `substeps`?"),
    (ACTUATORS, r#""body": {"radius": 0, "mass": 1e-9, "push_force": -1}, "actuators": {"#,
     "line 56: world.objects.bots.body.radius: must be between 0.1 and 10000, is 0\n\
      line 56: world.objects.bots.body.mass: must be between 0.001 and 1000, is 1e-9\n\
      line 56: world.objects.bots.body.push_force: must be between 0.001 and 10000, is -1"),
    (ACTUATORS, r#""body": {"radius": 1e999}, "actuators": {"#,
     "line 56: world.objects.bots.body.radius: must be between 0.1 and 10000, is 1e999"),
    (ACTUATORS, r#""body": {"radius": 600}, "actuators": {"#,
     "line 56: world.objects.bots.body.radius: a disc of radius 600 cm does not fit between the walls of `world.boundary`"),
    // Speed.
    (r#""wheel_actuator": {}"#, r#""wheel_actuator": {"max_speed": 100}"#,
     "line 49: world.bodies: robot `bots` drives up to 8.25 cm in a substep, more than half of 3.5 cm, the radius of its body; set `world.bodies.substeps` to 19 or more"),
    (r#""wheel_actuator": {}"#, r#""wheel_actuator": {"max_speed": 1e6}"#,
     "line 49: world.bodies: robot `bots` drives up to 82500 cm in a substep, more than half of 3.5 cm, the radius of its body; not even 64 substeps are enough, so make `max_speed` or `step_duration` smaller"),
    // Starts.
    (START, r#"{"name": "fixed", "params": {"values": [[5, 5], [1500, 5], [5, 9], [-1, 5]]}}"#,
     "line 57: world.objects.bots.initializers.positions.params.values[1]: [1500, 5] is outside the walls of `world.boundary`\n\
      line 57: world.objects.bots.initializers.positions.params.values[3]: [-1, 5] is outside the walls of `world.boundary`"),
    (START, r#"{"name": "random_uniform", "params": {"low": 1100, "high": 1200}}"#,
     "line 57: world.objects.bots.initializers.positions.params.low: every place from 1100 to 1200 is outside the walls of `world.boundary`"),
    (START, r#"{"name": "random_circumference", "params": {"radius": 5000}}"#,
     "line 57: world.objects.bots.initializers.positions.params.radius: the circle of 5000 cm around [500, 500] is outside the walls of `world.boundary`"),
    (START, r#"{"name": "random_graph", "params": {"initial_pos": [-5, 3]}}"#,
     "line 57: world.objects.bots.initializers.positions.params.initial_pos: [-5, 3] is outside the walls of `world.boundary`"),
    // Sensors.
    (LIGHT, r#""light_sensor": {"blocked_by": "glass"}"#,
     "line 55: world.objects.bots.sensors.light_sensor.blocked_by: unknown name `glass`; known: `nothing`, `walls`, `bodies`"),
    (LIGHT, r#""light_sensor": {}, "proximity_sensor": {"n_rays": 3, "angles": [0, 1]}"#,
     "line 55: world.objects.bots.sensors.proximity_sensor.angles: has 2 angles, but `n_rays` is 3"),
    (LIGHT, r#""light_sensor": {}, "proximity_sensor": {"sees": "robot"}"#,
     "line 55: world.objects.bots.sensors.proximity_sensor.sees: unknown name `robot`; did you mean `robots`?"),
    (LIGHT, r#""light_sensor": {}, "proximity_sensor": {"sees": ["robots", "walls", "robots"]}"#,
     "line 55: world.objects.bots.sensors.proximity_sensor.sees[2]: names `robots` twice"),
    (LIGHT, r#""light_sensor": {}, "proximity_sensor": {"sees": []}"#,
     "line 55: world.objects.bots.sensors.proximity_sensor.sees: expected a list of 1 to 4 elements, found 0"),
];

/// Objects added to the arena, each with the end of the message that it gets.
#[rustfmt::skip]
const THINGS: &[(&str, &str)] = &[
    (r#"{"type": "wall", "corners": [[1, 1]]}"#,
     ".corners: expected a list of 2 to 64 elements, found 1"),
    (r#"{"type": "wall"}"#,
     ": missing key `corners`"),
    (r#"{"type": "wall", "corners": [[1, 1], [2, 2], [2, 2]]}"#,
     ".corners[1]: the next corner is less than 0.01 cm from here"),
    (r#"{"type": "wall", "corners": [[1, 1], [2, 2000]]}"#,
     ".corners[1]: [2, 2000] is outside the world, which is 1000 by 1000 cm"),
    (r#"{"type": "wall", "corners": [[1, 1], [2, 2]], "num_instances": 1}"#,
     ".num_instances: unknown key; known: `type`, `corners`"),
    (r#"{OBSTACLE, AT, "params": {"radius": 1e-9}}"#,
     ".params.radius: must be between 0.1 and 10000, is 1e-9"),
    (r#"{OBSTACLE, AT, "params": {"radius": 700}}"#,
     ".params.radius: a disc of radius 700 cm does not fit between the walls of `world.boundary`"),
    (r#"{OBSTACLE, AT, "params": {"radius": 5, "corners": [[0, 0], [9, 0], [0, 9]]}}"#,
     ".params.corners: `radius` states the same quantity"),
    (r#"{OBSTACLE, AT, "params": {"corners": [[0, 0], [9, 9], [9, 0], [0, 9]]}}"#,
     ".params.corners[0]: the edge that begins here crosses the one that begins at [2]"),
    (r#"{OBSTACLE, AT, "params": {"corners": [[0, 0], [9, 0], [5000, 9]]}}"#,
     ".params.corners[2]: [5000, 9] is farther from the object's position than the world is long"),
    (r#"{OBSTACLE, AT, "params": {"mass": 1}}"#,
     ".params.mass: unknown key; known: `radius`, `corners`"),
    (r#"{OBSTACLE, AT, "controller": null}"#,
     ".controller: unknown key; known: `type`, `num_instances`, `initializers`, `params`"),
    (r#"{OBSTACLE, "initializers": {"positions": {"name": "fixed", "params": {"values": [[100, -1]]}}}}"#,
     ".initializers.positions.params.values[0]: [100, -1] is outside the walls of `world.boundary`"),
    (r#"{MOVABLE, AT, "params": {"corners": [[0, 0], [4, 0], [4, 4], [2, 4], [2, 2], [0, 2]]}}"#,
     ".params.corners[4]: the polygon turns inwards here, but a movable has to be convex"),
    (r#"{MOVABLE, AT, "params": {"corners": [[0, 0], [1, 0], [2, 0]]}}"#,
     ".params.corners[1]: is less than 0.01 cm from the edge that begins at [2]"),
    (r#"{MOVABLE, AT, "params": {"mass": 0, "friction": -0.1}}"#,
     ".params.mass: must be between 0.001 and 1000, is 0\nline 60: world.objects.thing.params.friction: must be between 0 and 10, is -0.1"),
];

#[test]
fn small_movables_need_more_substeps() {
    let text = arena_and(&movable(r#"{"radius": 1}"#));
    assert_eq!(
        refuse(&text),
        "line 49: world.bodies: robot `bots` drives up to 0.825 cm in a substep, more than half of \
         1 cm, the inner radius of `thing`; set `world.bodies.substeps` to 7 or more"
    );
    let bar = arena_and(&movable(r#"{"corners": [[-20, -1], [20, -1], [20, 1], [-20, 1]]}"#));
    assert_eq!(refuse(&bar), refuse(&text));
    accept(&bar.replace(BODIES, r#""bodies": {"substeps": 7}"#));
    refuse(&bar.replace(BODIES, r#""bodies": {"substeps": 6}"#));
}

#[test]
fn ten_thousand_corners_and_numbers_that_are_none_are_refused() {
    let corners: Vec<String> = (0..10_000).map(|i| format!("[{}, {}]", i % 100, i / 100)).collect();
    let corners = format!("[{}]", corners.join(", "));
    for text in [
        arena_with(&[(WALLS, &format!("\"boundary\": {corners}"))]),
        arena_and(&obstacle(&format!("{{\"corners\": {corners}}}"))),
        arena_and(&movable(&format!("{{\"corners\": {corners}}}"))),
        arena_and(&format!("{{\"type\": \"wall\", \"corners\": {corners}}}")),
    ] {
        let problems = refuse(&text);
        assert!(problems.ends_with("elements, found 10000"), "{problems}");
        assert_eq!(problems.lines().count(), 1, "{problems}");
    }
    for number in ["NaN", "Infinity", "-1e999"] {
        refuse(&arena_and(&obstacle(&format!("{{\"radius\": {number}}}"))));
        refuse(&arena_with(&[(WALLS, &format!("\"boundary\": [[0, 0], [9, {number}], [9, 9]]"))]));
    }
}

#[test]
fn all_mistakes_of_a_world_are_reported_at_once() {
    let (from, to) = thing(&movable(r#"{"corners": [[0, 0], [9, 9], [9, 0], [0, 9]]}"#));
    let text = arena_with(&[
        (WALLS, r#""boundary": [[0, 0], [1000, 0], [1000, 1000], [0, 1001]]"#),
        ("\"perturbations\": {", "\"perturbations\": {\"topology_switch\": {}, "),
        ("\"wheel_actuator\": {}", "\"wheel_actuator\": {\"max_speed\": 100}"),
        (LIGHT, r#""light_sensor": {}, "proximity_sensor": {"angles": [0]}"#),
        (from, &to),
    ]);
    let problems = refuse(&text);
    for place in [
        "line 49: world.boundary[3]:",
        "line 49: world.bodies:",
        "line 55: world.objects.bots.sensors.proximity_sensor.angles:",
        "line 58: world.objects.bots.perturbations.topology_switch:",
        "line 60: world.objects.thing.params.corners[0]:",
    ] {
        assert!(problems.contains(place), "{place}\n{problems}");
    }
    assert_eq!(problems.lines().count(), 5, "{problems}");
}

#[test]
fn lights_and_ground_areas_may_be_anywhere() {
    accept(&arena_with(&[("\"values\": [[500, 500]]", "\"values\": [[5000, -500]]")]));
}

#[test]
fn what_a_world_with_bodies_costs_is_limited() {
    let many = obstacle("{}").replace("\"num_instances\": 1", "\"num_instances\": 1000");
    accept(&arena_and(&many));
    let wall = r#"{"type": "wall", "corners": [[1, 1], [2, 2]]}"#;
    let problems = refuse(&arena_and(&format!("{many}, \"wall\": {wall}")));
    assert_eq!(
        problems,
        "line 50: world.objects: 1001 walls, obstacles and movables are more than the limit of 1000"
    );
    // 1,000 robots, 4 substeps and 64,000 edges are 258 million operations per step.
    let corner = |i: u32| {
        let angle = f64::from(i) * std::f64::consts::TAU / 64.0;
        format!("[{}, {}]", 10.0 * libm::cos(angle), 10.0 * libm::sin(angle))
    };
    let corners: Vec<String> = (0..64).map(corner).collect();
    let params = format!("{{\"corners\": [{}]}}", corners.join(", "));
    let many = many.replace("\"params\": {}", &format!("\"params\": {params}"));
    let text = arena_and(&many)
        .replace("\"num_instances\": 4", "\"num_instances\": 1000")
        .replace("\"evaluation_steps\": 200", "\"evaluation_steps\": 20000");
    let problems = refuse(&text);
    assert!(problems.contains("operations per episode are more than the limit"), "{problems}");
}

#[test]
fn values_that_may_be_in_another_unit_get_a_warning() {
    let (from, to) = thing(&movable(r#"{"mass": 500}"#));
    let text = arena_with(&[
        (ACTUATORS, r#""body": {"radius": 70, "mass": 150, "push_force": 500}, "actuators": {"#),
        (
            LIGHT,
            r#""light_sensor": {}, "proximity_sensor": {"n_rays": 1, "angles": [45], "range": 0.1}"#,
        ),
        (from, &to),
    ]);
    let (_, warnings) = read(&text).unwrap();
    let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    for warning in [
        "line 55: world.objects.bots.sensors.proximity_sensor.angles[0]: 45 is more than a full turn, 6.2832; degrees instead of radians?",
        "line 55: world.objects.bots.sensors.proximity_sensor.range: 0.1 cm is less than a robot; m instead of cm?",
        "line 56: world.objects.bots.body.radius: 70 cm is more than such robots have; mm instead of cm?",
        "line 56: world.objects.bots.body.mass: 150 kg; g instead of kg?",
        "line 56: world.objects.bots.body.push_force: 500 N is more than such robots push with; mN instead of N?",
        "line 60: world.objects.thing.params.mass: 500 kg; g instead of kg?",
    ] {
        assert!(warnings.iter().any(|known| known == warning), "{warning}\n{warnings:#?}");
    }
}
