//! Table of a model: force over speed and deflection, for tools that interpolate in both; SI.
//!
//! Each speed's curve continues beyond its maximum crush as a tail that is held, so that the table is a full rectangle.

use super::export_curve::in_lines;
use super::text::{line, nine_digits};
use super::{ExportCurve, Exported, Options};
use crate::curve::{Envelope, ForceKind, Tail};
use crate::error::{Error, error};
use crate::hdf5::{AttrValue, FileBuilder};

use crate::surrogate::{Model, Query, predict};
use crate::unit::km_per_h;

/// Names of the band's edges.
const EDGES: [&str; 2] = ["force_low_N", "force_high_N"];
/// Value of the HDF5 root's `format`.
const FORMAT: &str = "crumple force table";
/// Speeds of a table if none are requested.
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
    /// Lower and upper edge of the band, likewise; NaN at a speed without one.
    band: Option<[Vec<f64>; 2]>,
    band_meaning: Option<String>,
    /// What its curves have in common: mass, other mass, parameters.
    of_curves: Vec<(&'static str, String)>,
    max_deflection_m: Vec<f64>,
    unloading_stiffness_n_per_m: Vec<f64>,
    warnings: Vec<String>,
    notes: Vec<String>,
}

pub(crate) fn write(model: &Model, options: &Options) -> Result<Exported, Error> {
    let table = Table::of(model, options)?;
    let is_csv = options.extension.as_deref() == Some("csv");
    let bytes = if is_csv {
        table.to_csv(model, options.force)
    } else {
        table.to_hdf5(model, options.force)?
    };
    let extension = if is_csv { "csv" } else { "h5" };
    let name = format!("table.{extension}");
    Ok(Exported { files: vec![(name, bytes)], notes: table.notes, warnings: table.warnings })
}

impl Table {
    fn of(model: &Model, options: &Options) -> Result<Self, Error> {
        let query = Query { speed_m_per_s: model.range_m_per_s().0, ..options.query.clone() };
        let training = query.speeds_around(model)?;
        let (low, high) = (training[0], training[training.len() - 1]);
        let even = |k: usize| low + (high - low) * k as f64 / (SPEEDS - 1) as f64;
        let mut speed_m_per_s = options.speeds_m_per_s.clone();
        if speed_m_per_s.is_empty() {
            // The training speeds themselves belong to it: a curve is best known there.
            speed_m_per_s = (0..SPEEDS).map(even).collect();
            speed_m_per_s.extend(training);
        }
        speed_m_per_s.sort_by(f64::total_cmp);
        speed_m_per_s.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs());
        let tail = match options.tail {
            Some(Tail::None) => {
                let needs = "a tail: its curves end at different crushes (--tail hold or bottom)";
                return Err(error!(Export, "{format} takes {needs}", format = "table"));
            }
            asked => asked.unwrap_or(Tail::Hold),
        };
        let (mut curves, mut warnings) = (Vec::new(), Vec::new());
        for &speed in &speed_m_per_s {
            let query = Query { speed_m_per_s: speed, ..options.query.clone() };
            let curve = predict(model, &query)?;
            warnings.extend(curve.warnings.iter().map(ToString::to_string));
            curves.push(ExportCurve::new(&curve, options.force, tail, false)?);
        }
        warnings.sort();
        warnings.dedup();
        let reach = curves.iter().map(|c| c.loading.end_m()).fold(0.0, f64::max);
        let share = |k: usize| libm::pow(k as f64 / INTERVALS as f64, 1.5);
        let deflection_m: Vec<f64> = (0..=INTERVALS).map(|k| reach * share(k)).collect();
        let mut force_n = Vec::with_capacity(curves.len() * deflection_m.len());
        let mut band = [Vec::new(), Vec::new()];
        for curve in &curves {
            let (force, edges) = rows(curve, &deflection_m)?;
            force_n.extend(force);
            for (whole, edge) in band.iter_mut().zip(edges) {
                whole.extend(edge);
            }
        }
        let meaning = curves.iter().find_map(|curve| {
            let band = curve.predicted.provenance.band.filter(|_| curve.band.is_some())?;
            let percent = band.level * 100.0;
            Some(format!("{}: empirical range for {percent:.0} % of a force", EDGES.join(" to ")))
        });
        Ok(Self {
            force_n,
            band: meaning.is_some().then_some(band),
            band_meaning: meaning,
            max_deflection_m: curves.iter().map(ExportCurve::max_crush_m).collect(),
            unloading_stiffness_n_per_m: curves
                .iter()
                .map(ExportCurve::stiffness_n_per_m)
                .collect(),
            of_curves: curves.first().map_or_else(Vec::new, |curve| curve.conditions()),
            notes: no_band_note(&curves).into_iter().collect(),
            speed_m_per_s,
            deflection_m,
            warnings,
        })
    }

    /// One line per speed and deflection.
    fn to_csv(&self, model: &Model, force: ForceKind) -> Vec<u8> {
        let mut lines = String::new();
        for (key, value) in self.facts(model, force) {
            line!(lines, "# {key}: {value}");
        }
        let edges =
            if self.band.is_some() { format!(",{}", EDGES.join(",")) } else { String::new() };
        line!(lines, "speed_m_per_s,d_m,force_N{edges}");
        for (i, force) in self.force_n.iter().enumerate() {
            let (row, column) = (i / self.deflection_m.len(), i % self.deflection_m.len());
            let edges = match &self.band {
                Some(band) => {
                    band.iter().map(|edge| format!(",{}", nine_digits(edge[i]))).collect()
                }
                None => String::new(),
            };
            line!(
                lines,
                "{},{},{}{edges}",
                nine_digits(self.speed_m_per_s[row]),
                nine_digits(self.deflection_m[column]),
                nine_digits(*force)
            );
        }
        lines.into_bytes()
    }

    fn to_hdf5(&self, model: &Model, force: ForceKind) -> Result<Vec<u8>, Error> {
        let mut out = FileBuilder::new();
        out.set_attr("format", AttrValue::VarLenString(FORMAT.into()));
        for (key, value) in self.facts(model, force) {
            out.set_attr(key, AttrValue::VarLenString(value));
        }
        let shape = [self.speed_m_per_s.len() as u64, self.deflection_m.len() as u64];
        out.create_dataset("force_N").with_f64_data(&self.force_n).with_shape(&shape);
        for (name, edge) in EDGES.into_iter().zip(self.band.iter().flatten()) {
            out.create_dataset(name).with_f64_data(edge).with_shape(&shape);
        }
        for (name, values) in [
            ("speed_m_per_s", &self.speed_m_per_s),
            ("deflection_m", &self.deflection_m),
            ("max_deflection_m", &self.max_deflection_m),
            ("unloading_stiffness_N_per_m", &self.unloading_stiffness_n_per_m),
        ] {
            out.create_dataset(name).with_f64_data(values);
        }
        out.finish().map_err(|e| error!(Export, "cannot encode the table: {e}"))
    }
}

/// The forces of a curve at these deflections, with its own energy to its maximum crush, and the edges of its
/// band, which go with them.
fn rows(curve: &ExportCurve, deflection_m: &[f64]) -> Result<(Vec<f64>, [Vec<f64>; 2]), Error> {
    let at = |curve: &Envelope| deflection_m.iter().map(|&d| curve.force_at(d)).collect::<Vec<_>>();
    let (end_m, force_n) = (curve.max_crush_m(), at(&curve.loading));
    let sampled = Envelope::new(deflection_m.to_vec(), force_n.clone())?;
    let scale = curve.loading.work_to(end_m) / sampled.work_to(end_m);
    let until = deflection_m.partition_point(|&d| d <= end_m);
    let scaled = |mut force_n: Vec<f64>| {
        if scale.is_finite() {
            force_n[..until].iter_mut().for_each(|f| *f *= scale);
        }
        force_n
    };
    let edge = |edge_n: &[f64]| {
        let edge = Envelope::new(curve.deflection_m().to_vec(), edge_n.to_vec())?;
        Ok::<_, Error>(scaled(at(&edge)))
    };
    let edges = match &curve.band {
        Some((low_n, high_n)) => [edge(low_n)?, edge(high_n)?],
        None => [vec![f64::NAN; deflection_m.len()], vec![f64::NAN; deflection_m.len()]],
    };
    Ok((scaled(force_n), edges))
}

/// At which speeds the table has no band, in one line.
fn no_band_note(curves: &[ExportCurve]) -> Option<String> {
    let without: Vec<&ExportCurve> = curves.iter().filter(|c| c.band.is_none()).collect();
    let why = without.first()?.no_band?;
    let speeds = without.iter().map(|c| km_per_h(c.predicted.speed_m_per_s));
    let at = if without.len() == curves.len() {
        String::new()
    } else {
        format!(" at {}", speeds.collect::<Vec<_>>().join(", "))
    };
    Some(format!("table: written without a band{at}: {why}"))
}

impl Table {
    /// Description of the table, as keys and values.
    fn facts(&self, model: &Model, force: ForceKind) -> Vec<(&'static str, String)> {
        let mut facts = facts(model, force);
        facts.splice(4..4, self.of_curves.iter().cloned());
        facts.extend(self.band_meaning.clone().map(|meaning| ("band", meaning)));
        facts
    }
}

fn facts(model: &Model, force: ForceKind) -> Vec<(&'static str, String)> {
    let (low, high) = model.range_m_per_s();
    let mut facts = vec![
        ("group", model.group.clone()),
        ("force_kind", force.name().into()),
        ("drives", force.drives().into()),
        ("speed_kind", model.speed_kind.name().into()),
        ("fitted_between", format!("{low} and {high} m/s")),
        ("beyond", "each curve goes on beyond its maximum crush, along faster runs".into()),
        ("model", model.name().into()),
        ("training_hash", model.training_hash.clone()),
        ("written_by", concat!("crumple ", env!("CARGO_PKG_VERSION")).into()),
    ];
    facts.extend(model.case_warnings().iter().flat_map(|warning| in_lines(&warning.message)));
    facts
}
