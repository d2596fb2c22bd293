//! The cards of each kind of keyword: what names a run's parts and outputs, initial velocities, parameters, units.

use super::context::{Block, Context, Defined, MAX_ENTRIES, Missing, Value};
use super::keyword::{Card, Field, Kind, start, text};
use super::{DeckEntity, DeckOutput, DeckPlace, InitialVelocity, Material, Scope, StatedUnits};
use crate::solver::lsdyna::line::shown;
use crate::solver::problem::{Place, ProblemCode};
use crate::unit::UnitSystem;

/// Bytes of a parameter's name; the manual allows 9.
const MAX_NAME: usize = 80;

impl Context {
    /// DT BINARY LCUR IOOPT.
    pub(super) fn output(&mut self, file: &'static str, block: &Block, card: &Card<'_>) {
        let interval = self.real(card.field(0)).unwrap_or(None);
        let binary = self.integer(card.field(1)).unwrap_or(None);
        let output = DeckOutput { file, interval, binary, at: self.at(block.place) };
        self.keep(|deck| &mut deck.outputs, output, "output files");
    }

    pub(super) fn history(&mut self, sets: bool, card: &Card<'_>, k: usize) {
        let Ok(Some(id)) = self.integer(card.field(k)) else { return };
        if id == 0 {
            return;
        }
        if sets {
            self.keep(|deck| &mut deck.history_node_sets, id, "history node sets");
        } else {
            let node = self.entity(id, None, card);
            self.keep(|deck| &mut deck.history_nodes, node, "history nodes");
        }
    }

    pub(super) fn history_with_heading(&mut self, card: &Card<'_>) {
        if card.is_blank() {
            return;
        }
        let (field, title) = card.id_and_text();
        if let Some(id) = self.required_id(field) {
            let node = self.entity(id, title, card);
            self.keep(|deck| &mut deck.history_nodes, node, "history nodes");
        }
    }

    /// MID RO E …: most materials begin so. What is not a number there belongs to others, or to none, and is not missed.
    pub(super) fn material(&mut self, card: &Card<'_>) {
        let [density, modulus] = [1, 2].map(|k| self.parameters.real(card.field(k)).ok().flatten());
        if let (Some(density), Some(modulus)) = (density, modulus) {
            let material = Material { density, modulus, at: self.at(card.place) };
            self.keep(|deck| &mut deck.materials, material, "materials");
        }
    }

    fn entity(&self, id: i64, title: Option<String>, card: &Card<'_>) -> DeckEntity {
        DeckEntity { id: Some(id), title, keyword: String::new(), at: self.at(card.place) }
    }

    pub(super) fn interface(
        &mut self,
        kind: Kind,
        keyword: String,
        at: DeckPlace,
        id: Option<i64>,
        title: Option<String>,
    ) {
        let interface = DeckEntity { id: id.filter(|&id| id != 0), title, keyword, at };
        if kind == Kind::Wall {
            self.keep(|deck| &mut deck.rigid_walls, interface, "rigid walls");
        } else {
            self.keep(|deck| &mut deck.contacts, interface, "contacts");
        }
    }

    /// Heading; PID SECID MID …; then the cards of the options, for each part. Those of
    /// `_INERTIA` come first: XC YC ZC TM IRCS …; inertias; velocities; axes when IRCS is 1.
    pub(super) fn part(&mut self, block: &mut Block, card: &Card<'_>) {
        match (block.cards, block.kind) {
            (1, _) => {
                block.text = text(card.text);
                block.ids = [None; 3];
            }
            (2, _) => {
                // Two blank lines are the end of a keyword, not a part.
                if !card.is_blank() || block.text.is_some() {
                    block.ids[0] = self.required_id(card.field(0));
                }
                if let Some(id) = block.ids[0] {
                    let part = self.entity(id, block.text.take(), card);
                    self.keep(|deck| &mut deck.parts, part, "parts");
                }
            }
            (3, Kind::Parts { inertia: true, .. }) => {
                block.ids[1] = self.integer(card.field(4)).unwrap_or(None);
            }
            (5, Kind::Parts { inertia: true, .. }) => self.velocity_of_inertia(block, card),
            _ => {}
        }
        if let Kind::Parts { cards, inertia } = block.kind {
            let axes = usize::from(block.ids[1] == Some(1));
            if block.cards >= cards + if inertia { 3 + axes } else { 0 } {
                block.cards = 0;
            }
        }
    }

    /// Card 1: NSID NSIDEX BOXID …; card 2: VX VY VZ VXR VYR VZR; card 3, when there is
    /// NSIDEX: velocities of the exempted nodes.
    pub(super) fn velocity_of_set(&mut self, block: &mut Block, card: &Card<'_>) {
        let name = &block.keyword.name;
        let [set, exempted, in_box] = block.ids;
        let scope = match (block.cards, set, in_box) {
            (1, ..) => {
                block.ids = [0, 1, 2].map(|k| match self.integer(card.field(k)) {
                    Ok(id) => Some(id.unwrap_or(0)),
                    Err(Missing) => None,
                });
                return;
            }
            (2, Some(0), Some(0)) => Scope::AllNodes,
            (2, Some(set), Some(0)) => Scope::NodeSet(set),
            (2, Some(_), Some(in_box)) => Scope::Box(in_box),
            (3, ..) if exempted != Some(0) => exempted.map_or(Scope::Unknown, Scope::NodeSet),
            (3.., ..) => return,
            _ => Scope::Unknown,
        };
        // Rotations here are the nodes' own and move nothing.
        let velocity = self.three(card, 0);
        self.velocity(name, self.at(block.place), scope, velocity, false);
    }

    /// NID (or PID) VX VY VZ VXR VYR VZR.
    pub(super) fn velocity_of_id(
        &mut self,
        block: &Block,
        card: &Card<'_>,
        scope: fn(i64) -> Scope,
    ) {
        if card.is_blank() {
            return;
        }
        let id = self.required_id(card.field(0));
        let velocity = self.three(card, 1);
        let rotates = block.kind == Kind::VelocityOfRigidBodies && self.rotates(card, 4);
        let scope = id.map_or(Scope::Unknown, scope);
        self.velocity(&block.keyword.name, self.at(card.place), scope, velocity, rotates);
    }

    /// Card 1: ID STYP OMEGA VX VY VZ …; card 2: the axis; for each.
    pub(super) fn velocity_generation(&mut self, block: &mut Block, card: &Card<'_>) {
        if block.cards == 2 || card.is_blank() {
            block.cards = 0;
            return;
        }
        let scope = match (self.integer(card.field(0)), self.integer(card.field(1))) {
            (Ok(None | Some(0)), _) => Scope::AllNodes,
            (Ok(Some(id)), Ok(Some(1))) => Scope::PartSet(id),
            (Ok(Some(id)), Ok(Some(2))) => Scope::Part(id),
            (Ok(Some(id)), Ok(Some(3))) => Scope::NodeSet(id),
            _ => Scope::Unknown,
        };
        let rotates = !matches!(self.real(card.field(2)), Ok(None | Some(0.0)));
        let velocity = self.three(card, 3);
        self.velocity(&block.keyword.name, self.at(card.place), scope, velocity, rotates);
    }

    /// VTX VTY VTZ VRX VRY VRZ.
    pub(super) fn velocity_of_inertia(&mut self, block: &Block, card: &Card<'_>) {
        let velocity = self.three(card, 0);
        let rotates = self.rotates(card, 3);
        if rotates || velocity != Some([0.0; 3]) {
            let scope = block.ids[0].map_or(Scope::Unknown, Scope::Part);
            self.velocity(&block.keyword.name, self.at(card.place), scope, velocity, rotates);
        }
    }

    pub(super) fn velocity(
        &mut self,
        keyword: &str,
        at: DeckPlace,
        scope: Scope,
        velocity: Option<[f64; 3]>,
        rotates: bool,
    ) {
        let given = InitialVelocity { keyword: keyword.into(), at, velocity, rotates, scope };
        self.keep(|deck| &mut deck.initial_velocities, given, "initial velocities");
    }

    fn three(&mut self, card: &Card<'_>, from: usize) -> Option<[f64; 3]> {
        // All three are read, so that the problems of all three are found.
        let [x, y, z] =
            [0, 1, 2].map(|k| self.real(card.field(from + k)).map(|v| v.unwrap_or(0.0)));
        Some([x.ok()?, y.ok()?, z.ok()?])
    }

    fn rotates(&mut self, card: &Card<'_>, from: usize) -> bool {
        self.three(card, from) != Some([0.0; 3])
    }

    /// PRMR1 VAL1 PRMR2 VAL2 …: the first column of a name is its type.
    pub(super) fn parameters(&mut self, card: &Card<'_>) {
        for k in (0..card.fields().count().min(8)).step_by(2) {
            let (field, value) = (card.field(k), card.field(k + 1));
            if field.text.is_empty() && value.text.is_empty() {
                continue;
            }
            let Some((letter, name)) = parameter_name(field.text) else {
                self.bad_parameter_name(field);
                continue;
            };
            let value = match letter {
                b'C' => Value::Text(text(value.text).unwrap_or_default()),
                b'I' => number(self.integer(value), Value::Integer),
                _ => number(self.real(value), Value::Real),
            };
            self.define(name, value, card.place);
        }
    }

    /// PRMR1 EXPRESSION1, which continues below where the name is blank. Only one that is
    /// a plain number has a value here.
    pub(super) fn expression(&mut self, card: &Card<'_>) {
        let (field, expression) = card.id_and_text();
        let Some(expression) = expression.filter(|_| !field.text.is_empty()) else { return };
        let Some((letter, name)) = parameter_name(field.text) else {
            self.bad_parameter_name(field);
            return;
        };
        let plain = Field { text: expression.as_bytes(), ..field };
        let plain = match letter {
            b'I' => self.parameters.integer(plain).ok().flatten().map(Value::Integer),
            b'R' => self.parameters.real(plain).ok().flatten().map(Value::Real),
            _ => None,
        };
        if plain.is_none() {
            let message =
                format!("parameter \"{name}\" is not evaluated: it is the expression {expression}");
            self.problem(ProblemCode::UnreadRows, card.place, None, message);
        }
        self.define(name, plain.unwrap_or(Value::Unknown), card.place);
    }

    fn bad_parameter_name(&mut self, field: Field<'_>) {
        let message =
            format!("expected R, I or C and a parameter's name, found \"{}\"", start(field.text));
        self.bad_field(field, message);
    }

    fn define(&mut self, name: String, value: Value, place: Place) {
        match self.parameters.define(name.clone(), value, MAX_ENTRIES) {
            Defined::Kept => {}
            Defined::Full => self.note_full("parameters"),
            Defined::Contradicts => {
                let message = format!(
                    "parameter \"{name}\" has another value above; it is treated as unknown"
                );
                self.problem(ProblemCode::BadField, place, None, message);
            }
        }
    }
}

/// Type letter and name of a parameter: `R    tEnd` or `Rname`.
fn parameter_name(text: &[u8]) -> Option<(u8, String)> {
    let (letter, name) = text.split_first()?;
    let letter = letter.to_ascii_uppercase();
    let name = shown(name.trim_ascii()).to_lowercase();
    let well = matches!(letter, b'R' | b'I' | b'C') && (1..=MAX_NAME).contains(&name.len());
    well.then_some((letter, name))
}

fn number<T>(read: Result<Option<T>, Missing>, value: fn(T) -> Value) -> Value {
    read.ok().flatten().map_or(Value::Unknown, value)
}

/// What a comment such as `$# Units: kg / mm / ms / kN / GPa` states.
pub(super) fn in_comment(line: &[u8]) -> Option<String> {
    const WORD: &[u8] = b"units";
    let at = line.windows(WORD.len()).position(|w| w.eq_ignore_ascii_case(WORD))?;
    let behind = line.get(at + WORD.len()..)?.trim_ascii_start();
    text(behind.strip_prefix(b":").or_else(|| behind.strip_prefix(b"="))?)
}

/// Length, time and mass of `*CONTROL_UNITS`; m, sec and kg where blank.
pub(super) fn on_card(card: &Card<'_>) -> String {
    let field = |k: usize, default: &str| text(card.field(k).text).unwrap_or(default.into());
    [field(0, "m"), field(1, "sec"), field(2, "kg")].join(" ")
}

/// The system that a text names, whatever other units it names.
pub(crate) fn system(text: &str) -> Option<UnitSystem> {
    let separators = [' ', '/', ',', ';', '(', ')', '\t'];
    // `kN-mm` is an energy but `mm-t-s` is a system: hyphens part the second only.
    from_words(text.split(separators)).or_else(|| {
        from_words(text.split(separators).find(|w| w.matches('-').count() >= 2)?.split('-'))
    })
}

fn from_words<'a>(words: impl Iterator<Item = &'a str>) -> Option<UnitSystem> {
    let mut found: [Option<&str>; 3] = [None; 3];
    for word in words {
        // Case decides between Mg (tonne) and mg.
        let (slot, unit) = match word {
            // No `in`: sentences have it too ("forces in kN").
            "mm" | "cm" | "m" => (0, word),
            "kg" | "t" | "Mg" | "g" => (1, word),
            "ton" | "tonne" | "tonnes" | "mtrc_ton" | "MTRC_TON" => (1, "t"),
            "s" | "ms" | "us" => (2, word),
            "sec" | "SEC" => (2, "s"),
            "msec" => (2, "ms"),
            "micro_s" => (2, "us"),
            _ => continue,
        };
        let slot = found.get_mut(slot)?;
        if slot.replace(unit).is_some_and(|known| known != unit) {
            return None;
        }
    }
    let [length, mass, time] = found;
    UnitSystem::parse(&[length?, mass?, time?].join("-")).ok()
}

impl Context {
    /// Keeps the first statement that is recognised; `*CONTROL_UNITS` is above comments.
    pub(super) fn units(&mut self, stated: String, place: Place, on_card: bool) {
        // A card that is filled in with blanks between the units has parts of them in its fields.
        let is_whole = !on_card || stated.split(' ').count() == 3;
        let system = system(&stated).filter(|_| is_whole);
        let mut new = StatedUnits { system, text: stated, at: self.at(place) };
        if let Some(known) = &self.deck.units {
            if new.system.zip(known.system).is_some_and(|(a, b)| a != b) {
                let message = format!(
                    "units \"{}\" contradict \"{}\" of line {}",
                    new.text, known.text, known.at.line
                );
                self.units_differ = true;
                self.problem(ProblemCode::BadLine, place, None, message);
            } else if !on_card && (known.system.is_some() || self.units_differ) {
                return;
            }
        }
        new.system = new.system.filter(|_| !self.units_differ);
        self.deck.units = Some(new);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_stated_units() {
        fn t(comment: &str, expected: Option<&str>) {
            let text = in_comment(comment.as_bytes());
            let expected = expected.map(|e| UnitSystem::parse(e).unwrap());
            assert_eq!(text.and_then(|t| system(&t)), expected, "{comment:?}");
        }
        t("$# Units: kg / mm / ms / kN / GPa / kN-mm", Some("kg-mm-ms"));
        t("$ generated by deck.py  units: Mg mm s N MPa", Some("t-mm-s"));
        t("$ UNITS = ton-mm-s", Some("t-mm-s"));
        t("$ units : tonne, mm, sec", Some("t-mm-s"));
        t("$ units: mg mm s", None); // milligram is not known
        t("$ units: kg m mm s", None); // contradicts itself
        t("$ units: mm/s", None); // a speed only
        t("$ units: force in kN, mass in t, time in s", None);
        t("$ all units are consistent", None);
    }
}
