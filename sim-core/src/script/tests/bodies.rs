//! Scripts in worlds with bodies: what they see, and movables that they put elsewhere.

use std::f64::consts::FRAC_PI_4;

use determinism::Isa;
use experiment_file::ExperimentConfig;
use serde_json::{Value, json};

use super::acting::{controlled, failure, watch};
use super::measured;
use crate::record::MovableRecord;
use crate::simulation::Simulation;

/// A room of 200 x 200 cm with a box of 10 x 10 cm at (70, 100), a post at (150, 50) and a wall
/// from (20, 160) to (180, 160). The script controls its robots, which are given as x, y and
/// heading; without `control` they stand.
fn room(text: &str, n_steps: u32, robots: &[[f64; 3]]) -> ExperimentConfig {
    let stand = if text.contains("def control") { "" } else { STAND };
    let mut file = serde_json::to_value(controlled(&format!("{text}{stand}"), n_steps)).unwrap();
    let fixed = |values: Value| json!({"name": "fixed", "params": {"values": values}});
    let world = &mut file["world"];
    (world["width"], world["height"]) = (json!(200), json!(200));
    (world["boundary"], world["bodies"]) = (json!("walls"), json!({}));
    let objects = &mut world["objects"];
    objects["light_red"]["initializers"]["positions"] = fixed(json!([[100, 100]]));
    let robot = &mut objects["robotA"];
    robot["num_instances"] = json!(robots.len());
    robot["perturbations"] = json!({});
    let positions = robots.iter().map(|[x, y, _]| json!([x, y])).collect();
    let headings = robots.iter().map(|[_, _, heading]| json!([heading])).collect();
    robot["initializers"] = json!({"positions": fixed(positions), "orientations": fixed(headings)});
    robot["sensors"]["wireless_receiver"]["blocked_by"] = json!("bodies");
    objects["box"] = json!({
        "type": "movable", "num_instances": 1,
        "initializers": {"positions": fixed(json!([[70, 100]]))},
        "params": {"corners": [[-5, -5], [5, -5], [5, 5], [-5, 5]], "mass": 0.1, "friction": 0.1},
    });
    objects["post"] = json!({
        "type": "obstacle", "num_instances": 1,
        "initializers": {"positions": fixed(json!([[150, 50]]))}, "params": {"radius": 8},
    });
    objects["fence"] = json!({"type": "wall", "corners": [[20, 160], [180, 160]]});
    ExperimentConfig::from_json(&file.to_string(), "t", evolution::ALGORITHMS).unwrap().0
}

const STAND: &str = "\ndef control(robot):\n    return\n";

/// Robots that drive straight on.
const DRIVE: &str = "
def control(robot):
    robot.left = 1
    robot.right = 1
";

#[test]
fn a_script_sees_the_box_that_a_robot_pushes_and_what_robots_touch() {
    let text = format!(
        "{DRIVE}
def fitness(world):
    pusher, first, second = world.robots
    box = world.movables[0]
    if (box.id, box.group, len(world.movables)) != (0, 'box', 1):
        fail('names', box.id, box.group)
    if box.distance(pusher) != world.distance((pusher.x, pusher.y), (box.x, box.y)):
        fail('distance')
    near = [pusher] if box.distance(pusher) <= 20 else []
    if abs(pusher.bearing(box)) > 1e-6 or box.neighbours(20) != near:
        fail('near', pusher.bearing(box))
    if world.step == 0 and (pusher.touches or (box.x, box.y, box.heading) != (70, 100, 0)):
        fail('start', box.x, box.y, box.heading)
    if world.step > 2 and pusher.touches != [box]:
        fail('pusher', len(pusher.touches))
    box.state['most'] = max(box.x, box.state.get('most', 0))
    if world.step > 2 and (first.touches != [second, None] or second.touches != [first]):
        fail('queue', len(first.touches), len(second.touches))
    return box.state['most']
"
    );
    let pi = std::f64::consts::PI;
    let robots = [[50.0, 100.0, 0.0], [10.0, 20.0, pi], [20.0, 20.0, pi]];
    let steps = watch(&room(&text, 40, &robots));
    let way: Vec<f64> = steps.iter().map(|step| step.fitness.unwrap()).collect();
    assert_eq!(way[0], 70.0);
    // The box stops at the wall.
    assert!(way[3] > 75.0 && (way[39] - 195.0).abs() < 0.01, "{way:?}");
}

#[test]
fn react_puts_a_movable_where_it_is_free_at_once_and_at_rest() {
    let text = format!(
        "{DRIVE}
PLACES = [
    ((100, 100), True),
    ((100.5, 100), True),                    # where it overlaps only itself
    ((194.9, 100), True),
    ((195.1, 100), False),                   # in the boundary
    ((300, 100), False), ((-1e300, 50), False), ((100, 1e9), False),
    ((150, 50), False), ((150, 62), False),  # in the post
    ((150, 64), True),
    ((100, 163), False),                     # in the wall
    ((100, 180), True),
]
def react(world):
    robot, box = world.robots[0], world.movables[0]
    if world.step != 5:
        return
    if robot.touches != [box]:
        fail('pushes')
    for place, is_free in PLACES:
        before = (box.x, box.y)
        if world.place(box, place) != is_free or (box.x, box.y) != (place if is_free else before):
            fail('put', place[0], place[1], box.x, box.y)
    if world.place(box, robot) or world.place(box, world.robots[1]):
        fail('on a robot')
    if box.heading > 0.01 or robot.touches:
        fail('not moved', box.heading)
    # A diamond needs more room than a square.
    if world.place(box, (100, 165.5), math.pi / 4) or not world.place(box, (100, 165.5)):
        fail('diamond')
    if not world.place(box, (100, 180), math.pi / 4 - 2 * math.pi) or abs(box.heading - math.pi / 4) > 1e-9:
        fail('turn', box.heading)
def fitness(world):
    box = world.movables[0]
    if world.step >= 5 and (box.x, box.y) != (100, 180):
        fail('not at rest', box.x, box.y)
    return world.robots[0].x
"
    );
    let config = room(&text, 30, &[[50.0, 100.0, 0.0], [50.0, 30.0, 0.0]]);
    let steps = watch(&config);
    let MovableRecord { position, heading } = steps[29].movables[0];
    assert_eq!((position.x, position.y), (100.0, 180.0));
    assert!((heading - FRAC_PI_4).abs() < 1e-9, "{heading}");
    // Nothing is in the robot's way any more.
    assert!((steps[29].fitness.unwrap() - 196.5).abs() < 0.01, "{:?}", steps[29].fitness);
    let simulation = Simulation::compile(&config).unwrap();
    let values = measured(&simulation);
    for isa in Isa::available() {
        assert_eq!(measured(&simulation.clone().with_isa(isa)), values, "{isa:?}");
    }
}

#[test]
fn robots_do_not_hear_each_other_through_a_box_that_was_put_between_them() {
    let text = "
def control(robot):
    robot.message = [1, 1]
def react(world):
    if world.step == 3 and not world.place(world.movables[0], (120, 100)):
        fail('not free')
def fitness(world):
    return len([robot for robot in world.robots if robot.heard])
";
    let config = room(text, 9, &[[100.0, 100.0, 0.0], [140.0, 100.0, 0.0]]);
    let heard: Vec<f64> = watch(&config).iter().map(|step| step.fitness.unwrap()).collect();
    assert_eq!((&heard[1..4], &heard[4..]), (&[2.0; 3][..], &[0.0; 5][..]));
}

#[test]
fn walls_and_obstacles_are_between_places_and_movables_are_not() {
    let text = "
def fitness(world):
    a, b = world.robots
    box = world.movables[0]
    for start, end, expected in [
        (a, b, True), (b, a, True), (a, box, False), ((5, 150), (5, 170), False),
        ((60, 100), (80, 100), False), ((140, 50), (160, 50), True), ((150, 30), (150, 40), False),
        (a, a, False), (a, (-10, 100), True),
    ]:
        if world.walls_between(start, end) != expected:
            fail('between', expected)
    return 1
";
    watch(&room(text, 2, &[[100.0, 100.0, 0.0], [100.0, 180.0, 0.0]]));
}

#[test]
fn scripts_for_worlds_with_bodies_run_without_them() {
    let text = "
def control(robot):
    robot.left = 0 if robot.touches else 1
def react(world):
    for box in world.movables:
        world.place(box, world.center)
def fitness(world):
    a, b = world.robots[0], world.robots[1]
    if world.movables != [] or a.touches != [] or world.walls_between(a, b):
        fail('bodies')
    return a.left
";
    assert_eq!(watch(&controlled(text, 3))[2].fitness, Some(1.0));
}

#[test]
fn what_goes_wrong_says_where_and_why() {
    let fitness = "def fitness(world):\n    return 1\n";
    let put = "t.star:2: `place` puts movables elsewhere, not ";
    for (body, reason) in [
        ("world.place(world.robots[0], (1, 1))", &*format!("{put}a robot")),
        ("world.place(world, (1, 1))", &format!("{put}the world")),
        ("world.place((1, 1), (1, 1))", &format!("{put}a tuple")),
        ("world.place(world.movables[0], 1)", "a point is a thing or `(x, y)`, not an int"),
        ("world.place(world.movables[0], (0 * math.inf, 1))", "two finite numbers"),
        (
            "world.place(world.movables[0], (1, 1), math.inf)",
            "a heading is a finite number, not inf",
        ),
        ("world.place(world.movables[0])", "the world has no `place` of 1 arguments"),
        ("world.movables[0].x = 3", "`x` of a movable cannot be changed here; `react` sets"),
        ("world.movables[0].on", "a movable has no `on`"),
        ("world.movables[0].range", "a movable has no `range`"),
        ("world.movables[0].touches", "a movable has no `touches`"),
        ("world.walls_between(world.robots[0])", "no `walls_between` of 1 arguments"),
        ("world.movables.append(1)", "t.star:2: "),
        (
            "[0 for i in range(999) for j in range(999) if world.place(world.movables[0], (1, 1))]",
            "does too much",
        ),
    ] {
        let text = format!("def react(world):\n    {body}\n{fitness}");
        let error = failure(&room(&text, 3, &[[100.0, 100.0, 0.0]]));
        assert!(error.starts_with("t.star:2: ") && error.contains(reason), "{body}: {error}");
    }
    let text = "def fitness(world):\n    world.place(world.movables[0], (30, 30))";
    let error = failure(&room(text, 3, &[[100.0, 100.0, 0.0]]));
    assert!(error.contains("t.star:2: only `react` puts movables elsewhere"), "{error}");
}
