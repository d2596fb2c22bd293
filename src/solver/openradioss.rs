//! OpenRadioss time history `T01`: binary records framed as Fortran writes them.
//!
//! Its groups are given as the sections of LS-DYNA that hold the same: nodes as `nodout`,
//! rigid walls as `rwforc`, contact interfaces as `rcforc`, cross sections as `secforc` (never
//! seen in a file), global variables as `glstat`. T01 stores the *impulse* of walls, contacts
//! and sections; the forces here are its central difference over time (one-sided at both
//! ends), means over two output intervals.

use std::collections::HashSet;
use std::io::{self, BufRead, Read};
use std::sync::Arc;

use super::lsdyna::nodout::TRANSLATIONS;
use super::problem::{ProblemCode, Problems};
use super::source::{Source, Stream};
use super::{Entity, Selection, SolverFile};
use crate::history::{EntityId, History, Side, derivative};

/// A record of the header is at most this long; a state's may be as long as the file.
const MAX_HEADER_RECORD: usize = 1 << 20;
/// Objects or variables of one group; bounds what a damaged count can ask for.
const MAX_COUNT: i32 = 50_000_000;

/// Types of history groups that are read.
const NODES: i32 = 0;
const INTERFACE: i32 = 101;
const RIGID_WALL: i32 = 102;
const SECTION: i32 = 104;

/// Node variables by code, from 1: those of a nodout without its coordinates.
const NODE_COMPONENTS: &[&str] = TRANSLATIONS.split_at(9).0;
/// Global variables in their order, named as in `glstat` where it has them.
const GLOBAL_COMPONENTS: [&str; 22] = [
    "internal_energy",
    "kinetic_energy",
    "x_momentum",
    "y_momentum",
    "z_momentum",
    "mass",
    "time_step",
    "rotational_energy",
    "external_work",
    "spring_and_damper_energy",
    "sliding_interface_energy",
    "hourglass_energy",
    "elastic_contact_energy",
    "frictional_contact_energy",
    "damping_contact_energy",
    "plastic_work",
    "added_mass",
    "added_mass_percentage",
    "inlet_mass",
    "outlet_mass",
    "inlet_energy",
    "outlet_energy",
];
/// Components made from the impulses FNX FNY FNZ FTX FTY FTZ (codes 1 to 6).
const FORCE_COMPONENTS: [&str; 3] = ["x_force", "y_force", "z_force"];
const IMPULSES: usize = 6;

/// Whether a file begins like a T01: a record of a code and a title of 80 characters.
pub fn recognises(head: &[u8]) -> bool {
    let Some(words) = head.get(..8) else { return false };
    let code = i32::from_be_bytes([words[4], words[5], words[6], words[7]]);
    words[..4] == 84i32.to_be_bytes() && (1_000..100_000).contains(&code)
}

/// Reads the selected histories of every section, or of the one selected.
pub fn read(parts: &[Box<dyn Source>], selection: &Selection) -> io::Result<Vec<SolverFile>> {
    let Some(source) = parts.first() else { return Ok(Vec::new()) };
    let input = Stream::new(&**source);
    let mut problems = Problems::default();
    let mut records = Records { input };
    let Some(header) = Header::read(&mut records)? else {
        problems.add(
            ProblemCode::CutRecord,
            None,
            None,
            format!("the header is damaged or cut at byte {}", records.input.position()),
        );
        let file = SolverFile { problems: problems.into_list(), ..empty("glstat") };
        return Ok(vec![file]);
    };
    let mut states = States::new(&header, selection);
    states.read(&mut records, &mut problems)?;
    Ok(states.finish(&header, selection, problems))
}

/// Records: 4-byte length, that many bytes, the same length again, all big-endian.
struct Records<'a> {
    input: Stream<'a>,
}

impl Records<'_> {
    fn length(&mut self) -> io::Result<Option<usize>> {
        let mut word = [0; 4];
        match self.input.read_exact(&mut word) {
            Ok(()) => Ok(usize::try_from(i32::from_be_bytes(word)).ok()),
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// The next record, or `None` where there is none, or none that is whole.
    fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        let Some(length) = self.length()? else { return Ok(None) };
        let mut bytes = Vec::new();
        self.input.by_ref().take(length as u64).read_to_end(&mut bytes)?;
        if bytes.len() < length || self.length()? != Some(length) {
            return Ok(None);
        }
        Ok(Some(bytes))
    }

    fn header(&mut self) -> io::Result<Option<Vec<u8>>> {
        Ok(self.next()?.filter(|r| r.len() <= MAX_HEADER_RECORD))
    }
}

/// Bytes of the length before and behind each record.
const FRAME: u64 = 4;

/// A group of histories.
struct Group {
    kind: i32,
    objects: Vec<(i64, Option<String>)>,
    codes: Vec<i32>,
}

struct Header {
    title: Option<String>,
    solver: Option<String>,
    globals: usize,
    part_values: usize,
    subset_values: usize,
    groups: Vec<Group>,
}

fn integers(record: &[u8]) -> Vec<i32> {
    record.chunks_exact(4).map(|w| i32::from_be_bytes([w[0], w[1], w[2], w[3]])).collect()
}

fn text(bytes: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    (!text.is_empty()).then(|| text.to_string())
}

/// A count that a sane file can have.
fn count(value: Option<&i32>) -> Option<usize> {
    value.filter(|v| (0..=MAX_COUNT).contains(*v)).map(|&v| v as usize)
}

impl Header {
    /// `None` if the header is cut or makes no sense.
    fn read(records: &mut Records<'_>) -> io::Result<Option<Self>> {
        let Some(first) = records.header()? else { return Ok(None) };
        let Some(&code) = integers(first.get(..4).unwrap_or_default()).first() else {
            return Ok(None);
        };
        let title_length = match code {
            ..3041 => 40,
            3041..4021 => 80,
            _ => 100,
        };
        let Some(solver) = records.header()? else { return Ok(None) };
        if code > 3050 {
            let Some(extra) = records.header()? else { return Ok(None) };
            for _ in 0..count(integers(&extra).first()).unwrap_or(0) {
                if records.header()?.is_none() {
                    return Ok(None);
                }
            }
        }
        let Some(counts) = records.header()? else { return Ok(None) };
        let counts = integers(&counts);
        let sizes: Option<Vec<usize>> = (0..6).map(|i| count(counts.get(i))).collect();
        let Some([parts, materials, properties, subsets, groups, globals]) =
            sizes.and_then(|s| <[usize; 6]>::try_from(s).ok())
        else {
            return Ok(None);
        };
        if globals > 0 && records.header()?.is_none() {
            return Ok(None);
        }
        let mut part_values = 0;
        for _ in 0..parts {
            // Id, title, four integers: the last is the number of history variables.
            let Some(part) = records.header()? else { return Ok(None) };
            let tail = integers(part.get(4 + title_length..).unwrap_or_default());
            let Some(variables) = count(tail.get(3)) else { return Ok(None) };
            part_values += variables;
            if variables > 0 && records.header()?.is_none() {
                return Ok(None);
            }
        }
        for _ in 0..materials + properties {
            if records.header()?.is_none() {
                return Ok(None);
            }
        }
        let mut subset_values = 0;
        for _ in 0..subsets {
            // Id, parent, number of child subsets, of parts, of variables, title.
            let Some(subset) = records.header()? else { return Ok(None) };
            let head = integers(subset.get(..20).unwrap_or_default());
            for k in 2..5 {
                let Some(number) = count(head.get(k)) else { return Ok(None) };
                if k == 4 {
                    subset_values += number;
                }
                if number > 0 && records.next()?.is_none() {
                    return Ok(None);
                }
            }
        }
        let mut read = Vec::new();
        for _ in 0..groups {
            let Some(group) = Group::read(records)? else { return Ok(None) };
            read.push(group);
        }
        Ok(Some(Self {
            title: text(first.get(4..).unwrap_or_default()),
            solver: text(&solver),
            globals,
            part_values,
            subset_values,
            groups: read,
        }))
    }
}

impl Group {
    fn read(records: &mut Records<'_>) -> io::Result<Option<Self>> {
        // Id, type, one integer, number of objects, number of variables, title.
        let Some(head) = records.header()? else { return Ok(None) };
        let head = integers(head.get(..20).unwrap_or_default());
        let (Some(&kind), Some(objects), Some(variables)) =
            (head.get(1), count(head.get(3)), count(head.get(4)))
        else {
            return Ok(None);
        };
        let mut named = Vec::new();
        for _ in 0..objects {
            let Some(object) = records.header()? else { return Ok(None) };
            let Some(&id) = integers(object.get(..4).unwrap_or_default()).first() else {
                return Ok(None);
            };
            named.push((i64::from(id), text(&object[4..])));
        }
        let codes = match variables {
            0 => Vec::new(),
            _ => match records.next()? {
                Some(codes) => integers(&codes),
                None => return Ok(None),
            },
        };
        match codes.len() == variables {
            true => Ok(Some(Self { kind, objects: named, codes })),
            false => Ok(None),
        }
    }

    fn section(&self) -> Option<&'static str> {
        match self.kind {
            NODES => Some("nodout"),
            INTERFACE => Some("rcforc"),
            RIGID_WALL => Some("rwforc"),
            SECTION => Some("secforc"),
            _ => None,
        }
    }

    /// Position of a variable's code among an object's values.
    fn position(&self, code: usize) -> Option<usize> {
        self.codes.iter().position(|&c| usize::try_from(c) == Ok(code))
    }
}

/// One value per state of one object's variable.
struct Channel {
    offset: usize,
    values: Vec<f64>,
}

/// The states, of selected values only.
struct States {
    time: Vec<f64>,
    globals: Vec<Channel>,
    /// Channels per group, in order of the offsets asked for.
    groups: Vec<Vec<Channel>>,
    /// Lengths of a state's records in bytes: time, globals, parts, subsets, groups.
    lengths: Vec<usize>,
    first_group: usize,
    /// Kept values that are no finite numbers.
    not_finite: usize,
}

impl States {
    fn new(header: &Header, selection: &Selection) -> Self {
        let wants_section = |name: &str| selection.section.as_ref().is_none_or(|s| s == name);
        let channel = |offset| Channel { offset, values: Vec::new() };
        let globals = GLOBAL_COMPONENTS
            .iter()
            .enumerate()
            .take(header.globals)
            .filter(|(_, name)| wants_section("glstat") && selection.wants_component(name))
            .map(|(k, _)| channel(k))
            .collect();
        let groups = header
            .groups
            .iter()
            .map(|group| {
                let Some(section) = group.section().filter(|s| wants_section(s)) else {
                    return Vec::new();
                };
                let codes: Vec<usize> = match section {
                    "nodout" => (1..=NODE_COMPONENTS.len())
                        .filter(|&code| selection.wants_component(NODE_COMPONENTS[code - 1]))
                        .collect(),
                    _ if magnitude(section)
                        .iter()
                        .chain(&FORCE_COMPONENTS)
                        .any(|c| selection.wants_component(c)) =>
                    {
                        (1..=IMPULSES).collect()
                    }
                    _ => Vec::new(),
                };
                let positions: Vec<usize> =
                    codes.iter().filter_map(|&code| group.position(code)).collect();
                let wanted = |id: i64| {
                    [None, Some(Side::SurfA), Some(Side::SurfB)]
                        .into_iter()
                        .any(|side| selection.wants(EntityId { id, side }))
                };
                let objects = group.objects.iter().enumerate().filter(|(_, o)| wanted(o.0));
                objects
                    .flat_map(|(k, _)| {
                        positions.iter().map(move |p| channel(k * group.codes.len() + p))
                    })
                    .collect()
            })
            .collect();
        let mut lengths = vec![4];
        lengths.extend([header.globals].iter().filter(|&&n| n > 0).map(|n| 4 * n));
        lengths.extend([header.part_values].iter().filter(|&&n| n > 0).map(|n| 4 * n));
        lengths.extend([header.subset_values].iter().filter(|&&n| n > 0).map(|n| 4 * n));
        let first_group = lengths.len();
        lengths.extend(header.groups.iter().map(|g| 4 * g.objects.len() * g.codes.len()));
        Self { time: Vec::new(), globals, groups, lengths, first_group, not_finite: 0 }
    }

    /// Bytes of one state.
    fn stride(&self) -> u64 {
        self.lengths.iter().map(|&n| n as u64 + 2 * FRAME).sum()
    }

    /// Reads states until the end. One that is damaged is left out and said; as all have the
    /// same length, the next one is found behind it.
    fn read(&mut self, records: &mut Records<'_>, problems: &mut Problems) -> io::Result<()> {
        let mut start = records.input.position();
        let mut number = 0;
        let mut above: [Option<Vec<Vec<u8>>>; 2] = [None, None];
        let mut damaged: Option<(u64, usize)> = None;
        loop {
            records.input.go_to(start);
            if records.input.fill_buf()?.is_empty() {
                break;
            }
            number += 1;
            let mut state = Vec::with_capacity(self.lengths.len());
            for &length in &self.lengths {
                match records.next()? {
                    Some(record) if record.len() == length => state.push(record),
                    _ => break,
                }
            }
            if state.len() == self.lengths.len() {
                damaged = self.say(damaged, number, problems);
                self.look_for_zeros(&above, Some(&state), problems);
                self.store(&state, problems);
                let [_, last] = above;
                above = [last, Some(state)];
            } else if damaged.is_none() {
                damaged = Some((start, number));
            }
            start += self.stride();
        }
        self.say(damaged, number + 1, problems);
        self.look_for_zeros(&above, None, problems);
        if self.not_finite > 0 {
            let message = format!(
                "{} values are no finite numbers; they are returned as such",
                self.not_finite
            );
            problems.add(ProblemCode::NotFinite, None, None, message);
        }
        Ok(())
    }

    /// Says which states are left out: from the damaged one up to the one before `next`.
    fn say(
        &self,
        damaged: Option<(u64, usize)>,
        next: usize,
        problems: &mut Problems,
    ) -> Option<(u64, usize)> {
        let (byte, first) = damaged?;
        let message = match next - first {
            1 => format!("state {first} is cut or damaged; it is left out"),
            _ => format!("states {first} to {} are cut or damaged; they are left out", next - 1),
        };
        problems.add_at_byte(ProblemCode::IncompleteState, byte, message);
        None
    }

    /// Names the last state above if values of it are zero that are not in the states around
    /// it: T01 has no check sums, and neither a motion nor an impulse does that.
    fn look_for_zeros(
        &self,
        above: &[Option<Vec<Vec<u8>>>; 2],
        below: Option<&Vec<Vec<u8>>>,
        problems: &mut Problems,
    ) {
        let [Some(before), Some(state)] = above else { return };
        let is_zero = |word: &[u8]| word[0] & 0x7f == 0 && word[1..] == [0, 0, 0];
        let mut count = 0;
        for (k, record) in state.iter().enumerate().skip(1) {
            let words = record.chunks_exact(4).zip(before[k].chunks_exact(4)).enumerate();
            count += words
                .filter(|(i, (now, before))| {
                    let after = below.is_none_or(|b| !is_zero(&b[k][4 * i..4 * i + 4]));
                    is_zero(now) && !is_zero(before) && after
                })
                .count();
        }
        if count > 0 {
            let message = format!(
                "{count} values of the state at time {:?} are zero but not so in the states around it: was the file overwritten there?",
                self.time.last().copied().unwrap_or(f64::NAN)
            );
            problems.add(ProblemCode::SuspectZeros, None, None, message);
        }
    }

    fn store(&mut self, state: &[Vec<u8>], problems: &mut Problems) {
        let real = |record: &[u8], offset: usize| {
            let at = 4 * offset;
            let word = record.get(at..at + 4).and_then(|w| <[u8; 4]>::try_from(w).ok());
            word.map_or(f64::NAN, |w| f64::from(f32::from_be_bytes(w)))
        };
        let time = real(&state[0], 0);
        if self.time.last().is_some_and(|&last| time < last) || !time.is_finite() {
            problems.add(
                ProblemCode::TimeGoesBack,
                None,
                None,
                format!(
                    "time {time:?} of state {} does not follow the one above it",
                    self.time.len() + 1
                ),
            );
        }
        self.time.push(time);
        let mut keep = |channel: &mut Channel, record: &[u8]| {
            let value = real(record, channel.offset);
            self.not_finite += usize::from(!value.is_finite());
            channel.values.push(value);
        };
        for channel in &mut self.globals {
            keep(channel, &state[1]);
        }
        for (channels, record) in self.groups.iter_mut().zip(&state[self.first_group..]) {
            for channel in channels {
                keep(channel, record);
            }
        }
    }

    fn finish(self, header: &Header, selection: &Selection, problems: Problems) -> Vec<SolverFile> {
        let time: Arc<[f64]> = self.time.into();
        let problems = problems.into_list();
        let mut files: Vec<SolverFile> = Vec::new();
        let mut seen: HashSet<(&str, EntityId)> = HashSet::new();
        for (group, channels) in header.groups.iter().zip(self.groups) {
            let Some(section) = group.section() else { continue };
            let file = match files.iter_mut().find(|f| f.section == section) {
                Some(file) => file,
                None => {
                    files.push(empty(section));
                    let last = files.len() - 1;
                    &mut files[last]
                }
            };
            let mut channels = channels.into_iter().peekable();
            for (k, (id, title)) in group.objects.iter().enumerate() {
                let range = k * group.codes.len()..(k + 1) * group.codes.len();
                let mut own: Vec<(usize, Vec<f64>)> = Vec::new();
                while let Some(c) = channels.next_if(|c| range.contains(&c.offset)) {
                    let code = group.codes[c.offset - range.start];
                    own.push((usize::try_from(code).unwrap_or(0), c.values));
                }
                for entity in entities(section, *id) {
                    if seen.insert((section, entity)) {
                        file.entities.push(Entity { id: entity, title: title.clone() });
                        let wants = selection.wants(entity);
                        let made = if wants {
                            histories(section, entity, &own, &time)
                        } else {
                            Vec::new()
                        };
                        let kept =
                            made.into_iter().filter(|h| selection.wants_component(&h.component));
                        file.histories.extend(kept);
                    }
                }
            }
            let has: Vec<Arc<str>> = match section {
                "nodout" => (1..=NODE_COMPONENTS.len())
                    .filter(|&code| group.position(code).is_some())
                    .map(|code| NODE_COMPONENTS[code - 1].into())
                    .collect(),
                _ if (1..=IMPULSES).all(|code| group.position(code).is_some()) => {
                    magnitude(section).iter().chain(&FORCE_COMPONENTS).map(|&c| c.into()).collect()
                }
                _ => Vec::new(),
            };
            for component in has {
                if !file.components.contains(&component) {
                    file.components.push(component);
                }
            }
        }
        if header.globals > 0 {
            let mut file = empty("glstat");
            file.components =
                GLOBAL_COMPONENTS.iter().take(header.globals).map(|&c| c.into()).collect();
            file.histories = self
                .globals
                .into_iter()
                .map(|c| history(None, GLOBAL_COMPONENTS[c.offset], c.values, &time))
                .collect();
            files.push(file);
        }
        files.retain(|f| selection.section.as_ref().is_none_or(|s| *s == f.section));
        for file in &mut files {
            file.time = time.clone();
            file.solver = Some("OpenRadioss".into());
            file.version.clone_from(&header.solver);
            file.title.clone_from(&header.title);
            file.problems.clone_from(&problems);
            if file.time.is_empty() {
                file.components.clear();
                file.histories.clear();
            }
        }
        files
    }
}

/// Names of an object in its section: both sides of an interface.
fn entities(section: &str, id: i64) -> Vec<EntityId> {
    match section {
        "rcforc" => {
            [Side::SurfA, Side::SurfB].map(|side| EntityId { id, side: Some(side) }).to_vec()
        }
        _ => vec![EntityId::new(id)],
    }
}

/// The component that is the size of a force, where the section has one.
fn magnitude(section: &str) -> &'static [&'static str] {
    match section {
        "rwforc" => &["normal_force"],
        "secforc" => &["total_force"],
        _ => &[],
    }
}

/// The histories of one object from its variables by code.
fn histories(
    section: &str,
    entity: EntityId,
    own: &[(usize, Vec<f64>)],
    time: &Arc<[f64]>,
) -> Vec<History> {
    if section == "nodout" {
        let component = |code: usize| NODE_COMPONENTS.get(code.wrapping_sub(1));
        return own
            .iter()
            .filter_map(|(code, values)| {
                Some(history(Some(entity), component(*code)?, values.clone(), time))
            })
            .collect();
    }
    let impulse = |code: usize| own.iter().find(|(c, _)| *c == code).map(|(_, v)| v);
    let all: Option<Vec<&Vec<f64>>> = (1..=IMPULSES).map(impulse).collect();
    let Some(all) = all.filter(|_| time.len() > 1) else { return Vec::new() };
    // SURFB feels the opposite of what T01 writes for the interface.
    let sign = if entity.side == Some(Side::SurfB) { -1.0 } else { 1.0 };
    let rate = |values: &[f64]| derivative(time, values);
    let normal: Vec<Vec<f64>> = (0..3).map(|k| rate(all[k])).collect();
    let mut made = Vec::new();
    let total: Vec<Vec<f64>> = (0..3)
        .map(|k| {
            let tangential = rate(all[k + 3]);
            normal[k].iter().zip(tangential).map(|(n, t)| sign * (n + t)).collect()
        })
        .collect();
    for &component in magnitude(section) {
        // A wall's normal force, but the whole force of a section.
        let of = if section == "rwforc" { &normal } else { &total };
        let length = |i: usize| of.iter().map(|n| n[i] * n[i]).sum::<f64>().sqrt();
        let values = (0..time.len()).map(length).collect();
        made.push(history(Some(entity), component, values, time));
    }
    for (component, values) in FORCE_COMPONENTS.into_iter().zip(total) {
        made.push(history(Some(entity), component, values, time));
    }
    made
}

fn history(
    entity: Option<EntityId>,
    component: &str,
    values: Vec<f64>,
    time: &Arc<[f64]>,
) -> History {
    History { entity, component: component.into(), time: time.clone(), values }
}

fn empty(section: &str) -> SolverFile {
    SolverFile {
        format: "t01",
        section: section.into(),
        solver: None,
        version: None,
        title: None,
        entities: Vec::new(),
        without_data: Vec::new(),
        components: Vec::new(),
        time: Arc::new([]),
        histories: Vec::new(),
        problems: Vec::new(),
        notes: match section {
            "rwforc" | "rcforc" | "secforc" => vec![DIFFERENTIATED.into()],
            _ => Vec::new(),
        },
    }
}

const DIFFERENTIATED: &str =
    "forces are the central difference of T01's impulses, a mean over two output intervals";
