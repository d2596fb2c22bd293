//! A proposed study as TOML, every value with a comment that says where it is from.

use super::evidence::Proposed;
use super::masses;
use super::proposal::{Proposal, ProposedRun};
use super::text::{Text, inline, quoted, speed_text};
use super::units::trimmed;
use crate::curve::recipe::ForceSource;
use crate::history::Side;

const HEAD: &str = "\
Proposed by crumple init. Of every value the comment above it says where it is from:
  read      it stands in the runs' files
  computed  it follows from what stands there
  guessed   it is the likely one of several: look at it
  given     by an option of crumple init
Change what you know better.";

impl Proposal {
    /// The proposal as the text of a study manifest.
    pub fn to_toml(&self) -> String {
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
        match self.half_model {
            true => {
                text.comment(
                    "given: by --half-model. Closing speed and deflection are twice the run's.",
                );
                text.line("half_model = true");
            }
            false if self.node_titles.len() < 2 => {
                text.comment("CANNOT BE SEEN: is this one body of a pair, cut at the symmetry plane between the two? Then take the two lines below instead of kind = \"wall\", and write the closing speeds, twice the speeds below (crumple init --half-model does both).");
                text.line("# kind = \"pair\"");
                text.line("# half_model = true");
            }
            false => {}
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
        if let Some(side) = self.side_not_taken() {
            text.item(&format!("or side = \"{}\", which has the same force", side.name()));
        }
        text.value("force", &self.force, inline);
        text.value("filter", &self.filter, |filter| quoted(&String::from(*filter)));
        text.value("sampling", &self.sampling, inline);
    }

    /// The other side of the force's interface, where it has the same force.
    fn side_not_taken(&self) -> Option<Side> {
        match self.force.value()? {
            ForceSource::Contact { side: Some(Side::SurfA), .. } if self.other_side => {
                Some(Side::SurfB)
            }
            ForceSource::Contact { side: Some(Side::SurfB), .. } if self.other_side => {
                Some(Side::SurfA)
            }
            _ => None,
        }
    }

    /// What holds for all runs is said once, above them.
    fn shared(&self, text: &mut Text) -> Vec<String> {
        let first = self.runs.first();
        let masses = first.map(|run| ("mass", run.mass_kg.to_string()));
        let others =
            first.and_then(|run| Some(("other_mass", run.other_mass_kg.as_ref()?.to_string())));
        let is_shared = |key: &str, from: &String| {
            self.runs.iter().all(|run| match key {
                "mass" => run.mass_kg.to_string() == *from,
                _ => run.other_mass_kg.as_ref().is_some_and(|mass| mass.to_string() == *from),
            })
        };
        let shared = [masses, others].into_iter().flatten();
        let shared: Vec<(&str, String)> =
            shared.filter(|(key, from)| is_shared(key, from)).collect();
        if !shared.is_empty() && self.runs.len() > 1 {
            text.blank();
            shared.iter().for_each(|(key, from)| text.comment(&format!("{key}: {from}")));
        }
        match self.runs.len() {
            0 | 1 => Vec::new(),
            _ => shared.into_iter().map(|(_, from)| from).collect(),
        }
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
            Proposed::Found { value, evidence } if shared.contains(&mass.to_string()) => {
                let text_of = quoted(&masses::text(*value));
                text.line(&format!("{key} = {text_of}    # {}", evidence.word()));
            }
            _ => text.value(key, mass, |kg| quoted(&masses::text(*kg))),
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
