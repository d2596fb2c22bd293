//! The states of a T01: kept values, damage, and the histories made of them.

use std::collections::{HashMap, HashSet};
use std::io;
use std::sync::Arc;

use super::variables::{Component, Made, components, entities, is_normal_only, section, variable};
use super::{DIFFERENTIATED, FRAME, GLOBAL_COMPONENTS, Header, Records, empty, history};
use crate::history::{EntityId, History, Side};
use crate::signal::derivative;
use crate::solver::problem::{Diagnostics, Place, Problem, ProblemCode};
use crate::solver::states::finish::{resolve, take};
use crate::solver::{Entity, Selection, SolverFile};

/// A value of a record; NaN beyond its end.
fn real(record: &[u8], offset: usize) -> f64 {
    let at = 4 * offset;
    let word = record.get(at..at + 4).and_then(|w| <[u8; 4]>::try_from(w).ok());
    word.map_or(f64::NAN, |w| f64::from(f32::from_be_bytes(w)))
}

/// One value per state.
struct Channel {
    record: usize,
    offset: usize,
    values: Vec<f64>,
}

/// An object: the variables of one may be spread over several groups.
struct Object {
    kind: i32,
    id: i64,
    title: Option<String>,
    /// Its groups, and its place among the objects of each.
    places: Vec<(usize, usize)>,
    components: Arc<[Component]>,
    /// The channel of each variable that is kept.
    channels: HashMap<i32, usize>,
}

/// Values next to each other that a node loses for one state when it stands on a wall: its
/// velocity and its acceleration.
const STANDING: usize = 6;

/// The states, of selected values only.
pub(crate) struct StateReader {
    time: Vec<f64>,
    /// Of the globals that are kept, then of the objects.
    channels: Vec<Channel>,
    globals: usize,
    objects: Vec<Object>,
    /// Lengths of a state's records in bytes.
    lengths: Vec<usize>,
    starts: Vec<Place>,
    not_finite: usize,
    /// Which of the files is read, 0 for the first.
    part: usize,
    /// Times of the states before the cut ends of files.
    cut_after: Vec<f64>,
    problems: Diagnostics,
}

fn objects_of(header: &Header) -> Vec<Object> {
    let mut objects: Vec<Object> = Vec::new();
    let mut index: HashMap<(i32, i64), usize> = HashMap::new();
    for (group, of) in header.groups.iter().enumerate() {
        let kind = of.kind;
        for (k, (id, title)) in of.objects.iter().enumerate() {
            let at = *index.entry((kind, *id)).or_insert_with(|| {
                let (title, components) = (title.clone(), Arc::new([]) as Arc<[Component]>);
                let (places, channels) = (Vec::new(), HashMap::new());
                objects.push(Object { kind, id: *id, title, places, components, channels });
                objects.len() - 1
            });
            objects[at].places.push((group, k));
        }
    }
    // Most objects have the groups of the one above.
    let mut last: (Vec<usize>, Arc<[Component]>) = (Vec::new(), Arc::new([]));
    for object in &mut objects {
        let groups: Vec<usize> = object.places.iter().map(|place| place.0).collect();
        if groups != last.0 {
            last = (groups, components(object.kind, &object.codes(header)).into());
        }
        object.components = last.1.clone();
    }
    objects
}

impl Object {
    /// The codes of its variables, each once.
    fn codes(&self, header: &Header) -> Vec<i32> {
        let mut seen = HashSet::new();
        let all = self.places.iter().flat_map(|&(group, _)| &header.groups[group].codes);
        all.copied().filter(|code| seen.insert(*code)).collect()
    }

    fn is_wanted(&self, selection: &Selection) -> bool {
        let is_here = selection.section.as_ref().is_none_or(|s| *s == section(self.kind));
        is_here && entities(self.kind, self.id).iter().any(|entity| selection.wants(*entity))
    }

    fn values(&self, made: &Made, channels: &[Channel], time: &[f64], sign: f64) -> Vec<f64> {
        let of = |code: &i32| &channels[self.channels[code]].values;
        let rate = |codes: &Vec<i32>| {
            let rates = codes.iter().map(|code| derivative(time, of(code)));
            let sum = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(b).map(|(a, b)| a + b).collect();
            rates.reduce(sum).unwrap_or_default()
        };
        match made {
            Made::Value(code) => of(code).clone(),
            Made::Rate(codes) => rate(codes).into_iter().map(|force| sign * force).collect(),
            Made::Size(axes) => {
                let [x, y, z] = axes.each_ref().map(rate);
                let of_state = |i: usize| (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).sqrt();
                (0..time.len()).map(of_state).collect()
            }
        }
    }
}

impl StateReader {
    pub(crate) fn new(header: &Header, selection: &Selection) -> Self {
        let wants_globals = selection.section.as_ref().is_none_or(|s| s == "glstat");
        let mut channels: Vec<Channel> = GLOBAL_COMPONENTS
            .iter()
            .enumerate()
            .take(header.globals)
            .filter(|(_, name)| wants_globals && selection.wants_component(name))
            .map(|(offset, _)| Channel { record: 1, offset, values: Vec::new() })
            .collect();
        let globals = channels.len();
        let mut objects = objects_of(header);
        for object in objects.iter_mut().filter(|object| object.is_wanted(selection)) {
            let wanted = object.components.iter().filter(|c| selection.wants_component(&c.name));
            for code in wanted.flat_map(|component| component.made.codes()) {
                let mut places = object.places.iter();
                let place = places.find_map(|&(group, k)| header.groups[group].place(k, code));
                let Some((record, offset)) = place else { continue };
                object.channels.entry(code).or_insert_with(|| {
                    channels.push(Channel { record, offset, values: Vec::new() });
                    channels.len() - 1
                });
            }
        }
        Self {
            time: Vec::new(),
            channels,
            globals,
            objects,
            lengths: header.lengths.clone(),
            starts: Vec::new(),
            not_finite: 0,
            part: 0,
            cut_after: Vec::new(),
            problems: Diagnostics::default(),
        }
    }

    /// Reads the states of a restart; false if it is not one of this run, which is said.
    pub(crate) fn read_restart(
        &mut self,
        header: &Header,
        own: Option<Header>,
        records: &mut Records<'_>,
    ) -> io::Result<bool> {
        self.part += 1;
        let title = |header: &Header| header.title.clone().unwrap_or_default();
        let what = match own {
            None => "is damaged".into(),
            Some(own)
                if own.title.is_some() && header.title.is_some() && own.title != header.title =>
            {
                format!(
                    "is of another run: its title is {:?}, not {:?}",
                    title(&own),
                    title(header)
                )
            }
            Some(own) if !own.is_like(header) => "holds other histories".into(),
            Some(_) => {
                let start = records.position();
                let first = records.next()?.map(|record| real(&record, 0));
                records.go_to(start)?;
                match (self.time.first(), first) {
                    (Some(first), Some(own)) if own <= *first => {
                        format!("begins at time {own:?}, where the run does: it is another run")
                    }
                    _ => {
                        self.read(header, records)?;
                        return Ok(true);
                    }
                }
            }
        };
        let message = format!("this continuation {what}: neither it nor what follows is read");
        let place = Some(Place::in_part(self.part, 0));
        self.problems.add(ProblemCode::UnreadRows, place, message);
        Ok(false)
    }

    fn stride(&self) -> u64 {
        self.lengths.iter().map(|&n| n as u64 + 2 * FRAME).sum()
    }

    /// Reads states until the end. One that is damaged is left out and reported; as all have the
    /// same length, the next one is found after it.
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
                self.cut_after.extend(self.time.last().filter(|_| damaged.is_some()));
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
        self.cut_after.extend(self.time.last().filter(|_| damaged.is_some()));
        self.leave_out(damaged, number + 1);
        self.look_for_zeros(header, &above, None);
        if self.not_finite > 0 {
            let message = format!(
                "{} values are not finite numbers; they are returned as such",
                self.not_finite
            );
            self.problems.add(ProblemCode::NotFinite, None, message);
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
        let place = Some(Place::in_part(self.part, byte));
        self.problems.add(ProblemCode::IncompleteState, place, message);
    }

    /// Names the last state above if more values next to each other are zero, though not in the
    /// states around it, than a node that stands on a wall has: T01 has no checksums.
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
                    "{} values of the state at time {:?}, {} to {}, are zero, but not in the states around it: was the file overwritten there?",
                    i - first,
                    self.time.last().copied().unwrap_or(f64::NAN),
                    self.name(header, k, first),
                    self.name(header, k, i - 1),
                );
                let place = self.starts.last().copied();
                self.problems.add(ProblemCode::SuspectZeros, place, message);
            }
        }
    }

    /// What the `word`-th value of a state's record is.
    fn name(&self, header: &Header, record: usize, word: usize) -> String {
        let group = header.groups.iter().find(|group| {
            let values = group.objects.len() * group.codes.len();
            group.record == record && (group.start..group.start + values).contains(&word)
        });
        let Some(group) = group else {
            let global = GLOBAL_COMPONENTS.get(word).filter(|_| record == 1 && header.globals > 0);
            return global.map_or(format!("value {}", word + 1), std::string::ToString::to_string);
        };
        let (at, width) = (word - group.start, group.codes.len().max(1));
        let id = group.objects.get(at / width).map_or(0, |(id, _)| *id);
        format!("{}[{id}]", variable(group.kind, group.codes[at % width]))
    }

    fn store(&mut self, state: &[Vec<u8>], start: u64) {
        let time = real(&state[0], 0);
        let place = Place::in_part(self.part, start);
        if !time.is_finite() {
            let message = format!("the state is left out: its time is {time:?}");
            self.problems.add(ProblemCode::IncompleteState, Some(place), message);
            return;
        }
        self.starts.push(place);
        self.time.push(time);
        for channel in &mut self.channels {
            let value = real(&state[channel.record], channel.offset);
            self.not_finite += usize::from(!value.is_finite());
            channel.values.push(value);
        }
    }

    /// Leaves out what a restart wrote again; forces are unknown across it.
    fn resolve_restarts(&mut self) {
        let place = |i: usize| self.starts.get(i).copied();
        let (mut kept, found) = resolve(&self.time, |_, _| Some(true), place, "");
        self.problems.append(found);
        // Nor can a state whose time is out of order be differentiated.
        let mut last = f64::NEG_INFINITY;
        kept.retain(|&i| {
            let rises = self.time[i] > last;
            if !rises {
                let at = self.time[i];
                let message = format!(
                    "the state at time {at:?} is left out: forces are rates of impulses, which need times that rise"
                );
                self.problems.add(ProblemCode::IncompleteState, self.starts.get(i).copied(), message);
            }
            last = last.max(self.time[i]);
            rises
        });
        if kept.len() == self.time.len() {
            return;
        }
        let keep = |values: &mut Vec<f64>| take(values, &kept);
        keep(&mut self.time);
        self.channels.iter_mut().for_each(|channel| keep(&mut channel.values));
    }

    pub(crate) fn finish(mut self, header: &Header, selection: &Selection) -> Vec<SolverFile> {
        self.resolve_restarts();
        let has_impulses =
            self.objects.iter().flat_map(|o| &*o.components).any(|c| c.made.is_rate());
        if self.time.len() == 1 && has_impulses {
            let message = "one state gives no rate of impulses: there are no forces";
            self.problems.add(ProblemCode::AbsentComponent, None, message.into());
        }
        let time: Arc<[f64]> = std::mem::take(&mut self.time).into();
        let mut files = self.sections(header, selection, &time);
        if header.globals > 0 {
            let mut file = empty("glstat");
            file.components =
                GLOBAL_COMPONENTS.iter().take(header.globals).map(|&c| c.into()).collect();
            let of = |c: Channel| history(None, GLOBAL_COMPONENTS[c.offset], c.values, &time);
            self.channels.truncate(self.globals);
            file.histories = std::mem::take(&mut self.channels).into_iter().map(of).collect();
            files.push(file);
        }
        files.retain(|f| selection.section.as_ref().is_none_or(|s| *s == f.section));
        let problems = self.problems.into_list();
        for file in &mut files {
            file.time = time.clone();
            file.solver = Some("OpenRadioss".into());
            file.version.clone_from(&header.solver);
            file.title.clone_from(&header.title);
            file.problems.splice(..0, problems.iter().cloned());
            if file.time.is_empty() {
                file.components.clear();
                file.histories.clear();
            }
        }
        files
    }

    /// One file for each section that the objects have.
    fn sections(
        &self,
        header: &Header,
        selection: &Selection,
        time: &Arc<[f64]>,
    ) -> Vec<SolverFile> {
        let mut files: Vec<SolverFile> = Vec::new();
        let mut known: HashSet<(i32, Arc<str>)> = HashSet::new();
        let mut normal_only: Vec<(usize, i64)> = Vec::new();
        for object in &self.objects {
            let name = section(object.kind);
            let at = files.iter().position(|f| f.section == name).unwrap_or_else(|| {
                files.push(empty(&name));
                files.len() - 1
            });
            if is_normal_only(object.kind, &object.codes(header)) {
                normal_only.push((at, object.id));
            }
            let file = &mut files[at];
            let made = || object.components.iter().filter(|c| time.len() > 1 || !c.made.is_rate());
            for component in made() {
                if known.insert((object.kind, component.name.clone())) {
                    file.components.push(component.name.clone());
                }
                if component.made.is_rate() && file.notes.is_empty() {
                    file.notes.push(DIFFERENTIATED.into());
                    let is_last = |at: &f64| time.last() == Some(at);
                    file.problems.extend(self.cut_after.iter().map(|at| cut(*at, is_last(at))));
                }
            }
            for entity in entities(object.kind, object.id) {
                file.entities.push(Entity { id: entity, title: object.title.clone() });
                if !(selection.wants(entity) && object.is_wanted(selection)) {
                    continue;
                }
                let wanted = made().filter(|c| selection.wants_component(&c.name));
                file.histories.extend(wanted.map(|c| self.history(object, entity, c, time)));
            }
        }
        for (file, ids) in normal_only.chunk_by(|a, b| a.0 == b.0).map(|of| (of[0].0, of)) {
            let ids: Vec<String> = ids.iter().take(5).map(|(_, id)| id.to_string()).collect();
            let more = if ids.len() == 5 { " and others" } else { "" };
            files[file].notes.push(format!(
                "no tangential impulses are recorded for {}{more}: their forces are the normal components only",
                ids.join(", ")
            ));
        }
        files
    }

    fn history(
        &self,
        object: &Object,
        entity: EntityId,
        component: &Component,
        time: &Arc<[f64]>,
    ) -> History {
        // SURFB feels the opposite of what T01 writes for the interface.
        let sign = if entity.side == Some(Side::SurfB) { -1.0 } else { 1.0 };
        let values = object.values(&component.made, &self.channels, time, sign);
        history(Some(entity), &component.name, values, time)
    }
}

/// What the end of a cut file means for forces.
fn cut(after: f64, is_last: bool) -> Problem {
    let message = match is_last {
        true => format!(
            "the record continues after time {after:?}: the forces there are differences over one interval, and will change"
        ),
        false => format!(
            "states after time {after:?} are missing: the forces on both sides are differences across the gap, so they are not those of their times"
        ),
    };
    Problem::new(ProblemCode::CutRecord, message)
}
