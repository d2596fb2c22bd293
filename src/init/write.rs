//! A proposed study: its parts, and as TOML, every value with a comment that states its source.

use std::path::PathBuf;

use serde::Serialize;

use super::folders::LeftOut;
use super::measure;
use super::recipe::Alternative;
use super::units::trimmed;
use crate::curve::recipe::{DeflectionSource, Filter, ForceSource, Sampling};
use crate::history::Side;
use crate::study::StudyKind;
use crate::unit::UnitSystem;

const HEAD: &str = "\
Proposed by crumple init. The comment above each value says where it is from:
  read      found in the runs' files
  computed  derived from them
  guessed   the most likely of several: check it
  given     by an option of crumple init
Change whatever you know better.";

impl Proposal {
    /// The proposal as the text of a study manifest.
    pub(crate) fn to_toml(&self) -> String {
        let mut text = Text::default();
        HEAD.lines().for_each(|line| text.line(&format!("# {line}")));
        let missing = self.missing();
        if !missing.is_empty() {
            text.blank();
            text.comment(
                "NOT COMPLETE: crumple build needs the lines that are marked \"fill in\":",
            );
            missing.iter().for_each(|what| text.item(what));
        }
        self.head(&mut text);
        self.recipe(&mut text);
        let shared = self.shared(&mut text);
        for run in &self.runs {
            self.run(&mut text, run, &shared);
        }
        self.left_out(&mut text);
        text.done()
    }

    fn head(&self, text: &mut Text) {
        text.blank();
        text.line("[study]");
        text.value("name", &self.group, |name| quoted(name));
        if let Some(group) = self.group.value() {
            text.line(&format!("group = {}", quoted(group)));
        }
        text.value("units", &self.units, |units| quoted(&units.to_string()));
        text.value("kind", &self.kind, |kind| quoted(kind.name()));
        if self.half_model {
            text.comment(
                "given: by --half-model. Closing speed and deflection are twice the run's.",
            );
            text.line("half_model = true");
        } else if self.node_titles.len() < 2 {
            text.comment("CANNOT BE DETERMINED: is this one body of a pair, cut at the symmetry plane between the two? Then take the two lines below instead of kind = \"wall\", and write the closing speeds, twice the speeds below (crumple init --half-model does both).");
            text.line("# kind = \"pair\"");
            text.line("# half_model = true");
        }
    }

    fn recipe(&self, text: &mut Text) {
        text.blank();
        text.line("[recipe]");
        for (title, others) in self.node_titles.iter().zip(&self.other_nodes) {
            if let Some(title) = title {
                text.comment(&format!("node \"{title}\""));
            }
            others
                .iter()
                .for_each(|other| text.item(&format!("or node {}: {}", other.id, other.about)));
        }
        text.value("deflection", &self.deflection, inline);
        if let Some(title) = &self.force_title {
            text.comment(&format!("force of \"{title}\""));
        }
        for other in &self.other_forces {
            text.item(&format!("or {}: {}", other.id, other.about));
        }
        if self.other_side
            && let Some(ForceSource::Contact { side: Some(side), .. }) = self.force.value()
        {
            let other = if *side == Side::SurfA { Side::SurfB } else { Side::SurfA };
            text.item(&format!("or side = \"{}\", which has the same force", other.name()));
        }
        text.value("force", &self.force, inline);
        text.value("filter", &self.filter, |filter| quoted(&String::from(*filter)));
        text.value("sampling", &self.sampling, inline);
    }

    /// What applies to all runs is stated once, above them.
    fn shared(&self, text: &mut Text) -> Vec<String> {
        let of = |run: &ProposedRun, key: &str| match key {
            "mass" => Some(run.mass_kg.to_string()),
            _ => run.other_mass_kg.as_ref().map(Proposed::to_string),
        };
        let mut shared = Vec::new();
        for key in ["mass", "other_mass"] {
            if let [first, _, ..] = &self.runs[..]
                && let Some(from) = of(first, key)
                && self.runs.iter().all(|run| of(run, key).as_ref() == Some(&from))
            {
                if shared.is_empty() {
                    text.blank();
                }
                text.comment(&format!("{key}: {from}"));
                shared.push(from);
            }
        }
        shared
    }

    fn run(&self, text: &mut Text, run: &ProposedRun, shared: &[String]) {
        text.blank();
        text.line("[[run]]");
        text.line(&format!("path = {}", quoted(&run.path)));
        if run.name != run.path {
            text.line(&format!("name = {}", quoted(&run.name)));
        }
        run.notes.iter().for_each(|note| text.comment(&format!("LOOK: {note}")));
        text.value("speed", &run.speed_m_per_s, |speed| quoted(&speed_text(*speed)));
        let mut mass = |key: &str, mass: &Proposed<f64>| match mass {
            Proposed::Found { value, evidence, .. } if shared.contains(&mass.to_string()) => {
                let text_of = quoted(&measure::text(*value));
                text.line(&format!("{key} = {text_of}    # {}", evidence.word()));
            }
            _ => text.value(key, mass, |kg| quoted(&measure::text(*kg))),
        };
        mass("mass", &run.mass_kg);
        if let Some(other) = &run.other_mass_kg {
            mass("other_mass", other);
        }
        if let Some(truncate) = &run.truncate_s {
            let ms = |s: &f64| format!("{}ms", trimmed(&format!("{:.6}", s * 1e3)));
            text.value("truncate", truncate, |s| quoted(&ms(s)));
        }
    }

    fn left_out(&self, text: &mut Text) {
        if self.left_out.is_empty() {
            return;
        }
        text.blank();
        text.comment("Left out:");
        for out in &self.left_out {
            text.item(&format!("{}: {}", out.path.display(), out.message));
        }
        for path in self.left_out.iter().filter_map(|out| out.entry.as_deref()) {
            text.blank();
            text.line("# [[run]]");
            text.line(&format!("# path = {}", quoted(path)));
        }
    }
}

/// Comments are broken at this column.
const WIDTH: usize = 100;

/// A text as it grows.
#[derive(Default)]
pub(super) struct Text(String);

impl Text {
    pub(super) fn done(self) -> String {
        self.0
    }

    pub(super) fn blank(&mut self) {
        if !self.0.is_empty() {
            self.0.push('\n');
        }
    }

    pub(super) fn line(&mut self, line: &str) {
        self.0.push_str(line);
        self.0.push('\n');
    }

    /// A comment over as many lines as it needs.
    pub(super) fn comment(&mut self, comment: &str) {
        self.broken(comment, "# ", "#   ");
    }

    /// A point of a list.
    pub(super) fn item(&mut self, item: &str) {
        self.broken(item, "#   ", "#     ");
    }

    fn broken(&mut self, comment: &str, first: &str, further: &str) {
        let mut line = first.to_string();
        // A file's title may hold anything; a comment of TOML may not.
        let plain: String = comment.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        for word in words(&plain) {
            let is_begun = line.len() > further.len().max(first.len());
            if is_begun && line.chars().count() + 1 + word.chars().count() > WIDTH {
                self.line(&line);
                line = further.into();
            }
            if !line.ends_with(' ') {
                line.push(' ');
            }
            line.push_str(&word);
        }
        self.line(&line);
    }

    /// A key with its value under where it is from, or commented out with what to fill in.
    pub(super) fn value<T>(
        &mut self,
        key: &str,
        proposed: &Proposed<T>,
        shown: impl Fn(&T) -> String,
    ) {
        self.comment(&proposed.to_string());
        match proposed.value() {
            Some(value) => self.line(&format!("{key} = {}", shown(value))),
            None => self.line(&format!("# {key} =     # fill in")),
        }
    }
}

/// Units stay on the line of their number.
const UNITS: [&str; 10] = ["%", "ms", "µs", "s", "m", "m/s", "mm/s", "km/h", "t", "kg"];

/// The words of a comment, each number together with its unit.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let is_unit = UNITS.contains(&word.trim_end_matches([',', ';', ':', '.', ')']));
        match words.last_mut().filter(|last| is_unit && last.ends_with(|c: char| c.is_numeric())) {
            Some(last) => *last = format!("{last} {word}"),
            None => words.push(word.into()),
        }
    }
    words
}

/// A text as TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

/// A table on one line.
pub(super) fn inline<T: Serialize>(table: &T) -> String {
    let mut text = String::new();
    match table.serialize(toml::ser::ValueSerializer::new(&mut text)) {
        Ok(_) => text,
        Err(_) => String::new(),
    }
}

/// A speed with five significant digits: texts have six.
pub(super) fn speed_text(m_per_s: f64) -> String {
    let km_per_h = m_per_s * 3.6;
    if km_per_h <= 0.0 {
        return "0km/h".into();
    }
    let digits = (4 - libm::log10(km_per_h).floor() as i32).clamp(0, 9) as usize;
    format!("{}km/h", trimmed(&format!("{km_per_h:.digits$}")))
}

/// A proposed study.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Proposal {
    /// Group of the curve database, and name of the study.
    pub(crate) group: Proposed<String>,
    pub(crate) units: Proposed<UnitSystem>,
    pub(crate) kind: Proposed<StudyKind>,
    /// Whether the runs are of one body against the symmetry plane of a pair: only known if the
    /// caller says so.
    pub(crate) half_model: bool,
    pub(crate) deflection: Proposed<DeflectionSource>,
    /// Title of the node, then of the other body's.
    pub(crate) node_titles: Vec<Option<String>>,
    /// Nodes that could represent the same bodies, a list for each.
    pub(crate) other_nodes: Vec<Vec<Alternative>>,
    pub(crate) force: Proposed<ForceSource>,
    pub(crate) force_title: Option<String>,
    /// Whether the other side of the interface has the same force.
    pub(crate) other_side: bool,
    pub(crate) other_forces: Vec<Alternative>,
    pub(crate) filter: Proposed<Filter>,
    pub(crate) sampling: Proposed<Sampling>,
    /// In order of speed.
    pub(crate) runs: Vec<ProposedRun>,
    pub(crate) left_out: Vec<LeftOut>,
    /// What was chosen on the way.
    pub(crate) notes: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct ProposedRun {
    pub(crate) folder: PathBuf,
    /// The folder as the study names it.
    pub(crate) path: String,
    pub(crate) name: String,
    /// Impact speed in m/s: of a pair the closing speed.
    pub(crate) speed_m_per_s: Proposed<f64>,
    /// Mass of the body, or of each body of a pair, in kg.
    pub(crate) mass_kg: Proposed<f64>,
    /// Mass of the other body in kg, where it is another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) other_mass_kg: Option<Proposed<f64>>,
    /// Solver's time after which the record is not used, in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) truncate_s: Option<Proposed<f64>>,
    /// Maximum crush in m, if the units are known: doubled for half a model.
    pub(crate) crush_m: Option<f64>,
    /// Whether the record ends before it: then what it reached.
    pub(crate) truncated: bool,
    /// Whole states that motion and force both have.
    pub(crate) states: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) notes: Vec<String>,
}

impl Proposal {
    /// What is left to fill in before the study can be built.
    pub(crate) fn missing(&self) -> Vec<String> {
        let keys = ["units", "deflection", "force", "sampling"].map(String::from);
        let whys = [self.units.why(), self.deflection.why(), self.force.why(), self.sampling.why()];
        let mut all: Vec<(String, Option<&str>)> = keys.into_iter().zip(whys).collect();
        for run in &self.runs {
            all.push((format!("speed of {}", run.name), run.speed_m_per_s.why()));
            all.push((format!("mass of {}", run.name), run.mass_kg.why()));
            let other = run.other_mass_kg.as_ref().and_then(Proposed::why);
            all.push((format!("other_mass of {}", run.name), other));
        }
        all.into_iter().filter_map(|(key, why)| Some(format!("{key}: {}", why?))).collect()
    }
}

/// Where a value is from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Evidence {
    /// The caller gave it.
    Given,
    /// Found in a file.
    Read,
    /// It follows from what was read.
    Computed,
    /// It is the likely one of several.
    Guessed,
}

impl Evidence {
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Read => "read",
            Self::Computed => "computed",
            Self::Guessed => "guessed",
        }
    }
}

/// A value of a proposal, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Proposed<T> {
    Found {
        value: T,
        evidence: Evidence,
        /// What it was taken or made from.
        from: String,
    },
    /// It could not be determined: the user has to fill it in.
    Missing {
        /// Why not, and what to do.
        missing: String,
    },
}

impl<T> Proposed<T> {
    pub(super) fn found(value: T, evidence: Evidence, from: impl Into<String>) -> Self {
        Self::Found { value, evidence, from: from.into() }
    }

    pub(super) fn missing(why: impl Into<String>) -> Self {
        Self::Missing { missing: why.into() }
    }

    pub(crate) fn value(&self) -> Option<&T> {
        match self {
            Self::Found { value, .. } => Some(value),
            Self::Missing { .. } => None,
        }
    }

    fn why(&self) -> Option<&str> {
        match self {
            Self::Found { .. } => None,
            Self::Missing { missing } => Some(missing),
        }
    }
}

impl<T> std::fmt::Display for Proposed<T> {
    /// Where it is from: `read: …`, or `fill in: …`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Found { evidence, from, .. } => write!(f, "{}: {from}", evidence.word()),
            Self::Missing { missing } => write!(f, "fill in: {missing}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_units() {
        assert_eq!(
            words("within 3.1 %, at 36 km/h or m"),
            ["within", "3.1 %,", "at", "36 km/h", "or", "m"]
        );
        let mut text = Text::default();
        text.comment(&format!("{} 3.1 %", "x".repeat(WIDTH - 6)));
        text.comment("a\u{7f}b\nc");
        let long = format!("# {}\n#   3.1 %\n# a b c\n", "x".repeat(WIDTH - 6));
        assert_eq!(text.done(), long);
    }

    #[test]
    fn speeds_have_five_digits() {
        let shown = [24.999_984, 36.0, 0.123_456, 123.456_78].map(|v| speed_text(v / 3.6));
        assert_eq!(shown, ["25km/h", "36km/h", "0.12346km/h", "123.46km/h"]);
        assert_eq!(speed_text(0.0), "0km/h");
    }
}
