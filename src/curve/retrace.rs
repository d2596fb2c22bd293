//! The motion of a body that is stopped and thrown back by a table of force over deflection.
//!
//! Speeds follow from the work of the piecewise linear force and are exact at every state. Times
//! are sums of `2 Δd/(v + v')` over short steps, exact for a constant force, also where the body
//! is at rest.

use super::loading::steepest_rises;
use super::{ForceKind, Masses};
use crate::error::{Error, error};
use crate::unit::{Shown, Speed, UnitSystem};

/// A table of force over deflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table<'a> {
    /// In m. Without times: from 0 to the largest, then falling if it holds the unloading.
    pub deflection_m: &'a [f64],
    /// In N, one per deflection.
    pub force_n: &'a [f64],
    /// In s, one per deflection.
    pub time_s: Option<&'a [f64]>,
    /// In N, one per deflection: the force that moves the body, where that is another.
    pub body_force_n: Option<&'a [f64]>,
}

/// The impact that a table belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Which force the table holds.
    pub force_kind: ForceKind,
    /// Speed at contact.
    pub speed: Speed,
    /// Of the body, or of both bodies.
    pub masses: Masses,
    /// From the maximum deflection, in N/m, if it is known.
    pub unloading_stiffness_n_per_m: Option<f64>,
    /// The same for the force that moves the body, where that is another.
    pub body_unloading_stiffness_n_per_m: Option<f64>,
    /// Time of the first contact in s, if it is stated; of a table with times.
    pub contact_time_s: Option<f64>,
    /// Units in which the table's values were read, to find the cause of errors.
    pub units: UnitSystem,
    /// Accept the table whatever its energy.
    pub accept_energy: bool,
}

/// The error of a force so small somewhere that the body hardly moves.
pub(super) fn endless() -> Error {
    error!(
        Other,
        "along this curve a body almost stops moving before it is at rest: remove the points whose force is almost zero, or give the record with its times"
    )
}

/// States of a motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Motion {
    pub time_s: Vec<f64>,
    pub deflection_m: Vec<f64>,
    pub force_n: Vec<f64>,
    /// Rate of the deflection.
    pub closing_m_per_s: Vec<f64>,
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

/// Free motion after the unloading, in s: the speed of the separation is a mean over 20 ms, and
/// filters need some time after it.
const FREE_S: f64 = 0.040;
/// States between two samples at the common interval.
const FINER: f64 = 8.0;
/// The longest of a slow motion's steps is this share of its time.
const STEPS: f64 = 20_000.0;
/// Maximum number of states besides the points of the table.
const MAX_STATES: usize = 200_000;
/// No step is shorter than this share of its segment, so that a crawl ends.
const SHORTEST: f64 = 1e-6;
/// Nor than this share of the maximum deflection: states closer than a millionth of it are none of a
/// loading branch, and its last one is to be the table's.
const FINEST: f64 = 5e-6;

/// The motion of a table under an impact.
pub(super) fn retrace(
    table: &Table<'_>,
    impact: &Impact,
    interval_s: f64,
) -> Result<Motion, Error> {
    let (d, f) = (table.deflection_m, table.force_n);
    let end = (1..d.len()).fold(0, |best, i| if d[i] > d[best] { i } else { best });
    let moving = table.body_force_n.unwrap_or(f);
    let loading = Branch { d: &d[..=end], f: &f[..=end], moving: &moving[..=end] };
    let work = loading.work();
    if moving[end] <= 0.0 || f[end] <= 0.0 {
        let last = moving.iter().zip(f).take(end).rposition(|(g, f)| *g > 0.0 && *f > 0.0);
        return Err(error!(
            Other,
            "the force at the maximum deflection is 0 (from {from_m} m on), so that nothing stops a body there: remove the points after the end of the force, or give the record with its times",
            from_m = d[last.map_or(0, |i| i + 1)]
        ));
    }
    let v0 = impact.speed.m_per_s;
    let step_s = (interval_s / FINER).max(2.0 * d[end] / v0 / STEPS);
    let mass = 2.0 * work[end] / (v0 * v0);
    let mut builder =
        MotionBuilder { motion: Motion::default(), step_s, least_m: FINEST * d[end], mass };
    builder.motion.notes.push(
        "motion: reconstructed, the file has no times: the maximum deflection is taken as the maximum crush, v² = v0² (1 − W(d)/W(end))"
            .into(),
    );
    if table.body_force_n.is_some() {
        builder.motion.notes.push("motion: from the work of the body force".into());
    }
    builder.begin(0.0, f[0], v0);
    let speeds: Vec<f64> =
        work.iter().map(|w| v0 * (1.0 - w / work[end]).max(0.0).sqrt()).collect();
    builder.push_branch(&loading, &speeds, 1.0)?;
    let [d, f, moving] = builder.unloading(table, impact, end)?;
    let unloading = Branch { d: &d, f: &f, moving: &moving };
    let (back, mass) = (unloading.work(), builder.mass);
    let speeds: Vec<f64> = back.iter().map(|w| -(2.0 * -w / mass).max(0.0).sqrt()).collect();
    builder.push_branch(&unloading, &speeds, -1.0)?;
    if f.last().is_some_and(|f| *f <= 0.0) {
        builder.push_free_flight()?;
    } else {
        builder.motion.warnings.push(
            "unloading: the table ends before its force has fallen to 0; so does the motion".into(),
        );
    }
    Ok(builder.motion)
}

/// Points along which a body moves in one direction: deflection, force, and what moves it.
struct Branch<'a> {
    d: &'a [f64],
    f: &'a [f64],
    moving: &'a [f64],
}

impl Branch<'_> {
    /// Work of the moving force from the first point to each, in J; below 0 where it falls.
    fn work(&self) -> Vec<f64> {
        let mut work = vec![0.0];
        for i in 1..self.d.len() {
            let mean = 0.5 * (self.moving[i - 1] + self.moving[i]);
            work.push(work[i - 1] + mean * (self.d[i] - self.d[i - 1]));
        }
        work
    }
}

/// A motion that is being made.
struct MotionBuilder {
    motion: Motion,
    step_s: f64,
    /// Shortest step.
    least_m: f64,
    /// The mass whose kinetic energy is the table's work: that of the impact if both agree.
    mass: f64,
}

impl MotionBuilder {
    fn begin(&mut self, d: f64, f: f64, v: f64) {
        self.motion.time_s.push(0.0);
        self.push_columns(d, f, v);
    }

    fn push_columns(&mut self, d: f64, f: f64, v: f64) {
        self.motion.deflection_m.push(d);
        self.motion.force_n.push(f);
        self.motion.closing_m_per_s.push(v);
    }

    /// Adds a state after the last; an error if the body does not get there.
    fn push(&mut self, d: f64, f: f64, v: f64) -> Result<(), Error> {
        let last = self.motion.time_s.len() - 1;
        let way = (d - self.motion.deflection_m[last]).abs();
        let sum = (v + self.motion.closing_m_per_s[last]).abs();
        let time_s = self.motion.time_s[last] + 2.0 * way / sum;
        // A step of no time would be no state, and one of endless time none either.
        if !(time_s.is_finite() && time_s > self.motion.time_s[last]) {
            return Err(endless());
        }
        self.motion.time_s.push(time_s);
        self.push_columns(d, f, v);
        Ok(())
    }

    /// Follows a path whose points are passed at `speeds`; `direction` is 1 where the deflection
    /// grows.
    fn push_branch(
        &mut self,
        path: &Branch<'_>,
        speeds: &[f64],
        direction: f64,
    ) -> Result<(), Error> {
        let most = self.motion.time_s.len() + path.d.len() + MAX_STATES;
        for i in 1..path.d.len() {
            let length = (path.d[i] - path.d[i - 1]).abs();
            let between =
                |values: &[f64], s: f64| values[i - 1] + (values[i] - values[i - 1]) * (s / length);
            let mut s = 0.0;
            loop {
                let v = self.motion.closing_m_per_s[self.motion.time_s.len() - 1].abs();
                let a = -direction * between(path.moving, s) / self.mass;
                let step = v * self.step_s + 0.5 * a * self.step_s * self.step_s;
                let step = step.max(SHORTEST * length).max(self.least_m);
                // The last steps share what is left, and a body that would stop goes to the end.
                if s + 1.25 * step >= length || v + a * self.step_s <= 0.0 {
                    break;
                }
                s += step;
                let moving = 0.5 * (path.moving[i - 1] + between(path.moving, s));
                let square = speeds[i - 1].powi(2) - direction * 2.0 * moving * s / self.mass;
                let d = path.d[i - 1] + direction * s;
                self.push(d, between(path.f, s), direction * square.max(0.0).sqrt())?;
                if self.motion.time_s.len() > most {
                    return Err(endless());
                }
            }
            self.push(path.d[i], path.f[i], speeds[i])?;
        }
        Ok(())
    }

    /// The unloading branch from the maximum deflection: the table's own, else a line.
    fn unloading(
        &mut self,
        table: &Table<'_>,
        impact: &Impact,
        end: usize,
    ) -> Result<[Vec<f64>; 3], Error> {
        let (d, f) = (table.deflection_m, table.force_n);
        let stated = impact.unloading_stiffness_n_per_m;
        if end + 1 < d.len() {
            let stated = stated.map_or("", |_| "; the stated stiffness is not used");
            self.motion.notes.push(format!("unloading: the table's own branch{stated}"));
            let moving = table.body_force_n.unwrap_or(f);
            return Ok([d, f, moving].map(|values| values[end..].to_vec()));
        }
        let stiffness = match stated {
            Some(stiffness) => {
                self.motion.notes.push(format!(
                    "unloading: a line of {} from the maximum deflection",
                    Shown::one_stiffness(stiffness)
                ));
                stiffness
            }
            None => {
                // Where only jumps rise, how steep is a matter of the width that a reader gave them.
                let [steepest, of_jumps] = steepest_rises(d, f);
                if steepest <= 0.0 {
                    let how = if of_jumps > 0.0 { "rises by jumps alone" } else { "never rises" };
                    return Err(error!(
                        Other,
                        "the curve {how}, so its unloading stiffness must be given: --unloading 80MN/m"
                    ));
                }
                self.motion.warnings.push(format!(
                    "unloading: neither the file nor --unloading gives it; the steepest rise, {}, is used: give --unloading …MN/m",
                    Shown::one_stiffness(steepest)
                ));
                steepest
            }
        };
        let moving = table.body_force_n.unwrap_or(f)[end];
        let (d, f) = (d[end], f[end]);
        let body = impact.body_unloading_stiffness_n_per_m.filter(|_| table.body_force_n.is_some());
        let body = body.unwrap_or(stiffness * moving / f);
        let (ends, moving_ends) = (f / stiffness, moving / body);
        if ends.max(moving_ends) > d * (1.0 + 1e-9) {
            let (stiffness_n_per_m, least_n_per_m) = (stiffness, f / d);
            // So far off, a unit is wrong rather than the stiffness.
            let remedy = match least_n_per_m > 10.0 * stiffness_n_per_m {
                true => "check the units of the table and of the stiffness",
                false => "give a stiffer one with --unloading",
            };
            return Err(error!(
                Other,
                "the unloading stiffness {stiffness_n_per_m} N/m is softer than the line from the maximum deflection to zero ({least_n_per_m} N/m), which is impossible in a crash: {remedy}"
            ));
        }
        let mut way = vec![0.0, ends.min(moving_ends), ends.max(moving_ends)];
        // Two ends a rounding error apart are one.
        way.dedup_by(|b, a| (*b - *a).abs() <= 1e-9 * d);
        let falls = |top: f64, end: f64| {
            way.iter().map(|x| (top * (1.0 - x / end)).max(0.0)).collect::<Vec<f64>>()
        };
        let (mut force, mut moving) = (falls(f, ends), falls(moving, moving_ends));
        // After both ends there is no force, whatever rounding leaves of it.
        for values in [&mut force, &mut moving] {
            values.pop();
            values.push(0.0);
        }
        Ok([way.iter().map(|x| d - x).collect(), force, moving])
    }

    /// Free motion at the last speed.
    fn push_free_flight(&mut self) -> Result<(), Error> {
        let last = self.motion.time_s.len() - 1;
        let (d, v) = (self.motion.deflection_m[last], self.motion.closing_m_per_s[last]);
        let begin_s = self.motion.time_s[last];
        let steps = (FREE_S / self.step_s).ceil().max(2.0) as usize;
        for k in 1..=steps {
            let after_s = k as f64 * self.step_s;
            self.motion.time_s.push(begin_s + after_s);
            self.push_columns(d + v * after_s, 0.0, v);
        }
        Ok(())
    }
}
