//! FMI 2.0 and 3.0: one FMU per curve, with the whole law and its memory.

use super::fmu::{FmiVersion, Spring, archive, binaries};
use super::thin::thinned;
use super::{ExportCurve, Exported, Options};
use crate::error::{Error, error};

/// Points that an FMU's binary has room for.
const MOST_POINTS: usize = 4096;

pub(crate) fn write_fmi2(curve: &ExportCurve, options: &Options) -> Result<Exported, Error> {
    write(curve, options, FmiVersion::Fmi2, "fmi2")
}

pub(crate) fn write_fmi3(curve: &ExportCurve, options: &Options) -> Result<Exported, Error> {
    write(curve, options, FmiVersion::Fmi3, "fmi3")
}

fn write(
    curve: &ExportCurve,
    options: &Options,
    version: FmiVersion,
    format: &'static str,
) -> Result<Exported, Error> {
    if options.units.is_some() {
        return Err(error!(
            Export,
            "{format} is always in SI: remove --units, or take a format that has units (csv, lsdyna, radioss, calculix, adams)"
        ));
    }
    let mut notes = Vec::new();
    let points = curve.deflection_m().len();
    let thin;
    let mut curve = curve;
    if points > MOST_POINTS {
        let loading = thinned(&curve.loading, MOST_POINTS, curve.end)?;
        let end = loading.deflection_m().partition_point(|&d| d < curve.max_crush_m());
        thin = curve.clone().through(loading, end);
        curve = &thin;
        notes.push(format!(
            "{}: {MOST_POINTS} of {points} points are kept, with the same energy up to the maximum crush",
            curve.headline()
        ));
    }
    let law = curve.law();
    let (name, description, facts) = (curve.identifier(), curve.headline(), curve.facts());
    let spring = Spring { name: &name, description: &description, law: &law, facts: &facts };
    let bytes = archive(&spring, version)?;
    let there: Vec<&str> = binaries().collect();
    notes.push(format!(
        "{description}: the FMU holds the whole law, so it rebounds as crumple's own runs do (restitution {:.3}); ready binaries for {}",
        curve.own_restitution(),
        if there.is_empty() { "no platform".into() } else { there.join(" and ") }
    ));
    if !there.contains(&"win64") {
        notes.push("there is no win64 binary, because x86_64-w64-mingw32-gcc was not found when crumple was built: on Windows the FMU must be compiled from its sources".into());
    }
    if !there.contains(&"linux64") {
        notes.push("there is no linux64 binary, because no C compiler for it was found when crumple was built: on Linux the FMU must be compiled from its sources".into());
    }
    Ok(Exported {
        files: vec![(format!("{}-{format}.fmu", curve.file_stem()), bytes)],
        notes,
        ..Exported::default()
    })
}
