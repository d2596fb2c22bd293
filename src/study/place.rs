//! Which key of the manifest an error of a run is about.

use std::path::Path;

use super::files::force_file;
use super::{RunEntry, RunError, Study};
use crate::curve::recipe::ForceSource;
use crate::error::{KeyPath, Place};
use crate::solver::ReadError;

impl Study {
    /// The place in the manifest of what is wrong with a run, if the manifest says it.
    pub(crate) fn place(&self, entry: &RunEntry, error: &RunError) -> Option<Place> {
        let at = self.runs().iter().position(|run| std::ptr::eq(run, entry))?;
        let run = KeyPath::of("run").item(at);
        let key = match error {
            RunError::NoFolder { .. } => run.key("path"),
            RunError::Extract { .. } => run.key("path"),
            RunError::NoFile { file, .. } => self.sources().find(|s| s.file == file)?.key("file"),
            RunError::NoUnits { .. } => KeyPath::of("study"),
            RunError::Io { path, .. } => self.deck(entry, path).then(|| run.key("deck"))?,
            RunError::Read(error) => match self.read_key(error) {
                Some(key) => key,
                None => self.deck(entry, path_of(error)?).then(|| run.key("deck"))?,
            },
        };
        Some(self.document.place(&key))
    }

    /// Whether a path is that of the deck that the entry names.
    fn deck(&self, entry: &RunEntry, path: &Path) -> bool {
        entry.deck.as_ref().is_some_and(|deck| self.folder.join(deck) == path)
    }

    /// The key of the recipe that asks a file for what it does not have.
    fn read_key(&self, error: &ReadError) -> Option<KeyPath> {
        match error {
            ReadError::NoSuchEntity { path, format, id: wanted, .. } => {
                self.id_key(path, format, wanted.id)
            }
            ReadError::SingleSurface { path, id, .. } => self.id_key(path, "rcforc", *id),
            ReadError::NoSuchComponent { path, format, component, .. } => {
                let mut sources = self.sources().filter(|s| s.is_of(path, format));
                Some(sources.find(|s| s.component == component)?.key("component"))
            }
            _ => None,
        }
    }

    fn id_key(&self, path: &Path, format: &str, id: i64) -> Option<KeyPath> {
        let mut ids = self.sources().filter(|s| s.is_of(path, format)).flat_map(|source| {
            source.ids.map(|(key, found)| (found == Some(id)).then(|| source.key(key)))
        });
        ids.find_map(|key| key)
    }

    /// What the recipe asks of which file.
    fn sources(&self) -> impl Iterator<Item = Source<'_>> {
        let recipe = &self.manifest.recipe;
        let deflection = Source {
            table: "deflection",
            file: &recipe.deflection.file,
            ids: [
                ("node", Some(recipe.deflection.node)),
                ("minus_node", recipe.deflection.minus_node),
            ],
            component: recipe.deflection.component.name(),
        };
        let force = Source::of_force("force", &recipe.force);
        let contact = recipe.contact.as_ref().map(|force| Source::of_force("contact", force));
        [deflection, force].into_iter().chain(contact)
    }
}

/// The file of an error of a reader that cannot open it.
fn path_of(error: &ReadError) -> Option<&Path> {
    match error {
        ReadError::Io { path, .. } | ReadError::UnknownFormat { path, .. } => Some(path),
        _ => None,
    }
}

/// A table of the recipe that names a file and what is read of it.
struct Source<'a> {
    table: &'static str,
    file: &'a str,
    /// Keys of ids, and what they have.
    ids: [(&'static str, Option<i64>); 2],
    component: &'a str,
}

impl<'a> Source<'a> {
    fn of_force(table: &'static str, force: &'a ForceSource) -> Self {
        let (id, component) = match force {
            ForceSource::Contact { id, component, .. } => (("id", Some(*id)), component),
            ForceSource::Body { node, component, .. } => (("node", Some(*node)), component),
        };
        Self { table, file: force_file(force), ids: [id, ("", None)], component }
    }

    /// Whether this is the file at `path`, or the section of that format in it.
    fn is_of(&self, path: &Path, format: &str) -> bool {
        let section = format.split('/').next().unwrap_or(format);
        path.file_name().is_some_and(|name| name == self.file) || section == self.file
    }

    fn key(&self, key: &str) -> KeyPath {
        KeyPath::of("recipe").key(self.table).key(key)
    }
}
