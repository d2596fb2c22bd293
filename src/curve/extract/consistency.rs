//! Consistency of the histories of one record along time: impulse against momentum, displacement against velocity,
//! force against motion, the output interval against the curve.

use super::ExtractError;
use super::record::Record;
use super::start::FromContact;
use super::{Measured, Notes};
use crate::curve::contact::milliseconds;
use crate::curve::energy::{IMPOSSIBLE_ALONG_TIME, ImpossibleRun, POSSIBLE};
use crate::curve::{Curve, Masses, body, loading};
use crate::history::History;
use crate::signal::{cfc, derivative, integral, interpolate};
use crate::unit::Shown;

/// Impulse and lost momentum of clean FE runs differ by 1 to 4 % of the impact's momentum at any
/// time; a clock that is 10 ms off makes it 11 to 45 %.
const IMPULSE: f64 = 0.08;
/// Displacement and the integral of the velocity differ by 0.02 % of the range in clean runs, by
/// 0.07 % where only every 6 ms are written.
const DISPLACEMENT: f64 = 0.005;
/// A force after the contact counts from this share of the peak on, and from this share of the
/// momentum.
const LATE_FORCE: (f64, f64) = (0.15, 0.02);
/// A body that has lost less than this share of its speed, under an impulse of half its momentum,
/// does not move by that force.
const SLOWED: f64 = 0.05;
/// A body whose speed at contact is less than this share of what it gains is at rest.
const AT_REST: f64 = 0.02;
/// Fewer output intervals up to the maximum crush than this may cut peaks.
const STATES: usize = 100;
/// Effect of the sampling on the curve, as a share of its mean force, that deserves a warning.
const SAMPLED_OFF: f64 = 0.02;
/// Where two histories of one record cannot be one run's.
const OTHER_FILES: &str = "likely files of two runs, the wrong node or wall, or shifted times";
/// A peak is a spike above these multiples of its neighbours and of all others.
const SPIKE: (f64, f64) = (2.5, 1.2);
/// Masses of two bodies whose ratio differs from that of their changes of velocity by more are doubtful.
const RATIO: f64 = 0.25;
/// Those whose inverse ratio differs by no more are swapped.
const SWAPPED: f64 = 0.1;
/// Gravity changes half of the speed in half of a flight; what has changed less than this share of it begins later.
const SUDDEN: f64 = 0.2;
/// Neither gravity nor brakes change a speed faster, in m/s².
const STEEPEST: f64 = 40.0;
/// Free flight in fewer states says nothing of gravity.
const FLIGHT: usize = 5;
/// Work of another force, as a share of the kinetic energy, that deserves a warning.
const OTHER_WORK: f64 = 0.01;

/// Where two quantities that should be one differ along time.
#[derive(Default)]
struct Difference {
    /// The largest, as a share.
    largest: f64,
    /// When it first exceeds its limit.
    since_s: Option<f64>,
}

impl Difference {
    fn of(shares: impl Iterator<Item = (f64, f64)>, limit: f64) -> Self {
        let mut difference = Self::default();
        for (time_s, share) in shares {
            if share > limit && difference.since_s.is_none() {
                difference.since_s = Some(time_s);
            }
            difference.largest = difference.largest.max(share);
        }
        difference
    }
}

/// The displacement against the integral of the velocity, over the whole record.
pub(super) fn displacement(record: &Record) -> Result<Notes, ImpossibleRun> {
    let mut remarks = Notes::default();
    let (t, d) = (&record.time_s, &record.deflection_m);
    let range = |values: &[f64]| {
        let ends = |(low, high): (f64, f64), &v: &f64| (low.min(v), high.max(v));
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        high - low
    };
    let travelled = integral(t, &record.rate_m_per_s);
    let range_m = range(d).max(range(&travelled));
    if record.missing_velocity.is_some() || range_m <= 0.0 {
        return Ok(remarks);
    }
    let off = |i: usize| (t[i], (d[i] - d[0] - travelled[i]).abs() / range_m);
    let Difference { largest, since_s } = Difference::of((0..t.len()).map(off), DISPLACEMENT);
    let Some(since_s) = since_s else { return Ok(remarks) };
    let found = format!(
        "displacement: from {} on it deviates from the integral of the velocity by up to {:.1} % of its range",
        milliseconds(since_s),
        largest * 100.0
    );
    if largest > IMPOSSIBLE_ALONG_TIME {
        return Err(ImpossibleRun::of_histories(found, OTHER_FILES));
    }
    remarks.warn(format!("{found}: one of the two is damaged, scaled or from another node"));
    Ok(remarks)
}

/// Of two bodies, whether their changes of velocity are in the ratio of their masses while they close: `m₁Δv₁ = −m₂Δv₂`.
/// Brakes change the velocities as well, but little in that time.
pub(super) fn masses(measured: &Measured<'_>, masses: Masses) -> Option<String> {
    let changes = |history: &History| -> Vec<f64> {
        history.values.iter().map(|v| v - history.values[0]).collect()
    };
    let velocities = [measured.velocity?, measured.minus_velocity?];
    let closing = velocities[0].values.iter().zip(&velocities[1].values).map(|(a, b)| a - b);
    let first = velocities[0].values.first()? - velocities[1].values.first()?;
    let states = closing.take_while(|closing| closing * first > 0.0).count();
    let [own, other] = velocities.map(changes);
    let sum = |of: &dyn Fn(usize) -> f64| -> f64 { (0..states).map(of).sum() };
    let found = -sum(&|i| own[i] * other[i]) / sum(&|i| other[i] * other[i]);
    let stated = masses.other_kg? / masses.body_kg;
    let off = |stated: f64| (found / stated).max(stated / found) - 1.0;
    (found.is_finite() && found > 0.0 && off(stated) > RATIO).then(|| {
        let what_to_do = match off(1.0 / stated) > SWAPPED {
            true => "one of them is wrong, the node of another body, or brakes act on one",
            false => "they are swapped",
        };
        format!(
            "mass: by the velocity changes of the two bodies, the other one has {found:.3} times the mass of the first, by the study {stated:.3} times ({} and {}): {what_to_do}",
            Shown::one_mass(masses.body_kg),
            Shown::one_mass(stated * masses.body_kg)
        )
    })
}

/// What a filter takes from the work up to the maximum deflection: the pulses of a short impact are not noise. `recorded_n`
/// ends with the states of `filtered`.
pub(super) fn filter(class: u32, filtered: &Curve, recorded_n: &[f64]) -> Option<String> {
    // The first of the curve lies between two states.
    let states = 1..loading::loading_end(filtered) + 1;
    let recorded = &recorded_n[recorded_n.len() + 1 - filtered.force_n().len()..];
    let (force, path) = (filtered.force_n(), filtered.deflection_m());
    let kept = cfc::work_kept(&force[states.clone()], &recorded[..states.len()], &path[states]);
    (kept < cfc::KEPT).then(|| {
        format!(
            "filter: CFC{class} removes {:.1} % of the work of the force, because the impact is short or begins with a sharp peak: use a higher class, or filter = \"none\"",
            100.0 * (1.0 - kept)
        )
    })
}

/// A peak that is a single state, far above its neighbours and all others: damage, or an output
/// interval that is too long.
pub(super) fn spike(time_s: &[f64], force_n: &[f64]) -> Option<String> {
    let peak = (0..force_n.len()).max_by(|&a, &b| force_n[a].total_cmp(&force_n[b]))?;
    let beside = force_n.get(peak.checked_sub(1)?)?.max(*force_n.get(peak + 1)?).max(0.0);
    let others = force_n.iter().enumerate().filter(|(k, _)| *k != peak).map(|(_, f)| *f);
    let others = others.fold(0.0, f64::max);
    (force_n[peak] > SPIKE.0 * beside && force_n[peak] > SPIKE.1 * others).then(|| {
        format!(
            "force: the peak of {} is a single state, at {}; its neighbours reach {}, all other states {}: check whether it is damaged",
            Shown::one_force(force_n[peak]),
            milliseconds(time_s[peak]),
            Shown::one_force(beside),
            Shown::one_force(others)
        )
    })
}

/// A curve from contact on, with the closing speeds at its states.
pub(super) struct Motion<'a> {
    pub contact: &'a FromContact,
    pub masses: Masses,
    /// First state after the maximum deflection at which the force is gone.
    pub end: usize,
}

impl<'a> Motion<'a> {
    pub(super) fn of(contact: &'a FromContact, masses: Masses) -> Self {
        let force_n = contact.curve.force_n();
        let from = loading::loading_end(&contact.curve);
        let peak_n = force_n[..=from].iter().copied().fold(0.0, f64::max);
        let gone = (from..force_n.len()).find(|&i| force_n[i] <= LATE_FORCE.0 * peak_n);
        Self { contact, masses, end: gone.unwrap_or(force_n.len() - 1) }
    }

    fn momentum_ns(&self) -> f64 {
        self.masses.effective_kg() * self.contact.closing_m_per_s[0]
    }

    fn at(&self, i: usize) -> f64 {
        self.contact.time_s + self.contact.curve.time_s()[i]
    }

    fn lost_ns(&self, from: usize, to: usize) -> f64 {
        let closing = &self.contact.closing_m_per_s;
        self.masses.effective_kg() * (closing[from] - closing[to])
    }

    /// Refuses a body that the force does not slow down.
    pub(super) fn is_free(&self) -> Result<(), ExtractError> {
        let curve = &self.contact.curve;
        let last = loading::loading_end(curve);
        let closing = &self.contact.closing_m_per_s;
        let slowest = closing[..last].iter().copied().fold(f64::INFINITY, f64::min);
        let fastest = closing[..last].iter().copied().fold(0.0, f64::max);
        let impulse = integral(curve.time_s(), curve.force_n())[last];
        let is_slowed = slowest < (1.0 - SLOWED) * closing[0];
        if closing[0] > 0.0 && (is_slowed || impulse < 0.5 * self.momentum_ns()) {
            return Ok(());
        }
        if closing[0].abs() < AT_REST * fastest {
            let found = "the body does not move at first and gains speed under the force, as if a moving wall hit it: the deflection would be the wall's way less the body's";
            return Err(ExtractError::Prescribed(found.into()));
        }
        if closing[0] <= 0.0 {
            return Err(ExtractError::Standing);
        }
        Err(ExtractError::Prescribed(format!(
            "the motion is prescribed: the body keeps its {:.4} m/s up to the maximum deflection, although the force would have stopped it {:.1} times over",
            closing[0],
            impulse / self.momentum_ns()
        )))
    }

    /// The impulse of the force against the lost momentum, at every state of the contact, and of
    /// each force pulse after it.
    pub(super) fn momentum(&self) -> Result<Notes, ImpossibleRun> {
        let mut remarks = Notes::default();
        let (time_s, force_n) = (self.contact.curve.time_s(), self.contact.curve.force_n());
        let whole_ns = self.momentum_ns();
        if whole_ns <= 0.0 {
            return Ok(remarks);
        }
        let impulse = integral(time_s, force_n);
        let off = |i: usize| (self.at(i), (impulse[i] - self.lost_ns(0, i)).abs() / whole_ns);
        let Difference { largest, since_s } = Difference::of((0..=self.end).map(off), IMPULSE);
        if let Some(since_s) = since_s {
            let found = format!(
                "impulse: from {} on it deviates from the body's change of momentum by up to {:.1} % of the impact's momentum",
                milliseconds(since_s),
                largest * 100.0
            );
            if largest > IMPOSSIBLE_ALONG_TIME {
                return Err(ImpossibleRun::of_histories(found, OTHER_FILES));
            }
            remarks.warn(format!(
                "{found}: the times of force and motion differ, the force acts on another body, the recipe lacks part of it, or a heavy crush zone stops long before the body"
            ));
        }
        let peak_n = force_n[..=self.end].iter().copied().fold(0.0, f64::max);
        let is_late = |i: &usize| force_n[*i] > LATE_FORCE.0 * peak_n;
        let mut from = self.end + 1;
        while let Some(first) = (from..force_n.len()).find(is_late) {
            let past = (first..force_n.len()).find(|i| !is_late(i));
            let last = past.unwrap_or(force_n.len() - 1);
            let given_ns = impulse[last] - impulse[first - 1];
            let lost_ns = self.lost_ns(first - 1, last);
            if given_ns > LATE_FORCE.1 * whole_ns && (given_ns - lost_ns).abs() > 0.5 * given_ns {
                remarks.warn(format!(
                    "force: between {} and {}, after the contact, its impulse is {}, but the momentum changes by {lost}: this force, of up to {}, does not act on this body",
                    milliseconds(self.at(first)),
                    milliseconds(self.at(last)),
                    Shown::one_impulse(given_ns),
                    Shown::one_force(
                        force_n[first..=last].iter().copied().fold(0.0, f64::max)
                    ),
                    lost = Shown::one_impulse(lost_ns),
                ));
            }
            from = last + 1;
        }
        Ok(remarks)
    }

    /// The mass that the contact force implies for a body force: mass times acceleration is in
    /// balance with every mass.
    pub(super) fn mass(&self, record: &Record) -> Result<Notes, ImpossibleRun> {
        let mut remarks = Notes::default();
        let Some(contact) = &record.contact else { return Ok(remarks) };
        let end = loading::loading_end(&self.contact.curve);
        let (from_s, to_s) = (self.at(0), self.at(end));
        let within = |t: f64| t > from_s && t < to_s;
        let inner = contact.time_s.iter().copied().filter(|&t| within(t));
        let times: Vec<f64> = std::iter::once(from_s).chain(inner).chain([to_s]).collect();
        let lost_ns = self.lost_ns(0, end);
        let Ok(force_n) = interpolate(&contact.time_s, &contact.values, &times) else {
            return Ok(remarks);
        };
        if lost_ns < 0.1 * self.momentum_ns() {
            return Ok(remarks);
        }
        let ratio = integral(&times, &force_n)[times.len() - 1] / lost_ns;
        let found = format!(
            "mass: up to the maximum crush the impulse of the contact force is {ratio:.3} times the momentum lost by {}; it would fit {}",
            Shown::one_mass(self.masses.body_kg),
            Shown::one_mass(ratio * self.masses.body_kg)
        );
        // Other contacts may act as well, but none pulls.
        if ratio > POSSIBLE.1 {
            return Err(ImpossibleRun::of_histories(
                found,
                "likely the mass of the run, or the node of the force",
            ));
        }
        if (ratio - 1.0).abs() > IMPULSE {
            let or = if ratio < 1.0 { ", or other forces act besides this contact" } else { "" };
            remarks.warn(format!("{found}: the mass of the run is wrong{or}"));
        }
        Ok(remarks)
    }

    /// What another force than the recipe's does to the body, seen in its flight before contact.
    pub(super) fn flight(&self, record: &Record, remarks: &mut Notes) {
        let contact_s = self.contact.time_s;
        // A motion that is coarser than the force is interpolated from its last state before the contact on.
        let own_s = record.motion_time_s.iter().flatten().copied();
        let until_s = own_s.take_while(|t| *t <= contact_s).last().unwrap_or(contact_s);
        let states = record.time_s.partition_point(|&t| t < contact_s && t <= until_s);
        let curve = &self.contact.curve;
        let crush_m = curve.deflection_m()[loading::loading_end(curve)];
        if states < FLIGHT || record.missing_velocity.is_some() {
            return;
        }
        let (first, last) = (record.rate_m_per_s[0].abs(), record.rate_m_per_s[states - 1].abs());
        let rate = (last - first) / (record.time_s[states - 1] - record.time_s[0]);
        let energy = 0.5 * self.contact.closing_m_per_s[0].powi(2);
        let share = rate * crush_m / energy;
        let halfway = record.rate_m_per_s[states / 2].abs();
        let is_sudden = (halfway - first).abs() < SUDDEN * (last - first).abs();
        if share.abs() > OTHER_WORK && (is_sudden || rate.abs() > STEEPEST) {
            remarks.warn(format!(
                "free flight: the speed changes by {:.3} m/s before contact, in a way that neither gravity nor brakes explain: the force is recorded late, or another one acts before it: check the times of both files",
                last - first
            ));
        } else if share.abs() > OTHER_WORK {
            remarks.warn(format!(
                "free flight: before contact the speed changes by {rate:.2} m/s² (gravity, brakes, friction); energy and stopped mass neglect this force, whose work over the crush is {:.1} % of the kinetic energy",
                share * 100.0
            ));
        }
    }
}

/// Whether the output interval is short enough for the curve, by what it would be without every second
/// state; and what the recipe's common times make of it.
pub(super) fn sampling(original: &Curve, sampled: &Curve, remarks: &mut Notes) {
    let end = loading::loading_end(original);
    let interval_ms = |t: &[f64], n: usize| 1e3 * (t[n] - t[0]) / n.max(1) as f64;
    let halved: Vec<f64> = original.time_s().iter().copied().step_by(2).collect();
    let halved = off_at(original, &halved).unwrap_or(0.0);
    if end < STATES && end > 0 {
        let found = format!(
            "sampling: the record has {end} states up to the maximum crush, one every {:.3} ms; dropping every second one changes the curve by {:.1} % of its mean force",
            interval_ms(original.time_s(), end),
            halved * 100.0
        );
        if halved > SAMPLED_OFF {
            remarks.warn(format!("{found}: a similar error may remain between the recorded states, and peaks are cut off; write histories at shorter intervals"));
        } else {
            remarks.note(found);
        }
    }
    if let Some(off) = off_at(original, sampled.time_s()).filter(|&off| off > SAMPLED_OFF) {
        remarks.warn(format!(
            "sampling: the common times, one every {:.3} ms, change the curve by {:.1} % of its mean force: in a study shorten interval_ms (the database keeps the record's own states as well)",
            interval_ms(sampled.time_s(), sampled.time_s().len() - 1),
            off * 100.0
        ));
    }
}

/// Whether the motion, whose states are at `own_s` from contact on, is written often enough beside a force with more
/// states: by the body force that this force would give, with the velocities known at these times alone.
pub(super) fn coarse_motion(
    original: &Curve,
    (sampled, closing_m_per_s): (&Curve, &[f64]),
    masses: Masses,
    own_s: &[f64],
) -> Option<String> {
    let (at, times) = (original.time_s(), sampled.time_s());
    let (end, last_s) = (loading::loading_end(original), times[times.len() - 1]);
    let inner = |until_s: f64| own_s.iter().copied().filter(move |&t| t > 0.0 && t < until_s);
    let states = inner(at[end]).count() + 1;
    if states >= STATES || states >= end {
        return None;
    }
    let impulse = integral(at, original.force_n());
    let known_s: Vec<f64> = std::iter::once(0.0).chain(inner(last_s)).chain([last_s]).collect();
    let whole = interpolate(at, &impulse, times).ok()?;
    let known = interpolate(at, &impulse, &known_s).ok()?;
    let known = interpolate(&known_s, &known, times).ok()?;
    let (_, class) = body::body_force_of(sampled, closing_m_per_s, masses.effective_kg());
    let force = |impulse: &[f64]| {
        let raw = derivative(times, impulse);
        class.map_or(Some(raw.clone()), |class| Some(cfc::filter(class, times, &raw).ok()?.values))
    };
    let (whole, known) = (force(&whole)?, force(&known)?);
    let loading = 0..=loading::loading_end(sampled);
    let sum = |of: &dyn Fn(usize) -> f64| loading.clone().map(|i| of(i).abs()).sum::<f64>();
    let off = sum(&|i| known[i] - whole[i]) / sum(&|i| whole[i]);
    (off > SAMPLED_OFF).then(|| {
        format!(
            "sampling: the motion has {states} states up to the maximum crush, one every {:.3} ms, and the force {end}: without what lies between them the body force is off by about {:.1} % of its mean; write the nodes' histories at shorter intervals",
            1e3 * at[end] / states as f64,
            off * 100.0
        )
    })
}

/// Difference of a curve and of its states at other times, joined by lines, over the loading
/// branch: mean over the deflection, as a share of the mean force.
fn off_at(curve: &Curve, times_s: &[f64]) -> Option<f64> {
    let (t, d, f) = (curve.time_s(), curve.deflection_m(), curve.force_n());
    let end = loading::loading_end(curve);
    if times_s.len() < 2 || end == 0 {
        return None;
    }
    let force = interpolate(t, f, times_s).ok()?;
    let reached = times_s[times_s.len() - 1];
    let inner: Vec<f64> = t[..=end].iter().copied().filter(|&t| t <= reached).collect();
    let lines = interpolate(times_s, &force, &inner).ok()?;
    let width = |i: usize| 0.5 * (d[(i + 1).min(end)] - d[i.saturating_sub(1)]).abs();
    let over = |value: &dyn Fn(usize) -> f64| -> f64 {
        (0..inner.len()).map(|i| value(i).abs() * width(i)).sum()
    };
    let whole = over(&|i| f[i]);
    (whole > 0.0).then(|| over(&|i| lines[i] - f[i]) / whole)
}
