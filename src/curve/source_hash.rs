//! What a run's case was made of, whatever run, study and group are called.

use std::collections::BTreeSet;

use super::Case;

impl Case {
    /// Hash over the recipe without names and paths, and over the bytes of the sources: equal for
    /// a run and for its case under an earlier name. `None` if the case is of no run.
    pub(crate) fn source_hash(&self) -> Option<String> {
        source_hash(
            &self.provenance.recipe,
            self.provenance.sources.iter().map(|source| source.blake3.as_str()),
        )
    }
}

/// The same of a run's recipe, as JSON, and the hashes of its files.
pub(crate) fn source_hash<'a>(
    recipe: &str,
    files: impl Iterator<Item = &'a str>,
) -> Option<String> {
    let mut recipe: serde_json::Value = serde_json::from_str(recipe).ok()?;
    let run = recipe.get_mut("run")?.as_object_mut()?;
    run.remove("path");
    run.remove("deck");
    let recipe = recipe.as_object_mut()?;
    recipe.remove("study");
    // Found in the deck where the manifest has none; the files say the same.
    recipe.remove("units");
    let mut hash = blake3::Hasher::new();
    hash.update(serde_json::to_string(recipe).ok()?.as_bytes());
    for file in files.collect::<BTreeSet<_>>() {
        hash.update(file.as_bytes());
    }
    Some(hash.finalize().to_hex().to_string())
}
