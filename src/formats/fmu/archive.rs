//! The archive of an FMU and the places of its files.

use crate::error::{Error, error};
use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::description::{build_description, model_description};
use super::table::Table;
use super::text::{escaped, identifier};
use super::{BINARIES, FmiVersion, SOURCES, Spring, TABLE_HEADER};

/// Name of the generated C file.
const TABLE_SOURCE: &str = "table.c";

pub(super) fn pack(
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

    // A fixed date, so that the same input always gives the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let mut add = |path: &str, bytes: &[u8]| -> Result<(), Error> {
        archive.start_file(path, options).map_err(not_packed)?;
        archive.write_all(bytes).map_err(not_packed)
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
    Ok(archive.finish().map_err(not_packed)?.into_inner())
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
