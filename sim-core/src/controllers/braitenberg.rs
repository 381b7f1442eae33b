//! Braitenberg's vehicle 2b (Vehicles, 1984): each half of the light sensor drives
//! the wheel of the other side, so that the robot turns to the light.

use super::{Action, Controller};
use crate::lanes::Lanes;
use determinism::random::Stream;

/// Wheel action per mean reading of a half.
const GAIN: f32 = 5.0;

/// a_r = clip(5 * mean of sectors 1..=n/2), a_l = clip(5 * mean of sectors n-n/2..n), with n/2
/// rounded down. Sector 0 looks ahead and belongs to no half. If n is even, the sector that looks
/// back belongs to both halves.
#[derive(Debug)]
pub(crate) struct BraitenbergLightFollower {
    n_sectors: usize,
    /// Wheel actions, `[right, left][lane]`.
    wheels: Lanes,
}

impl BraitenbergLightFollower {
    /// A vehicle at rest. Its stimuli are the light sensor's sectors.
    pub fn new(n_sectors: usize, n_lanes: usize) -> Self {
        Self { n_sectors, wheels: Lanes::new(2, n_lanes) }
    }
}

impl Controller for BraitenbergLightFollower {
    fn perceive(&mut self, stimuli: &Lanes) {
        let n_half = self.n_sectors / 2;
        let halves = [1..n_half + 1, self.n_sectors - n_half..self.n_sectors];
        for (wheel, half) in halves.into_iter().enumerate() {
            let row = self.wheels.row_mut(wheel);
            row.fill(0.0);
            for sector in half {
                for (sum, reading) in row.iter_mut().zip(stimuli.row(sector)) {
                    *sum += reading;
                }
            }
            for sum in row {
                *sum = (GAIN * *sum / n_half.max(1) as f32).min(1.0);
            }
        }
    }

    fn act(&mut self, lane: usize, _stream: &mut Stream, action: &mut Action<'_>) {
        *action.wheels = [0, 1].map(|wheel| f64::from(self.wheels.get(wheel, lane)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::communication::Mode;
    use determinism::random::Purpose;

    fn wheels(readings: &[f64]) -> [f64; 2] {
        let mut stimuli = Lanes::new(readings.len(), 3);
        for (sector, &reading) in readings.iter().enumerate() {
            stimuli.set(sector, 2, reading as f32);
        }
        let mut controller = BraitenbergLightFollower::new(readings.len(), 3);
        controller.perceive(&stimuli);
        let (mut wheels, mut led, mut mode) = ([0.0; 2], 0, Mode::Send);
        let mut action =
            Action { wheels: &mut wheels, led: &mut led, mode: &mut mode, message: &mut [] };
        let mut stream = Stream::new(0, 0, 0, Purpose::Decoding, 0);
        controller.act(2, &mut stream, &mut action);
        wheels
    }

    #[test]
    fn halves_drive_the_wheels_of_the_other_side() {
        let wheels = wheels(&[0.9, 0.02, 0.04, 0.06, 0.08, 0.1]);
        assert!((wheels[0] - 5.0 * 0.04).abs() < 1e-7);
        assert!((wheels[1] - 5.0 * 0.08).abs() < 1e-7);
    }

    #[test]
    fn wheels_saturate_and_darkness_is_rest() {
        assert_eq!(wheels(&[0.0, 1.0, 1.0, 0.0, 0.0]), [1.0, 0.0]);
        assert_eq!(wheels(&[0.0; 6]), [0.0; 2]);
    }

    #[test]
    fn one_sector_cannot_steer() {
        assert_eq!(wheels(&[1.0]), [0.0; 2]);
    }
}
