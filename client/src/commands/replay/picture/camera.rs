//! The part of the world that a picture shows.

use experiment_file::ExperimentConfig;
use sim_core::{RoomRecord, StepRecord, Vec2};

/// Margin around all shown objects, cm.
const MARGIN: f64 = 40.0;
/// Margin around a room, as a share of its side.
const MARGIN_OF_ROOM: f64 = 0.02;
/// Farther than anything in a room, cm.
const BEYOND: f64 = 1e9;

/// The visible square of the plane. On a torus, each object is drawn at its image nearest to
/// the middle.
pub struct Camera {
    pub middle: Vec2,
    period: Vec2,
    /// Pixels of the canvas per cm.
    pub scale: f64,
    /// Side of the canvas, pixels.
    side: f64,
}

impl Camera {
    /// A camera that shows all robots and lights in some steps, at most the whole world; or all
    /// of a room.
    pub fn around(
        config: &ExperimentConfig,
        room: Option<&RoomRecord>,
        steps: &[StepRecord],
        pixels: u32,
    ) -> Self {
        let period = Vec2::new(config.world.width, config.world.height);
        let pixels = f64::from(pixels);
        if room.is_some() {
            let side = period.x.max(period.y) * (1.0 + 2.0 * MARGIN_OF_ROOM);
            let middle = Vec2::new(0.5 * period.x, 0.5 * period.y);
            let period = Vec2::new(BEYOND, BEYOND);
            return Self { middle, period, scale: pixels / side, side: pixels };
        }
        let places = || steps.iter().flat_map(places);
        let start = places().next().unwrap_or_default();
        let (mut low, mut high) = ([0.0_f64; 2], [0.0_f64; 2]);
        for place in places() {
            let way =
                [shortest(place.x - start.x, period.x), shortest(place.y - start.y, period.y)];
            for axis in 0..2 {
                low[axis] = low[axis].min(way[axis]);
                high[axis] = high[axis].max(way[axis]);
            }
        }
        let side = (high[0] - low[0]).max(high[1] - low[1]) + 2.0 * MARGIN;
        let side = side.min(period.x.max(period.y));
        let middle = Vec2::new(
            start.x + f64::midpoint(low[0], high[0]),
            start.y + f64::midpoint(low[1], high[1]),
        );
        Self { middle, period, scale: pixels / side, side: pixels }
    }

    /// Pixels of a place; y points up.
    pub fn place(&self, at: Vec2) -> (i32, i32) {
        let x = shortest(at.x - self.middle.x, self.period.x) * self.scale;
        let y = shortest(at.y - self.middle.y, self.period.y) * self.scale;
        let half = self.side / 2.0;
        ((half + x).round() as i32, (half - y).round() as i32)
    }
}

fn places(step: &StepRecord) -> impl Iterator<Item = Vec2> {
    step.robots.iter().map(|robot| robot.position).chain(step.lights.iter().copied())
}

/// A difference on the torus, by the shorter way.
fn shortest(difference: f64, period: f64) -> f64 {
    difference - period * (difference / period).round()
}
