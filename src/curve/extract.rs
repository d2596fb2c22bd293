//! Extraction: from the histories of one run to its curve.

use super::recipe::{BodyMotion, Filter, Recipe};
use super::resample::interpolate;
use super::{Curve, CurveError, EnergyAudit, Masses, cfc, energy, loading};
use crate::history::{History, derivative};
use crate::unit::{Speed, SpeedKind, UnitSystem, km_per_h};

/// The histories of one run, in the solver's units.
pub struct Measured<'a> {
    pub units: UnitSystem,
    pub displacement: &'a History,
    pub minus_displacement: Option<&'a History>,
    /// Velocities of the same nodes, where the file has them.
    pub velocity: Option<&'a History>,
    pub minus_velocity: Option<&'a History>,
    pub force: MeasuredForce<'a>,
}

/// The force, or what makes it.
pub enum MeasuredForce<'a> {
    Contact(&'a History),
    /// Acceleration or velocity of the body's node, to be multiplied by its mass.
    Body(&'a History, BodyMotion),
}

/// What the manifest says of a run.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    pub recipe: &'a Recipe,
    pub kind: SpeedKind,
    /// One of two identical bodies against the symmetry plane: closing speed and
    /// deflection are twice the run's.
    pub half_model: bool,
    pub masses: Masses,
    pub declared_speed: Option<DeclaredSpeed>,
}

/// An impact speed that was not measured, and who says so: "manifest" or "deck".
#[derive(Clone, Copy, Debug)]
pub struct DeclaredSpeed {
    pub m_per_s: f64,
    pub by: &'static str,
}

/// The curve of a run and what was found on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Extracted {
    pub speed: Speed,
    pub sampled: Curve,
    pub closing_speed_m_per_s: Vec<f64>,
    pub original: Curve,
    pub contact_time_s: f64,
    pub unloading_stiffness_n_per_m: Option<f64>,
    pub audit: EnergyAudit,
    /// Choices made, for the record.
    pub notes: Vec<String>,
    /// What the user should look at.
    pub warnings: Vec<String>,
}

/// Why a run gives no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExtractError {
    #[error("{what} holds {states} states: at least 2 are needed")]
    TooShort { origin: Origin, what: &'static str, states: usize },
    #[error(
        "{what} of state {state} is {value}: expected a finite number; look for the problem with crumple inspect"
    )]
    NotFinite { origin: Origin, what: String, state: usize, value: f64 },
    #[error(
        "the force never exceeds {threshold_n:.0} N (its largest is {largest_n:.0} N): there is no contact in this record"
    )]
    NoContact { threshold_n: f64, largest_n: f64 },
    #[error("the histories of deflection and force have no time in common")]
    NoOverlap,
    #[error("the deflection does not grow after contact: check node, component and direction")]
    NoDeflection,
    #[error(
        "the manifest gives no speed and the file has no {component} to take it from: add speed = \"…km/h\""
    )]
    NoSpeed { component: &'static str },
    #[error("the first state does not move: add speed = \"…km/h\" to the run")]
    Standing,
    #[error("{0}")]
    Filter(#[from] cfc::CfcError),
    #[error("{0}")]
    Curve(#[from] CurveError),
}

/// Contact begins where the force exceeds the larger of these.
const CONTACT_FORCE_N: f64 = 1e3;
const CONTACT_SHARE: f64 = 0.005;
/// Times of two files count as equal up to the six digits that solvers print.
const SAME_TIME: f64 = 1e-5;
/// Declared and measured speed may differ by this share before a warning is due.
const SAME_SPEED: f64 = 0.01;

/// Extracts the curve of one run.
///
/// Order of work: SI, common times, signs (compression positive), contact, filter (force
/// only, at its original rate), loading end, resampling, energy audit.
///
/// # Errors
/// [`ExtractError`] says which history cannot be used and what to change.
pub fn extract(measured: &Measured<'_>, setup: &Setup<'_>) -> Result<Extracted, ExtractError> {
    let mut notes = Vec::new();
    let mut warnings = Vec::new();
    let motion = Motion::of(measured, setup, &mut notes)?;
    let force = force(measured, setup, &mut notes)?;
    let record = on_common_times(motion, force, &mut notes)?;

    let (largest_n, sign) = extreme(&record.force_n);
    if sign < 0.0 {
        notes.push("force: sign flipped, positive in compression".into());
    }
    let force_n: Vec<f64> = record.force_n.iter().map(|f| sign * f).collect();
    let threshold_n = CONTACT_FORCE_N.max(CONTACT_SHARE * largest_n);
    // Before the filter, which without phase shift begins ahead of the contact.
    let contact = force_n
        .iter()
        .position(|&f| f > threshold_n)
        .ok_or(ExtractError::NoContact { threshold_n, largest_n })?;
    let force_n = match setup.recipe.filter {
        Filter::None => force_n,
        Filter::Cfc(class) => {
            let filtered = cfc::filter(class, &record.time_s, &force_n)?;
            if filtered.resampled {
                notes.push(format!(
                    "filter: intervals differ by up to {:.1} %, so the force was filtered at their mean",
                    filtered.spread * 100.0
                ));
            }
            filtered.values
        }
    };

    let at_contact_m = record.deflection_m[contact];
    let travel: Vec<f64> =
        record.deflection_m[contact..].iter().map(|d| d - at_contact_m).collect();
    // A rebound can travel further than the crush: what the impact does first counts.
    let direction = if record.rate_m_per_s[contact] < 0.0 { -1.0 } else { 1.0 };
    if travel.iter().all(|d| d * direction <= 0.0) {
        return Err(ExtractError::NoDeflection);
    }
    if direction < 0.0 {
        notes.push("deflection: sign flipped, positive in compression".into());
    }
    let contact_time_s = record.time_s[contact];
    let time_s: Vec<f64> = record.time_s[contact..].iter().map(|t| t - contact_time_s).collect();
    let deflection_m: Vec<f64> = travel.iter().map(|d| direction * d).collect();
    let closing: Vec<f64> = record.rate_m_per_s[contact..].iter().map(|v| direction * v).collect();
    let original = Curve::new(time_s, deflection_m, force_n[contact..].to_vec())?;

    let speed = speed(measured, setup, record.first_rate_m_per_s, &mut notes, &mut warnings)?;
    let (sampled, closing_speed_m_per_s) = sample(&original, &closing, setup, &mut warnings)?;
    let audit = energy::audit(&original, setup.masses, speed);
    if (audit.ratio() - 1.0).abs() > EnergyAudit::TOLERANCE {
        warnings.push(format!(
            "energy: the curve takes up {:.1} % of the kinetic energy",
            audit.ratio() * 100.0
        ));
    }
    if loading::loading_end(&original) + 1 == original.time_s().len() {
        warnings.push(
            "truncated: the largest deflection is the last state, so the run ended while loading"
                .into(),
        );
    }
    if let Ok(branch) = loading::loading_branch(&original)
        && branch.dropped > 0
    {
        notes.push(format!(
            "loading branch: {} samples left out because the deflection did not advance",
            branch.dropped
        ));
    }
    Ok(Extracted {
        speed,
        sampled,
        closing_speed_m_per_s,
        unloading_stiffness_n_per_m: loading::unloading_stiffness(&original),
        original,
        contact_time_s,
        audit,
        notes,
        warnings,
    })
}

/// A history in SI with strictly increasing times.
struct Signal {
    time_s: Vec<f64>,
    values: Vec<f64>,
}

impl ExtractError {
    /// Whether it speaks of the force's file rather than of the motion's.
    pub fn is_of_force(&self) -> bool {
        match self {
            Self::TooShort { origin, .. } | Self::NotFinite { origin, .. } => {
                *origin == Origin::Force
            }
            Self::NoContact { .. } | Self::Filter(_) => true,
            _ => false,
        }
    }
}

/// Which history an error speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    Motion,
    Force,
}

impl Signal {
    fn of(
        history: &History,
        units: UnitSystem,
        factor: f64,
        what: &'static str,
        origin: Origin,
        notes: &mut Vec<String>,
    ) -> Result<Self, ExtractError> {
        if let Some(i) = history.values.iter().position(|v| !v.is_finite()) {
            let what = history.label();
            return Err(ExtractError::NotFinite {
                origin,
                what,
                state: i + 1,
                value: history.values[i],
            });
        }
        let (mut time_s, mut values) = (Vec::new(), Vec::new());
        for (&t, &v) in history.time.iter().zip(&history.values) {
            let t = t * units.time_s;
            if time_s.last().is_none_or(|&last| t > last) {
                time_s.push(t);
                values.push(v * factor);
            }
        }
        let skipped = history.time.len() - time_s.len();
        if skipped > 0 {
            notes.push(format!("{what}: {skipped} states left out because time did not increase"));
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
}

impl Motion {
    fn of(
        measured: &Measured<'_>,
        setup: &Setup<'_>,
        notes: &mut Vec<String>,
    ) -> Result<Self, ExtractError> {
        let units = measured.units;
        let twice = if setup.half_model { 2.0 } else { 1.0 };
        let relative = |node: &History, minus: Option<&History>, factor, what, notes: &mut _| {
            let mut signal = Signal::of(node, units, factor, what, Origin::Motion, notes)?;
            if let Some(minus) = minus {
                let minus = Signal::of(minus, units, factor, what, Origin::Motion, notes)?;
                for (value, minus) in signal.values.iter_mut().zip(&minus.values) {
                    *value -= minus;
                }
            }
            Ok::<_, ExtractError>(signal)
        };
        let (node, minus) = (measured.displacement, measured.minus_displacement);
        let displacement = relative(node, minus, units.length_m * twice, "displacement", notes)?;
        if setup.half_model {
            notes.push("half model: deflection and speed are twice the run's".into());
        }
        let rate_m_per_s = match measured.velocity {
            Some(velocity) => {
                let factor = units.speed() * twice;
                relative(velocity, measured.minus_velocity, factor, "velocity", notes)?.values
            }
            None => {
                notes.push(
                    "closing speed: displacement differentiated, the file has no velocity".into(),
                );
                derivative(&displacement.time_s, &displacement.values)
            }
        };
        Ok(Self { time_s: displacement.time_s, deflection_m: displacement.values, rate_m_per_s })
    }
}

/// The force in N, in the direction of the file, at its own rate.
fn force(
    measured: &Measured<'_>,
    setup: &Setup<'_>,
    notes: &mut Vec<String>,
) -> Result<Signal, ExtractError> {
    let units = measured.units;
    let mass = setup.masses.body_kg;
    Ok(match measured.force {
        MeasuredForce::Contact(history) => {
            Signal::of(history, units, units.force(), "force", Origin::Force, notes)?
        }
        MeasuredForce::Body(history, BodyMotion::Acceleration) => Signal::of(
            history,
            units,
            mass * units.acceleration(),
            "acceleration",
            Origin::Force,
            notes,
        )?,
        MeasuredForce::Body(history, BodyMotion::Velocity) => {
            let velocity =
                Signal::of(history, units, mass * units.speed(), "velocity", Origin::Force, notes)?;
            notes.push("body force: mass times the central difference of the velocity".into());
            Signal { values: derivative(&velocity.time_s, &velocity.values), ..velocity }
        }
    })
}

/// Motion and force at the same times.
struct Record {
    time_s: Vec<f64>,
    deflection_m: Vec<f64>,
    rate_m_per_s: Vec<f64>,
    force_n: Vec<f64>,
    /// Rate of the first state of the motion, before any cut.
    first_rate_m_per_s: f64,
}

fn on_common_times(
    motion: Motion,
    force: Signal,
    notes: &mut Vec<String>,
) -> Result<Record, ExtractError> {
    let first_rate_m_per_s = motion.rate_m_per_s[0];
    let last_s = motion.time_s[motion.time_s.len() - 1].abs();
    let same = motion.time_s.len() == force.time_s.len()
        && motion
            .time_s
            .iter()
            .zip(&force.time_s)
            .all(|(a, b)| (a - b).abs() <= SAME_TIME * last_s);
    if same {
        return Ok(Record {
            time_s: motion.time_s,
            deflection_m: motion.deflection_m,
            rate_m_per_s: motion.rate_m_per_s,
            force_n: force.values,
            first_rate_m_per_s,
        });
    }
    let (from, to) = (motion.time_s[0], motion.time_s[motion.time_s.len() - 1]);
    let (time_s, force_n): (Vec<f64>, Vec<f64>) = force
        .time_s
        .iter()
        .zip(&force.values)
        .filter(|(t, _)| (from..=to).contains(*t))
        .map(|(&t, &f)| (t, f))
        .unzip();
    if time_s.len() < 2 {
        return Err(ExtractError::NoOverlap);
    }
    notes.push(format!(
        "times: the force has {} states and the motion {}; the motion was interpolated to {} common ones",
        force.time_s.len(),
        motion.time_s.len(),
        time_s.len()
    ));
    let at = |values: &[f64]| {
        interpolate(&motion.time_s, values, &time_s).map_err(|_| ExtractError::NoOverlap)
    };
    Ok(Record {
        deflection_m: at(&motion.deflection_m)?,
        rate_m_per_s: at(&motion.rate_m_per_s)?,
        time_s,
        force_n,
        first_rate_m_per_s,
    })
}

/// Largest magnitude of the values and its sign.
fn extreme(values: &[f64]) -> (f64, f64) {
    let value = values.iter().fold(0.0, |m: f64, &v| if v.abs() > m.abs() { v } else { m });
    (value.abs(), if value < 0.0 { -1.0 } else { 1.0 })
}

/// The impact speed: the manifest's, held against the first state, or the first state's.
fn speed(
    measured: &Measured<'_>,
    setup: &Setup<'_>,
    first_rate_m_per_s: f64,
    notes: &mut Vec<String>,
    warnings: &mut Vec<String>,
) -> Result<Speed, ExtractError> {
    let first = first_rate_m_per_s.abs();
    let m_per_s = match setup.declared_speed {
        Some(DeclaredSpeed { m_per_s: declared, by }) => {
            if measured.velocity.is_some() && (first - declared).abs() > SAME_SPEED * declared {
                warnings.push(format!(
                    "speed: the {by} says {}, the first state moves at {}; the {by}'s is used",
                    km_per_h(declared),
                    km_per_h(first)
                ));
            }
            declared
        }
        None if measured.velocity.is_none() => {
            let component = setup.recipe.deflection.component.velocity();
            return Err(ExtractError::NoSpeed { component });
        }
        None => {
            notes.push(format!("speed: {} taken from the first state", km_per_h(first)));
            first
        }
    };
    if m_per_s > 0.0 {
        Ok(Speed { m_per_s, kind: setup.kind })
    } else {
        Err(ExtractError::Standing)
    }
}

/// The curve at the recipe's common times, as far as the record reaches.
fn sample(
    original: &Curve,
    closing: &[f64],
    setup: &Setup<'_>,
    warnings: &mut Vec<String>,
) -> Result<(Curve, Vec<f64>), ExtractError> {
    let sampling = setup.recipe.sampling;
    let at = original.time_s();
    let last_s = at[at.len() - 1];
    // The last state may come a rounding error before its nominal time.
    let reach = last_s * (1.0 + 1e-9);
    let times: Vec<f64> = (0..sampling.states)
        .map(|i| i as f64 * sampling.interval_s)
        .take_while(|&t| t <= reach)
        .map(|t| t.min(last_s))
        .collect();
    if times.len() < sampling.states {
        warnings.push(format!(
            "short: the record holds {} of {} states from contact on",
            times.len(),
            sampling.states
        ));
    }
    let at_times =
        |values: &[f64]| interpolate(at, values, &times).map_err(|_| ExtractError::NoOverlap);
    let deflection = at_times(original.deflection_m())?;
    let force = at_times(original.force_n())?;
    let closing = at_times(closing)?;
    Ok((Curve::new(times.clone(), deflection, force)?, closing))
}
