//! Output of `crumple inspect` for a keyword deck.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::PathBuf;

use crate::solver::Value;
use crate::solver::lsdyna::deck::Deck;
use serde::Serialize;

/// Where titles were taken from, and what a deck says of its run, in its units.
pub(super) fn document(
    titles_from: Option<&(PathBuf, usize)>,
    deck: Option<&Deck>,
) -> impl Serialize {
    let parameters = deck.map(|deck| {
        let all = deck.parameters.iter();
        all.map(|(name, value)| document! { name: name, value: value }).collect::<Vec<_>>()
    });
    document! {
        titles_from if_any: titles_from.map(|(path, _)| path.display().to_string()),
        titles if_any: titles_from.map(|(_, count)| count),
        units if_any: deck.and_then(|deck| Some(deck.units.as_ref()?.text.trim())),
        impact_speed if_any: deck.and_then(|deck| Some(deck.impact_speed()?.speed)),
        outputs if_any: deck.map(|deck| &deck.outputs),
        history_nodes if_any: deck.map(|deck| &deck.history_nodes),
        contacts if_any: deck.map(|deck| &deck.contacts),
        rigid_walls if_any: deck.map(|deck| &deck.rigid_walls),
        parts if_any: deck.map(|deck| &deck.parts),
        parameters if_any: parameters,
        includes if_any: deck.map(|deck| &deck.includes),
    }
}

pub(super) fn print(out: &mut dyn Write, deck: &Deck) -> io::Result<()> {
    if let Some(units) = &deck.units {
        writeln!(out, "  units       {}", units.text.trim())?;
    }
    if let Some(impact) = deck.impact_speed() {
        let speed = impact.speed;
        writeln!(out, "  speed       {speed} (initial velocity, in the deck's units)")?;
    }
    let outputs: Vec<String> = deck
        .outputs
        .iter()
        .map(|o| o.interval.map_or(o.file.to_string(), |dt| format!("{} each {dt}", o.file)))
        .collect();
    if !outputs.is_empty() {
        writeln!(out, "  outputs     {}", outputs.join(", "))?;
    }
    list(out, "nodes", deck.history_nodes.iter().map(|node| titled(node.id, &node.title)))?;
    for (what, interfaces) in [("contacts", &deck.contacts), ("walls", &deck.rigid_walls)] {
        list(
            out,
            what,
            interfaces.iter().map(|of| match of.id {
                Some(id) => titled(id, &of.title),
                None => titled("(no id)", &of.title),
            }),
        )?;
    }
    list(out, "parts", deck.parts.iter().map(|part| titled(part.id, &part.title)))?;
    let parameters = deck.parameters.iter().map(|(name, value)| match value {
        Value::Real(value) => format!("{name} = {value:?}"),
        Value::Integer(value) => format!("{name} = {value}"),
        Value::Text(value) => format!("{name} = \"{value}\""),
        Value::Unknown => format!("{name} = (not known)"),
    });
    list(out, "parameters", parameters)?;
    for include in &deck.includes {
        let missing = if include.found { "" } else { "  (not found)" };
        writeln!(out, "  include     {}{missing}", include.name)?;
    }
    Ok(())
}

pub(super) fn titled(id: impl Display, title: &Option<String>) -> String {
    format!("{id}{}", title.as_ref().map_or(String::new(), |title| format!("  {title}")))
}

/// Entries printed in full; of longer lists the rest is counted.
pub(super) const SHOWN: usize = 20;

/// Entries below their number.
pub(super) fn list(
    out: &mut dyn Write,
    what: &str,
    entries: impl ExactSizeIterator<Item = String>,
) -> io::Result<()> {
    let count = entries.len();
    if count > 0 {
        writeln!(out, "  {what:<11} {count}")?;
    }
    for entry in entries.take(SHOWN) {
        writeln!(out, "    {entry}")?;
    }
    match count.checked_sub(SHOWN) {
        Some(more @ 1..) => writeln!(out, "    … and {more} more (--json lists all)"),
        _ => Ok(()),
    }
}
