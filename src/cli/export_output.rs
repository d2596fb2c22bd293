//! Where exported files go: standard output, a file, or a folder of several.

use crate::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use crate::file::{not_written, write_all_whole};
use crate::formats::{Exported, Format};

use super::file_kind::FileKind;
use super::{Failure, GlobalOptions, output, usage};

/// Writes the files to standard output if `output` is absent, and prints their notes.
pub(super) fn write(
    exported: &Exported,
    format: &Format,
    output: Option<&Path>,
    warnings: &[String],
    options: GlobalOptions,
) -> Result<(), Failure> {
    let (name, notes) = (format.name, &exported.notes);
    options.say_notes(notes);
    let Some(path) = output else {
        let [(_, bytes)] = &exported.files[..] else {
            let files = exported.files.len();
            return usage(format!("{name} gives {files} files: name a folder with -o"));
        };
        return match std::str::from_utf8(bytes) {
            Ok(text) if options.json => output::print_json(
                &document! { format: name, text: text, notes: notes, warnings: warnings },
            ),
            Err(_) if options.json => usage(format!("{name} is binary: name a file with -o")),
            _ => output::print_data(|out| out.write_all(bytes)),
        };
    };
    let files = paths(path, format, exported)?;
    // A table of a model is HDF5.
    let own = if name == "table" { FileKind::Database } else { FileKind::Curve };
    files.iter().try_for_each(|file| options.keep_others(file, own))?;
    if files != [path] {
        make_folders(&files)?;
    }
    write_all_whole(
        &files.iter().zip(&exported.files).map(|(p, f)| (&**p, &*f.1)).collect::<Vec<_>>(),
    )?;
    let document = document! {
        format: name,
        bytes: exported.files.iter().map(|f| f.1.len()).sum::<usize>(),
        output: path.display().to_string(),
        files: files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>(),
        notes: notes,
        warnings: warnings,
    };
    options.show(&document, |out| {
        files.iter().try_for_each(|f| writeln!(out, "wrote {}", f.display()))
    })
}

/// The paths of the files: the one that was named, or theirs within the folder.
fn paths(path: &Path, format: &Format, exported: &Exported) -> Result<Vec<PathBuf>, Failure> {
    if exported.files.len() == 1 && !path.is_dir() {
        return Ok(vec![path.into()]);
    }
    // A file's name for several; what is called .mme is a folder.
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let names_a_file = format.extensions.contains(&extension);
    if !path.is_dir() && names_a_file && !format.takes_case() {
        return usage(format!(
            "-o {}: this export gives {} files: name a folder, and the kind of file with --to {extension}",
            path.display(),
            exported.files.len()
        ));
    }
    Ok(exported.files.iter().map(|(name, _)| path.join(name)).collect())
}

/// The folders of files within the folder that was named.
fn make_folders(files: &[PathBuf]) -> Result<(), Error> {
    let folders = files.iter().filter_map(|f| f.parent());
    for folder in folders.filter(|f| !f.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(|e| not_written(folder, e))?;
    }
    Ok(())
}
