//! Interventions as the text of an address: `120:robot:3:mute,150:light:0:place:500:400`.

use std::str::FromStr;

use serde::Deserialize;
use sim_core::{Act, Intervention, Thing, Vec2};

/// Interventions in an episode, in any order.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct Interventions(pub Vec<Intervention>);

impl TryFrom<String> for Interventions {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl FromStr for Interventions {
    type Err = String;

    /// Reads interventions that commas separate; an empty text has none.
    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() {
            return Ok(Self::default());
        }
        let read = |one: &str| {
            intervention(one).ok_or_else(|| {
                let one: String = one.chars().take(80).collect();
                format!(
                    "`{one}` is no intervention; one is a step, `robot`, `light`, `area` or \
                     `movable`, its number, and `remove`, `freeze`, `mute`, `deafen` or \
                     `place:X:Y`, with colons between them"
                )
            })
        };
        text.split(',').map(read).collect::<Result<_, _>>().map(Self)
    }
}

fn intervention(text: &str) -> Option<Intervention> {
    let mut parts = text.split(':');
    let step = parts.next()?.parse().ok()?;
    let (kind, number) = (parts.next()?, parts.next()?.parse().ok()?);
    let thing = match kind {
        "robot" => Thing::Robot(number),
        "light" => Thing::Light(number),
        "area" => Thing::Area(number),
        "movable" => Thing::Movable(number),
        _ => return None,
    };
    let act = match parts.next()? {
        "remove" => Act::Remove,
        "freeze" => Act::Freeze,
        "mute" => Act::Mute,
        "deafen" => Act::Deafen,
        "place" => {
            let mut coordinate = || parts.next()?.parse().ok();
            let x = coordinate()?;
            Act::Place(Vec2::new(x, coordinate()?))
        }
        _ => return None,
    };
    parts.next().is_none().then_some(Intervention { step, thing, act })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interventions_are_read() {
        let read: Interventions = "120:robot:3:mute,7:light:0:place:500.5:-4".parse().unwrap();
        let mute = Intervention { step: 120, thing: Thing::Robot(3), act: Act::Mute };
        let act = Act::Place(Vec2::new(500.5, -4.0));
        assert_eq!(read.0, [mute, Intervention { step: 7, thing: Thing::Light(0), act }]);
        assert_eq!("".parse(), Ok(Interventions::default()));
    }

    #[test]
    fn anything_else_is_refused_by_name() {
        let wrong = [
            ",",
            "1:robot:3",
            "1:robot:3:mute:",
            "1:robot:3:dance",
            "1:wall:3:remove",
            "-1:robot:3:mute",
            "1:robot:3.5:mute",
            "1:light:0:place:1",
            "1:light:0:place:1:2:3",
            "1:robot:3:mute,",
        ];
        for text in wrong {
            let error = text.parse::<Interventions>().unwrap_err();
            assert!(error.contains("is no intervention"), "{text}: {error}");
        }
        let long = "x".repeat(10_000).parse::<Interventions>().unwrap_err();
        assert!(long.len() < 300, "{long}");
    }
}
