//! Springs: what a curve's source gives at one interface, and the force law made of it.

use super::layout::{Role, Slot};
use super::{CurveSource, CurveTable as Table, EndName, LawName};
use crate::curve::driving::NoDrivingCurve;
use crate::curve::{DrivingCurve, EnvelopeError, ForceKind};
use crate::multibody::{EnvelopeEnd, ForceLaw, UnloadingChoice};
use crate::surrogate::predict::{PredictError, predict_driving};
use crate::surrogate::{Model, PredictedCurve, Query, Warning};

/// The curve at one interface, with what must be said of it.
pub(super) struct Spring {
    pub curve: DrivingCurve,
    pub warnings: Vec<String>,
}

/// Why a source gives no force law at an interface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpringError {
    /// A band is asked of a source that has none.
    #[error("band needs a model or a predicted curve (.json), which has one")]
    NoBand,
    /// The case's loading branch is no envelope, or `scale` makes it none.
    #[error("{0}")]
    Envelope(#[from] EnvelopeError),
    /// The case's body force cannot be told from its speeds.
    #[error("its sampled states make no loading branch")]
    NoMotion,
    /// The factor on the force is not above 0.
    #[error("scale = {factor}: expected more than 0")]
    Scale {
        /// The factor.
        factor: f64,
    },
    /// A body force would count the mass of the crush zone twice.
    #[error(
        "interface {interface} has a vehicle with a crush zone of its own mass, which a body force already contains: use a contact force, or no front and rear"
    )]
    CrushZoneTwice {
        /// Name of the interface.
        interface: String,
    },
    /// The runs of the group do not tell stopped mass and crush force.
    #[error(
        "its group \"{group}\" tells no crush law for the end of a vehicle: expected contact forces and speeds of two or more runs that differ in speed alone, against a wall or between equal masses; give front and rear a mass and a curve"
    )]
    NoCrushLaw {
        /// The group.
        group: String,
    },
    /// It has stages, and its unloading stiffness is not stated.
    #[error(
        "it has stages, which do not say how they unload, so its unloading stiffness must be given: unloading = \"…MN/m\", or law = \"elastic\""
    )]
    StagesUnload,
    /// Its force never rises, and its unloading stiffness is not stated.
    #[error(
        "it never rises, so its unloading stiffness must be given: unloading = \"…MN/m\", or law = \"elastic\""
    )]
    NeverRises,
}

/// Why there is no spring: of the curve's table or source, or of the model that is asked.
pub(super) enum NoSpring {
    Spring(SpringError),
    Predict(PredictError),
}

impl From<SpringError> for NoSpring {
    fn from(error: SpringError) -> Self {
        Self::Spring(error)
    }
}

impl From<PredictError> for NoSpring {
    fn from(error: PredictError) -> Self {
        Self::Predict(error)
    }
}

impl From<NoDrivingCurve> for NoSpring {
    fn from(error: NoDrivingCurve) -> Self {
        Self::Spring(match error {
            NoDrivingCurve::Envelope(error) => SpringError::Envelope(error),
            NoDrivingCurve::NoMotion => SpringError::NoMotion,
        })
    }
}

/// The curve of a source that the interface needs, at `speed_m_per_s` if a model gives it.
pub(super) fn spring(
    source: &CurveSource,
    table: &Table,
    slot: &Slot<'_>,
    speed_m_per_s: f64,
) -> Result<Spring, NoSpring> {
    let (declared, has_body) = match source {
        CurveSource::Model(model) => (Some(model.force_kind), model.has_body_force()),
        CurveSource::Predicted(curve) => {
            (Some(curve.provenance.force_kind), curve.body_force_n.is_some())
        }
        CurveSource::Case(case) => (Some(case.force_kind), case.force_kind == ForceKind::Contact),
        CurveSource::Curve(curve) => (curve.force, curve.force == Some(ForceKind::Body)),
        CurveSource::Stages(_) => (None, false),
    };
    let force = which_force(table.force, slot, declared, has_body)?;
    if table.band.is_some() && !matches!(source, CurveSource::Model(_) | CurveSource::Predicted(_))
    {
        return Err(SpringError::NoBand.into());
    }
    let Spring { mut curve, mut warnings } = match source {
        CurveSource::Model(model) => of_model(model, table, slot, speed_m_per_s, force)?,
        CurveSource::Predicted(curve) => of_predicted(curve, table, force)?,
        CurveSource::Curve(curve) => Spring {
            warnings: curve.force.is_none().then(|| UNKNOWN_FORCE.into()).into_iter().collect(),
            curve: (**curve).clone(),
        },
        // A device between two bodies moves these, and no mass is stopped in it.
        CurveSource::Stages(envelope) => {
            Spring { curve: DrivingCurve::of_body(envelope.clone()), warnings: Vec::new() }
        }
        CurveSource::Case(case) => {
            let truncated = case.is_truncated().then(|| "the run ended while loading".into());
            let curve = DrivingCurve::of_case(case, force.unwrap_or(case.force_kind))?;
            Spring { curve, warnings: truncated.into_iter().collect() }
        }
    };
    let only_contact = force != Some(ForceKind::Body) && curve.force == Some(ForceKind::Contact);
    let stated = table.force.is_some() && !matches!(source, CurveSource::Curve(_));
    if only_contact && !stated && !slot.split && slot.role != Role::Within {
        warnings.push(ONLY_CONTACT.into());
    }
    if let Some(factor) = table.scale {
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(SpringError::Scale { factor }.into());
        }
        curve = curve.scaled(factor).map_err(SpringError::Envelope)?;
    }
    Ok(Spring { curve, warnings })
}

/// The curve of a model, with what lies beyond its maximal crush.
fn of_model(
    model: &Model,
    table: &Table,
    slot: &Slot<'_>,
    speed_m_per_s: f64,
    force: Option<ForceKind>,
) -> Result<Spring, NoSpring> {
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
    let (curve, warnings) = predict_driving(model, &query, force, table.band)?;
    let curve = curve.continued().map_err(PredictError::Envelope)?;
    Ok(Spring { curve, warnings: texts(&warnings) })
}

/// The curve of a predicted one that was read from a file.
fn of_predicted(
    curve: &PredictedCurve,
    table: &Table,
    force: Option<ForceKind>,
) -> Result<Spring, NoSpring> {
    let force = force.unwrap_or(curve.provenance.force_kind);
    let driving = curve.driving_member(force, table.band)?;
    Ok(Spring { curve: driving, warnings: texts(&curve.warnings) })
}

fn texts(warnings: &[Warning]) -> Vec<String> {
    warnings.iter().map(Warning::to_string).collect()
}

/// Said of a file without `# force_kind`.
const UNKNOWN_FORCE: &str = "its file does not say which force it holds: taken as the one that moves the bodies; write \"# force_kind: body\" or \"# force_kind: contact\" into it, or force = \"…\" beside it";

/// Said of a contact force that drives bodies of one mass without being asked for.
const ONLY_CONTACT: &str = "it has a contact force only, which a vehicle of one mass does not follow: mass that the crush zone stops early is in it; use a body force, or split the vehicles (front, rear)";

/// The force that drives the interface: what was asked for, or what the vehicles need; `None` for
/// the recipe's own. One mass per vehicle moves by the body force; where the crush zone has a mass
/// of its own, the contact force drives it, and a body force would count that mass twice.
fn which_force(
    asked: Option<ForceKind>,
    slot: &Slot<'_>,
    declared: Option<ForceKind>,
    has_body: bool,
) -> Result<Option<ForceKind>, NoSpring> {
    if asked == Some(ForceKind::Contact) && declared == Some(ForceKind::Body) {
        return Err(PredictError::NoContactForce.into());
    }
    if slot.split && slot.role != Role::Within && asked.or(declared) == Some(ForceKind::Body) {
        return Err(SpringError::CrushZoneTwice { interface: slot.name.clone() }.into());
    }
    Ok(asked.or((has_body && !slot.split).then_some(ForceKind::Body)))
}

impl Spring {
    /// The force law that the curve's table asks for, with all that must be said of it.
    pub(crate) fn law_with_warnings(
        mut self,
        table: &Table,
    ) -> Result<(ForceLaw, Vec<String>), SpringError> {
        let end = match table.end {
            EndName::Hold => EnvelopeEnd::Hold,
            EndName::Slope => EnvelopeEnd::Slope,
            EndName::Error => EnvelopeEnd::Error,
        };
        let (unloading, warnings) = match table.law {
            LawName::Elastic => (UnloadingChoice::Elastic, Vec::new()),
            LawName::Memory | LawName::Rate => self.memory(table)?,
        };
        self.warnings.extend(warnings);
        Ok((ForceLaw::of_curve(&self.curve, unloading, end), self.warnings))
    }

    fn memory(&self, table: &Table) -> Result<(UnloadingChoice, Vec<String>), SpringError> {
        let asked = table.unloading.map(|u| u.0);
        let known = self.curve.unloading.stiffness_n_per_m();
        let steepest = self.curve.loading.max_slope();
        let mut warnings = Vec::new();
        if asked.is_none() && known.is_none() && steepest > 0.0 {
            warnings.push(format!(
                "it has no unloading stiffness: it unloads with its steepest rise, {:.4} MN/m; how much it gives back follows from that: say unloading = \"…MN/m\"",
                steepest / 1e6
            ));
        }
        if let Some(asked) = asked
            && asked < steepest
            && table.stages.is_none()
        {
            warnings.push(format!(
                "unloading {:.4} MN/m is softer than the curve's steepest rise ({:.4} MN/m): where it rises so, unloading is stiffer",
                asked / 1e6,
                steepest / 1e6
            ));
        }
        let stiffness = asked.or(known).unwrap_or(steepest);
        if stiffness.max(steepest) <= 0.0 || asked.is_none() && table.stages.is_some() {
            return Err(match table.stages {
                Some(_) => SpringError::StagesUnload,
                None => SpringError::NeverRises,
            });
        }
        Ok((asked.map_or(UnloadingChoice::Own, UnloadingChoice::Stiffness), warnings))
    }
}
