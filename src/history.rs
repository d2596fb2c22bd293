//! Histories: values that a solver wrote over time, in the solver's own units.

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
    /// The first-listed side: slave.
    SurfA,
    /// The second-listed side: master.
    SurfB,
}

impl Side {
    /// Reads either generation's name, in upper or lower case.
    pub(crate) fn parse(name: &str) -> Option<Self> {
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
    /// As in the file.
    pub id: i64,
    /// Side of an interface; `None` for what has no sides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
}

impl EntityId {
    /// An entity without sides.
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

    /// The sum of histories with the same times, under the name of the first; `None` if there is none, or their times differ.
    pub(crate) fn sum(of: &[&Self]) -> Option<Self> {
        let (first, others) = of.split_first()?;
        let mut sum = Self::clone(first);
        for other in others {
            if other.time != sum.time {
                return None;
            }
            sum.values.iter_mut().zip(&other.values).for_each(|(sum, value)| *sum += value);
        }
        Some(sum)
    }
}

/// A hole in time: an interval without a state, far longer than those around it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TimeGap {
    /// Index of the state after it.
    pub state: usize,
    /// Times of the states before and after it.
    pub from: f64,
    /// Time of the state after the gap.
    pub to: f64,
    /// Interval of the states around it.
    pub interval: f64,
    /// States that seem to be missing.
    pub missing: usize,
}

impl fmt::Display for TimeGap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { from, to, interval, missing, state } = self;
        write!(
            f,
            "there is no state between time {from:?} and {to:?} (states {state} and {}), although states are about {interval:.3e} apart there: about {missing} seem to be missing",
            state + 1
        )
    }
}

/// An interval is a hole if it is this many times the interval around it: 3, and a little for
/// the rounding of printed times.
const GAP_RATIO: f64 = 3.01;
/// Intervals that are examined on each side of one.
const GAP_SIDE: usize = 4;
/// Intervals that must be known on both sides together to judge one.
const GAP_KNOWN: usize = 3;

/// The holes in `time`: intervals above 3 times the median of the four on either side,
/// whichever is larger.
///
/// For a file of one rate that is its median. The median of the whole file would call every
/// interval of a file's slower part a hole: a rate that changes and then stays is a choice of
/// the user, and is none. A hole shows by both sides being denser, at the ends
/// of the file by the one side there is. So a slower rate of which the file holds one or two
/// intervals counts as a hole (it is drawn across with a straight line all the same), and
/// three holes within four intervals count as a rate. A last state off the raster and small
/// jitter stay far below 3. Equal printed times (they have six digits) and times that go back
/// make no interval. Files of four states or fewer have no holes.
pub(crate) fn time_gaps(time: &[f64]) -> Vec<TimeGap> {
    let mut intervals: Vec<(usize, f64, f64)> = Vec::new();
    let mut last: Option<f64> = None;
    for (state, &now) in time.iter().enumerate().filter(|(_, t)| t.is_finite()) {
        match last {
            Some(before) if now <= before => continue,
            Some(before) => intervals.push((state, before, now)),
            None => {}
        }
        last = Some(now);
    }
    let upper_median = |side: &[(usize, f64, f64)]| {
        let mut lengths: Vec<f64> = side.iter().map(|(_, from, to)| to - from).collect();
        lengths.sort_by(f64::total_cmp);
        lengths.get(lengths.len() / 2).copied().unwrap_or(0.0)
    };
    let mut gaps = Vec::new();
    for (k, &(state, from, to)) in intervals.iter().enumerate() {
        let before = &intervals[k.saturating_sub(GAP_SIDE)..k];
        let behind = &intervals[k + 1..intervals.len().min(k + 1 + GAP_SIDE)];
        // No median is below the smallest, which is cheap to find.
        let shortest = before.iter().map(|(_, from, to)| to - from).reduce(f64::min);
        if shortest.is_some_and(|shortest| (to - from) / shortest <= GAP_RATIO) {
            continue;
        }
        let interval = upper_median(before).max(upper_median(behind));
        let ratio = (to - from) / interval;
        if before.len() + behind.len() >= GAP_KNOWN && ratio > GAP_RATIO {
            let missing = (ratio.round() as usize).saturating_sub(1);
            gaps.push(TimeGap { state, from, to, interval, missing });
        }
    }
    gaps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(intervals: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut now = 0.0;
        let behind = intervals.into_iter().map(|interval| {
            now += interval;
            now
        });
        [0.0].into_iter().chain(behind).collect()
    }

    fn gaps(intervals: &[(usize, f64)]) -> Vec<(usize, usize)> {
        let each = intervals.iter().flat_map(|&(count, interval)| vec![interval; count]);
        time_gaps(&times(each)).iter().map(|gap| (gap.state, gap.missing)).collect()
    }

    #[test]
    fn a_hole_in_time_is_found_wherever_it_is() {
        assert_eq!(gaps(&[(20, 1.0), (1, 69.0), (20, 1.0)]), [(21, 68)]);
        assert_eq!(gaps(&[(20, 1.0), (1, 3.1), (20, 1.0)]), [(21, 2)]);
        assert_eq!(gaps(&[(1, 9.0), (20, 1.0)]), [(1, 8)], "behind the first state");
        assert_eq!(gaps(&[(20, 1.0), (1, 9.0)]), [(21, 8)], "before the last state");
        assert_eq!(gaps(&[(9, 1.0), (1, 5.0), (1, 1.0), (1, 5.0), (9, 1.0)]).len(), 2);
        assert_eq!(gaps(&[(9, 1.0), (2, 5.0), (9, 1.0)]).len(), 2, "one state between two holes");
    }

    #[test]
    fn a_hole_is_found_in_both_parts_of_a_file_of_two_rates() {
        assert_eq!(gaps(&[(9, 0.1), (1, 0.9), (9, 0.1), (90, 1.0)]), [(10, 8)]);
        assert_eq!(gaps(&[(90, 0.1), (9, 1.0), (1, 8.0), (9, 1.0)]), [(100, 7)]);
    }

    #[test]
    fn what_solvers_write_has_no_holes() {
        assert_eq!(gaps(&[(90, 0.1), (30, 1.0)]), [], "a slower rate from some time on");
        assert_eq!(gaps(&[(30, 1.0), (90, 0.1)]), [], "a finer rate from some time on");
        assert_eq!(gaps(&[(90, 1.0), (1, 0.01)]), [], "a last state off the raster");
        assert_eq!(gaps(&[(1, 0.01), (90, 1.0)]), [], "a first state of its own");
        assert_eq!(gaps(&[(1, 2.0), (90, 1.0)]), [], "a first interval of two");
        assert_eq!(gaps(&[(20, 0.01), (1, 0.03), (20, 0.01)]), [], "two states left out");
        let pairs: Vec<(usize, f64)> = (0..20).flat_map(|_| [(1, 0.1), (1, 0.9)]).collect();
        assert_eq!(gaps(&pairs), [], "two raster lines beside each other");
        let jitter = (0..90).map(|k| if k % 3 == 0 { 0.7 } else { 1.4 });
        assert_eq!(time_gaps(&times(jitter)), []);
        let printed: Vec<f64> = (0..90).map(|k| (f64::from(k) * 0.3).floor()).collect();
        assert_eq!(time_gaps(&printed), [], "times that have too few digits");
        assert_eq!(time_gaps(&[1.0, 2.0, 3.0, 0.5, 4.0, 5.0]), [], "a time that goes back");
        assert_eq!(time_gaps(&[0.0, 1.0, 9.0, 10.0]), [], "too few states to tell");
        assert_eq!(time_gaps(&[]), []);
    }
}
