//! Histories: what a solver wrote down over time, in the solver's own units.

use std::fmt;
use std::sync::Arc;

use serde::Serialize;

/// Side of a contact interface.
///
/// Up to R13 LS-DYNA prints `slave` and `master`, later `SURFA` and `SURFB`;
/// slave is the first-listed side, SURFA.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    SurfA,
    SurfB,
}

impl Side {
    /// Reads either generation's name, in upper or lower case.
    pub fn parse(name: &str) -> Option<Self> {
        match name.trim().to_ascii_lowercase().as_str() {
            "surfa" | "slave" => Some(Self::SurfA),
            "surfb" | "master" => Some(Self::SurfB),
            _ => None,
        }
    }

    /// `"surfa"` or `"surfb"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::SurfA => "surfa",
            Self::SurfB => "surfb",
        }
    }
}

/// Name of an entity: a node, a wall, one side of an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub struct EntityId {
    pub id: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
}

impl EntityId {
    pub fn new(id: i64) -> Self {
        Self { id, side: None }
    }
}

impl fmt::Display for EntityId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.side {
            Some(side) => write!(f, "{}:{}", self.id, side.name()),
            None => write!(f, "{}", self.id),
        }
    }
}

/// One component of one entity over time.
#[derive(Clone, Debug, PartialEq)]
pub struct History {
    /// `None` for global quantities (`glstat`).
    pub entity: Option<EntityId>,
    /// Component name as in binout, such as `x_displacement`.
    pub component: Arc<str>,
    /// One time per state, in the solver's unit of time; shared by a file's histories.
    pub time: Arc<[f64]>,
    /// One value per state, in the solver's units. NaN where the file holds no number;
    /// a problem of the file then says where.
    pub values: Vec<f64>,
}

impl History {
    /// Column name in tables: `x_force[2:surfa]`, or the bare component for globals.
    pub fn label(&self) -> String {
        match self.entity {
            Some(entity) => format!("{}[{entity}]", self.component),
            None => self.component.to_string(),
        }
    }
}

/// Rate of `values` over `time`: central differences, one-sided at both ends.
///
/// `time`: strictly increasing, at least two. Over an output interval `h` the result is
/// a mean over `2 h`, as the contact forces derived from impulses are.
pub fn derivative(time: &[f64], values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    (0..values.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            (values[b] - values[a]) / (time[b] - time[a])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivative_of_a_parabola_is_exact_inside() {
        let t: Vec<f64> = (0..10).map(|i| f64::from(i) * 0.5).collect();
        let v: Vec<f64> = t.iter().map(|t| t * t).collect();
        let rate = derivative(&t, &v);
        assert_eq!(rate[4], 4.0);
        assert_eq!(rate[0], 0.5, "one-sided at the end");
    }
}
