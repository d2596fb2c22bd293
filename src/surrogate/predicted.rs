//! The predicted curve: the master format of exports, and its conversions.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Warning;
use super::band::Band;
use super::max_crush::{MaxCrush, MaxCrushRule};
use crate::curve::{CurveUnloading, Envelope, ForceCurve, ForceKind, Parameter};
use crate::dataset::OTHER_MASS;
use crate::error::{Error, ErrorCode, error};
use crate::unit::{SpeedKind, UnitSystem};

/// Least share of a vehicle's mass that its crush zone does not stop: the zone and its equipment are about a tenth.
const LEAST_FREE: f64 = 0.9;

/// A predicted curve: the master format of exports (JSON).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PredictedCurve {
    /// Loading branch to the maximum crush, from 0 on; of a recorded curve the first force need not be 0.
    pub deflection_m: Vec<f64>,
    /// Force in N, one value per deflection; `provenance.force_kind` states which force it is.
    #[serde(rename = "force_N")]
    pub force_n: Vec<f64>,
    /// Band around the force, where the model gives one.
    #[serde(rename = "force_low_N", default, skip_serializing_if = "Option::is_none")]
    pub force_low_n: Option<Vec<f64>>,
    /// Upper end of the band.
    #[serde(rename = "force_high_N", default, skip_serializing_if = "Option::is_none")]
    pub force_high_n: Option<Vec<f64>>,
    /// The force that moves the body, where `force_N` is what the obstacle feels, which also
    /// stops mass in the crush zone ahead of the body. It drives single-mass bodies.
    #[serde(rename = "body_force_N", default, skip_serializing_if = "Option::is_none")]
    pub body_force_n: Option<Vec<f64>>,
    /// Band around the body force, where the model gives one.
    #[serde(rename = "body_force_low_N", default, skip_serializing_if = "Option::is_none")]
    pub body_force_low_n: Option<Vec<f64>>,
    /// Upper end of that band.
    #[serde(rename = "body_force_high_N", default, skip_serializing_if = "Option::is_none")]
    pub body_force_high_n: Option<Vec<f64>>,
    /// Forces between which the members of a forest's leaves lie, if the model keeps them. They
    /// show how the training points scatter, not the distance from FE.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forest_quantiles: Option<ForestQuantiles>,
    /// Unloading stiffness that belongs to `force_N`, from its maximum crush: that of the
    /// rebound where one is known, else the measured one, at least the steepest rise.
    #[serde(rename = "unloading_stiffness_N_per_m")]
    pub unloading_stiffness_n_per_m: f64,
    /// The same for `body_force_N`.
    #[serde(
        rename = "body_unloading_stiffness_N_per_m",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub body_unloading_stiffness_n_per_m: Option<f64>,
    /// Which runs `force_N` may drive.
    #[serde(default)]
    pub drives: String,
    /// Which runs `body_force_N` may drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_drives: Option<String>,
    /// The rebound from the maximum crush.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rebound: Option<Rebound>,
    /// Maximum crush, in m: the last deflection.
    pub max_deflection_m: f64,
    /// Speed that the curve is for, in m/s.
    pub speed_m_per_s: f64,
    /// What that speed is measured against.
    pub speed_kind: SpeedKind,
    /// Mass of the body, or of each body of a pair.
    pub mass_kg: f64,
    /// How the forces continue beyond the maximum crush; absent for a recorded curve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beyond: Option<Beyond>,
    /// Integral of force over deflection.
    #[serde(rename = "energy_J")]
    pub energy_j: f64,
    /// Name of the model.
    pub model: String,
    /// What a user should know before using the curve.
    pub warnings: Vec<Warning>,
    /// Where it comes from and how it was checked.
    pub provenance: Provenance,
}

/// The forces beyond the maximum crush, along faster runs: neighbours in a train keep pushing
/// where a body by itself would have stopped. They are those of the runs: exports and trains multiply them by one factor, so that
/// they begin with the last force of the curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Beyond {
    /// Largest crush of the model's runs, in m: beyond it the forces are an assumption.
    pub data_end_m: f64,
    /// Increasing, from the maximum crush on.
    pub deflection_m: Vec<f64>,
    /// Force in N, one value per deflection.
    #[serde(rename = "force_N")]
    pub force_n: Vec<f64>,
    /// The same of the body force, where it is another.
    #[serde(rename = "body_force_N", default, skip_serializing_if = "Option::is_none")]
    pub body_force_n: Option<Vec<f64>>,
}

/// Quantiles of a regression forest (Meinshausen, JMLR 7, 2006) along the curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ForestQuantiles {
    /// Share of the members' weight between the two.
    pub level: f64,
    /// Lower quantile in N, one value per deflection.
    #[serde(rename = "low_N")]
    pub low_n: Vec<f64>,
    /// Upper quantile in N, one value per deflection.
    #[serde(rename = "high_N")]
    pub high_n: Vec<f64>,
}

/// How the bodies separate after the maximum crush.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Rebound {
    /// In m/s; a line over the impact speed, relative to the force before the maximum crush.
    pub speed_m_per_s: f64,
    /// Unloading stiffness from the maximum crush that gives this speed: `F²/(m v²)` with the
    /// force and mass of the body.
    #[serde(rename = "stiffness_N_per_m")]
    pub stiffness_n_per_m: f64,
    /// Mean magnitude of its error at the inner speeds that were left out, relative to FE's; absent for recorded cases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out_error: Option<f64>,
}

/// Where a predicted curve comes from and how it was checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Provenance {
    /// Program and version.
    pub written_by: String,
    /// Group of cases that the model was trained on.
    pub group: String,
    /// Name of the recorded case; absent for a predicted curve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub case: Option<String>,
    /// Which force the recipe declares.
    pub force_kind: ForceKind,
    /// Hash over the training cases.
    pub training_hash: String,
    /// Units of the training runs' files: what an export to their solver is written in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub study_units: Option<UnitSystem>,
    /// Speeds of the training cases, in m/s, increasing.
    pub training_speeds_m_per_s: Vec<f64>,
    /// Whether the speed lies within those of training.
    pub in_range: bool,
    /// The training speed nearest to this one, in m/s.
    pub nearest_training_speed_m_per_s: f64,
    /// Distance to it, in m/s.
    pub distance_to_nearest_m_per_s: f64,
    /// How the maximum crush was found; absent for a recorded curve, which has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_crush_rule: Option<MaxCrushRule>,
    /// The maximum crush by every rule.
    pub(crate) max_crush: MaxCrush,
    /// `mv²/2` against a wall, `μ v_r²/2` of a pair.
    #[serde(rename = "kinetic_energy_J")]
    pub kinetic_energy_j: f64,
    /// Energy of the curve over the kinetic energy.
    pub energy_over_kinetic: f64,
    /// The same for the body force, where it is another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_energy_over_kinetic: Option<f64>,
    /// The band around the declared force at this speed, and what it rests on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band: Option<Band>,
    /// The same for the body force, where it is another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_band: Option<Band>,
    /// Values of the model's further parameters.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Parameter>,
}

impl Beyond {
    /// Whether it has a number for each point, and the forces that its curve has.
    fn check(&self, has_body_force: bool) -> Result<(), Error> {
        let end_m = self.data_end_m;
        if !(end_m > 0.0 && end_m.is_finite()) {
            return Err(error!(Prediction, "beyond.data_end_m is {end_m}: expected more than 0"));
        }
        let points = self.deflection_m.len();
        let body = self.body_force_n.as_ref().map(Vec::len);
        // A curve whose body force was removed has no use for what is left of it here.
        let suits = body.map_or(!has_body_force, |body| body == points);
        if self.force_n.len() != points || !suits {
            return Err(error!(
                Prediction,
                "beyond has {points} deflections, {} values of force_N and {} of body_force_N: expected one for each force of the curve",
                self.force_n.len(),
                body.unwrap_or(0)
            ));
        }
        let forces_n = self.force_n.iter().chain(self.body_force_n.iter().flatten());
        match forces_n.into_iter().find(|f| **f < 0.0) {
            Some(force_n) => Err(error!(
                Prediction,
                "a force of beyond is {force_n} N, below 0: an interface only pushes"
            )),
            None => Ok(()),
        }
    }

    fn envelope(&self, force_n: &[f64]) -> Result<Envelope, Error> {
        let from_origin = |values: &[f64]| std::iter::once(&0.0).chain(values).copied().collect();
        Envelope::new(from_origin(&self.deflection_m), from_origin(force_n))
            .map_err(|error| invalid(error).of("beyond"))
    }
}

impl Provenance {
    /// The band of each force that has one, the declared force first.
    pub fn bands(&self) -> impl Iterator<Item = (ForceKind, Band)> {
        let declared = self.band.map(|band| (self.force_kind, band));
        declared.into_iter().chain(self.body_band.map(|band| (ForceKind::Body, band)))
    }
}

impl PredictedCurve {
    /// Peak force, in N.
    pub(crate) fn peak_force_n(&self) -> f64 {
        self.force_n.iter().copied().fold(0.0, f64::max)
    }

    /// Mass of the other body of a pair, in kg; `None` against a wall.
    pub(crate) fn other_mass_kg(&self) -> Option<f64> {
        match (self.speed_kind, self.provenance.parameters.get(OTHER_MASS)) {
            (SpeedKind::Wall, _) => None,
            (SpeedKind::Closing, Some(Parameter::Number(other))) => Some(*other),
            (SpeedKind::Closing, _) => Some(self.mass_kg),
        }
    }

    /// The loading branch as a function.
    pub(crate) fn envelope(&self) -> Result<Envelope, Error> {
        let stiffness = self.unloading_stiffness_n_per_m;
        if !(stiffness > 0.0 && stiffness.is_finite()) {
            return Err(error!(
                Prediction,
                "unloading_stiffness_N_per_m is {stiffness}: expected more than 0"
            ));
        }
        for (name, value) in [
            ("speed_m_per_s", Some(self.speed_m_per_s)),
            ("mass_kg", Some(self.mass_kg)),
            ("max_deflection_m", Some(self.max_deflection_m)),
            ("body_unloading_stiffness_N_per_m", self.body_unloading_stiffness_n_per_m),
        ] {
            if let Some(value) = value.filter(|v| !(*v > 0.0 && v.is_finite())) {
                return Err(error!(Prediction, "{name} is {value}: expected more than 0"));
            }
        }
        let end = self.deflection_m.last().copied().unwrap_or_default();
        if (end / self.max_deflection_m - 1.0).abs() > SAME_END {
            return Err(error!(
                Prediction,
                "max_deflection_m is {}, but the points end at {end} m", self.max_deflection_m
            ));
        }
        for (name, values) in [
            ("force_low_N", &self.force_low_n),
            ("force_high_N", &self.force_high_n),
            ("body_force_N", &self.body_force_n),
            ("body_force_low_N", &self.body_force_low_n),
            ("body_force_high_N", &self.body_force_high_n),
        ] {
            if let Some(values) = values
                && values.len() != self.force_n.len()
            {
                return Err(error!(
                    Prediction,
                    "{name} has {} values, force_N {}",
                    values.len(),
                    self.force_n.len()
                ));
            }
        }
        for (name, low, high) in [
            ("force", &self.force_low_n, &self.force_high_n),
            ("body_force", &self.body_force_low_n, &self.body_force_high_n),
        ] {
            let mut edges = low.iter().flatten().zip(high.iter().flatten());
            if let Some(point) = edges.position(|(low, high)| low > high) {
                return Err(error!(
                    Prediction,
                    "{name}_low_N of point {point} is above {name}_high_N"
                ));
            }
        }
        if let Some(beyond) = self.own_beyond() {
            beyond.check(self.body_force_n.is_some())?;
        }
        let envelope = envelope(self.deflection_m.clone(), self.force_n.clone())?;
        pushing("force_N", envelope)
    }

    /// Deflection up to which curve and continuation rest on runs, in m.
    pub(crate) fn data_end_m(&self) -> f64 {
        self.own_beyond().map_or(self.max_deflection_m, |beyond| beyond.data_end_m)
    }

    /// What lies beyond the maximum crush, if it belongs to these points and not to others that they
    /// have replaced.
    fn own_beyond(&self) -> Option<&Beyond> {
        let begins =
            |beyond: &Beyond| beyond.deflection_m.first().map(|d| d / self.max_deflection_m);
        self.beyond.as_ref().filter(|b| begins(b).is_some_and(|at| (at - 1.0).abs() <= SAME_END))
    }

    /// The force `force_N` beyond the maximum crush, as an envelope from (0, 0).
    pub(crate) fn beyond_envelope(&self) -> Result<Option<Envelope>, Error> {
        self.own_beyond().map(|beyond| beyond.envelope(&beyond.force_n)).transpose()
    }

    /// The curve of one force alone, with the unloading and the band that belong to it. The
    /// quantiles are of the declared force only.
    ///
    /// # Errors
    /// If it does not have that force, or its points are not an envelope.
    pub fn of_force(&self, kind: ForceKind) -> Result<Self, Error> {
        match (kind, self.provenance.force_kind) {
            (ForceKind::Contact, ForceKind::Body) => Err(
                error!(Prediction at "force", "the curve has a body force and no contact force, because its study's recipe names none or it was exported with --force body: use the body force"),
            ),
            (ForceKind::Contact, ForceKind::Contact) => self.of_contact_force(),
            (ForceKind::Body, _) => self.of_body_force(),
        }
    }

    fn of_contact_force(&self) -> Result<Self, Error> {
        let stiffness =
            self.stiffness_where_stopped(&self.envelope()?, ForceKind::Contact, ForceKind::Contact);
        let mut curve = self.clone();
        curve.unloading_stiffness_n_per_m = stiffness;
        if let Some(rebound) = &mut curve.rebound {
            rebound.stiffness_n_per_m = stiffness;
        }
        curve.without_second_force();
        Ok(curve)
    }

    fn of_body_force(&self) -> Result<Self, Error> {
        let envelope = self.driving_envelope()?;
        let mut curve = self.clone();
        curve.unloading_stiffness_n_per_m =
            self.stiffness_where_stopped(&envelope, ForceKind::Body, ForceKind::Body);
        if self.body_force_n.is_none() {
            return Ok(curve);
        }
        curve.energy_j = envelope.work();
        curve.force_n = envelope.force_n().to_vec();
        (curve.force_low_n, curve.force_high_n) =
            (curve.body_force_low_n.take(), curve.body_force_high_n.take());
        if let Some(beyond) = &mut curve.beyond
            && let Some(body) = beyond.body_force_n.take()
        {
            beyond.force_n = body;
        }
        curve.forest_quantiles = None;
        curve.drives = ForceKind::Body.drives().into();
        curve.provenance.force_kind = ForceKind::Body;
        curve.provenance.energy_over_kinetic =
            self.provenance.body_energy_over_kinetic.unwrap_or(self.provenance.energy_over_kinetic);
        curve.provenance.band = self.provenance.body_band;
        curve.without_second_force();
        Ok(curve)
    }

    fn without_second_force(&mut self) {
        self.body_force_n = None;
        (self.body_force_low_n, self.body_force_high_n) = (None, None);
        self.body_unloading_stiffness_n_per_m = None;
        if let Some(beyond) = &mut self.beyond {
            beyond.body_force_n = None;
        }
        self.body_drives = None;
        self.provenance.body_energy_over_kinetic = None;
        self.provenance.body_band = None;
    }

    /// Unloading stiffness with which a run leaves an envelope of one of the curve's forces where that has taken up the energy of the
    /// impact. The energy of the rebound is the same whichever force it comes from, but that a contact force below the body's
    /// drives less mass, down to [`LEAST_FREE`] of it: the rest is stopped in the crush zone.
    /// In a model of one mass a contact force drives all of it, and `drives` is the body's; `of` is the force of the envelope.
    pub(crate) fn stiffness_where_stopped(
        &self,
        envelope: &Envelope,
        of: ForceKind,
        drives: ForceKind,
    ) -> f64 {
        let top_n = |of: &Envelope| stopping_force_n(of, self.provenance.kinetic_energy_j);
        let driving_n = self.driving_envelope().map(|driving| top_n(&driving));
        let share =
            |of: &Envelope| driving_n.as_ref().map_or(1.0, |driving_n| top_n(of) / driving_n);
        let free = match (drives, &self.body_force_n) {
            // Of the curve itself: the edge of a band drives the same mass.
            (ForceKind::Contact, Some(_)) => {
                self.envelope().map_or(1.0, |own| share(&own).clamp(LEAST_FREE, 1.0))
            }
            _ => 1.0,
        };
        let share = share(envelope);
        let without_rebound = || {
            let of_body = self.body_unloading_stiffness_n_per_m;
            of_body.filter(|_| of == ForceKind::Body).unwrap_or(self.unloading_stiffness_n_per_m)
        };
        self.rebound
            .map(|r| r.stiffness_n_per_m * share * share / free)
            .filter(|k| *k > 0.0 && k.is_finite())
            .unwrap_or_else(without_rebound)
    }

    /// The curve of one force that drives a single-mass body.
    ///
    /// # Errors
    /// If the curve does not have that force, or its points are not an envelope.
    pub fn driving(&self, force: ForceKind) -> Result<ForceCurve, Error> {
        self.driving_member(force, None, false)
    }

    /// The curve of one force that drives an interface, of vehicles with crush zones of their own mass if `is_split`, with `member`
    /// of the half width of this force's band added, from −1 (lower edge) to 1.
    pub(crate) fn driving_member(
        &self,
        force: ForceKind,
        member: Option<f64>,
        is_split: bool,
    ) -> Result<ForceCurve, Error> {
        let mut loading = match (force, self.provenance.force_kind) {
            (ForceKind::Contact, ForceKind::Body) => {
                return Err(
                    error!(Prediction at "force", "the curve has a body force and no contact force, because its study's recipe names none or it was exported with --force body: use the body force"),
                );
            }
            (ForceKind::Contact, ForceKind::Contact) => self.envelope()?,
            (ForceKind::Body, _) => self.driving_envelope()?,
        };
        if let Some(member) = member {
            loading = self.band_member(force, &loading, member)?;
        }
        let beyond = self.own_beyond().map(|beyond| {
            let of_body = beyond.body_force_n.as_ref().filter(|_| force == ForceKind::Body);
            beyond.envelope(of_body.unwrap_or(&beyond.force_n))
        });
        // The force law keeps to its bounds by itself; the one constant is for other tools.
        let drives = if is_split { force } else { ForceKind::Body };
        let unloading =
            CurveUnloading::Stiffness(self.stiffness_where_stopped(&loading, force, drives));
        Ok(ForceCurve {
            unloading,
            kind: Some(force),
            speed_kind: Some(self.speed_kind),
            speed_m_per_s: Some(self.speed_m_per_s),
            data_end_m: Some(self.data_end_m()),
            beyond: beyond.transpose()?,
            ..ForceCurve::bare(loading)
        })
    }

    /// Lower and upper edge of the band of one of its forces, in N.
    fn edges(&self, force: ForceKind) -> (Option<&Vec<f64>>, Option<&Vec<f64>>) {
        if force == ForceKind::Body && self.body_force_n.is_some() {
            (self.body_force_low_n.as_ref(), self.body_force_high_n.as_ref())
        } else {
            (self.force_low_n.as_ref(), self.force_high_n.as_ref())
        }
    }

    fn band_member(
        &self,
        force: ForceKind,
        loading: &Envelope,
        member: f64,
    ) -> Result<Envelope, Error> {
        if !(-1.0..=1.0).contains(&member) {
            return Err(error!(Prediction, "band = {member}: expected from -1 to 1"));
        }
        let (low_n, high_n) = self.edges(force);
        let edge_n = if member < 0.0 { low_n } else { high_n };
        let edge_n = edge_n.ok_or_else(|| {
            let mut why =
                format!("there is no band around its {} force: remove band", force.name());
            if self.force_low_n.is_some() {
                why += ", or train the model again";
            }
            error!(Prediction, "{}", why)
        })?;
        let moved = |(force, edge): (&f64, &f64)| (force + member.abs() * (edge - force)).max(0.0);
        let force_n = loading.force_n().iter().zip(edge_n).map(moved).collect();
        envelope(loading.deflection_m().to_vec(), force_n)
    }

    /// The curve that moves a single-mass body: the body force, or the only force there is.
    pub(crate) fn driving_envelope(&self) -> Result<Envelope, Error> {
        let declared = self.envelope()?;
        match &self.body_force_n {
            Some(force_n) => {
                let envelope = envelope(self.deflection_m.clone(), force_n.clone())?;
                pushing("body_force_N", envelope)
            }
            None if self.provenance.force_kind == ForceKind::Contact => Err(
                error!(Prediction at "force", "the curve has a contact force and no body force: use the contact force, or predict it again with a model whose runs record velocities"),
            ),
            None => Ok(declared),
        }
    }
}

/// The force in N that stops a body of this energy, the last one of a curve that does not. A contact force stops it before the
/// end of its curve: mass in the crush zone is stopped by it as well.
pub(super) fn stopping_force_n(envelope: &Envelope, kinetic_j: f64) -> f64 {
    let end_m = envelope.end_m();
    let stop_m = envelope.deflection_for_work(kinetic_j).map_or(end_m, |d| d.min(end_m));
    envelope.force_at(stop_m)
}

/// The last point may differ by this share from the stated maximum crush.
const SAME_END: f64 = 1e-6;

/// An envelope of the forces called `name`, none of which pulls.
fn pushing(name: &str, envelope: Envelope) -> Result<Envelope, Error> {
    match envelope.first_pulling_point() {
        Some(point) => {
            Err(error!(Prediction, "{name} of point {point} is below 0: an interface only pushes"))
        }
        None => Ok(envelope),
    }
}

/// The envelope of a predicted curve.
pub(super) fn envelope(deflection_m: Vec<f64>, force_n: Vec<f64>) -> Result<Envelope, Error> {
    Envelope::new(deflection_m, force_n).map_err(invalid)
}

/// The error of a predicted curve that is not an envelope.
pub(crate) fn invalid(error: Error) -> Error {
    error.coded_as(ErrorCode::Prediction).of("the predicted curve is invalid")
}
