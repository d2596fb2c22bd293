//! `nearest` (FDRM): the one FE curve measured at the nearest speed, used as it is.

use serde::{Deserialize, Serialize};

use super::{Surrogate, Warning};
use crate::curve::Envelope;
use crate::dataset::{TrainingSet, nearest};

/// The measured curves, one of which answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Nearest {
    curves: Vec<NearestCurve>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct NearestCurve {
    speed_m_per_s: f64,
    deflection_m: Vec<f64>,
    #[serde(rename = "force_N")]
    force_n: Vec<f64>,
}

impl Nearest {
    pub fn fit(set: &TrainingSet) -> Self {
        let curves = set
            .cases
            .iter()
            .map(|case| NearestCurve {
                speed_m_per_s: case.speed_m_per_s,
                deflection_m: case.envelope.deflection_m().to_vec(),
                force_n: case.envelope.force_n().to_vec(),
            })
            .collect();
        Self { curves }
    }

    /// Checks curves that were read from a file.
    pub fn check(&self) -> Result<(), String> {
        if self.curves.is_empty() {
            return Err("there are no curves".into());
        }
        self.curves.iter().try_for_each(|c| {
            Envelope::new(c.deflection_m.clone(), c.force_n.clone())
                .map(|_| ())
                .map_err(|e| e.to_string())
        })
    }

    /// The curve nearest in speed; of two equally near ones the slower.
    fn nearest(&self, speed_m_per_s: f64) -> &NearestCurve {
        &self.curves[nearest(self.curves.iter().map(|c| c.speed_m_per_s), speed_m_per_s)]
    }
}

impl Surrogate for Nearest {
    fn force_n(&self, speed_m_per_s: f64, deflection_m: &[f64]) -> Vec<f64> {
        let curve = self.nearest(speed_m_per_s);
        // Curves were checked when they were fitted or read.
        match Envelope::new(curve.deflection_m.clone(), curve.force_n.clone()) {
            Ok(envelope) => deflection_m.iter().map(|&d| envelope.force_at(d)).collect(),
            Err(_) => vec![f64::NAN; deflection_m.len()],
        }
    }

    fn warnings(&self, _: f64) -> Vec<Warning> {
        Vec::new()
    }
}
