//! What occupants of a body meet: speed of a secondary impact and load of a restraint, from the body's speeds.
//!
//! An occupant goes on at the body's first speed while the body changes its own.

/// Free flight until an unrestrained occupant meets the interior, in m.
const FREE_FLIGHT_M: f64 = 0.6;
/// Free flight of a restrained occupant, and the path of its restraint after it, in m (occupant load criterion:
/// Euro NCAP, Technical Bulletin TB 027).
const SLACK_M: f64 = 0.065;
const RESTRAINT_M: f64 = 0.235;

/// Speeds relative to the occupant at outputs `interval_s` apart, and their integral.
pub(super) struct Flight {
    interval_s: f64,
    /// Speed of the occupant less that of the body, in m/s.
    speed: Vec<f64>,
    /// Path of the occupant less that of the body, in m.
    path: Vec<f64>,
}

impl Flight {
    /// From the speeds of the body.
    pub(super) fn new(speeds: &[f64], interval_s: f64) -> Self {
        let speed: Vec<f64> = speeds.iter().map(|v| speeds[0] - v).collect();
        let (mut path_m, mut before) = (0.0, 0.0);
        let next = |now: &f64| {
            path_m += 0.5 * (before + now) * interval_s;
            before = *now;
            path_m
        };
        let path = speed.iter().map(next).collect();
        Self { interval_s, speed, path }
    }

    /// Relative speed and path at a share of the interval from output `k` on; speeds are straight in between.
    fn at(&self, k: usize, share: f64) -> (f64, f64) {
        let change = self.speed.get(k + 1).map_or(0.0, |next| next - self.speed[k]);
        let speed = self.speed[k] + share * change;
        (speed, self.path[k] + 0.5 * (self.speed[k] + speed) * share * self.interval_s)
    }

    /// Where `is_reached` first holds from a place on: an output, and a share of the interval after it.
    fn first(&self, from: usize, is_reached: impl Fn(usize, f64) -> bool) -> Option<(usize, f64)> {
        let k = (from + 1..self.path.len()).find(|&k| is_reached(k, 0.0))? - 1;
        let (mut below, mut above) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (below + above);
            if is_reached(k, middle) { above = middle } else { below = middle }
        }
        Some((k, above))
    }

    /// Where the path first has this length, in either direction.
    fn reaches(&self, path_m: f64) -> Option<(usize, f64)> {
        self.first(0, |k, share| self.at(k, share).1.abs() >= path_m)
    }

    fn time_s(&self, (k, share): (usize, f64)) -> f64 {
        (k as f64 + share) * self.interval_s
    }

    /// Speed in m/s at which an unrestrained occupant meets the interior after [`FREE_FLIGHT_M`], below 0 if it goes
    /// on against the direction of positive speeds; `None` if it never does.
    pub(super) fn secondary_impact_m_per_s(&self) -> Option<f64> {
        let (k, share) = self.reaches(FREE_FLIGHT_M)?;
        Some(self.at(k, share).0)
    }

    /// Occupant load criterion in m/s²: the constant deceleration that stops an occupant relative to the body within
    /// 235 mm after a free flight of 65 mm, with the same sign; `None` if the run ends before.
    pub(super) fn occupant_load_m_per_s2(&self) -> Option<f64> {
        let begin = self.reaches(SLACK_M)?;
        let (_, path_m) = self.at(begin.0, begin.1);
        let begin_s = self.time_s(begin);
        // At constant deceleration the occupant has half of the relative speed on average.
        let restrained_m = |k: usize, share: f64| {
            let (speed, path) = self.at(k, share);
            path - path_m - 0.5 * speed * (self.time_s((k, share)) - begin_s)
        };
        let end = self.first(begin.0, |k, share| {
            self.time_s((k, share)) > begin_s
                && restrained_m(k, share) * path_m.signum() >= RESTRAINT_M
        })?;
        Some(self.at(end.0, end.1).0 / (self.time_s(end) - begin_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL_S: f64 = 1e-3;

    fn braked(deceleration: f64, until_s: f64) -> Vec<f64> {
        let v = |k: i32| 20.0 - deceleration * (f64::from(k) * INTERVAL_S).min(until_s);
        (0..500).map(v).collect()
    }

    /// A body with constant deceleration `a`: the flight takes `√(2 s/a)`, and the occupant then is faster by `√(2 a s)`.
    #[test]
    fn the_secondary_impact_of_a_constant_deceleration() {
        for deceleration in [50.0, -30.0, 12.5] {
            let speeds = braked(deceleration, 1.0);
            let found = Flight::new(&speeds, INTERVAL_S).secondary_impact_m_per_s().unwrap();
            let expected =
                (2.0 * deceleration.abs() * FREE_FLIGHT_M).sqrt() * deceleration.signum();
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        assert_eq!(
            Flight::new(&braked(50.0, 0.01), INTERVAL_S).secondary_impact_m_per_s(),
            None,
            "too slow"
        );
        assert_eq!(Flight::new(&[], INTERVAL_S).secondary_impact_m_per_s(), None);
    }

    /// A body that stops at once: the occupant has its speed for 65 mm and then `v²/(2 · 235 mm)`. With constant
    /// deceleration `a` of both, `√(2a·65 mm) T` is what the occupant lags behind, and both paths are parabolas.
    #[test]
    fn the_occupant_load_of_known_pulses() {
        let mut speeds = vec![0.0; 500];
        speeds[0] = 10.0;
        let found = Flight::new(&speeds, INTERVAL_S).occupant_load_m_per_s2().unwrap();
        assert!((found / (100.0 / 2.0 / RESTRAINT_M) - 1.0).abs() < 1e-9, "{found}");
        let a = 100.0;
        let found = Flight::new(&braked(a, 1.0), INTERVAL_S).occupant_load_m_per_s2().unwrap();
        // Slack until t1 = √(2 s/a); the relative speed is a t, so c = a t2/(t2 − t1), and the restraint's path is
        // ½ a (t2² − t1²) − ½ a t2 (t2 − t1) = ½ a t1 (t2 − t1).
        let t1 = (2.0 * SLACK_M / a).sqrt();
        let t2 = t1 + 2.0 * RESTRAINT_M / (a * t1);
        assert!((found / (a * t2 / (t2 - t1)) - 1.0).abs() < 1e-6, "{found}");
        let found = Flight::new(&braked(-a, 1.0), INTERVAL_S).occupant_load_m_per_s2().unwrap();
        assert!((found / -(a * t2 / (t2 - t1)) - 1.0).abs() < 1e-6, "{found}");
        assert_eq!(
            Flight::new(&braked(5.0, 0.1), INTERVAL_S).occupant_load_m_per_s2(),
            None,
            "too gentle"
        );
    }
}
