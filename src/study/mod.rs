//! Studies: which runs there are, and how each becomes a case.
//!
//! A manifest as written (`Manifest`) is checked once ([`Study`]); the files of a run are found
//! and hashed (`LocatedRun`); only if they changed are they read and the case extracted.

mod check;
pub(crate) mod extract;
pub(crate) mod files;

use std::path::{Path, PathBuf};

use crate::curve::Masses;
use crate::curve::extract::{Stated, StatedContact};
use crate::error::{Document, Error, KeyPath};
use crate::file::absolute;
use crate::manifest as toml_file;
use crate::unit::SpeedKind;
pub(crate) use check::{Manifest, RunEntry, StudyKind};
pub(crate) use files::LocatedRun;

/// A manifest that makes sense, and where it stands.
#[derive(Clone, Debug)]
pub struct Study {
    manifest: Manifest,
    path: PathBuf,
    folder: PathBuf,
    /// The manifest's text, for the places of what is wrong with a run.
    document: Document,
}

pub(crate) fn load(path: &Path) -> Result<Study, Error> {
    parse(path, &toml_file::read_text(path)?)
}

/// Parses and checks the text of a study manifest; `path` is for messages.
///
/// # Errors
/// If the text is not a manifest, or what it says makes no sense.
pub fn parse(path: &Path, text: &str) -> Result<Study, Error> {
    let manifest = toml_file::parse(path, text)?;
    let document = Document::new(path, text);
    check::check(&manifest).map_err(|error| error.placed(|key| document.place(key)))?;
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    Ok(Study { manifest, path: path.into(), folder, document })
}

impl Study {
    fn run_key(&self, entry: &RunEntry) -> KeyPath {
        let at = self.runs().iter().position(|run| std::ptr::eq(run, entry));
        KeyPath::of("run").item(at.unwrap_or_default())
    }

    /// An error of a run, with the place in the manifest of the key that it is about.
    pub(crate) fn placed(&self, error: Error) -> Error {
        error.placed_if_keyed(|key| self.document.place(key))
    }

    pub(crate) fn name(&self) -> &str {
        &self.manifest.study.name
    }

    pub(crate) fn group(&self) -> &str {
        &self.manifest.study.group
    }

    /// Its manifest from the root on, as given.
    pub(crate) fn path(&self) -> String {
        absolute(&self.path)
    }

    pub(crate) fn runs(&self) -> &[RunEntry] {
        &self.manifest.run
    }

    fn speed_kind(&self) -> SpeedKind {
        match self.manifest.study.kind {
            StudyKind::Wall => SpeedKind::Wall,
            StudyKind::Pair => SpeedKind::Closing,
        }
    }

    fn accepts_energy(&self, entry: &RunEntry) -> bool {
        entry.accept_energy.unwrap_or(self.manifest.study.accept_energy)
    }

    /// What the run's entry states of its record.
    fn stated(&self, entry: &RunEntry) -> Stated {
        let time = entry.contact_time.map(|t| StatedContact::Time { s: t.0 });
        Stated {
            contact: time.or(entry.gap.map(|g| StatedContact::Gap { m: g.0 })),
            offset_m: entry.offset.map_or(0.0, |o| o.0),
            truncate_s: entry.truncate.map(|t| t.0),
            force_sign: entry.sign.map(|sign| sign as f64),
            accept_energy: self.accepts_energy(entry),
        }
    }

    fn masses(&self, entry: &RunEntry) -> Masses {
        let body_kg = entry.mass.0;
        let other_kg = match self.manifest.study.kind {
            StudyKind::Wall => None,
            StudyKind::Pair => Some(entry.other_mass.map_or(body_kg, |m| m.0)),
        };
        Masses { body_kg, other_kg }
    }
}
