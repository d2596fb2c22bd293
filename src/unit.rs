//! Units: where numbers with units enter the program and become SI.
//!
//! All internal values are in SI. A number typed by a user carries its unit
//! (`36km/h`, `24t`, `0.75ms`); a solver file has none, so a
//! [`UnitSystem`] is declared once in the study manifest.
//!
//! ```
//! use crumple::unit::{UnitSystem, km_per_h};
//!
//! // Megagrams, millimetres and seconds make newtons.
//! assert_eq!(UnitSystem::parse("mm-t-s")?.force(), 1.0);
//! assert_eq!(km_per_h(10.0), "36 km/h");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::{Error, error};
use crate::guess;

/// Metres per second in one kilometre per hour.
pub(crate) const M_PER_S_PER_KM_PER_H: f64 = 1.0 / 3.6;

/// Metres per second in one mile per hour.
pub(crate) const M_PER_S_PER_MPH: f64 = 0.44704;

/// What a speed is measured against. A speed is never stated without it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SpeedKind {
    /// Speed of one body that hits a rigid wall.
    Wall,
    /// Relative speed of two bodies.
    Closing,
}

impl SpeedKind {
    /// `"wall"` or `"closing"`, as written in every file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wall => "wall",
            Self::Closing => "closing",
        }
    }

    pub(crate) fn parse(name: &str) -> Option<Self> {
        [Self::Wall, Self::Closing].into_iter().find(|kind| kind.name() == name)
    }
}

/// An impact speed in m/s together with what it is measured against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// The speed, in m/s.
    pub m_per_s: f64,
    /// What it is measured against.
    pub kind: SpeedKind,
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", km_per_h(self.m_per_s), self.kind.name())
    }
}

/// How the values of a column are written: all in the unit that fits the largest of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shown {
    unit: &'static str,
    size: f64,
    decimals: usize,
}

impl Shown {
    /// In the first unit of which the largest value has at least this share.
    fn fitting(largest: f64, share: f64, scales: &[(f64, &'static str, usize)]) -> Self {
        let fits = |(size, ..): &&(f64, &str, usize)| largest.abs() >= share * size;
        let last = scales.len() - 1;
        let &(size, unit, decimals) = scales.iter().find(fits).unwrap_or(&scales[last]);
        Self { unit, size, decimals }
    }

    /// In MN, kN or N.
    pub(crate) fn force(largest_n: f64) -> Self {
        Self::fitting(largest_n, 0.1, &[(1e6, "MN", 3), (1e3, "kN", 3), (1.0, "N", 2)])
    }

    pub(crate) fn mass(largest_kg: f64) -> Self {
        Self::fitting(largest_kg, 1.0, &[(1e3, "t", 2), (1.0, "kg", 2)])
    }

    /// In MJ, kJ or J.
    pub(crate) fn energy(largest_j: f64) -> Self {
        Self::fitting(largest_j, 0.1, &[(1e6, "MJ", 3), (1e3, "kJ", 3), (1.0, "J", 2)])
    }

    /// In MN/m or kN/m.
    pub(crate) fn stiffness(largest_n_per_m: f64) -> Self {
        Self::fitting(largest_n_per_m, 1.0, &[(1e6, "MN/m", 1), (1e3, "kN/m", 1)])
    }

    pub(crate) fn text(self, value: f64) -> String {
        format!("{:.*} {}", self.decimals, value / self.size, self.unit)
    }

    /// One force in the unit that fits it.
    pub(crate) fn one_force(force_n: f64) -> String {
        Self::force(force_n).text(force_n)
    }

    /// One mass in the unit that fits it.
    pub(crate) fn one_mass(mass_kg: f64) -> String {
        Self::mass(mass_kg).text(mass_kg)
    }

    /// One energy in the unit that fits it.
    pub(crate) fn one_energy(energy_j: f64) -> String {
        Self::energy(energy_j).text(energy_j)
    }

    /// One stiffness in the unit that fits it.
    pub(crate) fn one_stiffness(stiffness_n_per_m: f64) -> String {
        Self::stiffness(stiffness_n_per_m).text(stiffness_n_per_m)
    }

    /// One impulse in the unit that fits it.
    pub(crate) fn one_impulse(impulse_ns: f64) -> String {
        Self::fitting(impulse_ns, 0.1, &[(1e3, "kN·s", 3), (1.0, "N·s", 2)]).text(impulse_ns)
    }
}

/// A speed in m/s, of a text with its unit such as "36km/h".
///
/// # Errors
/// If it is not a number with a unit of speed, or not above 0.
pub fn speed_m_per_s(text: &str) -> Result<f64, Error> {
    SPEED.parse_positive(text)
}

/// A mass in kg, of a text with its unit such as "24t".
///
/// # Errors
/// If it is not a number with a unit of mass, or not above 0.
pub fn mass_kg(text: &str) -> Result<f64, Error> {
    MASS.parse_positive(text)
}

/// A length in m, of a text with its unit such as "620mm".
///
/// # Errors
/// If it is not a number with a unit of length, or not above 0.
pub fn length_m(text: &str) -> Result<f64, Error> {
    LENGTH.parse_positive(text)
}

/// A speed as people in the field read it: `36 km/h`, at most two decimals.
pub fn km_per_h(m_per_s: f64) -> String {
    let rounded = (m_per_s / M_PER_S_PER_KM_PER_H * 100.0).round() / 100.0;
    format!("{rounded} km/h")
}

/// One kind of quantity: its name for messages, its units with their size in SI.
pub(crate) struct Dimension {
    /// Name for messages, such as "speed".
    pub what: &'static str,
    example_unit: &'static str,
    units: &'static [(&'static str, f64)],
}

/// Speeds, in m/s inside.
pub(crate) const SPEED: Dimension = Dimension {
    what: "speed",
    example_unit: "km/h",
    units: &[
        ("km/h", M_PER_S_PER_KM_PER_H),
        ("m/s", 1.0),
        ("mm/ms", 1.0),
        ("mm/s", 1e-3),
        ("mph", M_PER_S_PER_MPH),
    ],
};
/// Masses, in kg inside.
pub(crate) const MASS: Dimension = Dimension {
    what: "mass",
    example_unit: "t",
    units: &[("t", 1e3), ("kg", 1.0), ("g", 1e-3), ("lb", LB_KG)],
};
/// Lengths, in metres.
pub(crate) const LENGTH: Dimension = Dimension {
    what: "length",
    example_unit: "mm",
    units: &[("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("in", 0.0254), ("ft", 0.3048), ("um", 1e-6)],
};
/// Times, in s inside.
pub(crate) const TIME: Dimension = Dimension {
    what: "time",
    example_unit: "ms",
    units: &[("us", 1e-6), ("ms", 1e-3), ("s", 1.0)],
};
/// Stiffnesses, in N/m inside.
pub(crate) const STIFFNESS: Dimension = Dimension {
    what: "stiffness",
    example_unit: "MN/m",
    units: &[
        ("N/m", 1.0),
        ("kN/m", 1e3),
        ("MN/m", 1e6),
        ("GN/m", 1e9),
        ("N/mm", 1e3),
        ("kN/mm", 1e6),
    ],
};
/// Forces, in newtons.
pub(crate) const FORCE: Dimension = Dimension {
    what: "force",
    example_unit: "kN",
    units: &[("N", 1.0), ("kN", 1e3), ("MN", 1e6), ("lbf", LBF_N)],
};

impl Dimension {
    /// SI value of a number with a unit, such as `"36 km/h"`.
    ///
    /// # Errors
    /// When the number or the unit is missing, unknown or not finite.
    pub(crate) fn parse(&self, text: &str) -> Result<f64, Error> {
        let trimmed = text.trim();
        let number_end = trimmed
            .char_indices()
            .find(|&(i, c)| !continues_number(trimmed, i, c))
            .map_or(trimmed.len(), |(i, _)| i);
        let (number, unit) = trimmed.split_at(number_end);
        let what = self.what;
        let value: f64 = number.trim().parse().map_err(|_| {
            let example = self.example();
            error!(
                Other,
                "{what} \"{text}\" is not a number with a unit: write for example {example}"
            )
        })?;
        let unit = unit.trim();
        if unit.is_empty() {
            // mm/ms is of that size, too, but nobody would write it first.
            let in_si = self.units.iter().filter(|(name, size)| *size == 1.0 && *name != "mm/ms");
            let units = [self.example_unit].into_iter().chain(in_si.map(|(name, _)| *name));
            let examples: Vec<String> = units.map(|unit| format!("\"{number}{unit}\"")).collect();
            let example = examples.join(" or ");
            return Err(error!(
                Other,
                "{what} \"{text}\" has no unit: write for example {example}"
            ));
        }
        let size = self.size_of(unit).ok_or_else(|| {
            error!(Other, "{what} \"{text}\" has the unknown unit \"{unit}\": use one of")
                .names(unit, self.units.iter().map(|(name, _)| *name))
        })?;
        let si = value * size;
        if !si.is_finite() {
            return Err(self.out_of_range(text, "finite"));
        }
        Ok(si)
    }

    /// The unit of that size in SI, if one has it.
    pub(crate) fn name_of(&self, size: f64) -> Option<&'static str> {
        let same = |unit: f64| (unit / size - 1.0).abs() < 1e-9;
        self.units.iter().find(|(_, unit)| same(*unit)).map(|&(name, _)| name)
    }

    /// SI value of one `unit`, or `None` when the unit is not one of this quantity's.
    pub(crate) fn size_of(&self, unit: &str) -> Option<f64> {
        // Both signs of micro.
        let plain = unit.replace(['\u{b5}', '\u{3bc}'], "u");
        self.units.iter().find(|(name, _)| *name == plain).map(|&(_, size)| size)
    }

    /// Like [`Dimension::parse`], but refuses values that are not above zero.
    pub(crate) fn parse_positive(&self, text: &str) -> Result<f64, Error> {
        let value = self.parse(text)?;
        if value > 0.0 { Ok(value) } else { Err(self.out_of_range(text, "above zero")) }
    }

    /// Like [`Dimension::parse`], but refuses values below zero.
    pub(crate) fn parse_not_negative(&self, text: &str) -> Result<f64, Error> {
        let value = self.parse(text)?;
        if value >= 0.0 { Ok(value) } else { Err(self.out_of_range(text, "zero or above")) }
    }

    fn out_of_range(&self, text: &str, range: &str) -> Error {
        error!(Other, "{} \"{text}\" is out of range: it must be {range}", self.what)
    }

    /// The units of this quantity, for messages: `km/h, m/s, …`.
    pub(crate) fn known_units(&self) -> String {
        names(self.units)
    }

    fn example(&self) -> &'static str {
        match self.example_unit {
            "km/h" => "36km/h",
            "t" => "24t",
            "mm" => "30mm",
            "ms" => "0.75ms",
            "MN/m" => "80MN/m",
            _ => "500kN",
        }
    }
}

/// Whether the character at `i` still belongs to the number that `text` starts with.
/// An `e` does only when digits follow it, so that a unit may begin with one.
fn continues_number(text: &str, i: usize, c: char) -> bool {
    match c {
        '0'..='9' | '.' | '+' | '-' => true,
        'e' | 'E' => {
            text[i + 1..].trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_digit())
        }
        _ => false,
    }
}

/// The units in which a solver files are written; factors turn a file's value into SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitSystem {
    /// The files' unit of length, in m: 0.001 for mm.
    pub length_m: f64,
    /// The files' unit of mass, in kg: 1000 for t.
    pub mass_kg: f64,
    /// The files' unit of time, in s.
    pub time_s: f64,
}

const LENGTHS: &[(&str, f64)] =
    &[("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("in", 0.0254), ("ft", 0.3048)];
/// One pound in kg, and one pound-force in N.
const LB_KG: f64 = 0.45359237;
const LBF_N: f64 = LB_KG * 9.80665;
/// `slinch` and `slug` are those that a pound-force accelerates by 1 in/s² and 1 ft/s².
const MASSES: &[(&str, f64)] = &[
    ("kg", 1.0),
    ("t", 1e3),
    ("Mg", 1e3),
    ("g", 1e-3),
    ("lb", LB_KG),
    ("slug", LBF_N / 0.3048),
    ("slinch", LBF_N / 0.0254),
];
const TIMES: &[(&str, f64)] = &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];

impl UnitSystem {
    /// Metres, kilograms, seconds.
    pub const SI: Self = Self { length_m: 1.0, mass_kg: 1.0, time_s: 1.0 };
    /// Systems that crash models are written in.
    pub(crate) const USUAL: [&'static str; 5] = ["mm-t-s", "mm-kg-ms", "SI", "mm-g-ms", "cm-g-us"];

    /// Systems of inches and feet.
    pub(crate) const CUSTOMARY: [&'static str; 2] = ["in-slinch-s", "ft-slug-s"];

    /// The system in which a density and a Young's modulus are those of a metal: 1 600 to 9 000 kg/m³ and a speed of sound
    /// √(E/ρ) of 4.3 to 5.7 km/s. Steel, aluminium, magnesium and titanium have 5.0 to 5.2 km/s. No two of these
    /// systems differ by less than both windows are wide.
    pub(crate) fn of_metal(density: f64, modulus: f64) -> Option<Self> {
        const OTHERS: [&str; 4] = ["m-t-s", "cm-g-s", "mm-kg-s", "mm-g-s"];
        let names = Self::USUAL.iter().chain(&Self::CUSTOMARY).chain(&OTHERS);
        let systems = names.filter_map(|name| Self::parse(name).ok());
        systems.into_iter().find(|units| {
            let density = density * units.mass_kg / units.length_m.powi(3);
            let sound = (modulus * units.mass_kg / units.length_m).sqrt() / units.time_s;
            (1.6e3..9e3).contains(&density) && (4.3e3..5.7e3).contains(&(sound / density.sqrt()))
        })
    }

    /// Reads `"SI"` or three units in any order, such as `"mm-t-s"` or `"kg-mm-ms"`.
    pub fn parse(text: &str) -> Result<Self, Error> {
        if text.eq_ignore_ascii_case("si") {
            return Ok(Self::SI);
        }
        let unknown = || {
            let (lengths, masses, times) = (names(LENGTHS), names(MASSES), names(TIMES));
            error!(
                Other,
                "unit system \"{text}\" is not known: write \"SI\" or one unit each of length ({lengths}), mass ({masses}) and time ({times}), joined by \"-\", such as \"mm-t-s\" or \"kg-mm-ms\"{}",
                guess::hint(text, "SI, mm-t-s, kg-mm-ms, m-kg-s, mm-kg-ms, mm-g-ms")
            )
        };
        let (mut length, mut mass, mut time) = (None, None, None);
        for part in text.split(['-', ' ', ',', '/']).filter(|p| !p.is_empty()) {
            let slot_and_size = [(&mut length, LENGTHS), (&mut mass, MASSES), (&mut time, TIMES)]
                .into_iter()
                .find_map(|(slot, table)| size_in(table, part).map(|size| (slot, size)));
            let (slot, size) = slot_and_size.ok_or_else(unknown)?;
            if slot.replace(size).is_some() {
                return Err(unknown());
            }
        }
        match (length, mass, time) {
            (Some(length_m), Some(mass_kg), Some(time_s)) => Ok(Self { length_m, mass_kg, time_s }),
            _ => Err(unknown()),
        }
    }

    /// m/s in one unit of speed.
    pub fn speed(&self) -> f64 {
        self.length_m / self.time_s
    }

    /// m/s² in one unit of acceleration.
    pub fn acceleration(&self) -> f64 {
        self.length_m / (self.time_s * self.time_s)
    }

    /// N in one unit of force.
    pub fn force(&self) -> f64 {
        self.mass_kg * self.acceleration()
    }

    /// Names of its units of length, mass and time; `?` for one that has none.
    pub(crate) fn names(&self) -> (&'static str, &'static str, &'static str) {
        let name = |table: &[(&'static str, f64)], size: f64| {
            table.iter().find(|(_, unit)| *unit == size).map_or("?", |(name, _)| *name)
        };
        (name(LENGTHS, self.length_m), name(MASSES, self.mass_kg), name(TIMES, self.time_s))
    }
}

/// The name among `names`, each a thousand times the one before from an SI unit on, of a unit of
/// that size in SI; else what the system's units make of it.
pub(crate) fn named_or(size: f64, names: &[&str], made: impl FnOnce() -> String) -> String {
    let is_size = |k: usize| (size / 1e3f64.powi(k as i32) - 1.0).abs() < 1e-9;
    names.iter().enumerate().find(|(k, _)| is_size(*k)).map_or_else(made, |(_, n)| n.to_string())
}

fn size_in(table: &[(&str, f64)], unit: &str) -> Option<f64> {
    table.iter().find(|(n, _)| *n == unit).map(|&(_, size)| size)
}

fn names(table: &[(&str, f64)]) -> String {
    let names: Vec<_> = table.iter().map(|(n, _)| *n).collect();
    names.join(", ")
}

impl fmt::Display for UnitSystem {
    /// As it is written in a manifest: `SI`, `mm-t-s`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Self::SI {
            return f.write_str("SI");
        }
        let (length, mass, time) = self.names();
        write!(f, "{length}-{mass}-{time}")
    }
}

impl Serialize for UnitSystem {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
impl schemars::JsonSchema for UnitSystem {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "UnitSystem".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "examples": ["SI", "mm-t-s", "mm-kg-ms"] })
    }
}

impl<'de> Deserialize<'de> for UnitSystem {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).map_err(serde::de::Error::custom)
    }
}

/// Reads text, as which a bare number is taken: it gets the message of a missing unit, not that of
/// a wrong type.
pub(crate) struct TextVisitor<T> {
    pub expecting: &'static str,
    pub parse: fn(&str) -> Result<T, Error>,
}

impl<T> serde::de::Visitor<'_> for TextVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.expecting)
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<T, E> {
        (self.parse)(text).map_err(E::custom)
    }

    fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<T, E> {
        self.visit_str(&number.to_string())
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<T, E> {
        self.visit_str(&number.to_string())
    }
}

/// Values read from text with a unit in a TOML file, in SI.
macro_rules! texts_with_units {
    ($($(#[$doc:meta])* $name:ident: $dimension:ident.$parse:ident, $sign:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name(pub f64);

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                let expecting = "a number with a unit, in quotes";
                let parse = |text: &str| $dimension.$parse(text).map(Self);
                d.deserialize_any(TextVisitor { expecting, parse })
            }
        }

        #[cfg(test)]
        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }
            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                let units: Vec<&str> = $dimension.units.iter().map(|(name, _)| *name).collect();
                let units = units.join("|").replace("us", "[uµμ]s").replace("um", "[uµμ]m");
                let pattern = format!("^{}[0-9.eE+-]+ *({units})$", $sign);
                schemars::json_schema!({ "type": "string", "pattern": pattern })
            }
        }
    )*};
}

texts_with_units! {
    /// A speed in m/s, zero or above, written like `"36km/h"`.
    SpeedText: SPEED.parse_not_negative, "";
    /// A speed in m/s of either direction, written like `"-18km/h"`.
    SignedSpeedText: SPEED.parse, "-?";
    /// A speed in m/s, above zero, written like `"36km/h"`.
    ImpactSpeedText: SPEED.parse_positive, "";
    /// A mass in kg, above zero, written like `"24t"`.
    MassText: MASS.parse_positive, "";
    /// A length in m, zero or above, written like `"30mm"`.
    LengthText: LENGTH.parse_not_negative, "";
    /// A length in m, of either sign, written like `"-30mm"`.
    SignedLengthText: LENGTH.parse, "-?";
    /// A time in s, zero or above, written like `"35ms"`.
    InstantText: TIME.parse_not_negative, "";
    /// A time in s, above zero, written like `"0.75ms"`.
    TimeText: TIME.parse_positive, "";
    /// A force in N, zero or above, written like `"1.2MN"`.
    ForceText: FORCE.parse_not_negative, "";
    /// A stiffness in N/m, above zero, written like `"80MN/m"`.
    StiffnessText: STIFFNESS.parse_positive, "";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_numbers_with_units() {
        fn t(dimension: &Dimension, text: &str, expected: f64) {
            assert_eq!(dimension.parse(text).unwrap(), expected, "{text:?}");
        }
        t(&SPEED, "36km/h", 36.0 / 3.6);
        t(&MASS, "24t", 24_000.0);
        t(&SPEED, " 10 m/s", 10.0);
        t(&MASS, "24.0t", 24_000.0);
        t(&MASS, "2.4e4kg", 24_000.0);
        t(&TIME, "0.75ms", 0.75e-3);
        t(&STIFFNESS, "80MN/m", 80e6);
        t(&LENGTH, "-3mm", -0.003);
        t(&LENGTH, "5 \u{b5}m", 5.0 * 1e-6);
        t(&TIME, "5\u{3bc}s", 5.0 * 1e-6);
    }

    /// Steel, aluminium and magnesium in each system; what is not a metal in any.
    #[test]
    fn metals_have_units() {
        for name in
            ["mm-t-s", "mm-kg-ms", "SI", "mm-g-ms", "cm-g-us", "in-slinch-s", "ft-slug-s", "cm-g-s"]
        {
            let units = UnitSystem::parse(name).unwrap();
            for (density, modulus) in [(7850.0, 210e9), (2700.0, 68.9e9), (1770.0, 45e9)] {
                let density = density / units.mass_kg * units.length_m.powi(3);
                let modulus =
                    modulus * units.length_m * units.time_s * units.time_s / units.mass_kg;
                assert_eq!(UnitSystem::of_metal(density, modulus), Some(units), "{name}");
            }
        }
        // Polyamide, water, foam, a rigid body of tenfold density; nothing, and less.
        let others = [
            (1140.0, 3e9),
            (1000.0, 2.2e9),
            (50.0, 5e6),
            (78500.0, 210e9),
            (0.0, 0.0),
            (-1.0, 1.0),
        ];
        for (density, modulus) in others {
            assert_eq!(UnitSystem::of_metal(density, modulus), None, "{density}, {modulus}");
        }
    }

    #[test]
    fn says_what_to_write_instead() {
        fn t(dimension: &Dimension, text: &str, expected: &str) {
            assert_eq!(dimension.parse(text).unwrap_err().to_string(), expected);
        }
        t(&SPEED, "36", "speed \"36\" has no unit: write for example \"36km/h\" or \"36m/s\"");
        t(
            &SPEED,
            "36kmh",
            "speed \"36kmh\" has the unknown unit \"kmh\": use one of km/h, m/s, mm/ms, mm/s, mph; did you mean \"km/h\"?",
        );
        t(&MASS, "t24", "mass \"t24\" is not a number with a unit: write for example 24t");
        t(&SPEED, "1e999m/s", "speed \"1e999m/s\" is out of range: it must be finite");
    }

    #[test]
    fn the_largest_value_chooses_the_unit() {
        assert_eq!(Shown::force(2.4e6).text(3e4), "0.030 MN");
        assert_eq!(Shown::force(1.1e3).text(1.1e3), "1.100 kN");
        assert_eq!(Shown::force(99e3).text(99e3), "99.000 kN");
        assert_eq!(Shown::force(f64::NAN).text(0.5), "0.50 N");
        assert_eq!(Shown::mass(24.0).text(24.0), "24.00 kg");
        assert_eq!(Shown::mass(24e3).text(24e3), "24.00 t");
        assert_eq!(Shown::energy(1.2e6).text(1.2e6), "1.200 MJ");
        assert_eq!(Shown::stiffness(8e7).text(8e7), "80.0 MN/m");
        assert_eq!(Shown::stiffness(5e5).text(5e5), "500.0 kN/m");
    }

    #[test]
    fn unit_systems_in_any_order() {
        let a = UnitSystem::parse("mm-t-s").unwrap();
        assert_eq!(a, UnitSystem::parse("t-mm-s").unwrap());
        assert!((a.force() - 1.0).abs() < 1e-15, "mm-t-s forces are newtons");
        let b = UnitSystem::parse("kg-mm-ms").unwrap();
        assert!((b.force() - 1e3).abs() < 1e-9, "kg-mm-ms forces are kilonewtons");
        assert!(UnitSystem::parse("mm-s").is_err());
        assert!(UnitSystem::parse("mm-mm-s").is_err());
        assert!(UnitSystem::parse("furlong-t-s").is_err());
    }
}
