//! Data sets: the cases of a group, checked and made into tables {v, d} → F.

use linfa::Dataset;
use ndarray::{Array1, Array2};
use serde::{Deserialize, Serialize};

use crate::curve::loading::loading_branch;
use crate::curve::{Case, Envelope, EnvelopeError, ForceKind, Masses};
use crate::unit::{SpeedKind, km_per_h};

/// One case as models see it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingCase {
    pub name: String,
    pub speed_m_per_s: f64,
    /// Loading branch at the solver's rate.
    pub envelope: Envelope,
    /// Loading branch at the common interval, as the reference method uses it.
    pub sampled: Envelope,
    pub truncated: bool,
    pub unloading_stiffness_n_per_m: Option<f64>,
    pub fingerprint: String,
}

/// The cases of one group.
///
/// Invariant: at least one case; speeds strictly increasing; one kind of speed and force.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingSet {
    pub group: String,
    pub speed_kind: SpeedKind,
    pub force_kind: ForceKind,
    /// Masses of the first case; [`TrainingSet::equal_masses`] says if all share them.
    pub masses: Masses,
    pub equal_masses: bool,
    pub cases: Vec<TrainingCase>,
}

/// Why cases are no training set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DatasetError {
    #[error("the group is empty: build it first")]
    Empty,
    #[error("cases \"{first}\" and \"{second}\" have the same speed {speed}: keep one of them")]
    EqualSpeeds { first: String, second: String, speed: String },
    #[error("cases \"{first}\" and \"{second}\" mix {what}: keep one kind per group")]
    Mixed { first: String, second: String, what: &'static str },
    #[error("case \"{name}\": {source}")]
    Envelope { name: String, source: EnvelopeError },
}

/// Which points of the cases make the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TableKind {
    /// The states at the common interval (reference method).
    Samples,
    /// An even deflection grid from the solver's rate, no coarser than [`GRID_M`].
    Grid,
}

/// Coarsest deflection grid for training: at 20 m/s one state each 0.75 ms is 15 mm, a
/// third of the way to the first peak.
pub const GRID_M: f64 = 2e-3;

/// Index of the speed nearest to `v`; of two equally near ones the first.
pub fn nearest(speeds_m_per_s: impl Iterator<Item = f64>, v: f64) -> usize {
    let closer = |best: (usize, f64), (i, s): (usize, f64)| {
        let distance = (s - v).abs();
        if distance < best.1 { (i, distance) } else { best }
    };
    speeds_m_per_s.enumerate().fold((0, f64::INFINITY), closer).0
}

impl TrainingSet {
    /// Checks the cases of a group.
    ///
    /// # Errors
    /// [`DatasetError`] names the cases that do not fit together.
    pub fn new<'a>(
        group: &str,
        cases: impl IntoIterator<Item = &'a Case>,
    ) -> Result<Self, DatasetError> {
        let mut cases: Vec<&Case> = cases.into_iter().collect();
        cases.sort_by(|a, b| a.speed.m_per_s.total_cmp(&b.speed.m_per_s));
        let first = *cases.first().ok_or(DatasetError::Empty)?;
        for pair in cases.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let names = || (a.name.clone(), b.name.clone());
            if a.speed.m_per_s == b.speed.m_per_s {
                let (first, second) = names();
                let speed = km_per_h(a.speed.m_per_s);
                return Err(DatasetError::EqualSpeeds { first, second, speed });
            }
            let mixed = if a.speed.kind != b.speed.kind {
                Some("wall and closing speeds")
            } else if a.force_kind != b.force_kind {
                Some("contact and body forces")
            } else {
                None
            };
            if let Some(what) = mixed {
                let (first, second) = names();
                return Err(DatasetError::Mixed { first, second, what });
            }
        }
        let training = cases.iter().map(|c| TrainingCase::new(c)).collect::<Result<_, _>>()?;
        Ok(Self {
            group: group.into(),
            speed_kind: first.speed.kind,
            force_kind: first.force_kind,
            masses: first.masses,
            equal_masses: cases.iter().all(|c| c.masses == first.masses),
            cases: training,
        })
    }

    /// Hash over the fingerprints of the cases.
    pub fn hash(&self) -> String {
        let mut hash = blake3::Hasher::new();
        for case in &self.cases {
            hash.update(case.fingerprint.as_bytes());
        }
        hash.finalize().to_hex().to_string()
    }

    pub fn speeds_m_per_s(&self) -> Vec<f64> {
        self.cases.iter().map(|c| c.speed_m_per_s).collect()
    }

    /// Largest deflection of any case, in m.
    pub fn max_deflection_m(&self) -> f64 {
        self.cases.iter().map(|c| c.envelope.end_m()).fold(0.0, f64::max)
    }

    /// The table {v in m/s, d in m} → F in N over the loading branches of all cases.
    pub fn table(&self, kind: TableKind) -> Dataset<f64, f64, ndarray::Ix1> {
        let mut records = Vec::new();
        let mut targets = Vec::new();
        for case in &self.cases {
            let (deflection_m, force_n) = case.points(kind);
            records.extend(deflection_m.iter().flat_map(|&d| [case.speed_m_per_s, d]));
            targets.extend(force_n);
        }
        let records = Array2::from_shape_fn((targets.len(), 2), |(i, k)| records[2 * i + k]);
        Dataset::new(records, Array1::from(targets))
            .with_feature_names(vec!["speed_m_per_s", "deflection_m"])
    }
}

impl TrainingCase {
    fn new(case: &Case) -> Result<Self, DatasetError> {
        let named = |source| DatasetError::Envelope { name: case.name.clone(), source };
        Ok(Self {
            name: case.name.clone(),
            speed_m_per_s: case.speed.m_per_s,
            envelope: loading_branch(&case.original).map_err(named)?.envelope,
            sampled: loading_branch(&case.sampled).map_err(named)?.envelope,
            truncated: case.is_truncated(),
            unloading_stiffness_n_per_m: case.unloading_stiffness_n_per_m,
            fingerprint: case.fingerprint.clone(),
        })
    }

    fn points(&self, kind: TableKind) -> (Vec<f64>, Vec<f64>) {
        match kind {
            TableKind::Samples => {
                (self.sampled.deflection_m().to_vec(), self.sampled.force_n().to_vec())
            }
            TableKind::Grid => {
                let end = self.envelope.end_m();
                let steps = (end / GRID_M).ceil().clamp(1.0, 1e6) as usize;
                let at = |i| end * i as f64 / steps as f64;
                let deflection_m: Vec<f64> = (0..=steps).map(at).collect();
                let force_n = deflection_m.iter().map(|&d| self.envelope.force_at(d)).collect();
                (deflection_m, force_n)
            }
        }
    }
}
