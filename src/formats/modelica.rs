//! Modelica: a self-contained package with the spring and its memory (`.mo`), or a CombiTable text (`.txt`); SI.
//!
//! The package needs no library: the law is the one of [`ForceLaw`](crate::multibody::ForceLaw) with a straight unloading
//! line, its tables are constants of the package. Memory: the maximum deflection is a discrete variable that is updated while
//! the deflection decreases (`when v < 0`); during loading the force is that of the loading branch.

use crate::error::Error;
use std::fmt::Write;

use super::export_curve::identifier;
use super::text::{line, nine_digits, title};
use super::{ExportCurve, Exported, Options, TargetUnloading};
use crate::curve::Tail;

const COMMENT_WIDTH: usize = 200;
/// Maximum number of points of the package's table: a translator unrolls the search through them.
const MOST_POINTS: usize = 200;
/// Names that a package cannot have: reserved words (Modelica 3.6, 2.3.3), predefined types and `time`.
const KEYWORDS: &str = "algorithm and annotation block break class connect connector constant constrainedby der discrete \
    each else elseif elsewhen encapsulated end enumeration equation expandable extends external false final flow for \
    function if import impure in initial inner input loop model not operator or outer output package parameter partial \
    protected public pure record redeclare replaceable return stream then true type when while within \
    Boolean Integer Real String time";
/// Numbers per line of an array.
const PER_LINE: usize = 6;

pub(crate) fn write(curves: &[ExportCurve], options: &Options) -> Result<Exported, Error> {
    if options.extension.as_deref() == Some("txt") {
        return combi_table(curves);
    }
    let mut exported = Exported::default();
    for curve in curves {
        let few = curve.of_at_most(MOST_POINTS, " in the package", &mut exported.notes)?;
        exported.notes.push(format!(
            "{}: restitution {}",
            curve.headline(),
            curve.own_restitution_text("as in")
        ));
        let name = match (&options.stem, curves) {
            (Some(stem), [_]) => package_name(stem),
            _ => curve.identifier(),
        };
        exported.files.push((format!("{name}.mo"), package(&few, &name)));
    }
    Ok(exported)
}

/// One table of loading and one of unloading per curve.
fn combi_table(curves: &[ExportCurve]) -> Result<Exported, Error> {
    let mut lines = String::new();
    let mut notes = Vec::new();
    line!(lines, "#1");
    for (k, curve) in curves.iter().enumerate() {
        let curve = &curve.begun_at_origin(true, &mut notes)?;
        let suffix = if k == 0 { String::new() } else { format!("_{}", k + 1) };
        for (key, value) in curve.facts() {
            line!(lines, "# {key}: {}", title(&value, COMMENT_WIDTH));
        }
        // Tables extrapolate by their last two points: guard points hold the force at 0 before
        // the contact.
        let reach = curve.loading.end_m();
        let guards = [(-0.02 * reach, 0.0), (-0.01 * reach, 0.0)];
        let points = curve.deflection_m().iter().copied().zip(curve.force_n().iter().copied());
        let held =
            (curve.tail != Tail::Bottom).then(|| (1.1 * reach, curve.loading.force_at(reach)));
        let loading: Vec<(f64, f64)> = guards.into_iter().chain(points).chain(held).collect();
        let (end_m, end_n) = (curve.max_crush_m(), curve.end_n());
        let open_m = end_m - end_n / curve.line_stiffness_n_per_m();
        let unloading = [(open_m - 0.01 * reach, 0.0), (open_m, 0.0), (end_m, end_n)];
        for (name, points) in [("fd_load", &loading[..]), ("fd_unload", &unloading)] {
            line!(lines, "double {name}{suffix}({},2)  # d [m], F [N]", points.len());
            for (d, f) in points {
                line!(lines, "{} {}", nine_digits(*d), nine_digits(*f));
            }
        }
        notes.push(curve.restitution_note("a table without memory", TargetUnloading::Elastic));
    }
    Ok(Exported::of_all(curves, "txt", lines.into_bytes(), notes))
}

/// A constant array.
fn array(name: &str, values: impl Iterator<Item = f64>, meaning: &str) -> String {
    let numbers: Vec<String> = values.map(nine_digits).collect();
    let rows: Vec<String> = numbers.chunks(PER_LINE).map(|row| row.join(", ")).collect();
    let values = rows.join(",\n    ");
    format!("  constant Real {name}[{}] = {{\n    {values}}} \"{meaning}\";\n", numbers.len())
}

/// The package has the name of its file, as translators expect: so packages of one folder differ.
fn package_name(stem: &str) -> String {
    if KEYWORDS.split(' ').any(|word| word == stem) {
        format!("curve_{stem}")
    } else {
        identifier(stem)
    }
}

fn package(curve: &ExportCurve, name: &str) -> Vec<u8> {
    let law = curve.law();
    let (envelope, memory) = (&law.envelope, law.memory.as_ref());
    let mut text = String::new();
    for (key, value) in curve.facts() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "// {key}: {}", title(&value, COMMENT_WIDTH));
    }
    let headline = title(&curve.headline(), COMMENT_WIDTH).replace(['"', '\\'], " ");
    let _ = writeln!(text, "package {name} \"{headline}\"");
    let points = envelope.deflection_m().len();
    let _ = writeln!(text, "  constant Integer points = {points};");
    text += &array("d", envelope.deflection_m().iter().copied(), "Deflection, m");
    text += &array("f", envelope.force_n().iter().copied(), "Force of the loading branch, N");
    text += &array("slope", law.slope_n_per_m.iter().copied(), "Slope behind each point, N/m");
    text += &array("work", envelope.work_j().iter().copied(), "Work done to each point, J");
    let lost = memory.map_or(envelope.work_j(), |m| &m.dissipated_j);
    text += &array("lost", lost.iter().copied(), "Energy lost to each point, J");
    let stiffness = memory.map_or(1.0, |m| m.stiffness_n_per_m);
    let steepest = memory.map_or(1.0, |m| m.steepest_n_per_m);
    for (key, value, meaning) in [
        ("stiffness", stiffness, "Unloading stiffness, N/m"),
        ("steepest", steepest, "Steepest rise or unloading stiffness, N/m"),
        ("impact_speed", curve.predicted.speed_m_per_s, "Speed the curve belongs to, m/s"),
        ("impact_mass", curve.effective_mass_kg(), "Mass that moves along the deflection, kg"),
    ] {
        let _ = writeln!(text, "  constant Real {key} = {} \"{meaning}\";", nine_digits(value));
    }
    text += FUNCTIONS;
    let _ = writeln!(text, "end {name};");
    text.into_bytes()
}

/// The law and two models that use it.
const FUNCTIONS: &str = include_str!("modelica/spring.mo");
