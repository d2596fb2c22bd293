//! Choosing cases of a database: by group, name, speed and tag.

use crate::error::{Error, error};
use crate::guess::hint;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use crate::curve::Case;
use crate::database::{CasePath, Database};
use crate::dataset::is_same_speed;
use crate::unit::{SPEED, km_per_h};

/// Which cases; every part that is given narrows the choice, and each value of a part widens it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Selection {
    /// Groups; all if empty.
    pub groups: Vec<String>,
    /// Names of cases, or `GROUP/NAME`; all if empty.
    pub cases: Vec<String>,
    /// Ranges of which one holds the impact speed; any if empty.
    pub speeds: Vec<SpeedRange>,
    /// Cases that have one of these; all if empty.
    pub tags: Vec<String>,
}

/// Speeds from one to another, both among them, in m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SpeedRange {
    /// The lowest; 0 if any is.
    pub low_m_per_s: f64,
    /// The highest; infinite if any is.
    pub high_m_per_s: f64,
}

impl FromStr for SpeedRange {
    type Err = Error;

    /// Reads `20km/h..40km/h`, an end of which may be left out, or one speed.
    fn from_str(text: &str) -> Result<Self, Error> {
        let Some((low, high)) = text.split_once("..") else {
            let speed = SPEED.parse_positive(text)?;
            return Ok(Self { low_m_per_s: speed, high_m_per_s: speed });
        };
        let end = |end: &str, open: f64| match end.trim() {
            "" => Ok(open),
            end => SPEED.parse_not_negative(end),
        };
        if low.trim().is_empty() && high.trim().is_empty() {
            return Err(error!(
                Usage,
                "\"{text}\" is not a range of speeds: write 20km/h..40km/h, ..40km/h, 20km/h.. or 36km/h"
            ));
        }
        let (low_m_per_s, high_m_per_s) = (end(low, 0.0)?, end(high, f64::INFINITY)?);
        if low_m_per_s <= high_m_per_s {
            Ok(Self { low_m_per_s, high_m_per_s })
        } else {
            Err(error!(Usage, "\"{text}\" ends below its start: write the lower speed first"))
        }
    }
}

impl fmt::Display for SpeedRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (low, high) = (self.low_m_per_s, self.high_m_per_s);
        match (low > 0.0, high.is_finite()) {
            _ if low == high => write!(f, "{}", km_per_h(low)),
            (true, true) => write!(f, "{} to {}", km_per_h(low), km_per_h(high)),
            (true, false) => write!(f, "at least {}", km_per_h(low)),
            _ => write!(f, "at most {}", km_per_h(high)),
        }
    }
}

impl SpeedRange {
    fn holds(&self, speed_m_per_s: f64) -> bool {
        let is_end = |end: f64| end > 0.0 && is_same_speed(speed_m_per_s, end);
        (self.low_m_per_s..=self.high_m_per_s).contains(&speed_m_per_s)
            || is_end(self.low_m_per_s)
            || is_end(self.high_m_per_s)
    }
}

const LISTED: usize = 20;

impl Selection {
    /// Whether it chooses nothing by itself: all cases.
    pub(crate) fn is_all(&self) -> bool {
        *self == Self::default()
    }

    /// Group, if it is stated, and name, if one case is named and nothing else is chosen by.
    pub(crate) fn only(&self) -> Option<(Option<&str>, &str)> {
        let Self { groups, cases, speeds, tags } = self;
        let ([case], [] | [_], [], []) = (&cases[..], &groups[..], &speeds[..], &tags[..]) else {
            return None;
        };
        match (case.split_once('/'), groups.first()) {
            (None, group) => Some((group.map(String::as_str), case)),
            (Some((own, name)), None) => Some((Some(own), name)),
            (Some((own, name)), Some(group)) => (own == group).then_some((Some(own), name)),
        }
    }

    /// The chosen cases, by group, speed and name; `path` is for messages.
    pub(crate) fn find<'a>(
        &self,
        path: &Path,
        database: &'a Database,
    ) -> Result<Vec<&'a Case>, Error> {
        for group in &self.groups {
            database.group(path, group)?;
        }
        let of_groups: Vec<&Case> = database
            .all()
            .filter(|case| self.groups.is_empty() || self.groups.contains(&case.id.group))
            .collect();
        let mut named: Vec<&Case> = Vec::new();
        for name in &self.cases {
            named.push(one_named(path, name, &of_groups)?);
        }
        let is_chosen = |case: &&Case| {
            (self.cases.is_empty() || named.iter().any(|c| CasePath::of(c) == CasePath::of(case)))
                && (self.speeds.is_empty()
                    || self.speeds.iter().any(|range| range.holds(case.conditions.speed.m_per_s)))
                && (self.tags.is_empty()
                    || self.tags.iter().any(|tag| case.provenance.tags.contains(tag)))
        };
        let chosen: Vec<&Case> = of_groups.iter().copied().filter(is_chosen).collect();
        if chosen.is_empty() {
            let (path, asked, known) = (path.display(), self.asked(), listed(&of_groups));
            return Err(error!(Database, "{path}: no case {asked}: there are {known}"));
        }
        Ok(chosen)
    }

    /// The selection, in words that follow "no case".
    fn asked(&self) -> String {
        let mut asked = Vec::new();
        if !self.cases.is_empty() {
            asked.push(format!("among {}", self.cases.join(", ")));
        }
        if !self.speeds.is_empty() {
            let ranges: Vec<String> = self.speeds.iter().map(ToString::to_string).collect();
            asked.push(format!("has a speed of {}", ranges.join(" or ")));
        }
        if !self.tags.is_empty() {
            let tags: Vec<String> = self.tags.iter().map(|tag| format!("\"{tag}\"")).collect();
            asked.push(format!("has the tag {}", tags.join(" or ")));
        }
        if asked.is_empty() { "is there".into() } else { asked.join(" and ") }
    }
}

fn one_named<'a>(path: &Path, name: &str, cases: &[&'a Case]) -> Result<&'a Case, Error> {
    let is_named = |case: &&&Case| match name.split_once('/') {
        Some((group, name)) => case.id.group == group && case.id.name == name,
        None => case.id.name == name,
    };
    let found: Vec<&Case> = cases.iter().filter(is_named).copied().collect();
    match found[..] {
        [case] => Ok(case),
        [] => {
            let (path, known) = (path.display(), listed(cases));
            let names: Vec<&str> = cases.iter().map(|case| case.id.name.as_str()).collect();
            let hint = hint(name.rsplit('/').next().unwrap_or(name), &names.join(", "));
            Err(error!(Database, "{path}: there is no case \"{name}\": there are {known}{hint}"))
        }
        _ => {
            let known: Vec<String> = found.iter().map(|c| CasePath::of(c).to_string()).collect();
            let (path, known) = (path.display(), known.join(" or "));
            Err(error!(
                Database,
                "{path}: several groups have a case \"{name}\": choose one with --group, or write {known}"
            ))
        }
    }
}

/// Cases with their speeds and tags, for a message.
fn listed(cases: &[&Case]) -> String {
    let shown = |case: &&Case| {
        let tags = if case.provenance.tags.is_empty() {
            String::new()
        } else {
            format!(", {}", case.provenance.tags.join(", "))
        };
        format!("{} ({}{tags})", CasePath::of(case), km_per_h(case.conditions.speed.m_per_s))
    };
    let names: Vec<String> = cases.iter().take(LISTED).map(shown).collect();
    match cases.len() - names.len() {
        0 if names.is_empty() => "none".into(),
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_speeds() {
        let range = |text: &str| text.parse::<SpeedRange>();
        let holds = |text: &str, km_per_h: f64| range(text).unwrap().holds(km_per_h / 3.6);
        assert!(holds("20km/h..40km/h", 20.0) && holds("20km/h..40km/h", 40.0));
        assert!(!holds("20km/h..40km/h", 19.9) && !holds("20km/h..40km/h", 40.1));
        assert!(holds("..40km/h", 1.0) && holds("10 m/s ..", 500.0));
        assert!(holds("36km/h", 36.01) && !holds("36km/h", 36.1), "as one speed counts");
        let said = |text: &str| range(text).unwrap_err().to_string();
        assert_eq!(
            said("40km/h..20km/h"),
            "\"40km/h..20km/h\" ends below its start: write the lower speed first"
        );
        assert!(said("..").contains("write 20km/h..40km/h"), "{}", said(".."));
        assert!(said("20..40").contains("speed \"20\" has no unit"), "{}", said("20..40"));
    }
}
