//! Labels of columns and axes: which quantity a text such as `displacement [mm]` or `F_kN` names,
//! and its unit.

use super::error::{ContentError, Place, shown};
use crate::unit::{Dimension, FORCE, LENGTH, TIME, UnitSystem};

/// What a column of a curve's file can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Deflection,
    Force,
    Time,
}

/// Names of each quantity, without blanks and marks, in lower case.
const NAMES: [(Quantity, &[&str]); 3] = [
    (
        Quantity::Deflection,
        &[
            "d",
            "x",
            "s",
            "u",
            "deflection",
            "displacement",
            "xdisplacement",
            "disp",
            "crush",
            "stroke",
            "compression",
            "deformation",
            "intrusion",
            "travel",
        ],
    ),
    (
        Quantity::Force,
        &["f", "force", "load", "contactforce", "bodyforce", "normalforce", "xforce"],
    ),
    (Quantity::Time, &["t", "time"]),
];

impl Quantity {
    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Deflection => "deflection",
            Self::Force => "force",
            Self::Time => "time",
        }
    }

    /// What its column could be called.
    pub fn example(self) -> &'static str {
        match self {
            Self::Deflection => "d_m or d_mm",
            Self::Force => "force_N or force_kN",
            Self::Time => "t_s or t_ms",
        }
    }

    pub fn dimension(self) -> &'static Dimension {
        match self {
            Self::Deflection => &LENGTH,
            Self::Force => &FORCE,
            Self::Time => &TIME,
        }
    }

    /// SI value of its unit in a system.
    pub fn size_in(self, units: UnitSystem) -> f64 {
        match self {
            Self::Deflection => units.length_m,
            Self::Force => units.force(),
            Self::Time => units.time_s,
        }
    }

    fn named(name: &str) -> Option<Self> {
        let plain: String =
            name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
        NAMES.iter().find(|(_, names)| names.contains(&&*plain)).map(|(quantity, _)| *quantity)
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
    pub fn of_axis(text: &str) -> Option<Self> {
        let by_unit = || {
            let (_, unit) = in_brackets(text.trim())?;
            let quantities = NAMES.iter().map(|(quantity, _)| *quantity);
            let quantity =
                quantities.into_iter().find(|q| q.dimension().size_of(unit).is_some())?;
            Some(Self { quantity, unit: Some(unit.into()) })
        };
        Self::parse(text).or_else(by_unit)
    }

    /// What a text names; `None` if that is nothing of a curve.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim().trim_matches('"').trim();
        if let Some((name, unit)) = in_brackets(text) {
            let quantity = Quantity::named(name)?;
            return Some(Self { quantity, unit: Some(unit.into()) });
        }
        if let Some((name, unit)) = text.rsplit_once('/')
            && let Some(quantity) = Quantity::named(name)
        {
            return Some(Self { quantity, unit: Some(unit.trim().into()) });
        }
        if let Some((name, unit)) = text.rsplit_once(['_', ' '])
            && let Some(quantity) = Quantity::named(name)
            && quantity.dimension().size_of(unit).is_some()
        {
            return Some(Self { quantity, unit: Some(unit.into()) });
        }
        Some(Self { quantity: Quantity::named(text)?, unit: None })
    }

    /// SI value of one unit: the label's own, else that of the given system.
    ///
    /// # Errors
    /// [`ContentError::UnknownUnit`], or [`ContentError::NoUnit`] without either.
    pub fn size(
        &self,
        text: &str,
        given: Option<UnitSystem>,
        place: Place,
    ) -> Result<f64, ContentError> {
        let what = self.quantity.name();
        match (&self.unit, given) {
            (Some(unit), _) => self.quantity.dimension().size_of(unit).ok_or_else(|| {
                let known = self.quantity.dimension().known_units();
                ContentError::UnknownUnit { place, what, unit: shown(unit), known }
            }),
            (None, Some(units)) => Ok(self.quantity.size_in(units)),
            (None, None) => {
                let example = self.quantity.example();
                Err(ContentError::NoUnit { place, what, found: shown(text), example })
            }
        }
    }
}

/// `name [unit]` or `name (unit)`, apart.
fn in_brackets(text: &str) -> Option<(&str, &str)> {
    let open = match text.chars().last()? {
        ']' => '[',
        ')' => '(',
        _ => return None,
    };
    let at = text.rfind(open)?;
    Some((&text[..at], text[at + 1..text.len() - 1].trim()))
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
        t("t_s", Some((Time, Some("s"))));
        t("deflection", Some((Deflection, None)));
        t("Force [lbf]", Some((Force, Some("lbf"))));
        t("force_low_N", None);
        t("force_KN", None);
        t("", None);
        t(")", None);
        t("€]", None);
    }
}
