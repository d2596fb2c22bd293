//! `bndout` and `nodfor`: forces and energies of nodes or rigid bodies with their sum:
//! `nd#  200034  xforce=… yforce=… zforce=… energy=…`, then `xtotal=…`.
//!
//! In `bndout` the blocks of a state are prescribed motions, pressures and discrete forces. Rigid
//! bodies (`mat#`), pressures and discrete forces have only been seen in the source of LSTC's
//! converter `l2a`. In `nodfor` they are groups of nodes, numbered by their order, not by the ids of
//! their node sets; it is read as the source of `l2a` writes it.

use super::ascii::Body;
use super::label_values::{Label, fields};
use super::line::{Line, integer};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::problem::ProblemCode;
use crate::solver::states::{StateReader, TableId};

const WIDTH: usize = 13;
/// Marks of a row: a node, or a rigid body.
const MARKS: [&[u8]; 4] = [b"nd#", b"mat#", b"mt#", b"rb#"];
const ID: &[u8] = b"xforce=";

const ROW: [Label; 7] = [
    ("x_force", "xforce="),
    ("y_force", "yforce="),
    ("z_force", "zforce="),
    ("energy", "energy="),
    ("xmoment", "xmoment="),
    ("ymoment", "ymoment="),
    ("zmoment", "zmoment="),
];
/// Moments of a rigid body, on a line of their own.
const MOMENTS: &[Label] = ROW.split_at(4).1;
const TOTALS: [Label; 7] = [
    ("x_total", "xtotal="),
    ("y_total", "ytotal="),
    ("z_total", "ztotal="),
    ("etotal", "etotal="),
    ("x_local", "xlocal="),
    ("y_local", "ylocal="),
    ("z_local", "zlocal="),
];
/// Groups or kinds of boundary condition of one file; more are damage.
const MAX_BLOCKS: usize = 200;

/// What the two files differ in.
struct Layout {
    /// Digits of the time.
    time_digits: i32,
    /// Begins a state; the time is after `t=`.
    state: &'static [u8],
    /// Name of the block that a heading begins, such as a group; `None` for other lines.
    block: fn(&[u8]) -> Option<String>,
}

static PRESCRIBED: Layout = Layout {
    time_digits: 6,
    state: b" n o d a l   f o r c e/e n e r g y    o u t p u t",
    // "velocity boundary condition forces/…", "pressure boundary condition …", "discrete nodal
    // point forces": the first word distinguishes them.
    block: |line| {
        let text = std::str::from_utf8(line).ok()?;
        let first = text.split_whitespace().next()?;
        (text.contains("forces") && first.bytes().all(|b| b.is_ascii_alphabetic()))
            .then(|| first.to_ascii_lowercase())
    },
};

static GROUPS: Layout = Layout {
    time_digits: 4,
    state: b" n o d a l   f o r c e   g r o u p    o u t p u t",
    block: |line| {
        let number = integer(line.strip_prefix(b" nodal group output number")?)?;
        Some(format!("group{number}"))
    },
};

pub(crate) const BNDOUT: Format =
    Format::text("bndout", "node", || of(&PRESCRIBED), |line| line.starts_with(PRESCRIBED.state));

pub(crate) const NODFOR: Format =
    Format::text("nodfor", "node", || of(&GROUPS), |line| line.starts_with(GROUPS.state));

/// Reader of either file. Components of all blocks but the first of the file have the
/// block's name in front, because the same node may be in several.
#[derive(Clone)]
struct NodeForces {
    layout: &'static Layout,
    /// Names of the blocks, and their tables once they have rows.
    blocks: Vec<(String, Option<[TableId; 2]>)>,
    current: Option<usize>,
    /// After a heading: a row that the state already has is the first of the next one.
    begins: bool,
}

fn of(layout: &'static Layout) -> Box<dyn Body> {
    Box::new(NodeForces { layout, blocks: Vec::new(), current: None, begins: false })
}

impl NodeForces {
    /// The current block, and what the names of its components begin with; `None` where its
    /// heading is missing.
    fn block(&mut self) -> Option<(&mut Option<[TableId; 2]>, String)> {
        let number = self.current?;
        let (name, tables) = &mut self.blocks[number];
        let prefix = if number == 0 { String::new() } else { format!("{name}_") };
        Some((tables, prefix))
    }

    fn enter(&mut self, name: String, line: &Line<'_>, states: &mut StateReader<'_>) {
        let known = self.blocks.iter().position(|(known, _)| *known == name);
        if known.is_none() && self.blocks.len() == MAX_BLOCKS {
            let message = format!("\"{name}\" is left out: there are too many groups");
            states.problems.add(ProblemCode::UnreadRows, Some(line.into()), message);
            states.mark_damaged();
            return;
        }
        self.current = Some(known.unwrap_or_else(|| {
            self.blocks.push((name, None));
            self.blocks.len() - 1
        }));
    }

    /// The tables of forces and of moments of the current block.
    fn tables(&mut self, states: &mut StateReader<'_>) -> Option<[TableId; 2]> {
        let (tables, prefix) = self.block()?;
        Some(*tables.get_or_insert_with(|| {
            [("forces", &ROW[..]), ("moments", MOMENTS)].map(|(what, labels)| {
                states.table(what, labels.iter().map(|(name, _)| format!("{prefix}{name}")))
            })
        }))
    }

    fn state(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        self.current = None;
        self.begins = true;
        states.time_digits = self.layout.time_digits;
        let at = memchr::memmem::find(line.text, b"t=").map(|at| &line.text[at + 2..]);
        let time = super::heading_time(at, super::TIME, line, states);
        // Every kind of boundary condition has a heading of its own at one time.
        if time.is_none() || states.pending_time() != time {
            states.begin(time, line.into());
        }
        time.map(drop)
    }

    fn row(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text;
        let from = memchr::memchr(b'#', text)? + 1;
        let to = memchr::memmem::find(text, ID)?;
        let entity = EntityId::new(integer(text.get(from..to)?)?);
        let fields = fields(line, &ROW, WIDTH, states)?;
        if fields[..4].iter().any(Option::is_none) {
            return None;
        }
        let [table, _] = self.tables(states)?;
        states.entity = Some(entity);
        if std::mem::take(&mut self.begins) && states.has_row(table, entity) {
            states.begin(states.pending_time(), line.into());
        }
        states.row(table, entity, line, |k| fields[k]);
        Some(())
    }

    fn moments(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let fields = fields(line, MOMENTS, WIDTH, states)?;
        let entity = states.entity?;
        if fields.iter().any(Option::is_none) {
            return None;
        }
        let [_, table] = self.tables(states)?;
        states.row(table, entity, line, |k| fields[k]);
        Some(())
    }

    fn totals(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let fields = fields(line, &TOTALS, WIDTH, states)?;
        let (_, prefix) = self.block()?;
        for ((name, _), field) in TOTALS.iter().zip(fields) {
            let Some((from, to)) = field else { continue };
            states.scalar(&format!("{prefix}{name}"), line, [from, to]);
        }
        Some(())
    }
}

impl Body for NodeForces {
    fn expected(&self) -> &'static str {
        "a node's forces, a sum or a heading"
    }

    fn is_by_time(&self) -> bool {
        true
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let start = line.text.trim_ascii_start();
        if line.text.starts_with(self.layout.state) {
            self.state(line, states)
        } else if MARKS.iter().any(|mark| start.starts_with(mark)) {
            self.row(line, states)
        } else if start.starts_with(b"xtotal=") || start.starts_with(b"xlocal=") {
            self.totals(line, states)
        } else if start.starts_with(b"xmoment=") {
            self.moments(line, states)
        } else {
            let name = (self.layout.block)(line.text).filter(|_| line.is_heading())?;
            self.enter(name, line, states);
            Some(())
        }
    }
}
