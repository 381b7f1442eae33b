//! Changes in the middle of an episode, by somebody who watches it.

use crate::bodies::Room;
use crate::torus::Vec2;
use crate::world::World;

/// Most interventions in an episode.
pub const INTERVENTIONS_MAX: usize = 1000;

/// A change of one thing, at the start of a step of an episode. Evolution has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intervention {
    /// The environment step before which it happens, from 0.
    pub step: u32,
    /// The thing that changes.
    pub thing: Thing,
    /// What happens to it. All but [`Act::Place`] last until the end of the episode.
    pub act: Act,
}

/// A thing in a world. Each kind has numbers of its own, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thing {
    /// A robot, by its number among all robots.
    Robot(usize),
    /// A light.
    Light(usize),
    /// A ground area.
    Area(usize),
    /// A movable of a world with bodies.
    Movable(usize),
}

/// What happens to a thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Act {
    /// A light or an area goes out, so no sensor sees it. A robot fails for good: it stands still,
    /// its LED is off, it hears nothing, no robot hears it or senses it, and nothing meets its
    /// body. In a script's `sense` and `control`, it is nobody's neighbour. The task still counts
    /// it where it was.
    Remove,
    /// A robot stands still, whatever its controller decides, and a light stays where it is,
    /// whatever moves it.
    Freeze,
    /// A robot's transmitter emits nothing.
    Mute,
    /// A robot's receiver hears nothing.
    Deafen,
    /// The thing is put elsewhere: to this place, cm.
    Place(Vec2),
}

/// Why interventions do not fit an experiment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}", problems.join("\n"))]
pub struct InterventionError {
    /// One line per problem.
    pub problems: Vec<String>,
}

impl Thing {
    /// Its kind, for people.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Robot(_) => "robot",
            Self::Light(_) => "light",
            Self::Area(_) => "area",
            Self::Movable(_) => "movable",
        }
    }

    /// Its number.
    pub fn number(self) -> usize {
        match self {
            Self::Robot(number)
            | Self::Light(number)
            | Self::Area(number)
            | Self::Movable(number) => number,
        }
    }

    /// Number of things of its kind.
    fn n_of_kind(self, world: &World) -> usize {
        match self {
            Self::Robot(_) => world.n_robots(),
            Self::Light(_) => world.n_lights(),
            Self::Area(_) => world.n_areas(),
            Self::Movable(_) => world.room.as_ref().map_or(0, Room::n_movables),
        }
    }
}

impl Act {
    /// Its name, for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Remove => "remove",
            Self::Freeze => "freeze",
            Self::Mute => "mute",
            Self::Deafen => "deafen",
            Self::Place(_) => "place",
        }
    }

    /// Whether it can happen to a thing of this kind.
    fn suits(self, thing: Thing) -> bool {
        match self {
            Self::Place(_) => true,
            Self::Remove => !matches!(thing, Thing::Movable(_)),
            Self::Freeze => matches!(thing, Thing::Robot(_) | Thing::Light(_)),
            Self::Mute | Self::Deafen => matches!(thing, Thing::Robot(_)),
        }
    }
}

/// The interventions in the order of their steps.
///
/// # Errors
///
/// All that do not fit the world, or an episode of `n_steps` steps.
pub(crate) fn in_order(
    mut interventions: Vec<Intervention>,
    world: &World,
    n_steps: u32,
) -> Result<Vec<Intervention>, InterventionError> {
    let problems: Vec<String> = if interventions.len() > INTERVENTIONS_MAX {
        let n = interventions.len();
        vec![format!("an episode has at most {INTERVENTIONS_MAX} interventions, not {n}")]
    } else {
        interventions.iter().filter_map(|asked| asked.problem(world, n_steps)).collect()
    };
    // Those of one step keep their order.
    interventions.sort_by_key(|intervention| intervention.step);
    if problems.is_empty() { Ok(interventions) } else { Err(InterventionError { problems }) }
}

impl Intervention {
    fn problem(&self, world: &World, n_steps: u32) -> Option<String> {
        let Self { step, thing, act } = *self;
        let (kind, number, n) = (thing.kind(), thing.number(), thing.n_of_kind(world));
        if step >= n_steps {
            return Some(format!("step {step}: the episode has the steps 0 to {}", n_steps - 1));
        }
        if number >= n {
            return Some(match n {
                0 => format!("{kind} {number}: the world has no {kind}"),
                n => format!("{kind} {number}: the world has the numbers 0 to {}", n - 1),
            });
        }
        if !act.suits(thing) {
            return Some(format!("{}: nothing can do this to a {kind}", act.name()));
        }
        let Act::Place(Vec2 { x, y }) = act else { return None };
        let (width, height) = (world.torus.width, world.torus.height);
        let is_within = (0.0..=width).contains(&x) && (0.0..=height).contains(&y);
        (!is_within).then(|| {
            format!("{kind} {number}: the place ({x}, {y}) is outside of {width} x {height} cm")
        })
    }
}
