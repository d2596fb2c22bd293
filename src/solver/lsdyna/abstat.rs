//! `abstat`: state of airbags and control volumes, and of the materials they are made of.

use super::ascii::{self, Body};
use super::label_values::{Labelled, Widths, fields, labelled};
use super::line::{Field, Line, integer, real, shown};
use crate::history::EntityId;
use crate::solver::format::Format;
use crate::solver::states::{StateReader, TableId};

const COMPONENTS: [&str; 12] = [
    "volume",
    "pressure",
    "internal_energy",
    "dm_dt_in",
    "density",
    "dm_dt_out",
    "total_mass",
    "gas_temp",
    "surface_area",
    "reaction",
    "dm_dt_outp",
    "dm_dt_outv",
];
/// "time E12.5, airbag id I8, five E15.4, then seven of 11", five of 11 in old files.
const TIME: (usize, usize) = (1, 12);
const ID: (usize, usize) = (13, 20);
const WIDE: usize = 5;
const WIDE_WIDTH: usize = 15;
const NARROW_WIDTH: usize = 11;
const MATERIAL: &[u8] = b"Material I.D.=";
const AREAS: [Labelled; 3] = [
    labelled("unblocked_area", "Unblocked  Area=", 12),
    labelled("blocked_area", "  Blocked  Area=", 12),
    labelled("leakage", "Leakage      =", 12),
];
const MAX_MATERIALS: usize = 1_000;

fn signature(line: &[u8]) -> bool {
    let text = line.trim_ascii_start();
    text.starts_with(b"time   airbag/cv #") || (text.starts_with(MATERIAL) && text.len() > 60)
}

pub(crate) const FORMAT: Format =
    Format::text("abstat", "airbag", signature, ascii::read_default::<Abstat>);

#[derive(Default)]
struct Abstat {
    table: Option<TableId>,
    /// Areas by material and row of it below its airbag; their components carry both.
    materials: Vec<((i64, usize), TableId)>,
    airbag: Option<EntityId>,
    /// Materials of the rows below the airbag: one may be there for each of its vents.
    below: Vec<i64>,
    widths: Widths,
    width: usize,
}

impl Body for Abstat {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        let text = line.text.trim_ascii_start();
        if line.is_blank() || (text.starts_with(b"time   airbag/cv #") && line.is_heading()) {
            return;
        }
        let read = if text.starts_with(MATERIAL) {
            self.material(line, states)
        } else {
            self.row(line, states)
        };
        if read.is_none() {
            let found = shown(line.columns(1, 40));
            let message =
                format!("expected an airbag's or a material's row, found \"{}\"", found.trim_end());
            states.damage(line, None, message);
        }
    }

    fn interrupt(&mut self) {
        self.airbag = None;
    }
}

/// Columns of the k-th number.
fn field(k: usize) -> (usize, usize) {
    let wide = ID.1 + k.min(WIDE) * WIDE_WIDTH;
    match k.checked_sub(WIDE) {
        None => (wide + 1, wide + WIDE_WIDTH),
        Some(narrow) => (wide + narrow * NARROW_WIDTH + 1, wide + (narrow + 1) * NARROW_WIDTH),
    }
}

impl Abstat {
    fn row(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        let count = [10, 12].into_iter().find(|&n| field(n - 1).1 == text.len())?;
        if text.len() < self.width {
            return None;
        }
        self.width = text.len();
        let Field::Real(time) = real(line.columns(TIME.0, TIME.1)) else { return None };
        let airbag = EntityId::new(integer(line.columns(ID.0, ID.1))?);
        let table = *self.table.get_or_insert_with(|| states.table("airbags", &COMPONENTS));
        if states.pending_time() != Some(time) || states.has_row(table, airbag) {
            states.begin(Some(time), line.into());
        }
        self.airbag = Some(airbag);
        self.below.clear();
        states.row(table, airbag, line, |k| (k < count).then(|| field(k)));
        Some(())
    }

    fn material(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text;
        let from = memchr::memmem::find(text, MATERIAL)? + MATERIAL.len();
        let to = memchr::memmem::find(text, AREAS[0].label.as_bytes())?;
        let material = integer(text.get(from..to)?)?;
        let fields = fields(line, &AREAS, &mut self.widths, states)?;
        if fields.iter().any(Option::is_none) {
            return None;
        }
        let row = 1 + self.below.iter().filter(|&&above| above == material).count();
        let key = (material, row);
        let known = self.materials.iter().find(|(k, _)| *k == key).map(|(_, t)| *t);
        let table = match known {
            Some(table) => table,
            None if self.materials.len() < MAX_MATERIALS => {
                let tail = if row > 1 { format!("_{row}") } else { String::new() };
                let name = |area: &Labelled| format!("{}_mat{material}{tail}", area.component);
                let names = AREAS.each_ref().map(name);
                let table = states.table("materials", &names.each_ref().map(String::as_str));
                self.materials.push((key, table));
                table
            }
            None => return None,
        };
        states.row(table, self.airbag?, line, |k| fields[k]);
        self.below.push(material);
        Some(())
    }
}
