//! Adams: a spline as View command (`.cmd`), Solver statement (`.adm`) or spring property file (`.spr`).
//!
//! Adams interpolates by Akima's or cubic splines, so kinks are fenced with points; beyond the ends linear extrapolation is
//! requested. Elastic: a spline has no memory. The `.spr` file is that of Adams/Car, which MotionView reads too.

use super::text::{line, nine_digits, title};
use super::thin::for_splines;
use super::{ExportCurve, Exported, Options, TargetUnloading};
use crate::error::{Error, error};
use crate::unit::{FORCE, LENGTH, UnitSystem};

/// Numbers per line of a statement.
const PER_LINE: usize = 4;
const COMMENT_WIDTH: usize = 200;
/// Least share of the table's length that its points without force reach to before the contact.
const GUARDED: f64 = 0.01;

pub(crate) fn write(curves: &[ExportCurve], options: &Options) -> Result<Exported, Error> {
    // mm and N, as of Adams' own default units (MMKS).
    let usual = UnitSystem { length_m: 1e-3, mass_kg: 1e3, time_s: 1.0 };
    let units = options.units.unwrap_or(usual);
    let extension = options.extension.as_deref().unwrap_or("cmd");
    let mut files = Vec::new();
    let mut notes = Vec::new();
    let mut together = String::new();
    for (k, curve) in curves.iter().enumerate() {
        let curve = &curve.begun_at_origin(true, &mut notes)?;
        let spline = Spline::of(curve, units, options.id + k as u32)?;
        notes.push(curve.restitution_note("Adams", TargetUnloading::Elastic));
        match extension {
            "spr" => files.push((format!("{}.spr", curve.file_stem()), spline.property_file()?)),
            "adm" => spline.solver_statement(&mut together),
            _ => spline.view_command(&mut together),
        }
    }
    if !["cmd", "adm", "spr"].contains(&extension) {
        notes.push(format!(
            ".{extension} is written as an Adams View command file (.cmd): name it .adm for Adams Solver, .spr for a property file"
        ));
    }
    if extension != "spr" {
        let stem = curves.first().map_or("curves".into(), ExportCurve::file_stem);
        files.push((format!("{stem}.{extension}"), together.into_bytes()));
    }
    Ok(Exported { files, notes, ..Exported::default() })
}

struct Spline<'a> {
    curve: &'a ExportCurve,
    units: UnitSystem,
    id: u32,
    /// Deflection and force of each point in the file's units, compression positive; they begin
    /// below 0 with no force.
    points: Vec<(f64, f64)>,
}

impl<'a> Spline<'a> {
    fn of(curve: &'a ExportCurve, units: UnitSystem, id: u32) -> Result<Self, Error> {
        let loading = for_splines(&curve.loading, curve.predicted.peak_force_n())?;
        // The first as close to the kink at the contact as on its other side, each further one twice as far: otherwise a spline would pull.
        let first_m = loading.deflection_m()[1];
        let reach_m = GUARDED * loading.end_m();
        let guards = std::iter::successors(Some(first_m), |d| (*d < reach_m).then_some(2.0 * d));
        let mut guards: Vec<f64> = guards.collect();
        guards.extend(guards.last().map(|last| 2.0 * last));
        let force = std::iter::once(0.0).chain(loading.force_n().iter().copied().skip(1));
        let points = guards
            .iter()
            .rev()
            .map(|d| (-d, 0.0))
            .chain(loading.deflection_m().iter().copied().zip(force))
            .map(|(d, f)| (d / units.length_m, f / units.force()))
            .collect();
        Ok(Self { curve, units, id, points })
    }

    fn comments(&self, lines: &mut String, sign: &str) {
        line!(
            lines,
            "{sign} units of the points: length {} m, force {} N",
            nine_digits(self.units.length_m),
            nine_digits(self.units.force())
        );
        for (key, value) in self.curve.facts() {
            line!(lines, "{sign} {}", title(&format!("{key}: {value}"), COMMENT_WIDTH));
        }
    }

    fn columns(&self) -> [(char, Vec<String>); 2] {
        let x = self.points.iter().map(|p| nine_digits(p.0)).collect();
        let y = self.points.iter().map(|p| nine_digits(p.1)).collect();
        [('x', x), ('y', y)]
    }

    /// `data_element create spline`: a line ends in `&` where the command continues.
    fn view_command(&self, lines: &mut String) {
        self.comments(lines, "!");
        line!(
            lines,
            "data_element create spline spline_name=.model_1.{} adams_id={} &",
            self.curve.identifier(),
            self.id
        );
        for (name, numbers) in self.columns() {
            let rows: Vec<&[String]> = numbers.chunks(PER_LINE).collect();
            for (i, row) in rows.iter().enumerate() {
                let key = if i == 0 { format!("{name}=") } else { String::new() };
                let comma = if i + 1 < rows.len() { "," } else { "" };
                line!(lines, "  {key}{}{comma} &", row.join(","));
            }
        }
        line!(lines, "  linear_extrapolate=yes");
    }

    /// `SPLINE/id`: a line begins with a comma where the statement continues.
    fn solver_statement(&self, lines: &mut String) {
        self.comments(lines, "!");
        line!(lines, "SPLINE/{}, LINEAR_EXTRAPOLATE", self.id);
        for (name, numbers) in self.columns() {
            for (i, row) in numbers.chunks(PER_LINE).enumerate() {
                let key =
                    if i == 0 { format!("{}=", name.to_ascii_uppercase()) } else { String::new() };
                line!(lines, ", {key}{}", row.join(","));
            }
        }
    }

    /// The units are in it, with names of their own.
    fn property_file(&self) -> Result<Vec<u8>, Error> {
        let names = LENGTH.name_of(self.units.length_m).zip(FORCE.name_of(self.units.force()));
        let words = |(length, force)| {
            let lengths = [("m", "meter"), ("in", "inch"), ("ft", "foot")];
            let length = lengths.iter().find(|l| l.0 == length).map_or(length, |l| l.1);
            let forces = [("N", "newton"), ("kN", "knewton"), ("lbf", "pound_force")];
            Some((length, forces.iter().find(|f| f.0 == force)?.1))
        };
        let (length, force) = names.and_then(words).ok_or_else(|| {
            error!(
                Export,
                "columns need units that have a name: lengths in {lengths}, forces in {forces}; choose others with --units, such as mm-t-s",
                forces = "N, kN, lbf",
                lengths = LENGTH.known_units()
            )
        })?;
        let mut lines = String::new();
        self.comments(&mut lines, "$");
        line!(
            lines,
            "[MDI_HEADER]\nFILE_TYPE = 'spr'\nFILE_VERSION = 4.0\nFILE_FORMAT = 'ASCII'\n[UNITS]"
        );
        line!(lines, "LENGTH = '{length}'\nANGLE = 'degrees'\nFORCE = '{force}'");
        let reach = nine_digits(1.2 * self.points[self.points.len() - 1].0);
        line!(lines, "MASS = 'kg'\nTIME = 'second'\n[SPRING_DATA]\nFREE_LENGTH = {reach}");
        line!(lines, "[CURVE]\n{{ disp force }}");
        for (d, f) in &self.points {
            line!(lines, "{} {}", nine_digits(*d), nine_digits(*f));
        }
        Ok(lines.into_bytes())
    }
}
