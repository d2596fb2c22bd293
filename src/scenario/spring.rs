//! Springs: the curve of a source at one interface, and its force law.

use super::layout::{Connection, Role};
use super::{CurveSource, CurveTable as Table, LawName};
use crate::curve::force_curve::ForceCurveError;
use crate::curve::{ForceCurve, ForceKind, Tail};
use crate::error::{Error, ErrorCode, error};
use crate::multibody::{EnvelopeEnd, ForceLaw, UnloadingChoice};
use crate::surrogate::predict::predict_driving;
use crate::surrogate::{Model, PredictedCurve, Query, Warning};
use crate::unit::Shown;

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
            (Some(case.curves.force_kind), case.curves.force_kind == ForceKind::Contact)
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
        CurveSource::Predicted(curve) => of_predicted(curve, table, force)?,
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
            let curve = curve.map_err(|error| match error {
                ForceCurveError::Envelope(error) => envelope_error(error),
                ForceCurveError::NoMotion => {
                    error!(Scenario, "its samples contain no loading branch")
                }
            })?;
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
        mass_kg: Some(slot.mass_kg),
        rule: table.max_crush,
        parameters: table.parameters.clone(),
        // Inside a train interfaces close far more slowly than any run by itself; that is warned
        // of, but a train without their curves could not run at all.
        extrapolate: true,
        ..Query::at(speed_m_per_s)
    };
    let force = force.unwrap_or(model.force_kind);
    let (curve, warnings) =
        predict_driving(model, &query, force, table.band).map_err(predict_error)?;
    Ok((curve, texts(&warnings)))
}

/// The curve of a predicted one that was read from a file.
fn of_predicted(
    curve: &PredictedCurve,
    table: &Table,
    force: Option<ForceKind>,
) -> Result<(ForceCurve, Vec<String>), Error> {
    let force = force.unwrap_or(curve.provenance.force_kind);
    let driving = curve.driving_member(force, table.band).map_err(predict_error)?;
    Ok((driving, texts(&curve.warnings)))
}

fn texts(warnings: &[Warning]) -> Vec<String> {
    warnings.iter().map(Warning::to_string).collect()
}

/// Said of a file without `# force_kind`.
const UNKNOWN_FORCE: &str = "its file does not state which force it holds: taken as the body force; write \"# force_kind: body\" or \"# force_kind: contact\" into it, or force = \"…\" beside it";

/// Warning for a contact force that drives bodies of one mass without being requested.
const ONLY_CONTACT: &str = "it has a contact force only, which includes mass that the crush zone stops early and is wrong for a vehicle of one mass; use a body force, or split the vehicles (front, rear)";

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
            error!(Prediction at "force", "the curve has a body force and no contact force: its study's recipe names none; use the body force"),
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
        let curve = self.curve.continued(tail).map_err(envelope_error)?;
        Ok(Self { curve, end, ..self })
    }

    /// The force law that the curve's table specifies, with all warnings.
    pub(crate) fn law_with_warnings(
        mut self,
        table: &Table,
    ) -> Result<(ForceLaw, Vec<String>), Error> {
        let (unloading, warnings) = match table.law {
            LawName::Elastic => (UnloadingChoice::Elastic, Vec::new()),
            LawName::Memory | LawName::Rate => self.memory(table)?,
        };
        self.warnings.extend(warnings);
        Ok((ForceLaw::of_curve(&self.curve, unloading, self.end), self.warnings))
    }

    fn memory(&self, table: &Table) -> Result<(UnloadingChoice, Vec<String>), Error> {
        let asked = table.unloading.map(|u| u.0);
        let known = self.curve.unloading.stiffness_n_per_m();
        let steepest = self.curve.loading.max_slope();
        let mut warnings = Vec::new();
        if asked.is_none() && known.is_none() && steepest > 0.0 {
            warnings.push(format!(
                "it has no unloading stiffness: it unloads with its steepest rise, {}, which decides the rebound: set unloading = \"…MN/m\"",
                Shown::one_stiffness(steepest)
            ));
        }
        if let Some(asked) = asked
            && asked < steepest
            && table.stages.is_none()
        {
            warnings.push(format!(
                "unloading {} is softer than the curve's steepest rise ({}): there it unloads as steeply as it rises",
                Shown::one_stiffness(asked),
                Shown::one_stiffness(steepest)
            ));
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
        Ok((asked.map_or(UnloadingChoice::Own, UnloadingChoice::Stiffness), warnings))
    }
}
