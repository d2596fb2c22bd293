//! The entries of the table of models.

use std::sync::Arc;

use serde::de::DeserializeOwned;

use super::forest_options::ForestOptions;
use super::{CaseCurve, CrushLaw, Surrogate};
use crate::curve::ForceKind;
use crate::dataset::TrainingSet;
use crate::error::{Error, error};

/// One model: its name, its requirements, how it is fitted and read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ModelEntry {
    /// As the command line and model files name it.
    pub name: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// Place from simple (0) to elaborate: of the models that follow the closing speed the simplest is the default.
    pub complexity: u8,
    /// Whether it sees parameters besides the speed.
    pub sees_features: bool,
    /// Whether its force follows the closing speed at each deflection.
    pub follows_closing: bool,
    /// Whether it needs runs that determine a crush law with stopped mass.
    pub needs_crush_law: bool,
    /// Minimum number of training curves that it answers from.
    pub least_curves: usize,
    /// Options of its forest; `None` for a model without one.
    pub(super) forest: Option<fn() -> ForestOptions>,
    pub(super) fit: Fit,
    /// From what [`Surrogate::parameters`] gave; `None` for a model without any.
    pub(super) load: Load,
}

/// Fits a model.
pub(super) type Fit = fn(&FitInput<'_>) -> Result<Arc<dyn Surrogate>, Error>;

/// Makes a model of its parameters in a model file.
pub(super) type Load = fn(Option<&str>) -> Result<Arc<dyn Surrogate>, serde_json::Error>;

/// Input of a fit.
pub(super) struct FitInput<'a> {
    pub set: &'a TrainingSet,
    /// The curves of `force`, in order of speed.
    pub curves: &'a [CaseCurve],
    pub force: ForceKind,
    pub forest: Option<&'a ForestOptions>,
    /// Of the set, if the model needs one and the runs determine one.
    pub crush_law: Option<&'a CrushLaw>,
}

impl FitInput<'_> {
    pub(crate) fn forest_options(&self) -> &ForestOptions {
        self.forest.expect("ModelKind gives options to each model with a forest")
    }

    /// The crush law with stopped mass.
    pub(crate) fn crush_law(&self) -> Result<CrushLaw, Error> {
        self.crush_law.cloned().ok_or(error!(Model, "model crush-law takes the mass stopped in the crush zone from momentum: it needs contact forces and speeds of a body against a wall, or of two bodies of equal mass, whose momentum agrees; the runs of this group do not qualify, or show no stopped mass: use --model rate"))
    }
}

/// `parameters` of a model that has some.
pub(super) fn loaded<T>(parameters: Option<&str>) -> Result<Arc<dyn Surrogate>, serde_json::Error>
where
    T: Surrogate + DeserializeOwned + 'static,
{
    Ok(Arc::new(serde_json::from_str::<T>(parameters.unwrap_or("null"))?))
}
