//! Target of model files: any bytes give a model or an error, and a model a curve or one.

use std::path::Path;

use crumple::surrogate::{Model, Query, predict};

pub fn target(bytes: &[u8]) {
    let model = match Model::parse(Path::new("a.model"), bytes) {
        Ok(model) => model,
        Err(error) => {
            assert!(error.to_string().starts_with("a.model: "));
            return;
        }
    };
    let (low, high) = model.range_m_per_s();
    for v in [0.5 * low, 0.5 * (low + high), 2.0 * high] {
        let query = Query { extrapolate: true, ..Query::at(v) };
        if let Ok(curve) = predict(&model, &query) {
            assert!(curve.force_n.iter().all(|f| f.is_finite() && *f >= 0.0));
            assert_eq!(curve.deflection_m[0], 0.0);
        }
    }
}
