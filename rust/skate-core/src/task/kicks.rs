//! Schedule of random kicks.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Minimum and maximum time between two kicks and before the first one [s]. Gait steps take 0.3 to 1.1 s,
/// so the robot has time to recover, and an episode of 30 s has at least five kicks.
const KICK_INTERVAL: [f64; 2] = [2.0, 6.0];

/// Time of the next kick, with its random number generator.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Kicks {
    /// Separate generator, so that neither kicks nor later starts depend on the length of episodes.
    rng: ChaCha8Rng,
    /// Actions before the next kick.
    wait: u64,
}

impl Kicks {
    /// Schedule of a new episode with actions of `period` [s].
    pub fn new(period: f64, rng: &mut impl Rng) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(rng.random());
        let wait = draw_wait(period, &mut rng);
        Self { rng, wait }
    }

    /// To be called before every action. Sign of the kick (1 forward, -1 backward), or None.
    pub fn due(&mut self, period: f64) -> Option<f64> {
        let mut sign = None;
        if self.wait == 0 {
            sign = Some(if self.rng.random() { 1.0 } else { -1.0 });
            self.wait = draw_wait(period, &mut self.rng);
        }
        self.wait -= 1;
        sign
    }
}

/// Random time between two kicks, in actions.
fn draw_wait(period: f64, rng: &mut impl Rng) -> u64 {
    // Tolerance for rounding of the quotient.
    let shortest = (KICK_INTERVAL[0] / period - 1e-9).ceil() as u64;
    let longest = (KICK_INTERVAL[1] / period + 1e-9).floor() as u64;
    rng.random_range(shortest..=longest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The intervals, including the first, are uniform between two and six seconds; both signs occur.
    #[test]
    fn kick_intervals_are_within_their_bounds() {
        for period in [1e-4, 0.003, 0.01, 0.07, 0.3, 1.0] {
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            let (mut times, mut forward) = (Vec::new(), 0);
            for _ in 0..200 {
                let mut kicks = Kicks::new(period, &mut rng);
                let mut last = 0;
                for action in 0..(20.0 / period) as u64 {
                    if let Some(sign) = kicks.due(period) {
                        times.push((action - last) as f64 * period);
                        forward += u32::from(sign > 0.0);
                        last = action;
                    }
                }
            }
            let n = times.len() as f64;
            let [low, high] = [f64::min, f64::max].map(|of| times.iter().copied().fold(4.0, of));
            assert!(
                low >= 2.0 - 1e-9 && low < 2.0 + 1.5 * period.max(0.02),
                "{low}"
            );
            assert!(
                high <= 6.0 + 1e-9 && high > 6.0 - 1.5 * period.max(0.02),
                "{high}"
            );
            // About 800 kicks; the tolerance is four standard deviations of the fraction.
            assert!(
                (f64::from(forward) / n - 0.5).abs() < 0.07,
                "{forward} of {n}"
            );
        }
    }
}
