//! Arguments that several commands share, and the kind of an input file by its first bytes.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};

use super::{Failure, is_stdout, usage};
use crate::curve::{ForceKind, Parameter};
use crate::error::error;
use crate::file;
use crate::formats;
use crate::formats::read::ReadOptions;
use crate::import::Settings;
use crate::solver::{Selection, WantedId};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::sweep;
use crate::unit::{STIFFNESS, SpeedKind, mass_kg};

/// A file or folder that cannot be standard output.
pub(super) fn named() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match is_stdout(&path) {
        true => Err("this cannot be written to standard output: name it (./- for the name -)"),
        false => Ok(path),
    })
}

/// A case parameter: `angle_deg=10` or `obstacle=pole`.
pub(super) fn parameter(text: &str) -> Result<(String, Parameter), String> {
    let (name, value) = text
        .split_once('=')
        .filter(|(name, value)| !name.is_empty() && !value.is_empty())
        .ok_or_else(|| format!("\"{text}\" is not a parameter: write NAME=VALUE"))?;
    let value = match value.parse::<f64>() {
        Ok(number) if number.is_finite() => Parameter::Number(number),
        Ok(_) => return Err(format!("\"{value}\" is not finite")),
        Err(_) => Parameter::Category(value.into()),
    };
    Ok((name.into(), value))
}

/// Parameters by their names, each given once.
pub(super) fn parameters(
    given: &[(String, Parameter)],
) -> Result<BTreeMap<String, Parameter>, Failure> {
    let mut by_name = BTreeMap::new();
    for (name, value) in given {
        if by_name.insert(name.clone(), value.clone()).is_some() {
            return usage(format!("--parameter {name}=… is given twice"));
        }
    }
    Ok(by_name)
}

/// Histories of a solver's file by their options; what is not named is not narrowed.
pub(super) fn selection(
    ids: &[WantedId],
    components: &[String],
    section: Option<&str>,
) -> Selection {
    Selection {
        ids: (!ids.is_empty()).then(|| ids.to_vec()),
        components: (!components.is_empty()).then(|| components.to_vec()),
        section: section.map(Into::into),
        ..Selection::all()
    }
}

/// One of a few values of the library, by name and with a line of help each.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    values: &'static [(&'static str, T, &'static str)],
) -> impl TypedValueParser<Value = T> {
    let names = values.iter().map(|(name, _, help)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names).map(|given| {
        let found = values.iter().find(|(name, ..)| *name == given);
        found.expect("the parser lets only these names pass").1
    })
}

pub(super) const MAX_CRUSH_RULES: &[(&str, MaxCrushRule, &str)] = &[
    ("spline", MaxCrushRule::Spline, "Cubic spline through the training speeds (reference method)"),
    ("monotone", MaxCrushRule::Monotone, "Monotone cubic through (0, 0) and the training speeds"),
    ("energy", MaxCrushRule::Energy, "Where the curve has absorbed the kinetic energy"),
    ("motion", MaxCrushRule::Motion, "Where the body's own force has stopped it"),
];

/// Forces of a curve.
pub(super) const FORCES: &[(&str, ForceKind, &str)] = &[
    ("body", ForceKind::Body, "The force that drives a single-mass body"),
    (
        "contact",
        ForceKind::Contact,
        "The force on the obstacle: for bodies whose crush zone is a separate mass",
    ),
];

/// How a curve's file is read.
#[derive(clap::Args)]
pub(super) struct Reading {
    /// Format of the file, if not recognised by its content (crumple db add --list)
    #[arg(long)]
    from: Option<String>,
    /// Number or name of the curve in a file that holds several
    #[arg(long)]
    curve: Option<String>,
    /// Deflection column of a table, by its header or its number from 1
    #[arg(long, value_name = "COLUMN")]
    deflection_column: Option<String>,
    /// Force column
    #[arg(long, value_name = "COLUMN")]
    force_column: Option<String>,
    /// Time column; none for force over deflection without times (quasi-static tests)
    #[arg(long, value_name = "COLUMN")]
    time_column: Option<String>,
}

/// How a file is read, and the impact that its curve belongs to.
#[derive(clap::Args)]
pub(super) struct CurveFile {
    /// What the speed is measured against [default: as the file states, else the group's]
    #[arg(long, value_parser = one_of(KINDS))]
    kind: Option<SpeedKind>,
    /// Mass of the other body of a pair [default: as the file states, else that of the body]
    #[arg(long, value_parser = mass_kg, allow_hyphen_values = true)]
    other_mass: Option<f64>,
    /// Unloading stiffness from the maximum deflection, such as 80MN/m [default: the file's]
    #[arg(long, value_parser = |text: &str| STIFFNESS.parse_positive(text), allow_hyphen_values = true)]
    unloading: Option<f64>,
    #[command(flatten)]
    reading: Reading,
    /// Accept curves whose energy is impossible for the speed and mass
    #[arg(long)]
    accept_energy: bool,
}

const KINDS: &[(&str, SpeedKind, &str)] = &[
    ("wall", SpeedKind::Wall, "Of one body against a rigid wall"),
    ("closing", SpeedKind::Closing, "Of two bodies against each other"),
];

impl Reading {
    /// Whether any of the options is given.
    pub(super) fn is_asked(&self) -> bool {
        self.options() != ReadOptions::default()
    }

    /// The given options, and defaults for the rest.
    pub(super) fn options(&self) -> ReadOptions {
        ReadOptions {
            format: self.from.clone(),
            curve: self.curve.clone(),
            deflection_column: self.deflection_column.clone(),
            force_column: self.force_column.clone(),
            time_column: self.time_column.clone(),
            ..ReadOptions::default()
        }
    }
}

impl CurveFile {
    /// Whether any of the options is given.
    pub(super) fn is_asked(&self) -> bool {
        self.settings() != Settings::default()
    }

    /// The given options, and defaults for the rest.
    pub(super) fn settings(&self) -> Settings {
        Settings {
            kind: self.kind,
            other_mass_kg: self.other_mass,
            unloading_stiffness_n_per_m: self.unloading,
            read: self.reading.options(),
            accept_energy: self.accept_energy,
            ..Settings::default()
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileKind {
    Database,
    Model,
    /// Predicted curve.
    Curve,
    Scenario,
    /// Result of a multi-body run.
    Result,
    /// Results of a sweep.
    Sweep,
    /// Anything else: what a solver has written, if it is known at all.
    Solver,
}

/// Bytes in which a file says what it is.
const HEAD: u64 = 4096;
/// With these every HDF5 file begins.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

fn head(path: &Path) -> Result<Vec<u8>, Failure> {
    let mut head = Vec::new();
    file::open(path)
        .and_then(|f| f.take(HEAD).read_to_end(&mut head))
        .map_err(|e| error!(CurveFile, "{path}: {e}", path = path.display()).caused_by(e))?;
    Ok(head)
}

/// Whether the file at `path` is by its name an input of another tool, and does not say that crumple wrote it.
pub(super) fn is_others_deck(path: &Path) -> Result<bool, Failure> {
    let says = |head: Vec<u8>| String::from_utf8_lossy(&head).contains("written_by: crumple");
    Ok(formats::is_deck(path) && !says(head(path)?))
}

impl FileKind {
    pub(super) fn of(path: &Path) -> Result<Self, Failure> {
        let head = head(path)?;
        if head.starts_with(HDF5) {
            return Ok(if sweep::is_table(path) { Self::Sweep } else { Self::Database });
        }
        let text = String::from_utf8_lossy(&head);
        let text = text.trim_start_matches('\u{feff}');
        let is_toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        Ok(match () {
            () if text.trim_start().starts_with('{') && text.contains("\"crumple model\"") => {
                Self::Model
            }
            () if text.trim_start().starts_with('{') => Self::Curve,
            () if is_toml => Self::Scenario,
            () if text.starts_with("time_s,") || formats::is_run(&head) => Self::Result,
            () if text.starts_with("# crumple sweep") => Self::Sweep,
            () => Self::Solver,
        })
    }

    /// As a message calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Database => "a database",
            Self::Model => "a model",
            Self::Curve => "a predicted curve",
            Self::Scenario => "a scenario",
            Self::Result => "a result",
            Self::Sweep => "a sweep's result",
            Self::Solver => "read as a solver file",
        }
    }
}
