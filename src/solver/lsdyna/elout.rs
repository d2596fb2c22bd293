//! `elout` and `eloutdet`: stresses, strains and resultants of elements, and stresses and
//! strains of nodes.
//!
//! Seen with data: solids, beams, averages at nodes. Shells, thick shells and the details of
//! elements (at integration points, at nodes) are read as the source of LSTC's converter `l2a`
//! writes them. Components are named as in a binout; those of a second integration point end with
//! `_ip2`, and so on, those of details with `_point1` or `_node7`. Elements may erode: their values
//! are then NaN. Each kind of element has a block of its own in a state.
//!
//! Rows may come and go, because elements erode; missing values are NaN. Their number is limited, so that damage
//! that looks like erosion cannot fill the memory.

use super::ascii::{self, Body};
use super::label_values::Widths;
use super::line::{Line, integer, shown};
use crate::history::EntityId;
use crate::solver::format::Format;
use crate::solver::problem::{Place, ProblemCode};
use crate::solver::states::{StateReader, TableId};

const STRESS: &[u8] = b" e l e m e n t   s t r e s s   c a l c u l a t i o n s";
const STRAIN: &[u8] = b" e l e m e n t   s t r a i n   c a l c u l a t i o n s";
const BEAM: &[u8] = b" r e s u l t a n t s   a n d   s t r e s s e s";
const NODAL_STRESS: &[u8] = b" n o d a l  s t r e s s";
const NODAL_STRAIN: &[u8] = b" n o d a l  s t r a i n";
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

fn signature(line: &[u8]) -> bool {
    [STRESS, STRAIN, BEAM].iter().any(|heading| line.starts_with(heading))
}

/// Whether a line can only be in an `eloutdet`.
fn signature_of_details(line: &[u8]) -> bool {
    line.starts_with(NODAL_STRESS) || line.starts_with(NODAL_STRAIN)
}

pub(crate) const FORMAT: Format =
    Format::text("elout", "element", signature, ascii::read_default::<Elout>);

pub(crate) const DETAILS: Format =
    Format::text("eloutdet", "node", signature_of_details, ascii::read_default::<Elout>);

#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    Stress,
    Strain,
    Beam,
    NodalStress,
    NodalStrain,
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

#[derive(Default)]
struct Elout {
    tables: Vec<(Key, TableId)>,
    quantity: Option<Quantity>,
    cycle: Option<Vec<u8>>,
    /// Names of the numbers after the tensor, by the column lines.
    further: &'static [&'static str],
    entity: Option<EntityId>,
    /// Inside a beam's stresses at its integration points.
    at_points: bool,
    /// After a heading: a row that the state already has is the first of the next one.
    begins: bool,
    unread: Option<Place>,
    widths: Widths,
}

impl Body for Elout {
    fn is_signature(&self, line: &[u8]) -> bool {
        signature(line) || signature_of_details(line)
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        states.allow_empty_states();
        if line.is_blank() {
            return;
        }
        if self.heading(line, states) || self.column_line(line) {
            return;
        }
        let read = match self.quantity {
            Some(Quantity::Beam) => self.beam(line, states),
            Some(_) => self.tensor(line, states),
            None => None,
        };
        if read.is_none() {
            let found = shown(line.columns(1, 40));
            let message =
                format!("expected an element or its values, found \"{}\"", found.trim_end());
            states.damage(line, None, message);
        }
    }

    fn interrupt(&mut self) {
        self.entity = None;
    }

    fn end(&mut self, _: Place, states: &mut StateReader<'_>) {
        if self.unread.is_some() {
            let message = "rows of muscle data are not read".into();
            states.problems.add(ProblemCode::UnreadRows, self.unread, None, message);
        }
    }
}

impl Elout {
    /// Whether the line begins a block; begins its state if it is a new one.
    fn heading(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> bool {
        let quantities = [
            (STRESS, Quantity::Stress),
            (STRAIN, Quantity::Strain),
            (BEAM, Quantity::Beam),
            (NODAL_STRESS, Quantity::NodalStress),
            (NODAL_STRAIN, Quantity::NodalStrain),
        ];
        let found = quantities.iter().find(|(heading, _)| line.text.starts_with(heading));
        let Some(&(_, quantity)) = found else { return false };
        self.further = &[];
        self.entity = None;
        let step = memchr::memmem::find(line.text, b"s t e p").map(|at| at + 7);
        let to = memchr::memmem::find(line.text, b"( at time");
        let cycle = step.zip(to).and_then(|(from, to)| line.text.get(from..to));
        let text = super::at_time(line.text).filter(|_| line.is_heading());
        let time = text.and_then(|text| {
            super::printed_time(text, super::TIME, &mut self.widths, line, states)
        });
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
        true
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
    fn table(
        &mut self,
        key: Key,
        states: &mut StateReader<'_>,
        names: impl FnOnce() -> Vec<String>,
    ) -> Option<TableId> {
        if let Some((_, table)) = self.tables.iter().find(|(known, _)| *known == key) {
            return Some(*table);
        }
        if self.tables.len() >= MAX_TABLES {
            return None;
        }
        let names = names();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let table = states.varying_table("elements", &names);
        self.tables.push((key, table));
        Some(table)
    }

    fn beam(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        if let Some(rest) = text.strip_prefix(b" beam/truss # =") {
            let digits = rest.trim_ascii_start();
            let end = digits.iter().position(|b| !b.is_ascii_digit())?;
            if !line.is_heading() {
                return None;
            }
            self.entity = Some(EntityId::new(integer(&digits[..end])?));
            self.at_points = false;
            return Some(());
        }
        let (entity, quantity) = (self.entity?, Quantity::Beam);
        if !self.at_points {
            let numbers = text.len().checked_sub(RESULTANT_AT)? / RESULTANT_WIDTH;
            let whole = text.len() == RESULTANT_AT + numbers * RESULTANT_WIDTH;
            if !(whole && (6..=7).contains(&numbers)) {
                return None;
            }
            let names = &RESULTANTS[..numbers];
            let key = Key { quantity, point: 0, surface: "", location: None, names };
            let table = self.table(key, states, || {
                names.iter().map(std::string::ToString::to_string).collect()
            })?;
            self.row(table, entity, line, states, |k| {
                let from = RESULTANT_AT + k * RESULTANT_WIDTH;
                (from + 1, from + RESULTANT_WIDTH)
            });
            return Some(());
        }
        let point = integer(text.get(..BEAM_STRESS_AT)?)?;
        let width = BEAM_STRESS_AT + BEAM_STRESSES.len() * BEAM_STRESS_WIDTH;
        if text.len() != width {
            return None;
        }
        let key = Key { quantity, point, surface: "", location: None, names: &BEAM_STRESSES };
        let table = self.table(key, states, || {
            BEAM_STRESSES.iter().map(|n| format!("{n}{}", suffix(point))).collect()
        })?;
        self.row(table, entity, line, states, |k| {
            let from = BEAM_STRESS_AT + k * BEAM_STRESS_WIDTH;
            (from + 1, from + BEAM_STRESS_WIDTH)
        });
        Some(())
    }

    /// An element's or node's line, or one of its tensors.
    fn tensor(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        if text.len() < LABEL + WIDTH {
            // "id-part" of an element, "id-" of a node.
            let dash = memchr::memchr(b'-', text)?;
            let part = &text[dash + 1..];
            if !(part.is_empty() || integer(part).is_some()) {
                return None;
            }
            self.entity = Some(EntityId::new(integer(&text[..dash])?));
            return Some(());
        }
        let entity = self.entity?;
        let quantity = self.quantity?;
        let nodal = matches!(quantity, Quantity::NodalStress | Quantity::NodalStrain);
        let label = text.get(..LABEL)?;
        let (numbers, location) = location(text)?;
        // Details of solids, and those at nodes, have no integration point but their location.
        let (point, surface) = place(label)
            .or_else(|| location.and(label[..POINT].trim_ascii().is_empty().then_some((1, ""))))
            .filter(|_| !label.contains(&b'*'))?;
        let further: &'static [&'static str] = match quantity {
            Quantity::Stress => self.further,
            Quantity::NodalStress => &["yield"],
            _ => &[],
        };
        let wide = if nodal { WIDTH } else { WIDE };
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
            let tensor = TENSOR.iter().map(|axes| format!("{surface}{kind}_{axes}{tail}"));
            tensor.chain(further.iter().map(|name| format!("{surface}{name}{tail}"))).collect()
        })?;
        self.row(table, entity, line, states, |k| {
            let (from, width) = match k.checked_sub(TENSOR.len()) {
                None => (LABEL + k * WIDTH, WIDTH),
                Some(k) => (tensor_end + k * wide, wide),
            };
            (from + 1, from + width)
        });
        Some(())
    }
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
