//! MDF 4.1 (ASAM): one group of channels over time, of a recorded case or of a multi-body run; SI.
//!
//! Blocks follow each other: a name such as `##CG`, the length, the number of links, the links, the data. Every record
//! holds the time and one double per channel.

use super::export_curve::stem_of;
use super::{Exported, sampled_note};
use crate::curve::body::body_force_n;
use crate::curve::{Case, ForceKind};
use crate::error::Error;
use crate::unit::km_per_h;

/// A quantity over time: name, SI unit, one value per time.
pub(crate) struct Channel<'a> {
    pub name: String,
    pub unit: &'static str,
    pub values: &'a [f64],
}

/// The recorded motion of a case. Its comment holds what an import needs to know.
pub(super) fn write_case(case: &Case) -> Result<Exported, Error> {
    let sampled = &case.curves.sampled;
    let body_force = body_force_n(case);
    let channel = |name: &str, unit, values| Channel { name: name.to_string(), unit, values };
    let speed = &case.conditions.speed;
    let mut channels = vec![
        channel("deflection", "m", sampled.deflection_m()),
        channel("closing speed", "m/s", &case.curves.closing_speed_m_per_s),
    ];
    match case.curves.force_kind {
        ForceKind::Contact => {
            channels.push(channel("force", "N", sampled.force_n()));
            channels.push(channel("inertia", "N", &body_force));
        }
        ForceKind::Body => channels.push(channel("force", "N", sampled.force_n())),
    }
    let (group, name) = (&case.id.group, &case.id.name);
    let mut facts = vec![
        format!("{group} {name} {} ({})", km_per_h(speed.m_per_s), speed.kind.name()),
        format!("force_kind: {}", case.curves.force_kind.name()),
        format!("speed_m_per_s: {}", speed.m_per_s),
        format!("speed_kind: {}", speed.kind.name()),
        format!("mass_kg: {}", case.conditions.masses.body_kg),
    ];
    facts.extend(case.conditions.masses.other_kg.map(|kg| format!("other_mass_kg: {kg}")));
    facts.push("contact_time_s: 0".into());
    facts.push("sign: deflection and force positive in compression, time 0 is the first contact; inertia is the force that moves the body".into());
    let bytes = file(&facts.join("\n"), &format!("{group}/{name}"), sampled.time_s(), &channels);
    let name = stem_of(group, name);
    let notes = sampled_note(case).into_iter().collect();
    Ok(Exported { files: vec![(format!("{name}.mf4"), bytes)], notes, ..Exported::default() })
}

/// Comment of a run's file.
pub(super) const RUN: &str =
    "multi-body run of crumple: x positive in the direction in which the first train moves";

/// How the columns of a run end, and the units of their channels.
const UNITS: [(&str, &str); 5] =
    [("_m_per_s2", "m/s^2"), ("_m_per_s", "m/s"), ("_m", "m"), ("_N", "N"), ("_s", "s")];

/// A run: of the times and columns such as `v_m_per_s[A1]` a channel "v A1" in m/s each.
pub(crate) fn of_run(columns: &[(String, &[f64])]) -> Vec<u8> {
    let channels = columns.iter().skip(1).map(|(name, values)| {
        let (quantity, of) = name.split_once('[').unwrap_or((name, ""));
        let unit = UNITS.iter().find(|(end, _)| quantity.ends_with(end));
        let (end, unit) = unit.copied().unwrap_or_default();
        let name = format!("{} {}", quantity.trim_end_matches(end), of.trim_end_matches(']'));
        Channel { name: name.trim().to_string(), unit, values }
    });
    let channels: Vec<Channel<'_>> = channels.collect();
    file(RUN, "run", columns.first().map_or(&[], |(_, time_s)| time_s), &channels)
}

/// The column of which [`of_run`] made a channel.
pub(super) fn column_of(name: &str, unit: &str) -> String {
    let end = UNITS.iter().find(|(_, of)| *of == unit).map_or("", |(end, _)| end);
    match name.split_once(' ') {
        Some((quantity, of)) => format!("{quantity}{end}[{of}]"),
        None => format!("{name}{end}"),
    }
}

/// A file with these channels.
fn file(comment: &str, group: &str, time_s: &[f64], channels: &[Channel<'_>]) -> Vec<u8> {
    let mut out = Blocks(Vec::new());
    out.0.extend_from_slice(b"MDF     4.10    crumple \0\0\0\0");
    out.0.extend_from_slice(&410u16.to_le_bytes());
    out.0.resize(64, 0);
    // Links are offsets, so that what a block refers to comes first, but for the header, which has its place.
    let header = out.0.len();
    out.block(b"HD", &[0; 6], &[0; 32]);
    let comment = out.text(b"MD", &format!("<HDcomment><TX>{}</TX></HDcomment>", escaped(comment)));
    let by =
        "<FHcomment><TX>written</TX><tool_id>crumple</tool_id><tool_vendor>crumple</tool_vendor>";
    let version = env!("CARGO_PKG_VERSION");
    let by = format!("{by}<tool_version>{version}</tool_version></FHcomment>");
    let by = out.text(b"MD", &by);
    let history = out.block(b"FH", &[0, by], &[0; 16]);
    let mut next = 0;
    for (k, channel) in channels.iter().enumerate().rev() {
        next = out.channel(next, &channel.name, channel.unit, 0, k + 1);
    }
    let first = out.channel(next, "time", "s", 2, 0);
    let size = 8 * (channels.len() + 1);
    let name = out.text(b"TX", group);
    let mut described = vec![0; 8];
    described.extend_from_slice(&(time_s.len() as u64).to_le_bytes());
    described.resize(24, 0);
    described.extend_from_slice(&(size as u32).to_le_bytes());
    described.resize(32, 0);
    let group = out.block(b"CG", &[0, first, name, 0, 0, 0], &described);
    let mut records = Vec::with_capacity(size * time_s.len());
    for (k, time) in time_s.iter().enumerate() {
        records.extend_from_slice(&time.to_le_bytes());
        for channel in channels {
            let value = channel.values.get(k).copied().unwrap_or(f64::NAN);
            records.extend_from_slice(&value.to_le_bytes());
        }
    }
    let data = out.block(b"DT", &[], &records);
    let data_group = out.block(b"DG", &[0, group, data, 0], &[0; 8]);
    for (link, to) in [(0, data_group), (1, history), (5, comment)] {
        let at = header + 24 + 8 * link;
        out.0[at..at + 8].copy_from_slice(&to.to_le_bytes());
    }
    out.0
}

struct Blocks(Vec<u8>);

impl Blocks {
    /// Adds a block; its offset.
    fn block(&mut self, name: &[u8; 2], links: &[u64], data: &[u8]) -> u64 {
        let at = self.0.len() as u64;
        self.0.extend_from_slice(b"##");
        self.0.extend_from_slice(name);
        self.0.extend_from_slice(&[0; 4]);
        let length = 24 + 8 * links.len() + data.len();
        for word in [length as u64, links.len() as u64].iter().chain(links) {
            self.0.extend_from_slice(&word.to_le_bytes());
        }
        self.0.extend_from_slice(data);
        self.0.resize(self.0.len().next_multiple_of(8), 0);
        at
    }

    fn text(&mut self, name: &[u8; 2], text: &str) -> u64 {
        let mut bytes = text.as_bytes().to_vec();
        bytes.push(0);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        self.block(name, &[], &bytes)
    }

    /// The `k`-th double of a record; `kind` 2 is the time that the others are over.
    fn channel(&mut self, next: u64, name: &str, unit: &str, kind: u8, k: usize) -> u64 {
        let (name, unit) = (self.text(b"TX", name), self.text(b"TX", unit));
        // Kind, synchronised by time, little-endian IEEE 754, first bit; first byte, bits.
        let mut data = vec![kind, kind / 2, 4, 0];
        data.extend_from_slice(&(8 * k as u32).to_le_bytes());
        data.extend_from_slice(&64u32.to_le_bytes());
        data.resize(72, 0);
        self.block(b"CN", &[next, 0, name, 0, 0, 0, unit, 0], &data)
    }
}

/// Unlike names, comments have lines.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
