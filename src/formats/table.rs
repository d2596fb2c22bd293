//! Table of a model: force over speed and deflection, for tools that interpolate in both; SI.
//!
//! Each speed's curve goes on beyond its maximal crush as a tail that is held, so that the table is a full rectangle.

use super::tail::{Tail, with_tail};
use super::text::{Lines, nine_digits};
use super::{ExportError, Exported, Options};
use crate::curve::{Envelope, ForceKind};
use crate::hdf5::{AttrValue, FileBuilder};
use crate::surrogate::predict::predict_beyond;
use crate::surrogate::{Model, Query};

/// Value of the HDF5 root's `format`.
const FORMAT: &str = "crumple force table";
/// Speeds of a table if none are asked for.
const SPEEDS: usize = 25;
/// Intervals of the deflection. They grow with its square root: a crush of 10 mm at a low speed has as
/// sharp a spike as one of 2 m, in the same row of columns.
const INTERVALS: usize = 1000;

/// Force over speed and deflection.
struct Table {
    speed_m_per_s: Vec<f64>,
    deflection_m: Vec<f64>,
    /// One row per speed.
    force_n: Vec<f64>,
    max_deflection_m: Vec<f64>,
    unloading_stiffness_n_per_m: Vec<f64>,
    warnings: Vec<String>,
}

pub fn write(model: &Model, options: &Options) -> Result<Exported, ExportError> {
    if options.units.is_some() {
        return Err(ExportError::SiOnly { format: "table" });
    }
    let table = Table::of(model, options)?;
    let is_csv = options.extension.as_deref() == Some("csv");
    let bytes = match is_csv {
        true => table.to_csv(model, options.force),
        false => table.to_hdf5(model, options.force)?,
    };
    let extension = if is_csv { "csv" } else { "h5" };
    let name = format!("table.{extension}");
    Ok(Exported { files: vec![(name, bytes)], notes: Vec::new(), warnings: table.warnings })
}

impl Table {
    fn of(model: &Model, options: &Options) -> Result<Self, ExportError> {
        let (low, high) = model.range_m_per_s();
        let even = |k: usize| low + (high - low) * k as f64 / (SPEEDS - 1) as f64;
        let mut speed_m_per_s = options.speeds_m_per_s.clone();
        if speed_m_per_s.is_empty() {
            // The training speeds themselves belong to it: a curve is best known there.
            speed_m_per_s = (0..SPEEDS).map(even).collect();
            speed_m_per_s.extend(model.cases.iter().map(|c| c.speed_m_per_s));
        }
        speed_m_per_s.sort_by(f64::total_cmp);
        speed_m_per_s.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs());
        let tail = match options.tail {
            Some(Tail::None) => {
                let needs = "a tail: its curves end at different crushes (--tail hold or bottom)";
                return Err(ExportError::Unfit { format: "table", needs: needs.into() });
            }
            asked => asked.unwrap_or(Tail::Hold),
        };
        let (mut max_deflection_m, mut stiffness, mut curves) =
            (Vec::new(), Vec::new(), Vec::new());
        let mut warnings = Vec::new();
        for &speed in &speed_m_per_s {
            let query = Query { speed_m_per_s: speed, ..options.query.clone() };
            let (curve, beyond) = predict_beyond(model, &query)?;
            let alone = curve.of_force(options.force)?;
            let beyond = match options.force {
                ForceKind::Contact => &beyond.declared,
                ForceKind::Body => &beyond.body,
            };
            let k_u = alone.unloading_stiffness_n_per_m;
            curves.push(with_tail(&alone.envelope()?, Some(beyond), k_u, tail)?);
            max_deflection_m.push(alone.max_deflection_m);
            stiffness.push(k_u);
            warnings.extend(curve.warnings.iter().map(ToString::to_string));
        }
        warnings.sort();
        warnings.dedup();
        let reach = curves.iter().map(Envelope::end_m).fold(0.0, f64::max);
        let share = |k: usize| (k as f64 / INTERVALS as f64).powf(1.5);
        let deflection_m: Vec<f64> = (0..=INTERVALS).map(|k| reach * share(k)).collect();
        let mut force_n = Vec::with_capacity(curves.len() * deflection_m.len());
        for (curve, &end) in curves.iter().zip(&max_deflection_m) {
            force_n.extend(row(curve, &deflection_m, end)?);
        }
        Ok(Self {
            force_n,
            speed_m_per_s,
            deflection_m,
            max_deflection_m,
            unloading_stiffness_n_per_m: stiffness,
            warnings,
        })
    }

    /// One line per speed and deflection.
    fn to_csv(&self, model: &Model, force: ForceKind) -> Vec<u8> {
        let mut lines = Lines::default();
        for (key, value) in facts(model, force) {
            lines.add(format_args!("# {key}: {value}"));
        }
        lines.add(format_args!("speed_m_per_s,d_m,force_N"));
        for (row, speed) in self.force_n.chunks(self.deflection_m.len()).zip(&self.speed_m_per_s) {
            for (d, f) in self.deflection_m.iter().zip(row) {
                lines.add(format_args!(
                    "{},{},{}",
                    nine_digits(*speed),
                    nine_digits(*d),
                    nine_digits(*f)
                ));
            }
        }
        lines.into_bytes()
    }

    fn to_hdf5(&self, model: &Model, force: ForceKind) -> Result<Vec<u8>, ExportError> {
        let mut out = FileBuilder::new();
        out.set_attr("format", AttrValue::VarLenString(FORMAT.into()));
        for (key, value) in facts(model, force) {
            out.set_attr(key, AttrValue::VarLenString(value));
        }
        let shape = [self.speed_m_per_s.len() as u64, self.deflection_m.len() as u64];
        out.create_dataset("force_N").with_f64_data(&self.force_n).with_shape(&shape);
        for (name, values) in [
            ("speed_m_per_s", &self.speed_m_per_s),
            ("deflection_m", &self.deflection_m),
            ("max_deflection_m", &self.max_deflection_m),
            ("unloading_stiffness_N_per_m", &self.unloading_stiffness_n_per_m),
        ] {
            out.create_dataset(name).with_f64_data(values);
        }
        out.finish().map_err(|e| ExportError::Hdf5 { detail: e.to_string() })
    }
}

/// The forces of a curve at these deflections, with its own energy to its maximal crush.
fn row(curve: &Envelope, deflection_m: &[f64], end_m: f64) -> Result<Vec<f64>, ExportError> {
    let mut force_n: Vec<f64> = deflection_m.iter().map(|&d| curve.force_at(d)).collect();
    let sampled = Envelope::new(deflection_m.to_vec(), force_n.clone())?;
    let scale = curve.work_to(end_m) / sampled.work_to(end_m);
    if scale.is_finite() {
        let until = deflection_m.partition_point(|&d| d <= end_m);
        force_n[..until].iter_mut().for_each(|f| *f *= scale);
    }
    Ok(force_n)
}

fn facts(model: &Model, force: ForceKind) -> Vec<(&'static str, String)> {
    let (low, high) = model.range_m_per_s();
    vec![
        ("group", model.group.clone()),
        ("force_kind", force.name().into()),
        ("drives", force.drives().into()),
        ("speed_kind", model.speed_kind.name().into()),
        ("mass_kg", model.mass_kg.to_string()),
        ("fitted_between", format!("{low} and {high} m/s")),
        ("beyond", "each curve goes on beyond its maximal crush, along faster runs".into()),
        ("model", model.name().into()),
        ("training_hash", model.training_hash.clone()),
        ("written_by", concat!("crumple ", env!("CARGO_PKG_VERSION")).into()),
    ]
}
