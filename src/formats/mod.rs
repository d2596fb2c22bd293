//! Exports: a predicted curve or a model as a file for another tool. One file per target.
//! [`read`] takes curves back from such files.

pub mod csv;
pub mod json;
pub mod lsdyna;
pub mod onnx;
pub mod read;

use std::path::Path;

use crate::curve::Parameter;
use crate::dataset::OTHER_MASS;
use crate::forest::OnnxError;
use crate::surrogate::{Model, PredictedCurve};
use crate::unit::{SpeedKind, UnitSystem};

/// One target: its name, its file extensions, how it is written.
pub struct Format {
    pub name: &'static str,
    /// Without the dot; the first is the usual one.
    pub extensions: &'static [&'static str],
    pub description: &'static str,
    write: Write,
}

/// What a target is made of.
enum Write {
    Curve(fn(&PredictedCurve, &Options) -> Result<Vec<u8>, ExportError>),
    Model(fn(&Model) -> Result<Vec<u8>, ExportError>),
}

/// Every format we write. To add one: write its module, add its line here.
pub const FORMATS: &[Format] = &[
    Format {
        name: "json",
        extensions: &["json"],
        description: "predicted curve with everything known of it, SI (master format)",
        write: Write::Curve(json::write),
    },
    Format {
        name: "csv",
        extensions: &["csv"],
        description: "columns of deflection and force with # header lines, SI or --units",
        write: Write::Curve(csv::write),
    },
    Format {
        name: "lsdyna",
        extensions: &["k", "key", "dyn"],
        description: "LS-DYNA *DEFINE_CURVE_TITLE, in the study's units or --units",
        write: Write::Curve(lsdyna::write),
    },
    Format {
        name: "onnx",
        extensions: &["onnx"],
        description: "forest model (of crumple train) as ONNX, SI; splits double, output float",
        write: Write::Model(onnx::write),
    },
];

/// Choices that some targets take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Units of the file; the target's usual ones if absent.
    pub units: Option<UnitSystem>,
    /// Number of the curve in the target's deck.
    pub id: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { units: None, id: 101 }
    }
}

/// Why a curve or a model cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error("there is no export format \"{name}\": use one of {known}")]
    NoSuchFormat { name: String, known: String },
    #[error(
        "{path}: the extension does not name an export format: use one of {known}, or name the format"
    )]
    NoSuchExtension { path: String, known: String },
    #[error("{format} takes {needs}")]
    Unfit { format: &'static str, needs: String },
    #[error("columns need units with names of their own: lengths in {lengths}, forces in {forces}")]
    NoUnitNames { lengths: String, forces: String },
    #[error(
        "{format} is always in SI: leave --units away, or take a format that has units (csv, lsdyna)"
    )]
    SiOnly { format: &'static str },
    #[error(transparent)]
    Onnx(#[from] OnnxError),
    #[error("cannot encode the curve: {0}")]
    Encode(#[from] serde_json::Error),
}

/// Most bytes of a file that holds a curve: a predicted one has some ten thousand.
pub(crate) const MAX_CURVE_BYTES: u64 = 64 << 20;

/// Fewest points that every target takes.
pub const MIN_POINTS: usize = 4;

impl Format {
    /// Whether it is made of a model, not of a curve.
    pub fn takes_model(&self) -> bool {
        matches!(self.write, Write::Model(_))
    }

    /// The file's bytes, made of a model.
    ///
    /// # Errors
    /// [`ExportError::Unfit`] if the target cannot take the model.
    pub fn encode_model(&self, model: &Model) -> Result<Vec<u8>, ExportError> {
        match self.write {
            Write::Model(write) => write(model),
            Write::Curve(_) => Err(self.unfit("a curve made by crumple predict")),
        }
    }

    fn unfit(&self, needs: impl Into<String>) -> ExportError {
        ExportError::Unfit { format: self.name, needs: needs.into() }
    }

    /// The file's bytes, made of a curve.
    ///
    /// # Errors
    /// [`ExportError::Unfit`] if the target cannot take the curve.
    pub fn encode(
        &self,
        curve: &PredictedCurve,
        options: &Options,
    ) -> Result<Vec<u8>, ExportError> {
        let Write::Curve(write) = self.write else {
            return Err(self.unfit("a model: crumple export MODEL --to onnx"));
        };
        let points = curve.deflection_m.len();
        if points < MIN_POINTS {
            return Err(self.unfit(format!("{MIN_POINTS} points or more, found {points}")));
        }
        write(curve, options)
    }

    /// Whether one file holds both forces of a curve, each with its unloading.
    pub fn holds_both_forces(&self) -> bool {
        self.name == "json"
    }
}

/// The format of that name.
///
/// # Errors
/// [`ExportError::NoSuchFormat`] lists the names there are.
pub fn by_name(name: &str) -> Result<&'static Format, ExportError> {
    let known = || FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ");
    FORMATS
        .iter()
        .find(|f| f.name == name)
        .ok_or_else(|| ExportError::NoSuchFormat { name: name.into(), known: known() })
}

/// The format that the file's extension names.
///
/// # Errors
/// [`ExportError::NoSuchExtension`] lists the extensions there are.
pub fn by_extension(path: &Path) -> Result<&'static Format, ExportError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let known = || {
        let all: Vec<String> =
            FORMATS.iter().flat_map(|f| f.extensions).map(|e| format!(".{e}")).collect();
        all.join(", ")
    };
    FORMATS.iter().find(|f| f.extensions.contains(&extension)).ok_or_else(|| {
        ExportError::NoSuchExtension { path: path.display().to_string(), known: known() }
    })
}

/// What a curve is, in one line, for headers and titles.
fn headline(curve: &PredictedCurve) -> String {
    format!(
        "{} {} ({})",
        curve.provenance.group,
        crate::unit::km_per_h(curve.speed_m_per_s),
        curve.speed_kind.name()
    )
}

/// What a curve is and what it may drive, as keys and values of a file's header; SI.
fn facts(curve: &PredictedCurve) -> Vec<(&'static str, String)> {
    let kind = curve.provenance.force_kind;
    let steepest = curve.envelope().map_or(0.0, |e| e.max_slope());
    vec![
        ("curve", headline(curve)),
        ("force_kind", kind.name().into()),
        ("drives", kind.drives().into()),
        ("sign", "deflection and force positive in compression".into()),
        ("speed_m_per_s", curve.speed_m_per_s.to_string()),
        ("speed_kind", curve.speed_kind.name().into()),
        ("mass_kg", curve.mass_kg.to_string()),
        ("impact", impact(curve)),
        ("energy_J", nine_digits(curve.energy_j)),
        ("unloading_stiffness_N_per_m", nine_digits(curve.unloading_stiffness_n_per_m)),
        ("unloading", unloading(curve, steepest).into()),
        ("steepest_rise_N_per_m", nine_digits(steepest)),
        ("model", curve.model.clone()),
        ("training_hash", curve.provenance.training_hash.clone()),
        ("written_by", curve.provenance.written_by.clone()),
    ]
}

/// What the unloading stiffness gives.
fn unloading(curve: &PredictedCurve, steepest_n_per_m: f64) -> &'static str {
    let softer = curve.unloading_stiffness_n_per_m < steepest_n_per_m;
    match (curve.rebound.is_some(), softer) {
        (true, false) => "along this stiffness from the maximal crush it gives the rebound",
        (true, true) => {
            "along this stiffness from the maximal crush it gives the rebound; from a point of the steepest rise it would give energy"
        }
        (false, _) => {
            "no run shows the rebound: at least the steepest rise, so that it gives no energy"
        }
    }
}

/// What hits what.
fn impact(curve: &PredictedCurve) -> String {
    match (curve.speed_kind, curve.provenance.parameters.get(OTHER_MASS)) {
        (SpeedKind::Wall, _) => "one body of this mass against a rigid wall".into(),
        (SpeedKind::Closing, Some(Parameter::Number(other))) => {
            format!(
                "two bodies, of this mass and of {other} kg; the speed is that of their closure"
            )
        }
        (SpeedKind::Closing, _) => {
            "two bodies of this mass each; the speed is that of their closure".into()
        }
    }
}

/// Nine significant digits in Fortran's form: `3.80000000E+06`.
fn nine_digits(value: f64) -> String {
    // A negative zero would only puzzle readers.
    let text = format!("{:.8E}", value + 0.0);
    match text.split_once('E') {
        Some((mantissa, exponent)) => {
            let (sign, digits) = match exponent.strip_prefix('-') {
                Some(digits) => ('-', digits),
                None => ('+', exponent),
            };
            format!("{mantissa}E{sign}{digits:0>2}")
        }
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_nine_digits() {
        assert_eq!(nine_digits(3.8e6), "3.80000000E+06");
        assert_eq!(nine_digits(-1.0 / 3.0), "-3.33333333E-01");
        assert_eq!(nine_digits(-0.0), "0.00000000E+00");
        assert_eq!(nine_digits(1e-120), "1.00000000E-120");
    }
}
