//! Energy audit, and the refusal of runs with an impossible energy or impulse.
//!
//! Refuses impossible crashes: work or impulse outside 0.67 to 1.5 times that of mass and speed, or a crush, speed or
//! loading time of no vehicle. Units are distinguished by trying the usual systems: energy, impulse, speed and the times must all
//! fit, because SI and mm-kg-ms agree in energy and impulse. A run that ended while loading is compared with the speed that it
//! had reached.

use super::loading::loading_end;
use super::{Curve, EnergyAudit, Masses};
use crate::unit::{Speed, UnitSystem, km_per_h};

/// `W = ∫F dd` up to the maximum deflection by the trapezoidal rule over the samples,
/// and `E`, the kinetic energy of the impact.
pub fn audit(curve: &Curve, masses: Masses, speed: Speed) -> EnergyAudit {
    let work_j = work_to_end(curve);
    EnergyAudit { work_j, kinetic_j: masses.kinetic_energy_j(speed) }
}

fn work_to_end(curve: &Curve) -> f64 {
    let (d, f) = (curve.deflection_m(), curve.force_n());
    (1..=loading_end(curve)).map(|i| 0.5 * (f[i] + f[i - 1]) * (d[i] - d[i - 1])).sum()
}

/// Energy or impulse outside these ratios to the impact's is an error of the input.
pub(crate) const POSSIBLE: (f64, f64) = (0.67, 1.5);
/// Two quantities of a record that should be one differ by less than this share of their range
/// at any time, or the record is not one.
pub(crate) const IMPOSSIBLE_ALONG_TIME: f64 = 0.5;
/// Impulse that differs from the change of momentum by more than this deserves a warning.
pub(crate) const IMPULSE_TOLERANCE: f64 = 0.05;
/// No vehicle is faster, in m/s, is crushed by more, in m, or in less time, in s.
const FASTEST_M_PER_S: f64 = 340.0;
const LONGEST_CRUSH_M: f64 = 100.0;
const SHORTEST_LOADING_S: f64 = 0.5e-3;
/// A crush, in m, and a time to it, in s, that are usual in crashes, to recognise units.
const USUAL_CRUSH_M: (f64, f64) = (2e-3, 20.0);
const USUAL_LOADING_S: (f64, f64) = (2e-3, 3.0);
/// Two speeds, or a speed's square and an energy, that agree this well have one cause.
const ALIKE: f64 = 0.1;
/// A factor of a power of ten, or of two, is one within this factor.
const NEAR_TEN: f64 = 1.6;
const NEAR_TWO: f64 = 1.2;

/// What a run's record says of its energy and momentum.
#[derive(Clone, Copy)]
pub(crate) struct StatedConditions<'a> {
    pub curve: &'a Curve,
    pub masses: Masses,
    pub speed: Speed,
    /// Closing speeds at the curve's states, where the file records velocities.
    pub closing_m_per_s: Option<&'a [f64]>,
    /// The recorded impact speed, likewise.
    pub recorded_m_per_s: Option<f64>,
    pub units: UnitSystem,
    /// Mass times acceleration: scales with lengths and times only.
    pub is_body_force: bool,
    /// Names and speeds of the study's other runs.
    pub others: &'a (dyn Fn() -> Vec<(String, f64)> + Sync),
}

/// Energy and impulse of the record relative to those of the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EnergyBalance {
    /// Work of the loading branch over the kinetic energy that it stopped.
    pub work: Option<f64>,
    /// Impulse of the loading branch over the change of momentum.
    pub impulse: Option<f64>,
}

/// Why a run cannot be what the manifest says.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "{found}: such an impact is impossible; {}. Correct the study, or take the run as it is with accept_energy = true",
    cause.of_run()
)]
pub(crate) struct ImpossibleRun {
    /// What was found, without its cause.
    pub found: String,
    cause: Cause,
}

impl ImpossibleRun {
    /// Whether the speed of the study is likely wrong.
    pub(crate) fn is_of_speed(&self) -> bool {
        matches!(self.cause, Cause::RecordedSpeed(_))
    }

    /// Whether its mass is.
    pub(crate) fn is_of_mass(&self) -> bool {
        matches!(self.cause, Cause::Half(_))
    }

    /// Histories that cannot be one run's.
    pub(crate) fn of_histories(found: String, cause: &'static str) -> Self {
        Self { found, cause: Cause::Histories(cause) }
    }

    /// The same with another cause: a record that begins with an offset.
    pub(crate) fn by_offset(self) -> Self {
        let cause = "likely the offset: the record lacks that crush, and the work done there; provide the earlier states, or leave the run out";
        Self::of_histories(self.found, cause)
    }

    /// The same with another cause: a force before the contact that was found.
    pub(crate) fn by_earlier_force(self) -> Self {
        let cause = "likely a force before the contact that was found, which the curve leaves out: contact_time in the run takes it in";
        Self::of_histories(self.found, cause)
    }

    /// The likely cause where the curve is that of a file without a study.
    pub(crate) fn cause_in_file(&self) -> String {
        self.cause.of_file()
    }
}

/// The likely cause of an impossible energy or impulse.
#[derive(Debug, Clone, PartialEq)]
enum Cause {
    /// Units as which it would fit.
    FittingUnits(&'static str),
    /// Units, but none of the usual ones.
    OtherUnits,
    /// The record's speed, as text with the run of that speed.
    RecordedSpeed(String),
    /// Speed, deck or files of another run, as text with its speed.
    OtherRun(String),
    /// A factor of two, with the mass that impulse and speeds imply, as text.
    Half(String),
    /// A factor of four, likewise.
    OneBody(String),
    /// Histories that do not belong together.
    Histories(&'static str),
    /// Unknown from its size, likewise.
    Unknown(String),
}

impl Cause {
    /// In words for somebody who built the run by a study.
    fn of_run(&self) -> String {
        match self {
            Self::FittingUnits(units) => {
                format!("likely the units: read as \"{units}\" it would fit")
            }
            Self::OtherUnits => {
                "likely the units: the solver files, or the mass of this run, have others than the study states".into()
            }
            Self::RecordedSpeed(speed) => format!("likely the speed: the record's is {speed}"),
            Self::OtherRun(run) => format!("likely speed, deck or files of the run {run}"),
            Self::Half(mass) => format!(
                "likely the mass{mass}, half a model taken for a whole one (half_model), or the force of one side only"
            ),
            Self::OneBody(mass) => format!(
                "likely the speed of one body taken for the closing speed of two (half_model), or the mass{mass}"
            ),
            Self::Histories(cause) => (*cause).into(),
            Self::Unknown(mass) => {
                format!(
                    "check units, speed and mass{mass}, and node, force and signs of the recipe"
                )
            }
        }
    }

    /// In words for somebody who has the curve in a file.
    fn of_file(&self) -> String {
        match self {
            Self::OtherUnits => "likely the units of its columns".into(),
            Self::Half(mass) => format!(
                "likely the mass{mass}, half a structure taken for a whole one, an impact of two vehicles for one against a wall (--kind), or the force of one of two sides"
            ),
            Self::OneBody(mass) => format!(
                "likely the speed of one body taken for the closing speed of two (--kind), or the mass{mass}"
            ),
            Self::Unknown(mass) => format!(
                "check units, speed and mass{mass}; whether the curve ends at the maximum crush of this impact, neither before nor after it; and whether its columns are deflection and force of the whole body"
            ),
            Self::FittingUnits(_)
            | Self::RecordedSpeed(_)
            | Self::OtherRun(_)
            | Self::Histories(_) => self.of_run(),
        }
    }
}

impl StatedConditions<'_> {
    /// Work and impulse against the impact's, over the loading branch. A record that ends
    /// while loading is compared with the speed that it has reached; without recorded speeds
    /// there is nothing to compare it with.
    pub(crate) fn balance(&self) -> EnergyBalance {
        let end = loading_end(self.curve);
        let mass = self.masses.effective_kg();
        let truncated = end + 1 == self.curve.time_s().len();
        let v = self.speed.m_per_s;
        let lost_j = match (truncated, self.closing_m_per_s) {
            (false, _) => Some(0.5 * mass * v * v),
            (true, Some(closing)) => Some(0.5 * mass * (v * v - closing[end] * closing[end])),
            (true, None) => None,
        };
        let (t, f) = (self.curve.time_s(), self.curve.force_n());
        let impulse_ns: f64 = (1..=end).map(|i| 0.5 * (f[i] + f[i - 1]) * (t[i] - t[i - 1])).sum();
        let lost_ns = self.closing_m_per_s.zip(self.recorded_m_per_s);
        let lost_ns = lost_ns.map(|(closing, first)| mass * (first - closing[end]));
        // Tiny values may be off by any factor: a record cut right after contact.
        let ratio = |is: f64, lost: f64, whole: f64| (lost > 0.1 * whole).then(|| is / lost);
        let recorded = self.recorded_m_per_s.unwrap_or(v);
        EnergyBalance {
            work: lost_j.and_then(|j| ratio(work_to_end(self.curve), j, 0.5 * mass * v * v)),
            impulse: lost_ns.and_then(|j| ratio(impulse_ns, j, mass * recorded)),
        }
    }

    /// Refuses impossible crashes, with the likely cause.
    pub(crate) fn check(&self) -> Result<EnergyBalance, ImpossibleRun> {
        let balance = self.balance();
        let possible = |ratio: f64| (POSSIBLE.0..=POSSIBLE.1).contains(&ratio);
        let fits = |ratio: Option<f64>| ratio.is_none_or(possible);
        let end = loading_end(self.curve);
        let (crush_m, loading_s) = (self.curve.deflection_m()[end], self.curve.time_s()[end]);
        let beyond = self.speed.m_per_s > FASTEST_M_PER_S
            || crush_m > LONGEST_CRUSH_M
            || loading_s < SHORTEST_LOADING_S && end + 1 < self.curve.time_s().len();
        if fits(balance.work) && fits(balance.impulse) && !beyond {
            return Ok(balance);
        }
        let mut found = Vec::new();
        if beyond {
            found.push(format!(
                "the maximum crush is {} m after {} ms",
                significant(crush_m),
                significant(loading_s * 1e3)
            ));
        }
        if let Some(work) = balance.work {
            found.push(format!(
                "the curve absorbs {} times the kinetic energy of {} at {}",
                significant(work),
                self.shown_mass(),
                self.speed
            ));
        }
        if let Some(impulse) = balance.impulse.filter(|&i| !possible(i)) {
            found.push(format!(
                "the force's impulse is {} times the change of momentum",
                significant(impulse)
            ));
        }
        Err(ImpossibleRun { found: found.join(", "), cause: self.cause(balance) })
    }

    fn shown_mass(&self) -> String {
        match self.masses.other_kg {
            Some(other) => {
                format!("{} on {}", significant_mass(self.masses.body_kg), significant_mass(other))
            }
            None => significant_mass(self.masses.body_kg),
        }
    }

    /// The likely cause.
    fn cause(&self, balance: EnergyBalance) -> Cause {
        let used = self.speed.m_per_s;
        let work = balance.work.unwrap_or(1.0);
        let near =
            |a: f64, b: f64, factor: f64| a > 0.0 && libm::log(a / b).abs() < libm::log(factor);
        let same = |a: f64, b: f64| (a / b - 1.0).abs() < ALIKE;
        if let Some(units) = self.fitting_units(balance) {
            return Cause::FittingUnits(units);
        }
        let ratios = [balance.work, balance.impulse].into_iter().flatten();
        let beyond = ratios.clone().any(|r| !(0.05..=20.0).contains(&r));
        let tens =
            |r: f64| near(r, 10_f64.powi(3 * (libm::log10(r) / 3.0).round() as i32), NEAR_TEN);
        if ratios.clone().filter(|r| !same(*r, 1.0)).all(tens) && beyond {
            return Cause::OtherUnits;
        }
        let recorded = self.recorded_m_per_s.filter(|&r| !same(r, used));
        if let Some(recorded) = recorded
            && same(work, (recorded / used).powi(2))
        {
            let other = self.named_other(recorded);
            return Cause::RecordedSpeed(format!("{}{other}", km_per_h(recorded)));
        }
        let others = (self.others)()
            .into_iter()
            .find(|(_, v)| !same(*v, used) && same(work, (v / used).powi(2)));
        if self.recorded_m_per_s.is_none()
            && let Some((name, speed)) = others
        {
            return Cause::OtherRun(format!("{name} ({})", km_per_h(speed)));
        }
        let mass = balance
            .impulse
            .map(|i| {
                format!(" (impulse and speeds give {})", significant_mass(i * self.masses.body_kg))
            })
            .unwrap_or_default();
        match work {
            w if near(w, 2.0, NEAR_TWO) || near(w, 0.5, NEAR_TWO) => Cause::Half(mass),
            w if near(w, 4.0, NEAR_TWO) || near(w, 0.25, NEAR_TWO) => Cause::OneBody(mass),
            _ => Cause::Unknown(mass),
        }
    }

    /// The run of that speed, for a message.
    fn named_other(&self, speed: f64) -> String {
        let found = (self.others)().into_iter().find(|(_, v)| (v / speed - 1.0).abs() < 0.02);
        found.map_or(String::new(), |(name, _)| format!(", that of the run {name}"))
    }

    /// A unit system that would make work, impulse and speed fit, if the declared one does not.
    fn fitting_units(&self, balance: EnergyBalance) -> Option<&'static str> {
        let end = loading_end(self.curve);
        let (crush_m, loading_s) = (self.curve.deflection_m()[end], self.curve.time_s()[end]);
        let scale = |units: &UnitSystem| {
            let speed = units.speed() / self.units.speed();
            let force = if self.is_body_force {
                units.acceleration() / self.units.acceleration()
            } else {
                units.force() / self.units.force()
            };
            let length = units.length_m / self.units.length_m;
            (speed, force * length, length, units.time_s / self.units.time_s)
        };
        let fits = |r: f64| (POSSIBLE.0..=POSSIBLE.1).contains(&r);
        // A filter has left nothing of a force at times that are a thousand times too short.
        let is_garbled = loading_s < SHORTEST_LOADING_S;
        // Where the speed came from the record, it has the record's units as well.
        let taken = self.recorded_m_per_s == Some(self.speed.m_per_s);
        UnitSystem::USUAL.into_iter().find_map(|name| {
            let units = UnitSystem::parse(name).ok()?;
            if units == self.units {
                return None;
            }
            let (speed, work, length, time) = scale(&units);
            let impulse = work / length * time;
            let energy = if taken { speed * speed } else { 1.0 };
            let v = self.speed.m_per_s * if taken { speed } else { 1.0 };
            let recorded_fits =
                taken || self.recorded_m_per_s.is_none_or(|r| fits(r * speed / self.speed.m_per_s));
            let balances = balance.work.is_none_or(|w| fits(w * work / energy))
                && balance.impulse.is_none_or(|i| fits(i * impulse / speed));
            let all = (is_garbled || balances)
                && recorded_fits
                && (0.01..=FASTEST_M_PER_S).contains(&v)
                && (USUAL_CRUSH_M.0..=USUAL_CRUSH_M.1).contains(&(crush_m * length))
                && (USUAL_LOADING_S.0..=USUAL_LOADING_S.1).contains(&(loading_s * time));
            all.then_some(name)
        })
    }
}

/// A mass with four digits, in t or kg.
fn significant_mass(kg: f64) -> String {
    if kg < 1e3 {
        format!("{} kg", significant(kg))
    } else {
        format!("{} t", significant(kg / 1e3))
    }
}

/// Four significant digits, for messages; two of what is as small or large as no crash.
fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(1e-4..1e7).contains(&value.abs()) {
        return format!("{value:.1e}");
    }
    let digits = (3 - libm::log10(value.abs()).floor() as i32).max(0) as usize;
    format!("{value:.digits$}")
}
