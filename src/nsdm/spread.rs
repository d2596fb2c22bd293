//! Spread of fits with several seeds: whether their parameters are meaningful.

use serde::Serialize;

use super::Fit;
use super::law::PiecewiseLinear;
use crate::error::{Error, error};

/// Minimum number of fits that show a spread.
const FEWEST: usize = 3;
/// Places along an axis at which laws are compared.
const PLACES: usize = 200;

/// Smallest, largest and mean value over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Range {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean value.
    pub mean: f64,
}

impl Range {
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count() as f64;
        Self {
            min: values.clone().fold(f64::INFINITY, f64::min),
            max: values.clone().fold(f64::NEG_INFINITY, f64::max),
            mean: values.sum::<f64>() / count,
        }
    }

    /// `(max − min) / mean`; 0 where all are zero.
    fn relative(self) -> f64 {
        if self.max == self.min { 0.0 } else { (self.max - self.min) / self.mean }
    }
}

/// How far laws lie apart along their axis, as `(max − min) / mean` over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LawSpread {
    /// The largest along the axis.
    pub largest: f64,
    /// Where that is, in m or m/s.
    pub largest_at: f64,
    /// The mean along the axis.
    pub mean: f64,
}

impl LawSpread {
    fn of(laws: &[&PiecewiseLinear]) -> Self {
        let end = laws.iter().map(|law| law.end()).fold(0.0, f64::max);
        let mut spread = Self { largest: 0.0, largest_at: 0.0, mean: 0.0 };
        for place in 0..=PLACES {
            let at = end * place as f64 / PLACES as f64;
            let here = Range::of(laws.iter().map(|law| law.at(at))).relative();
            if here > spread.largest {
                (spread.largest, spread.largest_at) = (here, at);
            }
            spread.mean += here / (PLACES + 1) as f64;
        }
        spread
    }
}

/// Spread of errors and of parameters over the seeds.
///
/// Equal errors with different laws mean that the parameters are not unique: spring
/// and damper can replace each other, and what the law does at another speed is chance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Identifiability {
    /// Number of fits.
    pub seeds: usize,
    /// Objective of the fits, in m²/s⁴.
    pub objective: Range,
    /// `Σ|p − r|/Σ|r|` of the velocity at the fitted speed.
    pub velocity_l1: Range,
    /// The same for the acceleration.
    pub acceleration_l1: Range,
    /// Spread of the springs.
    pub stiffness: LawSpread,
    /// Spread of the dampers.
    pub damping: LawSpread,
}

impl Identifiability {
    /// Of at least three fits of one target.
    ///
    /// # Errors
    /// For fewer.
    pub fn of(fits: &[Fit]) -> Result<Self, Error> {
        if fits.len() < FEWEST {
            return Err(error!(
                Comparison,
                "{seeds} fits show no spread: at least {fewest} seeds are needed",
                fewest = FEWEST,
                seeds = fits.len()
            ));
        }
        let stiffness: Vec<_> = fits.iter().map(|fit| &fit.model.stiffness).collect();
        let damping: Vec<_> = fits.iter().map(|fit| &fit.model.damping).collect();
        Ok(Self {
            seeds: fits.len(),
            objective: Range::of(fits.iter().map(|fit| fit.objective)),
            velocity_l1: Range::of(fits.iter().map(|fit| fit.velocity_l1)),
            acceleration_l1: Range::of(fits.iter().map(|fit| fit.acceleration_l1)),
            stiffness: LawSpread::of(&stiffness),
            damping: LawSpread::of(&damping),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Nsdm;
    use super::*;

    fn fit(seed: u64, stiffness: f64, damping: [f64; 2], velocity_l1: f64) -> Fit {
        let law = |values: [f64; 2]| PiecewiseLinear::new(vec![0.0, 2.0], values.to_vec()).unwrap();
        Fit {
            model: Nsdm { stiffness: law([stiffness; 2]), damping: law(damping) },
            seed,
            objective: 1.0,
            velocity_l1,
            acceleration_l1: 0.1,
            evaluations: 0,
            generations: 0,
            history: vec![],
        }
    }

    #[test]
    fn spreads_by_hand() {
        let fits = [
            fit(0, 1e6, [0.0, 1e5], 0.01),
            fit(1, 2e6, [0.0, 2e5], 0.02),
            fit(2, 3e6, [0.0, 3e5], 0.06),
        ];
        let found = Identifiability::of(&fits).unwrap();
        assert_eq!((found.velocity_l1.min, found.velocity_l1.max), (0.01, 0.06));
        assert!((found.velocity_l1.mean - 0.03).abs() < 1e-15);
        assert_eq!(
            found.stiffness,
            LawSpread { largest: 1.0, largest_at: 0.0, mean: found.stiffness.mean }
        );
        assert!((found.stiffness.mean - 1.0).abs() < 1e-12);
        // All are zero at rest, and lie apart alike everywhere else.
        assert!((found.damping.largest - 1.0).abs() < 1e-12);
        assert!((found.damping.mean - 200.0 / 201.0).abs() < 1e-12);
        let error = Identifiability::of(&fits[..2]).unwrap_err().to_string();
        assert_eq!(error, "2 fits show no spread: at least 3 seeds are needed");
    }
}
