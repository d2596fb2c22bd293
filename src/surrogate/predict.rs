//! Prediction in stages: query → motion of the body → the declared force and the maximum
//! crush by every rule → the curve to one of them, with its audit and warnings.
//!
//! Order of work: body force → motion u(d) → maximum crush → declared force at these speeds → band → audit. The motion
//! makes `rate` more than an interpolation.
//!
//! A model has two forces. The **declared** one is the recipe's: it is exported and compared along FE's crush. The
//! **body force**, −m dv/dt of the recorded closing speed with CFC 60 (`curve/body`), drives a single-mass body. FE's own
//! contact force in a one-mass model misses FE's velocity by some per cent, because the crush zone
//! stops part of the mass early.
//!
//! Unloading: FE curves begin with a rise far steeper than the line of the rebound. One stiffness for both would have
//! to be the steep one (otherwise a deflection creates energy) and would lose most of the rebound. A predicted curve has one
//! stiffness per force, from its maximum crush, which gives the measured separation speed (`rebound`). The body force
//! of the bundled runs rises less steeply than that, so tools with one constant get the rebound and create no energy.
//! Exports take the body force by default and also state its steepest rise.

use super::band::{self, Band};
use super::max_crush::{MaxCrush, MaxCrushRule, chosen};
use super::predicted::{Beyond, ForestQuantiles, PredictedCurve, Provenance, envelope};
use super::query::{Query, ResolvedQuery};
use super::warning::is_unlike;
use super::{Model, QueryPoint, Warning};
use crate::curve::{EnergyAudit, Envelope, ForceCurve, ForceKind, is_beyond};
use crate::dataset::{MASS, OTHER_MASS, grid, nearest};
use crate::error::{Error, error};

/// Points of a predicted curve besides (0, 0), as in the reference data.
const POINTS: usize = 400;
/// The body's motion is followed to this share of the longest training curve.
const REACH: f64 = 1.5;

/// The curve of `model` at the speed of `query`, with its audit and warnings.
///
/// # Errors
/// If the speed is not above 0 or far outside the training speeds, a parameter is missing, the rule gives no
/// maximum crush, or an energy correction is out of bounds.
pub fn predict(model: &Model, query: &Query) -> Result<PredictedCurve, Error> {
    let prediction = Prediction::new(model, query)?;
    prediction.curve(prediction.rule())
}

/// The curve of one force that drives an interface, with what lies beyond its maximum crush;
/// `member` of its band's half width added, from −1 (lower edge) to 1. With `is_split` a contact force
/// drives vehicles whose crush zones have masses of their own, else all of their mass.
///
/// For the body's own force the declared one is not examined: many interfaces of a train or a
/// sweep ask for the former alone.
///
/// # Errors
/// As [`predict`]; also if the model has no such force, or no band.
pub fn predict_driving(
    model: &Model,
    query: &Query,
    force: ForceKind,
    member: Option<f64>,
    is_split: bool,
) -> Result<(ForceCurve, Vec<Warning>), Error> {
    let motion = Motion::new(model, query)?;
    let needs_declared = motion.rule() == MaxCrushRule::Energy
        || query.energy_correct
        || member.is_some()
        || !model.has_body_force();
    if force == ForceKind::Body && !needs_declared {
        return motion.driving();
    }
    let prediction = Prediction::of(motion)?;
    let curve = prediction.curve(prediction.rule())?;
    Ok((curve.driving_member(force, member, is_split)?, curve.warnings))
}

/// The motion that the body force gives, beyond any maximum crush.
struct Motion<'a> {
    asked: ResolvedQuery<'a>,
    query: &'a Query,
    /// Body force over even deflections.
    body: Envelope,
}

impl<'a> Motion<'a> {
    fn new(model: &'a Model, query: &'a Query) -> Result<Self, Error> {
        let asked = ResolvedQuery::new(model, query)?;
        let longest = model.cases.iter().map(|c| c.max_deflection_m).fold(0.0, f64::max);
        let along = grid(REACH * longest, POINTS);
        let force_n = model.body_force_n(&asked.at(), &along);
        let force_n = without_spikes(model, &along, force_n, true)?;
        let body = envelope(along, force_n)?;
        Ok(Self { asked, query, body })
    }

    fn rule(&self) -> MaxCrushRule {
        self.asked.rule(self.query)
    }

    /// The declared force in N, at the speeds that the motion gives at these deflections.
    fn declared_n(&self, deflection_m: &[f64]) -> Result<Vec<f64>, Error> {
        let ResolvedQuery { model, v, mass_kg, .. } = self.asked;
        if !model.has_body_force() {
            return Ok(deflection_m.iter().map(|&d| self.body.force_at(d)).collect());
        }
        let closing_at = |&d: &f64| (v * v - 2.0 * self.body.work_to(d) / mass_kg).max(0.0).sqrt();
        let closing: Vec<f64> = deflection_m.iter().map(closing_at).collect();
        let at = QueryPoint { closing_m_per_s: Some(&closing), ..self.asked.at() };
        without_spikes(model, deflection_m, model.force_n(&at, deflection_m), false)
    }

    /// The body's force to the maximum crush and how it unloads, without the declared force.
    fn driving(self) -> Result<(ForceCurve, Vec<Warning>), Error> {
        let Self { asked, body: beyond, .. } = &self;
        let model = asked.model;
        // The energy rule's answer, which needs the declared force, is not asked for.
        let crush = asked.max_crush(beyond, beyond);
        let deflection_m = evenly(chosen(&crush, self.rule())?);
        let force_n = deflection_m.iter().map(|&d| beyond.force_at(d)).collect();
        let loading = envelope(deflection_m, force_n)?;
        let unloading = asked.unloading_n_per_m();
        let mut warnings = model.warnings(&asked.at());
        warnings.extend(asked.warnings(unloading, loading.work() / asked.kinetic_energy_j));
        let stiffness_n_per_m = match asked.rebound(&loading) {
            Some(rebound) => rebound.stiffness_n_per_m,
            None => unloading.unwrap_or(0.0).max(loading.max_slope()),
        };
        let curve = ForceCurve {
            beyond: Some(beyond.clone()),
            data_end_m: Some(model.data_end_m(&asked.at())),
            speed_kind: Some(model.speed_kind),
            speed_m_per_s: Some(asked.v),
            ..ForceCurve::of_body(loading).unloading_with(stiffness_n_per_m)
        };
        Ok((curve, warnings))
    }
}

/// What a prediction is before a rule for the maximum crush is chosen: the forces beyond any
/// crush, and the crush by every rule. One such serves all rules.
pub(crate) struct Prediction<'a> {
    motion: Motion<'a>,
    /// Declared force over the same even deflections as the body's.
    declared: Envelope,
    crush: MaxCrush,
}

/// Both forces to the maximum crush.
struct Forces {
    declared: Envelope,
    body: Option<Envelope>,
}

impl Forces {
    /// The force that moves the body.
    fn moving(&self) -> &Envelope {
        self.body.as_ref().unwrap_or(&self.declared)
    }
}

impl<'a> Prediction<'a> {
    /// The stages that no rule for the maximum crush changes.
    pub(crate) fn new(model: &'a Model, query: &'a Query) -> Result<Self, Error> {
        Self::of(Motion::new(model, query)?)
    }

    fn of(motion: Motion<'a>) -> Result<Self, Error> {
        let along = motion.body.deflection_m();
        let declared = envelope(along.to_vec(), motion.declared_n(along)?)?;
        let crush = motion.asked.max_crush(&declared, &motion.body);
        Ok(Self { motion, declared, crush })
    }

    /// The rule that the query names, or the model's own.
    pub(crate) fn rule(&self) -> MaxCrushRule {
        self.motion.rule()
    }

    /// The curve to the maximum crush of one rule.
    pub(crate) fn curve(&self, rule: MaxCrushRule) -> Result<PredictedCurve, Error> {
        let deflection_m = evenly(chosen(&self.crush, rule)?);
        let motion = &self.motion;
        let declared_n = motion.declared_n(&deflection_m)?;
        let mut forces =
            Forces { declared: envelope(deflection_m.clone(), declared_n)?, body: None };
        if motion.asked.model.has_body_force() {
            let body_n = deflection_m.iter().map(|&d| motion.body.force_at(d)).collect();
            forces.body = Some(envelope(deflection_m, body_n)?);
        }
        let mut warnings = motion.asked.model.warnings(&motion.asked.at());
        if motion.query.energy_correct {
            let factor = self.correction(forces.moving())?;
            forces.declared = scaled(&forces.declared, factor)?;
            forces.body = forces.body.map(|body| scaled(&body, factor)).transpose()?;
            warnings.push(Warning::energy_corrected(factor));
        }
        Ok(self.report(rule, forces, warnings))
    }

    /// The factor that gives the force that moves the body the impact's energy. A contact force also stops the crush zone's
    /// mass, so its own work may exceed that energy: it is scaled like the body's.
    fn correction(&self, moving: &Envelope) -> Result<f64, Error> {
        let factor = self.motion.asked.kinetic_energy_j / moving.work();
        if !(CORRECTION.0..=CORRECTION.1).contains(&factor) {
            return Err(error!(
                Prediction,
                "the energy correction would multiply the force by {factor:.3}, outside {low} to {high}: scaling is not the remedy; check mass, speed and the rule for the maximum crush",
                low = CORRECTION.0,
                high = CORRECTION.1
            ));
        }
        Ok(factor)
    }

    /// The forces from a maximum crush on.
    fn beyond(&self, max_crush_m: f64) -> Beyond {
        let Motion { asked, body, .. } = &self.motion;
        // Whole intervals of the curve, so that what goes on with it keeps its table even.
        let interval_m = max_crush_m / POINTS as f64;
        let on_grid = |d: f64| max_crush_m + ((d - max_crush_m) / interval_m).ceil() * interval_m;
        let further = body.deflection_m().iter().filter(|&&d| d > max_crush_m).map(|&d| on_grid(d));
        let mut deflection_m: Vec<f64> = std::iter::once(max_crush_m).chain(further).collect();
        deflection_m.dedup();
        if deflection_m.len() == 1 {
            // Further than the motion is followed: the last force is held.
            deflection_m.push(max_crush_m + interval_m);
        }
        let along = |force: &Envelope| deflection_m.iter().map(|&d| force.force_at(d)).collect();
        let force_n = along(&self.declared);
        let body_force_n = asked.model.has_body_force().then(|| along(body));
        let data_end_m = asked.model.data_end_m(&asked.at());
        Beyond { data_end_m, deflection_m, force_n, body_force_n }
    }

    /// The band around one force, with both branches where the collapse mode changes; what was reported for the other
    /// force is not repeated.
    fn banded(&self, force: ForceKind, envelope: &Envelope, warnings: &mut Vec<Warning>) -> Banded {
        let asked = &self.motion.asked;
        let band = asked.model.band(&asked.at(), force).unwrap_or_else(|warning| {
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
            None
        });
        let alone = band.filter(|band| band.curves == 1).map(|_| Warning::band_of_one());
        warnings.extend(alone.filter(|alone| !warnings.contains(alone)));
        let edges = band.map(|band| {
            let (mut low_n, mut high_n) = band.around(envelope.force_n());
            for branch in asked.model.branches(asked.v, force) {
                for (i, &d) in envelope.deflection_m().iter().enumerate() {
                    if branch.reaches(d) {
                        low_n[i] = low_n[i].min(branch.force_at(d).max(0.0));
                        high_n[i] = high_n[i].max(branch.force_at(d));
                    }
                }
            }
            (low_n, high_n)
        });
        let (low_n, high_n) = edges.unzip();
        Banded { band, low_n, high_n }
    }

    /// The curve with everything that is known of it.
    fn report(
        &self,
        rule: MaxCrushRule,
        forces: Forces,
        mut warnings: Vec<Warning>,
    ) -> PredictedCurve {
        let Self { motion: Motion { asked, .. }, crush, .. } = self;
        let (model, v, at) = (asked.model, asked.v, asked.at());
        let Forces { declared, body } = forces;
        let over_kinetic = |envelope: &Envelope| envelope.work() / asked.kinetic_energy_j;
        let energy = over_kinetic(&declared);
        let body_energy = body.as_ref().map(over_kinetic);
        // With a crush law the contact force stops the crush zone's mass besides, so the body's counts; so it does where it was
        // corrected.
        let is_moving = model.crush_law.is_some() || self.motion.query.energy_correct;
        let is_worse = |other: &f64| is_moving || (other - 1.0).abs() > (energy - 1.0).abs();
        let unloading = asked.unloading_n_per_m();
        warnings.extend(asked.warnings(unloading, body_energy.filter(is_worse).unwrap_or(energy)));
        if is_moving && body_energy.is_some_and(|e| (e - 1.0).abs() <= EnergyAudit::TOLERANCE) {
            warnings.extend(contact_mismatch(model, energy));
        }
        warnings.extend(asked.unlike_peak(&declared));
        let (crush_m, data_end_m) = (declared.end_m(), model.data_end_m(&asked.at()));
        let longest_m = model.largest_crush_m();
        if is_beyond(crush_m, data_end_m) {
            let by_speed_m = crush.monotone_m.filter(|_| !model.contains(&asked.at()));
            let of = if data_end_m < longest_m { "nearest run" } else { "training runs" };
            warnings.push(Warning::beyond_data(crush_m, (data_end_m, of), by_speed_m));
        }
        // Between the training speeds no curve that was left out goes on there: a mass does that. Nor above them if the fastest run is
        // cut, so that it could not be left out.
        let is_beyond = is_beyond(crush_m, longest_m)
            && (model.contains(&asked.at()) || model.fastest_is_truncated());
        let ratio = asked.mass_kg / model.masses().effective_kg();
        let without_band = match () {
            () if is_unlike(ratio) && !(model.has(MASS) || model.has(OTHER_MASS)) => {
                Some("the mass is nowhere near the training runs'")
            }
            () if is_beyond => {
                Some("no left-out curve goes on beyond the crush of the training runs")
            }
            () => None,
        };
        if let Some(why) = without_band {
            warnings.extend(match model.band(&at, model.force_kind) {
                Ok(band) => band.map(|_| Warning::no_band(why)),
                Err(warning) => Some(warning),
            });
        }
        let mut banded = |force, envelope| match without_band {
            None => self.banded(force, envelope, &mut warnings),
            Some(_) => Banded::default(),
        };
        let own = banded(model.force_kind, &declared);
        let of_body = body.as_ref().map(|b| banded(ForceKind::Body, b)).unwrap_or_default();
        let end = declared.end_m();
        let mut curve = PredictedCurve {
            // Without a rebound a softer unloading than the steepest rise would create energy.
            unloading_stiffness_n_per_m: unloading.unwrap_or(0.0).max(declared.max_slope()),
            body_unloading_stiffness_n_per_m: body
                .as_ref()
                .map(|b| unloading.unwrap_or(0.0).max(b.max_slope())),
            drives: model.force_kind.drives().into(),
            body_drives: body.as_ref().map(|_| ForceKind::Body.drives().into()),
            rebound: asked.rebound(body.as_ref().unwrap_or(&declared)),
            max_deflection_m: end,
            energy_j: declared.work(),
            deflection_m: declared.deflection_m().to_vec(),
            force_n: declared.force_n().to_vec(),
            force_low_n: own.low_n,
            force_high_n: own.high_n,
            beyond: Some(self.beyond(end)),
            body_force_n: body.as_ref().map(|b| b.force_n().to_vec()),
            body_force_low_n: of_body.low_n,
            body_force_high_n: of_body.high_n,
            forest_quantiles: model
                .fitted
                .forest()
                .and_then(|forest| forest.quantiles(&at, declared.deflection_m(), band::LEVEL))
                .map(|(low_n, high_n)| ForestQuantiles { level: band::LEVEL, low_n, high_n }),
            speed_m_per_s: v,
            speed_kind: model.speed_kind,
            mass_kg: asked.masses.body_kg,
            model: model.name().into(),
            warnings,
            provenance: Provenance {
                band: own.band,
                body_band: of_body.band,
                ..provenance(asked, rule, *crush, (energy, body_energy))
            },
        };
        curve.unloading_stiffness_n_per_m =
            curve.stiffness_where_stopped(&declared, model.force_kind, model.force_kind);
        curve.body_unloading_stiffness_n_per_m =
            body.map(|b| curve.stiffness_where_stopped(&b, ForceKind::Body, ForceKind::Body));
        curve
    }
}

/// If the contact force absorbs less or more of the impact's energy than in any of the runs: it also stops the mass of the crush
/// zone, so that theirs is not 1 either.
fn contact_mismatch(model: &Model, energy: f64) -> Option<Warning> {
    let runs = model.work_over_energy().map(|(_, ratio)| ratio);
    let (least, most) = runs.fold((f64::INFINITY, 0.0), |(l, m), of| (of.min(l), of.max(m)));
    let usual = least - EnergyAudit::TOLERANCE..=most + EnergyAudit::TOLERANCE;
    (least <= most && !usual.contains(&energy))
        .then(|| Warning::contact_energy_mismatch(energy, (least, most)))
}

/// The force times `factor`.
fn scaled(level: &Envelope, factor: f64) -> Result<Envelope, Error> {
    let force_n = level.force_n().iter().map(|f| factor * f).collect();
    envelope(level.deflection_m().to_vec(), force_n)
}

/// The band of one force and its edges in N; empty where there is none.
#[derive(Default)]
struct Banded {
    band: Option<Band>,
    low_n: Option<Vec<f64>>,
    high_n: Option<Vec<f64>>,
}

/// Where the curve comes from and how it was checked, without its bands; energies over the kinetic one are those of
/// the declared force and of the body's.
fn provenance(
    asked: &ResolvedQuery<'_>,
    rule: MaxCrushRule,
    crush: MaxCrush,
    (energy, body_energy): (f64, Option<f64>),
) -> Provenance {
    let (model, v) = (asked.model, asked.v);
    let around = model.speeds_around(&asked.at());
    let nearest = around[nearest(around.iter().copied(), v)];
    let mut parameters = asked.parameters.clone();
    let is_unequal = asked.masses.other_kg.is_some_and(|other| other != asked.masses.body_kg);
    parameters.retain(|name, _| {
        // Without it the other body of a pair has the mass of the first.
        is_unequal && name == OTHER_MASS || model.features.iter().any(|f| f.parameter == *name)
    });
    Provenance {
        case: None,
        written_by: concat!("crumple ", env!("CARGO_PKG_VERSION")).into(),
        group: model.group.clone(),
        force_kind: model.force_kind,
        training_hash: model.training_hash.clone(),
        study_units: model.study_units,
        training_speeds_m_per_s: model.cases.iter().map(|c| c.speed_m_per_s).collect(),
        in_range: model.contains(&asked.at()),
        nearest_training_speed_m_per_s: nearest,
        distance_to_nearest_m_per_s: (nearest - v).abs(),
        max_crush_rule: Some(rule),
        max_crush: crush,
        kinetic_energy_j: asked.kinetic_energy_j,
        energy_over_kinetic: energy,
        body_energy_over_kinetic: body_energy,
        band: None,
        body_band: None,
        parameters,
    }
}

/// Even deflections to the end.
fn evenly(end_m: f64) -> Vec<f64> {
    // The last point is the end itself, not its rounding.
    let inner = (0..POINTS).map(|i| end_m * i as f64 / POINTS as f64);
    inner.chain([end_m]).collect()
}

/// Bounds of an energy correction: beyond them level or crush is wrong, not the scale.
pub(super) const CORRECTION: (f64, f64) = (0.8, 1.25);

/// A point stands alone if its force lies above both neighbours, or below both, by more than
/// this factor of what any training curve shows.
const SPIKE: f64 = 1.05;
/// Most rounds of taking points back.
const ROUNDS: usize = 100;
/// Most places of a training curve that are examined.
const PROBES: f64 = 4_000.0;

/// Forces of a physical loading branch: 0 at 0, never negative, and no point that stands
/// alone as none of a training curve does. A force that begins with a step reaches its first value at the second point, so that its first
/// peak is kept.
fn without_spikes(
    model: &Model,
    deflection_m: &[f64],
    force_n: Vec<f64>,
    of_body: bool,
) -> Result<Vec<f64>, Error> {
    if force_n.iter().any(|f| !f.is_finite()) {
        return Err(error!(
            Prediction,
            "the {model} model cannot predict this speed: train another one",
            model = model.name()
        ));
    }
    let mut force_n: Vec<f64> = force_n.into_iter().map(|f| f.max(0.0)).collect();
    force_n[1] = force_n[1].max(force_n[0]);
    force_n[0] = 0.0;
    let step = deflection_m[1] - deflection_m[0];
    // How far a point lies above both of its neighbours, or below both.
    let stands_out = |before: f64, at: f64, after: f64| {
        let (a, b) = (at - before, at - after);
        if a * b > 0.0 { a.abs().min(b.abs()) } else { 0.0 }
    };
    let most = model.most_kink_n(of_body, step, |curves| {
        let mut most = 0.0_f64;
        // Of many curves 20 that are spread over the speeds show how far points stand out.
        for curve in curves.iter().step_by(curves.len().div_ceil(20).max(1)) {
            // Far finer steps than the curve's own find no other kinks.
            let probes = (2.0 * curve.end_m() / step).clamp(2.0, PROBES) as usize;
            let even = (0..probes)
                .map(|k| step + (curve.end_m() - 2.0 * step).max(0.0) * k as f64 / probes as f64);
            // A point at a corner stands out most.
            let corners = curve.envelope().deflection_m().iter().copied();
            let corners = corners.filter(|&d| d >= step && d + step <= curve.end_m());
            let mut near = [0; 3];
            for d in even.chain(corners.take(PROBES as usize)) {
                let mut force_n = |i: usize, d| curve.envelope().force_near(&mut near[i], d);
                let [a, b, c] = [force_n(0, d - step), force_n(1, d), force_n(2, d + step)];
                most = most.max(stands_out(a, b, c));
            }
        }
        most
    });
    // Taking one point back may leave its neighbour standing: a few rounds settle it.
    for _ in 0..ROUNDS {
        let mut settled = true;
        for i in 2..force_n.len() - 1 {
            let (before, after) = (force_n[i - 1], force_n[i + 1]);
            if most > 0.0 && stands_out(before, force_n[i], after) > SPIKE * most {
                force_n[i] = 0.5 * (before + after);
                settled = false;
            }
        }
        if settled {
            break;
        }
    }
    Ok(force_n)
}
