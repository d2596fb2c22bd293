//! Layout of the database file: `/group/case` with attributes and datasets.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use hdf5_pure::{AttrValue, File, FileBuilder, Group, GroupBuilder};

use super::{Database, DatabaseError, damaged_curve};
use crate::curve::{Case, Curve, EnergyAudit, ForceKind, Masses, Source};
use crate::unit::{Speed, SpeedKind};

/// Value of the root attribute `format`.
pub const FORMAT: &str = "crumple curve database";
/// Layout version this program writes; it reads this and every older one.
pub const VERSION: i64 = 2;

/// Encodes a database as the bytes of an HDF5 file.
pub fn encode(database: &Database) -> Result<Vec<u8>, DatabaseError> {
    let mut file = FileBuilder::new();
    file.set_attr("format", AttrValue::VarLenString(FORMAT.into()));
    file.set_attr("layout_version", AttrValue::I64(VERSION));
    file.set_attr(
        "written_by",
        AttrValue::VarLenString(concat!("crumple ", env!("CARGO_PKG_VERSION")).into()),
    );
    for (name, cases) in &database.groups {
        let mut group = file.create_group(name);
        let names = cases.iter().map(|c| c.name.clone()).collect();
        group.set_attr("cases", AttrValue::VarLenStringArray(names));
        for case in cases {
            let mut builder = group.create_group(&case.name);
            encode_case(case, &mut builder)?;
            group.add_group(builder.finish());
        }
        file.add_group(group.finish());
    }
    file.finish().map_err(|e| DatabaseError::Encode { detail: e.to_string() })
}

fn encode_case(case: &Case, group: &mut GroupBuilder) -> Result<(), DatabaseError> {
    let text = |s: &str| AttrValue::VarLenString(s.into());
    let json = |value: Result<String, serde_json::Error>| {
        value.map_err(|e| DatabaseError::Encode { detail: e.to_string() })
    };
    group.set_attr("study", text(&case.study));
    group.set_attr("speed_m_per_s", AttrValue::F64(case.speed.m_per_s));
    group.set_attr("speed_kind", text(case.speed.kind.name()));
    group.set_attr("mass_kg", AttrValue::F64(case.masses.body_kg));
    if let Some(other) = case.masses.other_kg {
        group.set_attr("other_mass_kg", AttrValue::F64(other));
    }
    group.set_attr("parameters", text(&json(serde_json::to_string(&case.parameters))?));
    group.set_attr("force_kind", text(case.force_kind.name()));
    group.set_attr("contact_time_s", AttrValue::F64(case.contact_time_s));
    if let Some(time_s) = case.solver_wall_time_s {
        group.set_attr("solver_wall_time_s", AttrValue::F64(time_s));
    }
    group.set_attr("loading_end", AttrValue::I64(case.loading_end() as i64));
    group.set_attr("max_deflection_m", AttrValue::F64(case.max_deflection_m()));
    group.set_attr("truncated", AttrValue::U8(case.is_truncated().into()));
    if let Some(stiffness) = case.unloading_stiffness_n_per_m {
        group.set_attr("unloading_stiffness_N_per_m", AttrValue::F64(stiffness));
    }
    group.set_attr("work_J", AttrValue::F64(case.audit.work_j));
    group.set_attr("kinetic_energy_J", AttrValue::F64(case.audit.kinetic_j));
    group.set_attr("work_over_energy", AttrValue::F64(case.audit.ratio()));
    group.set_attr("recipe", text(&case.recipe));
    group.set_attr("fingerprint", text(&case.fingerprint));
    group.set_attr("sources", text(&json(serde_json::to_string(&case.sources))?));
    group.set_attr("notes", text(&json(serde_json::to_string(&case.notes))?));
    group.set_attr("warnings", text(&json(serde_json::to_string(&case.warnings))?));
    encode_curve(&case.sampled, group);
    group.create_dataset("closing_speed_m_per_s").with_f64_data(&case.closing_speed_m_per_s);
    let mut original = group.create_group("original");
    encode_curve(&case.original, &mut original);
    group.add_group(original.finish());
    Ok(())
}

fn encode_curve(curve: &Curve, group: &mut GroupBuilder) {
    group.create_dataset("time_s").with_f64_data(curve.time_s());
    group.create_dataset("deflection_m").with_f64_data(curve.deflection_m());
    group.create_dataset("force_N").with_f64_data(curve.force_n());
}

/// Decodes the bytes of a database file; `path` is for messages.
pub fn decode(path: &Path, bytes: Vec<u8>) -> Result<Database, DatabaseError> {
    let not_hdf5 = |detail: String| DatabaseError::NotHdf5 { path: path.into(), detail };
    if !hdf5_pure::is_hdf5_bytes(&bytes) {
        return Err(not_hdf5("its signature is missing".into()));
    }
    let file = File::from_bytes(bytes).map_err(|e| not_hdf5(e.to_string()))?;
    let root = file.root();
    let attrs = root.attrs().map_err(|e| not_hdf5(e.to_string()))?;
    if attrs.get("format").and_then(AttrValue::as_str) != Some(FORMAT) {
        return Err(DatabaseError::NotOurs { path: path.into() });
    }
    let found = attrs.get("layout_version").and_then(AttrValue::as_i64).unwrap_or(0);
    if !(1..=VERSION).contains(&found) {
        return Err(DatabaseError::Version { path: path.into(), found });
    }
    let mut database = Database::default();
    let names = root.groups().map_err(|e| not_hdf5(e.to_string()))?;
    for name in names {
        let place = Place { path, name: name.clone() };
        let group = place.check(root.group(&name))?;
        for case in place.check(group.groups())? {
            let place = Place { path, name: format!("{name}/{case}") };
            let group = place.check(group.group(&case))?;
            database.put(decode_case(&name, &case, &group, &place)?)?;
        }
    }
    Ok(database)
}

/// Where in the file something is read, for messages.
struct Place<'a> {
    path: &'a Path,
    name: String,
}

impl Place<'_> {
    fn damaged(&self, detail: impl Into<String>) -> DatabaseError {
        DatabaseError::Damaged {
            path: self.path.into(),
            place: self.name.clone(),
            detail: detail.into(),
        }
    }

    fn check<T>(&self, result: Result<T, hdf5_pure::Error>) -> Result<T, DatabaseError> {
        result.map_err(|e| self.damaged(e.to_string()))
    }
}

/// Attributes of one case.
struct Attrs<'a> {
    map: HashMap<String, AttrValue>,
    place: &'a Place<'a>,
}

impl Attrs<'_> {
    fn number(&self, name: &str) -> Result<f64, DatabaseError> {
        self.optional_number(name)?
            .ok_or_else(|| self.place.damaged(format!("attribute {name} is missing or no number")))
    }

    fn optional_number(&self, name: &str) -> Result<Option<f64>, DatabaseError> {
        let value = self.map.get(name).and_then(AttrValue::as_f64);
        if value.is_some_and(|v| !v.is_finite()) {
            return Err(self.place.damaged(format!("attribute {name} is not finite")));
        }
        Ok(value)
    }

    fn positive(&self, name: &str) -> Result<f64, DatabaseError> {
        let value = self.number(name)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(self.place.damaged(format!("attribute {name} is {value}: expected more than 0")))
        }
    }

    fn text(&self, name: &str) -> Result<&str, DatabaseError> {
        self.map
            .get(name)
            .and_then(AttrValue::as_str)
            .ok_or_else(|| self.place.damaged(format!("attribute {name} is missing or no text")))
    }

    fn json<T: serde::de::DeserializeOwned>(&self, name: &str) -> Result<T, DatabaseError> {
        serde_json::from_str(self.text(name)?)
            .map_err(|e| self.place.damaged(format!("attribute {name}: {e}")))
    }
}

fn decode_case(
    group_name: &str,
    name: &str,
    group: &Group,
    place: &Place<'_>,
) -> Result<Case, DatabaseError> {
    let attrs = Attrs { map: place.check(group.attrs())?, place };
    let kind = match attrs.text("speed_kind")? {
        "wall" => SpeedKind::Wall,
        "closing" => SpeedKind::Closing,
        other => return Err(place.damaged(format!("speed_kind \"{other}\" is not known"))),
    };
    let force_kind = match attrs.text("force_kind")? {
        "contact" => ForceKind::Contact,
        "body" => ForceKind::Body,
        other => return Err(place.damaged(format!("force_kind \"{other}\" is not known"))),
    };
    let sampled = decode_curve(group, place)?;
    let closing_speed_m_per_s = numbers(group, "closing_speed_m_per_s", place)?;
    if closing_speed_m_per_s.len() != sampled.time_s().len() {
        return Err(place.damaged("closing_speed_m_per_s and time_s differ in length"));
    }
    if let Some(i) = closing_speed_m_per_s.iter().position(|v| !v.is_finite()) {
        return Err(
            place.damaged(format!("closing_speed_m_per_s of state {} is not finite", i + 1))
        );
    }
    let original_place = Place { path: place.path, name: format!("{}/original", place.name) };
    let original = decode_curve(&place.check(group.group("original"))?, &original_place)?;
    let sources: Vec<Source> = attrs.json("sources")?;
    Ok(Case {
        study: attrs.text("study")?.into(),
        group: group_name.into(),
        name: name.into(),
        speed: Speed { m_per_s: attrs.positive("speed_m_per_s")?, kind },
        masses: Masses {
            body_kg: attrs.positive("mass_kg")?,
            other_kg: match attrs.map.contains_key("other_mass_kg") {
                true => Some(attrs.positive("other_mass_kg")?),
                false => None,
            },
        },
        // Layout version 1 has none.
        parameters: match attrs.map.contains_key("parameters") {
            true => attrs.json("parameters")?,
            false => BTreeMap::new(),
        },
        force_kind,
        sampled,
        closing_speed_m_per_s,
        original,
        contact_time_s: attrs.number("contact_time_s")?,
        solver_wall_time_s: attrs.optional_number("solver_wall_time_s")?,
        unloading_stiffness_n_per_m: attrs.optional_number("unloading_stiffness_N_per_m")?,
        audit: EnergyAudit {
            work_j: attrs.number("work_J")?,
            kinetic_j: attrs.positive("kinetic_energy_J")?,
        },
        recipe: attrs.text("recipe")?.into(),
        fingerprint: attrs.text("fingerprint")?.into(),
        sources,
        notes: attrs.json("notes")?,
        warnings: attrs.json("warnings")?,
    })
}

fn decode_curve(group: &Group, place: &Place<'_>) -> Result<Curve, DatabaseError> {
    let time = numbers(group, "time_s", place)?;
    let deflection = numbers(group, "deflection_m", place)?;
    let force = numbers(group, "force_N", place)?;
    Curve::new(time, deflection, force).map_err(|e| damaged_curve(place.path, &place.name, e))
}

fn numbers(group: &Group, name: &str, place: &Place<'_>) -> Result<Vec<f64>, DatabaseError> {
    let dataset = group.dataset(name).map_err(|e| place.damaged(format!("{name}: {e}")))?;
    dataset.read_f64().map_err(|e| place.damaged(format!("{name}: {e}")))
}
