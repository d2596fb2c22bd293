//! Checking a database file: every dataset is read, and values that are stored twice or follow from
//! the curves are compared with each other.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use serde::Serialize;

use super::layout::{self, ATTRIBUTES, BODY_FORCE, Content, OLDEST};
use super::opened::{self, FoundCase, FoundGroup, Opened};
use super::{group, listed};
use crate::curve::body::body_force_n;
use crate::curve::{Case, Curve, EnergyAudit, ForceKind, energy, group as siblings, loading};
use crate::error::Error;
use crate::hdf5::{AttrValue, Group};
use crate::history::time_gaps;
use crate::signal::interpolate;

/// Something to check before a case is trusted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Finding {
    /// Group of the case.
    pub group: String,
    /// Name of the case.
    pub case: String,
    /// Kind of finding, such as `altered` or `time_gap`.
    pub code: &'static str,
    /// Path of the dataset in the case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// Index of the value in it, counted from 0 as HDF5's tools do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub index: Option<usize>,
    /// What was found, in words.
    pub message: String,
}

/// What a check has found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Checked {
    /// Number of cases.
    pub cases: usize,
    /// What was found, in the order of the file.
    pub findings: Vec<Finding>,
}

/// Checks the database file at `path`; damage of a case is a finding.
pub(crate) fn check(path: &Path) -> Result<Checked, Error> {
    // Each has its own bound of bytes, and every dataset is read twice.
    let (raw, decoded) = (opened::open(path)?, opened::open(path)?);
    let mut checked = Checked::default();
    for group in raw.groups()? {
        let mut readable = Vec::new();
        let before = checked.findings.len();
        for (name, case) in &group.cases {
            checked.cases += 1;
            let mut findings =
                Findings { group: &group.name, case: name, list: &mut checked.findings };
            findings.datasets(&raw, case);
            match decoded.case(&group.name, name, case) {
                Ok(found) => {
                    findings.case(&found)?;
                    findings.body_force(&decoded, case, &found.case);
                    readable.push(found.case);
                }
                // Already reported for its datasets, with their indices.
                Err(_) if findings.has_damage() => {}
                Err(error) => {
                    let own = format!("{}: {}/{name}", path.display(), group.name);
                    let Some(within) = error.message().strip_prefix(&own) else {
                        return Err(error);
                    };
                    let within = within.trim_start_matches(['/', ':', ' ']);
                    findings.add("damaged", None, None, within.into());
                }
            }
        }
        super::sort(&mut readable);
        // Of cases that are not what was written the stopped mass is another, and another version of the
        // program may have found another.
        let is_altered = |f: &Finding| f.code == "altered" || DAMAGE.contains(&f.code);
        let is_as_written = raw.is_of_this_program()?
            && readable.len() == group.cases.len()
            && !checked.findings[before..].iter().any(is_altered);
        let is_altered = checked.findings[before..].iter().any(is_altered);
        of_group(&group, &readable, &mut checked.findings);
        if !is_altered {
            // What is unusual in cases compared with their group.
            for (case, code, message) in siblings::remarks(&readable) {
                Findings { group: &group.name, case: &case, list: &mut checked.findings }
                    .add(code, None, None, message);
            }
        }
        if is_as_written {
            of_stopped_mass(&raw, &group.name, &readable, &mut checked.findings)?;
        }
    }
    Ok(checked)
}

/// Takes the findings of one case.
struct Findings<'a> {
    group: &'a str,
    case: &'a str,
    list: &'a mut Vec<Finding>,
}

/// Names of the datasets of a case, the times of each curve first.
const DATASETS: [&str; 8] = [
    "time_s",
    "deflection_m",
    "force_N",
    "closing_speed_m_per_s",
    BODY_FORCE,
    "original/time_s",
    "original/deflection_m",
    "original/force_N",
];

/// Codes of findings without which a case could be decoded.
const DAMAGE: [&str; 4] = ["unreadable", "not_finite", "length", "time_order"];

impl Findings<'_> {
    fn add(
        &mut self,
        code: &'static str,
        dataset: Option<&str>,
        index: Option<usize>,
        message: String,
    ) {
        self.list.push(Finding {
            group: self.group.into(),
            case: self.case.into(),
            code,
            dataset: dataset.map(Into::into),
            index,
            message,
        });
    }

    fn has_damage(&self) -> bool {
        let own = |f: &&Finding| f.group == self.group && f.case == self.case;
        self.list.iter().rev().take_while(own).any(|f| DAMAGE.contains(&f.code))
    }

    /// Checks every value.
    fn datasets(&mut self, opened: &Opened<'_>, case: &Group) {
        let hashes = opened.hashes(case);
        let mut states = 0;
        for path in DATASETS {
            if path == BODY_FORCE && opened.version == OLDEST {
                continue;
            }
            let [unit, _] = layout::labels(path);
            let stored = case.dataset(path).and_then(|dataset| dataset.attrs());
            if let Some(found) = stored.ok().and_then(|mut of| of.remove(unit.0))
                && found.as_str() != unit.1.as_str()
            {
                let found = found.as_str().unwrap_or("not a text");
                let message = format!(
                    "the {} of {path} are \"{found}\", and its values are read in {}",
                    unit.0,
                    unit.1.as_str().unwrap_or_default()
                );
                self.add("attribute_differs", Some(path), None, message);
            }
            let values = match opened.values(case, path) {
                Ok(values) => values,
                Err(detail) => {
                    self.add("unreadable", Some(path), None, detail);
                    continue;
                }
            };
            if path.ends_with("time_s") {
                states = values.len();
                if states < 2 {
                    let message = format!("{path} has {states} values: expected at least 2");
                    self.add("length", Some(path), None, message);
                }
                if let Some(i) = values.windows(2).position(|w| w[1] <= w[0]) {
                    let message = format!(
                        "{path}[{}] is {}, not after {path}[{i}] = {}",
                        i + 1,
                        values[i + 1],
                        values[i]
                    );
                    self.add("time_order", Some(path), Some(i + 1), message);
                }
            } else if values.len() != states {
                let times = if path.contains('/') { "original/time_s" } else { "time_s" };
                let message = format!("{path} has {} values, {times} has {states}", values.len());
                self.add("length", Some(path), None, message);
            }
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let message = format!("{path}[{i}] is {}: expected a finite number", values[i]);
                self.add("not_finite", Some(path), Some(i), message);
            }
            if let Some(hashes) = &hashes
                && hashes.get(path).is_none_or(|hash| *hash != layout::hash_of(&values))
            {
                // A value that is not a number is named already.
                let is_known = values.iter().all(|v| v.is_finite());
                let odd = least_like_neighbours(&values).filter(|_| is_known);
                let which = odd.map_or(String::new(), |i| {
                    format!(
                        "; the one that fits its neighbours least is {path}[{i}] = {}",
                        values[i]
                    )
                });
                let message =
                    format!("the values of {path} differ from those that were written{which}");
                self.add("altered", Some(path), odd, message);
            }
        }
    }

    /// Compares stored values with those that follow from the curves.
    fn case(&mut self, found: &FoundCase) -> Result<(), Error> {
        let FoundCase { case, attributes, hashes } = found;
        let content = Content::of(case)?;
        if hashes.get(ATTRIBUTES) != content.hashes().get(ATTRIBUTES) {
            let message = "its attributes differ from those that were written".into();
            self.add("altered", None, None, message);
        }
        self.attributes(&content, attributes);
        self.audit(case);
        let stiffness = loading::unloading_stiffness(&case.curves.original);
        let stored = case.curves.unloading_stiffness_n_per_m;
        if stored.is_some() != stiffness.is_some()
            || stored.zip(stiffness).is_some_and(|(a, b)| !is_same(a, b))
        {
            let shown = |k: Option<f64>| k.map_or("absent".into(), |k| format!("{k} N/m"));
            let message = format!(
                "unloading_stiffness_N_per_m is {}, the curve's is {}",
                shown(stored),
                shown(stiffness)
            );
            self.add("attribute_differs", None, None, message);
        }
        self.sampled("deflection_m", case, Curve::deflection_m);
        self.sampled("force_N", case, Curve::force_n);
        for (path, curve) in
            [("time_s", &case.curves.sampled), ("original/time_s", &case.curves.original)]
        {
            for gap in time_gaps(curve.time_s()) {
                self.add("time_gap", Some(path), Some(gap.state), format!("{path}: {gap}"));
            }
        }
        if case.is_truncated() {
            self.add("truncated", None, None, "the run ended while loading".into());
        }
        if stiffness.is_none() {
            let message = "the record does not hold the unloading branch".into();
            self.add("no_unloading", None, None, message);
        }
        for warning in &case.quality.warnings {
            self.add("extraction", None, None, warning.clone());
        }
        Ok(())
    }

    /// Attributes that follow from others or from the curve.
    fn attributes(&mut self, content: &Content<'_>, stored: &HashMap<String, AttrValue>) {
        for (name, expected) in &content.attributes {
            let Some(expected) = number(expected) else { continue };
            match stored.get(*name).and_then(number) {
                Some(found) if is_same(found, expected) => {}
                Some(found) => {
                    let message =
                        format!("{name} is {found}, by the case's other values {expected}");
                    self.add("attribute_differs", None, None, message);
                }
                None => {
                    let message = format!("attribute {name} is missing or not a number");
                    self.add("attribute_differs", None, None, message);
                }
            }
        }
    }

    fn audit(&mut self, case: &Case) {
        let audit =
            energy::audit(&case.curves.original, case.conditions.masses, case.conditions.speed);
        let ratio = audit.ratio();
        let (least, most) = energy::POSSIBLE;
        // A run that ended while loading has not stopped its body yet.
        if !(least..=most).contains(&ratio) && !case.is_truncated() {
            let message = format!(
                "W/E is {ratio:.4}, outside of {least} to {most}: mass, speed or units of the run are wrong"
            );
            self.add("energy_impossible", None, None, message);
        } else if (ratio - 1.0).abs() > EnergyAudit::TOLERANCE {
            let of_contact = match case.curves.force_kind {
                ForceKind::Contact if ratio > 1.0 => ": a contact force also stops the crush zone",
                _ => "",
            };
            let message = format!("W/E is {ratio:.4}, off by more than 5 %{of_contact}");
            self.add("energy_mismatch", None, None, message);
        }
        let pairs = [
            ("work", case.quality.audit.work_j, audit.work_j),
            ("kinetic energy", case.quality.audit.kinetic_j, audit.kinetic_j),
        ];
        for (what, stored, own) in pairs {
            if !is_same(stored, own) {
                let message = format!("the stored {what} {stored} J is not the curve's {own} J");
                self.add("audit_differs", None, None, message);
            }
        }
    }

    /// The curve at the common interval is the original one, interpolated.
    fn sampled(&mut self, name: &str, case: &Case, column: fn(&Curve) -> &[f64]) {
        let (sampled, original) = (&case.curves.sampled, &case.curves.original);
        let values = column(sampled);
        let expected = interpolate(original.time_s(), column(original), sampled.time_s());
        let Ok(expected) = expected else {
            let message = "time_s goes beyond original/time_s".into();
            return self.add("sampled_differs", Some("time_s"), None, message);
        };
        if let Some(i) = first_difference(values, &expected) {
            let message = format!(
                "{name}[{i}] is {}, original/{name} has {} at this time",
                values[i], expected[i]
            );
            self.add("sampled_differs", Some(name), Some(i), message);
        }
    }

    /// The body force is that of the closing speed.
    fn body_force(&mut self, opened: &Opened<'_>, group: &Group, case: &Case) {
        // What cannot be read has been named already.
        let Ok(values) = opened.values(group, BODY_FORCE) else { return };
        let expected = body_force_n(case);
        if let Some(i) = first_difference(&values, &expected) {
            let message = format!(
                "{BODY_FORCE}[{i}] is {}, the closing speed's is {}",
                values[i], expected[i]
            );
            self.add("body_force_differs", Some(BODY_FORCE), Some(i), message);
        }
    }
}

/// Index of the first value that is not the expected one. One value 1e300 must not hide what is
/// wrong of the others.
fn first_difference(values: &[f64], expected: &[f64]) -> Option<usize> {
    let scale = values.iter().chain(expected).fold(0.0, |m: f64, v| m.max(v.abs()));
    let differs =
        |(a, b): (&f64, &f64)| (a - b).abs() > SAMPLED * a.abs().max(b.abs()).max(SAMPLED * scale);
    values.iter().zip(expected).position(differs)
}

/// Share by which a sampled value may differ from what its original gives.
const SAMPLED: f64 = 1e-6;

/// A number of either kind.
fn number(value: &AttrValue) -> Option<f64> {
    value.as_f64().or_else(|| value.as_i64().map(|n| n as f64))
}

/// Equal but for rounding.
fn is_same(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

/// Index of the value that differs most from the mean of its neighbours.
fn least_like_neighbours(values: &[f64]) -> Option<usize> {
    let oddness = |i: usize| {
        let before = i.checked_sub(1).map(|k| values[k]);
        let behind = values.get(i + 1).copied();
        let mean = match (before, behind) {
            (Some(a), Some(b)) => 0.5 * a + 0.5 * b,
            // One neighbour says less than two.
            (Some(a), None) | (None, Some(a)) => return 0.75 * (values[i] - a).abs(),
            (None, None) => 0.0,
        };
        (values[i] - mean).abs()
    };
    (0..values.len()).max_by(|&a, &b| oddness(a).total_cmp(&oddness(b)))
}

/// What concerns several cases of a group; `cases` are those that can be read, by speed.
fn of_group(found: &FoundGroup, cases: &[Case], list: &mut Vec<Finding>) {
    let group = &found.name;
    let mut add = |case: &str, code, message: String| {
        Findings { group, case, list }.add(code, None, None, message);
    };
    for pair in cases.windows(2) {
        let (one, other) = (&pair[0], &pair[1]);
        let same_value = one.conditions.speed == other.conditions.speed
            && one.conditions.masses == other.conditions.masses
            && one.conditions.parameters == other.conditions.parameters;
        // Equal runs of one recipe are replicates.
        if same_value && !one.is_measured_as(other) {
            let message = format!("has the same speed as {}, but a different recipe", one.id.name);
            add(&pair[1].id.name, "equal_speeds", message);
        }
    }
    if let Some(first) = cases.first() {
        for case in
            cases.iter().filter(|case| case.conditions.speed.kind != first.conditions.speed.kind)
        {
            let message = format!(
                "has a {} speed, {} a {} speed: no model can be trained on both",
                case.conditions.speed.kind.name(),
                first.id.name,
                first.conditions.speed.kind.name()
            );
            add(&case.id.name, "speed_kinds", message);
        }
    }
    let in_list: Vec<&str> = found.listed.iter().flatten().map(String::as_str).collect();
    let there: Vec<&str> = found.cases.iter().map(|(name, _)| name.as_str()).collect();
    let is_there: HashSet<&str> = there.iter().copied().collect();
    let mut is_listed = HashSet::new();
    for name in in_list.iter().filter(|name| !is_listed.insert(**name)) {
        add(name, "case_list", "is listed more than once in the group's cases".into());
    }
    for name in in_list.iter().filter(|name| !is_there.contains(*name)) {
        add(name, "case_list", "is listed in the group's cases, but is missing".into());
    }
    for name in there.iter().filter(|name| !is_listed.contains(*name)) {
        add(name, "case_list", "is not listed in the group's cases".into());
    }
    let by_speed: Vec<&str> = cases.iter().map(|case| case.id.name.as_str()).collect();
    if in_list.len() == by_speed.len() && in_list != by_speed {
        let message = format!(
            "the group's cases are listed as {}, by speed they are {}",
            listed(in_list.into_iter()),
            listed(by_speed.iter().copied())
        );
        add(by_speed[0], "case_order", message);
    }
}

/// The group's stopped mass is that of its cases.
fn of_stopped_mass(
    opened: &Opened<'_>,
    name: &str,
    cases: &[Case],
    list: &mut Vec<Finding>,
) -> Result<(), Error> {
    let (Some(first), attributes) = (cases.first(), opened.group_attributes(name)?) else {
        return Ok(());
    };
    if let Some((attribute, why)) = group::differs(&attributes, name, cases) {
        let message = format!(
            "the group's {attribute} is not that of its cases ({why}): crumple rewrites it at the next change of the group"
        );
        Findings { group: name, case: &first.id.name, list }.add(
            "stopped_mass_differs",
            None,
            None,
            message,
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_odd_value_is_found_anywhere() {
        let smooth: Vec<f64> = (0..50).map(|i| f64::from(i) * 0.1).collect();
        for i in [0, 1, 25, 48, 49] {
            for odd in [1e300, -7.0] {
                let mut values = smooth.clone();
                values[i] = odd;
                assert_eq!(least_like_neighbours(&values), Some(i));
            }
        }
        assert_eq!(least_like_neighbours(&[]), None);
    }
}
