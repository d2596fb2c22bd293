//! Springs: what a curve's source gives at one interface, and the force law made of it.

use super::layout::{Role, Slot};
use super::{CurveTable as Table, EndName, ForceName, LawName, Source};
use crate::curve::body::recorded_force;
use crate::curve::{Case, Envelope, ForceKind};
use crate::export::csv::CurveTable;
use crate::multibody::{EnvelopeEnd, ForceLaw, Unloading, UnloadingShape};
use crate::surrogate::predict::{PredictError, drive, predict_beyond};
use crate::surrogate::{Model, PredictedCurve, Query};
use crate::unit::SpeedKind;

/// An envelope with what its source knows of unloading.
pub(super) struct Spring {
    pub envelope: Envelope,
    unloading_n_per_m: Option<f64>,
    /// Of a recorded motion.
    shape: Option<UnloadingShape>,
    pub kind: Option<SpeedKind>,
    pub force: Option<ForceKind>,
    /// Speed that the curve was predicted for.
    pub speed_m_per_s: Option<f64>,
    pub warnings: Vec<String>,
}

/// Why a source gives no spring.
pub(super) enum SpringError {
    Message(String),
    Predict(PredictError),
}

impl<E: Into<PredictError>> From<E> for SpringError {
    fn from(error: E) -> Self {
        Self::Predict(error.into())
    }
}

/// The curve of a source that the interface needs, at `speed_m_per_s` if a model gives it.
pub(super) fn spring(
    source: &Source,
    table: &Table,
    slot: &Slot<'_>,
    speed_m_per_s: f64,
) -> Result<Spring, SpringError> {
    let (declared, has_body) = match source {
        Source::Model(model) => (Some(model.force_kind), model.has_body_force()),
        Source::Predicted(curve) => {
            (Some(curve.provenance.force_kind), curve.body_force_n.is_some())
        }
        Source::Case(case) => (Some(case.force_kind), case.force_kind == ForceKind::Contact),
        Source::Table(held) => (held.force_kind, held.force_kind == Some(ForceKind::Body)),
        Source::Stages(_) => (None, false),
    };
    let force = which_force(table.force, slot, declared, has_body)?;
    let mut spring = match source {
        Source::Model(model) => from_model(model, table, slot, speed_m_per_s, force)?,
        Source::Predicted(curve) => from_curve(curve, table, force)?,
        Source::Table(_) | Source::Stages(_) | Source::Case(_) if table.band.is_some() => {
            return Err(SpringError::Message(
                "band needs a model or a predicted curve (.json), which has one".into(),
            ));
        }
        Source::Table(held) => from_table(held),
        // A device between two bodies moves these, and no mass is stopped in it.
        Source::Stages(envelope) => from_table(&CurveTable {
            force_kind: Some(ForceKind::Body),
            ..CurveTable::bare(envelope.clone())
        }),
        Source::Case(case) => from_case(case, force).map_err(SpringError::Message)?,
    };
    let only_contact = force == ForceName::Declared && spring.force == Some(ForceKind::Contact);
    let stated = table.force.is_some() && !matches!(source, Source::Table(_));
    if only_contact && !stated && !slot.split && slot.role != Role::Within {
        spring.warnings.push(
            "it has a contact force only, which a vehicle of one mass does not follow: mass that the crush zone stops early is in it; use a body force, or split the vehicles (front, rear)".into(),
        );
    }
    scaled(spring, table.scale).map_err(SpringError::Message)
}

/// The force that drives the interface: what was asked for, or what the vehicles need. One
/// mass per vehicle moves by the body force; where the crush zone has a mass of its own, the
/// contact force drives it, and a body force would count that mass twice.
fn which_force(
    asked: Option<ForceName>,
    slot: &Slot<'_>,
    declared: Option<ForceKind>,
    has_body: bool,
) -> Result<ForceName, SpringError> {
    let is_body = match asked {
        Some(ForceName::Body) => true,
        Some(ForceName::Contact) => false,
        Some(ForceName::Declared) | None => declared == Some(ForceKind::Body),
    };
    if asked == Some(ForceName::Contact) && declared == Some(ForceKind::Body) {
        return Err(SpringError::Predict(PredictError::NoContactForce));
    }
    if slot.split && slot.role != Role::Within && is_body {
        return Err(SpringError::Message(format!(
            "interface {} has a vehicle with a crush zone of its own mass, which a body force already contains: use a contact force, or no front and rear",
            slot.name
        )));
    }
    Ok(match asked {
        Some(ForceName::Body) => ForceName::Body,
        Some(ForceName::Declared | ForceName::Contact) => ForceName::Declared,
        None if has_body && !slot.split => ForceName::Body,
        None => ForceName::Declared,
    })
}

fn from_model(
    model: &Model,
    table: &Table,
    slot: &Slot<'_>,
    speed_m_per_s: f64,
    force: ForceName,
) -> Result<Spring, SpringError> {
    let query = Query {
        mass_kg: Some(slot.mass_kg),
        rule: table.max_crush,
        parameters: table.parameters.clone(),
        // Inside a train interfaces close far more slowly than any run by itself; that is warned
        // of, but a train without their curves could not run at all.
        extrapolate: true,
        ..Query::at(speed_m_per_s)
    };
    let driven = match force {
        ForceName::Body if table.band.is_none() => drive(model, &query)?,
        _ => None,
    };
    let (mut spring, beyond) = match driven {
        Some(drive) => {
            let spring = Spring {
                envelope: drive.envelope,
                unloading_n_per_m: Some(drive.unloading_stiffness_n_per_m),
                shape: None,
                kind: Some(model.speed_kind),
                force: Some(ForceKind::Body),
                speed_m_per_s: None,
                warnings: drive.warnings.iter().map(|w| w.to_string()).collect(),
            };
            (spring, drive.beyond)
        }
        None => {
            let (curve, beyond) = predict_beyond(model, &query)?;
            let beyond = match force {
                ForceName::Body => beyond.body,
                ForceName::Declared | ForceName::Contact => beyond.declared,
            };
            (from_curve(&curve, table, force)?, beyond)
        }
    };
    // Neighbours push on where a vehicle by itself would have stopped.
    let end = spring.envelope.end_m();
    let share = match beyond.force_at(end) {
        at if at > 0.0 => spring.envelope.force_at(end) / at,
        _ => 1.0,
    };
    let (mut d, mut f) =
        (spring.envelope.deflection_m().to_vec(), spring.envelope.force_n().to_vec());
    for (&deflection, &force) in beyond.deflection_m().iter().zip(beyond.force_n()) {
        if deflection > end {
            d.push(deflection);
            f.push(share * force);
        }
    }
    spring.envelope = Envelope::new(d, f)?;
    spring.speed_m_per_s = Some(speed_m_per_s);
    Ok(spring)
}

/// A table with what its header says; what it does not say is said.
fn from_table(held: &CurveTable) -> Spring {
    let mut warnings = Vec::new();
    if held.force_kind.is_none() {
        warnings.push(
            "its file does not say which force it holds: taken as the one that moves the bodies; write \"# force_kind: body\" or \"# force_kind: contact\" into it, or force = \"…\" beside it".into(),
        );
    }
    Spring {
        envelope: held.envelope.clone(),
        unloading_n_per_m: held.unloading_stiffness_n_per_m,
        shape: None,
        kind: held.speed_kind,
        force: held.force_kind,
        speed_m_per_s: held.speed_m_per_s,
        warnings,
    }
}

/// The force that was asked for, with the unloading that goes with it.
fn from_curve(
    curve: &PredictedCurve,
    table: &Table,
    force: ForceName,
) -> Result<Spring, PredictError> {
    let mut envelope = match force {
        ForceName::Declared | ForceName::Contact => curve.envelope()?,
        ForceName::Body => curve.driving_envelope()?,
    };
    if let Some(member) = table.band {
        envelope = band_member(curve, &envelope, member)?;
    }
    // The force law keeps to its bounds by itself; the one constant is for other tools.
    let unloading_n_per_m = Some(curve.stiffness_at_end(&envelope));
    Ok(Spring {
        envelope,
        unloading_n_per_m,
        shape: None,
        kind: Some(curve.speed_kind),
        force: Some(match force {
            ForceName::Declared | ForceName::Contact => curve.provenance.force_kind,
            ForceName::Body => ForceKind::Body,
        }),
        speed_m_per_s: Some(curve.speed_m_per_s),
        warnings: curve.warnings.iter().map(|w| w.to_string()).collect(),
    })
}

/// The envelope with `member` of the band's half width added, from −1 (lower edge) to 1.
fn band_member(
    curve: &PredictedCurve,
    envelope: &Envelope,
    member: f64,
) -> Result<Envelope, PredictError> {
    if !(-1.0..=1.0).contains(&member) {
        return Err(PredictError::Damaged(format!("band = {member}: expected from -1 to 1")));
    }
    let edge = if member < 0.0 { &curve.force_low_n } else { &curve.force_high_n };
    let edge = edge.as_ref().ok_or_else(|| {
        PredictError::Damaged("there is no band around it: leave band away".into())
    })?;
    let declared = curve.force_n.iter().zip(edge);
    let force_n = envelope
        .force_n()
        .iter()
        .zip(declared)
        .map(|(force, (declared, edge))| (force + member.abs() * (edge - declared)).max(0.0))
        .collect();
    Ok(Envelope::new(envelope.deflection_m().to_vec(), force_n)?)
}

fn from_case(case: &Case, force: ForceName) -> Result<Spring, String> {
    let truncated = case.is_truncated().then(|| "the run ended while loading".to_string());
    let mut spring = Spring {
        envelope: case.loading().map_err(|e| e.to_string())?.envelope,
        unloading_n_per_m: case.unloading_stiffness_n_per_m,
        shape: None,
        kind: Some(case.speed.kind),
        force: Some(case.force_kind),
        speed_m_per_s: Some(case.speed.m_per_s),
        warnings: truncated.into_iter().collect(),
    };
    if force == ForceName::Body && case.force_kind == ForceKind::Contact {
        let recorded = recorded_force(case).ok_or("its sampled states make no loading branch")?;
        spring.force = Some(ForceKind::Body);
        if let Some(stiffness) = recorded.unloading_stiffness_n_per_m {
            spring.unloading_n_per_m = Some(stiffness);
            spring.shape = UnloadingShape::of_branch(
                &recorded.unloading_deflection_m,
                &recorded.unloading_force_n,
            );
        }
        spring.envelope = recorded.loading;
    }
    Ok(spring)
}

/// With the force times `factor`, and the unloading stiffness with it.
fn scaled(mut spring: Spring, factor: Option<f64>) -> Result<Spring, String> {
    let Some(factor) = factor else { return Ok(spring) };
    if !(factor > 0.0 && factor.is_finite()) {
        return Err(format!("scale = {factor}: expected more than 0"));
    }
    let force_n = spring.envelope.force_n().iter().map(|f| f * factor).collect();
    spring.envelope = Envelope::new(spring.envelope.deflection_m().to_vec(), force_n)
        .map_err(|e| e.to_string())?;
    spring.unloading_n_per_m = spring.unloading_n_per_m.map(|k| k * factor);
    Ok(spring)
}

impl Spring {
    /// The force law that the curve's table asks for.
    pub fn law(&mut self, table: &Table) -> Result<ForceLaw, String> {
        let asked = table.unloading.map(|u| u.0);
        let unloading = match table.law {
            LawName::Elastic => Unloading::Elastic,
            LawName::Memory => {
                let steepest = self.envelope.max_slope();
                let stiffness = asked.or(self.unloading_n_per_m).unwrap_or(steepest);
                if asked.is_none() && self.unloading_n_per_m.is_none() && steepest > 0.0 {
                    self.warnings.push(format!(
                        "it has no unloading stiffness: it unloads with its steepest rise, {:.4} MN/m; how much it gives back follows from that: say unloading = \"…MN/m\"",
                        steepest / 1e6
                    ));
                }
                if let Some(asked) = asked
                    && asked < steepest
                    && table.stages.is_none()
                {
                    self.warnings.push(format!(
                        "unloading {:.4} MN/m is softer than the curve's steepest rise ({:.4} MN/m): where it rises so, unloading is stiffer",
                        asked / 1e6,
                        steepest / 1e6
                    ));
                }
                if stiffness.max(steepest) <= 0.0 || asked.is_none() && table.stages.is_some() {
                    let why = match table.stages {
                        Some(_) => "has stages, which do not say how they unload",
                        None => "never rises",
                    };
                    return Err(format!(
                        "it {why}, so its unloading stiffness must be given: unloading = \"…MN/m\", or law = \"elastic\""
                    ));
                }
                Unloading::Memory { stiffness_n_per_m: stiffness }
            }
        };
        let end = match table.end {
            EndName::Hold => EnvelopeEnd::Hold,
            EndName::Slope => EnvelopeEnd::Slope,
            EndName::Error => EnvelopeEnd::Error,
        };
        let envelope = self.envelope.clone();
        Ok(match (&self.shape, asked) {
            (Some(shape), None) => ForceLaw::recorded(envelope, unloading, shape.clone(), end),
            _ => ForceLaw::new(envelope, unloading, end),
        })
    }
}
