//! Envelope: the loading branch as a function, force over increasing deflection.

use crate::error::{Error, error};
use crate::piecewise;

/// A piecewise linear force over deflection.
///
/// Invariant: at least two points, all finite, deflection strictly increasing from 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Envelope {
    deflection_m: Vec<f64>,
    force_n: Vec<f64>,
    /// `∫F dd` from 0 to each point, in J.
    work_j: Vec<f64>,
}

impl Envelope {
    /// Checks the invariant once.
    ///
    /// # Errors
    /// It names the first point that breaks it, counted from 1.
    pub fn new(deflection_m: Vec<f64>, force_n: Vec<f64>) -> Result<Self, Error> {
        let (deflections, forces) = (deflection_m.len(), force_n.len());
        if deflections != forces {
            return Err(error!(Other, "{deflections} deflections but {forces} forces"));
        }
        if deflections < 2 {
            return Err(error!(Other, "a curve needs at least 2 points, found {deflections}"));
        }
        for (i, (&deflection_m, &force_n)) in deflection_m.iter().zip(&force_n).enumerate() {
            if !(deflection_m.is_finite() && force_n.is_finite()) {
                return Err(error!(
                    Other,
                    "point {point} is ({deflection_m} m, {force_n} N): expected finite numbers",
                    point = i + 1
                ));
            }
        }
        if deflection_m[0] != 0.0 {
            return Err(error!(
                Other,
                "the deflection must begin at 0, found {first_m} m",
                first_m = deflection_m[0]
            ));
        }
        if let Some(i) = deflection_m.windows(2).position(|w| w[1] <= w[0]) {
            let (before_m, deflection_m) = (deflection_m[i], deflection_m[i + 1]);
            return Err(error!(
                Other,
                "the deflection must increase, found {deflection_m} m after {before_m} m at point {point}",
                point = i + 2
            ));
        }
        let mut envelope = Self { deflection_m, force_n, work_j: Vec::new() };
        envelope.integrate();
        Ok(envelope)
    }

    fn integrate(&mut self) {
        let (d, f) = (&self.deflection_m, &self.force_n);
        let mut work = 0.0;
        self.work_j = vec![0.0];
        for i in 1..d.len() {
            work += 0.5 * (f[i - 1] + f[i]) * (d[i] - d[i - 1]);
            self.work_j.push(work);
        }
    }

    /// The first point whose force is below zero, counted from 1.
    pub(crate) fn first_pulling_point(&self) -> Option<usize> {
        self.force_n.iter().position(|&f| f < 0.0).map(|i| i + 1)
    }

    /// The envelope with forces below zero raised to zero.
    pub(crate) fn pushing(mut self) -> Self {
        if self.first_pulling_point().is_some() {
            self.force_n.iter_mut().for_each(|f| *f = f.max(0.0));
            self.integrate();
        }
        self
    }

    /// Deflections in m, from 0, strictly increasing.
    pub fn deflection_m(&self) -> &[f64] {
        &self.deflection_m
    }

    /// Forces in N, one per deflection.
    pub fn force_n(&self) -> &[f64] {
        &self.force_n
    }

    /// `∫F dd` from 0 to each point, in J.
    pub(crate) fn work_j(&self) -> &[f64] {
        &self.work_j
    }

    /// Maximum deflection of the table, in m.
    pub fn end_m(&self) -> f64 {
        self.deflection_m[self.deflection_m.len() - 1]
    }

    /// Force at `deflection_m` by linear interpolation; the first and last force beyond the ends.
    pub fn force_at(&self, deflection_m: f64) -> f64 {
        self.force_in(self.segment(deflection_m), deflection_m)
    }

    /// The same, looked for near a segment, which becomes the one that holds `deflection_m`.
    pub(crate) fn force_near(&self, near: &mut usize, deflection_m: f64) -> f64 {
        let last = self.deflection_m.len() - 2;
        let holds = |i: usize| {
            i <= last && (self.deflection_m[i]..self.deflection_m[i + 1]).contains(&deflection_m)
        };
        if !holds(*near) {
            let next = *near + 1;
            *near = if holds(next) { next } else { self.segment(deflection_m) };
        }
        self.force_in(*near, deflection_m)
    }

    #[inline]
    fn force_in(&self, i: usize, deflection_m: f64) -> f64 {
        let (d0, d1) = (self.deflection_m[i], self.deflection_m[i + 1]);
        let (f0, f1) = (self.force_n[i], self.force_n[i + 1]);
        let share = ((deflection_m - d0) / (d1 - d0)).clamp(0.0, 1.0);
        f0 + share * (f1 - f0)
    }

    /// `∫F dd` from 0 to `deflection_m`, exact for the piecewise linear force; beyond the
    /// end the last force is held. In J.
    pub fn work_to(&self, deflection_m: f64) -> f64 {
        let end = self.deflection_m.len() - 1;
        if deflection_m >= self.deflection_m[end] {
            return self.work_j[end] + self.force_n[end] * (deflection_m - self.deflection_m[end]);
        }
        let i = self.segment(deflection_m);
        let d = (deflection_m - self.deflection_m[i]).max(0.0);
        self.work_j[i] + 0.5 * (self.force_n[i] + self.force_in(i, deflection_m)) * d
    }

    /// `∫F dd` over the whole table, in J.
    pub fn work(&self) -> f64 {
        self.work_j[self.work_j.len() - 1]
    }

    /// The deflection at which the envelope has absorbed `energy_j`; beyond its end the
    /// last force holds. `None` if it never does.
    pub(crate) fn deflection_for_work(&self, energy_j: f64) -> Option<f64> {
        let end = self.work_j.len() - 1;
        match self.work_j.iter().position(|&w| w >= energy_j) {
            Some(0) => Some(0.0),
            Some(i) => {
                let (d0, d1) = (self.deflection_m[i - 1], self.deflection_m[i]);
                let (f0, f1) = (self.force_n[i - 1], self.force_n[i]);
                let rest = energy_j - self.work_j[i - 1];
                let slope = (f1 - f0) / (d1 - d0);
                // Root of f0 d + slope d²/2 = rest, in the form that is exact for slope → 0.
                let root = (f0 * f0 + 2.0 * slope * rest).max(0.0).sqrt();
                Some((d0 + 2.0 * rest / (f0 + root)).clamp(d0, d1))
            }
            None if self.force_n[end] > 0.0 => {
                Some(self.end_m() + (energy_j - self.work_j[end]) / self.force_n[end])
            }
            None => None,
        }
    }

    /// Steepest rise in N/m, but for jumps whose points a reader has set apart, if it rises anywhere else.
    pub(crate) fn steepest_rise(&self) -> f64 {
        super::loading::steepest_rise(self.deflection_m(), self.force_n())
    }

    /// Steepest rise, in N/m; 0 if the force never rises.
    pub fn max_slope(&self) -> f64 {
        let slope = |i: usize| {
            (self.force_n[i] - self.force_n[i - 1])
                / (self.deflection_m[i] - self.deflection_m[i - 1])
        };
        (1..self.force_n.len()).map(slope).fold(0.0, f64::max)
    }

    /// Peak force, in N.
    pub fn peak_force_n(&self) -> f64 {
        self.force_n.iter().copied().fold(0.0, f64::max)
    }

    /// Index of the segment that holds `deflection_m`, the first or last one beyond the ends.
    fn segment(&self, deflection_m: f64) -> usize {
        // Tables over even deflections are the rule: the guess is off by rounding at most.
        let last = self.deflection_m.len() - 2;
        let guess = ((deflection_m / self.end_m() * (last + 1) as f64) as usize).min(last);
        for i in [guess, guess.saturating_sub(1), (guess + 1).min(last)] {
            if self.deflection_m[i] <= deflection_m && deflection_m < self.deflection_m[i + 1] {
                return i;
            }
        }
        piecewise::segment(&self.deflection_m, deflection_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Envelope {
        Envelope::new(vec![0.0, 1.0, 3.0], vec![0.0, 10.0, 0.0]).unwrap()
    }

    #[test]
    fn work_is_exact_between_points() {
        let e = triangle();
        assert_eq!(e.work_to(0.5), 1.25);
        assert_eq!(e.work_to(2.0), 5.0 + 7.5);
        assert_eq!(e.work(), 15.0);
        assert_eq!(e.work_to(9.0), 15.0, "the last force, 0, is held");
    }

    #[test]
    fn deflection_for_work_inverts_work() {
        let e = triangle();
        for d in [0.1, 0.9, 1.0, 1.7, 2.9] {
            let back = e.deflection_for_work(e.work_to(d)).unwrap();
            assert!((back - d).abs() < 1e-12, "{d} came back as {back}");
        }
        assert_eq!(e.deflection_for_work(20.0), None, "the force has ended");
        let constant = Envelope::new(vec![0.0, 1.0], vec![2.0, 2.0]).unwrap();
        assert_eq!(constant.deflection_for_work(5.0), Some(2.5));
    }

    #[test]
    fn refuses_what_is_not_a_function() {
        let order = Envelope::new(vec![0.0, 1.0, 1.0], vec![0.0; 3]).unwrap_err();
        assert_eq!(
            order.to_string(),
            "the deflection must increase, found 1 m after 1 m at point 3"
        );
        assert!(Envelope::new(vec![0.1, 1.0], vec![0.0; 2]).is_err());
        assert!(Envelope::new(vec![0.0, f64::NAN], vec![0.0; 2]).is_err());
        assert!(Envelope::new(vec![0.0], vec![0.0]).is_err());
    }
}
