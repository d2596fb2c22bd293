//! Adding curves of files to a database: each becomes a case of the study `IMPORTED`.
//!
//! All files are read, and all cases made, before anything is written; the database is locked
//! meanwhile, and written as a whole.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::clock;
use crate::curve::from_table::{IMPORTED, from_table};
use crate::curve::recipe::Filter;
use crate::curve::{
    Case, CaseId, Conditions, ForceKind, Impact, Masses, Parameter, Provenance, Quality,
    SourceFile, Table,
};
use crate::database::{self, Database};
use crate::error::{Error, ErrorCode, error};
use crate::file::WriterLock;
use crate::formats::read::{self, Metadata, ReadCurve, ReadOptions};
use crate::history::time_gaps;
use crate::unit::{Shown, Speed, SpeedKind, UnitSystem, km_per_h};

/// One file that is to become a case, with its metadata.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Item {
    /// The file, or an ISO-MME test's folder.
    pub path: PathBuf,
    /// Name of the case; the file's, without its extension, if absent.
    pub case: Option<String>,
    /// Impact speed in m/s; the file's if absent.
    pub speed_m_per_s: Option<f64>,
}

/// Metadata of all files that are added at once.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Settings {
    pub group: String,
    /// What speeds are measured against; the file's if absent, else the group's.
    pub kind: Option<SpeedKind>,
    /// Mass of the body in kg; the file's if absent.
    pub mass_kg: Option<f64>,
    /// Mass of the other body of a pair in kg; the file's if absent, else that of the body.
    pub other_mass_kg: Option<f64>,
    /// Unloading stiffness in N/m; the file's if absent.
    pub unloading_stiffness_n_per_m: Option<f64>,
    /// How the files are read; its force is also the kind of a curve whose file does not state it.
    pub read: ReadOptions,
    pub parameters: BTreeMap<String, Parameter>,
    /// Replace cases of these names that were added before.
    pub replace: bool,
    /// Accept curves whose energy is impossible for the impact.
    pub accept_energy: bool,
}

/// Adds the curves of `items` to the database at `path`, which is created if it does not exist; returns
/// their cases in the order of the items.
pub(crate) fn add(path: &Path, items: &[Item], settings: &Settings) -> Result<Vec<Case>, Error> {
    let _lock = WriterLock::take(path)?;
    let mut database = if path.try_exists().unwrap_or(true) {
        Database::read_as_it_is(path)?
    } else {
        Database::default()
    };
    let mut cases: Vec<Case> = Vec::with_capacity(items.len());
    let now = clock::now_utc();
    for item in items {
        let mut case = case_of(item, settings, database.cases(&settings.group).first())?;
        case.provenance.built_utc = Some(now.clone());
        if let Some(k) = cases.iter().position(|c| c.id.name == case.id.name) {
            return Err(error!(
                Import,
                "{first} and {second} would both be case \"{name}\": name them with --case",
                first = items[k].path.display(),
                name = case.id.name,
                second = item.path.display()
            ));
        }
        check_place(&database, item, &case, settings.replace)?;
        if let Some(first) = cases.first() {
            check_kinds(item, &case, first)?;
        }
        if let Some(before) = existing_case(&database, &case) {
            // Tags and notes are kept for the case that replaces it.
            (case.provenance.tags, case.provenance.user_notes) =
                (before.provenance.tags.clone(), before.provenance.user_notes.clone());
        }
        cases.push(case);
    }
    database.put_all(cases.iter().cloned())?;
    database.write(path)?;
    Ok(cases)
}

fn existing_case<'a>(database: &'a Database, case: &Case) -> Option<&'a Case> {
    database.cases(&case.id.group).iter().find(|c| c.id.name == case.id.name)
}

fn check_place(database: &Database, item: &Item, case: &Case, replace: bool) -> Result<(), Error> {
    let (path, group, name) = (item.path.display(), &case.id.group, &case.id.name);
    match existing_case(database, case) {
        Some(other) if other.id.study != IMPORTED => Err(error!(
            Import,
            "{path}: case \"{name}\" of group \"{group}\" belongs to the study \"{study}\", which builds it: give another name with --case",
            study = other.id.study
        )),
        Some(_) if !replace => Err(error!(
            Import,
            "{path}: group \"{group}\" has a case \"{name}\" already: replace it with --replace, or give another name with --case"
        )),
        // A case that is replaced imposes no restriction.
        _ => match database.cases(group).iter().find(|c| c.id.name != *name) {
            Some(other) => check_kinds(item, case, other),
            None => Ok(()),
        },
    }
}

fn check_kinds(item: &Item, case: &Case, other: &Case) -> Result<(), Error> {
    let Some((what, found, there)) = case.other_kind(other) else { return Ok(()) };
    Err(error!(
        Import,
        "{path}: this curve has a {found} {what}, the cases of group \"{group}\" have a {there} one: no model can be trained on both; give another --group",
        group = case.id.group,
        path = item.path.display()
    ))
}

/// The case of the curve of one file; `group`: a case of its group in the database, if there is one.
pub(crate) fn case_of(
    item: &Item,
    settings: &Settings,
    group: Option<&Case>,
) -> Result<Case, Error> {
    check_name(item, "group", &settings.group)?;
    let (curve, format) = read::read(&item.path, &settings.read)?;
    let name = case_name(item)?;
    check_name(item, "case", &name)?;
    let (notes, warnings) = (Vec::new(), Vec::new());
    let mut both = StatedAndFound { item, settings, facts: &curve.facts, notes, warnings };
    let (speed, masses, force_kind) = both.impact(group)?;
    let stiffness = settings.unloading_stiffness_n_per_m;
    let impact = Impact {
        force_kind,
        speed,
        masses,
        unloading_stiffness_n_per_m: stiffness.or(curve.facts.unloading_stiffness_n_per_m),
        // One that was given belongs to the force of the curve.
        body_unloading_stiffness_n_per_m: match stiffness {
            Some(_) => None,
            None => curve.facts.body_unloading_stiffness_n_per_m,
        },
        contact_time_s: curve.facts.contact_time_s,
        units: curve.units.unwrap_or(UnitSystem::SI),
        accept_energy: settings.accept_energy,
    };
    let table = Table {
        deflection_m: &curve.deflection_m,
        force_n: &curve.force_n,
        time_s: curve.time_s.as_deref(),
        body_force_n: curve.body_force_n.as_deref(),
    };
    let (curves, quality) = from_table(&table, &impact)
        .map_err(|error| error.coded(ErrorCode::Import).of(item.path.display()))?;
    let moves = table.time_s.is_none() && table.body_force_n.is_none();
    let stated = curve.facts.force.or(settings.read.force);
    let is_contact_alone = moves && stated == Some(ForceKind::Contact);
    let alone = is_contact_alone.then(|| CONTACT_ALONE.to_string());
    let interval_s = curves.sampled.time_s().get(1).copied().unwrap_or_default();
    let recipe = recipe(item, settings, &curve, format, &impact, is_contact_alone, interval_s);
    let mut hash = blake3::Hasher::new();
    hash.update(recipe.as_bytes());
    for file in &curve.files {
        hash.update(file.blake3.as_bytes());
    }
    let sources = curve.files.iter().map(|file| {
        let (format, title) = (format.into(), curve.title.clone());
        SourceFile { format, title, ..file.clone() }
    });
    let gaps = time_gaps(curve.time_s.as_deref().unwrap_or_default());
    let gaps = gaps.iter().map(|gap| format!("time: {gap}; the curve is drawn straight across"));
    let notes = curve.notes.iter().cloned().chain(both.notes).chain(quality.notes);
    Ok(Case {
        id: CaseId { study: IMPORTED.into(), group: settings.group.clone(), name },
        conditions: Conditions { speed, masses, parameters: settings.parameters.clone() },
        curves,
        quality: Quality {
            audit: quality.audit,
            notes: notes.collect(),
            warnings: both
                .warnings
                .into_iter()
                .chain(alone)
                .chain(gaps)
                .chain(quality.warnings)
                .collect(),
        },
        provenance: Provenance {
            fingerprint: hash.finalize().to_hex().to_string(),
            recipe,
            sources: sources.collect(),
            ..Provenance::default()
        },
    })
}

/// What a contact force over deflection leaves open, where it is stated to be one.
const CONTACT_ALONE: &str = "force: only the contact force is known: a single-mass vehicle is driven by less, where its crush zone stops mass early";

/// Everything besides the file that determines the case's numbers, as JSON.
// `document!` calls the type of a field as the field.
#[allow(non_camel_case_types)]
fn recipe(
    item: &Item,
    settings: &Settings,
    curve: &ReadCurve,
    format: &str,
    impact: &Impact,
    is_contact_alone: bool,
    interval_s: f64,
) -> String {
    let Impact { speed, masses, force_kind, .. } = *impact;
    let recipe = document! {
        study: IMPORTED,
        units: curve.units,
        kind: speed.kind,
        imported: document! {
            path: item.path.display().to_string(),
            format: format,
            curve: settings.read.curve.as_deref(),
            // Whether the motion is that of the file's times.
            has_times: curve.time_s.is_some(),
            // Whether the motion was made of the case's own force, which then moves the body, too.
            moves_by_its_force: curve.time_s.is_none() && curve.body_force_n.is_none(),
            // Whether the file is said to hold the contact force, so that the one that moves the body is not known.
            contact_alone if_any: is_contact_alone.then_some(true),
            force: force_kind,
            speed_m_per_s: speed.m_per_s,
            mass_kg: masses.body_kg,
            other_mass_kg: masses.other_kg,
            unloading_stiffness_N_per_m: impact.unloading_stiffness_n_per_m,
            parameters: &settings.parameters,
            accept_energy: settings.accept_energy,
            filter: Filter::None,
            sampling_interval_ms: 1e3 * interval_s,
        },
    };
    // A structure of texts and finite numbers is always JSON.
    serde_json::to_string(&recipe).unwrap_or_default()
}

/// The name that was given, else the file's without its extension.
fn case_name(item: &Item) -> Result<String, Error> {
    if let Some(name) = &item.case {
        return Ok(name.clone());
    }
    let stem = if item.path.is_dir() { item.path.file_name() } else { item.path.file_stem() };
    let name = stem.map(|stem| stem.to_string_lossy().into_owned());
    name.ok_or_else(|| {
        error!(
            Import,
            "{}: \"\" cannot be the name of a case: give one with --case",
            item.path.display()
        )
    })
}

fn check_name(item: &Item, what: &'static str, name: &str) -> Result<(), Error> {
    database::check_name(name).map_err(|why| {
        error!(
            Import,
            "{path}: \"{name}\" cannot be the name of a {what}: {why}",
            name = name.escape_debug(),
            path = item.path.display()
        )
    })
}

/// Two values this close are one.
const SAME: f64 = 0.01;

/// What is stated of a file and what was found in it: stated values take precedence, and a warning
/// says where the file differs.
struct StatedAndFound<'a> {
    pub item: &'a Item,
    pub settings: &'a Settings,
    pub facts: &'a Metadata,
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

impl StatedAndFound<'_> {
    /// The impact of the curve, and which force it is. `group`: a case that is there, whose kind of
    /// speed is the default.
    fn impact(&mut self, group: Option<&Case>) -> Result<(Speed, Masses, ForceKind), Error> {
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
