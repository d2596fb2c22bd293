//! Rows: the motion that a method gives, rated against FE's.

use std::time::Instant;

use super::{CompareError, Row};
use crate::curve::Envelope;
use crate::nsdm::Nsdm;
use crate::rating::{Quantity, Rating, Settings, Signal, rate};
use crate::signal::l1_ratio;
use crate::validate::motion::{Driver, Reference};

/// What all rows of one comparison share.
pub(super) struct Maker<'a> {
    pub reference: &'a Reference,
    pub fe_time_s: Option<f64>,
    /// Of all runs that curves are trained on.
    pub training_time_s: Option<f64>,
}

/// Times that a method took.
#[derive(Clone, Copy)]
pub(super) struct Times {
    pub fit_s: f64,
    pub predict_s: f64,
    /// FE's time of the runs it needs, if not all.
    pub training_s: Option<f64>,
    /// Whether it saves an FE run at all.
    pub training: bool,
}

impl Default for Times {
    fn default() -> Self {
        Self { fit_s: 0.0, predict_s: 0.0, training_s: None, training: true }
    }
}

impl Maker<'_> {
    /// The row of a curve. `forces` are FE's own and the method's, of one kind of force.
    pub fn row(
        &self,
        method: &str,
        curve: &str,
        driver: &Driver,
        forces: Option<(&Envelope, &Envelope)>,
        times: Times,
    ) -> Result<Row, CompareError> {
        let start = Instant::now();
        let run = self.reference.run(driver)?;
        let simulation_s = start.elapsed().as_secs_f64();
        let velocity = self.reference.velocity_of(&run)?;
        let (peak_n, crush_m) =
            (run.interfaces[0].peak_force_n, run.interfaces[0].max_deflection_m);
        let mut row =
            self.rated(method, curve, &velocity, (peak_n, crush_m), times, simulation_s)?;
        row.force_l1 = forces.map(|(truth, ours)| {
            let along = truth.deflection_m();
            let force: Vec<f64> = along.iter().map(|&d| ours.force_at(d)).collect();
            l1_ratio(truth.force_n(), &force)
        });
        Ok(row)
    }

    /// The row of a spring and damper.
    pub fn of_nsdm(&self, model: &Nsdm, curve: &str, times: Times) -> Result<Row, CompareError> {
        let reference = self.reference;
        let start = Instant::now();
        let (mass, speed) = (reference.mass_kg(), reference.speed_m_per_s());
        let motion = model.run(mass, speed, reference.time_s())?;
        let simulation_s = start.elapsed().as_secs_f64();
        let crush_m = motion.x_m.iter().copied().fold(0.0, f64::max);
        let peak_n = motion.a_m_per_s2.iter().map(|a| -a * mass).fold(0.0, f64::max);
        self.rated("nsdm", curve, &motion.v_m_per_s, (peak_n, crush_m), times, simulation_s)
    }

    fn rated(
        &self,
        method: &str,
        curve: &str,
        velocity: &[f64],
        (peak_force_n, max_crush_m): (f64, f64),
        times: Times,
        simulation_time_s: f64,
    ) -> Result<Row, CompareError> {
        let reference = self.reference;
        let inside = reference.inside();
        let errors = reference.errors_of(velocity);
        let (fe_a, ours_a) = reference.filtered_accelerations(velocity);
        let rated = |fe: &[f64], ours: &[f64], quantity| -> Result<Rating, CompareError> {
            let time_s = &reference.time_s()[..inside];
            let signal = |name, values: &[f64]| Signal::new(name, time_s.to_vec(), values.to_vec());
            let settings = Settings { quantity, ..Settings::default() };
            Ok(rate(&signal("fe", fe)?, &signal(method, ours)?, &settings)?)
        };
        let own_s = times.predict_s + simulation_time_s;
        let over = |all_s: f64| self.fe_time_s.filter(|_| times.training).map(|fe| fe / all_s);
        let training_s = times.training_s.or(self.training_time_s);
        Ok(Row {
            method: method.into(),
            curve: curve.into(),
            velocity_l1: errors.velocity_l1,
            acceleration_l1: errors.acceleration_l1,
            acceleration_unfiltered_l1: errors.acceleration_unfiltered_l1,
            force_l1: None,
            peak_force_n,
            max_crush_m,
            fit_time_s: times.fit_s,
            predict_time_s: times.predict_s,
            simulation_time_s,
            speed_up: over(own_s),
            speed_up_with_training: training_s.and_then(|t| over(t + times.fit_s + own_s)),
            velocity: rated(&reference.velocity()[..inside], &velocity[..inside], Quantity::Other)?,
            acceleration: rated(fe_a, &ours_a, Quantity::Acceleration)?,
        })
    }
}
