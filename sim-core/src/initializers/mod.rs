//! Initialisers, which draw the start positions and headings of objects.

mod random_graph;

use std::f64::consts::TAU;

use crate::torus::{Torus, Vec2, wrap_angle};
use determinism::random::Stream;
use experiment_file::Initializer;

/// An initialiser that cannot place all its objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Unplaceable {
    /// The first object without a place.
    pub index: usize,
}

/// Start positions of `n` objects.
#[derive(Debug, Clone)]
pub(crate) enum Positions {
    /// Given values.
    Fixed(Vec<Vec2>),
    /// Both coordinates uniform in \[low, high).
    Uniform { low: f64, high: f64, n: usize },
    /// Uniform on a circle.
    Circumference { radius: f64, center: Vec2, n: usize },
    /// A connected random geometric graph.
    Graph { max_rad: f64, initial: Vec2, n: usize },
}

impl Positions {
    /// Compiles the configuration for `n` objects; or returns its mistake.
    pub fn new(config: &Initializer, n: usize) -> Result<Self, String> {
        Ok(match config {
            Initializer::Fixed { values } => {
                let positions = fixed(values, n)?;
                Self::Fixed(positions.map(|[x, y]| Vec2::new(x, y)).collect())
            }
            Initializer::RandomUniform { low, high, .. } => {
                Self::Uniform { low: *low, high: *high, n }
            }
            Initializer::RandomCircumference { radius, center: [x, y] } => {
                Self::Circumference { radius: *radius, center: Vec2::new(*x, *y), n }
            }
            Initializer::RandomGraph { max_rad, initial_pos: [x, y] } => {
                Self::Graph { max_rad: *max_rad, initial: Vec2::new(*x, *y), n }
            }
        })
    }

    /// Draws the positions.
    pub fn draw(&self, torus: &Torus, stream: &mut Stream) -> Result<Vec<Vec2>, Unplaceable> {
        Ok(match *self {
            Self::Fixed(ref positions) => positions.iter().map(|&p| torus.wrap(p)).collect(),
            Self::Uniform { low, high, n } => {
                let mut coordinate = || low + (high - low) * stream.uniform();
                let mut position = || {
                    let x = coordinate();
                    torus.wrap(Vec2 { x, y: coordinate() })
                };
                (0..n).map(|_| position()).collect()
            }
            Self::Circumference { radius, center, n } => {
                let mut position = || {
                    let direction = Vec2::unit(TAU * stream.uniform());
                    torus.wrap(Vec2 {
                        x: center.x + radius * direction.x,
                        y: center.y + radius * direction.y,
                    })
                };
                (0..n).map(|_| position()).collect()
            }
            Self::Graph { max_rad, initial, n } => {
                random_graph::draw(max_rad, initial, n, torus, stream)?
            }
        })
    }

    /// Draws another position for one object, if each is drawn by itself.
    pub fn draw_one(&self, torus: &Torus, stream: &mut Stream) -> Option<Vec2> {
        let one = match *self {
            Self::Uniform { low, high, .. } => Self::Uniform { low, high, n: 1 },
            Self::Circumference { radius, center, .. } => {
                Self::Circumference { radius, center, n: 1 }
            }
            Self::Fixed(_) | Self::Graph { .. } => return None,
        };
        one.draw(torus, stream).ok()?.pop()
    }

    /// Whether positions are drawn together, and another draw gives others.
    pub fn is_arrangement(&self) -> bool {
        matches!(self, Self::Graph { .. })
    }
}

/// Start headings of `n` robots.
#[derive(Debug, Clone)]
pub(crate) enum Headings {
    /// Given values.
    Fixed(Vec<f64>),
    /// Uniform in \[low, high).
    Uniform { low: f64, high: f64, n: usize },
}

impl Headings {
    /// Compiles the configuration for `n` robots; or returns its mistake.
    pub fn new(config: &Initializer, n: usize) -> Result<Self, String> {
        Ok(match config {
            Initializer::Fixed { values } => {
                Self::Fixed(fixed(values, n)?.map(|[theta]| theta).collect())
            }
            Initializer::RandomUniform { low, high, .. } => {
                Self::Uniform { low: *low, high: *high, n }
            }
            Initializer::RandomCircumference { .. } | Initializer::RandomGraph { .. } => {
                return Err("headings are `fixed` or `random_uniform`".into());
            }
        })
    }

    /// Draws the headings, in \[0, 2 pi).
    pub fn draw(&self, stream: &mut Stream) -> Vec<f64> {
        match *self {
            Self::Fixed(ref headings) => headings.iter().map(|&h| wrap_angle(h)).collect(),
            Self::Uniform { low, high, n } => {
                (0..n).map(|_| wrap_angle(low + (high - low) * stream.uniform())).collect()
            }
        }
    }
}

/// One value for each of `n` objects, of N components.
fn fixed<const N: usize>(
    values: &[Vec<f64>],
    n: usize,
) -> Result<impl Iterator<Item = [f64; N]>, String> {
    let values: Option<Vec<[f64; N]>> =
        values.iter().map(|value| value.as_slice().try_into().ok()).collect();
    let values = values.ok_or_else(|| format!("each value has {N} component(s)"))?;
    if values.len() != 1 && values.len() != n {
        return Err(format!("{} values for {n} objects: give 1 or {n}", values.len()));
    }
    Ok(values.into_iter().cycle().take(n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;

    const TORUS: Torus = Torus::new(1000.0, 500.0);

    fn stream() -> Stream {
        Stream::new(1, 2, 3, Purpose::Positions, 0)
    }

    #[test]
    fn one_fixed_value_serves_all() {
        let config = Initializer::Fixed { values: vec![vec![1200.0, -1.0]] };
        let positions = Positions::new(&config, 2).unwrap().draw(&TORUS, &mut stream()).unwrap();
        assert_eq!(positions, [Vec2::new(200.0, 499.0); 2]);
        let config = Initializer::Fixed { values: vec![vec![7.0], vec![-1.0]] };
        let headings = Headings::new(&config, 2).unwrap().draw(&mut stream());
        assert_eq!(headings, [7.0 - TAU, TAU - 1.0]);
    }

    #[test]
    fn uniform_draws_x_then_y_of_each_object() {
        let config = Initializer::RandomUniform { low: 400.0, high: 600.0, size: 2 };
        let positions = Positions::new(&config, 3).unwrap().draw(&TORUS, &mut stream()).unwrap();
        let mut values = stream();
        for position in positions {
            let x = 400.0 + 200.0 * values.uniform();
            let y = 400.0 + 200.0 * values.uniform();
            assert_eq!(position, TORUS.wrap(Vec2::new(x, y)));
        }
    }

    #[test]
    fn the_circumference_is_a_circle() {
        let config = Initializer::RandomCircumference { radius: 50.0, center: [500.0, 250.0] };
        let positions = Positions::new(&config, 20).unwrap().draw(&TORUS, &mut stream()).unwrap();
        for position in positions {
            let distance = TORUS.distance(position, Vec2::new(500.0, 250.0));
            assert!((distance - 50.0).abs() < 1e-9);
        }
    }

    #[test]
    fn misshapen_values_are_refused() {
        let three = Initializer::Fixed { values: vec![vec![1.0, 2.0]; 3] };
        assert!(Positions::new(&three, 2).is_err());
        assert!(Headings::new(&three, 3).is_err());
        let circle = Initializer::RandomCircumference { radius: 1.0, center: [0.0, 0.0] };
        assert!(Headings::new(&circle, 2).is_err());
    }
}
