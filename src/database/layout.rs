//! Layout of the database file: `/group/case` with attributes and datasets.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Display;

use super::group;
use super::{CasePath, Database};
use crate::curve::body::body_force_n;
use crate::curve::{Case, Curve};
use crate::error::{Error, error};
use crate::hdf5::{AttrValue, FileBuilder};
use crate::parallel;

/// Value of the root attribute `format`.
pub(crate) const FORMAT: &str = "crumple curve database";
/// Layout version this program writes.
pub(crate) const VERSION: i64 = 3;
/// Value of the root attribute `written_by`.
pub(super) const WRITTEN_BY: &str = concat!("crumple ", env!("CARGO_PKG_VERSION"));
/// The oldest it reads: that one has no body force, dates, origins and tags.
pub(crate) const OLDEST: i64 = 2;

pub(crate) const ROOT: [&str; 5] =
    ["format", "layout_version", "written_by", "NX_class", "default"];
/// Group of a case with the curve at the solver's rate.
pub(crate) const ORIGINAL: &str = "original";
/// Attribute of a case with the BLAKE3 hashes of its content.
pub(crate) const HASHES: &str = "hashes";
/// Name, among the hashes, of the one over the attributes.
pub(crate) const ATTRIBUTES: &str = "attributes";

/// Everything that is written for a case, before it is written.
pub(crate) struct Content<'a> {
    /// In the order in which they are written and hashed.
    pub attributes: Vec<(&'static str, AttrValue)>,
    /// By their paths in the case.
    pub datasets: Vec<(Cow<'static, str>, Cow<'a, [f64]>)>,
}

/// The dataset of the force that moves the body, which follows from the closing speed.
pub(crate) const BODY_FORCE: &str = "body_force_N";

/// Every attribute that a case can have; others belong to other programs.
pub(crate) const CASE_ATTRIBUTES: [&str; 29] = [
    "study",
    "speed_m_per_s",
    "speed_kind",
    "mass_kg",
    "other_mass_kg",
    "parameters",
    "force_kind",
    "contact_time_s",
    "solver_wall_time_s",
    "loading_end",
    "max_deflection_m",
    "truncated",
    "unloading_stiffness_N_per_m",
    "work_J",
    "kinetic_energy_J",
    "work_over_energy",
    "recipe",
    "fingerprint",
    "sources",
    "notes",
    "warnings",
    "built_utc",
    "origin",
    "tags",
    "user_notes",
    HASHES,
    // What follows is PLOT.
    "NX_class",
    "signal",
    "axes",
];

/// Attributes of a case by which tools that know NeXus draw its curve. They are the same for every case, and
/// not among the hashed ones.
pub(crate) const PLOT: [(&str, &str); 3] =
    [("NX_class", "NXdata"), ("signal", "force_N"), ("axes", "deflection_m")];

/// Attributes of the dataset at `path`: its unit and what its axis is called. Of fixed length: each text of
/// variable length takes 4 KiB.
pub(crate) fn labels(path: &str) -> [(&'static str, AttrValue); 2] {
    let (unit, name) = match path.rsplit('/').next().unwrap_or(path) {
        "time_s" => ("s", "Time after contact"),
        "deflection_m" => ("m", "Deflection"),
        "closing_speed_m_per_s" => ("m/s", "Closing speed"),
        BODY_FORCE => ("N", "Body force"),
        _ => ("N", "Force"),
    };
    [("units", AttrValue::String(unit.into())), ("long_name", AttrValue::String(name.into()))]
}

impl<'a> Content<'a> {
    pub(crate) fn of(case: &'a Case) -> Result<Self, Error> {
        let mut content = Self::recorded(case)?;
        let body_force = (BODY_FORCE.into(), Cow::Owned(body_force_n(case)));
        // With the other sampled ones, before the original curve's.
        let original = content.datasets.iter().position(|(path, _)| path.starts_with(ORIGINAL));
        content.datasets.insert(original.unwrap_or(content.datasets.len()), body_force);
        Ok(content)
    }

    /// All but the body force, which follows from it.
    fn recorded(case: &'a Case) -> Result<Self, Error> {
        let mut content = Self { attributes: Vec::new(), datasets: Vec::new() };
        content.describe(case)?;
        content.curve("", &case.curves.sampled);
        let closing = Cow::Borrowed(&*case.curves.closing_speed_m_per_s);
        content.datasets.push(("closing_speed_m_per_s".into(), closing));
        content.curve("original/", &case.curves.original);
        Ok(content)
    }

    fn describe(&mut self, case: &Case) -> Result<(), Error> {
        let text = |s: &str| AttrValue::VarLenString(s.into());
        let json = |value: Result<String, serde_json::Error>| {
            let value = value.map_err(not_encoded);
            value.map(AttrValue::VarLenString)
        };
        self.attr("study", text(&case.id.study));
        self.attr("speed_m_per_s", AttrValue::F64(case.conditions.speed.m_per_s));
        self.attr("speed_kind", text(case.conditions.speed.kind.name()));
        self.attr("mass_kg", AttrValue::F64(case.conditions.masses.body_kg));
        if let Some(other) = case.conditions.masses.other_kg {
            self.attr("other_mass_kg", AttrValue::F64(other));
        }
        self.attr("parameters", json(serde_json::to_string(&case.conditions.parameters))?);
        self.attr("force_kind", text(case.curves.force_kind.name()));
        self.attr("contact_time_s", AttrValue::F64(case.curves.contact_time_s));
        if let Some(time_s) = case.provenance.solver_wall_time_s {
            self.attr("solver_wall_time_s", AttrValue::F64(time_s));
        }
        self.attr("loading_end", AttrValue::I64(case.loading_end() as i64));
        self.attr("max_deflection_m", AttrValue::F64(case.max_deflection_m()));
        self.attr("truncated", AttrValue::U8(case.is_truncated().into()));
        if let Some(stiffness) = case.curves.unloading_stiffness_n_per_m {
            self.attr("unloading_stiffness_N_per_m", AttrValue::F64(stiffness));
        }
        self.attr("work_J", AttrValue::F64(case.quality.audit.work_j));
        self.attr("kinetic_energy_J", AttrValue::F64(case.quality.audit.kinetic_j));
        self.attr("work_over_energy", AttrValue::F64(case.quality.audit.ratio()));
        self.attr("recipe", text(&case.provenance.recipe));
        self.attr("fingerprint", text(&case.provenance.fingerprint));
        self.attr("sources", json(serde_json::to_string(&case.provenance.sources))?);
        self.attr("notes", json(serde_json::to_string(&case.quality.notes))?);
        self.attr("warnings", json(serde_json::to_string(&case.quality.warnings))?);
        // Absent where version 2 had nothing either, so that the hash of such a case stays.
        if let Some(built) = &case.provenance.built_utc {
            self.attr("built_utc", text(built));
        }
        if let Some(origin) = &case.provenance.origin {
            self.attr("origin", json(serde_json::to_string(origin))?);
        }
        if !case.provenance.tags.is_empty() {
            self.attr("tags", json(serde_json::to_string(&case.provenance.tags))?);
        }
        if !case.provenance.user_notes.is_empty() {
            self.attr("user_notes", json(serde_json::to_string(&case.provenance.user_notes))?);
        }
        Ok(())
    }

    fn curve(&mut self, folder: &str, curve: &'a Curve) {
        let mut put = |name: &str, values: &'a [f64]| {
            self.datasets.push((format!("{folder}{name}").into(), values.into()));
        };
        put("time_s", curve.time_s());
        put("deflection_m", curve.deflection_m());
        put("force_N", curve.force_n());
    }

    fn attr(&mut self, name: &'static str, value: AttrValue) {
        self.attributes.push((name, value));
    }

    /// All attributes of the case, those for other programs among them.
    pub(crate) fn written(&mut self) -> impl Iterator<Item = (&'static str, AttrValue)> {
        let plot = PLOT.map(|(name, value)| (name, AttrValue::String(value.into())));
        std::mem::take(&mut self.attributes).into_iter().chain(plot)
    }

    /// BLAKE3 of each dataset's values (doubles, little endian) by its path, and of all
    /// attributes: name, zero byte, value (text, or little endian), zero byte, each.
    pub(crate) fn hashes(&self) -> BTreeMap<String, String> {
        let mut of_attributes = blake3::Hasher::new();
        for (name, value) in &self.attributes {
            of_attributes.update(name.as_bytes()).update(b"\0");
            match value {
                AttrValue::F64(number) => of_attributes.update(&number.to_le_bytes()),
                AttrValue::I64(number) => of_attributes.update(&number.to_le_bytes()),
                AttrValue::U8(number) => of_attributes.update(&[*number]),
                other => of_attributes.update(other.as_str().unwrap_or_default().as_bytes()),
            };
            of_attributes.update(b"\0");
        }
        let mut hashes: BTreeMap<String, String> = self
            .datasets
            .iter()
            .map(|(path, values)| (path.to_string(), hash_of(values)))
            .collect();
        hashes.insert(ATTRIBUTES.into(), of_attributes.finalize().to_hex().to_string());
        hashes
    }
}

/// Attributes that identify what the curves of a case describe.
const RECORD_ATTRIBUTES: [&str; 6] =
    ["speed_m_per_s", "speed_kind", "mass_kg", "other_mass_kg", "parameters", "force_kind"];

/// BLAKE3 of the recorded curves of a case and of what they are of: speed, masses, parameters and kinds, and
/// not of names, notes or where it is from.
pub(crate) fn record_hash(case: &Case) -> Result<String, Error> {
    let mut record = Content::recorded(case)?;
    record.attributes.retain(|(name, _)| RECORD_ATTRIBUTES.contains(name));
    let mut hash = blake3::Hasher::new();
    for (path, of_values) in record.hashes() {
        hash.update(path.as_bytes()).update(b"\0").update(of_values.as_bytes()).update(b"\0");
    }
    Ok(hash.finalize().to_hex().to_string())
}

/// Whether a case is not the one that its hashes are of. That of the body force is not compared: the force is computed
/// where it is needed, and `db check` looks at the stored one.
pub(crate) fn is_altered(case: &Case, hashes: &BTreeMap<String, String>) -> Result<bool, Error> {
    let stored = hashes.iter().filter(|(path, _)| *path != BODY_FORCE);
    Ok(!Content::recorded(case)?.hashes().iter().eq(stored))
}

pub(crate) fn hash_of(values: &[f64]) -> String {
    let bytes: Vec<[u8; 8]> = values.iter().map(|value| value.to_le_bytes()).collect();
    blake3::hash(bytes.as_flattened()).to_hex().to_string()
}

/// The attributes of a case as they are written, its hashes among them: those it was read with
/// if they are not its own, so that damage is not made good by writing it again.
pub(crate) fn with_hashes<'a>(database: &Database, case: &'a Case) -> Result<Content<'a>, Error> {
    let mut content = Content::of(case)?;
    let altered = database.altered.get(&CasePath::of(case));
    let hashes = altered.cloned().unwrap_or_else(|| content.hashes());
    let hashes = serde_json::to_string(&hashes);
    let hashes = hashes.map_err(not_encoded)?;
    content.attr("hashes", AttrValue::VarLenString(hashes));
    Ok(content)
}

/// The attributes of the root, which draws its first case if it is asked for a picture.
pub(crate) fn root_attributes(database: &Database) -> Vec<(&'static str, AttrValue)> {
    let mut all = vec![
        ("format", AttrValue::VarLenString(FORMAT.into())),
        ("layout_version", AttrValue::I64(VERSION)),
        ("written_by", AttrValue::VarLenString(WRITTEN_BY.into())),
        ("NX_class", AttrValue::String("NXroot".into())),
    ];
    let first = database.groups().next();
    all.extend(first.map(|group| ("default", AttrValue::VarLenString(group.into()))));
    all
}

/// Cases whose content is made at once, on all processors.
const HASHED_AT_ONCE: usize = 64;

/// A database as the HDF5 file that it will be: all groups, and the first `most` cases.
pub(crate) fn encode(database: &Database, mut most: usize) -> Result<FileBuilder, Error> {
    let mut file = FileBuilder::new();
    for (name, value) in root_attributes(database) {
        file.set_attr(name, value);
    }
    for (name, cases) in &database.groups {
        let mut group = file.create_group(name);
        for (attribute, value) in group::attributes(name, cases) {
            group.set_attr(attribute, value);
        }
        let cases = &cases[..cases.len().min(most)];
        most -= cases.len();
        for (case, content) in contents(database, cases) {
            let mut content = content?;
            let mut builder = group.create_group(&case.id.name);
            for (name, value) in content.written() {
                builder.set_attr(name, value);
            }
            let mut original = builder.create_group(ORIGINAL);
            for (path, values) in content.datasets {
                let dataset = match path.strip_prefix("original/") {
                    Some(name) => original.create_dataset(name),
                    None => builder.create_dataset(&path),
                };
                dataset.with_f64_data(&values);
                for (name, value) in labels(&path) {
                    dataset.set_attr(name, value);
                }
            }
            builder.add_group(original.finish());
            group.add_group(builder.finish());
        }
        file.add_group(group.finish());
    }
    Ok(file)
}

/// What is written for each of these cases of a database.
pub(crate) fn contents<'a>(
    database: &'a Database,
    cases: &'a [Case],
) -> impl Iterator<Item = (&'a Case, Result<Content<'a>, Error>)> {
    cases.chunks(HASHED_AT_ONCE).flat_map(|cases| {
        cases.iter().zip(parallel::map(cases, |case| with_hashes(database, case)))
    })
}

pub(crate) fn not_encoded(detail: impl Display) -> Error {
    error!(Database, "cannot encode the database: {detail}")
}
