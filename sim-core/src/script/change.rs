//! The changes that a script may make in each of its functions.

use determinism::random::Stream;
use task_script::{Object, Value};

use super::names::Named;
use super::view::{Kind, View, number};
use crate::communication::Mode;
use crate::controllers::Action;
use crate::world::RobotGroup;

/// Largest number of a colour.
const COLORS: i64 = 255;

/// The changes that a call may make besides `state`.
pub(crate) enum May<'a> {
    /// None.
    Look,
    /// None: the function returns the robot's reading.
    Sense { robot: usize, stream: &'a mut Stream },
    /// The actions of one robot in this step.
    Act { robot: usize, plan: &'a mut Plan, stream: &'a mut Stream },
    /// None: the function returns the new place of the light or area.
    Move { thing: Object, stream: &'a mut Stream },
    /// Whether robots fail and carry something, whether lights and areas are on, and where
    /// movables are.
    React,
}

impl May<'_> {
    /// The advice in the error about any other change.
    fn advice(&self) -> &'static str {
        match self {
            Self::Look => "keep values for later in `state`, a dict",
            Self::Sense { .. } => "`sense` returns a list of numbers, and `state` is a dict",
            Self::Act { .. } => {
                "`control` sets `left`, `right`, `led`, `mode` and `message` of its own robot, and \
                 `state` is a dict"
            }
            Self::Move { .. } => "`move` returns the new place, `(x, y)`, and `state` is a dict",
            Self::React => {
                "`react` sets `failed` and `carries` of robots and `on` of lights and areas, \
                 `world.place` puts movables elsewhere, and `state` is a dict"
            }
        }
    }
}

/// A robot's planned actions in a step.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    wheels: [f64; 2],
    led: u32,
    mode: Mode,
    message: Vec<f64>,
}

impl Plan {
    /// The plan to stand still, with the LED off, and to send zeros.
    pub fn new(message_len: usize) -> Self {
        Self { wheels: [0.0; 2], led: 0, mode: Mode::Send, message: vec![0.0; message_len] }
    }

    /// Resets the plan.
    pub fn reset(&mut self) {
        *self = Self { message: std::mem::take(&mut self.message), ..Self::new(0) };
        self.message.fill(0.0);
    }

    /// Sets the robot's actions.
    pub fn carry_out(&self, action: &mut Action<'_>) {
        *action.wheels = self.wheels;
        *action.led = self.led;
        *action.mode = self.mode;
        action.message.copy_from_slice(&self.message);
    }

    /// Plans one action of a robot of `group`.
    fn set(&mut self, group: &RobotGroup, emits: bool, name: Named, value: &Value) -> Change {
        let lacks =
            |actuator: &str| Err(format!("robots of `{}` have no `{actuator}`", group.site.name));
        match name {
            Named::Left | Named::Right if group.drive.is_none() => return lacks("wheel_actuator"),
            Named::Led if !group.has_led => return lacks("led_actuator"),
            Named::Mode | Named::Message if !emits => return lacks("wireless_transmitter"),
            Named::Right => self.wheels[0] = within(-1.0, number(value)?, "the action of a wheel")?,
            Named::Left => self.wheels[1] = within(-1.0, number(value)?, "the action of a wheel")?,
            Named::Led => self.led = color(value)?,
            Named::Mode => {
                self.mode = match value.as_text() {
                    Some("send") => Mode::Send,
                    Some("relay") => Mode::Relay,
                    _ => return Err("a `mode` is \"send\" or \"relay\"".into()),
                }
            }
            _ => self.write(value)?,
        }
        Ok(())
    }

    fn write(&mut self, value: &Value) -> Change {
        let len = self.message.len();
        let expected = || format!("a `message` is a list of {len} numbers in [0, 1]");
        let Value::List(list) = value else { return Err(expected()) };
        if list.len() != len {
            return Err(format!("{}, not of {}", expected(), list.len()));
        }
        for (component, value) in self.message.iter_mut().zip(list.items()?) {
            *component = within(0.0, number(&value)?, "a component of a message")?;
        }
        Ok(())
    }
}

type Change = Result<(), String>;

/// A number in [`least`, 1].
fn within(least: f64, value: f64, what: &str) -> Result<f64, String> {
    if (least..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{what} is in [{least}, 1], not {value}; limit it with `min` and `max`"))
    }
}

fn color(value: &Value) -> Result<u32, String> {
    match value {
        Value::Bool(on) => Ok(u32::from(*on)),
        Value::Int(color) if (0..=COLORS).contains(color) => Ok(*color as u32),
        _ => Err(format!("an `led` is a bool, or a whole number from 0, off, to {COLORS}")),
    }
}

fn switch(value: &Value, name: Named) -> Result<bool, String> {
    let Value::Bool(value) = value else {
        return Err(format!(
            "`{}` is True or False, not {}",
            name.name(),
            value.kind_with_article()
        ));
    };
    Ok(*value)
}

impl View<'_> {
    /// `object.name = value`.
    pub(super) fn change(&mut self, object: Object, name: Named, value: &Value) -> Change {
        let (kind, number) = (Kind::of_object(object), object.index as usize);
        match (&mut self.may, kind, name) {
            (
                May::Act { robot, plan, .. },
                Kind::Robot,
                Named::Left | Named::Right | Named::Led | Named::Mode | Named::Message,
            ) if *robot == number => {
                let group = &self.world.groups[self.world.group_of(number)];
                let emits = self.world.antennas[number].emits_within.is_some();
                return plan.set(group, emits, name, value);
            }
            (May::React, Kind::Robot, Named::Failed) => {
                self.swarm.failed[number] = switch(value, name)?;
            }
            (May::React, Kind::Robot, Named::Carries) => {
                self.swarm.carries[number] = switch(value, name)?;
            }
            (May::React, Kind::Light, Named::On) => {
                self.switches.lights[number] = switch(value, name)?;
            }
            (May::React, Kind::Area, Named::On) => {
                self.switches.areas[number] = switch(value, name)?;
            }
            (may, ..) => {
                let (name, kind, advice) = (name.name(), kind.name(), may.advice());
                return Err(format!("`{name}` of {kind} cannot be changed here; {advice}"));
            }
        }
        Ok(())
    }
}
