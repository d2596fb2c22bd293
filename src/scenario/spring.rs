//! Springs: the curve of a source at one interface, and its force law.
//!
//! Ends of vehicles from models: crush force, rate and stopped mass at one end, and the plates
//! that meet.
//!
//! Models give speed and deflection against a wall, or of two equal ends together. An end takes
//! half of the deflection of two, twice their reduced stopped mass, and twice their stiffness.

use std::sync::Arc;

use super::layout::{Connection, End, Role};
use super::{CurveSource, CurveTable as Table, LawName};
use crate::curve::force_curve::ForceCurveError;
use crate::curve::{CurveUnloading, Envelope, ForceCurve, ForceKind, Tail};
use crate::error::{Error, ErrorCode, error};
use crate::multibody::{
    Damping, EnvelopeEnd, ForceLaw, Interface, RateFactor, Stopping, Unloading,
};
use crate::surrogate::crush_law::{CrushCurve, CrushLaw, per_crush_force};
use crate::surrogate::predict::predict_driving;
use crate::surrogate::{Model, PredictedCurve, Query, QueryPoint, Warning};
use crate::unit::{Shown, SpeedKind};

/// The curve at one interface, with its warnings.
pub(super) struct Spring {
    pub curve: ForceCurve,
    pub end: EnvelopeEnd,
    pub warnings: Vec<String>,
}

/// The error of a factor on the force that is not above 0.
pub(super) fn scale_error(factor: f64) -> Error {
    error!(Scenario at "scale", "scale = {factor}: expected more than 0")
}

/// The error of a curve that is not an envelope, or none any more.
fn envelope_error(error: Error) -> Error {
    error.coded(ErrorCode::Scenario)
}

/// The error of a model that gives no curve, at the key that decides it.
fn predict_error(error: Error) -> Error {
    error.coded_as(ErrorCode::Prediction).or_at_key("model")
}

/// The curve of a source that the interface needs, at `speed_m_per_s` if a model gives it.
pub(super) fn spring(
    source: &CurveSource,
    table: &Table,
    slot: &Connection<'_>,
    speed_m_per_s: f64,
) -> Result<Spring, Error> {
    let (declared, has_body) = match source {
        CurveSource::Model(model) => (Some(model.force_kind), model.has_body_force()),
        CurveSource::Predicted(curve) => {
            (Some(curve.provenance.force_kind), curve.body_force_n.is_some())
        }
        CurveSource::Case(case) => {
            let is_contact = case.curves.force_kind == ForceKind::Contact;
            (Some(case.curves.force_kind), is_contact && !case.has_contact_alone())
        }
        CurveSource::Curve(curve, _) => (curve.kind, curve.kind == Some(ForceKind::Body)),
        CurveSource::Stages(_) => (None, false),
    };
    let force = which_force(table.force, slot, declared, has_body)?;
    if table.band.is_some() && !matches!(source, CurveSource::Model(_) | CurveSource::Predicted(_))
    {
        return Err(error!(
            Scenario at "band",
            "band needs a model or a predicted curve (.json), which has one"
        ));
    }
    let (mut curve, mut warnings) = match source {
        CurveSource::Model(model) => of_model(model, table, slot, speed_m_per_s, force)?,
        CurveSource::Predicted(curve) => of_predicted(curve, table, slot, force)?,
        CurveSource::Curve(curve, changes) => {
            let unknown = curve.kind.is_none().then(|| UNKNOWN_FORCE.into());
            let warnings = changes.iter().cloned().chain(unknown).collect();
            ((**curve).clone(), warnings)
        }
        // A device between two bodies moves these, and no mass is stopped in it.
        CurveSource::Stages(envelope) => (ForceCurve::of_body(envelope.clone()), Vec::new()),
        CurveSource::Case(case) => {
            let truncated = case.is_truncated().then(|| "the run ended while loading".into());
            let curve = ForceCurve::of_case(case, force.unwrap_or(case.curves.force_kind));
            let mut curve = curve.map_err(|error| match error {
                ForceCurveError::Envelope(error) => envelope_error(error),
                ForceCurveError::NoMotion => {
                    error!(Scenario, "its samples contain no loading branch")
                }
            })?;
            let is_line = matches!(curve.unloading, CurveUnloading::Stiffness(_));
            if let Some(kind) = curve.kind.filter(|_| is_line && !case.has_contact_alone()) {
                // What it drives leaves it as it leaves predicted curves: with the rebound of the run, from where it stops.
                let driving = PredictedCurve::of_case(case)
                    .and_then(|of| of.driving_member(kind, None, slot.split));
                curve.unloading = driving.map_err(predict_error)?.unloading;
            }
            (curve, truncated.into_iter().collect())
        }
    };
    let only_contact = force != Some(ForceKind::Body) && curve.kind == Some(ForceKind::Contact);
    let stated = table.force.is_some() && !matches!(source, CurveSource::Curve(..));
    if only_contact && !stated && !slot.split && slot.role != Role::Within {
        warnings.push(ONLY_CONTACT.into());
    }
    if let Some(factor) = table.scale {
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(scale_error(factor));
        }
        curve = curve.scaled(factor).map_err(envelope_error)?;
    }
    // A file or a device says itself how far it goes; the curve of one impact only how far that went.
    let is_whole = matches!(source, CurveSource::Curve(..) | CurveSource::Stages(_));
    if !is_whole || table.end == Some(EnvelopeEnd::Bottom) {
        return Spring { curve, end: EnvelopeEnd::Bottom, warnings }.continued(table);
    }
    let goes_on = curve.data_end_m.is_some_and(|m| m < curve.loading.end_m());
    let usual = if goes_on { EnvelopeEnd::Slope } else { EnvelopeEnd::Hold };
    Ok(Spring { curve, end: table.end.unwrap_or(usual), warnings })
}

/// The curve of a model, with its warnings.
fn of_model(
    model: &Model,
    table: &Table,
    slot: &Connection<'_>,
    speed_m_per_s: f64,
    force: Option<ForceKind>,
) -> Result<(ForceCurve, Vec<String>), Error> {
    let query = Query {
        rule: table.max_crush,
        parameters: table.parameters.clone(),
        // Inside a train interfaces close far more slowly than any run by itself; that is warned
        // of, but a train without their curves could not run at all.
        extrapolate: true,
        ..Query::at(speed_m_per_s)
    }
    .between(model, slot.masses);
    let force = force.unwrap_or(model.force_kind);
    let (curve, warnings) =
        predict_driving(model, &query, force, table.band, slot.split).map_err(predict_error)?;
    Ok((curve, texts(&warnings)))
}

/// The curve of a predicted one that was read from a file.
fn of_predicted(
    curve: &PredictedCurve,
    table: &Table,
    slot: &Connection<'_>,
    force: Option<ForceKind>,
) -> Result<(ForceCurve, Vec<String>), Error> {
    let force = force.unwrap_or(curve.provenance.force_kind);
    let driving = curve.driving_member(force, table.band, slot.split).map_err(predict_error)?;
    Ok((driving, texts(&curve.warnings)))
}

fn texts(warnings: &[Warning]) -> Vec<String> {
    warnings.iter().map(Warning::to_string).collect()
}

/// Said of a file without `# force_kind`.
const UNKNOWN_FORCE: &str = "its file does not state which force it holds: taken as the body force; write \"# force_kind: body\" or \"# force_kind: contact\" into it, or force = \"…\" beside it";

/// Warning for a contact force that drives single-mass bodies without being requested.
const ONLY_CONTACT: &str = "it has a contact force only, which includes mass that the crush zone stops early and is wrong for a single-mass vehicle; use a body force, or split the vehicles (front, rear)";

/// The force that drives the interface: what was requested, or what the vehicles need; `None` for
/// the recipe's own. One mass per vehicle moves by the body force; where the crush zone has a mass
/// of its own, the contact force drives it, and a body force would count that mass twice.
fn which_force(
    asked: Option<ForceKind>,
    slot: &Connection<'_>,
    declared: Option<ForceKind>,
    has_body: bool,
) -> Result<Option<ForceKind>, Error> {
    if asked == Some(ForceKind::Contact) && declared == Some(ForceKind::Body) {
        return Err(predict_error(
            error!(Prediction at "force", "the curve has a body force and no contact force, because its study's recipe names none or it was exported with --force body: use the body force"),
        ));
    }
    if slot.split && slot.role != Role::Within && asked.or(declared) == Some(ForceKind::Body) {
        return Err(error!(
            Scenario at "force",
            "interface {} has a vehicle with a crush zone of its own mass, which a body force already contains: use a contact force, or no front and rear",
            slot.name
        ));
    }
    Ok(asked.or((has_body && !slot.split).then_some(ForceKind::Body)))
}

impl Spring {
    /// The curve of FE runs, continued as its table asks, or as exports are.
    pub(super) fn continued(self, table: &Table) -> Result<Self, Error> {
        let end = table.end.unwrap_or(EnvelopeEnd::Bottom);
        let tail = match end {
            EnvelopeEnd::Bottom => Tail::Bottom,
            EnvelopeEnd::Slope if self.curve.beyond.is_none() => Tail::None,
            EnvelopeEnd::Hold | EnvelopeEnd::Slope | EnvelopeEnd::Error => Tail::Hold,
        };
        let curve = match &table.unloading {
            Some(stiffness) => self.curve.unloading_with(stiffness.0),
            None => self.curve,
        };
        let rises =
            curve.unloading.stiffness_n_per_m().unwrap_or(curve.loading.steepest_rise()) > 0.0;
        let is_elastic = table.law == LawName::Elastic;
        if table.end == Some(EnvelopeEnd::Bottom) && is_elastic && !rises {
            return Err(
                error!(Scenario at "end", "it never rises, so it cannot bottom: write end = \"hold\""),
            );
        }
        let curve = curve.continued(tail).map_err(envelope_error)?;
        Ok(Self { curve, end, ..self })
    }

    /// The force law that the curve's table specifies, with all warnings.
    pub(crate) fn law_with_warnings(
        mut self,
        table: &Table,
    ) -> Result<(ForceLaw, Vec<String>), Error> {
        let unloading = match table.law {
            LawName::Elastic => Some(Unloading::Elastic),
            LawName::Memory | LawName::Rate => self.memory(table)?,
        };
        Ok((ForceLaw::of_curve(&self.curve, unloading, self.end), self.warnings))
    }

    fn memory(&mut self, table: &Table) -> Result<Option<Unloading>, Error> {
        let asked = table.unloading.map(|u| u.0);
        let known = self.curve.unloading.stiffness_n_per_m();
        let steepest = self.curve.loading.steepest_rise();
        let warnings = &mut self.warnings;
        if asked.is_none() && known.is_none() && steepest > 0.0 {
            warnings.push(format!(
                "it has no unloading stiffness: it unloads with its steepest rise, {}, which decides the rebound: set unloading = \"…MN/m\"",
                Shown::one_stiffness(steepest)
            ));
        }
        if let Some(asked) = asked
            // The tail of the curve rises with it, but for rounding.
            && asked < steepest * (1.0 - 1e-9)
            && table.stages.is_none()
        {
            warnings.push(format!(
                "unloading {} is softer than the curve's steepest rise ({}): there it unloads as steeply as it rises",
                Shown::one_stiffness(asked),
                Shown::one_stiffness(steepest)
            ));
        }
        if let (Some(asked), Some(stages)) = (asked, &table.stages) {
            let points = self.curve.loading.deflection_m().iter().zip(self.curve.loading.force_n());
            let begins = |&(d, _): &(&f64, &f64)| stages.first().is_some_and(|s| *d < s.stroke.0);
            let secants = points.skip_while(begins).map(|(d, f)| f / d);
            let secant = secants.fold(0.0, f64::max);
            let stroke_m = stages.first().map_or(0.0, |first| first.stroke.0);
            let is_softer = |share: &f64| {
                self.curve.loading.force_at(share * stroke_m) > asked * share * stroke_m
            };
            let until =
                (1..=100).map(|k| f64::from(k) / 100.0).filter(is_softer).fold(0.0, f64::max);
            if asked >= secant && until > MENTIONED {
                warnings.push(format!(
                    "unloading {} would return more than the first stage has absorbed, until it is crushed by {:.0} mm: up to there it unloads along the line to the origin, which is steeper",
                    Shown::one_stiffness(asked),
                    until * stroke_m * 1e3
                ));
            }
            if asked < secant {
                warnings.push(format!(
                    "unloading {} is softer than the line from the origin to the stages' forces ({} from the end of the first on, more before): there it unloads along that line, or more steeply where a force that steps up has absorbed less than that line would return",
                    Shown::one_stiffness(asked),
                    Shown::one_stiffness(secant)
                ));
            }
        }
        let stiffness = asked.or(known).unwrap_or(steepest);
        if stiffness.max(steepest) <= 0.0 || asked.is_none() && table.stages.is_some() {
            let (why, key) = match table.stages {
                Some(_) => ("has stages, which do not say how they unload", "stages"),
                None => ("never rises", ""),
            };
            return Err(error!(
                Scenario at key,
                "it {why}, so its unloading stiffness must be given: unloading = \"…MN/m\", or law = \"elastic\""
            ));
        }
        Ok(asked.map(|stiffness_n_per_m| Unloading::Memory { stiffness_n_per_m }))
    }
}

/// A larger share of the first stage within which it does not unload as stated is mentioned.
const MENTIONED: f64 = 0.25;

/// Stiffness and damping between two plates, or a plate and the wall: ten times as stiff as any end
/// we have seen, so that little of the crush is theirs, and damped enough not to ring.
const PLATES_N_PER_M: f64 = 5e9;
const PLATES_N_S_PER_M: f64 = 3e5;

/// A crush force as the chain takes it, with its warnings.
pub(super) struct Crush {
    /// Loads from (0, 0); of an end over its own deflection.
    pub curve: ForceCurve,
    pub rate: RateFactor,
    /// Of an end; between single-mass vehicles the curve contains it.
    pub stopping: Option<Stopping>,
    /// Speed at which the model was evaluated, in m/s of its kind.
    pub speed_m_per_s: f64,
    pub warnings: Vec<String>,
}

/// How an end counts what its model counts: two ends together, or one.
struct EndScaling {
    /// Model's deflection per deflection of the end.
    deflection: f64,
    /// Model's speed per closing speed of the two vehicles.
    speed: f64,
}

impl EndScaling {
    fn of(kind: SpeedKind, at: Role) -> Self {
        let against_wall = at == Role::Wall;
        match kind {
            SpeedKind::Wall => {
                Self { deflection: 1.0, speed: if against_wall { 1.0 } else { 0.5 } }
            }
            SpeedKind::Closing => {
                Self { deflection: 2.0, speed: if against_wall { 2.0 } else { 1.0 } }
            }
        }
    }

    /// The envelope over the deflection of the end, with values times `factor`.
    fn per_end(&self, of_model: &Envelope, factor: f64) -> Result<Envelope, Error> {
        let d = of_model.deflection_m().iter().map(|d| d / self.deflection).collect();
        let f = of_model.force_n().iter().map(|f| f * factor).collect();
        Envelope::new(d, f).map_err(below)
    }
}

fn below(error: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::below(ErrorCode::Scenario, error)
}

/// Least share of the give of end and plates together that is the end's.
const MIN_END_COMPLIANCE_SHARE: f64 = 0.1;

/// The end of a vehicle whose neighbours close at `closing_m_per_s`.
pub(super) fn crush_end(
    model: &Model,
    end: &End<'_>,
    vehicle_kg: f64,
    closing_m_per_s: f64,
    scale: f64,
) -> Result<Crush, Error> {
    let coordinates = EndScaling::of(model.speed_kind, end.at);
    let speed_m_per_s = coordinates.speed * closing_m_per_s;
    let (law, at) = crush_curve(model, speed_m_per_s)?;
    let loading = coordinates.per_end(&at.standing_n, scale)?;
    let stopped_kg = coordinates.per_end(&at.stopped_kg, coordinates.deflection)?;
    let stiffness = model.unloading_n_per_m(speed_m_per_s, vehicle_kg);
    // The plates give way, too: half as much for each of two ends.
    let plates_m_per_n = if end.at == Role::Wall { 1.0 } else { 0.5 } / PLATES_N_PER_M;
    let of_end = |k: f64| {
        let m_per_n = 1.0 / (k * coordinates.deflection * scale);
        1.0 / (m_per_n - plates_m_per_n).max(MIN_END_COMPLIANCE_SHARE * m_per_n)
    };
    let unloading = CurveUnloading::of(stiffness.map(of_end));
    let mut warnings = warnings(model, speed_m_per_s);
    if model.has_own_body_forces() && !model.knows_stopped_mass() {
        warnings.push(
            "its runs agree on no stopped mass, so the contact force moves the whole vehicle: a single-mass vehicle, which the body force moves, follows these runs more closely".into(),
        );
    }
    if model.speed_kind == SpeedKind::Wall && end.at != Role::Wall {
        warnings.push(
            "its runs hit a wall: between two vehicles each end is taken to load as against a wall at half their closing speed".into(),
        );
    }
    Ok(Crush {
        curve: ForceCurve {
            unloading,
            data_end_m: Some(model.largest_crush_m() / coordinates.deflection),
            ..ForceCurve::bare(loading)
        },
        rate: RateFactor {
            sensitivity_sqrt_s_per_m: law.sensitivity,
            share: coordinates.speed,
            behind: end.behind,
            ahead: end.ahead,
        },
        stopping: Some(Stopping {
            body: end.body,
            zone: end.zone,
            stopped_kg: Arc::new(stopped_kg),
        }),
        speed_m_per_s,
        warnings,
    })
}

/// The crush force between two single-mass vehicles, or one and the wall, that close at
/// `speed_m_per_s`: each is moved by `F_f M/(M − m_s)`.
pub(super) fn crush_between(
    model: &Model,
    slot: &Connection<'_>,
    (behind, ahead): (usize, Option<usize>),
    speed_m_per_s: f64,
    scale: f64,
) -> Result<Crush, Error> {
    let (law, at) = crush_curve(model, speed_m_per_s)?;
    // Of two equal masses half is what moves along their deflection.
    let mass_kg = slot.masses.equal_kg();
    let moved_kg = if slot.role == Role::Wall { mass_kg } else { 0.5 * mass_kg };
    let factor = |d: f64| per_crush_force(at.stopped_kg.force_at(d), moved_kg);
    let deflection_m = at.standing_n.deflection_m().to_vec();
    let points = deflection_m.iter().zip(at.standing_n.force_n());
    let force_n = points.map(|(&d, f)| f * scale * factor(d)).collect();
    let stiffness = model.unloading_n_per_m(speed_m_per_s, mass_kg).map(|k| k * scale);
    let unloading = CurveUnloading::of(stiffness);
    let curve = ForceCurve::bare(Envelope::new(deflection_m, force_n).map_err(below)?);
    let sensitivity_sqrt_s_per_m = law.sensitivity;
    Ok(Crush {
        curve: ForceCurve { unloading, data_end_m: Some(model.largest_crush_m()), ..curve },
        rate: RateFactor { sensitivity_sqrt_s_per_m, share: 1.0, behind, ahead },
        stopping: None,
        speed_m_per_s,
        warnings: warnings(model, speed_m_per_s),
    })
}

fn crush_curve(model: &Model, speed_m_per_s: f64) -> Result<(&CrushLaw, CrushCurve), Error> {
    model.crush_curve(speed_m_per_s).ok_or_else(|| {
        error!(
            Scenario at "model",
            "its group \"{}\" has no crush law for the end of a vehicle: expected contact forces and speeds of two or more runs that differ in speed and mass alone, against a wall or between equal masses; give front and rear a mass and a curve",
            model.group
        )
    })
}

fn warnings(model: &Model, speed_m_per_s: f64) -> Vec<String> {
    let mass_kg = model.mass_kg;
    let point = QueryPoint { speed_m_per_s, features: &[], mass_kg, closing_m_per_s: None };
    model.warnings(&point).iter().map(std::string::ToString::to_string).collect()
}

/// The interface of two plates that meet after `gap_m`.
pub(super) fn plates(name: &str, gap_m: f64) -> Result<Interface, Error> {
    let spring = Envelope::new(vec![0.0, 1.0], vec![0.0, PLATES_N_PER_M]).map_err(below)?;
    let law = ForceLaw::new(spring, Unloading::Elastic, EnvelopeEnd::Slope);
    let damping = Damping::constant(PLATES_N_S_PER_M).map_err(below)?;
    Ok(Interface::new(name, law, gap_m).with_damping(damping))
}
