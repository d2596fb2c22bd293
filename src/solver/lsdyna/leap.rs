//! Reading by layout: states that repeat the layout of one that was read line by line are verified and read at
//! once, on all threads.
//!
//! A state and the lines after it up to the next one are a unit of the file. Once the line reader has read one, its
//! lines are read a second time to note their parts ([`StateReader::learner`]). At the first unit that does not fit,
//! the line reader goes on as if it had read all those before it, so that damage is found and reported as it would be
//! without. `tests/stride.rs` compares both ways on intact and on damaged files.

use std::io;

use rayon::prelude::*;

use super::ascii::{AsciiReader, Body};
use super::label_values::Widths;
use super::layout::{DENSE_READ, Found, Layout, MAX_STATE, Plan};
use crate::solver::problem::Place;
use crate::solver::source::{Source, Window, fill_at};
use crate::solver::states::StateReader;
use crate::solver::states::repeat::{Repeated, Shape};

/// Values and bytes of the states that are read before they are handed on.
const BATCH_VALUES: usize = 1 << 20;
const BATCH_BYTES: usize = 1 << 24;
/// States of other layouts after which none is learnt for a while.
const MAX_PAUSE: usize = 1 << 10;

/// What is known of the states of a file.
#[derive(Default)]
pub(crate) struct Leaps {
    learnt: Option<Learnt>,
    /// Where the pending state begins, and how many states were kept before it.
    begun: Option<Place>,
    kept: usize,
    /// States that are read line by line until the next attempt, and after an attempt that fails.
    wait: usize,
    pause: usize,
}

/// A layout, and what the line reader is like after a state of it.
pub(crate) struct Learnt {
    pub layout: Layout,
    pub shape: Shape,
    pub widths: Widths,
    pub body: Box<dyn Body>,
}

impl Leaps {
    /// Where the state above and a new one begin, if the last line began one after a complete one.
    pub(crate) fn between(&mut self, states: &StateReader<'_>) -> Option<(Option<Place>, Place)> {
        let begun = states.begun();
        if begun == self.begun {
            return None;
        }
        let above = std::mem::replace(&mut self.begun, begun);
        let kept = std::mem::replace(&mut self.kept, states.kept());
        Some((above.filter(|_| states.kept() == kept + 1), begun?))
    }

    /// Offered after every line: goes on after the states that are read at once.
    pub(crate) fn leap(
        &mut self,
        frame: &mut AsciiReader<'_>,
        body: &mut Box<dyn Body>,
    ) -> io::Result<()> {
        let Some((above, at)) = self.between(&frame.states) else { return Ok(()) };
        self.wait = self.wait.saturating_sub(1);
        for known in [true, false] {
            if !known {
                let Some(above) = above.filter(|_| self.wait == 0) else { break };
                self.learnt = frame.learn(&**body, above, at)?;
                self.pause = (2 * self.pause + 1).min(MAX_PAUSE);
                self.wait = self.pause;
            }
            let Some(learnt) = &self.learnt else { continue };
            if let Some(end) = learnt.leap(frame.source, at, &mut frame.states)? {
                *body = learnt.body.copied();
                if let Some(cycle) = learnt.layout.cycle() {
                    let mut text = vec![0; cycle.len()];
                    let last = end.byte - learnt.layout.period();
                    fill_at(frame.source, last + cycle.start as u64, &mut text)?;
                    body.continue_cycle(&text);
                }
                frame.lines.go_to(end);
                (self.begun, self.kept) = (frame.states.begun(), frame.states.kept());
                (self.wait, self.pause) = (0, 0);
                break;
            }
        }
        Ok(())
    }
}

impl AsciiReader<'_> {
    /// The layout of the state between two places, which was kept.
    pub(crate) fn learn(
        &self,
        body: &dyn Body,
        from: Place,
        to: Place,
    ) -> io::Result<Option<Learnt>> {
        let length = to.byte.saturating_sub(from.byte);
        if length == 0 || length > MAX_STATE {
            return Ok(None);
        }
        let mut bytes = vec![0; length as usize];
        if fill_at(self.source, from.byte, &mut bytes)? < bytes.len() {
            return Ok(None);
        }
        let mut body = body.copied();
        let mut again = AsciiReader::new(self.format, &*body, self.source, self.states.selection);
        again.states = self.states.learner();
        again.lines.go_to(from);
        while again.lines.place().byte < to.byte && again.step(&mut *body)? {}
        let Some(shape) = self.states.learnt(&again.states) else { return Ok(None) };
        let trace = again.states.trace.take().unwrap_or_default();
        let layout = Layout::new(bytes, from.byte, &trace.zones, |part| again.states.channel(part));
        let widths = again.states.take_widths();
        Ok(layout.map(|layout| Learnt { layout, shape, widths, body }))
    }
}

impl Learnt {
    /// Reads the states from `start` on as long as they repeat the layout, of which the last one stays pending; the place
    /// after them, or `None` if there is none.
    fn leap(
        &self,
        source: &dyn Source,
        start: Place,
        states: &mut StateReader<'_>,
    ) -> io::Result<Option<Place>> {
        if !states.keeps(&self.shape) {
            return Ok(None);
        }
        let layout = &self.layout;
        let size = source.size()?;
        let audit = states.selection.audit;
        let plan = if self.body.may_skip() && !audit { layout.some() } else { layout.all(audit) };
        let width = states.channels();
        let period = layout.period() as usize;
        let largest = (BATCH_VALUES / width.max(1)).min(BATCH_BYTES / period).max(2);
        // Grows while states are read without surprise, so that little work is lost at one.
        let mut batch = 1;
        let mut place = start;
        let mut above = states.last();
        let mut pending: Option<(Repeated, Vec<f64>)> = None;
        loop {
            let count = layout.count(size, place.byte).min(batch);
            let (found, values) = read(source, layout, &plan, place.byte, count, width)?;
            let mut repeated: Vec<Repeated> = Vec::with_capacity(found.len());
            for (k, found) in (0..).zip(found) {
                // Where a line's time alone begins a state, an equal one does not.
                if self.body.is_by_time() && above == Some(found) {
                    break;
                }
                above = Some(found);
                let place = self.place(place, k);
                repeated.push(Repeated { time: found.0, cycle: found.1, place });
            }
            let read = repeated.len();
            if read > 0 {
                if pending.is_none() {
                    states.forget_pending();
                    states.set_widths(&self.widths);
                }
                let waiting: Vec<(Repeated, Vec<f64>)> = pending.take().into_iter().collect();
                for (state, values) in &waiting {
                    states.extend(&self.shape, &[*state], values);
                }
                let last =
                    repeated.pop().zip(Some(values[(read - 1) * width..read * width].to_vec()));
                states.extend(&self.shape, &repeated, &values);
                pending = last;
                place = self.place(place, read as u64);
            }
            if read < batch {
                break;
            }
            batch = (2 * batch).min(largest);
        }
        let Some((last, values)) = pending else { return Ok(None) };
        states.pend(&self.shape, last, &values);
        Ok(Some(place))
    }

    /// Beginning of the `k`-th state after the one at `place`.
    fn place(&self, place: Place, k: u64) -> Place {
        let (line, byte) = (self.layout.lines(), self.layout.period());
        Place { line: place.line + k * line, byte: place.byte + k * byte, ..place }
    }
}

/// Times and values of up to `count` states from byte `at` on, up to the first that is laid out in another way.
pub(crate) fn read(
    source: &dyn Source,
    layout: &Layout,
    plan: &Plan,
    at: u64,
    count: usize,
    width: usize,
) -> io::Result<(Vec<Found>, Vec<f64>)> {
    let size = source.size()?;
    let together = (DENSE_READ / layout.period() as usize).max(1);
    let groups: Vec<(Vec<Found>, Vec<f64>)> = (0..count.div_ceil(together))
        .into_par_iter()
        .map_init(
            || Window::new(source),
            |window, group| {
                let first = group * together;
                let states = first..count.min(first + together);
                let mut values = vec![f64::NAN; states.len() * width];
                let mut found = Vec::with_capacity(states.len());
                for (k, state) in states.enumerate() {
                    let at = at + state as u64 * layout.period();
                    let out = &mut values[k * width..(k + 1) * width];
                    match layout.state(window, (at, size), plan, out)? {
                        Some(state) => found.push(state),
                        None => break,
                    }
                }
                Ok((found, values))
            },
        )
        .collect::<io::Result<_>>()?;
    let (mut found, mut values) = (Vec::new(), Vec::new());
    for (k, (states, read)) in groups.into_iter().enumerate() {
        let is_whole = states.len() == together.min(count - k * together);
        found.extend(states);
        values.extend(read);
        if !is_whole {
            break;
        }
    }
    Ok((found, values))
}
