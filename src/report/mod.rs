//! The report: one HTML page about a database and the runs made with it.
//!
//! The page is self-contained: styles, script and numbers are inside, and it may not load anything (`default-src
//! 'none'`). Every picture is embedded as SVG; the script adds values under the pointer and zoom. Without the script,
//! tables and pictures remain.

mod figure;
mod group;
mod page;
mod side_by_side;
mod train;

use std::path::{Path, PathBuf};

use crate::curve::Case;
use crate::database::Database;
use crate::error::Error;
use crate::order;
use crate::surrogate::Model;
use crate::table::Table;
use figure::Figure;

/// What a report is about.
#[derive(Clone, Debug)]
pub(crate) struct ReportSettings {
    /// Title of the page; the first file's name if absent.
    pub title: Option<String>,
    /// Who answers for it, if stated.
    pub author: Option<String>,
    /// When it was made, in ISO 8601.
    pub made_at: String,
    /// The command that made it.
    pub command: String,
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
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct KeyFigure {
    value: String,
    name: String,
}

/// Part of a section.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Part {
    /// A heading of the third level.
    Heading(String),
    Text(String),
    Figure(Figure),
    Table {
        caption: String,
        table: Table,
    },
}

impl Part {
    fn table(caption: impl Into<String>, table: impl Into<Table>) -> Self {
        let mut table = table.into();
        for cell in table.rows.iter_mut().flatten() {
            if let Some(number) = cell.text.strip_prefix('-') {
                cell.text = format!("−{number}");
            }
        }
        Self::Table { caption: caption.into(), table }
    }
}

/// A part of the page with a heading.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Section {
    id: String,
    title: String,
    parts: Vec<Part>,
}

/// What came out, in a sentence.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Verdict {
    /// `over` or `kept` of a limit, `unknown`, or `known`: a result without a limit.
    state: &'static str,
    about: String,
    text: String,
}

impl Verdict {
    fn known(about: &str, text: String) -> Self {
        Self { state: "known", about: about.into(), text }
    }
}

/// What the reader can do about a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ToDo {
    CheckRuns,
    AddRuns,
    CheckScenario,
}

impl ToDo {
    fn text(self) -> &'static str {
        match self {
            Self::CheckRuns => {
                "About FE runs: check the record, or set the key of the study that is named"
            }
            Self::AddRuns => "About predictions: further FE runs, or another speed",
            Self::CheckScenario => "About scenarios: the curve or the key that is named",
        }
    }
}

/// Warnings that the reader can do the same about.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Warnings {
    what_to_do: &'static str,
    texts: Vec<Warning>,
}

/// What is warned of, and what it is said of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Warning {
    about: Vec<String>,
    text: String,
}

/// All that the page shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Content {
    title: String,
    /// Date, author, command, versions and files, a line each.
    about: Vec<String>,
    figures: Vec<KeyFigure>,
    /// Breaches first.
    verdicts: Vec<Verdict>,
    warnings: Vec<Warnings>,
    sections: Vec<Section>,
}

impl Content {
    /// A warning, once for all that it is said of.
    fn warn(&mut self, what: ToDo, about: &str, text: String) {
        let what_to_do = what.text();
        let group = match self.warnings.iter_mut().find(|of| of.what_to_do == what_to_do) {
            Some(group) => group,
            None => {
                self.warnings.push(Warnings { what_to_do, texts: Vec::new() });
                self.warnings.last_mut().expect("it was just added")
            }
        };
        let about = about.to_string();
        match group.texts.iter_mut().find(|warning| warning.text == text) {
            Some(warning) if warning.about.contains(&about) => {}
            Some(warning) => warning.about.push(about),
            None => group.texts.push(Warning { about: vec![about], text }),
        }
    }

    fn verdict(&mut self, verdict: Verdict) {
        self.verdicts.push(verdict);
    }
}

/// The page about databases and scenarios, and how many warnings it shows.
///
/// Of `models`, those that `auto` chose for these very cases spare their validation; `step` receives the current step.
pub(crate) fn report(
    databases: &[(PathBuf, Database)],
    scenarios: &[PathBuf],
    models: &[Model],
    settings: &ReportSettings,
    mut step: impl FnMut(&str),
) -> Result<(String, usize), Error> {
    let files: Vec<&Path> =
        databases.iter().map(|(path, _)| &**path).chain(scenarios.iter().map(|p| &**p)).collect();
    let first = files.first().map(|path| file_name(path)).unwrap_or_default();
    let mut content = Content {
        title: settings.title.clone().unwrap_or(first),
        about: about(&files, settings),
        ..Content::default()
    };
    let groups = groups(databases, settings)?;
    let cases: usize = groups.iter().map(|(_, _, cases)| cases.len()).sum();
    if !databases.is_empty() {
        content.figures.push(KeyFigure { value: cases.to_string(), name: "runs".into() });
    }
    let mut designs = Vec::new();
    for (title, group, cases) in &groups {
        step(&format!("reporting {title}"));
        let kind = |cases: &[Case]| cases.first().map(|case| case.conditions.speed.kind);
        let same = groups.iter().filter(|(_, name, of)| name == group && kind(of) == kind(cases));
        let same = same.map(|(.., cases)| *cases);
        let speed_m_per_s = settings.speed_m_per_s.or_else(|| group::common_speed(same));
        let settings = ReportSettings { speed_m_per_s, ..settings.clone() };
        designs.extend(group::add(&mut content, title, group, cases, models, &settings)?);
    }
    let mut ran = Vec::new();
    for scenario in scenarios {
        step(&format!("running {}", scenario.display()));
        ran.push(train::add(&mut content, scenario, &short_name(scenario, scenarios), settings)?);
    }
    if databases.len() > 1 {
        side_by_side::add_designs(&mut content, &designs);
    }
    side_by_side::add_scenarios(&mut content, ran)?;
    let all = groups.iter().flat_map(|(title, _, cases)| cases.iter().map(|case| (&**title, case)));
    group::add_sources(&mut content, all);
    if !scenarios.is_empty() {
        content.verdict(Verdict::known(
            "All scenarios",
            "these values come from one-dimensional models, say nothing about survival space, and are not evidence of conformity".into(),
        ));
    }
    // Breaches first, then what is not known.
    let urgency = |verdict: &Verdict| match verdict.state {
        "over" => 0,
        "unknown" => 1,
        "kept" => 2,
        _ => 3,
    };
    order::sort_by_key(&mut content.verdicts, urgency);
    let warnings = content.warnings.iter().map(|of| of.texts.len()).sum();
    Ok((page::html(&content), warnings))
}

/// Date, author, command and versions, and the files.
fn about(files: &[&Path], settings: &ReportSettings) -> Vec<String> {
    let author = settings.author.iter().map(|author| format!(", {author}"));
    let author: String = author.collect();
    let day = settings.made_at.split('T').next().unwrap_or_default();
    let files: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    vec![
        format!("{day}{author}"),
        format!("Files: {}", files.join(", ")),
        format!("Made by crumple {}: {}", env!("CARGO_PKG_VERSION"), settings.command),
    ]
}

type Group<'a> = (String, &'a str, &'a [Case]);

/// The groups that are shown, with titles that tell those of different databases apart.
fn groups<'a>(
    databases: &'a [(PathBuf, Database)],
    settings: &ReportSettings,
) -> Result<Vec<Group<'a>>, Error> {
    let mut groups = Vec::new();
    for (path, database) in databases {
        for group in database.groups() {
            let is_shown = settings.groups.is_empty() || settings.groups.iter().any(|g| g == group);
            let title = match databases {
                [_] => group.into(),
                _ => {
                    format!("{group}, {}", short_name(path, databases.iter().map(|(path, _)| path)))
                }
            };
            if is_shown {
                groups.push((title, group, database.cases(group)));
            }
        }
    }
    for wanted in &settings.groups {
        if let Some((path, database)) = databases.first()
            && groups.iter().all(|(_, group, _)| group != wanted)
        {
            database.group(path, wanted)?;
        }
    }
    Ok(groups)
}

/// The last part of a path; the whole if another one ends in the same.
fn short_name<'a>(path: &Path, all: impl IntoIterator<Item = &'a PathBuf>) -> String {
    let name = file_name(path);
    let alike = all.into_iter().filter(|other| file_name(other) == name).count();
    if alike > 1 { path.display().to_string() } else { name }
}

/// The last part of a path.
fn file_name(path: &Path) -> String {
    path.file_name()
        .map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// `4.5 %`.
fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:.1} %", 100.0 * share) } else { "–".into() }
}

/// `1.087 m`.
fn metres(length_m: f64) -> String {
    format!("{length_m:.3} m")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{KeyFigure, Section};
    use crate::table::{Cell, Table};

    #[test]
    fn names_of_files_are_text() {
        let name = "</script><b>\"'&";
        let cell = |_: &&str| Cell { text: name.into(), title: name.into(), is_chosen: true };
        let table = Table::of([name]).column(name, cell);
        let chart = crate::plot::Chart::of(
            name,
            crate::plot::Panel {
                series: vec![crate::plot::Series::line(name, 0, vec![0.0, 1.0], vec![0.0, 1.0])],
                ..crate::plot::Panel::new(
                    crate::plot::Axis::new(name, name, 1.0),
                    crate::plot::Axis::new(name, name, 1.0),
                )
            },
        );
        let figure = super::figure::Figure::new("f1".into(), chart);
        let content = Content {
            title: name.into(),
            about: vec![name.into()],
            figures: vec![KeyFigure { value: name.into(), name: name.into() }],
            verdicts: vec![Verdict { state: "over", about: name.into(), text: name.into() }],
            warnings: vec![Warnings {
                what_to_do: "",
                texts: vec![Warning { about: vec![name.into()], text: name.into() }],
            }],
            sections: vec![Section {
                id: "s1".into(),
                title: name.into(),
                parts: vec![
                    Part::Heading(name.into()),
                    Part::Text(name.into()),
                    Part::Figure(figure),
                    Part::table(name, table),
                ],
            }],
        };
        let html = page::html(&content);
        assert!(!html.contains("<b>"), "{html}");
        assert_eq!(html.matches("</script>").count(), 2);
    }
}
