//! Notes and warnings on a run.

/// Choices that were made, and what the user should check.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Notes {
    /// Choices made, for the record.
    pub notes: Vec<String>,
    /// What the user should check.
    pub warnings: Vec<String>,
}

impl Notes {
    /// A single warning.
    pub(crate) fn warning(warning: String) -> Self {
        Self { notes: Vec::new(), warnings: vec![warning] }
    }

    /// Adds a note.
    pub(crate) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Adds a warning.
    pub(crate) fn warn(&mut self, warning: impl Into<String>) {
        self.warnings.push(warning.into());
    }

    /// Adds other remarks after these.
    pub(crate) fn append(&mut self, other: Self) {
        self.notes.extend(other.notes);
        self.warnings.extend(other.warnings);
    }

    /// The result of a step, whose remarks are added after these.
    pub(crate) fn take<T>(&mut self, (result, remarks): (T, Self)) -> T {
        self.append(remarks);
        result
    }
}
