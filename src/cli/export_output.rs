//! Where exported files go: standard output, a file, or a folder of several.

use crate::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use crate::file::{not_written, write_all_whole};
use crate::formats::{Exported, Format};
use serde::Serialize;

use super::file_kind::FileKind;
use super::output;
use super::{Failure, GlobalOptions};

/// The target of an export.
pub(super) struct Destination<'a> {
    /// Standard output if absent.
    pub output: Option<&'a Path>,
    pub format: &'a Format,
    /// Of the curves.
    pub warnings: &'a [String],
}

/// A file that would go to standard output, within a JSON document.
#[derive(Serialize)]
struct Text<'a> {
    format: &'static str,
    text: String,
    notes: &'a [String],
    warnings: &'a [String],
}

#[derive(Serialize)]
struct Document<'a> {
    format: &'static str,
    bytes: usize,
    output: String,
    files: Vec<String>,
    notes: &'a [String],
    warnings: &'a [String],
}

impl Destination<'_> {
    /// Writes the files and prints their notes.
    pub(super) fn write(&self, exported: Exported, options: GlobalOptions) -> Result<(), Failure> {
        let notes = &exported.notes;
        if !options.json && !options.quiet {
            notes.iter().for_each(|note| output::say(&format!("note: {note}")));
        }
        let Some(path) = self.output else {
            return self.print(&exported, options);
        };
        let files = self.paths(path, &exported)?;
        // A table of a model is HDF5.
        let own = if self.format.name == "table" { FileKind::Database } else { FileKind::Curve };
        files.iter().try_for_each(|file| options.keep_others(file, own))?;
        if files != [path] {
            make_folders(&files)?;
        }
        write_all_whole(
            &files.iter().zip(&exported.files).map(|(p, f)| (&**p, &*f.1)).collect::<Vec<_>>(),
        )?;
        if options.json {
            return output::print_json(&Document {
                format: self.format.name,
                bytes: exported.files.iter().map(|f| f.1.len()).sum(),
                output: path.display().to_string(),
                files: files.iter().map(|f| f.display().to_string()).collect(),
                notes,
                warnings: self.warnings,
            });
        }
        options.print(|out| files.iter().try_for_each(|f| writeln!(out, "wrote {}", f.display())))
    }

    fn print(&self, exported: &Exported, options: GlobalOptions) -> Result<(), Failure> {
        let name = self.format.name;
        let [(_, bytes)] = &exported.files[..] else {
            return Err(Failure::Usage(format!(
                "{name} gives {} files: name a folder with -o",
                exported.files.len()
            )));
        };
        match std::str::from_utf8(bytes) {
            Ok(text) if options.json => output::print_json(&Text {
                format: name,
                text: text.into(),
                notes: &exported.notes,
                warnings: self.warnings,
            }),
            Err(_) if options.json => {
                Err(Failure::Usage(format!("{name} is binary: name a file with -o")))
            }
            _ => output::print_data(|out| out.write_all(bytes)),
        }
    }

    /// The paths of the files: the one that was named, or theirs within the folder.
    fn paths(&self, path: &Path, exported: &Exported) -> Result<Vec<PathBuf>, Failure> {
        if exported.files.len() == 1 && !path.is_dir() {
            return Ok(vec![path.into()]);
        }
        // A file's name for several; what is called .mme is a folder.
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let names_a_file = self.format.extensions.contains(&extension);
        if !path.is_dir() && names_a_file && !self.format.takes_case() {
            return Err(Failure::Usage(format!(
                "-o {}: this export gives {} files: name a folder, and the kind of file with --to {extension}",
                path.display(),
                exported.files.len()
            )));
        }
        Ok(exported.files.iter().map(|(name, _)| path.join(name)).collect())
    }
}

/// The folders of files within the folder that was named.
fn make_folders(files: &[PathBuf]) -> Result<(), Error> {
    let folders = files.iter().filter_map(|f| f.parent());
    for folder in folders.filter(|f| !f.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(|e| not_written(folder, e))?;
    }
    Ok(())
}
