//! Rows: the motion of each method, rated against FE's.

use std::time::Instant;

use serde::Serialize;

use super::left_out::{STEPS, forces_n};
use super::methods::{FittedNsdm, Method, Times};
use super::reference::{MOST_WINDOWS, Reference};
use crate::curve::{ForceKind, is_beyond};
use crate::dataset::grid;
use crate::error::Error;
use crate::nsdm::{self, Nsdm};
use crate::rating::acceptance::Acceptance;
use crate::rating::{Quantity, Rating, RatingSettings, Signal, rate};
use crate::signal::l1_ratio;

/// One method.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Row {
    /// `fe` (FE's own curve of the recipe's force: the floor of a one-mass model), `fe_body` (of the
    /// body's motion, made from FE's speeds: a check of consistency), `fdrm`, `nsdm`, `ddtcm`,
    /// `best` (the model that validation chooses).
    pub method: String,
    /// Which force drives the run; null for a spring and damper.
    pub driven_by: Option<ForceKind>,
    /// What its curve was made from.
    pub curve: String,
    /// Ratio of the errors of the velocity.
    pub velocity_l1: f64,
    /// Accelerations filtered with CFC 60.
    pub acceleration_l1: f64,
    /// Accelerations as central differences, not filtered.
    pub acceleration_unfiltered_l1: f64,
    /// Force of the method's curve along FE's crush, of the same kind of force; null for a
    /// spring and damper.
    pub force_l1: Option<f64>,
    /// Largest force at the interface, in N; of a spring and damper mass times deceleration.
    #[serde(rename = "peak_force_N")]
    pub peak_force_n: f64,
    /// Maximum deflection of the run, in m.
    pub max_crush_m: f64,
    /// Deflection up to which the curve has data, in m; beyond it the run holds the last force. Null for a spring and damper.
    pub data_end_m: Option<f64>,
    /// By the acceptance rule for numerical crash models, as one stage.
    pub acceptance: Acceptance,
    /// Time to fit, from the training cases on.
    pub fit_time_s: f64,
    /// Time to predict the curve.
    pub predict_time_s: f64,
    /// Time of the multi-body run.
    pub simulation_time_s: f64,
    /// FE's time over that of prediction and run; null where FE's is not known.
    pub speed_up: Option<f64>,
    /// The same with the training runs and the fit counted.
    pub speed_up_with_training: Option<f64>,
    /// Every measure of the velocity.
    pub velocity: Rating,
    /// Every measure of the acceleration, CFC 60.
    pub acceleration: Rating,
}

impl Row {
    /// Where the curve's data end, in m, if the run crushes further.
    pub(crate) fn held_from_m(&self) -> Option<f64> {
        self.data_end_m.filter(|end| is_beyond(self.max_crush_m, *end))
    }
}

/// What all rows of one comparison share.
pub(super) struct RowBuilder<'a> {
    pub reference: &'a Reference,
    /// FE's maximum deflection, in m.
    pub max_crush_m: f64,
    pub fe_time_s: Option<f64>,
    /// Speed in m/s with which FE's body leaves; `None` if the record ends before.
    pub fe_rebound_m_per_s: Option<f64>,
    /// Of all runs that curves are trained on.
    pub training_time_s: Option<f64>,
}

/// The motion that a method gives.
struct Motion<'a> {
    /// At the reference's times, in m/s.
    velocity: &'a [f64],
    peak_force_n: f64,
    max_crush_m: f64,
    /// Kinetic and stored energy at the end of the window, or when the body stops if that is later, over the initial energy.
    left: f64,
    /// Time of the run, in s.
    simulation_s: f64,
}

/// The motion on spring and damper is looked at so many times in each interval of the reference.
const FINER: usize = 8;
/// And no further than for so many states.
const MOST_STATES: usize = 1_000_000;

impl RowBuilder<'_> {
    /// The row of a method with a curve.
    pub(crate) fn row(&self, method: Method) -> Result<Row, Error> {
        let Method { name, made_from, curve, forces: (truth, ours), times } = method;
        let start = Instant::now();
        let run = self.reference.run(&curve)?;
        let data_end_m = Some(curve.data_end_m.unwrap_or(curve.loading.end_m()));
        let simulation_s = start.elapsed().as_secs_f64();
        let velocity = self.reference.velocity_of(&run)?;
        let (v, stored_j) = (&run.bodies[0].v_m_per_s, &run.interfaces[0].stored_j);
        let window = run.time_s.partition_point(|t| *t < self.reference.window_s());
        let at = (window..v.len() - 1).find(|k| v[*k] <= 0.0).unwrap_or(v.len() - 1);
        // Of a curve that is followed back nothing says what the structure returns; nor of FE, if its record ends before.
        let is_known = self.fe_rebound_m_per_s.is_some();
        let counts = is_known && run.interfaces[0].dissipated_at_end_j > 0.0;
        let motion = Motion {
            velocity: &velocity,
            peak_force_n: run.interfaces[0].peak_force_n,
            max_crush_m: run.interfaces[0].max_deflection_m,
            left: self.left(v[at], if counts { stored_j[at] } else { 0.0 }),
            simulation_s,
        };
        let along = grid(truth.end_m(), STEPS);
        let force_l1 = Some(l1_ratio(&forces_n(&truth, &along), &forces_n(&ours, &along)));
        let row = self.rated(name, made_from, curve.kind, motion, times)?;
        Ok(Row { force_l1, data_end_m, ..row })
    }

    /// The row of a spring and damper.
    pub(crate) fn of_nsdm(&self, fitted: &FittedNsdm) -> Result<Row, Error> {
        let reference = self.reference;
        let start = Instant::now();
        let (mass, speed) = (reference.mass_kg, reference.speed_m_per_s);
        let law = &fitted.best().model;
        let motion = law.run(mass, speed, &reference.time_s)?;
        let simulation_s = start.elapsed().as_secs_f64();
        let (finer, at) = self.until_it_stops(law)?;
        let motion = Motion {
            velocity: &motion.v_m_per_s,
            peak_force_n: finer.a_m_per_s2.iter().map(|a| -a * mass).fold(0.0, f64::max),
            max_crush_m: finer.x_m.iter().copied().fold(0.0, f64::max),
            left: self.left(finer.v_m_per_s[at], law.envelope()?.work_to(finer.x_m[at].abs())),
            simulation_s,
        };
        let times = Times {
            // All seeds: one alone would not say which is best.
            fit_s: fitted.fits.iter().map(|(_, seconds)| seconds).sum(),
            training_s: fitted.training_s,
            ..Times::default()
        };
        self.rated("nsdm", fitted.made_from.clone(), None, motion, times)
    }

    /// The motion on spring and damper, and its state at the end of the window, or where the body stops if that is later.
    fn until_it_stops(&self, law: &Nsdm) -> Result<(nsdm::Motion, usize), Error> {
        let reference = self.reference;
        let (mass, speed) = (reference.mass_kg, reference.speed_m_per_s);
        let interval_s = (reference.time_s[1] - reference.time_s[0]) / FINER as f64;
        let window = (reference.window_s() / interval_s).round() as usize;
        let mut states = window + 1;
        loop {
            let time_s: Vec<f64> = (0..=states).map(|k| k as f64 * interval_s).collect();
            let motion = law.run(mass, speed, &time_s)?;
            let stops = (window..=states).find(|k| motion.v_m_per_s[*k] <= 0.0);
            let is_long = states as f64 > MOST_WINDOWS * window as f64 || states > MOST_STATES;
            if stops.is_some() || is_long {
                return Ok((motion, stops.unwrap_or(states)));
            }
            states *= 2;
        }
    }

    /// Kinetic and stored energy over the initial energy.
    fn left(&self, v_m_per_s: f64, stored_j: f64) -> f64 {
        let speed = self.reference.speed_m_per_s;
        let initial_j = 0.5 * self.reference.mass_kg * speed * speed;
        (v_m_per_s / speed).powi(2) + stored_j / initial_j
    }

    /// Of one mass, which has all of the energy at first; the force is the mean that stops it. FE's body may still be leaving when the
    /// window is over.
    fn acceptance(&self, left: f64, max_crush_m: f64) -> Acceptance {
        let last = self.reference.velocity[self.reference.inside - 1].abs();
        let fe = self.left(self.fe_rebound_m_per_s.map_or(last, |v| v.max(last)), 0.0);
        let crush = max_crush_m / self.max_crush_m;
        Acceptance::of(fe - left, crush - 1.0, 1.0 / crush - 1.0)
    }

    fn rated(
        &self,
        method: &str,
        curve: String,
        driven_by: Option<ForceKind>,
        motion: Motion<'_>,
        times: Times,
    ) -> Result<Row, Error> {
        let Motion { velocity, peak_force_n, max_crush_m, left, simulation_s } = motion;
        let reference = self.reference;
        let inside = reference.inside;
        let errors = reference.errors_of(velocity);
        let (fe_a, ours_a) = reference.filtered_accelerations(velocity);
        let rated = |fe: &[f64], ours: &[f64], quantity| -> Result<Rating, Error> {
            let time_s = &reference.time_s[..inside];
            let signal = |name, values: &[f64]| Signal::new(name, time_s.to_vec(), values.to_vec());
            let settings = RatingSettings { quantity, ..RatingSettings::default() };
            rate(&signal("fe", fe)?, &signal(method, ours)?, &settings)
        };
        let own_s = times.predict_s + simulation_s;
        let over = |all_s: f64| self.fe_time_s.filter(|_| times.training).map(|fe| fe / all_s);
        let training_s = times.training_s.or(self.training_time_s);
        Ok(Row {
            method: method.into(),
            driven_by,
            curve,
            velocity_l1: errors.velocity_l1,
            acceleration_l1: errors.acceleration_l1,
            acceleration_unfiltered_l1: errors.acceleration_unfiltered_l1,
            force_l1: None,
            peak_force_n,
            max_crush_m,
            data_end_m: None,
            acceptance: self.acceptance(left, max_crush_m),
            fit_time_s: times.fit_s,
            predict_time_s: times.predict_s,
            simulation_time_s: simulation_s,
            speed_up: over(own_s),
            speed_up_with_training: training_s.and_then(|t| over(t + times.fit_s + own_s)),
            velocity: rated(&reference.velocity[..inside], &velocity[..inside], Quantity::Other)?,
            acceleration: rated(fe_a, &ours_a, Quantity::Acceleration)?,
        })
    }
}
