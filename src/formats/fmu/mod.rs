//! FMUs: a force law as a component for any tool that imports FMI 2.0 or 3.0, by model exchange or by
//! co-simulation. They are the only exports with the complete law and its memory.
//!
//! The component is written in C (`c/`) and compiled when crumple is built. One binary serves both
//! versions; an export writes the curve into a marked block of it, so that users need no compiler.
//! The same sources go into the archive, with the curve as a C file.

mod description;
mod table;

use std::io::Write;

use flate2::Compression;
use flate2::write::DeflateEncoder;
use rawzip::time::UtcDateTime;
use rawzip::{CompressionMethod, ZipArchiveWriter};

use super::{ExportCurve, Exported};
use crate::error::{Error, error};
use crate::formats::text::identifier;
use crate::multibody::ForceLaw;
use crate::words::escaped;
use description::{build_description, model_description};
use table::Table;

/// Version of the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FmiVersion {
    /// FMI 2.0.
    Fmi2,
    /// FMI 3.0.
    Fmi3,
}

/// What goes into one FMU.
pub struct Spring<'a> {
    /// Any text; letters, digits and `_` of it name the model.
    pub name: &'a str,
    /// One line for the importer's user.
    pub description: &'a str,
    /// What it computes.
    pub law: &'a ForceLaw,
    /// Data of the curve, for documentation/ and extra/.
    pub facts: &'a [(&'static str, String)],
}

/// A compiled component without a curve.
struct Binary {
    /// Names of the platform's folder in FMI 2 and FMI 3.
    folders: [&'static str; 2],
    extension: &'static str,
    bytes: &'static [u8],
}

/// As `tests/fmu.rs` compiles them from the sources below, to the same bytes on any machine.
const BINARIES: [Binary; 2] = [
    Binary {
        folders: ["linux64", "x86_64-linux"],
        extension: "so",
        bytes: include_bytes!("lib/linux64.so"),
    },
    Binary {
        folders: ["win64", "x86_64-windows"],
        extension: "dll",
        bytes: include_bytes!("lib/win64.dll"),
    },
];

/// Sources of the component, besides the table, for the archive.
const SOURCES: [(&str, &str); 13] = [
    ("derivative.c", include_str!("c/derivative.c")),
    ("fmi2.c", include_str!("c/fmi2.c")),
    ("fmi3.c", include_str!("c/fmi3.c")),
    ("fmi3_none.c", include_str!("c/fmi3_none.c")),
    ("instance.c", include_str!("c/instance.c")),
    ("knots.c", include_str!("c/knots.c")),
    ("law.c", include_str!("c/law.c")),
    ("law.h", include_str!("c/law.h")),
    ("names.h", include_str!("c/names.h")),
    ("spring.c", include_str!("c/spring.c")),
    ("spring.h", include_str!("c/spring.h")),
    ("state.c", include_str!("c/state.c")),
    ("sum.c", include_str!("c/sum.c")),
];

/// The header of the table, which the exporter must agree with.
const TABLE_HEADER: &str = include_str!("c/table.h");

/// Platforms whose binary is in every FMU of this program, by their names in FMI 2 (`linux64`,
/// `win64`). On others the FMU must be compiled from its sources.
pub fn binaries() -> impl Iterator<Item = &'static str> {
    BINARIES.iter().map(|binary| binary.folders[0])
}

/// The FMU as the bytes of its archive. The same input gives the same bytes.
///
/// Deflection is in m, compression positive; the outputs are the law's force and energies, and the
/// maximum deflection so far. Beyond the curve's end [`crate::multibody::EnvelopeEnd::Error`] holds
/// the force.
///
/// # Errors
/// If the curve has too many points for the FMU.
pub fn archive(spring: &Spring<'_>, version: FmiVersion) -> Result<Vec<u8>, Error> {
    let token = token(spring, version, &Table::new(spring.law, "")?);
    let table = Table::new(spring.law, &token)?;
    pack(spring, version, &table, &token)
}

/// GUID of FMI 2 and instantiation token of FMI 3: a hash of the content of the FMU.
fn token(spring: &Spring<'_>, version: FmiVersion, table: &Table) -> String {
    let mut hash = blake3::Hasher::new();
    let mut add = |text: &[u8]| {
        hash.update(&(text.len() as u64).to_le_bytes());
        hash.update(text);
    };
    add(format!("{version:?} {}", env!("CARGO_PKG_VERSION")).as_bytes());
    add(spring.name.as_bytes());
    add(spring.description.as_bytes());
    for (key, value) in spring.facts {
        add(key.as_bytes());
        add(value.as_bytes());
    }
    for (_, source) in SOURCES {
        add(source.as_bytes());
    }
    add(TABLE_HEADER.as_bytes());
    add(&table.bytes());
    let hex = hash.finalize().to_hex();
    let part = |from: usize, to: usize| hex.get(from..to).unwrap_or_default();
    format!("{{{}-{}-{}-{}-{}}}", part(0, 8), part(8, 12), part(12, 16), part(16, 20), part(20, 32))
}

/// Points that an FMU's binary has room for.
const MOST_POINTS: usize = 4096;

pub(crate) fn write(curve: &ExportCurve, version: FmiVersion) -> Result<Exported, Error> {
    let mut notes = Vec::new();
    let curve = &curve.of_at_most(MOST_POINTS, "", &mut notes)?;
    let law = curve.law();
    let (name, description, facts) = (curve.identifier(), curve.headline(), curve.facts());
    let spring = Spring { name: &name, description: &description, law: &law, facts: &facts };
    let bytes = archive(&spring, version)?;
    let there: Vec<&str> = binaries().collect();
    notes.push(format!(
        "{description}: the FMU holds the whole law: restitution {}; ready binaries for {}",
        curve.own_restitution_text("as in"),
        there.join(" and ")
    ));
    Ok(Exported {
        files: vec![(format!("{}-fmi{}.fmu", curve.file_stem(), version as u8 + 2), bytes)],
        notes,
        ..Exported::default()
    })
}

/// Name of the generated C file.
const TABLE_SOURCE: &str = "table.c";

/// Date of the files in the archive, 1980-01-01: the same input always gives the same bytes.
const DATED_UNIX_S: i64 = 315_532_800;

fn pack(
    spring: &Spring<'_>,
    version: FmiVersion,
    table: &Table,
    token: &str,
) -> Result<Vec<u8>, Error> {
    let name = identifier(spring.name);
    let mut sources = SOURCES.to_vec();
    let table_source = table.source();
    sources.push((TABLE_SOURCE, &table_source));
    sources.push(("table.h", TABLE_HEADER));
    sources.sort_unstable();
    let compiled: Vec<&str> =
        sources.iter().map(|(file, _)| *file).filter(|file| file.ends_with(".c")).collect();

    let mut archive = ZipArchiveWriter::new(Vec::new());
    let mut add = |path: &str, bytes: &[u8]| -> Result<(), Error> {
        let entry = archive.new_file(path).compression_method(CompressionMethod::DEFLATE);
        let entry =
            entry.unix_permissions(0o100_644).last_modified(UtcDateTime::from_unix(DATED_UNIX_S));
        let (mut entry, config) = entry.start().map_err(not_packed)?;
        let mut writer = config.wrap(DeflateEncoder::new(&mut entry, Compression::default()));
        writer.write_all(bytes).map_err(not_packed)?;
        let (encoder, descriptor) = writer.finish().map_err(not_packed)?;
        encoder.finish().map_err(not_packed)?;
        entry.finish(descriptor).map(drop).map_err(not_packed)
    };
    let model = model_description(spring, version, &name, token, &compiled);
    add("modelDescription.xml", model.as_bytes())?;
    for binary in BINARIES {
        let folder = binary.folders[version as usize];
        let bytes = table.written_into(binary.bytes, folder)?;
        add(&format!("binaries/{folder}/{name}.{}", binary.extension), &bytes)?;
    }
    if version == FmiVersion::Fmi3 {
        add("sources/buildDescription.xml", build_description(&name, &compiled).as_bytes())?;
    }
    for (file, text) in &sources {
        add(&format!("sources/{file}"), text.as_bytes())?;
    }
    add("documentation/index.html", documentation(spring).as_bytes())?;
    add("extra/crumple/facts.json", facts(spring)?.as_bytes())?;
    archive.finish().map_err(not_packed)
}

fn not_packed(error: impl std::error::Error + Send + Sync + 'static) -> Error {
    error!(Export, "the archive cannot be packed: {error}").caused_by(error)
}

/// What a user of the FMU must know.
fn documentation(spring: &Spring<'_>) -> String {
    let mut rows = String::new();
    for (key, value) in spring.facts {
        rows += &format!("<tr><th>{}</th><td>{}</td></tr>\n", escaped(key), escaped(value));
    }
    format!(
        include_str!("documentation.html"),
        name = escaped(spring.name),
        description = escaped(spring.description),
        rows = rows,
    )
}

/// The facts for programs.
fn facts(spring: &Spring<'_>) -> Result<String, Error> {
    let mut facts = serde_json::Map::new();
    facts.insert("name".into(), spring.name.into());
    facts.insert("description".into(), spring.description.into());
    for (key, value) in spring.facts {
        // A warning in several lines, and several of them, are one text.
        let text = match facts.get(*key).and_then(|before| before.as_str()) {
            Some(before) => format!("{before} {value}"),
            None => value.clone(),
        };
        facts.insert((*key).into(), text.into());
    }
    let text = serde_json::to_string_pretty(&facts);
    let text = text.map_err(|e| {
        error!(Export, "the facts of the curve cannot be written: {e}").caused_by(e)
    })?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Envelope;
    use crate::multibody::{EnvelopeEnd, Unloading, UnloadingShape};

    fn law(points: usize) -> ForceLaw {
        let d = (0..points).map(|i| i as f64 * 1e-3).collect();
        let f = (0..points).map(|i| i as f64 * 1e3).collect();
        let unloading = Unloading::Memory { stiffness_n_per_m: 40e6 };
        ForceLaw::new(Envelope::new(d, f).unwrap(), unloading, EnvelopeEnd::Hold)
    }

    #[test]
    fn the_token_names_all_that_the_fmu_holds() {
        let token_of = |name: &str, points: usize, version: FmiVersion| {
            let law = law(points);
            let spring = Spring { name, description: "", law: &law, facts: &[] };
            token(&spring, version, &Table::new(&law, "").unwrap())
        };
        let one = token_of("a", 5, FmiVersion::Fmi2);
        assert_eq!(one.len(), 38, "{one}");
        assert_eq!(one, token_of("a", 5, FmiVersion::Fmi2));
        assert_ne!(one, token_of("b", 5, FmiVersion::Fmi2));
        assert_ne!(one, token_of("a", 6, FmiVersion::Fmi2));
        assert_ne!(one, token_of("a", 5, FmiVersion::Fmi3));
    }

    #[test]
    fn refuses_more_points_than_there_is_room_for() {
        let refused = |law: &ForceLaw| {
            let spring = Spring { name: "a", description: "", law, facts: &[] };
            archive(&spring, FmiVersion::Fmi3).unwrap_err().to_string()
        };
        let points = "an FMU holds at most 4096 points of a curve, found 4097";
        assert_eq!(refused(&law(4097)), points);

        let d: Vec<f64> = (0..1100).map(|i| 1.0 - f64::from(i) * 1e-4).collect();
        let f: Vec<f64> = (0..1100).map(|i| 1099.0 - f64::from(i)).collect();
        let shape = UnloadingShape::of_branch(&d, &f).unwrap();
        let envelope = Envelope::new(vec![0.0, 1.0], vec![0.0, 1e6]).unwrap();
        let unloading = Unloading::Memory { stiffness_n_per_m: 40e6 };
        let law = ForceLaw::shaped(envelope, unloading, shape, EnvelopeEnd::Hold);
        let points = "an FMU holds at most 1024 points of an unloading branch, found 1100";
        assert_eq!(refused(&law), points);
    }
}
