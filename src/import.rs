//! Adding curves of files to a database: each becomes a case of the study [`IMPORTED`].
//!
//! All files are read, and all cases made, before anything is written; the database is locked
//! meanwhile, and written whole.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::curve::from_table::{FromTable, FromTableError, IMPORTED, Impact, Table, from_table};
use crate::curve::recipe::{Filter, Sampling};
use crate::curve::{Case, ForceKind, Masses, Parameter, Source};
use crate::database::{Database, DatabaseError};
use crate::file::{LockError, WriterLock};
use crate::formats::read::{self, ReadCurve, ReadCurveError, ReadOptions};
use crate::unit::{Speed, SpeedKind, UnitSystem, km_per_h};

/// One file that is to become a case, and what is said of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// The file, or an ISO-MME test's folder.
    pub path: PathBuf,
    /// Name of the case; the file's, without its extension, if absent.
    pub case: Option<String>,
    /// Impact speed in m/s; the file's if absent.
    pub speed_m_per_s: Option<f64>,
}

/// What is said of all files that are added at once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Group of the database.
    pub group: String,
    /// What speeds are measured against; the file's if absent, else the group's.
    pub kind: Option<SpeedKind>,
    /// Mass of the body in kg; the file's if absent.
    pub mass_kg: Option<f64>,
    /// Mass of the other body of a pair in kg; the file's if absent, else that of the body.
    pub other_mass_kg: Option<f64>,
    /// Unloading stiffness in N/m; the file's if absent.
    pub unloading_stiffness_n_per_m: Option<f64>,
    /// How the files are read; its force is also which force a curve is, if its file does not say.
    pub read: ReadOptions,
    /// Further parameters of the cases.
    pub parameters: std::collections::BTreeMap<String, Parameter>,
    /// Replace cases of these names that were added before.
    pub replace: bool,
    /// Take curves whose energy cannot be the impact's.
    pub accept_energy: bool,
}

/// Why nothing was added.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file is no curve.
    #[error(transparent)]
    Read(#[from] ReadCurveError),
    /// A curve is not that of the impact.
    #[error("{path}: {source}")]
    Table {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: FromTableError,
    },
    /// Something is neither in the file nor said beside it.
    #[error("{path}: the file does not say {what}: give {option}")]
    Missing {
        /// The file.
        path: PathBuf,
        /// What is missing.
        what: &'static str,
        /// How to say it.
        option: &'static str,
    },
    /// A value of the file is no such quantity.
    #[error("{path}: its {what} is {value}: expected more than 0")]
    NotPositive {
        /// The file.
        path: PathBuf,
        /// Speed or mass.
        what: &'static str,
        /// As read.
        value: f64,
    },
    /// The file says another force than was asked for.
    #[error("{path}: the file holds the {} force, not the {}: remove --force", .found.name(), .asked.name())]
    OtherForce {
        /// The file.
        path: PathBuf,
        /// As the file says.
        found: ForceKind,
        /// As was asked for.
        asked: ForceKind,
    },
    /// The mass of another body where there is none.
    #[error("{path}: a wall has no mass: remove --other-mass, or say --kind closing")]
    MassOfWall {
        /// The file.
        path: PathBuf,
    },
    /// The group has speeds or forces of another kind.
    #[error(
        "{path}: this curve has a {found} {what}, the cases of group \"{group}\" have a {there} one: no model can be trained on both; give another --group"
    )]
    OtherKind {
        /// The file.
        path: PathBuf,
        /// Speed or force.
        what: &'static str,
        /// The curve's.
        found: &'static str,
        /// The group's.
        there: &'static str,
        /// The group.
        group: String,
    },
    /// A name that cannot stand in a database.
    #[error("{path}: \"{name}\" cannot be the name of a {what}: {why}", name = name.escape_debug())]
    Name {
        /// The file.
        path: PathBuf,
        /// Group or case.
        what: &'static str,
        /// The name.
        name: String,
        /// Why not, and what to do.
        why: &'static str,
    },
    /// Two files with one name.
    #[error("{first} and {second} would both be case \"{name}\": name them with --case")]
    SameName {
        /// One file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// Their name.
        name: String,
    },
    /// There is such a case.
    #[error(
        "{path}: group \"{group}\" has a case \"{name}\" already: replace it with --replace, or give another name with --case"
    )]
    Taken {
        /// The file.
        path: PathBuf,
        /// The group.
        group: String,
        /// The name.
        name: String,
    },
    /// There is such a case of a study.
    #[error(
        "{path}: case \"{name}\" of group \"{group}\" is of the study \"{study}\", which builds it: give another name with --case"
    )]
    OfStudy {
        /// The file.
        path: PathBuf,
        /// The group.
        group: String,
        /// The name.
        name: String,
        /// The study.
        study: String,
    },
    /// The database is not ours, or damaged.
    #[error(transparent)]
    Database(#[from] DatabaseError),
    /// Another process writes it.
    #[error(transparent)]
    Lock(#[from] LockError),
}

/// Adds the curves of `items` to the database at `path`, which is made if it is not there; returns
/// their cases in the order of the items.
///
/// # Errors
/// [`ImportError`] names the file and what to do; the database is then unchanged.
pub fn add(path: &Path, items: &[Item], settings: &Settings) -> Result<Vec<Case>, ImportError> {
    let _lock = WriterLock::take(path)?;
    let mut database = match path.try_exists().unwrap_or(true) {
        true => Database::read(path)?,
        false => Database::default(),
    };
    let mut cases: Vec<Case> = Vec::with_capacity(items.len());
    for item in items {
        let case = case(item, settings, database.cases(&settings.group).first())?;
        if let Some(k) = cases.iter().position(|c| c.name == case.name) {
            let (first, second) = (items[k].path.clone(), item.path.clone());
            return Err(ImportError::SameName { first, second, name: case.name });
        }
        check_place(&database, item, &case, settings.replace)?;
        if let Some(first) = cases.first() {
            check_kinds(item, &case, first)?;
        }
        cases.push(case);
    }
    database.put_all(cases.iter().cloned())?;
    database.write(path)?;
    Ok(cases)
}

/// Whether the case may take its place in the database.
fn check_place(
    database: &Database,
    item: &Item,
    case: &Case,
    replace: bool,
) -> Result<(), ImportError> {
    let there = database.cases(&case.group);
    let (path, group, name) = (item.path.clone(), case.group.clone(), case.name.clone());
    match there.iter().find(|c| c.name == case.name) {
        Some(other) if other.study != IMPORTED => {
            return Err(ImportError::OfStudy { path, group, name, study: other.study.clone() });
        }
        Some(_) if !replace => return Err(ImportError::Taken { path, group, name }),
        _ => {}
    }
    // A case that is replaced binds nobody.
    match there.iter().find(|c| c.name != case.name) {
        Some(other) => check_kinds(item, case, other),
        None => Ok(()),
    }
}

/// Whether two cases of a group are of one kind.
fn check_kinds(item: &Item, case: &Case, other: &Case) -> Result<(), ImportError> {
    let kinds = [
        ("speed", case.speed.kind.name(), other.speed.kind.name()),
        ("force", case.force_kind.name(), other.force_kind.name()),
    ];
    match kinds.into_iter().find(|(_, found, there)| found != there) {
        None => Ok(()),
        Some((what, found, there)) => Err(ImportError::OtherKind {
            path: item.path.clone(),
            what,
            found,
            there,
            group: case.group.clone(),
        }),
    }
}

/// What was said and what the file says, put together.
struct Said {
    speed: Speed,
    masses: Masses,
    force: ForceKind,
    notes: Vec<String>,
    warnings: Vec<String>,
}

/// Two values this close are one.
const SAME: f64 = 0.01;

impl Said {
    fn of(
        item: &Item,
        settings: &Settings,
        curve: &ReadCurve,
        group: Option<&Case>,
    ) -> Result<Self, ImportError> {
        let (mut notes, mut warnings) = (Vec::new(), Vec::new());
        let facts = &curve.facts;
        let missing = |what, option| ImportError::Missing { path: item.path.clone(), what, option };
        let kind = match (settings.kind, facts.speed_kind, group) {
            (Some(kind), ..) | (None, Some(kind), _) => kind,
            (None, None, Some(case)) => {
                notes.push(format!("speed: {} as in the group", case.speed.kind.name()));
                case.speed.kind
            }
            (None, None, None) => {
                let option = "--kind wall (against a rigid wall) or --kind closing (of two bodies)";
                return Err(missing("what its speed is measured against", option));
            }
        };
        let mut either =
            |what, stated: Option<f64>, found: Option<f64>, shown: fn(f64) -> String| {
                if let (Some(stated), Some(found)) = (stated, found)
                    && (stated / found - 1.0).abs() > SAME
                {
                    warnings.push(format!(
                        "{what}: the file says {}, {} is used",
                        shown(found),
                        shown(stated)
                    ));
                }
                let value = stated.or(found);
                match value.filter(|v| !(*v > 0.0 && v.is_finite())) {
                    Some(value) => {
                        Err(ImportError::NotPositive { path: item.path.clone(), what, value })
                    }
                    None => Ok(value),
                }
            };
        let tonnes = |kg: f64| format!("{} t", kg / 1e3);
        let speed = either("speed", item.speed_m_per_s, facts.speed_m_per_s, km_per_h)?;
        let mass = either("mass", settings.mass_kg, facts.mass_kg, tonnes)?;
        let other = either("other mass", settings.other_mass_kg, facts.other_mass_kg, tonnes)?;
        let body_kg =
            mass.ok_or_else(|| missing("the mass of the body", "--mass, such as --mass 24t"))?;
        let m_per_s =
            speed.ok_or_else(|| missing("its speed", "--speed, such as --speed 36km/h"))?;
        let other_kg = match (kind, other) {
            (SpeedKind::Wall, _) if settings.other_mass_kg.is_some() => {
                return Err(ImportError::MassOfWall { path: item.path.clone() });
            }
            (SpeedKind::Wall, _) => None,
            (SpeedKind::Closing, Some(other)) => Some(other),
            (SpeedKind::Closing, None) => {
                notes.push("other mass: that of the body".into());
                Some(body_kg)
            }
        };
        let force = match (facts.force, settings.read.force) {
            (Some(found), Some(asked)) if found != asked => {
                return Err(ImportError::OtherForce { path: item.path.clone(), found, asked });
            }
            (found, asked) => found.or(asked).unwrap_or_else(|| {
                notes.push(
                    "force: taken as the contact force; neither file nor --force say which it is"
                        .into(),
                );
                ForceKind::Contact
            }),
        };
        let masses = Masses { body_kg, other_kg };
        Ok(Self { speed: Speed { m_per_s, kind }, masses, force, notes, warnings })
    }
}

/// The case of one file.
fn case(item: &Item, settings: &Settings, group: Option<&Case>) -> Result<Case, ImportError> {
    let name = case_name(item)?;
    check_name(item, "group", &settings.group)?;
    check_name(item, "case", &name)?;
    let (curve, reader) = read::read(&item.path, &settings.read)?;
    let said = Said::of(item, settings, &curve, group)?;
    let stiffness = settings.unloading_stiffness_n_per_m;
    let impact = Impact {
        speed: said.speed,
        masses: said.masses,
        unloading_stiffness_n_per_m: stiffness.or(curve.facts.unloading_stiffness_n_per_m),
        // One that was given belongs to the force of the curve.
        body_unloading_stiffness_n_per_m: match stiffness {
            Some(_) => None,
            None => curve.facts.body_unloading_stiffness_n_per_m,
        },
        units: curve.units.unwrap_or(UnitSystem::SI),
        accept_energy: settings.accept_energy,
    };
    let table = Table {
        deflection_m: &curve.deflection_m,
        force_n: &curve.force_n,
        time_s: curve.time_s.as_deref(),
        body_force_n: curve.body_force_n.as_deref(),
    };
    let made = from_table(&table, &impact)
        .map_err(|source| ImportError::Table { path: item.path.clone(), source })?;
    let recipe = recipe(item, settings, &curve, reader.name, &said);
    Ok(assembled(name, settings, &curve, reader.name, said, made, recipe))
}

fn assembled(
    name: String,
    settings: &Settings,
    curve: &ReadCurve,
    format: &str,
    said: Said,
    made: FromTable,
    recipe: String,
) -> Case {
    let mut hash = blake3::Hasher::new();
    hash.update(recipe.as_bytes());
    for file in &curve.files {
        hash.update(file.blake3.as_bytes());
    }
    let sources = curve.files.iter().map(|file| Source {
        path: file.path.display().to_string(),
        size_bytes: file.size_bytes,
        blake3: file.blake3.clone(),
        format: format.into(),
        solver: None,
        version: None,
        title: curve.title.clone(),
        problems: 0,
    });
    let notes = curve.notes.iter().cloned().chain(said.notes).chain(made.notes);
    Case {
        study: IMPORTED.into(),
        group: settings.group.clone(),
        name,
        speed: said.speed,
        masses: said.masses,
        parameters: settings.parameters.clone(),
        force_kind: said.force,
        sampled: made.sampled,
        closing_speed_m_per_s: made.closing_speed_m_per_s,
        original: made.original,
        contact_time_s: made.contact_time_s,
        solver_wall_time_s: None,
        unloading_stiffness_n_per_m: made.unloading_stiffness_n_per_m,
        audit: made.audit,
        fingerprint: hash.finalize().to_hex().to_string(),
        recipe,
        sources: sources.collect(),
        notes: notes.collect(),
        warnings: said.warnings.into_iter().chain(made.warnings).collect(),
    }
}

/// Everything beside the file that decides the case's numbers.
#[derive(Serialize)]
struct Recipe<'a> {
    study: &'a str,
    /// Of the file, if they are one system.
    units: Option<UnitSystem>,
    kind: SpeedKind,
    imported: Imported<'a>,
}

#[derive(Serialize)]
struct Imported<'a> {
    path: String,
    format: &'a str,
    curve: Option<&'a str>,
    /// Whether the motion is that of the file's times.
    has_times: bool,
    force: ForceKind,
    speed_m_per_s: f64,
    mass_kg: f64,
    other_mass_kg: Option<f64>,
    #[serde(rename = "unloading_stiffness_N_per_m")]
    unloading_stiffness_n_per_m: Option<f64>,
    parameters: &'a std::collections::BTreeMap<String, Parameter>,
    accept_energy: bool,
    filter: Filter,
    sampling_interval_ms: f64,
}

fn recipe(
    item: &Item,
    settings: &Settings,
    curve: &ReadCurve,
    format: &str,
    said: &Said,
) -> String {
    let stiffness = settings.unloading_stiffness_n_per_m;
    let recipe = Recipe {
        study: IMPORTED,
        units: curve.units,
        kind: said.speed.kind,
        imported: Imported {
            path: item.path.display().to_string(),
            format,
            curve: settings.read.curve.as_deref(),
            has_times: curve.time_s.is_some(),
            force: said.force,
            speed_m_per_s: said.speed.m_per_s,
            mass_kg: said.masses.body_kg,
            other_mass_kg: said.masses.other_kg,
            unloading_stiffness_n_per_m: stiffness.or(curve.facts.unloading_stiffness_n_per_m),
            parameters: &settings.parameters,
            accept_energy: settings.accept_energy,
            filter: Filter::None,
            sampling_interval_ms: Sampling::default().interval_s * 1e3,
        },
    };
    // A structure of texts and finite numbers is always JSON.
    serde_json::to_string(&recipe).unwrap_or_default()
}

/// The name that was given, else the file's without its extension.
fn case_name(item: &Item) -> Result<String, ImportError> {
    if let Some(name) = &item.case {
        return Ok(name.clone());
    }
    let stem = match item.path.is_dir() {
        true => item.path.file_name(),
        false => item.path.file_stem(),
    };
    let name = stem.map(|stem| stem.to_string_lossy().into_owned());
    name.ok_or_else(|| ImportError::Name {
        path: item.path.clone(),
        what: "case",
        name: String::new(),
        why: "give one with --case",
    })
}

/// Names stand in files, tables and HDF5 paths.
fn check_name(item: &Item, what: &'static str, name: &str) -> Result<(), ImportError> {
    let why = if name.trim().is_empty() || name == "." || name == ".." {
        "it is none"
    } else if name.contains(|c: char| c.is_control() || c == '/') {
        "it may not contain \"/\" or control characters"
    } else if name.len() > MAX_NAME {
        "it has more than 200 bytes; give a shorter one (--case, --group)"
    } else {
        return Ok(());
    };
    let name = name.chars().take(MAX_NAME).collect();
    Err(ImportError::Name { path: item.path.clone(), what, name, why })
}

/// Longest name of a case or group, in bytes.
const MAX_NAME: usize = 200;
