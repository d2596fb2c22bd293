//! Motion and force of a run in SI, at common times.

use super::{ExtractError, Origin};
use super::{Measured, MeasuredForce, Notes, Setup};
use crate::curve::contact::milliseconds;
use crate::curve::recipe::{MAX_STATES, RecordedMotion};
use crate::curve::{Curve, ForceKind, loading};
use crate::error::error;
use crate::history::History;
use crate::signal::{derivative, interpolate};
use crate::unit::UnitSystem;
use crate::words::counted;

/// Times of two files count as equal up to the six digits that solvers print.
const SAME_TIME: f64 = 1e-5;
/// Share of the impulse before the common times that deserves a warning.
const LEFT_OUT: f64 = 0.001;
/// Share of the recipe's states that a record may lack without a warning; also the share of the record, at its end, that
/// must be without force for the contact to be over.
const SHORT: f64 = 0.02;
/// Rates that differ by less are one: nothing has slowed the bodies down.
const SAME_RATE: f64 = 0.002;
/// A force below this share of the largest counts as none.
const NO_FORCE: f64 = 0.01;

/// Motion and force at the same times, the force positive in compression: of a run, or of a file with times.
#[derive(Clone)]
pub(crate) struct Record {
    pub time_s: Vec<f64>,
    pub deflection_m: Vec<f64>,
    pub rate_m_per_s: Vec<f64>,
    pub force_n: Vec<f64>,
    /// Rate of the first state of the motion, before any cut.
    pub first_rate_m_per_s: f64,
    /// Of a motion at other times than the force: its own ones.
    pub motion_time_s: Option<Vec<f64>>,
    /// If the force begins after the motion: how far the bodies have moved until then since they had that rate.
    pub slowed_over_m: Option<f64>,
    /// Name of the velocity that the files do not have: the rate is then a derivative.
    pub missing_velocity: Option<String>,
    pub force_kind: ForceKind,
    /// Contact force that marks the start of contact for a body force.
    pub contact: Option<Signal>,
    /// Of the files, to name what was mistaken.
    pub units: UnitSystem,
}

impl Record {
    /// The record of a run, up to the manifest's end.
    pub(super) fn of(
        measured: &Measured<'_>,
        setup: &Setup<'_>,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        let units = measured.units;
        let motion = Motion::of(measured, setup, remarks)?;
        let force = force(measured, setup, remarks)?;
        let mut record = Self::at_common_times(motion, force, units, remarks)?;
        if let MeasuredForce::Body(..) = measured.force {
            record.force_kind = ForceKind::Body;
        }
        if let Some(until_s) = setup.stated.truncate_s {
            remarks.note(record.truncate(until_s)?);
        }
        record.turn_force(setup.stated.force_sign, remarks);
        if let Some(contact) = measured.contact {
            let (factor, what) = (units.force(), "contact force");
            let mut signal = Signal::of(contact, units, factor, what, Origin::Force, remarks)?;
            let sign = sign_of_impulse(&signal.time_s, &signal.values);
            signal.values.iter_mut().for_each(|f| *f *= sign);
            if setup.stated.contact.is_none() {
                remarks.note(format!("contact: found by {}", contact.label()));
            }
            record.contact = Some(signal);
        }
        Ok(record)
    }

    /// The record of columns in SI, which were read in `units`.
    pub(crate) fn of_columns(
        time_s: &[f64],
        deflection_m: &[f64],
        force_n: &[f64],
        units: UnitSystem,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        let states = |values: &'_ [f64]| time_s.iter().copied().zip(values.to_vec());
        let deflection =
            Signal::new(states(deflection_m), "displacement", Origin::Motion, remarks)?;
        let motion = Motion::differentiated(deflection, "velocity".into(), remarks);
        let force = Signal::new(states(force_n), "force", Origin::Force, remarks)?;
        let mut record = Self::at_common_times(motion, force, units, remarks)?;
        record.turn_force(None, remarks);
        Ok(record)
    }

    /// Makes compression positive, by the impulse where no sign is stated.
    fn turn_force(&mut self, stated: Option<f64>, remarks: &mut Notes) {
        let sign = stated.unwrap_or_else(|| sign_of_impulse(&self.time_s, &self.force_n));
        if sign < 0.0 {
            remarks.note("force: sign flipped, positive in compression");
        }
        self.force_n.iter_mut().for_each(|f| *f *= sign);
    }

    fn at_common_times(
        motion: Motion,
        force: Signal,
        units: UnitSystem,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        let mut record = Self {
            first_rate_m_per_s: motion.rate_m_per_s[0],
            slowed_over_m: None,
            motion_time_s: None,
            time_s: motion.time_s,
            deflection_m: motion.deflection_m,
            rate_m_per_s: motion.rate_m_per_s,
            force_n: Vec::new(),
            missing_velocity: motion.missing_velocity,
            force_kind: ForceKind::Contact,
            contact: None,
            units,
        };
        let (from, to) = (record.time_s[0], record.time_s[record.time_s.len() - 1]);
        let mut pairs = record.time_s.iter().zip(&force.time_s);
        if record.time_s.len() == force.time_s.len()
            && pairs.all(|(a, b)| (a - b).abs() <= SAME_TIME * to.abs())
        {
            record.force_n = force.values;
            return Ok(record);
        }
        let lead = force.time_s.partition_point(|&t| t < from);
        let whole = impulse(&force.time_s, &force.values);
        let lost = impulse(&force.time_s[..lead], &force.values[..lead]);
        if lost.abs() > LEFT_OUT * whole.abs() {
            remarks.warn(format!(
                "times: the force starts at {}, the motion at {}: {:.1} % of the impulse precede the motion and are left out; the time origins of the two files differ, or the first states of the motion are missing",
                milliseconds(force.time_s[0]),
                milliseconds(from),
                100.0 * lost / whole
            ));
        }
        let states = force.time_s.iter().copied().zip(force.values);
        let (time_s, force_n): (Vec<f64>, Vec<f64>) =
            states.filter(|(t, _)| (from..=to).contains(t)).unzip();
        if time_s.len() < 2 {
            return Err(ExtractError::NoOverlap);
        }
        remarks.note(format!(
            "times: the force has {} states and the motion {}; the motion was interpolated to {} common ones",
            force.time_s.len(),
            record.time_s.len(),
            time_s.len()
        ));
        let at = |values: &[f64]| {
            interpolate(&record.time_s, values, &time_s).map_err(|_| ExtractError::NoOverlap)
        };
        let earlier = record.time_s.partition_point(|&t| t < time_s[0]);
        let is_free = |&i: &usize| {
            (record.rate_m_per_s[i] / record.first_rate_m_per_s - 1.0).abs() < SAME_RATE
        };
        let free_m = (1..earlier).rev().find(is_free).map(|i| record.deflection_m[i]);
        (record.deflection_m, record.rate_m_per_s) =
            (at(&record.deflection_m)?, at(&record.rate_m_per_s)?);
        let is_slower = record.rate_m_per_s[0].abs() < record.first_rate_m_per_s.abs();
        record.slowed_over_m =
            free_m.filter(|_| is_slower).map(|free_m| (record.deflection_m[0] - free_m).abs());
        record.motion_time_s = Some(std::mem::replace(&mut record.time_s, time_s));
        record.force_n = force_n;
        Ok(record)
    }

    /// Removes the states after the manifest's end of the record; says how many.
    fn truncate(&mut self, until_s: f64) -> Result<String, ExtractError> {
        let kept = self.time_s.iter().take_while(|&&t| t <= until_s).count();
        if kept == 0 {
            return Err(self.outside("truncate", until_s));
        }
        if kept < 2 {
            let what = "the record up to truncate";
            return Err(ExtractError::TooShort { origin: Origin::Motion, what, states: kept });
        }
        let removed = self.time_s.len() - kept;
        self.time_s.truncate(kept);
        self.deflection_m.truncate(kept);
        self.rate_m_per_s.truncate(kept);
        self.force_n.truncate(kept);
        let removed = counted(removed, "state");
        Ok(format!("truncate: {removed} after {} removed", milliseconds(until_s)))
    }

    /// That a time lies outside the record.
    pub(crate) fn outside(&self, key: &'static str, time_s: f64) -> ExtractError {
        let (first_s, last_s) = (self.time_s[0], self.time_s[self.time_s.len() - 1]);
        ExtractError::OutsideRecord { key, time_s, first_s, last_s }
    }

    /// Whether a time lies within the record and before its last state.
    pub(crate) fn holds(&self, time_s: f64) -> bool {
        (self.time_s[0]..self.time_s[self.time_s.len() - 1]).contains(&time_s)
    }

    /// A column's value at a time within the record.
    pub(crate) fn at(&self, values: &[f64], time_s: f64) -> Result<f64, ExtractError> {
        interpolate(&self.time_s, values, &[time_s])
            .map(|v| v[0])
            .map_err(|_| ExtractError::NoOverlap)
    }
}

/// `∫F dt` by the trapezoidal rule.
pub(super) fn impulse(time_s: &[f64], force_n: &[f64]) -> f64 {
    let step = |i| 0.5 * (force_n[i] + force_n[i - 1]) * (time_s[i] - time_s[i - 1]);
    (1..time_s.len()).map(step).sum()
}

/// The sign of `∫F dt`: a single state that is wrong does not turn it.
fn sign_of_impulse(time_s: &[f64], force_n: &[f64]) -> f64 {
    if impulse(time_s, force_n) < 0.0 { -1.0 } else { 1.0 }
}

/// Up to this share of the states may repeat a time, or go back in it, without a warning.
const REPEATED: f64 = 0.02;

/// A history in SI with strictly increasing times.
#[derive(Clone)]
pub(crate) struct Signal {
    pub time_s: Vec<f64>,
    pub values: Vec<f64>,
}

impl Signal {
    /// A history's values times `factor`.
    fn of(
        history: &History,
        units: UnitSystem,
        factor: f64,
        what: &'static str,
        origin: Origin,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        if let Some(i) = history.values.iter().position(|v| !v.is_finite()) {
            let (what, value) = (history.label(), history.values[i]);
            return Err(ExtractError::NotFinite { origin, what, state: i + 1, value });
        }
        let times = history.time.iter().map(|t| t * units.time_s);
        Self::new(times.zip(history.values.iter().map(|v| v * factor)), what, origin, remarks)
    }

    /// The states whose time comes after that of the one before.
    fn new(
        states: impl ExactSizeIterator<Item = (f64, f64)>,
        what: &'static str,
        origin: Origin,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        let all = states.len();
        let (mut time_s, mut values) = (Vec::new(), Vec::new());
        let mut copies = 0;
        for (t, v) in states {
            if time_s.last().is_none_or(|&last| t > last) {
                time_s.push(t);
                values.push(v);
            } else {
                copies += usize::from(time_s.last() == Some(&t) && values.last() == Some(&v));
            }
        }
        let skipped = all - time_s.len();
        if (skipped - copies) as f64 > REPEATED * all as f64 {
            remarks.warn(format!(
                "{what}: {skipped} of {all} states left out because time did not increase: do its times have too few digits?"
            ));
        } else if skipped > 0 {
            let skipped = counted(skipped, "state");
            remarks.note(format!("{what}: {skipped} left out because time did not increase"));
        }
        if time_s.len() < 2 {
            return Err(ExtractError::TooShort { origin, what, states: time_s.len() });
        }
        Ok(Self { time_s, values })
    }
}

/// Relative displacement and its rate, in the direction of the file.
struct Motion {
    time_s: Vec<f64>,
    deflection_m: Vec<f64>,
    rate_m_per_s: Vec<f64>,
    missing_velocity: Option<String>,
}

impl Motion {
    fn of(
        measured: &Measured<'_>,
        setup: &Setup<'_>,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        let units = measured.units;
        let bodies = if setup.half_model { 2.0 } else { 1.0 };
        let (node, minus) = (measured.displacement, measured.minus_displacement);
        let factor = units.length_m * bodies;
        let deflection = relative(node, minus, units, factor, "displacement", remarks)?;
        if setup.half_model {
            remarks.note("half model: deflection and speed are twice the run's");
        }
        let Some(velocity) = measured.velocity else {
            let missing = measured.displacement.component.replace("displacement", "velocity");
            return Ok(Self::differentiated(deflection, missing, remarks));
        };
        let (minus, factor) = (measured.minus_velocity, units.speed() * bodies);
        let rate = relative(velocity, minus, units, factor, "velocity", remarks)?;
        Ok(Self {
            time_s: deflection.time_s,
            deflection_m: deflection.values,
            rate_m_per_s: rate.values,
            missing_velocity: None,
        })
    }

    fn differentiated(deflection: Signal, missing: String, remarks: &mut Notes) -> Self {
        remarks.note("closing speed: displacement differentiated, because no velocity was read");
        let (t, d) = (&deflection.time_s, &deflection.values);
        // A channel of the crush rests before contact, though the bodies close: no derivative across that kink.
        let rests = d.iter().take_while(|value| **value == d[0]).count().saturating_sub(1);
        let rests = if rests + LEAST_MOVING <= d.len() { rests } else { 0 };
        let mut rate_m_per_s = derivative(&t[rests..], &d[rests..]);
        if let Some(&first) = rate_m_per_s.first() {
            rate_m_per_s.splice(0..0, vec![first; rests]);
        }
        Self {
            rate_m_per_s,
            time_s: deflection.time_s,
            deflection_m: deflection.values,
            missing_velocity: Some(missing),
        }
    }
}

/// Samples that must move for the rest before them to be that of a channel of the crush.
const LEAST_MOVING: usize = 3;

/// A node's history less another's.
fn relative(
    node: &History,
    minus: Option<&History>,
    units: UnitSystem,
    factor: f64,
    what: &'static str,
    remarks: &mut Notes,
) -> Result<Signal, ExtractError> {
    let mut signal = Signal::of(node, units, factor, what, Origin::Motion, remarks)?;
    if let Some(minus) = minus {
        let minus = Signal::of(minus, units, factor, what, Origin::Motion, remarks)?;
        for (value, minus) in signal.values.iter_mut().zip(&minus.values) {
            *value -= minus;
        }
    }
    Ok(signal)
}

/// The force in N, in the direction of the file, at its own rate.
fn force(
    measured: &Measured<'_>,
    setup: &Setup<'_>,
    remarks: &mut Notes,
) -> Result<Signal, ExtractError> {
    let units = measured.units;
    let others = measured.minus_displacement.and_then(|history| history.entity);
    let mass = match (&measured.force, setup.masses.other_kg) {
        // The node of the other body.
        (MeasuredForce::Body(history, _), Some(other_kg))
            if others.is_some() && history.entity == others =>
        {
            other_kg
        }
        _ => setup.masses.body_kg,
    };
    let mut of =
        |history, factor, what| Signal::of(history, units, factor, what, Origin::Force, remarks);
    match measured.force {
        MeasuredForce::Contact(history) => of(history, units.force(), "force"),
        MeasuredForce::Body(history, RecordedMotion::Acceleration) => {
            of(history, mass * units.acceleration(), "acceleration")
        }
        MeasuredForce::Body(history, RecordedMotion::Velocity) => {
            let velocity = of(history, mass * units.speed(), "velocity")?;
            remarks.note("body force: mass times the central difference of the velocity");
            let values = derivative(&velocity.time_s, &velocity.values);
            Ok(Signal { values, ..velocity })
        }
    }
}

/// The curve and its closing speeds at the recipe's common times, as far as the record
/// reaches.
pub(super) fn sample(
    original: &Curve,
    closing: &[f64],
    setup: &Setup<'_>,
    remarks: &mut Notes,
) -> Result<(Curve, Vec<f64>), ExtractError> {
    let sampling = setup.sampling;
    let at = original.time_s();
    let last_s = at[at.len() - 1];
    // The last state may come a rounding error before its nominal time.
    let reach = last_s * (1.0 + 1e-9);
    let times: Vec<f64> = (0..sampling.states)
        .map(|i| i as f64 * sampling.interval_s)
        .take_while(|&t| t <= reach)
        .map(|t| t.min(last_s))
        .collect();
    if times.len() < 2 {
        let what = "the record at the recipe's interval";
        return Err(ExtractError::TooShort { origin: Origin::Motion, what, states: times.len() });
    }
    if times.len() < sampling.states {
        let short = format!(
            "short: the record holds {} of {} states from contact on",
            times.len(),
            sampling.states
        );
        // A record that was cut on purpose is as short as was requested, one that begins with
        // some states of flight ends as much earlier, and once the bodies part without force nothing
        // is missing. (A body force rings on: it is warned of.)
        let missing = sampling.states - times.len();
        let force = original.force_n();
        let peak = force.iter().fold(0.0_f64, |peak, f| peak.max(f.abs()));
        let end = &force[force.len() - (SHORT * force.len() as f64).ceil() as usize..];
        let is_over = closing.last().is_some_and(|v| *v < 0.0)
            && end.iter().all(|f| f.abs() < NO_FORCE * peak);
        match setup.stated.truncate_s {
            None if missing as f64 > SHORT * sampling.states as f64 && !is_over => {
                remarks.warn(short)
            }
            _ => remarks.note(short),
        }
    }
    let (end_s, window_s) = (at[loading::loading_end(original)], times[times.len() - 1]);
    if window_s < end_s && times.len() == sampling.states && setup.stated.truncate_s.is_none() {
        let states = (end_s / sampling.interval_s).ceil() + 1.0;
        let remedy = match states <= MAX_STATES as f64 {
            true => format!("raise states to {states:.0} or more"),
            false => "lengthen interval_ms".into(),
        };
        return Err(error!(
            Run at "sampling",
            "recipe.sampling has {sampling}, which ends {} after contact, before the maximum crush at {}: {remedy}, or set truncate in the run",
            milliseconds(window_s),
            milliseconds(end_s)
        )
        .into());
    }
    let at_times =
        |values: &[f64]| interpolate(at, values, &times).map_err(|_| ExtractError::NoOverlap);
    let deflection = at_times(original.deflection_m())?;
    let force = at_times(original.force_n())?;
    let closing = at_times(closing)?;
    Ok((Curve::new(times, deflection, force)?, closing))
}
