//! The report: one HTML page about a database and the runs made with it.
//!
//! The page is self-contained: styles, script and numbers are inside, and it may not load anything (`default-src
//! 'none'`). Every picture is embedded as SVG; the script adds values under the pointer and zoom. Without the script,
//! tables and pictures remain.

mod figure;
mod group;
mod page;
mod train;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::database::Database;
use crate::error::Error;
use crate::surrogate::Model;
use crate::table::Table;
use figure::Figure;

/// What a report is about.
#[derive(Clone, Debug)]
pub(crate) struct ReportSettings {
    /// Title of the page; the database's name if absent.
    pub title: Option<String>,
    /// Groups of the database; all if empty.
    pub groups: Vec<String>,
    /// Speed in m/s of the predicted curves; the middle of each group's widest gap if absent.
    pub speed_m_per_s: Option<f64>,
    /// At which left-out speeds the methods are compared.
    pub methods: MethodSpeeds,
    /// Fits of the spring and damper (NSDM) at each of them; 0 leaves that method out.
    pub nsdm_seeds: u64,
    /// Seed of the forests.
    pub seed: u64,
}

/// At which left-out speeds the methods are compared: each takes about half a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MethodSpeeds {
    /// At none; trains are not compared with FE either.
    None,
    /// Where the chosen model has its largest error.
    Worst,
    /// At every inner speed.
    All,
}

/// A number that stands out at the top, with its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct KeyFigure {
    value: String,
    name: String,
}

/// Part of a section.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Part {
    /// A heading of the third level.
    Heading(String),
    Text(String),
    Figure(Figure),
    Table {
        caption: String,
        #[serde(flatten)]
        table: Table,
    },
}

impl Part {
    fn table(caption: impl Into<String>, table: impl Into<Table>) -> Self {
        Self::Table { caption: caption.into(), table: table.into() }
    }
}

/// A part of the page with a heading.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Section {
    id: String,
    title: String,
    parts: Vec<Part>,
}

/// All that the page shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Content {
    title: String,
    subtitle: String,
    figures: Vec<KeyFigure>,
    warnings: Vec<String>,
    sections: Vec<Section>,
}

impl Content {
    /// A warning, once.
    fn warn(&mut self, warning: String) {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }
}

/// The page about a database and scenarios, and how many warnings it shows.
///
/// Of `models`, those that `auto` chose for these very cases spare their validation; `step` receives the current step.
pub(crate) fn report(
    path: &Path,
    database: &Database,
    scenarios: &[PathBuf],
    models: &[Model],
    settings: &ReportSettings,
    mut step: impl FnMut(&str),
) -> Result<(String, usize), Error> {
    let mut content = Content {
        title: settings.title.clone().unwrap_or_else(|| page::file_name(path)),
        subtitle: format!(
            "Curve database {}, crumple {}",
            path.display(),
            env!("CARGO_PKG_VERSION")
        ),
        ..Content::default()
    };
    let mut groups: Vec<&str> = Vec::new();
    for group in &settings.groups {
        database.group(path, group)?;
        groups.push(group);
    }
    if groups.is_empty() {
        groups.extend(database.groups());
    }
    let cases: usize = groups.iter().map(|group| database.cases(group).len()).sum();
    content.figures.push(KeyFigure { value: cases.to_string(), name: "FE runs".into() });
    for group in &groups {
        step(&format!("reporting {group}"));
        group::add(&mut content, group, database.cases(group), models, settings)?;
    }
    for scenario in scenarios {
        step(&format!("running {}", scenario.display()));
        train::add(&mut content, scenario, settings)?;
    }
    group::add_sources(&mut content, groups.iter().flat_map(|group| database.cases(group)));
    let warnings = content.warnings.len();
    Ok((page::html(&content), warnings))
}
