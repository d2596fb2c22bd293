//! ONNX: a forest model for other programs' runtimes.

use super::Exported;
use crate::error::{Error, error};
use crate::forest::OnnxDescription;
use crate::surrogate::Model;

/// The model's forest: speed and deflection to force, in SI.
pub(crate) fn write(model: &Model) -> Result<Exported, Error> {
    let Some(forest) = model.forest() else {
        let needs =
            format!("models of --model forest or extra, this is of --model {}", model.name());
        return Err(error!(Export, "{format} takes {needs}", format = "onnx"));
    };
    let (low, high) = model.range_m_per_s();
    let text = format!(
        "Force (N) over {} (m/s) and deflection (m) of {}; fitted between {low} and {high} m/s",
        model.speed_kind.name(),
        model.group
    );
    let further: Vec<String> =
        model.features.iter().map(super::super::dataset::Feature::name).collect();
    let features: Vec<&str> = ["speed_m_per_s", "deflection_m"]
        .into_iter()
        .chain(further.iter().map(String::as_str))
        .collect();
    let description =
        OnnxDescription { name: &model.group, text: &text, features: &features, target: "force_N" };
    Ok(Exported::file(
        "forest.onnx",
        forest.to_onnx(&description).map_err(|e| error!(Export, "{e}"))?,
    ))
}
