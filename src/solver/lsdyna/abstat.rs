//! `abstat`: state of airbags and control volumes, and of the materials they are made of.

use super::ascii::{Body, boxed};
use super::label_values::{Label, fields};
use super::line::{Line, integer, real};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::{KeyedTables, StateReader, TableId};

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
const TIME_END: usize = 12;
const ID_END: usize = 20;
const WIDE: usize = 5;
const WIDE_WIDTH: usize = 15;
const NARROW_WIDTH: usize = 11;
const COLUMN_LINE: &[u8] = b"time   airbag/cv #";
const MATERIAL: &[u8] = b"Material I.D.=";
const AREAS: [Label; 3] = [
    ("unblocked_area", "Unblocked  Area="),
    ("blocked_area", "  Blocked  Area="),
    ("leakage", "Leakage      ="),
];
const AREA_WIDTH: usize = 12;
const MAX_MATERIALS: usize = 1_000;

pub(crate) const FORMAT: Format = Format::text("abstat", "airbag", boxed::<Abstat>, |line| {
    let text = line.trim_ascii_start();
    text.starts_with(COLUMN_LINE) || (text.starts_with(MATERIAL) && text.len() > 60)
});

#[derive(Clone, Default)]
struct Abstat {
    table: Option<TableId>,
    /// Areas by material and row of it below its airbag; their components carry both.
    materials: KeyedTables<(i64, usize)>,
    /// Materials of the rows below the airbag: one may be there for each of its vents.
    below: Vec<i64>,
    width: usize,
}

impl Body for Abstat {
    fn expected(&self) -> &'static str {
        "an airbag's or a material's row"
    }

    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_start();
        if text.starts_with(COLUMN_LINE) && line.is_heading() {
            Some(())
        } else if text.starts_with(MATERIAL) {
            self.material(line, states)
        } else {
            self.row(line, states)
        }
    }
}

/// Columns of the k-th number.
fn field(k: usize) -> (usize, usize) {
    let wide = ID_END + k.min(WIDE) * WIDE_WIDTH;
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
        let printed = line.columns(1, TIME_END);
        let time = real(printed).number()?;
        let airbag = EntityId::new(integer(line.columns(TIME_END + 1, ID_END))?);
        let table = *self.table.get_or_insert_with(|| states.table("airbags", COMPONENTS));
        states.entity = Some(airbag);
        self.below.clear();
        states.timed_row(table, airbag, (time, printed), line, |k| (k < count).then(|| field(k)));
        Some(())
    }

    fn material(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text;
        let from = memchr::memmem::find(text, MATERIAL)? + MATERIAL.len();
        let to = memchr::memmem::find(text, AREAS[0].1.as_bytes())?;
        let material = integer(text.get(from..to)?)?;
        let fields = fields(line, &AREAS, AREA_WIDTH, states)?;
        if fields.iter().any(Option::is_none) {
            return None;
        }
        let row = 1 + self.below.iter().filter(|&&above| above == material).count();
        let table = self.materials.get((material, row), MAX_MATERIALS, |_| {
            let tail = if row > 1 { format!("_{row}") } else { String::new() };
            states.table("materials", AREAS.map(|(area, _)| format!("{area}_mat{material}{tail}")))
        })?;
        states.row(table, states.entity?, line, |k| fields[k]);
        self.below.push(material);
        Some(())
    }
}
