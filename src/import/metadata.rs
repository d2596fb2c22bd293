//! Metadata given by the user combined with those of the file.

use super::{Item, Settings};
use crate::curve::{Case, ForceKind, Masses};
use crate::error::{Error, error};
use crate::formats::read::Metadata;
use crate::unit::{Shown, Speed, SpeedKind, km_per_h};

/// Two values this close are one.
const SAME: f64 = 0.01;

/// What is stated of a file and what was found in it: stated values take precedence, and a warning
/// says where the file differs.
pub(super) struct StatedAndFound<'a> {
    pub item: &'a Item,
    pub settings: &'a Settings,
    pub facts: &'a Metadata,
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

impl StatedAndFound<'_> {
    /// The impact of the curve, and which force it is. `group`: a case that is there, whose kind of
    /// speed is the default.
    pub(super) fn impact(
        &mut self,
        group: Option<&Case>,
    ) -> Result<(Speed, Masses, ForceKind), Error> {
        let kind = self.kind(group)?;
        let speeds = (self.item.speed_m_per_s, self.facts.speed_m_per_s);
        let m_per_s = self.either("speed", speeds, km_per_h)?;
        let m_per_s =
            m_per_s.ok_or_else(|| self.missing("its speed", "--speed, such as --speed 36km/h"))?;
        let masses = self.masses(kind)?;
        let force = self.force()?;
        // Reports a stated unloading stiffness that differs from the file's; the choice is made elsewhere.
        let stated = self.settings.unloading_stiffness_n_per_m;
        let both = (stated, stated.and(self.facts.unloading_stiffness_n_per_m));
        self.either("unloading stiffness", both, Shown::one_stiffness)?;
        Ok((Speed { m_per_s, kind }, masses, force))
    }

    fn missing(&self, what: &'static str, option: &'static str) -> Error {
        error!(
            Usage,
            "{path}: the file does not state {what}: give {option}",
            path = self.item.path.display()
        )
    }

    /// The stated value, else the file's, above 0.
    fn either(
        &mut self,
        what: &'static str,
        (stated, found): (Option<f64>, Option<f64>),
        shown: fn(f64) -> String,
    ) -> Result<Option<f64>, Error> {
        if let (Some(stated), Some(found)) = (stated, found)
            && (stated / found - 1.0).abs() > SAME
        {
            let (stated, found) = (shown(stated), shown(found));
            self.warnings.push(format!("{what}: the file states {found}; {stated} is used"));
        }
        let value = stated.or(found);
        match value.filter(|v| !(*v > 0.0 && v.is_finite())) {
            Some(value) => Err(error!(
                Import,
                "{path}: its {what} is {value}: expected more than 0",
                path = self.item.path.display()
            )),
            None => Ok(value),
        }
    }

    fn kind(&mut self, group: Option<&Case>) -> Result<SpeedKind, Error> {
        if let (Some(stated), Some(found)) = (self.settings.kind, self.facts.speed_kind)
            && stated != found
        {
            let (stated, found) = (stated.name(), found.name());
            self.warnings.push(format!("speed: the file states {found}; {stated} is used"));
        }
        match (self.settings.kind, self.facts.speed_kind, group) {
            (Some(kind), ..) | (None, Some(kind), _) => Ok(kind),
            (None, None, Some(case)) => {
                self.notes
                    .push(format!("speed: {} as in the group", case.conditions.speed.kind.name()));
                Ok(case.conditions.speed.kind)
            }
            (None, None, None) => Err(self.missing(
                "what its speed is measured against",
                "--kind wall (against a rigid wall) or --kind closing (of two bodies)",
            )),
        }
    }

    fn masses(&mut self, kind: SpeedKind) -> Result<Masses, Error> {
        let shown = |kg: f64| {
            if kg < 1e3 { format!("{kg} kg") } else { format!("{} t", kg / 1e3) }
        };
        let mass = self.either("mass", (self.settings.mass_kg, self.facts.mass_kg), shown)?;
        let others = (self.settings.other_mass_kg, self.facts.other_mass_kg);
        let other = self.either("other mass", others, shown)?;
        let body_kg =
            mass.ok_or_else(|| self.missing("the mass of the body", "--mass, such as --mass 24t"))?;
        let other_kg = match (kind, other) {
            (SpeedKind::Wall, _) if self.settings.other_mass_kg.is_some() => {
                return Err(error!(
                    Usage,
                    "{path}: a wall has no mass: remove --other-mass, or use --kind closing",
                    path = self.item.path.display()
                ));
            }
            (SpeedKind::Wall, _) => None,
            (SpeedKind::Closing, Some(other)) => Some(other),
            (SpeedKind::Closing, None) => {
                self.notes.push("other mass: that of the body".into());
                Some(body_kg)
            }
        };
        Ok(Masses { body_kg, other_kg })
    }

    fn force(&mut self) -> Result<ForceKind, Error> {
        match (self.facts.force, self.settings.read.force) {
            (Some(found), Some(asked)) if found != asked => Err(error!(
                Usage,
                "{path}: the file holds the {} force, not the {}: remove --force",
                found.name(),
                asked.name(),
                path = self.item.path.display()
            )),
            (Some(force), _) | (None, Some(force)) => Ok(force),
            (None, None) => {
                self.notes.push(
                    "force: taken as the contact force, because nothing states which it is".into(),
                );
                Ok(ForceKind::Contact)
            }
        }
    }
}
