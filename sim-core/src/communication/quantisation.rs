//! Messages become symbols of a lattice (Eq. 3.13 and 3.14, Algorithm 4).

use crate::random::sample;

/// Draws lattice points with probabilities softmax(-beta * d / sqrt(M)), d the
/// Euclidean distance to the message.
#[derive(Debug, Clone)]
pub(crate) struct Quantiser {
    /// Inverse temperature.
    beta: f64,
    message_len: usize,
    /// `[point][component]`, row-major: the last component runs fastest.
    points: Vec<f64>,
}

impl Quantiser {
    /// The lattice of K = round(n_symbols^(1/M)) levels i/(K-1) per component of
    /// messages of length M. The reader of experiment files sees to it that K is 2
    /// at least and the lattice of bearable size.
    pub fn new(message_len: usize, n_symbols: u32, beta: f64) -> Self {
        let n_levels = libm::round(libm::pow(f64::from(n_symbols), 1.0 / message_len as f64))
            .max(2.0) as usize;
        let n_points = (0..message_len).fold(1, |n, _| n * n_levels);
        let mut points = vec![0.0; n_points * message_len];
        for (index, point) in points.chunks_exact_mut(message_len).enumerate() {
            let mut rest = index;
            for component in point.iter_mut().rev() {
                *component = (rest % n_levels) as f64 / (n_levels - 1) as f64;
                rest /= n_levels;
            }
        }
        Self { beta, message_len, points }
    }

    /// Replaces the message, clipped to \[0, 1\], by the lattice point that `u`,
    /// uniform in \[0, 1), draws. `weights` is scratch.
    pub fn quantise(&self, message: &mut [f64], u: f64, weights: &mut Vec<f64>) {
        weights.clear();
        weights.extend(self.points.chunks_exact(self.message_len).map(|point| {
            let squares = point.iter().zip(&*message).fold(0.0, |sum, (level, component)| {
                let difference = level - component.clamp(0.0, 1.0);
                sum + difference * difference
            });
            squares.sqrt()
        }));
        let nearest = weights.iter().copied().fold(f64::INFINITY, f64::min);
        let scale = (self.message_len as f64).sqrt();
        for weight in &mut *weights {
            *weight = libm::exp(-self.beta * (*weight - nearest) / scale);
        }
        let symbol = sample(weights, u);
        message.copy_from_slice(&self.points[symbol * self.message_len..][..self.message_len]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quantised(quantiser: &Quantiser, message: [f64; 2], u: f64) -> [f64; 2] {
        let mut message = message;
        quantiser.quantise(&mut message, u, &mut Vec::new());
        message
    }

    #[test]
    fn sixteen_symbols_of_two_components_have_four_levels() {
        let quantiser = Quantiser::new(2, 16, 100.0);
        assert_eq!(quantiser.points.len(), 32);
        assert_eq!(quantiser.points[..4], [0.0, 0.0, 0.0, 1.0 / 3.0]);
        assert_eq!(quantiser.points[8..10], [1.0 / 3.0, 0.0]);
        assert_eq!(quantiser.points[30..], [1.0, 1.0]);
    }

    #[test]
    fn a_cold_quantiser_takes_the_nearest_point() {
        let quantiser = Quantiser::new(2, 16, 1e4);
        for u in [0.0, 0.5, 0.999_999] {
            assert_eq!(quantised(&quantiser, [0.3, 0.95], u), [1.0 / 3.0, 1.0]);
            assert_eq!(quantised(&quantiser, [-7.0, 7.0], u), [0.0, 1.0]);
        }
    }

    #[test]
    fn a_hot_quantiser_is_uniform() {
        let quantiser = Quantiser::new(2, 16, 0.0);
        assert_eq!(quantised(&quantiser, [0.9, 0.9], 0.0), [0.0, 0.0]);
        assert_eq!(quantised(&quantiser, [0.9, 0.9], 1.5 / 16.0), [0.0, 1.0 / 3.0]);
        assert_eq!(quantised(&quantiser, [0.1, 0.1], 15.5 / 16.0), [1.0, 1.0]);
    }

    #[test]
    fn probabilities_match_a_case_by_hand() {
        // Two points, at distances 0.25 and 0.75 of a message of one component.
        let quantiser = Quantiser::new(1, 2, 2.0);
        let p_near = 1.0 / (1.0 + libm::exp(-1.0));
        for (u, level) in [(p_near - 1e-9, 0.0), (p_near + 1e-9, 1.0)] {
            let mut message = [0.25];
            quantiser.quantise(&mut message, u, &mut Vec::new());
            assert_eq!(message, [level]);
        }
    }
}
