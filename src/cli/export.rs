//! `crumple export`: curves, models and recorded cases as files for other tools: a file, a folder of several, or standard output.

use std::fs;
use std::path::{Path, PathBuf};

use super::arguments::{self, CurveFile, FORCES, FileKind, MAX_CRUSH_RULES, one_of};
use super::export_input::Input;
use super::{CommandResult, Failure, GlobalOptions, keep_input, output, usage, usage_error};
use crate::curve::{ForceKind, Parameter, Tail};
use crate::error::Error;
use crate::file::{not_written, write_all_whole};
use crate::formats::{self, Exported, FORMATS, Format, IDS, Material, Options};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::{PredictedCurve, Query, WarningCode};
use crate::unit::{UnitSystem, mass_kg, speed_m_per_s};
use crate::words::counted;

/// Write curves, recorded cases or a model for another tool
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple export lead50.json --to lsdyna --units mm-t-s -o lead50.k
  crumple export lead50.json --to csv
  crumple export lead.model --speed 36km/h,50km/h --to modelica -o lead
  crumple export curves.h5 --group lead-car-wall --to lsdyna -o lead-car-wall.k
  crumple export lead.model --to table -o lead-table.h5
  crumple export ddtcm.model --to onnx -o ddtcm.onnx
  crumple export test12.csv --speed 50km/h --kind wall --mass 24t --to lsdyna -o test12.k
  crumple export --list

Beyond the maximum crush, files for multi-body tools continue along faster runs where a model has
them, else at the curve's last force (or the mean of its last tenth if that is more) up to 1.5 times the
maximum crush, and then rise with the unloading stiffness. --tail changes this.

ONNX: input is records, double, N x 2: speed_m_per_s, deflection_m (then the model's further
parameters); output is force_N, float, N x 1. Splits are evaluated in double; the force is rounded to float (6e-8).
It is the forest alone: before contact (deflection_m <= 0) and beyond the maximum crush of predict the force is yours to set,
and it keeps isolated points that predict takes out (docs/forest.md).")]
pub(super) struct Args {
    /// Predicted curve (JSON of crumple predict), model (of crumple train), curve database, or a measured
    /// or legacy curve's file (crumple db add --list)
    #[arg(required_unless_present = "list")]
    input: Option<PathBuf>,
    /// List the formats
    #[arg(long)]
    list: bool,
    /// File to write, or folder for several (default: standard output)
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    pub which: Which,
    #[command(flatten)]
    target: Target,
    /// Units of a measured or legacy curve's file if it does not state them
    #[arg(long, value_parser = UnitSystem::parse)]
    pub input_units: Option<UnitSystem>,
    #[command(flatten, next_help_heading = "Measured and legacy curves")]
    pub file: CurveFile,
}

/// Which curves of a model or database.
#[derive(clap::Args)]
pub(super) struct Which {
    /// Speeds of a model's curves, of a database's cases, or of a measured curve, with units; repeated or separated by commas
    #[arg(long, value_parser = speed_m_per_s, value_delimiter = ',', allow_hyphen_values = true)]
    pub speed: Vec<f64>,
    /// Mass of a model's body, or of each body of a pair (the first, if the two bodies of a run differ), with its unit (default: the training runs')
    #[arg(long, value_parser = mass_kg, allow_hyphen_values = true)]
    pub mass: Option<f64>,
    /// Rule for a model's maximum crush [default: the model's own]
    #[arg(long, value_parser = one_of(MAX_CRUSH_RULES))]
    pub max_crush: Option<MaxCrushRule>,
    /// Allow speeds outside a model's training speeds by more than a third of their range
    #[arg(long)]
    pub extrapolate: bool,
    /// Value of a model's further parameter, as NAME=VALUE; may be repeated
    #[arg(long, value_parser = arguments::parameter, value_name = "NAME=VALUE")]
    pub parameter: Vec<(String, Parameter)>,
    /// Group of a database (default: the only one)
    #[arg(long)]
    pub group: Option<String>,
    /// Case of the group, or GROUP/CASE (default: all); may be repeated
    #[arg(long)]
    pub case: Vec<String>,
}

/// The target's format and what it leaves open.
#[derive(clap::Args)]
pub(super) struct Target {
    /// Format or kind of file, if not given by the file's extension (crumple export --list)
    #[arg(long)]
    to: Option<String>,
    /// Units of the file, such as mm-t-s (default: lsdyna and radioss the study's, adams mm and N, others SI)
    #[arg(long, value_parser = UnitSystem::parse)]
    units: Option<UnitSystem>,
    /// Which force [default: body; JSON of a model's or a database's curve holds both]
    #[arg(long, value_parser = one_of(FORCES))]
    force: Option<ForceKind>,
    /// Number of the first curve in the target's deck [default: 101]
    #[arg(long, value_parser = clap::value_parser!(u32).range(i64::from(*IDS.start())..=i64::from(*IDS.end())))]
    curve_id: Option<u32>,
    /// How the curve continues beyond the maximum crush [default: bottom for multi-body tools]
    #[arg(long, value_parser = one_of(TAILS))]
    tail: Option<Tail>,
    /// Reduce rises steeper than the unloading stiffness, at equal energy
    #[arg(long)]
    soften: bool,
    /// Spring material of LS-DYNA [default: s08]
    #[arg(long, value_parser = one_of(MATERIALS))]
    material: Option<Material>,
    /// Write a complete input of one mass on the spring (lsdyna, radioss, calculix)
    #[arg(long)]
    deck: bool,
}

/// What a curve does beyond its maximum crush.
const TAILS: &[(&str, Tail, &str)] = &[
    ("none", Tail::None, "Nothing: the last point is the maximum crush"),
    (
        "hold",
        Tail::Hold,
        "Continues along faster runs, or at its last force or the mean of its last tenth, whichever is more",
    ),
    ("bottom", Tail::Bottom, "The same, and then rises with the unloading stiffness"),
];

/// Spring materials of LS-DYNA.
const MATERIALS: &[(&str, Material, &str)] = &[
    ("s08", Material::S08, "*MAT_SPRING_INELASTIC: unloads with KU, at least the steepest rise"),
    (
        "mat121",
        Material::Mat121,
        "Discrete beam of one degree of freedom: unloads with its own stiffness",
    ),
    ("s06", Material::S06, "*MAT_SPRING_GENERAL_NONLINEAR: unloads along a curve"),
];

impl Target {
    /// The format by `--to`, else by the extension of the file.
    pub(super) fn format(&self, path: Option<&Path>) -> Result<&'static Format, Failure> {
        let found = match (&self.to, path) {
            (Some(name), _) => formats::by_name(name),
            (None, Some(path)) => formats::by_extension(path),
            (None, None) => {
                return usage(format!(
                    "name the format with --to ({}) or by the extension of -o",
                    formats::names()
                ));
            }
        };
        found.map_err(|e: Error| usage_error(e))
    }

    /// The options for a file of `format` at `path`.
    fn options(&self, format: &Format, path: Option<&Path>) -> Options {
        let path = path.filter(|path| !path.is_dir());
        let own = path.and_then(Path::extension).and_then(|e| e.to_str());
        let by_name = || own.map(|own| format.kind(own).unwrap_or(own));
        let kind = self.to.as_deref().and_then(|to| format.kind(to)).or_else(by_name);
        Options {
            units: self.units,
            id: self.curve_id.unwrap_or(Options::default().id),
            force: self.force.unwrap_or(ForceKind::Body),
            tail: self.tail,
            soften: self.soften,
            material: self.material.unwrap_or_default(),
            deck: self.deck,
            extension: kind.map(Into::into),
            stem: path.and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned()),
            speeds_m_per_s: Vec::new(),
            query: Query::at(0.0),
        }
    }

    /// The files of curves for `path`, of the force that was requested or of the body's; of both where
    /// the format holds both and none was requested.
    pub(super) fn export(
        &self,
        format: &Format,
        curves: &[PredictedCurve],
        path: Option<&Path>,
    ) -> Result<Exported, Failure> {
        let alone;
        let mut curves = curves;
        if let (true, Some(force)) = (format.holds_both_forces(), self.force) {
            let one = |curve: &PredictedCurve| curve.of_force(force);
            alone = curves.iter().map(one).collect::<Result<Vec<_>, Error>>()?;
            curves = &alone;
        }
        format.export(curves, &self.options(format, path)).map_err(|error| {
            if self.force.is_none() && error.is_about("force") {
                usage_error("the curve has no force that drives a single-mass body (its runs record no velocities, or its file states a contact force without times): use --force contact to export the force on the obstacle")
            } else {
                error.into()
            }
        })
    }

    /// Refuses what none of the formats has a use for.
    pub(super) fn check(&self, formats: &[&Format]) -> Result<(), Failure> {
        let is_of_none = |takes: fn(&Format) -> bool| !formats.iter().any(|f| takes(f));
        for (option, is_asked, takes) in [
            ("--deck", self.deck, (|f| f.deck) as fn(&Format) -> bool),
            ("--material", self.material.is_some(), |f| f.materials),
            ("--curve-id", self.curve_id.is_some(), |f| f.ids),
            ("--tail", self.tail.is_some(), Format::takes_tail),
            ("--soften", self.soften, |f| f.takes_tail() && !f.takes_model()),
        ] {
            if is_asked && is_of_none(takes) {
                let those: Vec<&str> =
                    FORMATS.iter().filter(|f| takes(f)).map(|f| f.name).collect();
                return usage(format!("{option} is for {}", those.join(", ")));
            }
        }
        Ok(())
    }

    /// Refuses what a whole model has no use for.
    fn check_for_model(&self, format: &Format) -> Result<(), Failure> {
        let of_curves = self.units.is_some() || self.soften;
        let forced = self.force.is_some() && !format.over_speeds;
        if of_curves || forced {
            usage(format!(
                "{} holds a whole model in SI: remove --units and --soften{}",
                format.name,
                if forced { " and --force: it holds the recipe's force" } else { "" }
            ))
        } else {
            Ok(())
        }
    }
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let Some(path) = args.input.as_ref().filter(|_| !args.list) else {
        let listed = FORMATS.iter().map(|f| (f.name, f.extensions, f.description));
        return output::formats(listed, options);
    };
    let output = args.output.as_deref().filter(|path| !super::is_stdout(path));
    let format = args.target.format(output)?;
    if let Some(output) = output {
        keep_input(path, output)?;
    }
    args.target.check(&[format])?;
    let input = Input::read(path)?;
    let exported = export(args, format, &input, output)?;
    let outcome = options.warn_all(&exported.warnings);
    write(&exported, format, output, options)?;
    Ok(outcome)
}

/// The files, with the warnings of the curves.
fn export(
    args: &Args,
    format: &Format,
    input: &Input,
    output: Option<&Path>,
) -> Result<Exported, Failure> {
    input.check_said(args)?;
    if format.takes_model() {
        args.target.check_for_model(format)?;
        args.which.check_for_model(format.over_speeds)?;
        let model = input.model(format.name)?;
        let mut options = args.target.options(format, output);
        options.speeds_m_per_s.clone_from(&args.which.speed);
        options.query = args.which.query()?;
        return Ok(format.export_model(model, &options)?);
    }
    if format.takes_case() {
        let cases = input.cases(args, format.name)?;
        if let (Some(force), Some(case)) = (args.target.force, cases.first())
            && force != case.curves.force_kind
        {
            return usage(format!(
                "{} holds a case's histories, which are of the {} force: remove --force",
                format.name,
                case.curves.force_kind.name()
            ));
        }
        let mut exported = format.export_cases(&cases, &args.target.options(format, output))?;
        if let (Input::File(_), Some(case)) = (input, cases.into_iter().next()) {
            exported.notes.splice(0..0, case.quality.notes);
            exported.warnings = case.quality.warnings;
        }
        return Ok(exported);
    }
    export_curves(args, format, input, output)
}

/// The same for a format that is made of curves.
fn export_curves(
    args: &Args,
    format: &Format,
    input: &Input,
    output: Option<&Path>,
) -> Result<Exported, Failure> {
    let (mut curves, quality) = input.curves(args)?;
    let is_file = quality.is_some();
    let (mut notes, mut warnings) =
        quality.map_or_else(Default::default, |q| (q.notes, q.warnings));
    if let (Input::Curve(curve), true, None) =
        (input, format.holds_both_forces(), args.target.force)
    {
        // The file itself holds both.
        curves[0] = curve.of_force(ForceKind::Body)?;
        if curve.provenance.force_kind == ForceKind::Contact {
            notes.push("the body force alone is exported, which drives a single-mass body: --force contact exports the contact force, and the file itself has both".into());
        }
    }
    // Those of a file's case are its curve's, too.
    let of_curves = curves.iter().flat_map(|c| &c.warnings);
    let of_curves = of_curves.filter(|w| !(is_file && w.code == WarningCode::CaseWarning));
    for warning in of_curves.map(ToString::to_string) {
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }
    let mut exported = args.target.export(format, &curves, output)?;
    exported.notes.splice(0..0, notes);
    Ok(Exported { warnings, ..exported })
}

/// Writes the files to standard output if `output` is absent, and prints their notes.
pub(super) fn write(
    exported: &Exported,
    format: &Format,
    output: Option<&Path>,
    options: GlobalOptions,
) -> Result<(), Failure> {
    let (name, Exported { notes, warnings, .. }) = (format.name, exported);
    options.say_notes(notes);
    let Some(path) = output else {
        let [(_, bytes)] = &exported.files[..] else {
            let files = exported.files.len();
            return usage(format!("{name} gives {files} files: name a folder with -o"));
        };
        return match std::str::from_utf8(bytes) {
            Ok(text) if options.json => output::print_json(
                &document! { format: name, text: text, notes: notes, warnings: warnings },
            ),
            Err(_) if options.json => usage(format!("{name} is binary: name a file with -o")),
            _ => output::print_data(|out| out.write_all(bytes)),
        };
    };
    let files = paths(path, format, exported)?;
    // A table of a model is HDF5.
    let own = if name == "table" { FileKind::Database } else { FileKind::Curve };
    files.iter().try_for_each(|file| options.keep_others(file, own))?;
    if files != [path] {
        make_folders(&files)?;
    }
    write_all_whole(
        &files.iter().zip(&exported.files).map(|(p, f)| (&**p, &*f.1)).collect::<Vec<_>>(),
    )?;
    if name == "iso-mme" {
        warn_of_other_channels(&files, options);
    }
    let document = document! {
        format: name,
        bytes: exported.files.iter().map(|f| f.1.len()).sum::<usize>(),
        output: path.display().to_string(),
        files: files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>(),
        notes: notes,
        warnings: warnings,
    };
    options.show(&document, |out| {
        files.iter().try_for_each(|f| writeln!(out, "wrote {}", f.display()))
    })?;
    Ok(())
}

/// The paths of the files: the one that was named, or theirs within the folder.
fn paths(path: &Path, format: &Format, exported: &Exported) -> Result<Vec<PathBuf>, Failure> {
    if exported.files.len() == 1 && !path.is_dir() {
        return Ok(vec![path.into()]);
    }
    // A file's name for several; what is called .mme is a folder.
    let named = path.extension().and_then(|e| format.kind(e.to_str()?));
    if let (Some(extension), false, false) = (named, path.is_dir(), format.takes_case()) {
        return usage(format!(
            "-o {}: this export gives {} files: name a folder, as with -o {} --to {extension}",
            path.display(),
            exported.files.len(),
            path.with_extension("").display()
        ));
    }
    Ok(exported.files.iter().map(|(name, _)| path.join(name)).collect())
}

/// Files that an earlier record left beside the channels of ISO-MME that were written last.
pub(super) fn warn_of_other_channels(written: &[PathBuf], options: GlobalOptions) {
    let Some(folder) = written.last().and_then(|file| file.parent()) else { return };
    let found = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_channel = |path: &Path| {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        ending == "chn" || ending.len() == 3 && ending.bytes().all(|b| b.is_ascii_digit())
    };
    let others = found.map(|entry| entry.path());
    let others = others.filter(|path| is_channel(path) && !written.contains(path)).count();
    if others > 0 {
        options.warn(&format!(
            "{}: holds {} that {} not written now: remove what is of an earlier record, since some tools read all channels of a folder",
            folder.display(),
            counted(others, "file"),
            if others == 1 { "was" } else { "were" }
        ));
    }
}

/// The folders of files within the folder that was named.
fn make_folders(files: &[PathBuf]) -> Result<(), Error> {
    let folders = files.iter().filter_map(|f| f.parent());
    for folder in folders.filter(|f| !f.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(|e| not_written(folder, e))?;
    }
    Ok(())
}
