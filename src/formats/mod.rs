//! Curves to files of other tools: one file per format, one line in [`FORMATS`]. [`read`] reads them
//! back.
//!
//! Shared by all targets: the prepared curve ([`ExportCurve`]), its tail, thinning, softening, numbers and
//! titles as text.

mod adams;
mod calculix;
mod csv;
mod export_curve;
pub(crate) mod fmu;
pub(crate) mod iso_mme;
mod json;
mod lsdyna;
mod mat;
pub(crate) mod mdf;
mod modelica;
mod onnx;
mod radioss;
pub(crate) mod read;
mod table;
mod text;
mod thin;

use std::collections::BTreeSet;
use std::iter;
use std::path::Path;

use crate::curve::{Case, ForceKind, Tail};
use crate::error::{Error, error};
use crate::guess;
use crate::signal::interpolate;
use crate::surrogate::{Model, PredictedCurve, Query};
use crate::unit::{Shown, UnitSystem};
pub use export_curve::ExportCurve;
pub(crate) use export_curve::TargetUnloading;
pub use fmu::{FmiVersion, Spring, archive, binaries};
pub use lsdyna::Material;
pub use read::{Metadata, ReadCurve, ReadOptions, read, readers};
pub(crate) use read::{history, is_run, run_table};

/// One target: its name, file extensions, capabilities and writer.
pub struct Format {
    /// As `--to` takes it.
    pub name: &'static str,
    /// Without the dot; the first is the usual one.
    pub extensions: &'static [&'static str],
    /// One line for `export --list`.
    pub description: &'static str,
    /// Default continuation of its curves beyond the maximum crush; `Tail::None` for
    /// files whose curves cannot continue.
    pub tail: Tail,
    /// Whether it can be in other units than SI (`--units`).
    pub(crate) units: bool,
    /// Whether it can be a complete input of one mass on the spring (`--deck`).
    pub deck: bool,
    /// Whether it has several spring materials (`--material`).
    pub materials: bool,
    /// Whether curves have numbers in it (`--curve-id`).
    pub ids: bool,
    /// Whether it holds a band with its curves.
    pub band: bool,
    /// Whether it holds a model at several speeds, so that it accepts the options of a model.
    pub(crate) over_speeds: bool,
    writer: Writer,
}

/// The input of a target.
enum Writer {
    /// Curves, each with a file of its own.
    Each(fn(&ExportCurve, &Options) -> Result<Exported, Error>),
    /// Any number of curves in one file.
    Together(fn(&[ExportCurve], &Options) -> Result<Exported, Error>),
    /// A predicted or recorded curve with both forces.
    Whole(fn(&PredictedCurve) -> Result<Exported, Error>),
    Model(fn(&Model, &Options) -> Result<Exported, Error>),
    /// A recorded case with its histories.
    Case(fn(&Case) -> Result<Exported, Error>),
}

/// A format without further capabilities.
const fn of(tail: Tail, writer: Writer) -> Format {
    Format {
        name: "",
        extensions: &[],
        description: "",
        tail,
        units: false,
        deck: false,
        materials: false,
        ids: false,
        band: false,
        over_speeds: false,
        writer,
    }
}

/// Every format we write. To add one: write its module, add its line here with its capabilities.
pub const FORMATS: &[Format] = &[
    Format {
        name: "json",
        extensions: &["json"],
        description: "predicted curve with all its data, SI (master format)",
        ..of(Tail::None, Writer::Whole(json::write))
    },
    Format {
        name: "csv",
        extensions: &["csv"],
        description: "columns of deflection and force with # header lines, SI or --units",
        units: true,
        band: true,
        ..of(Tail::Bottom, Writer::Each(csv::write))
    },
    Format {
        name: "lsdyna",
        extensions: &["k", "key", "dyn"],
        description: "LS-DYNA curves with a spring material, in the study's units or --units; --deck",
        units: true,
        deck: true,
        materials: true,
        ids: true,
        ..of(Tail::Bottom, Writer::Together(lsdyna::write))
    },
    Format {
        name: "radioss",
        extensions: &["rad"],
        description: "Radioss /FUNCT and /PROP/TYPE4, in the study's units or --units; --deck",
        units: true,
        deck: true,
        ids: true,
        ..of(Tail::Bottom, Writer::Together(radioss::write))
    },
    Format {
        name: "calculix",
        extensions: &["inp"],
        description: "CalculiX or Abaqus *SPRING, NONLINEAR (elastic, at most 200 rows), SI or --units",
        units: true,
        deck: true,
        ids: true,
        ..of(Tail::Bottom, Writer::Together(calculix::write))
    },
    Format {
        name: "adams",
        extensions: &["cmd", "adm", "spr"],
        description: "Adams spline: View command, Solver statement or spring property file",
        units: true,
        ids: true,
        ..of(Tail::Bottom, Writer::Together(adams::write))
    },
    Format {
        name: "fmi2",
        extensions: &["fmu"],
        description: "FMU of FMI 2.0, model exchange and co-simulation, complete law with memory, SI",
        ..of(Tail::Bottom, Writer::Each(|curve, _| fmu::write(curve, FmiVersion::Fmi2)))
    },
    Format {
        name: "fmi3",
        extensions: &["fmu"],
        description: "the same for FMI 3.0",
        ..of(Tail::Bottom, Writer::Each(|curve, _| fmu::write(curve, FmiVersion::Fmi3)))
    },
    Format {
        name: "modelica",
        extensions: &["mo", "txt"],
        description: "Modelica package with the spring and its memory, or a CombiTable text, SI",
        ..of(Tail::Bottom, Writer::Together(modelica::write))
    },
    Format {
        name: "mat",
        extensions: &["mat"],
        description: "MAT v4 matrices for MATLAB, Octave, scipy and Modelica, SI",
        band: true,
        ..of(Tail::Bottom, Writer::Together(|curves, _| mat::write(curves)))
    },
    Format {
        name: "iso-mme",
        extensions: &["mme"],
        description: "ISO-MME folder of a case's histories: displacement, velocity, force, SI",
        ..of(Tail::None, Writer::Case(iso_mme::write_case))
    },
    Format {
        name: "mdf",
        extensions: &["mf4"],
        description: "MDF 4 (ASAM) with a case's histories: deflection, velocity, force, SI",
        ..of(Tail::None, Writer::Case(mdf::write_case))
    },
    Format {
        name: "table",
        extensions: &["h5", "hdf5", "csv"],
        description: "force over speed and deflection of a model, HDF5 or CSV, SI",
        over_speeds: true,
        ..of(Tail::Hold, Writer::Model(table::write))
    },
    Format {
        name: "onnx",
        extensions: &["onnx"],
        description: "forest model (of crumple train) as ONNX, SI; splits double, output float",
        ..of(Tail::None, Writer::Model(|model, _| onnx::write(model)))
    },
];

/// Options of some targets.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Units of the file; the target's usual ones if absent.
    pub units: Option<UnitSystem>,
    /// Number of the first curve in the target's deck.
    pub id: u32,
    /// Which force.
    pub force: ForceKind,
    /// Continuation beyond the maximum crush; the target's default if absent.
    pub tail: Option<Tail>,
    /// Reduce rises steeper than the unloading stiffness, at equal energy.
    pub soften: bool,
    /// Which spring material of LS-DYNA.
    pub material: Material,
    /// A complete input of one mass on the spring, not only the spring.
    pub deck: bool,
    /// Extension of the kind of file that will be written, where a target has several; the usual one if absent or of none.
    pub extension: Option<String>,
    /// Name of the file that will be written, without its extension, if it is to be one.
    pub stem: Option<String>,
    /// Speeds in m/s of a table over speeds; none for even steps over the training speeds.
    pub speeds_m_per_s: Vec<f64>,
    /// Mass, rule and parameters of a table; its speed is not used.
    pub query: Query,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            units: None,
            id: 101,
            force: ForceKind::Body,
            tail: None,
            soften: false,
            material: Material::default(),
            deck: false,
            extension: None,
            stem: None,
            speeds_m_per_s: Vec::new(),
            query: Query::at(0.0),
        }
    }
}

/// The result of an export: one file, or several in a folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exported {
    /// Name and bytes of each file. A single file takes the name that the user gives; several
    /// take theirs within the folder that the user names. Names may hold `/`.
    pub files: Vec<(String, Vec<u8>)>,
    /// Notes on the curves in the target.
    pub notes: Vec<String>,
    /// Warnings of the curves that were made for it.
    pub warnings: Vec<String>,
}

/// Where an export of the common times of a recorded case is off by more than 1 % of its largest force.
fn sampled_note(case: &Case) -> Option<String> {
    let (common, own) = (&case.curves.sampled, &case.curves.original);
    let (from_s, to_s) = (common.time_s().first()?, common.time_s().last()?);
    let states = || own.time_s().iter().zip(own.force_n());
    let (time_s, force_n): (Vec<f64>, Vec<f64>) =
        states().filter(|(t, _)| (from_s..=to_s).contains(t)).unzip();
    let lines_n = interpolate(common.time_s(), common.force_n(), &time_s).ok()?;
    let off_n = force_n.iter().zip(&lines_n).map(|(own, line)| (own - line).abs());
    let (off_n, largest_n) = (off_n.fold(0.0, f64::max), case.peak_force_n());
    (off_n > 0.01 * largest_n).then(|| {
        format!(
            "{}: the file has the force at the recipe's common times, which differs by up to {} from the record's own states (crumple db export --originals writes those of a database)",
            case.id.name,
            Shown::one_force(off_n)
        )
    })
}

impl Exported {
    /// One file without notes.
    pub(crate) fn file(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self { files: vec![(name.into(), bytes)], ..Self::default() }
    }

    /// One file of all curves, named after the first.
    fn of_all(curves: &[ExportCurve], ending: &str, bytes: Vec<u8>, notes: Vec<String>) -> Self {
        let stem = curves.first().map_or("curves".into(), ExportCurve::file_stem);
        Self { notes, ..Self::file(format!("{stem}.{ending}"), bytes) }
    }
}

/// Maximum number of bytes of a file that holds a curve: a predicted one has some ten thousand.
pub(crate) const MAX_CURVE_BYTES: u64 = 64 << 20;

/// Minimum number of points that every target accepts.
pub(crate) const MIN_POINTS: usize = 4;

impl Format {
    /// Its extension that is called `name`, in letters of either case.
    pub(crate) fn kind(&self, name: &str) -> Option<&'static str> {
        self.extensions.iter().find(|e| e.eq_ignore_ascii_case(name)).copied()
    }

    /// Whether it takes a whole model, not its curves.
    pub fn takes_model(&self) -> bool {
        matches!(self.writer, Writer::Model(_))
    }

    /// Whether it takes recorded cases, not curves.
    pub fn takes_case(&self) -> bool {
        matches!(self.writer, Writer::Case(_))
    }

    /// Whether one file holds both forces of a curve, each with its unloading.
    pub(crate) fn holds_both_forces(&self) -> bool {
        matches!(self.writer, Writer::Whole(_))
    }

    /// Whether its curves can continue beyond the maximum crush.
    pub(crate) fn takes_tail(&self) -> bool {
        self.tail != Tail::None
    }

    /// The files of a model.
    ///
    /// # Errors
    /// If the target cannot take the model.
    pub fn export_model(&self, model: &Model, options: &Options) -> Result<Exported, Error> {
        self.check(options)?;
        match self.writer {
            Writer::Model(write) => write(model, options),
            _ => Err(self.unfit("a curve: name its speed with --speed")),
        }
    }

    /// The files of recorded cases, one set for each.
    pub(crate) fn export_cases(
        &self,
        cases: &[Case],
        options: &Options,
    ) -> Result<Exported, Error> {
        let Writer::Case(write) = self.writer else {
            return Err(self.unfit("curves: it has no histories"));
        };
        self.check(options)?;
        let mut all = cases.iter().map(write).collect::<Result<Vec<_>, _>>()?;
        if let [_, _, ..] = &all[..] {
            // Each test has a folder of its own, also where names differ in what a file's name cannot hold.
            let mut taken = BTreeSet::new();
            for (exported, case) in all.iter_mut().zip(cases) {
                let plain: String = case.id.name.chars().map(export_curve::plain).collect();
                let numbered = (2..).map(|k| format!("{plain}-{k}"));
                let mut folders = iter::once(plain.clone()).chain(numbered);
                let free = |folder: &String| taken.insert(folder.to_lowercase());
                let folder = folders.find(free).unwrap_or(plain);
                exported.files.iter_mut().for_each(|f| f.0 = format!("{folder}/{}", f.0));
            }
        }
        Ok(joined(all))
    }

    /// The files of curves: of the force that the options name, or of both where one file holds both.
    ///
    /// # Errors
    /// If the target cannot take them.
    pub fn export(&self, inputs: &[PredictedCurve], options: &Options) -> Result<Exported, Error> {
        for input in inputs {
            let points = input.deflection_m.len();
            if points < MIN_POINTS {
                return Err(self.unfit(format!("{MIN_POINTS} points or more, found {points}")));
            }
        }
        self.check(options)?;
        if options.deck && self.deck && inputs.len() != 1 {
            let (name, found) = (self.name, inputs.len());
            return Err(error!(
                Export,
                "{name} --deck takes one curve for a deck of one mass, found {found}"
            ));
        }
        let exported = match self.writer {
            Writer::Model(_) => {
                let how = format!("a model: crumple export MODEL --to {}", self.name);
                return Err(self.unfit(how));
            }
            Writer::Case(_) => {
                return Err(self.unfit(
                    "histories over time: name a case of a database, which has them, or use crumple simulate -o",
                ));
            }
            Writer::Whole(write) => joined(inputs.iter().map(write).collect::<Result<_, _>>()?),
            Writer::Each(write) => {
                let curves = options.ready(inputs, self.tail)?;
                let files = curves.iter().map(|c| write(c, options)).collect::<Result<_, _>>()?;
                self.with_notes(joined(files), &curves)
            }
            Writer::Together(write) => {
                let curves = options.ready(inputs, self.tail)?;
                self.with_notes(write(&curves, options)?, &curves)
            }
        };
        let mut exported = with_names_of_their_own(exported);
        if options.deck && options.force == ForceKind::Contact {
            exported.notes.push("the deck's single mass is driven by the contact force, which includes mass that the crush zone stops early: its crush and rebound differ from the run's; use the body force".into());
        }
        Ok(exported)
    }

    /// Changes to the curves, and omissions, after the target's own notes.
    fn with_notes(&self, mut exported: Exported, curves: &[ExportCurve]) -> Exported {
        exported.notes.extend(curves.iter().flat_map(ExportCurve::change_notes));
        if self.band {
            exported.notes.extend(curves.iter().filter_map(ExportCurve::no_band_note));
        }
        exported
    }

    fn check(&self, options: &Options) -> Result<(), Error> {
        if !IDS.contains(&options.id) {
            let (id, last) = (options.id, IDS.end());
            return Err(error!(Usage, "the id is {id}: expected 1 to {last}"));
        }
        if options.units.is_none() || self.units {
            return Ok(());
        }
        let with: Vec<&str> = FORMATS.iter().filter(|f| f.units).map(|f| f.name).collect();
        let (format, with) = (self.name, with.join(", "));
        Err(error!(
            Usage,
            "{format} is always in SI: remove --units, or take a format that has units ({with})"
        ))
    }

    fn unfit(&self, needs: impl std::fmt::Display) -> Error {
        error!(Export, "{format} takes {needs}", format = self.name)
    }
}

/// First ids of a deck's keywords: eight digits, with room for those of the curves that follow.
pub(crate) const IDS: std::ops::RangeInclusive<u32> = 1..=99_999_000;

/// States of a deck's histories, as in the reference data.
const NUMBER_OF_STATES: f64 = 400.0;

/// Time in s until a body on this curve has rebounded: a constant force takes 2 d/v to stop it.
fn run_time_s(curve: &ExportCurve) -> f64 {
    4.0 * curve.max_crush_m() / curve.predicted.speed_m_per_s
}

fn joined(all: Vec<Exported>) -> Exported {
    let mut whole = Exported::default();
    for one in all {
        whole.files.extend(one.files);
        whole.notes.extend(one.notes);
        whole.warnings.extend(one.warnings);
    }
    whole
}

/// Curves of one speed would overwrite each other's files: the later ones are numbered.
fn with_names_of_their_own(mut exported: Exported) -> Exported {
    for i in 1..exported.files.len() {
        let (before, rest) = exported.files.split_at_mut(i);
        let name = rest[0].0.clone();
        let (stem, extension) = name.rsplit_once('.').unwrap_or((&name, ""));
        let mut number = 1;
        while before.iter().any(|(other, _)| *other == rest[0].0) {
            number += 1;
            rest[0].0 = format!("{stem}-{number}.{extension}");
        }
    }
    exported
}

/// The format of that name.
///
/// # Errors
/// It lists the existing names.
pub fn by_name(name: &str) -> Result<&'static Format, Error> {
    // "--to spr" names one of the kinds of file of a format.
    let by_kind = || FORMATS.iter().find(|f| f.extensions.contains(&name));
    FORMATS.iter().find(|f| f.name == name).or_else(by_kind).ok_or_else(|| {
        let known = names();
        error!(
            Export,
            "there is no export format \"{name}\": use one of {known}{}",
            guess::hint(name, &known)
        )
    })
}

/// The names of all formats, for messages.
pub(crate) fn names() -> String {
    FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")
}

/// Whether a file is by its extension one that users of other tools write themselves, such as a solver's deck.
pub(crate) fn is_deck(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let of_ids = FORMATS.iter().filter(|f| f.ids).any(|f| f.kind(extension).is_some());
    of_ids || extension.eq_ignore_ascii_case("mo")
}

/// The format that the file's extension names.
pub(crate) fn by_extension(path: &Path) -> Result<&'static Format, Error> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let known = || {
        let all = FORMATS.iter().flat_map(|f| f.extensions).map(|e| format!(".{e}"));
        let mut seen = BTreeSet::new();
        all.filter(|e| seen.insert(e.clone())).collect::<Vec<_>>().join(", ")
    };
    FORMATS.iter().find(|f| f.extensions.contains(&extension)).ok_or_else(|| {
        error!(Export, "{path}: the extension does not name an export format: use one of {known}, or name the format with --to", known = known(), path = path.display())
    })
}
