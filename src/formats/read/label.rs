//! Labels of columns and axes: which quantity a text such as `displacement [mm]` or `F_kN` names,
//! and its unit.

use super::curve::{Place, shown};
use crate::error::{Error, error};
use crate::guess;
use crate::unit::{Dimension, FORCE, LENGTH, TIME, UnitSystem};

/// What a column of a curve's file can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Deflection,
    Force,
    Time,
}

/// Names of a quantity: words separated by blanks, in lower case.
pub(super) struct Terms {
    /// In messages.
    pub name: &'static str,
    /// What its column could be called.
    pub example: &'static str,
    /// The option that names its column.
    pub option: &'static str,
    dimension: &'static Dimension,
    /// Its dimension in labels that state the size of their unit.
    stated: &'static str,
    /// Its names, without blanks and marks.
    names: &'static str,
    /// Its names, also as words within the name of a column.
    words: &'static str,
    /// The end of other words, such as Standardkraft and Traversenweg.
    ending: Option<&'static str>,
}

/// By quantity.
static TERMS: [Terms; 3] = [
    Terms {
        name: "deflection",
        example: "d_m or d_mm",
        option: "--deflection-column",
        dimension: &LENGTH,
        stated: "length displacement",
        names: "d x s u xdisplacement",
        words: "deflection displacement disp crush stroke compression deformation intrusion travel extension weg verschiebung verformung stauchung",
        ending: Some("weg"),
    },
    Terms {
        name: "force",
        example: "force_N or force_kN",
        option: "--force-column",
        dimension: &FORCE,
        stated: "force",
        names: "f fx fy fz contactforce bodyforce normalforce xforce",
        words: "force load kraft",
        ending: Some("kraft"),
    },
    Terms {
        name: "time",
        example: "t_s or t_ms",
        option: "--time-column",
        dimension: &TIME,
        stated: "time",
        names: "t",
        words: "time zeit",
        ending: None,
    },
];

/// With one of these words a name is that of another quantity: an edge, a bound, a rate.
const OTHERS: &str = "low lo lower high hi upper min max std deviation error tolerance rate target setpoint command nominal soll";

/// Units that make a column `T` that of a temperature, in lower case.
const OF_TEMPERATURE: &str = "°c ºc c degc gradc k °f degf celsius kelvin";

/// Whether a word is one of several with blanks between.
fn is_one(word: &str, of: &str) -> bool {
    of.split(' ').any(|one| one == word)
}

impl Quantity {
    /// In the order in which they are matched with an axis.
    pub(super) const ALL: [Self; 3] = [Self::Deflection, Self::Force, Self::Time];

    pub(super) fn terms(self) -> &'static Terms {
        &TERMS[self as usize]
    }

    /// SI value of its unit in a system.
    pub(super) fn size_in(self, units: UnitSystem) -> f64 {
        match self {
            Self::Deflection => units.length_m,
            Self::Force => units.force(),
            Self::Time => units.time_s,
        }
    }

    /// Whether a column called `T` is that of a temperature, as `T [°C]`.
    fn is_temperature(self, unit: &str) -> bool {
        let unit = unit.to_lowercase().replace(' ', "");
        self == Self::Time && is_one(&unit, OF_TEMPERATURE)
    }

    pub(super) fn named(name: &str) -> Option<Self> {
        let plain: String =
            name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
        let is_named = |quantity: &Self| {
            let Terms { names, words, .. } = quantity.terms();
            is_one(&plain, names) || is_one(&plain, words)
        };
        Self::ALL.into_iter().find(is_named)
    }

    /// The only quantity named by words of a name.
    fn within(name: &str) -> Option<Self> {
        let named = Self::all_within(name);
        let first = *named.first()?;
        named.iter().all(|other| *other == first).then_some(first)
    }

    /// The quantities named by words of a text; none if it names an edge, a bound or a rate.
    pub(super) fn all_within(text: &str) -> Vec<Self> {
        let text = text.to_lowercase();
        let words = || text.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
        if words().any(|word| is_one(word, OTHERS)) {
            return Vec::new();
        }
        let of_word = |word: &str| {
            let is_whole = |quantity: &Self| is_one(word, quantity.terms().words);
            let is_end = |q: &Self| q.terms().ending.is_some_and(|end| word.ends_with(end));
            Self::ALL.into_iter().find(is_whole).or_else(|| Self::ALL.into_iter().find(is_end))
        };
        words().filter_map(of_word).collect()
    }

    /// SI value of a unit of this quantity, also of one that states it, as `LENGTH/0.001` does.
    pub(super) fn size_of(self, unit: &str) -> Option<f64> {
        if let Some((dimension, size)) = unit.split_once('/') {
            let size = size.trim().parse().ok().filter(|size: &f64| size.is_normal());
            let is_its = is_one(&dimension.trim().to_ascii_lowercase(), self.terms().stated);
            return size.filter(|size| is_its && *size > 0.0);
        }
        self.terms().dimension.size_of(unit)
    }

    /// The same, or what is wrong with the unit.
    pub(super) fn known_size_of(self, unit: &str, place: Place) -> Result<f64, Error> {
        self.size_of(unit).ok_or_else(|| {
            let (what, known, unit) =
                (self.terms().name, self.terms().dimension.known_units(), shown(unit));
            let hint = guess::hint(&unit, &known);
            error!(
                CurveFile,
                "{place}: the unit \"{unit}\" of the {what} is not known: use one of {known}{hint}"
            )
        })
    }
}

/// A label that names a quantity of a curve.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Label {
    pub quantity: Quantity,
    /// As it is written; `None` if there is none.
    pub unit: Option<String>,
}

impl Label {
    /// What an axis shows: by its name, or by its unit in brackets alone.
    pub(super) fn of_axis(text: &str) -> Option<Self> {
        let by_unit = || {
            let (_, unit) = in_brackets(text.trim())?;
            let quantity = Quantity::ALL.into_iter().find(|q| q.size_of(unit).is_some())?;
            Some(Self { quantity, unit: Some(unit.into()) })
        };
        Self::parse(text).or_else(by_unit)
    }

    /// What a column holds: by its name, or by a word within its name such as `Y Force [kN]`.
    pub(super) fn of_column(text: &str) -> Option<Self> {
        let within = || {
            let (name, unit) = name_and_unit(text);
            let quantity = Quantity::within(name)?;
            let is_its = unit.is_none_or(|unit| quantity.size_of(unit).is_some());
            is_its.then(|| Self { quantity, unit: unit.map(Into::into) })
        };
        Self::parse(text).or_else(within)
    }

    /// The column of a quantity that the user has named: with the unit of its header.
    pub(super) fn of_named(quantity: Quantity, text: &str) -> Self {
        let (_, unit) = name_and_unit(text);
        Self { quantity, unit: unit.map(Into::into) }
    }

    /// What a text names; `None` if that is not a quantity of a curve.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let text = text.trim().trim_matches('"').trim();
        if let Some((name, unit)) = in_brackets(text) {
            let quantity = Quantity::named(name)?;
            return (!quantity.is_temperature(unit))
                .then(|| Self { quantity, unit: Some(unit.into()) });
        }
        if let Some((name, unit)) = text.rsplit_once('/')
            && let Some(quantity) = Quantity::named(name)
        {
            let is_its = !quantity.is_temperature(unit);
            return is_its.then(|| Self { quantity, unit: Some(unit.trim().into()) });
        }
        if let Some((name, unit)) = text.rsplit_once(['_', ' '])
            && let Some(quantity) = Quantity::named(name)
            && quantity.size_of(unit).is_some()
        {
            return Some(Self { quantity, unit: Some(unit.into()) });
        }
        Some(Self { quantity: Quantity::named(text)?, unit: None })
    }

    /// SI value of one unit: the label's own, else that of the given system.
    pub(super) fn size(
        &self,
        text: &str,
        given: Option<UnitSystem>,
        place: Place,
    ) -> Result<f64, Error> {
        match (&self.unit, given) {
            (Some(unit), _) => self.quantity.known_size_of(unit, place),
            (None, Some(units)) => Ok(self.quantity.size_in(units)),
            (None, None) => {
                let Terms { name, example, .. } = self.quantity.terms();
                Err(no_unit(place, name, text, example))
            }
        }
    }
}

/// Neither the file nor the user gives the unit.
pub(super) fn no_unit(place: Place, what: &str, found: &str, example: &str) -> Error {
    let found = shown(found);
    error!(
        CurveFile,
        "{place}: the {what} has no unit (\"{found}\"): write it as {example}, or give the file's units with --units (of crumple export: --input-units), such as mm-t-s or SI"
    )
}

/// `name [unit]`, `name (unit)` or T/HIS' `name <LENGTH/0.001>;`, apart.
fn in_brackets(text: &str) -> Option<(&str, &str)> {
    let text = text.trim_end_matches([';', ' ']);
    let open = match text.chars().last()? {
        ']' => '[',
        ')' => '(',
        '>' => '<',
        _ => return None,
    };
    let at = text.rfind(open)?;
    Some((&text[..at], text[at + 1..text.len() - 1].trim()))
}

/// The name of a column and its unit: in brackets, or after a slash, comma, blank or underscore.
pub(super) fn name_and_unit(text: &str) -> (&str, Option<&str>) {
    let text = text.trim().trim_matches('"').trim();
    if let Some((name, unit)) = in_brackets(text) {
        return (name, Some(unit));
    }
    match text.rsplit_once(['/', ',', ' ', '_']) {
        Some((name, unit)) if is_unit(unit.trim()) => (name, Some(unit.trim())),
        _ => (text, None),
    }
}

/// Whether a text is a unit of a curve's columns.
pub(super) fn is_unit(text: &str) -> bool {
    Quantity::ALL.iter().any(|quantity| quantity.size_of(text).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_name_quantities_and_units() {
        fn t(text: &str, expected: Option<(Quantity, Option<&str>)>) {
            let found = Label::parse(text);
            let found = found.as_ref().map(|l| (l.quantity, l.unit.as_deref()));
            assert_eq!(found, expected, "{text}");
        }
        use Quantity::{Deflection, Force, Time};
        for text in ["d_mm", "displacement [mm]", "Displacement (mm)", "s/mm", "CRUSH_mm"] {
            t(text, Some((Deflection, Some("mm"))));
        }
        t("x [m]", Some((Deflection, Some("m"))));
        t("X-Displacement[ cm ]", Some((Deflection, Some("cm"))));
        for text in ["F_kN", "Force [kN]", "load (kN)", "contact_force_kN", "force kN"] {
            t(text, Some((Force, Some("kN"))));
        }
        t("time [ms]", Some((Time, Some("ms"))));
        t("Crush <LENGTH/0.001>;", Some((Deflection, Some("LENGTH/0.001"))));
        assert_eq!(Force.size_of("FORCE/1000"), Some(1e3));
        assert_eq!(Force.size_of("LENGTH/1000").or(Force.size_of("FORCE/0")), None);
        t("t_s", Some((Time, Some("s"))));
        t("deflection", Some((Deflection, None)));
        t("Force [lbf]", Some((Force, Some("lbf"))));
        t("force_low_N", None);
        t("force_KN", None);
        t("", None);
        t(")", None);
        t("€]", None);
    }

    #[test]
    fn columns_are_told_by_words_of_their_names() {
        fn t(text: &str, expected: Option<(Quantity, Option<&str>)>) {
            let found = Label::of_column(text);
            let found = found.as_ref().map(|l| (l.quantity, l.unit.as_deref()));
            assert_eq!(found, expected, "{text}");
        }
        use Quantity::{Deflection, Force, Time};
        for text in ["Y Force [kN]", "Force, contact [kN]", "Kraft / kN", "Standardkraft in kN"] {
            t(text, Some((Force, Some("kN"))));
        }
        for text in ["Displacement (X) [mm]", "Weg / mm", "Compression mm", "Traversenweg,mm"] {
            t(text, Some((Deflection, Some("mm"))));
        }
        t("Zeit [µs]", Some((Time, Some("µs"))));
        t("Fz", Some((Force, None)));
        t("Force of cell 2", Some((Force, None)));
        t("force_low_N", None);
        t("Force rate [kN/s]", None);
        t("Displacement rate [mm/s]", None);
        t("Load displacement [mm]", None);
        t("Reinforced [mm]", None);
        t("Temperature [°C]", None);
        t("T [°C]", None);
        t("T [K]", None);
        t("T/° C", None);
        t("t [sek]", Some((Time, Some("sek"))));
    }
}
