//! Output of `crumple inspect` for a keyword deck.

use std::io::{self, Write};
use std::path::Path;

use crate::solver::lsdyna::deck::{Deck, DeckInterface, TitledEntity, Value};
use serde::Serialize;

/// A deck's metadata, or only where titles were taken from.
#[derive(Default, Serialize)]
pub(super) struct DeckReport<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    titles_from: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    titles: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    units: Option<&'a str>,
    /// In the deck's units.
    #[serde(skip_serializing_if = "Option::is_none")]
    impact_speed: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outputs: Vec<Output>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    history_nodes: Vec<Entry<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    contacts: Vec<Entry<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    rigid_walls: Vec<Entry<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    parts: Vec<Entry<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    parameters: Vec<Parameter<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    includes: Vec<Include<'a>>,
}

#[derive(Serialize)]
struct Parameter<'a> {
    name: &'a str,
    /// None if the deck does not state it clearly.
    value: Option<Plain<'a>>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Plain<'a> {
    Real(f64),
    Integer(i64),
    Text(&'a str),
}

impl<'a> Parameter<'a> {
    fn of(name: &'a str, value: &'a Value) -> Self {
        let value = match value {
            Value::Real(value) => Some(Plain::Real(*value)),
            Value::Integer(value) => Some(Plain::Integer(*value)),
            Value::Text(value) => Some(Plain::Text(value)),
            Value::Unknown => None,
        };
        Self { name, value }
    }

    fn shown(&self) -> String {
        match self.value {
            Some(Plain::Real(value)) => format!("{value:?}"),
            Some(Plain::Integer(value)) => value.to_string(),
            Some(Plain::Text(value)) => format!("\"{value}\""),
            None => "(not known)".into(),
        }
    }
}

#[derive(Serialize)]
struct Output {
    file: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    interval: Option<f64>,
}

#[derive(Serialize)]
struct Entry<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    title: Option<&'a str>,
}

#[derive(Serialize)]
struct Include<'a> {
    name: &'a str,
    found: bool,
}

impl<'a> DeckReport<'a> {
    pub(super) fn of(deck: &'a Deck) -> Self {
        let named = |list: &'a [TitledEntity]| -> Vec<Entry<'a>> {
            list.iter().map(|n| Entry { id: Some(n.id), title: n.title.as_deref() }).collect()
        };
        let interfaces = |list: &'a [DeckInterface]| -> Vec<Entry<'a>> {
            list.iter().map(|n| Entry { id: n.id, title: n.title.as_deref() }).collect()
        };
        Self {
            titles_from: None,
            titles: None,
            units: deck.units.as_ref().map(|u| u.text.trim()),
            impact_speed: deck.impact_speed().map(|s| s.speed),
            outputs: deck
                .outputs
                .iter()
                .map(|o| Output { file: o.file, interval: o.interval })
                .collect(),
            history_nodes: named(&deck.history_nodes),
            contacts: interfaces(&deck.contacts),
            rigid_walls: interfaces(&deck.rigid_walls),
            parts: named(&deck.parts),
            parameters: deck.parameters.iter().map(|(n, v)| Parameter::of(n, v)).collect(),
            includes: deck
                .includes
                .iter()
                .map(|i| Include { name: &i.name, found: i.found })
                .collect(),
        }
    }

    /// A note that titles of a solver file come from the deck at `path`.
    pub(super) fn titles(path: &Path, count: usize) -> Self {
        Self {
            titles_from: Some(path.display().to_string()),
            titles: Some(count),
            ..Self::default()
        }
    }

    pub(super) fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        if let (Some(path), Some(count)) = (&self.titles_from, self.titles) {
            writeln!(out, "  titles      {count} taken from the deck {path}")?;
        }
        if let Some(units) = self.units {
            writeln!(out, "  units       {units}")?;
        }
        if let Some(speed) = self.impact_speed {
            writeln!(out, "  speed       {speed} (initial velocity, in the deck's units)")?;
        }
        let outputs: Vec<String> = self
            .outputs
            .iter()
            .map(|o| o.interval.map_or(o.file.to_string(), |dt| format!("{} each {dt}", o.file)))
            .collect();
        if !outputs.is_empty() {
            writeln!(out, "  outputs     {}", outputs.join(", "))?;
        }
        list(out, "nodes", &self.history_nodes)?;
        list(out, "contacts", &self.contacts)?;
        list(out, "walls", &self.rigid_walls)?;
        list(out, "parts", &self.parts)?;
        if !self.parameters.is_empty() {
            writeln!(out, "  parameters  {}", self.parameters.len())?;
        }
        for parameter in self.parameters.iter().take(SHOWN) {
            writeln!(out, "    {} = {}", parameter.name, parameter.shown())?;
        }
        rest(out, self.parameters.len())?;
        for include in &self.includes {
            let missing = if include.found { "" } else { "  (not found)" };
            writeln!(out, "  include     {}{missing}", include.name)?;
        }
        Ok(())
    }
}

/// Entries printed in full; of longer lists the rest is counted.
const SHOWN: usize = 20;

fn list(out: &mut dyn Write, what: &str, entries: &[Entry<'_>]) -> io::Result<()> {
    if entries.is_empty() {
        return Ok(());
    }
    writeln!(out, "  {what:<11} {}", entries.len())?;
    for entry in entries.iter().take(SHOWN) {
        let id = entry.id.map_or("(no id)".to_string(), |id| id.to_string());
        writeln!(out, "    {id}{}", entry.title.map_or(String::new(), |t| format!("  {t}")))?;
    }
    rest(out, entries.len())
}

/// Says how many of all entries were not printed.
fn rest(out: &mut dyn Write, entries: usize) -> io::Result<()> {
    match entries.checked_sub(SHOWN) {
        Some(more @ 1..) => writeln!(out, "    … and {more} more (--json lists all)"),
        _ => Ok(()),
    }
}
