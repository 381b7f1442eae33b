//! Random numbers of which every robot uses one per step.

use determinism::random::Stream;

/// Steps whose numbers are drawn at once. The streams of a large swarm do not fit in a cache; its
/// numbers for one step do.
const N_STEPS: usize = 8;

/// Uniform numbers of one stream per robot.
#[derive(Debug)]
pub(super) struct Draws {
    streams: Vec<Stream>,
    /// `[step][robot]`
    values: Vec<f64>,
    /// Steps left in `values`, with the present one.
    n_left: usize,
}

impl Draws {
    /// The numbers before the first step.
    pub fn new(streams: Vec<Stream>) -> Self {
        Self { values: vec![0.0; N_STEPS * streams.len()], streams, n_left: 0 }
    }

    /// Goes on to the next step.
    pub fn advance(&mut self) {
        if self.n_left > 1 {
            self.n_left -= 1;
            return;
        }
        let n_robots = self.streams.len();
        for (robot, stream) in self.streams.iter_mut().enumerate() {
            for step in 0..N_STEPS {
                self.values[step * n_robots + robot] = stream.uniform();
            }
        }
        self.n_left = N_STEPS;
    }

    /// Each robot's number in this step, in \[0, 1).
    pub fn current(&self) -> &[f64] {
        let n_robots = self.streams.len();
        &self.values[(N_STEPS - self.n_left) * n_robots..][..n_robots]
    }
}

#[cfg(test)]
mod tests {
    use determinism::random::Purpose;

    use super::*;

    #[test]
    fn every_robot_gets_the_numbers_of_its_stream_one_per_step() {
        let stream = |robot| Stream::new(0, 0_u64, 0, Purpose::Reception, robot);
        let mut draws = Draws::new((0..3).map(stream).collect());
        let mut streams: Vec<Stream> = (0..3).map(stream).collect();
        for _ in 0..3 * N_STEPS + 1 {
            draws.advance();
            let expected: Vec<f64> = streams.iter_mut().map(Stream::uniform).collect();
            assert_eq!(draws.current(), expected);
        }
    }
}
