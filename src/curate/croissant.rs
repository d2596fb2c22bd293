//! Description of exported tables for machine learning: Croissant 1.0 of MLCommons, a JSON-LD document beside the CSV files.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use hmac_sha256::Hash;
use serde_json::{Value, json};

use crate::curve::{Case, Parameter};
use crate::error::Error;
use crate::file::{self, not_written, write_at};

/// Name of the document.
pub(crate) const FILE: &str = "croissant.json";
/// Columns that are texts; parameters that are categories join them.
const TEXTS: [&str; 12] = [
    "group",
    "case",
    "study",
    "speed_kind",
    "force_kind",
    "tags",
    "user_notes",
    "warnings",
    "sources",
    "solver",
    "built_utc",
    "fingerprint",
];

/// Describes the tables that were written for cases of the database `name`; the path of the description.
pub(super) fn describe(name: &str, cases: &[&Case], tables: &[PathBuf]) -> Result<PathBuf, Error> {
    let folder = tables.first().and_then(|path| path.parent()).unwrap_or(Path::new("."));
    let path = folder.join(FILE);
    let failed = |source| not_written(&path, source);
    let categories: BTreeSet<String> = cases
        .iter()
        .flat_map(|case| &case.conditions.parameters)
        .filter(|(_, value)| matches!(value, Parameter::Category(_)))
        .map(|(name, _)| format!("parameter_{name}"))
        .collect();
    let is_text = |column: &str| TEXTS.contains(&column) || categories.contains(column);
    let (mut distribution, mut records) = (Vec::new(), Vec::new());
    for table in tables {
        let of_file = |source| Error::io(table, source);
        let file = table.file_name().unwrap_or_default().to_string_lossy();
        let columns = csv::Reader::from_path(table).and_then(|mut table| table.headers().cloned());
        let columns = columns.map_err(|e| of_file(io::Error::other(e)))?;
        distribution.push(json!({
            "@type": "cr:FileObject",
            "@id": file,
            "name": file,
            "contentUrl": file,
            "encodingFormat": "text/csv",
            "sha256": sha256(table).map_err(of_file)?,
        }));
        let set = file.trim_end_matches(".csv");
        let field = |column: &str| {
            json!({
                "@type": "cr:Field",
                "@id": format!("{set}/{column}"),
                "name": format!("{set}/{column}"),
                "description": column,
                "dataType": match column {
                    "truncated" => "sc:Boolean",
                    "states" => "sc:Integer",
                    _ if is_text(column) => "sc:Text",
                    _ => "sc:Float",
                },
                "source": { "fileObject": { "@id": file }, "extract": { "column": column } },
            })
        };
        let mut record = json!({
            "@type": "cr:RecordSet",
            "@id": set,
            "name": set,
            "description": about(set),
            "field": columns.iter().map(field).collect::<Vec<Value>>(),
        });
        if set == "cases" {
            record["key"] = json!([{ "@id": "cases/group" }, { "@id": "cases/case" }]);
        }
        records.push(record);
    }
    let document = json!({
        "@context": context(),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": name,
        "description": "Force-displacement curves of FE crash runs by impact speed; SI, the unit is part of a column's name.",
        "distribution": distribution,
        "recordSet": records,
    });
    let mut text = serde_json::to_string_pretty(&document).map_err(|e| failed(e.into()))?;
    text.push('\n');
    write_at(&path, |mut file: &File| {
        io::Write::write_all(&mut file, text.as_bytes())?;
        file.sync_all().map(Some)
    })?;
    Ok(path)
}

fn about(set: &str) -> &'static str {
    match set {
        "cases" => "One record per FE run: speed, masses, crush, energies, provenance",
        "curves" => "One record per sample at the common interval, from the first contact on",
        _ => "One record per sample at the solver's rate",
    }
}

/// Hexadecimal.
fn sha256(path: &Path) -> io::Result<String> {
    let (mut file, mut hash) = (file::open(path)?, Hash::new());
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block)? {
            0 => return Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()),
            read => hash.update(&block[..read]),
        }
    }
}

/// The context of Croissant 1.0, all of it: tools warn of any other.
fn context() -> Value {
    let mut context = json!({
        "@language": "en",
        "@vocab": "https://schema.org/",
        "sc": "https://schema.org/",
        "cr": "http://mlcommons.org/croissant/",
        "rai": "http://mlcommons.org/croissant/RAI/",
        "dct": "http://purl.org/dc/terms/",
        "conformsTo": "dct:conformsTo",
        "data": { "@id": "cr:data", "@type": "@json" },
        "dataType": { "@id": "cr:dataType", "@type": "@vocab" },
        "examples": { "@id": "cr:examples", "@type": "@json" },
    });
    for name in [
        "citeAs",
        "column",
        "equivalentProperty",
        "extract",
        "field",
        "fileObject",
        "fileProperty",
        "fileSet",
        "format",
        "includes",
        "isLiveDataset",
        "jsonPath",
        "key",
        "md5",
        "parentField",
        "path",
        "recordSet",
        "references",
        "regex",
        "repeated",
        "replace",
        "samplingRate",
        "separator",
        "source",
        "subField",
        "transform",
    ] {
        context[name] = json!(format!("cr:{name}"));
    }
    context
}
