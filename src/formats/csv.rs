//! Curve as CSV: deflection and force under `#` header lines.

use super::text::{line, nine_digits};
use super::{ExportCurve, Exported, Options};
use crate::error::{Error, error};
use crate::unit::{FORCE, LENGTH, UnitSystem};

pub(crate) fn write(curve: &ExportCurve, options: &Options) -> Result<Exported, Error> {
    let units = options.units.unwrap_or(UnitSystem::SI);
    let (length, force) =
        LENGTH.name_of(units.length_m).zip(FORCE.name_of(units.force())).ok_or_else(|| {
            error!(
                Export,
                "columns need units that have a name: lengths in {lengths}, forces in {forces}; choose others with --units, such as mm-t-s",
                forces = FORCE.known_units(),
                lengths = LENGTH.known_units()
            )
        })?;
    let mut lines = String::new();
    for (key, value) in curve.facts() {
        line!(lines, "# {key}: {}", value.replace('\n', " "));
    }
    let edges = if curve.band.is_some() { ",lo,hi" } else { "" };
    line!(lines, "d_{length},force_{force}{edges}");
    let shown = |force_n: f64| nine_digits(force_n / units.force());
    for (i, (d, f)) in curve.deflection_m().iter().zip(curve.force_n()).enumerate() {
        let edges = curve.band.as_ref().map(|(low, high)| [low[i], high[i]]);
        lines += &nine_digits(d / units.length_m);
        for force_n in [*f].into_iter().chain(edges.into_iter().flatten()) {
            lines.push(',');
            lines += &shown(force_n);
        }
        lines.push('\n');
    }
    Ok(Exported::file(format!("{}.csv", curve.file_stem()), lines.into_bytes()))
}
