//! The view of a script on a trial. The view copies nothing: an object of the world is a kind and a
//! number, and the view reads its attributes in place.

use std::f64::consts::PI;
use std::rc::Rc;

use determinism::random::Stream;
use experiment_file::suggestion;
use task_script::{Host, Meter, Name, Object, Value};

use super::change::May;
use super::names::Named;
use crate::border;
use crate::communication::Mode;
use crate::objects::{StaticObjects, Switches};
use crate::swarm::Swarm;
use crate::torus::{Vec2, wrap_angle};
use crate::trial::{Group, Interior};
use crate::world::World;

/// The only object of its kind.
pub(super) const WORLD: Value = Value::Object(Object { kind: Kind::World as u8, index: 0 });

/// Kinds of objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Kind {
    World,
    Robot,
    Light,
    Area,
    Movable,
}

impl Kind {
    pub fn of_object(object: Object) -> Self {
        match object.kind {
            1 => Self::Robot,
            2 => Self::Light,
            3 => Self::Area,
            4 => Self::Movable,
            _ => Self::World,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::World => "the world",
            Self::Robot => "a robot",
            Self::Light => "a light",
            Self::Area => "an area",
            Self::Movable => "a movable",
        }
    }
}

/// The data that a script keeps from step to step.
#[derive(Debug)]
pub(crate) struct Kept {
    stream: Stream,
    /// Lists of objects that never change.
    lists: Vec<(Named, Value)>,
    /// `state` of objects.
    states: Vec<(Object, Value)>,
}

impl Kept {
    pub fn new(stream: Stream) -> Self {
        Self { stream, lists: Vec::new(), states: Vec::new() }
    }
}

/// A step of a trial, for one call.
pub(crate) struct View<'a> {
    pub world: &'a World,
    pub swarm: &'a mut Swarm,
    pub lights: &'a mut [Vec2],
    pub areas: &'a mut [Vec2],
    pub switches: &'a mut Switches,
    /// `None` in a world without bodies.
    pub interior: Option<&'a mut Interior>,
    /// Readings of robots, group by group.
    pub groups: &'a [Group],
    /// Environment step, from 0.
    pub step: u32,
    /// Steps of the episode.
    pub n_steps: u32,
    pub may: May<'a>,
    /// Whether to continue.
    pub goes_on: &'a dyn Fn() -> bool,
    /// The caller of the script sets it.
    pub kept: Option<&'a mut Kept>,
}

pub(super) type Answer = Result<Value, String>;

impl<'a> View<'a> {
    /// The same step for another call, which may make the changes of `may`.
    pub fn again<'b>(&'b mut self, may: May<'b>) -> View<'b> {
        View {
            world: self.world,
            swarm: self.swarm,
            lights: self.lights,
            areas: self.areas,
            switches: self.switches,
            interior: self.interior.as_deref_mut(),
            groups: self.groups,
            step: self.step,
            n_steps: self.n_steps,
            may,
            goes_on: self.goes_on,
            kept: None,
        }
    }

    fn kept(&mut self) -> Result<&mut Kept, String> {
        self.kept.as_deref_mut().ok_or_else(|| "nothing is kept outside functions".into())
    }

    /// `world.state`.
    pub(super) fn world_state(&mut self, meter: &Rc<Meter>) -> Answer {
        self.state(Object { kind: Kind::World as u8, index: 0 }, meter)
    }

    fn state(&mut self, object: Object, meter: &Rc<Meter>) -> Answer {
        let kept = self.kept()?;
        match kept.states.binary_search_by_key(&(object.kind, object.index), |(object, _)| {
            (object.kind, object.index)
        }) {
            Ok(place) => Ok(kept.states[place].1.clone()),
            Err(place) => {
                let state = Value::dict(meter)?;
                kept.states.insert(place, (object, state.clone()));
                Ok(state)
            }
        }
    }

    /// A list of objects that is the same in all steps.
    fn list(&mut self, name: Named, meter: &Rc<Meter>) -> Answer {
        let (kind, numbers) = match name {
            Named::Robots => (Kind::Robot, self.world.evaluated()),
            Named::AllRobots => (Kind::Robot, 0..self.world.n_robots()),
            Named::Lights => (Kind::Light, 0..self.lights.len()),
            Named::Movables => {
                let interior = self.interior.as_deref();
                let n_movables = interior.map_or(0, |interior| interior.bodies.loads().len());
                (Kind::Movable, 0..n_movables)
            }
            _ => (Kind::Area, 0..self.areas.len()),
        };
        let kept = self.kept()?;
        if let Some((_, list)) = kept.lists.iter().find(|(known, _)| *known == name) {
            return Ok(list.clone());
        }
        let list = Value::list(numbers.map(|number| thing(kind, number)).collect(), meter)?;
        list.freeze();
        kept.lists.push((name, list.clone()));
        Ok(list)
    }

    fn position(&self, object: Object) -> Result<Vec2, String> {
        let number = object.index as usize;
        match Kind::of_object(object) {
            Kind::World => Err("the world has no position; use `world.center`".into()),
            Kind::Robot => Ok(self.swarm.positions[number]),
            Kind::Light => Ok(self.lights[number]),
            Kind::Area => Ok(self.areas[number]),
            Kind::Movable => Ok(self.pose(number)?.position),
        }
    }

    /// The position of an object, or the point `(x, y)`, in the torus.
    pub(super) fn point(&self, value: &Value) -> Result<Vec2, String> {
        match value {
            Value::Object(object) => self.position(*object),
            Value::List(list) if list.len() == 2 => {
                let coordinate = |index| list.get(index).as_ref().and_then(Value::number);
                match (coordinate(0), coordinate(1)) {
                    (Some(x), Some(y)) if x.is_finite() && y.is_finite() => {
                        Ok(self.world.torus.wrap(Vec2 { x, y }))
                    }
                    _ => Err("a point is a thing or two finite numbers, `(x, y)`".into()),
                }
            }
            _ => Err(format!("a point is a thing or `(x, y)`, not {}", value.kind_with_article())),
        }
    }

    /// The lights or areas to which an object belongs.
    pub(super) fn objects(&self, object: Object) -> Result<&'a StaticObjects, String> {
        let groups = match Kind::of_object(object) {
            Kind::Light => &self.world.lights,
            _ => &self.world.areas,
        };
        let number = object.index as usize;
        let found = groups.iter().find(|group| group.members.contains(&number));
        found.ok_or_else(|| NO_OBJECT.into())
    }

    fn of_world(&mut self, name: Named, meter: &Rc<Meter>) -> Answer {
        let torus = self.world.torus;
        match name {
            Named::Robots | Named::AllRobots | Named::Lights | Named::Areas | Named::Movables => {
                self.list(name, meter)
            }
            Named::Center => pair(torus.center(), meter),
            Named::Width => Ok(Value::Float(torus.width)),
            Named::Height => Ok(Value::Float(torus.height)),
            Named::Step => Ok(Value::Int(self.step.into())),
            Named::Steps => Ok(Value::Int(self.n_steps.into())),
            Named::Range => Ok(Value::Float(self.world.communication_range())),
            _ => Err(no_such(Kind::World, name)),
        }
    }

    fn of_robot(&mut self, robot: usize, name: Named, meter: &Rc<Meter>) -> Answer {
        let swarm = &*self.swarm;
        let floats =
            |values: &[f64]| Value::list(values.iter().copied().map(Value::Float).collect(), meter);
        Ok(match name {
            Named::Id => Value::Int(robot as i64),
            Named::Heading => Value::Float(swarm.headings[robot]),
            Named::Led => Value::Int(swarm.leds[robot].into()),
            Named::Right => Value::Float(swarm.wheels[robot][0]),
            Named::Left => Value::Float(swarm.wheels[robot][1]),
            Named::Mode => match swarm.modes[robot] {
                Mode::Send => Value::text("send", meter)?,
                Mode::Relay => Value::text("relay", meter)?,
            },
            Named::Message => floats(&swarm.messages[swarm.message_range(robot)])?,
            Named::Heard => match swarm.received[robot] {
                Some(_) => floats(&swarm.received_messages[swarm.message_range(robot)])?,
                None => Value::Nothing,
            },
            Named::HeardFrom => match &swarm.received[robot] {
                Some(received) => Value::Float(received.receiving_direction.angle()),
                None => Value::Nothing,
            },
            Named::SeesLight => Value::Bool(swarm.photosensitive[robot]),
            Named::Touches => self.touches(robot, meter)?,
            Named::Failed => Value::Bool(swarm.failed[robot]),
            Named::Carries => Value::Bool(swarm.carries[robot]),
            Named::Group => {
                let group = &self.world.groups[self.world.group_of(robot)];
                Value::text(&group.site.name, meter)?
            }
            _ => return Err(no_such(Kind::Robot, name)),
        })
    }

    /// A reading of a robot's sensors at the start of the step, zeros where it is inhibited.
    fn sense(&self, robot: usize, reading: &Value, meter: &Rc<Meter>) -> Answer {
        let Some(name) = reading.as_text() else {
            return Err(format!(
                "`sense` takes the name of a reading, such as \"light_sensor\", not {}",
                reading.kind_with_article()
            ));
        };
        let number = self.world.group_of(robot);
        let (group, Group { senses, perturbations, .. }) =
            (&self.world.groups[number], &self.groups[number]);
        let Some(&reading) = group.readings.iter().find(|(query, _)| query.name() == name) else {
            let known: Vec<&str> = group.readings.iter().map(|(query, _)| query.name()).collect();
            let (name, group) = (shortened(name), &group.site.name);
            let suggestion = suggestion(&name, &known);
            return Err(format!("robots of `{group}` have no reading `{name}`; {suggestion}"));
        };
        let index = robot - group.robots.start;
        let values = if perturbations.inhibits(index, reading.0) {
            vec![0.0; reading.1]
        } else {
            senses.reading(reading, &group.robots, index, self.swarm)
        };
        meter.work(values.len() / 4)?;
        Value::list(values.into_iter().map(Value::Float).collect(), meter)
    }

    /// The random stream of the object for which the script decides.
    fn own_stream(&mut self, object: Object) -> Result<&mut Stream, String> {
        match &mut self.may {
            May::Act { robot, stream, .. } | May::Sense { robot, stream }
                if Kind::of_object(object) == Kind::Robot && *robot == object.index as usize =>
            {
                Ok(stream)
            }
            May::Move { thing, stream } if *thing == object => Ok(stream),
            _ => {
                Err("draws for itself only in `control`, `move` or `sense`; use `world` elsewhere"
                    .into())
            }
        }
    }

    /// Robots within `range` of an object or point, except the object itself. The task counts a
    /// removed robot, but no robot senses it.
    fn neighbours(&self, of: &Value, range: f64, meter: &Rc<Meter>) -> Answer {
        meter.work(self.world.n_robots() / 4)?;
        let from = self.point(of)?;
        let torus = &self.world.torus;
        let is_sensing = matches!(self.may, May::Sense { .. } | May::Act { .. });
        let near = (0..self.world.n_robots())
            .filter(|&robot| !(is_sensing && self.swarm.is_removed(robot)))
            .filter(|&robot| torus.distance(from, self.swarm.positions[robot]) <= range);
        let near = near.map(|robot| thing(Kind::Robot, robot));
        let itself = |value: &Value| match (value, of) {
            (Value::Object(a), Value::Object(b)) => a == b,
            _ => false,
        };
        Value::list(near.filter(|value| !itself(value)).collect(), meter)
    }

    fn points(&self, list: &Value) -> Result<Vec<Vec2>, String> {
        let Value::List(list) = list else {
            return Err(format!("expected a list of things, not {}", list.kind_with_article()));
        };
        list.items()?.iter().map(|value| self.point(value)).collect()
    }

    fn call_world(&mut self, name: Named, arguments: &[Value], meter: &Rc<Meter>) -> Answer {
        let torus = self.world.torus;
        Ok(match (name, arguments) {
            (Named::Distance, [a, b]) => {
                Value::Float(torus.distance(self.point(a)?, self.point(b)?))
            }
            (Named::Way, [a, b]) => {
                pair(torus.displacement(self.point(a)?, self.point(b)?), meter)?
            }
            (Named::Angle, [x, y]) => Value::Float(Vec2 { x: number(x)?, y: number(y)? }.angle()),
            (Named::Turn, [from, to]) => {
                Value::Float(wrap_angle(number(to)? - number(from)? + PI) - PI)
            }
            (Named::Centroid, [list]) => pair(torus.centroid(&self.points(list)?), meter)?,
            (Named::Neighbours, [of, range]) => self.neighbours(of, number(range)?, meter)?,
            (Named::WallsBetween, [a, b]) => Value::Bool(self.walls_between(a, b, meter)?),
            (Named::Place, [movable, place]) => {
                Value::Bool(self.place(movable, place, None, meter)?)
            }
            (Named::Place, [movable, place, heading]) => {
                Value::Bool(self.place(movable, place, Some(heading), meter)?)
            }
            (Named::Border, []) => {
                let evaluated = self.world.evaluated();
                // The work per robot, which is the whole cost for a small swarm.
                let n = evaluated.len();
                meter.work(n * n / 16 + 30 * n)?;
                let positions = &self.swarm.positions[evaluated.clone()];
                let World { alpha, .. } = self.world;
                let range = self.world.communication_range();
                let border = border::of_swarm(&torus, positions, range, *alpha);
                let robots = evaluated.zip(border).filter(|(_, is)| *is);
                let robots = robots.map(|(robot, _)| thing(Kind::Robot, robot));
                Value::list(robots.collect(), meter)?
            }
            (Named::Random, []) => Value::Float(self.kept()?.stream.uniform()),
            (Named::Normal, []) => Value::Float(self.kept()?.stream.normal()),
            _ => return Err(wrong_call(Kind::World, name, arguments)),
        })
    }

    fn call_thing(
        &mut self,
        object: Object,
        name: Named,
        arguments: &[Value],
        meter: &Rc<Meter>,
    ) -> Answer {
        let kind = Kind::of_object(object);
        let itself = Value::Object(object);
        match (name, arguments) {
            (Named::Distance | Named::Way, [other]) => {
                let arguments = [itself, other.clone()];
                self.call_world(name, &arguments, meter)
            }
            (Named::Random, []) => Ok(Value::Float(self.own_stream(object)?.uniform())),
            (Named::Normal, []) => Ok(Value::Float(self.own_stream(object)?.normal())),
            (Named::Sense, [reading]) if kind == Kind::Robot => {
                self.sense(object.index as usize, reading, meter)
            }
            (Named::Neighbours, [range]) => self.neighbours(&itself, number(range)?, meter),
            (Named::Bearing, [other]) if kind == Kind::Robot => {
                let way = self.world.torus.displacement(self.position(object)?, self.point(other)?);
                let heading = self.swarm.headings[object.index as usize];
                Ok(Value::Float(wrap_angle(way.angle() - heading + PI) - PI))
            }
            _ => Err(wrong_call(kind, name, arguments)),
        }
    }
}

impl Host for View<'_> {
    fn goes_on(&mut self) -> bool {
        (self.goes_on)()
    }

    fn get(&mut self, object: Object, name: Name, meter: &Rc<Meter>) -> Answer {
        let kind = Kind::of_object(object);
        match (Named::numbered(name), kind) {
            (Named::State, _) => self.state(object, meter),
            (name, Kind::World) => self.of_world(name, meter),
            (Named::World, _) => Ok(WORLD),
            (Named::On, Kind::Light) => {
                Ok(Value::Bool(self.switches.lights[object.index as usize]))
            }
            (Named::On, Kind::Area) => Ok(Value::Bool(self.switches.areas[object.index as usize])),
            (Named::X, _) => Ok(Value::Float(self.position(object)?.x)),
            (Named::Y, _) => Ok(Value::Float(self.position(object)?.y)),
            (name, Kind::Robot) => self.of_robot(object.index as usize, name, meter),
            (Named::Id, _) => Ok(Value::Int(object.index.into())),
            (Named::Group, _) => Value::text(self.group(object)?, meter),
            (Named::Heading, Kind::Movable) => {
                Ok(Value::Float(self.pose(object.index as usize)?.heading))
            }
            (name, Kind::Movable) => Err(no_such(kind, name)),
            (Named::Color, _) => Value::text(&self.objects(object)?.color, meter),
            (Named::Range, _) => Ok(Value::Float(self.objects(object)?.range)),
            (name, kind) => Err(no_such(kind, name)),
        }
    }

    fn set(&mut self, object: Object, name: Name, value: Value) -> Result<(), String> {
        self.change(object, Named::numbered(name), &value)
    }

    fn call(
        &mut self,
        object: Object,
        name: Name,
        arguments: &[Value],
        meter: &Rc<Meter>,
    ) -> Answer {
        let name = Named::numbered(name);
        match Kind::of_object(object) {
            Kind::World => self.call_world(name, arguments, meter),
            _ => self.call_thing(object, name, arguments, meter),
        }
    }
}

/// The host of statements outside functions; the function tells whether to continue.
pub(super) struct Nothing<'a>(pub &'a dyn Fn() -> bool);

impl Host for Nothing<'_> {
    fn goes_on(&mut self) -> bool {
        (self.0)()
    }

    fn get(&mut self, _: Object, _: Name, _: &Rc<Meter>) -> Answer {
        Err(OUTSIDE.into())
    }

    fn set(&mut self, _: Object, _: Name, _: Value) -> Result<(), String> {
        Err(OUTSIDE.into())
    }

    fn call(&mut self, _: Object, _: Name, _: &[Value], _: &Rc<Meter>) -> Answer {
        Err(OUTSIDE.into())
    }
}

pub(super) const NO_OBJECT: &str = "there is no such object";
const OUTSIDE: &str = "there is no world outside functions";

pub(super) fn thing(kind: Kind, number: usize) -> Value {
    Value::Object(Object { kind: kind as u8, index: number as u32 })
}

fn pair(point: Vec2, meter: &Rc<Meter>) -> Answer {
    Value::tuple(vec![Value::Float(point.x), Value::Float(point.y)], meter)
}

pub(super) fn number(value: &Value) -> Result<f64, String> {
    value.number().ok_or_else(|| format!("expected a number, not {}", value.kind_with_article()))
}

fn no_such(kind: Kind, name: Named) -> String {
    format!("{} has no `{}`", kind.name(), name.name())
}

fn wrong_call(kind: Kind, name: Named, arguments: &[Value]) -> String {
    format!("{} has no `{}` of {} arguments", kind.name(), name.name(), arguments.len())
}

/// A name from the script, fit for a message.
fn shortened(name: &str) -> String {
    name.chars().take(40).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
