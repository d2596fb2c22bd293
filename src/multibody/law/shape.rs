//! Shape of an unloading branch, as shares of its force and its length.

/// Shape of an unloading branch: share of the force at the top over the share of the
/// branch's length that has been given back.
///
/// Invariant: shares of the length rise from 0 to 1, those of the force are at least 0, begin
/// at 1 and end at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct UnloadingShape {
    pub(super) length: Vec<f64>,
    pub(super) force: Vec<f64>,
    /// `∫` of the force from each point to the end; the first is the share of force × length that
    /// is given back.
    pub(super) rest: Vec<f64>,
    /// `∫` of `rest` from the first point to each.
    pub(super) rest_so_far: Vec<f64>,
}

impl UnloadingShape {
    /// The straight line.
    pub fn line() -> Self {
        Self::new(vec![0.0, 1.0], vec![1.0, 0.0])
    }

    fn new(length: Vec<f64>, force: Vec<f64>) -> Self {
        let n = length.len();
        let mut rest = vec![0.0; n];
        for j in (0..n - 1).rev() {
            rest[j] = rest[j + 1] + 0.5 * (force[j] + force[j + 1]) * (length[j + 1] - length[j]);
        }
        let mut rest_so_far = vec![0.0; n];
        for j in 0..n - 1 {
            let step = length[j + 1] - length[j];
            rest_so_far[j + 1] = rest_so_far[j]
                + rest[j + 1] * step
                + (force[j] / 6.0 + force[j + 1] / 3.0) * step * step;
        }
        Self { length, force, rest, rest_so_far }
    }

    /// From a branch that was recorded: deflections in m, falling, and forces in N. Points at
    /// which the deflection does not fall are left out; forces end at the first that is not
    /// above 0. `None` if that leaves fewer than three points or no force.
    pub fn of_branch(deflection_m: &[f64], force_n: &[f64]) -> Option<Self> {
        let (&top_m, &top_n) = (deflection_m.first()?, force_n.first()?);
        if top_n.is_nan() || top_n <= 0.0 {
            return None;
        }
        let mut points = vec![(top_m, 1.0)];
        for (&d, &f) in deflection_m.iter().zip(force_n).skip(1) {
            let (before_m, before) = points[points.len() - 1];
            if !(d < before_m && f.is_finite()) {
                continue;
            }
            let force = f / top_n;
            if force <= 0.0 {
                // Where the straight line between the two samples reaches zero.
                points.push((before_m - (before_m - d) * before / (before - force), 0.0));
                break;
            }
            points.push((d, force));
        }
        let (end_m, last) = points[points.len() - 1];
        if points.len() < 3 || last > 0.0 || end_m >= points[points.len() - 2].0 {
            return None;
        }
        let length = points.iter().map(|(d, _)| (top_m - d) / (top_m - end_m)).collect();
        Some(Self::new(length, points.iter().map(|p| p.1).collect()))
    }

    /// Share of force × length that is given back: ½ for the line.
    pub(super) fn share(&self) -> f64 {
        self.rest[0]
    }

    /// The piece that holds a share of the length.
    pub(super) fn piece(&self, length: f64) -> usize {
        let above = self.length.partition_point(|&s| s <= length);
        above.clamp(1, self.length.len() - 1) - 1
    }

    /// Change of the force over the length in piece `j`, at most 0 where it falls.
    pub(super) fn slope(&self, j: usize) -> f64 {
        (self.force[j + 1] - self.force[j]) / (self.length[j + 1] - self.length[j])
    }

    /// `∫` of the force from a share of the length below 1 to the end.
    pub(super) fn rest_at(&self, length: f64) -> f64 {
        let j = self.piece(length);
        let along = self.length[j + 1] - length;
        let force = self.force[j + 1] - self.slope(j) * along;
        self.rest[j + 1] + 0.5 * (self.force[j + 1] + force) * along
    }

    /// Steepest fall, 1 for the line.
    pub(super) fn steepest(&self) -> f64 {
        (0..self.length.len() - 1).map(|j| self.slope(j).abs()).fold(0.0, f64::max)
    }
}
