//! Motion of a case against a multi-body run of one mass: the errors of a curve in use.
//!
//! FE's own curve in a run comes from the speeds alone: between two states the mean force is the change of kinetic energy
//! over that of deflection. A body that runs on it has FE's speeds at FE's deflections, whatever the filter. Its unloading
//! has FE's shape, and the energy of FE's mean separation speed over 20 ms. A recorded force oscillates, so the stored energy
//! is scaled by the mean force and not by the force itself.

use crate::curve::body::filtered;
use crate::curve::{Case, ForceCurve};
use crate::error::{Error, error};
use crate::multibody::{Body, Chain, EnvelopeEnd, ForceLaw, Interface, Run, RunSettings, simulate};
use crate::signal::{derivative, interpolate, l1_ratio};

/// The comparison ends this long after FE's maximum deflection, so that rebound counts.
const AFTER_MAX_CRUSH_S: f64 = 0.030;
/// The record is followed so much longer that the filter does not see its end.
const FOR_FILTER_S: f64 = 0.050;

/// FE's motion over the window of the comparison, and a little longer.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    case: String,
    pub(crate) mass_kg: f64,
    pub(crate) speed_m_per_s: f64,
    /// Times of the states that are compared and a little more, in s.
    pub(crate) time_s: Vec<f64>,
    /// States inside the window of the comparison.
    pub(crate) inside: usize,
    /// Whether the record ends inside the window.
    pub(crate) is_cut: bool,
    /// FE's closing speed at these times, in m/s.
    pub(crate) velocity: Vec<f64>,
    /// Its central differences, in m/s².
    pub(crate) acceleration: Vec<f64>,
    /// CFC 60.
    acceleration_filtered: Vec<f64>,
}

/// A body that has not stopped after so many windows is not followed further.
pub(super) const MOST_WINDOWS: f64 = 16.0;
/// Nor beyond half the outputs that a run may have.
const MOST_OUTPUTS: f64 = 5e5;

/// Errors of a multi-body run against FE, from contact to 30 ms after FE's maximum
/// deflection, as `Σ|p − r|/Σ|r|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionErrors {
    /// Ratio of the errors of the velocity.
    pub velocity_l1: f64,
    /// CFC 60 on both sides.
    pub acceleration_l1: f64,
    /// Central differences over two sampling intervals on both sides.
    pub acceleration_unfiltered_l1: f64,
}

impl Reference {
    /// # Errors
    /// For a record of fewer than three states.
    pub fn of(case: &Case) -> Result<Self, Error> {
        let end_s = case.curves.original.time_s()[case.loading_end()] + AFTER_MAX_CRUSH_S;
        let upto =
            |end_s: f64| case.curves.sampled.time_s().iter().take_while(|&&t| t <= end_s).count();
        let (inside, all) = (upto(end_s), upto(end_s + FOR_FILTER_S));
        if inside < 3 {
            return Err(error!(
                Comparison,
                "case \"{case}\": only {} in the window: at least 3 are needed",
                crate::words::counted(inside, "state"),
                case = case.id.name
            ));
        }
        let time_s = case.curves.sampled.time_s()[..all].to_vec();
        let velocity = case.curves.closing_speed_m_per_s[..all].to_vec();
        let acceleration = derivative(&time_s, &velocity);
        Ok(Self {
            case: case.id.name.clone(),
            mass_kg: case.conditions.masses.effective_kg(),
            speed_m_per_s: case.conditions.speed.m_per_s,
            acceleration_filtered: filtered(&time_s, acceleration.clone()),
            is_cut: end_s - time_s[time_s.len() - 1] > 1.5 * (time_s[1] - time_s[0]),
            time_s,
            inside,
            velocity,
            acceleration,
        })
    }

    /// Length of the window in s.
    pub(crate) fn window_s(&self) -> f64 {
        self.time_s[self.inside - 1]
    }

    /// Runs one body of the case's effective mass against a wall with a force curve, until the window is over and the body has
    /// stopped, or for 16 windows.
    ///
    /// # Errors
    /// If the curve makes no run.
    pub fn run(&self, curve: &ForceCurve) -> Result<Run, Error> {
        let body = Body::new("body", self.mass_kg, self.speed_m_per_s);
        let law = ForceLaw::of_curve(curve, None, EnvelopeEnd::Hold);
        let interface = Interface::new("body|wall", law, 0.0);
        let chain = Chain::new(vec![body], vec![interface])?;
        let output_interval_s = self.time_s[1] - self.time_s[0];
        // One output more than is compared, so that rounding cannot make it too short.
        let mut duration_s = self.time_s[self.time_s.len() - 1] + 1.5 * output_interval_s;
        let most_s = (MOST_WINDOWS * duration_s).min(MOST_OUTPUTS * output_interval_s);
        loop {
            let run = simulate(&chain, &RunSettings::new(duration_s, output_interval_s))?;
            let is_closing = run.bodies[0].v_m_per_s.last().is_some_and(|v| *v > 0.0);
            if !is_closing || duration_s >= most_s {
                return Ok(run);
            }
            duration_s *= 2.0;
        }
    }

    /// Errors of the one-mass run that a force curve gives.
    pub fn errors_with(&self, curve: &ForceCurve) -> Result<MotionErrors, Error> {
        let errors = self.errors(&self.run(curve)?)?;
        let MotionErrors { velocity_l1, acceleration_l1, acceleration_unfiltered_l1 } = errors;
        let all = [velocity_l1, acceleration_l1, acceleration_unfiltered_l1];
        if all.iter().all(|e| e.is_finite()) {
            Ok(errors)
        } else {
            Err(error!(Comparison, "its errors against FE are not finite numbers"))
        }
    }

    /// FE's and another motion's accelerations inside the window, CFC 60, from speeds at
    /// [`time_s`](Self::time_s).
    pub(crate) fn filtered_accelerations(&self, velocity: &[f64]) -> (&[f64], Vec<f64>) {
        let mut smooth = filtered(&self.time_s, derivative(&self.time_s, velocity));
        smooth.truncate(self.inside);
        (&self.acceleration_filtered[..self.inside], smooth)
    }

    /// A run's first body's speeds at [`time_s`](Self::time_s).
    pub(crate) fn velocity_of(&self, run: &Run) -> Result<Vec<f64>, Error> {
        interpolate(&run.time_s, &run.bodies[0].v_m_per_s, &self.time_s).map_err(|_| {
            error!(
                Comparison,
                "case \"{case}\": the multi-body run is shorter than the window",
                case = self.case
            )
        })
    }

    /// Errors of a run's first body.
    ///
    /// # Errors
    /// If the run ends before the window.
    pub fn errors(&self, run: &Run) -> Result<MotionErrors, Error> {
        Ok(self.errors_of(&self.velocity_of(run)?))
    }

    /// Errors of speeds at `time_s`.
    pub(crate) fn errors_of(&self, velocity: &[f64]) -> MotionErrors {
        let acceleration = derivative(&self.time_s, velocity);
        let smooth = filtered(&self.time_s, acceleration.clone());
        let inside =
            |values: &[f64], other: &[f64]| l1_ratio(&values[..self.inside], &other[..self.inside]);
        MotionErrors {
            velocity_l1: inside(&self.velocity, velocity),
            acceleration_l1: inside(&self.acceleration_filtered, &smooth),
            acceleration_unfiltered_l1: inside(&self.acceleration, &acceleration),
        }
    }
}
