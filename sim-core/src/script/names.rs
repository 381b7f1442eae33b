//! The names of attributes and methods in scripts.

use task_script::Vocabulary;

/// Makes an enum and the vocabulary from one row per name.
macro_rules! names {
    ($($name:literal = $variant:ident,)*) => {
        /// An attribute or a method.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(super) enum Named { $($variant),* }

        /// All attributes and methods, in the order of the vocabulary.
        const ALL: &[Named] = &[$(Named::$variant),*];

        /// All names.
        pub(super) const VOCABULARY: Vocabulary = Vocabulary { names: &[$($name),*] };
    };
}

names! {
    "all_robots" = AllRobots,
    "angle" = Angle,
    "areas" = Areas,
    "bearing" = Bearing,
    "border" = Border,
    "carries" = Carries,
    "center" = Center,
    "centroid" = Centroid,
    "color" = Color,
    "distance" = Distance,
    "failed" = Failed,
    "group" = Group,
    "heading" = Heading,
    "heard" = Heard,
    "heard_from" = HeardFrom,
    "height" = Height,
    "id" = Id,
    "led" = Led,
    "left" = Left,
    "lights" = Lights,
    "message" = Message,
    "mode" = Mode,
    "movables" = Movables,
    "neighbours" = Neighbours,
    "normal" = Normal,
    "on" = On,
    "place" = Place,
    "random" = Random,
    "range" = Range,
    "right" = Right,
    "robots" = Robots,
    "sees_light" = SeesLight,
    "sense" = Sense,
    "state" = State,
    "step" = Step,
    "steps" = Steps,
    "touches" = Touches,
    "turn" = Turn,
    "walls_between" = WallsBetween,
    "way" = Way,
    "width" = Width,
    "world" = World,
    "x" = X,
    "y" = Y,
}

impl Named {
    /// The attribute or method with this number in the vocabulary.
    pub fn numbered(name: task_script::Name) -> Self {
        ALL[usize::from(name)]
    }

    /// The name in scripts.
    pub fn name(self) -> &'static str {
        VOCABULARY.names[self as usize]
    }
}
