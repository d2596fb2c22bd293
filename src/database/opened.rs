//! A database file that is open, and its cases decoded.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Display;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use super::group::CASES;
use super::layout::{FORMAT, HASHES, OLDEST, ORIGINAL, VERSION, WRITTEN_BY, is_altered};
use super::{CasePath, Database};
use crate::curve::{
    Case, CaseId, Conditions, Curve, EnergyAudit, ForceKind, Masses, Provenance, Quality,
    RecordedCurves, SourceFile,
};
use crate::error::{Error, error};
use crate::file;
use crate::hdf5::{self, AttrValue, Fault, File, Group, OpenError, declared_bytes};
use crate::parallel;
use crate::unit::{Speed, SpeedKind};

/// The database file of a path, whose values are read when they are asked for.
pub(crate) struct Opened<'a> {
    pub path: &'a Path,
    pub file: File,
    fault: Fault,
    /// Version of its layout.
    pub version: i64,
    /// Bytes of values that datasets may still declare.
    left: AtomicU64,
}

/// Bytes that datasets may declare in addition to a multiple of the file's size. A multiple,
/// because they are compressed: force histories shrink by less than this.
const DECLARED_BYTES: u64 = 64 << 20;
const DECLARED_PER_BYTE: u64 = 32;

fn not_hdf5(path: &Path, detail: impl Display) -> Error {
    error!(Database, "{}: {detail}: give a database made by crumple build", path.display())
}

/// Opens a database file; values are not read yet.
pub(crate) fn open(path: &Path) -> Result<Opened<'_>, Error> {
    let (file, fault) = hdf5::open(path).map_err(|e| match e {
        OpenError::Io(source) => Error::io(path, source),
        OpenError::InUse => error!(Locked, "{}: {e}", path.display()),
        OpenError::Cut { .. } => error!(Database, "{}: {e}", path.display()),
        other => not_hdf5(path, other),
    })?;
    Opened::of(path, file, fault)
}

/// A group that holds cases, as it is found in a file.
pub(crate) struct FoundGroup {
    pub name: String,
    /// The names that its attribute `cases` lists.
    pub listed: Option<Vec<String>>,
    /// Names and groups of its cases. The links of a group are read once, here: to find one by
    /// its name, HDF5 reads all of them each time.
    pub cases: Vec<(String, Group)>,
}

/// A case that was read, and what it was read from.
pub(crate) struct FoundCase {
    pub case: Case,
    pub attributes: HashMap<String, AttrValue>,
    /// The hashes that are stored with it.
    pub hashes: BTreeMap<String, String>,
}

impl<'a> Opened<'a> {
    /// The database in an open file; `path` is for messages.
    pub(crate) fn of(path: &'a Path, file: File, fault: Fault) -> Result<Self, Error> {
        let attrs = file.root().attrs();
        fault.check().map_err(|source| Error::io(path, source))?;
        let attrs =
            attrs.map_err(|e| not_hdf5(path, format_args!("this is not an HDF5 file ({e})")))?;
        if attrs.get("format").and_then(AttrValue::as_str) != Some(FORMAT) {
            return Err(error!(
                Database,
                "{}: this HDF5 file is not a curve database (its root has no attribute format = \"{FORMAT}\"): give one made by crumple build",
                path.display()
            ));
        }
        let found = attrs.get("layout_version").and_then(AttrValue::as_i64).unwrap_or(0);
        if !(OLDEST..=VERSION).contains(&found) {
            return Err(error!(
                Database,
                "{}: its layout has version {found}, this program reads versions {OLDEST} to {VERSION}: build the database again with crumple build",
                path.display()
            ));
        }
        let left = DECLARED_BYTES + DECLARED_PER_BYTE.saturating_mul(file.file_size());
        Ok(Self { path, file, fault, version: found, left: left.into() })
    }

    fn damaged(&self, place: &str, detail: impl Display) -> Error {
        super::damaged(self.path, place, detail)
    }

    pub(crate) fn check<T>(&self, place: &str, result: Result<T, hdf5::Error>) -> Result<T, Error> {
        self.fault.check().map_err(|source| Error::io(self.path, source))?;
        result.map_err(|e| self.damaged(place, e))
    }

    /// Groups that hold cases, with these. What other programs put next to them is not a group of ours.
    pub(crate) fn groups(&self) -> Result<Vec<FoundGroup>, Error> {
        let mut groups = Vec::new();
        for (name, group) in self.check("/", self.file.root().iter_groups())? {
            let listed = self.listed(&name, &group)?;
            let names: HashSet<&str> = listed.iter().flatten().map(String::as_str).collect();
            let mut cases = Vec::new();
            for (case, group) in self.check(&name, group.iter_groups())? {
                if names.contains(case.as_str()) || self.is_case(&name, &case, &group)? {
                    cases.push((case, group));
                }
            }
            if listed.is_some() || !cases.is_empty() {
                groups.push(FoundGroup { name, listed, cases });
            }
        }
        Ok(groups)
    }

    /// Whether this version of the program has written the file.
    pub(crate) fn is_of_this_program(&self) -> Result<bool, Error> {
        let attributes = self.check("/", self.file.root().attrs())?;
        let written_by = attributes.get("written_by").and_then(AttrValue::as_str);
        Ok(written_by == Some(WRITTEN_BY))
    }

    pub(crate) fn group_attributes(&self, name: &str) -> Result<HashMap<String, AttrValue>, Error> {
        let group = self.check(name, self.file.root().group(name))?;
        self.check(name, group.attrs())
    }

    /// The names that a group's attribute `cases` lists.
    fn listed(&self, name: &str, group: &Group) -> Result<Option<Vec<String>>, Error> {
        let attributes = self.check(name, group.attrs())?;
        Ok(attributes
            .get(CASES)
            .and_then(AttrValue::as_strings)
            .map(|names| names.iter().map(std::string::ToString::to_string).collect()))
    }

    /// Whether a group has what every case has; one of it is enough, so that damage shows.
    fn is_case(&self, group: &str, case: &str, found: &Group) -> Result<bool, Error> {
        let attributes = self.check(&format!("{group}/{case}"), found.attr_datatypes())?;
        Ok(["study", "speed_m_per_s", "fingerprint"].iter().any(|n| attributes.contains_key(*n)))
    }

    /// The group of a case, found by name without looking at any other case; `None` if there is
    /// no such case, or if that depends on the names of others.
    pub(crate) fn find(&self, group: Option<&str>, case: &str) -> Option<(String, Group)> {
        let root = self.file.root();
        let name = match group {
            Some(name) => name.to_string(),
            // The only group there is, if others have put none next to it.
            None => <[String; 1]>::try_from(root.groups().ok()?).ok()?.into_iter().next()?,
        };
        // A name is not a path.
        if [&*name, case].iter().any(|name| name.contains('/') || ["", "."].contains(name)) {
            return None;
        }
        let found = root.group(&name).ok()?.group(case).ok()?;
        self.is_case(&name, case, &found).ok()?.then_some((name, found))
    }

    /// The values of one dataset of a case; why not, in words.
    pub(crate) fn values(&self, case: &Group, path: &str) -> Result<Vec<f64>, String> {
        let place = Location { opened: self, name: String::new() };
        numbers(case, path, &place)
    }

    /// The hashes that are stored with a case, if they are there and can be read.
    pub(crate) fn hashes(&self, case: &Group) -> Option<BTreeMap<String, String>> {
        let attributes = case.attrs().ok()?;
        serde_json::from_slice(attributes.get(HASHES)?.as_str()?.as_bytes()).ok()
    }

    /// Reads one case from its group.
    pub(crate) fn case(&self, group: &str, name: &str, case: &Group) -> Result<FoundCase, Error> {
        let place = Location { opened: self, name: format!("{group}/{name}") };
        decode_case(group, name, case, &place)
    }
}

/// Reads all cases of the file at `path`.
pub(crate) fn decode(path: &Path) -> Result<Database, Error> {
    let opened = open(path)?;
    decode_opened(&opened)
}

fn decode_opened(opened: &Opened<'_>) -> Result<Database, Error> {
    let mut database = Database::default();
    for group in opened.groups()? {
        let mut found = Vec::with_capacity(group.cases.len());
        for (name, case) in group.cases {
            let FoundCase { case, hashes, .. } = opened.case(&group.name, &name, &case)?;
            found.push((case, hashes));
        }
        let altered = parallel::map(&found, |(case, hashes)| is_altered(case, hashes));
        let altered: Vec<bool> = altered.into_iter().collect::<Result<_, Error>>()?;
        let mut cases = Vec::with_capacity(found.len());
        for ((case, hashes), altered) in found.into_iter().zip(altered) {
            if altered {
                database.altered.insert(CasePath::of(&case), hashes);
            }
            cases.push(case);
        }
        if !cases.is_empty() {
            super::sort(&mut cases);
            database.groups.insert(group.name, cases);
        }
    }
    Ok(database)
}

/// Where in the file something is read, for messages.
struct Location<'a> {
    opened: &'a Opened<'a>,
    name: String,
}

impl Location<'_> {
    fn damaged(&self, detail: impl Display) -> Error {
        self.opened.damaged(&self.name, detail)
    }

    fn check<T>(&self, result: Result<T, hdf5::Error>) -> Result<T, Error> {
        self.opened.check(&self.name, result)
    }
}

/// Attributes of one case.
struct Attrs<'a> {
    map: HashMap<String, AttrValue>,
    place: &'a Location<'a>,
}

impl Attrs<'_> {
    fn number(&self, name: &str) -> Result<f64, Error> {
        self.optional_number(name)?.ok_or_else(|| {
            self.place.damaged(format!("attribute {name} is missing or not a number"))
        })
    }

    fn optional_number(&self, name: &str) -> Result<Option<f64>, Error> {
        let value = self.map.get(name).and_then(AttrValue::as_f64);
        if value.is_some_and(|v| !v.is_finite()) {
            return Err(self.place.damaged(format!("attribute {name} is not finite")));
        }
        Ok(value)
    }

    fn positive(&self, name: &str) -> Result<f64, Error> {
        let value = self.number(name)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(self.place.damaged(format!("attribute {name} is {value}: expected more than 0")))
        }
    }

    fn text(&self, name: &str) -> Result<&str, Error> {
        self.map
            .get(name)
            .and_then(AttrValue::as_str)
            .ok_or_else(|| self.place.damaged(format!("attribute {name} is missing or not text")))
    }

    fn kind<T>(&self, name: &str, parse: fn(&str) -> Option<T>) -> Result<T, Error> {
        let text = self.text(name)?;
        parse(text).ok_or_else(|| self.place.damaged(format!("{name} \"{text}\" is not known")))
    }

    fn json<T: serde::de::DeserializeOwned>(&self, name: &str) -> Result<T, Error> {
        serde_json::from_slice(self.text(name)?.as_bytes())
            .map_err(|e| self.place.damaged(format!("attribute {name}: {e}")))
    }

    fn optional<'s, T>(
        &'s self,
        name: &str,
        read: impl FnOnce(&'s Self, &str) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        self.map.contains_key(name).then(|| read(self, name)).transpose()
    }
}

fn decode_case(
    group_name: &str,
    name: &str,
    group: &Group,
    place: &Location<'_>,
) -> Result<FoundCase, Error> {
    let attrs = Attrs { map: place.check(group.attrs())?, place };
    let kind = attrs.kind("speed_kind", SpeedKind::parse)?;
    let force_kind = attrs.kind("force_kind", ForceKind::parse)?;
    let sampled = decode_curve(group, place)?;
    let closing_speed_m_per_s = closing_speeds(group, sampled.time_s().len(), place)?;
    let original_place =
        Location { opened: place.opened, name: format!("{}/{ORIGINAL}", place.name) };
    let original = decode_curve(&place.check(group.group(ORIGINAL))?, &original_place)?;
    let sources: Vec<SourceFile> = attrs.json("sources")?;
    let id =
        CaseId { study: attrs.text("study")?.into(), group: group_name.into(), name: name.into() };
    let conditions = Conditions {
        speed: Speed { m_per_s: attrs.positive("speed_m_per_s")?, kind },
        masses: Masses {
            body_kg: attrs.positive("mass_kg")?,
            other_kg: attrs.optional("other_mass_kg", Attrs::positive)?,
        },
        parameters: attrs.json("parameters")?,
    };
    let curves = RecordedCurves {
        force_kind,
        sampled,
        closing_speed_m_per_s,
        original,
        contact_time_s: attrs.number("contact_time_s")?,
        unloading_stiffness_n_per_m: attrs.optional_number("unloading_stiffness_N_per_m")?,
    };
    let quality = Quality {
        audit: EnergyAudit {
            work_j: attrs.number("work_J")?,
            kinetic_j: attrs.positive("kinetic_energy_J")?,
        },
        notes: attrs.json("notes")?,
        warnings: attrs.json("warnings")?,
    };
    let provenance = Provenance {
        recipe: attrs.text("recipe")?.into(),
        fingerprint: attrs.text("fingerprint")?.into(),
        sources,
        solver_wall_time_s: attrs.optional_number("solver_wall_time_s")?,
        built_utc: attrs.optional("built_utc", Attrs::text)?.map(Into::into),
        origin: attrs.optional("origin", Attrs::json)?,
        tags: attrs.optional("tags", Attrs::json)?.unwrap_or_default(),
        user_notes: attrs.optional("user_notes", Attrs::json)?.unwrap_or_default(),
    };
    let case = Case { id, conditions, curves, quality, provenance };
    let hashes = attrs.json(HASHES)?;
    Ok(FoundCase { case, attributes: attrs.map, hashes })
}

/// The closing speeds of a case, in m/s: a finite one for each of `times` times.
fn closing_speeds(group: &Group, times: usize, place: &Location<'_>) -> Result<Vec<f64>, Error> {
    let speeds = numbers(group, "closing_speed_m_per_s", place).map_err(|e| place.damaged(e))?;
    if speeds.len() != times {
        return Err(place.damaged(format!(
            "closing_speed_m_per_s and time_s differ in length: {} and {times}",
            speeds.len()
        )));
    }
    match speeds.iter().position(|v| !v.is_finite()) {
        Some(i) => {
            Err(place.damaged(format!("closing_speed_m_per_s of state {} is not finite", i + 1)))
        }
        None => Ok(speeds),
    }
}

fn decode_curve(group: &Group, place: &Location<'_>) -> Result<Curve, Error> {
    let numbers = |name| numbers(group, name, place).map_err(|e| place.damaged(e));
    let (time, deflection, force) =
        (numbers("time_s")?, numbers("deflection_m")?, numbers("force_N")?);
    Curve::new(time, deflection, force).map_err(|e| place.damaged(e))
}

/// The values of a dataset; why not, in words.
fn numbers(group: &Group, name: &str, place: &Location<'_>) -> Result<Vec<f64>, String> {
    let failed = |e: hdf5::Error| format!("{name}: {e}");
    let dataset = group.dataset(name).map_err(failed)?;
    let bytes = declared_bytes(&dataset).map_err(failed)?;
    let left = &place.opened.left;
    let taken =
        left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(bytes));
    if taken.is_err() {
        return Err(format!(
            "{name}: it declares {} values, more than a file of this size holds: the file is damaged, or was not made by crumple build",
            bytes / 8
        ));
    }
    // A reader without memory ends the process; here it is only reserved.
    let mut memory: Vec<u8> = Vec::new();
    if memory.try_reserve_exact(bytes.saturating_mul(2) as usize).is_err() {
        return Err(format!("{name}: {}", file::out_of_memory(bytes)));
    }
    drop(memory);
    dataset.read_f64().map_err(failed)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU64, Ordering};

    use hdf5::FormatError;

    use super::super::layout::encode;
    use super::*;

    /// Bytes of a file that count how many of them are read.
    struct Counting {
        bytes: Vec<u8>,
        read: Arc<AtomicU64>,
    }

    impl hdf5::Source for Counting {
        fn len(&self) -> u64 {
            self.bytes.len() as u64
        }

        fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<(), FormatError> {
            self.read.fetch_add(buffer.len() as u64, Ordering::Relaxed);
            let from = offset as usize;
            buffer.copy_from_slice(&self.bytes[from..from + buffer.len()]);
            Ok(())
        }
    }

    fn case(name: String) -> Case {
        let curve = |d: f64| Curve::new(vec![0.0, 0.1], vec![0.0, d], vec![0.0, 1e6]).unwrap();
        Case {
            id: CaseId { study: "s".into(), group: "g".into(), name },
            conditions: Conditions {
                speed: Speed { m_per_s: 10.0, kind: SpeedKind::Wall },
                masses: Masses { body_kg: 24e3, other_kg: None },
                parameters: BTreeMap::new(),
            },
            curves: RecordedCurves {
                force_kind: ForceKind::Contact,
                sampled: curve(0.5),
                closing_speed_m_per_s: vec![10.0, 0.0],
                original: curve(0.5),
                contact_time_s: 0.0,
                unloading_stiffness_n_per_m: None,
            },
            quality: Quality {
                audit: EnergyAudit { work_j: 1.0, kinetic_j: 1.0 },
                notes: Vec::new(),
                warnings: Vec::new(),
            },
            provenance: Provenance { recipe: "{}".into(), ..Provenance::default() },
        }
    }

    /// Bytes that are read of a database with this many cases: for all of them, and for one.
    fn bytes_read(cases: usize) -> (u64, u64) {
        let mut database = Database::default();
        database.put_all((0..cases).map(|k| case(format!("case {k:05}")))).unwrap();
        let bytes = encode(&database, usize::MAX).unwrap().finish().unwrap();
        let count = |work: &dyn Fn(&Opened<'_>)| {
            let read = Arc::new(AtomicU64::new(0));
            let source = Counting { bytes: bytes.clone(), read: read.clone() };
            work(
                &Opened::of(
                    Path::new("a.h5"),
                    File::from_source(source).unwrap(),
                    Fault::default(),
                )
                .unwrap(),
            );
            read.load(Ordering::Relaxed)
        };
        let all = count(&|opened| assert!(decode_opened(opened).unwrap() == database));
        let one = count(&|opened| {
            let name = format!("case {:05}", cases / 2);
            for group in [None, Some("g")] {
                let (group, found) = opened.find(group, &name).unwrap();
                let found = opened.case(&group, &name, &found).unwrap();
                assert_eq!(&found.case, &database.cases("g")[cases / 2]);
            }
        });
        (all, one)
    }

    #[test]
    fn a_database_written_in_parts_is_the_one_written_as_a_whole() {
        let of = |group: &str, k: usize| {
            let mut case = case(format!("case {k}"));
            case.id.group = group.into();
            case
        };
        let mut database = Database::default();
        database.put_all((0..3).map(|k| of("a", k)).chain((0..8).map(|k| of("b", k)))).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let (whole, parts) = (folder.path().join("whole.h5"), folder.path().join("parts.h5"));
        database.write(&whole).unwrap();
        for at_once in [1, 2, 3, 5, 10] {
            super::super::edit::write_in_parts(&database, &parts, at_once).unwrap();
            assert!(decode(&parts).unwrap() == database);
            assert_eq!(content(&parts), content(&whole));
        }
    }

    /// All groups and datasets of a file with their attributes and values, as text.
    fn content(path: &Path) -> BTreeMap<String, String> {
        fn list(group: &Group, path: &str, found: &mut BTreeMap<String, String>) {
            let sorted = |all: HashMap<String, AttrValue>| {
                format!("{:?}", all.into_iter().collect::<BTreeMap<_, _>>())
            };
            found.insert(path.to_string(), sorted(group.attrs().unwrap()));
            for (name, dataset) in group.iter_datasets().unwrap() {
                let values = dataset.read_f64().unwrap();
                let text = format!("{values:?} {}", sorted(dataset.attrs().unwrap()));
                found.insert(format!("{path}/{name}"), text);
            }
            for (name, inner) in group.iter_groups().unwrap() {
                list(&inner, &format!("{path}/{name}"), found);
            }
        }
        let mut found = BTreeMap::new();
        list(&open(path).unwrap().file.root(), "", &mut found);
        found
    }

    #[test]
    fn reading_grows_with_the_number_of_cases_and_one_case_needs_its_own_bytes_only() {
        let ((few, one_of_few), (many, one_of_many)) = (bytes_read(100), bytes_read(1600));
        assert!(many < 17 * few, "{few} bytes of 100 cases, {many} of 1600");
        // The names of all cases are read, and of the others nothing else.
        let names = 1500 * 300;
        assert!(one_of_many < one_of_few + names, "{one_of_few} of 100, {one_of_many} of 1600");
        assert!(30 * one_of_many < many, "{one_of_many} bytes for one, {many} for all");
    }
}
