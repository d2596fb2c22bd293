//! Cases side by side (what differs from the first of them), and as CSV tables: one of the cases, and long tables of the samples of their curves.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::croissant;
use crate::curve::body::body_force_n;
use crate::curve::{Case, Envelope, ForceKind, Parameter};
use crate::dataset::grid;
use crate::error::{Error, error};
use crate::file::{not_written, write_at};
use crate::signal::l1_ratio;
use crate::unit::SpeedKind;

/// Names of the tables, the last one on demand.
pub(crate) const TABLES: [&str; 3] = ["cases.csv", "curves.csv", "originals.csv"];

/// Writes the tables of cases into the folder at `path`, which is created if it does not exist; returns
/// their paths: `cases.csv` and `curves.csv`, the curves at their common interval, and with `originals`
/// those at the solver's rate. Numbers have as many digits as they need to be read back the same; what a case
/// does not have is empty.
/// With `described_as`, `croissant.json` describes them under this name.
pub(crate) fn write_tables(
    cases: &[&Case],
    path: &Path,
    originals: bool,
    described_as: Option<&str>,
) -> Result<Vec<PathBuf>, Error> {
    if path.is_file() {
        return Err(error!(
            Database,
            "{} is a file: tables are written into a folder",
            path.display()
        ));
    }
    std::fs::create_dir_all(path).map_err(|e| not_written(path, e))?;
    let mut written = Vec::new();
    let mut table = |name: &str, fill: &dyn Fn(&mut dyn Write) -> io::Result<()>| {
        let path = path.join(name);
        write_at(&path, |file: &File| {
            let mut out = BufWriter::new(file);
            fill(&mut out)?;
            out.flush()?;
            file.sync_all().map(Some)
        })?;
        written.push(path);
        Ok::<(), Error>(())
    };
    table(TABLES[0], &|out| write_cases(out, cases))?;
    table(TABLES[1], &|out| write_sampled(out, cases))?;
    if originals {
        table(TABLES[2], &|out| write_originals(out, cases))?;
    }
    if let Some(name) = described_as {
        written.push(croissant::describe(name, cases, &written)?);
    }
    Ok(written)
}

fn write_cases(out: &mut dyn Write, cases: &[&Case]) -> io::Result<()> {
    let parameters: BTreeSet<&String> =
        cases.iter().flat_map(|c| c.conditions.parameters.keys()).collect();
    let mut table = csv::Writer::from_writer(out);
    for (k, case) in cases.iter().enumerate() {
        let (mut names, mut values): (Vec<String>, Vec<String>) =
            columns(case).into_iter().map(|(name, value)| (name.to_string(), value)).unzip();
        for name in &parameters {
            names.push(format!("parameter_{name}"));
            values.push(match case.conditions.parameters.get(*name) {
                Some(Parameter::Number(number)) => shown(*number),
                Some(Parameter::Category(category)) => category.clone(),
                None => String::new(),
            });
        }
        if k == 0 {
            table.write_record(names)?;
        }
        table.write_record(values)?;
    }
    table.flush()
}

/// Columns of every case; its parameters follow.
fn columns(case: &Case) -> [(&'static str, String); 25] {
    let optional = |value: Option<f64>| value.map_or(String::new(), shown);
    let sources =
        case.provenance.sources.iter().map(|s| s.absolute_path.clone().unwrap_or(s.path.clone()));
    let solver = case.provenance.sources.iter().find_map(|source| {
        Some([source.solver.as_deref()?, source.version.as_deref().unwrap_or("")].join(" "))
    });
    [
        ("group", case.id.group.clone()),
        ("case", case.id.name.clone()),
        ("study", case.id.study.clone()),
        ("speed_m_per_s", shown(case.conditions.speed.m_per_s)),
        ("speed_kind", case.conditions.speed.kind.name().into()),
        ("mass_kg", shown(case.conditions.masses.body_kg)),
        ("other_mass_kg", optional(case.conditions.masses.other_kg)),
        ("force_kind", case.curves.force_kind.name().into()),
        ("max_deflection_m", shown(case.max_deflection_m())),
        ("peak_force_N", shown(case.peak_force_n())),
        ("work_J", shown(case.quality.audit.work_j)),
        ("kinetic_energy_J", shown(case.quality.audit.kinetic_j)),
        ("work_over_energy", shown(case.quality.audit.ratio())),
        ("unloading_stiffness_N_per_m", optional(case.curves.unloading_stiffness_n_per_m)),
        ("truncated", case.is_truncated().to_string()),
        ("contact_time_s", shown(case.curves.contact_time_s)),
        ("solver_wall_time_s", optional(case.provenance.solver_wall_time_s)),
        ("states", case.curves.sampled.time_s().len().to_string()),
        ("tags", case.provenance.tags.join(";")),
        ("user_notes", case.provenance.user_notes.join("\n")),
        ("warnings", case.quality.warnings.join("\n")),
        ("sources", sources.collect::<Vec<_>>().join(";")),
        ("solver", solver.map(|s| s.trim().into()).unwrap_or_default()),
        ("built_utc", case.provenance.built_utc.clone().unwrap_or_default()),
        ("fingerprint", case.provenance.fingerprint.clone()),
    ]
}

fn write_sampled(out: &mut dyn Write, cases: &[&Case]) -> io::Result<()> {
    let heading = "group,case,time_s,deflection_m,force_N,body_force_N,closing_speed_m_per_s";
    writeln!(out, "{heading}")?;
    for case in cases {
        let body = body_force_n(case);
        let curve = &case.curves.sampled;
        let columns = [
            curve.time_s(),
            curve.deflection_m(),
            curve.force_n(),
            &body,
            &case.curves.closing_speed_m_per_s,
        ];
        write_samples(out, case, &columns)?;
    }
    Ok(())
}

fn write_originals(out: &mut dyn Write, cases: &[&Case]) -> io::Result<()> {
    writeln!(out, "group,case,time_s,deflection_m,force_N")?;
    for case in cases {
        let curve = &case.curves.original;
        write_samples(out, case, &[curve.time_s(), curve.deflection_m(), curve.force_n()])?;
    }
    Ok(())
}

/// A line for each sample of a case: its names, which may hold commas and quotes, then numbers.
fn write_samples(out: &mut dyn Write, case: &Case, columns: &[&[f64]]) -> io::Result<()> {
    let mut names = csv::Writer::from_writer(Vec::new());
    names.write_record([&case.id.group, &case.id.name])?;
    let names = names.into_inner().map_err(|e| io::Error::other(e.to_string()))?;
    let names = names.strip_suffix(b"\n").unwrap_or(&names);
    let mut digits = zmij::Buffer::new();
    for sample in 0..columns.first().map_or(0, |column| column.len()) {
        out.write_all(names)?;
        for column in columns {
            out.write_all(b",")?;
            out.write_all(digits.format(column[sample]).as_bytes())?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// A number with as many digits as it needs.
fn shown(value: f64) -> String {
    zmij::Buffer::new().format(value).into()
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Comparison {
    pub reference: String,
    pub cases: Vec<Difference>,
}

/// One case, and its differences from the reference; those of values are shares of the reference's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Difference {
    pub group: String,
    pub case: String,
    pub speed_m_per_s: f64,
    pub speed_kind: SpeedKind,
    pub force_kind: ForceKind,
    pub mass_kg: f64,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Parameter>,
    pub max_deflection_m: f64,
    /// ∫F dd up to it, in J.
    #[serde(rename = "work_J")]
    pub work_j: f64,
    #[serde(rename = "peak_force_N")]
    pub peak_force_n: f64,
    pub speed_difference: f64,
    pub mass_difference: f64,
    pub max_deflection_difference: f64,
    pub work_difference: f64,
    pub peak_force_difference: f64,
    /// Deflection up to which both have a loading branch, in m.
    pub common_deflection_m: f64,
    /// Σ|F − F₀| / Σ|F₀| of the loading branches over even steps of that deflection; `None` if the
    /// reference has no force there.
    pub force_l1: Option<f64>,
}

/// Steps of the common deflection at least.
const STEPS: usize = 400;

pub(crate) fn compare(cases: &[&Case]) -> Result<Option<Comparison>, Error> {
    let Some(first) = cases.first() else { return Ok(None) };
    let reference = first.loading()?.envelope;
    let differences: Result<Vec<Difference>, Error> = cases
        .iter()
        .map(|case| Ok(difference(first, &reference, case, case.loading()?.envelope)))
        .collect();
    let reference = format!("{}/{}", first.id.group, first.id.name);
    Ok(Some(Comparison { reference, cases: differences? }))
}

fn difference(first: &Case, reference: &Envelope, case: &Case, envelope: Envelope) -> Difference {
    let share = |value: fn(&Case) -> f64| value(case) / value(first) - 1.0;
    let common_deflection_m = reference.end_m().min(envelope.end_m());
    let along = grid(common_deflection_m, STEPS);
    let at = |e: &Envelope| -> Vec<f64> { along.iter().map(|&d| e.force_at(d)).collect() };
    let force_l1 = l1_ratio(&at(reference), &at(&envelope));
    Difference {
        group: case.id.group.clone(),
        case: case.id.name.clone(),
        speed_m_per_s: case.conditions.speed.m_per_s,
        speed_kind: case.conditions.speed.kind,
        force_kind: case.curves.force_kind,
        parameters: case.conditions.parameters.clone(),
        mass_kg: case.conditions.masses.body_kg,
        max_deflection_m: case.max_deflection_m(),
        work_j: case.quality.audit.work_j,
        peak_force_n: case.peak_force_n(),
        speed_difference: share(|c| c.conditions.speed.m_per_s),
        mass_difference: share(|c| c.conditions.masses.body_kg),
        max_deflection_difference: share(Case::max_deflection_m),
        work_difference: share(|c| c.quality.audit.work_j),
        peak_force_difference: share(Case::peak_force_n),
        common_deflection_m,
        force_l1: Some(force_l1).filter(|l1| l1.is_finite()),
    }
}
