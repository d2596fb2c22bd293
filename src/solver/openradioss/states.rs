//! The states of a T01: kept values, damage, and the histories made of them.

use std::collections::HashSet;
use std::io;
use std::sync::Arc;

use super::header::{FRAME, Group, Header, Records};
use super::{
    FORCE_COMPONENTS, GLOBAL_COMPONENTS, IMPULSES, NODE_COMPONENTS, empty, entities, histories,
    history, magnitude,
};
use crate::history::{EntityId, Side};
use crate::solver::problem::{Diagnostics, Place, ProblemCode};
use crate::solver::restart;
use crate::solver::{Entity, Selection, SolverFile};

/// One value per state of one object's variable.
struct Channel {
    offset: usize,
    values: Vec<f64>,
}

/// Values next to each other that a node loses for one state when it stands on a wall: its
/// velocity and its acceleration.
const STANDING: usize = 6;

/// The states, of selected values only.
pub(crate) struct StateReader {
    time: Vec<f64>,
    globals: Vec<Channel>,
    /// Channels per group, in order of the offsets asked for.
    groups: Vec<Vec<Channel>>,
    /// Lengths of a state's records in bytes: time, globals, parts, subsets, groups.
    lengths: Vec<usize>,
    first_group: usize,
    /// Where each kept state begins.
    starts: Vec<u64>,
    /// Kept values that are not finite numbers.
    not_finite: usize,
    /// What was found to be wrong on the way.
    problems: Diagnostics,
}

/// The channels of a group's selected objects and variables.
fn channels_of(group: &Group, section: &str, selection: &Selection) -> Vec<Channel> {
    let wants = |component: &str| selection.wants_component(component);
    let codes: Vec<usize> = match section {
        "nodout" => {
            (1..=NODE_COMPONENTS.len()).filter(|&code| wants(NODE_COMPONENTS[code - 1])).collect()
        }
        _ if magnitude(section).iter().chain(&FORCE_COMPONENTS).any(|c| wants(c)) => {
            (1..=IMPULSES).collect()
        }
        _ => Vec::new(),
    };
    let positions: Vec<usize> = codes.iter().filter_map(|&code| group.position(code)).collect();
    let sides = [None, Some(Side::SurfA), Some(Side::SurfB)];
    let wanted = |id: i64| sides.into_iter().any(|side| selection.wants(EntityId { id, side }));
    let objects = group.objects.iter().enumerate().filter(|(_, object)| wanted(object.0));
    objects
        .flat_map(|(k, _)| {
            let channel =
                move |p: &usize| Channel { offset: k * group.codes.len() + p, values: Vec::new() };
            positions.iter().map(channel)
        })
        .collect()
}

impl StateReader {
    pub(crate) fn new(header: &Header, selection: &Selection) -> Self {
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
            .map(|group| match group.section().filter(|s| wants_section(s)) {
                Some(section) => channels_of(group, section, selection),
                None => Vec::new(),
            })
            .collect();
        let mut lengths = vec![4];
        lengths.extend([header.globals].iter().filter(|&&n| n > 0).map(|n| 4 * n));
        lengths.extend([header.part_values].iter().filter(|&&n| n > 0).map(|n| 4 * n));
        lengths.extend([header.subset_values].iter().filter(|&&n| n > 0).map(|n| 4 * n));
        let first_group = lengths.len();
        lengths.extend(header.groups.iter().map(|g| 4 * g.objects.len() * g.codes.len()));
        Self {
            time: Vec::new(),
            globals,
            groups,
            lengths,
            first_group,
            starts: Vec::new(),
            not_finite: 0,
            problems: Diagnostics::default(),
        }
    }

    /// Bytes of one state.
    fn stride(&self) -> u64 {
        self.lengths.iter().map(|&n| n as u64 + 2 * FRAME).sum()
    }

    /// Reads states until the end. One that is damaged is left out and said; as all have the
    /// same length, the next one is found behind it.
    pub(crate) fn read(&mut self, header: &Header, records: &mut Records<'_>) -> io::Result<()> {
        let mut start = records.position();
        let mut number = 0;
        let mut above: [Option<Vec<Vec<u8>>>; 2] = [None, None];
        let mut damaged: Option<(u64, usize)> = None;
        loop {
            if !records.go_to(start)? {
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
                self.leave_out(damaged.take(), number);
                self.look_for_zeros(header, &above, Some(&state));
                self.store(&state, start);
                let [_, last] = above;
                above = [last, Some(state)];
            } else if damaged.is_none() {
                damaged = Some((start, number));
            }
            start += self.stride();
        }
        self.leave_out(damaged, number + 1);
        self.look_for_zeros(header, &above, None);
        if self.not_finite > 0 {
            let message = format!(
                "{} values are not finite numbers; they are returned as such",
                self.not_finite
            );
            self.problems.add(ProblemCode::NotFinite, None, None, message);
        }
        Ok(())
    }

    /// Notes which states are left out: from the damaged one, given by its byte and number, up to
    /// the one before `next`.
    fn leave_out(&mut self, damaged: Option<(u64, usize)>, next: usize) {
        let Some((byte, first)) = damaged else { return };
        let message = match next - first {
            1 => format!("state {first} is cut or damaged; it is left out"),
            _ => format!("states {first} to {} are cut or damaged; they are left out", next - 1),
        };
        self.problems.add_at_byte(ProblemCode::IncompleteState, byte, message);
    }

    /// Names the last state above if more values next to each other are zero, though not in the
    /// states around it, than a node that stands on a wall has: T01 has no check sums.
    fn look_for_zeros(
        &mut self,
        header: &Header,
        above: &[Option<Vec<Vec<u8>>>; 2],
        below: Option<&Vec<Vec<u8>>>,
    ) {
        let [Some(before), Some(state)] = above else { return };
        let is_zero = |word: &[u8]| word[0] & 0x7f == 0 && word[1..] == [0, 0, 0];
        for (k, record) in state.iter().enumerate().skip(1) {
            let words = record.chunks_exact(4).zip(before[k].chunks_exact(4)).enumerate();
            let vanishes = words.map(|(i, (now, before))| {
                let after = below.is_none_or(|b| !is_zero(&b[k][4 * i..4 * i + 4]));
                is_zero(now) && !is_zero(before) && after
            });
            let mut first = None;
            for (i, vanishes) in vanishes.chain([false]).enumerate() {
                if vanishes {
                    first.get_or_insert(i);
                    continue;
                }
                let Some(first) = first.take().filter(|first| i - first > STANDING) else {
                    continue;
                };
                let message = format!(
                    "{} values of the state at time {:?}, {} to {}, are zero but not so in the states around it: was the file overwritten there?",
                    i - first,
                    self.time.last().copied().unwrap_or(f64::NAN),
                    self.name(header, k, first),
                    self.name(header, k, i - 1),
                );
                let place = self.starts.last().copied().map(Place::at_byte);
                self.problems.add(ProblemCode::SuspectZeros, place, None, message);
            }
        }
    }

    /// What the `word`-th value of a state's record is.
    fn name(&self, header: &Header, record: usize, word: usize) -> String {
        let Some(group) = record.checked_sub(self.first_group).map(|k| &header.groups[k]) else {
            let global = GLOBAL_COMPONENTS.get(word).filter(|_| record == 1 && header.globals > 0);
            return global.map_or(format!("value {}", word + 1), std::string::ToString::to_string);
        };
        let width = group.codes.len().max(1);
        let id = group.objects.get(word / width).map_or(0, |(id, _)| *id);
        let code = usize::try_from(group.codes[word % width]).unwrap_or(0);
        match group.section() {
            Some("nodout") if (1..=NODE_COMPONENTS.len()).contains(&code) => {
                format!("{}[{id}]", NODE_COMPONENTS[code - 1])
            }
            section => format!("variable {code} of {} {id}", section.unwrap_or("object")),
        }
    }

    fn store(&mut self, state: &[Vec<u8>], start: u64) {
        let real = |record: &[u8], offset: usize| {
            let at = 4 * offset;
            let word = record.get(at..at + 4).and_then(|w| <[u8; 4]>::try_from(w).ok());
            word.map_or(f64::NAN, |w| f64::from(f32::from_be_bytes(w)))
        };
        let time = real(&state[0], 0);
        if !time.is_finite() {
            let message = format!("the state is left out: its time is {time:?}");
            self.problems.add_at_byte(ProblemCode::IncompleteState, start, message);
            return;
        }
        self.starts.push(start);
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

    /// Leaves out what a restart wrote again; forces cannot be told across it.
    fn resolve_restarts(&mut self) {
        let place = |i: usize| self.starts.get(i).copied().map(Place::at_byte);
        let (mut kept, found) = restart::resolve(&self.time, |_, _| Some(true), place, "");
        self.problems.append(found);
        // Nor can a state whose time is out of order be differentiated.
        let mut last = f64::NEG_INFINITY;
        kept.retain(|&i| {
            let rises = self.time[i] > last;
            last = last.max(self.time[i]);
            rises
        });
        if kept.len() == self.time.len() {
            return;
        }
        let take = |values: &mut Vec<f64>| {
            if !values.is_empty() {
                *values = kept.iter().map(|&i| values[i]).collect();
            }
        };
        take(&mut self.time);
        self.globals.iter_mut().chain(self.groups.iter_mut().flatten()).for_each(|channel| {
            take(&mut channel.values);
        });
    }

    pub(crate) fn finish(mut self, header: &Header, selection: &Selection) -> Vec<SolverFile> {
        self.resolve_restarts();
        let has_impulses = header.groups.iter().any(|g| g.section().is_some_and(|s| s != "nodout"));
        if self.time.len() == 1 && has_impulses {
            let message = "one state has no rate of impulses: there are no forces";
            self.problems.add(ProblemCode::AbsentComponent, None, None, message.into());
        }
        let time: Arc<[f64]> = self.time.into();
        let problems = self.problems.into_list();
        let mut files = group_files(header, self.groups, selection, &time);
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

/// One file for each section that the groups have.
fn group_files(
    header: &Header,
    groups: Vec<Vec<Channel>>,
    selection: &Selection,
    time: &Arc<[f64]>,
) -> Vec<SolverFile> {
    let mut files: Vec<SolverFile> = Vec::new();
    let mut seen: HashSet<(&str, EntityId)> = HashSet::new();
    // The variables of one object may be spread over several groups.
    let mut made: HashSet<(&str, EntityId, Arc<str>)> = HashSet::new();
    for (group, channels) in header.groups.iter().zip(groups) {
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
                }
                if selection.wants(entity) {
                    let new = histories(section, entity, &own, time).into_iter().filter(|h| {
                        selection.wants_component(&h.component)
                            && made.insert((section, entity, h.component.clone()))
                    });
                    file.histories.extend(new);
                }
            }
        }
        for component in components_of(group, section, time.len()) {
            if !file.components.contains(&component) {
                file.components.push(component);
            }
        }
    }
    files
}

/// The components that a group's variables give.
fn components_of(group: &Group, section: &str, states: usize) -> Vec<Arc<str>> {
    let has = |code: usize| group.position(code).is_some();
    match section {
        "nodout" => (1..=NODE_COMPONENTS.len())
            .filter(|&code| has(code))
            .map(|code| NODE_COMPONENTS[code - 1].into())
            .collect(),
        _ if states > 1 && (1..=IMPULSES).all(has) => {
            magnitude(section).iter().chain(&FORCE_COMPONENTS).map(|&c| c.into()).collect()
        }
        _ => Vec::new(),
    }
}
