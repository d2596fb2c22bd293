//! The recipe of a study: which histories make a curve, and how.

use serde::{Deserialize, Serialize};

use crate::history::{EntityId, Side};

/// How curves are extracted from the runs of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Where the deflection comes from.
    pub(crate) deflection: DeflectionSource,
    /// Where the force comes from.
    pub force: ForceSource,
    /// Contact force that marks the start of contact, if the force is a body force: a body
    /// slows down some milliseconds after the first touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<ForceSource>,
    /// Share of the peak force above which a record is in contact: 0.005 where it is not given; above 0, below 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_threshold: Option<f64>,
    /// Filter of the force.
    #[serde(default)]
    pub filter: Filter,
    /// Common times of all cases.
    #[serde(default)]
    pub sampling: Sampling,
}

impl Recipe {
    /// Whether the force is mass times acceleration of a body.
    pub fn force_is_body(&self) -> bool {
        matches!(self.force, ForceSource::Body { .. })
    }
}

/// Displacement of one node, or the difference of two.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DeflectionSource {
    /// File in the run's folder.
    pub file: String,
    /// Node behind the crush zone, or the centre of gravity.
    pub node: i64,
    /// Node on the other body, whose displacement is subtracted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minus_node: Option<i64>,
    /// `x_displacement`, `y_displacement` or `z_displacement`.
    pub component: DisplacementComponent,
}

impl std::fmt::Display for DeflectionSource {
    /// `x_displacement of nodout 900001 less 900002`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {} {}", self.component.name(), self.file, self.node)?;
        match self.minus_node {
            Some(other) => write!(f, " less {other}"),
            None => Ok(()),
        }
    }
}

/// Direction of the deflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[allow(clippy::enum_variant_names, reason = "the names are the components' in the files")]
pub(crate) enum DisplacementComponent {
    /// Along x.
    XDisplacement,
    /// Along y.
    YDisplacement,
    /// Along z.
    ZDisplacement,
}

impl DisplacementComponent {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::XDisplacement => "x_displacement",
            Self::YDisplacement => "y_displacement",
            Self::ZDisplacement => "z_displacement",
        }
    }

    /// Along x, y and z.
    pub(crate) const ALL: [Self; 3] =
        [Self::XDisplacement, Self::YDisplacement, Self::ZDisplacement];

    /// `x`, `y` or `z`.
    pub(crate) fn axis(self) -> &'static str {
        &self.name()[..1]
    }

    /// The component of a force along it.
    pub(crate) fn force(self) -> &'static str {
        match self {
            Self::XDisplacement => "x_force",
            Self::YDisplacement => "y_force",
            Self::ZDisplacement => "z_force",
        }
    }

    /// The component that holds its rate.
    pub(crate) fn velocity(self) -> &'static str {
        match self {
            Self::XDisplacement => "x_velocity",
            Self::YDisplacement => "y_velocity",
            Self::ZDisplacement => "z_velocity",
        }
    }
}

/// Where the force comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(try_from = "ForceTable", into = "ForceTable")]
#[cfg_attr(test, schemars(with = "ForceTable"))]
pub enum ForceSource {
    /// A contact force: rigid wall, side of an interface.
    Contact {
        /// Name of the file in the run's folder.
        file: String,
        /// Number of the wall or interface.
        id: i64,
        /// Further ones that share the load: their forces are added.
        also: Vec<i64>,
        /// Side of an interface; a wall has none.
        side: Option<Side>,
        /// Component of the force, such as `normal_force`.
        component: String,
    },
    /// Mass of the body times the acceleration of its node.
    Body {
        /// Name of the file in the run's folder.
        file: String,
        /// Number of the node that moves with the body.
        node: i64,
        /// What the acceleration is made from.
        motion: RecordedMotion,
        /// Component of that motion, such as `x_acceleration`.
        component: String,
    },
}

impl std::fmt::Display for ForceSource {
    /// `x_force of rcforc 3:surfa`, or `mass times the rate of x_velocity of nodout 900001`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Contact { file, id, also, side, component } => {
                write!(f, "{component} of {file} {}", EntityId { id: *id, side: *side })?;
                let side = *side;
                also.iter().try_for_each(|&id| write!(f, " + {}", EntityId { id, side }))
            }
            Self::Body { file, node, motion, component } => {
                let rate = match motion {
                    RecordedMotion::Acceleration => "",
                    RecordedMotion::Velocity => "the rate of ",
                };
                write!(f, "mass times {rate}{component} of {file} {node}")
            }
        }
    }
}

/// What the acceleration of a body is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordedMotion {
    /// The acceleration that the solver wrote.
    Acceleration,
    /// Differentiated by central differences: a mean over two output intervals.
    Velocity,
}

/// The force as written in a manifest.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct ForceTable {
    /// File in the run's folder.
    file: String,
    /// Wall or interface of a contact force; several are added.
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<Ids>,
    /// Side of an interface: "surfa" (slave) or "surfb" (master).
    #[serde(skip_serializing_if = "Option::is_none")]
    side: Option<String>,
    /// Node of a body force.
    #[serde(skip_serializing_if = "Option::is_none")]
    node: Option<i64>,
    /// Such as "normal_force", "x_force"; for a body force "x_acceleration" or "x_velocity".
    component: String,
    /// "mass" makes a body force from the node's acceleration.
    #[serde(skip_serializing_if = "Option::is_none")]
    times: Option<String>,
}

/// One number, or several.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected the number of a wall or contact, or a list of numbers")]
enum Ids {
    One(i64),
    Several(Vec<i64>),
}

impl TryFrom<ForceTable> for ForceSource {
    type Error = String;

    fn try_from(table: ForceTable) -> Result<Self, String> {
        let ForceTable { file, id, side, node, component, times } = table;
        match (id, node, times.as_deref()) {
            (Some(_), None, None) if !component.ends_with("_force") => Err(format!(
                "\"{component}\" of a wall or contact is not a force: use normal_force, x_force, y_force or z_force"
            )),
            (Some(id), None, None) => {
                let side = side
                    .map(|s| {
                        Side::parse(&s).ok_or_else(|| {
                            format!("side \"{s}\" is not known: write \"surfa\" (slave) or \"surfb\" (master)")
                        })
                    })
                    .transpose()?;
                let ids = match id {
                    Ids::One(id) => vec![id],
                    Ids::Several(ids) => ids,
                };
                let mut distinct = ids.clone();
                distinct.sort_unstable();
                distinct.dedup();
                match ids.split_first() {
                    Some((&id, also)) if distinct.len() == ids.len() => {
                        Ok(Self::Contact { file, id, also: also.to_vec(), side, component })
                    }
                    _ => Err("id is a number, or a list of different numbers".into()),
                }
            }
            (None, Some(_), _) if side.is_some() => {
                Err("a node has no side: remove side, or give the id of an interface".into())
            }
            (None, Some(node), Some("mass")) => {
                let motion = match component.as_str() {
                    "x_acceleration" | "y_acceleration" | "z_acceleration" => {
                        RecordedMotion::Acceleration
                    }
                    "x_velocity" | "y_velocity" | "z_velocity" => RecordedMotion::Velocity,
                    _ => {
                        return Err(format!(
                            "\"{component}\" times mass is not a force: use x_acceleration, or x_velocity to differentiate it"
                        ));
                    }
                };
                Ok(Self::Body { file, node, motion, component })
            }
            (None, Some(_), _) => {
                Err("a force from a node needs times = \"mass\" (body force)".into())
            }
            _ => Err(
                "a force needs either id = … (a wall or contact) or node = … with times = \"mass\""
                    .into(),
            ),
        }
    }
}

impl From<ForceSource> for ForceTable {
    fn from(source: ForceSource) -> Self {
        match source {
            ForceSource::Contact { file, id, also, side, component } => Self {
                file,
                id: Some(match also.is_empty() {
                    true => Ids::One(id),
                    false => Ids::Several([&[id], &also[..]].concat()),
                }),
                side: side.map(|s| s.name().into()),
                node: None,
                component,
                times: None,
            },
            ForceSource::Body { file, node, component, .. } => Self {
                file,
                id: None,
                side: None,
                node: Some(node),
                component,
                times: Some("mass".into()),
            },
        }
    }
}

/// Filter of the force: `"CFC60"` (default), another class, or `"none"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(try_from = "String", into = "String")]
#[cfg_attr(test, schemars(with = "String"))]
pub enum Filter {
    /// No filter.
    None,
    /// A channel frequency class of SAE J211, such as 60.
    Cfc(u32),
}

impl Default for Filter {
    fn default() -> Self {
        Self::Cfc(60)
    }
}

impl TryFrom<String> for Filter {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let class = text.strip_prefix("CFC").and_then(|c| c.parse().ok());
        match (text.as_str(), class) {
            ("none", _) => Ok(Self::None),
            (_, Some(class @ (60 | 180 | 600 | 1000))) => Ok(Self::Cfc(class)),
            _ => Err(format!(
                "filter \"{text}\" is not known: write \"CFC60\", \"CFC180\", \"CFC600\", \"CFC1000\" or \"none\""
            )),
        }
    }
}

impl From<Filter> for String {
    fn from(filter: Filter) -> Self {
        match filter {
            Filter::None => "none".into(),
            Filter::Cfc(class) => format!("CFC{class}"),
        }
    }
}

/// The common times of all cases: `states` from contact on, one every `interval_ms`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(try_from = "SamplingTable", into = "SamplingTable")]
#[cfg_attr(test, schemars(with = "SamplingTable"))]
pub struct Sampling {
    /// Number of states, from contact on.
    pub states: usize,
    /// Time between two of them, in s.
    pub interval_s: f64,
}

impl std::fmt::Display for Sampling {
    /// `400 states, one every 0.75 ms`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let SamplingTable { states, interval_ms } = (*self).into();
        write!(f, "{states} states, one every {interval_ms} ms")
    }
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct SamplingTable {
    /// 2 to 1 000 000.
    states: usize,
    /// Above 0.
    interval_ms: f64,
}

/// Guards memory against a mistyped number; real outputs have hundreds of states.
pub(super) const MAX_STATES: usize = 1_000_000;

impl TryFrom<SamplingTable> for Sampling {
    type Error = String;

    fn try_from(table: SamplingTable) -> Result<Self, String> {
        let sampling = Self { states: table.states, interval_s: table.interval_ms * 1e-3 };
        sampling.check().map(|()| sampling)
    }
}

impl From<Sampling> for SamplingTable {
    fn from(sampling: Sampling) -> Self {
        // Back through the decimal that was typed: 0.75, not 0.7500000000000001.
        let interval_ms = (sampling.interval_s * 1e15).round() / 1e12;
        Self { states: sampling.states, interval_ms }
    }
}

/// A motion that is sampled less often up to its maximum deflection loses energy in its accelerations.
pub(crate) const LEAST_STATES: f64 = 40.0;

impl Sampling {
    /// Whether both numbers are possible.
    pub(super) fn check(&self) -> Result<(), String> {
        let SamplingTable { states, interval_ms } = (*self).into();
        if !(2..=MAX_STATES).contains(&states) {
            return Err(format!("sampling needs states from 2 to {MAX_STATES}, found {states}"));
        }
        if !(interval_ms > 0.0 && interval_ms.is_finite()) {
            return Err(format!("sampling needs interval_ms above 0, found {interval_ms}"));
        }
        Ok(())
    }

    /// The default's interval in s, or for a shorter crush the round one (1, 2 or 5 of a decade) of which it has at least
    /// [`LEAST_STATES`], if the states of the record are no further apart than that.
    pub(crate) fn interval_for(crush_s: f64, apart_s: f64) -> f64 {
        let (usual_s, most_s) =
            (Self::default().interval_s, (crush_s / LEAST_STATES).max(apart_s * (1.0 + 1e-9)));
        if !(most_s > 0.0 && most_s < usual_s) {
            return usual_s;
        }
        let decimals = (4..20).flat_map(|k| [5, 2, 1].map(|of| format!("{of}e-{k}").parse().ok()));
        decimals.flatten().find(|s| *s <= most_s).unwrap_or(most_s)
    }
}

impl Default for Sampling {
    /// The reference data's: 400 states, one every 0.75 ms.
    fn default() -> Self {
        Self { states: 400, interval_s: 0.75e-3 }
    }
}
