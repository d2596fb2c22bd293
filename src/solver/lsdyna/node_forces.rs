//! Forces and energies of nodes or rigid bodies with their sum, as `bndout` and `nodfor`
//! print them: `nd#  200034  xforce=… yforce=… zforce=… energy=…`, then `xtotal=…`.

use super::ascii::Body;
use super::label_values::{Labelled, Widths, components, fields, labelled};
use super::line::{Line, integer, shown};
use crate::history::EntityId;
use crate::solver::problem::ProblemCode;
use crate::solver::states::{StateReader, TableId};

const WIDTH: usize = 13;
/// Marks of a row: a node, or a rigid body.
const MARKS: [&[u8]; 4] = [b"nd#", b"mat#", b"mt#", b"rb#"];
const ID: &[u8] = b"xforce=";

const ROW: [Labelled; 7] = [
    labelled("x_force", "xforce=", WIDTH),
    labelled("y_force", "yforce=", WIDTH),
    labelled("z_force", "zforce=", WIDTH),
    labelled("energy", "energy=", WIDTH),
    labelled("xmoment", "xmoment=", WIDTH),
    labelled("ymoment", "ymoment=", WIDTH),
    labelled("zmoment", "zmoment=", WIDTH),
];
/// Moments of a rigid body, on a line of their own.
const MOMENTS: [Labelled; 3] = [
    labelled("xmoment", "xmoment=", WIDTH),
    labelled("ymoment", "ymoment=", WIDTH),
    labelled("zmoment", "zmoment=", WIDTH),
];
const TOTALS: [Labelled; 7] = [
    labelled("x_total", "xtotal=", WIDTH),
    labelled("y_total", "ytotal=", WIDTH),
    labelled("z_total", "ztotal=", WIDTH),
    labelled("etotal", "etotal=", WIDTH),
    labelled("x_local", "xlocal=", WIDTH),
    labelled("y_local", "ylocal=", WIDTH),
    labelled("z_local", "zlocal=", WIDTH),
];
/// Groups or kinds of boundary condition of one file; more are damage.
const MAX_BLOCKS: usize = 200;

/// What the two files differ in.
pub(crate) struct Layout {
    /// Digits of the time.
    pub time_digits: i32,
    /// Begins a state; the time is after `t=`.
    pub state: &'static [u8],
    /// Name of the block that a heading begins, such as a group; `None` for other lines.
    pub block: fn(&[u8]) -> Option<String>,
}

/// Reader of either file. Components of all blocks but the first of the file have the
/// block's name in front, because the same node may be in several.
pub(crate) struct NodeForces {
    layout: &'static Layout,
    blocks: Vec<Block>,
    current: Option<usize>,
    body: Option<i64>,
    /// After a heading: a row that the state already has is the first of the next one.
    begins: bool,
    widths: Widths,
}

struct Block {
    name: String,
    tables: Option<[TableId; 2]>,
}

impl NodeForces {
    pub(crate) fn new(layout: &'static Layout) -> Self {
        let widths = Widths::default();
        Self { layout, blocks: Vec::new(), current: None, body: None, begins: false, widths }
    }

    /// What the names of the block's components begin with.
    fn prefix(&self, block: usize) -> String {
        match block {
            0 => String::new(),
            k => format!("{}_", self.blocks[k].name),
        }
    }

    fn enter(&mut self, name: String, line: &Line<'_>, states: &mut StateReader<'_>) {
        let known = self.blocks.iter().position(|b| b.name == name);
        if known.is_none() && self.blocks.len() == MAX_BLOCKS {
            let message = format!("\"{name}\" is left out: there are too many groups");
            states.problems.add(ProblemCode::UnreadRows, Some(line.into()), None, message);
            states.mark_damaged();
            return;
        }
        self.current = Some(known.unwrap_or_else(|| {
            self.blocks.push(Block { name, tables: None });
            self.blocks.len() - 1
        }));
    }

    /// The tables of the current block; `None` where its heading is missing.
    fn tables(&mut self, states: &mut StateReader<'_>) -> Option<[TableId; 2]> {
        let current = self.current?;
        let prefix = self.prefix(current);
        let tables = *self.blocks[current].tables.get_or_insert_with(|| {
            let table = |states: &mut StateReader<'_>, what, names: &[&str]| {
                let names: Vec<String> = names.iter().map(|n| format!("{prefix}{n}")).collect();
                states.table(what, &names.iter().map(String::as_str).collect::<Vec<_>>())
            };
            [
                table(states, "forces", &components(&ROW)),
                table(states, "moments", &components(&MOMENTS)),
            ]
        });
        Some(tables)
    }

    fn row(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text;
        let from = memchr::memchr(b'#', text)? + 1;
        let to = memchr::memmem::find(text, ID)?;
        let id = integer(text.get(from..to)?)?;
        let fields = fields(line, &ROW, &mut self.widths, states)?;
        if fields[..4].iter().any(Option::is_none) {
            return None;
        }
        let [table, _] = self.tables(states)?;
        self.body = Some(id);
        let entity = EntityId::new(id);
        if std::mem::take(&mut self.begins) && states.has_row(table, entity) {
            states.begin(states.pending_time(), line.into());
        }
        states.row(table, entity, line, |k| fields[k]);
        Some(())
    }

    fn moments(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let fields = fields(line, &MOMENTS, &mut self.widths, states)?;
        let id = self.body?;
        if fields.iter().any(Option::is_none) {
            return None;
        }
        let [_, table] = self.tables(states)?;
        states.row(table, EntityId::new(id), line, |k| fields[k]);
        Some(())
    }

    fn totals(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let fields = fields(line, &TOTALS, &mut self.widths, states)?;
        let prefix = self.prefix(self.current?);
        for (label, field) in TOTALS.iter().zip(fields) {
            let Some((from, to)) = field else { continue };
            let name = format!("{prefix}{}", label.component);
            states.scalar(&name, line.columns(from, to), line, [from, to]);
        }
        Some(())
    }
}

impl Body for NodeForces {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        let text = line.text;
        let start = text.trim_ascii_start();
        if line.is_blank() {
            return;
        }
        let done = if text.starts_with(self.layout.state) {
            self.current = None;
            self.begins = true;
            states.set_time_digits(self.layout.time_digits);
            let at = memchr::memmem::find(text, b"t=").map(|at| at + 2);
            let time = at.and_then(|at| {
                super::printed_time(&text[at..], super::TIME, &mut self.widths, line, states)
            });
            match time {
                // Every kind of boundary condition has a heading of its own at one time.
                Some(time) => {
                    if states.pending_time() != Some(time) {
                        states.begin(Some(time), line.into());
                    }
                    Some(())
                }
                _ => {
                    states.begin(None, line.into());
                    None
                }
            }
        } else if MARKS.iter().any(|mark| start.starts_with(mark)) {
            self.row(line, states)
        } else if start.starts_with(b"xtotal=") || start.starts_with(b"xlocal=") {
            self.totals(line, states)
        } else if start.starts_with(b"xmoment=") {
            self.moments(line, states)
        } else if let Some(name) = (self.layout.block)(text).filter(|_| line.is_heading()) {
            self.enter(name, line, states);
            Some(())
        } else {
            None
        };
        if done.is_none() {
            let found = shown(line.columns(1, 40));
            let message = format!(
                "expected a node's forces, a sum or a heading, found \"{}\"",
                found.trim_end()
            );
            states.damage(line, None, message);
        }
    }

    fn interrupt(&mut self) {
        self.body = None;
    }
}
