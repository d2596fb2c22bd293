//! `elout` and `eloutdet`: stresses, strains and resultants of elements, and stresses and
//! strains of nodes.
//!
//! Seen with data: solids, beams, averages at nodes. Shells, thick shells and the details of
//! elements (at integration points, at nodes) are read as the source of LSTC's converter `l2a`
//! writes them. Components are named as in a binout; those of a second integration point end with
//! `_ip2`, and so on, those of details with `_point1` or `_node7`. Each kind of element has
//! a block of its own in a state.
//!
//! Rows may come and go, because elements erode; missing values are NaN. Their number is limited, so that damage
//! that looks like erosion cannot fill the memory.

use super::ascii::{Body, boxed};
use super::line::{Line, integer};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::problem::{Place, ProblemCode};
use crate::solver::states::repeat::Part;
use crate::solver::states::{KeyedTables, StateReader, TableId};

/// Headings of blocks; the last two are in an `eloutdet` only.
const HEADINGS: [(&[u8], Quantity); 5] = [
    (b" e l e m e n t   s t r e s s   c a l c u l a t i o n s", Quantity::Stress),
    (b" e l e m e n t   s t r a i n   c a l c u l a t i o n s", Quantity::Strain),
    (b" r e s u l t a n t s   a n d   s t r e s s e s", Quantity::Beam),
    (b" n o d a l  s t r e s s", Quantity::NodalStress),
    (b" n o d a l  s t r a i n", Quantity::NodalStrain),
];
const TENSOR: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "zx"];
/// After 17 columns with integration point, surface and state: six numbers of 12, then
/// further ones of 14, at nodes of 12.
const LABEL: usize = 17;
const POINT: usize = 9;
const WIDTH: usize = 12;
const WIDE: usize = 14;
/// Beams: resultants of 11 after 11 columns; stresses of 15 after 16.
static RESULTANTS: [&str; 7] =
    ["axial", "shear_s", "shear_t", "moment_s", "moment_t", "torsion", "pl_eps"];
const RESULTANT_AT: usize = 11;
const RESULTANT_WIDTH: usize = 11;
static BEAM_STRESSES: [&str; 4] = ["sigma_11", "sigma_12", "sigma_31", "plastic_eps"];
const BEAM_STRESS_AT: usize = 16;
const BEAM_STRESS_WIDTH: usize = 15;
/// Combinations of quantity, point and surface in one file; more are damage.
const MAX_TABLES: usize = 1_000;

/// The quantity whose block a line begins.
fn heading(line: &[u8]) -> Option<Quantity> {
    HEADINGS.iter().find(|(heading, _)| line.starts_with(heading)).map(|(_, quantity)| *quantity)
}

pub(crate) const FORMAT: Format = Format::text("elout", "element", boxed::<Elout>, |line| {
    heading(line).is_some_and(|quantity| !quantity.is_nodal())
});

pub(crate) const DETAILS: Format = Format::text("eloutdet", "node", boxed::<Elout>, |line| {
    heading(line).is_some_and(Quantity::is_nodal)
});

#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    Stress,
    Strain,
    Beam,
    NodalStress,
    NodalStrain,
}

impl Quantity {
    fn is_nodal(self) -> bool {
        matches!(self, Self::NodalStress | Self::NodalStrain)
    }
}

/// What distinguishes the kinds of rows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    quantity: Quantity,
    point: i64,
    surface: &'static str,
    /// "point" or "node" and its number, for details.
    location: Option<Location>,
    /// Names of the numbers after the tensor; of a beam of all numbers.
    names: &'static [&'static str],
}

#[derive(Clone, Default)]
struct Elout {
    tables: KeyedTables<Key>,
    quantity: Option<Quantity>,
    cycle: Option<Vec<u8>>,
    /// Names of the numbers after the tensor, by the column lines.
    further: &'static [&'static str],
    /// Inside a beam's stresses at its integration points.
    at_points: bool,
    /// After a heading: a row that the state already has is the first of the next one.
    begins: bool,
    unread: Option<Place>,
}

impl Body for Elout {
    fn has_empty_states(&self) -> bool {
        true
    }

    fn is_by_time(&self) -> bool {
        true
    }

    fn expected(&self) -> &'static str {
        "an element or its values"
    }

    fn is_signature(&self, line: &[u8]) -> bool {
        heading(line).is_some()
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if let Some(quantity) = heading(line.text) {
            self.block(quantity, line, states);
        } else if !self.column_line(line) {
            match self.quantity? {
                Quantity::Beam => self.beam(line, states)?,
                quantity => self.tensor(quantity, line, states)?,
            }
        }
        Some(())
    }

    fn continue_cycle(&mut self, cycle: &[u8]) {
        self.cycle = Some(cycle.to_vec());
    }

    fn end(&mut self, states: &mut StateReader<'_>) {
        if self.unread.is_some() {
            let message = "rows of muscle data are not read".into();
            states.problems.add(ProblemCode::UnreadRows, self.unread, message);
        }
    }
}

impl Elout {
    /// Begins a block, and its state if that is a new one.
    fn block(&mut self, quantity: Quantity, line: &Line<'_>, states: &mut StateReader<'_>) {
        self.further = &[];
        states.entity = None;
        let step = memchr::memmem::find(line.text, b"s t e p").map(|at| at + 7);
        let to = memchr::memmem::find(line.text, b"( at time");
        let cycle = step.zip(to).and_then(|(from, to)| line.text.get(from..to));
        let text = super::at_time(line.text).filter(|_| line.is_heading());
        let time = super::heading_time(text, super::TIME, line, states);
        states.part(line, cycle.unwrap_or_default(), Part::Cycle);
        self.quantity = Some(quantity);
        self.begins = true;
        let is_same = states.is_pending()
            && time.is_some()
            && states.pending_time() == time
            && self.cycle.as_deref() == cycle;
        if time.is_some() && !is_same {
            self.cycle = cycle.map(<[u8]>::to_vec);
            self.begin(time, line, states);
        }
        if time.is_none() {
            self.quantity = None;
            states.damage(line, None, "expected a cycle number and \"( at time … )\"".into());
        }
    }

    fn begin(&self, time: Option<f64>, line: &Line<'_>, states: &mut StateReader<'_>) {
        states.begin(time, line.into());
        if let Some(cycle) = self.cycle.as_deref().and_then(integer) {
            states.set_cycle(cycle);
        }
    }

    /// One row; the first after a heading begins a state where the one above has it already. After
    /// damage that state's own heading, with its time, may be what was lost.
    fn row(
        &mut self,
        table: TableId,
        entity: EntityId,
        line: &Line<'_>,
        states: &mut StateReader<'_>,
        field: impl Fn(usize) -> (usize, usize),
    ) {
        if std::mem::take(&mut self.begins) && states.has_row(table, entity) {
            let time = states.pending_time().filter(|_| !states.is_damaged());
            self.begin(time, line, states);
        }
        states.row(table, entity, line, |k| Some(field(k)));
    }

    /// Whether the line names columns; notes those after the tensor.
    fn column_line(&mut self, line: &Line<'_>) -> bool {
        let text = line.text.trim_ascii_start();
        let has = |word: &[u8]| memchr::memmem::find(text, word).is_some();
        if has(b"sig-xx") && line.is_heading() {
            self.further = match () {
                () if has(b"plastic") => &["plastic_strain"],
                () => &["effsg", "yield"],
            };
        }
        // The strains of shells are below the heading of their stresses.
        let is_new = match self.quantity {
            Some(Quantity::Stress) if has(b"eps-xx") => Some(Quantity::Strain),
            Some(Quantity::Strain) if has(b"sig-xx") => Some(Quantity::Stress),
            _ => None,
        };
        if let Some(quantity) = is_new.filter(|_| line.is_heading()) {
            self.quantity = Some(quantity);
            self.begins = true;
        }
        const STARTS: [&[u8]; 12] = [
            b"element ",
            b"ipt",
            b"num/ipt",
            b"state",
            b"node (",
            b"stress ",
            b"strain",
            b"resultants",
            b"integration point stresses",
            b"sigma 11",
            b"muscle data",
            b"strains (",
        ];
        let is_column_line =
            line.is_heading() && STARTS.iter().any(|start| text.starts_with(start));
        if is_column_line && text.starts_with(b"integration") {
            self.at_points = true;
        }
        if is_column_line && text.starts_with(b"muscle") {
            self.unread.get_or_insert(line.into());
        }
        is_column_line
    }

    /// The table of a kind of row; `names` gives its components when it is a new one.
    fn table<N: Iterator<Item = String>>(
        &mut self,
        key: Key,
        states: &mut StateReader<'_>,
        names: impl FnOnce() -> N,
    ) -> Option<TableId> {
        self.tables.get(key, MAX_TABLES, |_| states.varying_table("elements", names()))
    }

    fn beam(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        if let Some(rest) = text.strip_prefix(b" beam/truss # =") {
            let digits = rest.trim_ascii_start();
            let end = digits.iter().position(|b| !b.is_ascii_digit())?;
            if !line.is_heading() {
                return None;
            }
            states.entity = Some(EntityId::new(integer(&digits[..end])?));
            self.at_points = false;
            return Some(());
        }
        let (entity, quantity) = (states.entity?, Quantity::Beam);
        if !self.at_points {
            let numbers = text.len().checked_sub(RESULTANT_AT)? / RESULTANT_WIDTH;
            let whole = text.len() == RESULTANT_AT + numbers * RESULTANT_WIDTH;
            if !(whole && (6..=7).contains(&numbers)) {
                return None;
            }
            let names = &RESULTANTS[..numbers];
            let key = Key { quantity, point: 0, surface: "", location: None, names };
            let table = self.table(key, states, || names.iter().map(ToString::to_string))?;
            self.row(table, entity, line, states, |k| column(RESULTANT_AT, k, RESULTANT_WIDTH));
            return Some(());
        }
        let point = integer(text.get(..BEAM_STRESS_AT)?)?;
        let width = BEAM_STRESS_AT + BEAM_STRESSES.len() * BEAM_STRESS_WIDTH;
        if text.len() != width {
            return None;
        }
        let key = Key { quantity, point, surface: "", location: None, names: &BEAM_STRESSES };
        let table = self
            .table(key, states, || BEAM_STRESSES.iter().map(|n| format!("{n}{}", suffix(point))))?;
        self.row(table, entity, line, states, |k| column(BEAM_STRESS_AT, k, BEAM_STRESS_WIDTH));
        Some(())
    }

    /// An element's or node's line, or one of its tensors.
    fn tensor(
        &mut self,
        quantity: Quantity,
        line: &Line<'_>,
        states: &mut StateReader<'_>,
    ) -> Option<()> {
        let text = line.text.trim_ascii_end();
        if text.len() < LABEL + WIDTH {
            // "id-part" of an element, "id-" of a node.
            let dash = memchr::memchr(b'-', text)?;
            let part = &text[dash + 1..];
            if !(part.is_empty() || integer(part).is_some()) {
                return None;
            }
            states.entity = Some(EntityId::new(integer(&text[..dash])?));
            return Some(());
        }
        let entity = states.entity?;
        let label = text.get(..LABEL)?;
        let (numbers, location) = location(text)?;
        // Details of solids, and those at nodes, have no integration point but their location.
        let (point, surface) = place(label)
            .or_else(|| location.and(label[..POINT].trim_ascii().is_empty().then_some((1, ""))))
            .filter(|_| !label.contains(&b'*'))?;
        // The state of the material, such as plastic.
        let words = label.iter().position(u8::is_ascii_digit).unwrap_or(LABEL);
        let words = words + label[words..].iter().take_while(|b| b.is_ascii_digit()).count();
        let is_point = label[..words].trim_ascii_start().first().is_some_and(u8::is_ascii_digit);
        states.part(line, if is_point { &label[words..] } else { &[] }, Part::Unread);
        let further: &'static [&'static str] = match quantity {
            Quantity::Stress => self.further,
            Quantity::NodalStress => &["yield"],
            _ => &[],
        };
        let wide = if quantity.is_nodal() { WIDTH } else { WIDE };
        let tensor_end = LABEL + TENSOR.len() * WIDTH;
        let more = numbers.len().checked_sub(tensor_end)? / wide;
        // Thick shells have no effective stress.
        let further = match (further, more) {
            (["effsg", last], 1) => std::slice::from_ref(last),
            (all, more) if all.len() == more => all,
            _ => return None,
        };
        if numbers.len() != tensor_end + further.len() * wide {
            return None;
        }
        let key = Key { quantity, point, surface, location, names: further };
        let table = self.table(key, states, || {
            let kind = match quantity {
                Quantity::Stress | Quantity::NodalStress => "sig",
                _ => "eps",
            };
            let place = location.map_or(String::new(), |(what, number)| format!("_{what}{number}"));
            let tail = format!("{}{place}", suffix(point));
            let axes = TENSOR.iter().map(move |axes| format!("{kind}_{axes}"));
            let names = axes.chain(further.iter().map(ToString::to_string));
            names.map(move |name| format!("{surface}{name}{tail}"))
        })?;
        self.row(table, entity, line, states, |k| match k.checked_sub(TENSOR.len()) {
            None => column(LABEL, k, WIDTH),
            Some(k) => column(tensor_end, k, wide),
        });
        Some(())
    }
}

/// First and last column of the `k`-th number of a width after the column `from`.
fn column(from: usize, k: usize, width: usize) -> (usize, usize) {
    (from + k * width + 1, from + (k + 1) * width)
}

/// Which point or node of its element a row is of, in files of details.
type Location = (&'static str, i64);

/// A row without the place of its point, with which rows of details end, and that place.
fn location(text: &[u8]) -> Option<(&[u8], Option<Location>)> {
    let found = [b"int. point".as_slice(), b"node"]
        .iter()
        .find_map(|word| memchr::memmem::rfind(text, word).map(|at| (at, word.len())));
    Some(match found.filter(|(at, _)| *at > LABEL) {
        Some((at, length)) => {
            let number = integer(&text[at + length..])?;
            let what = if text[at] == b'i' { "point" } else { "node" };
            (text[..at].trim_ascii_end(), Some((what, number)))
        }
        None => (text, None),
    })
}

/// Integration point and surface in the first columns of a row.
fn place(label: &[u8]) -> Option<(i64, &'static str)> {
    let text = label.trim_ascii_start();
    // The middle of a shell is what a binout calls its lower surface.
    let surfaces = [(b"lower".as_slice(), "lower_"), (b"mid.", "lower_"), (b"upper", "upper_")];
    if let Some((_, name)) = surfaces.iter().find(|(word, _)| text.starts_with(word)) {
        return Some((1, name));
    }
    let digits = text.iter().position(|b| !b.is_ascii_digit()).unwrap_or(text.len());
    Some((integer(&text[..digits])?, ""))
}

/// What the components of an integration point end with.
fn suffix(point: i64) -> String {
    if point == 1 { String::new() } else { format!("_ip{point}") }
}
