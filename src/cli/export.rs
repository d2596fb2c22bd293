//! `crumple export`: one curve or model as a file for another tool.

use std::path::{Path, PathBuf};

use crumple::curve::ForceKind;
use crumple::file::write_whole;
use crumple::formats::{self, ExportError, FORMATS, Format, Options};
use crumple::surrogate::predict::PredictError;
use crumple::surrogate::{Model, PredictedCurve};
use crumple::unit::UnitSystem;
use serde::Serialize;

use super::arguments::one_of;
use super::output;
use super::{CommandResult, Failure, GlobalOptions, Outcome, is_stdout, keep_input};

/// Write a predicted curve, or a forest model, for another tool
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple export lead50.json --to lsdyna --units mm-t-s -o lead50.k
  crumple export lead50.json --to csv
  crumple export lead50.json --to lsdyna --force contact -o lead50-wall.k
  crumple export ddtcm.model --to onnx -o ddtcm.onnx
  crumple export --list

ONNX: input is records, double, N x 2: speed_m_per_s, deflection_m (then the model's further
parameters); output is force_N, float, N x 1. Splits are decided in double; the force is rounded to float, by 6e-8 of its value.")]
pub struct Args {
    /// Predicted curve (JSON made by crumple predict); for onnx a model (made by crumple train)
    #[arg(required_unless_present = "list")]
    input: Option<PathBuf>,
    /// List the formats
    #[arg(long)]
    list: bool,
    /// File to write (default: standard output)
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    target: Target,
}

/// The target's format and what it leaves open.
#[derive(clap::Args)]
pub struct Target {
    /// Format, if not told by the file's extension (crumple export --list)
    #[arg(long)]
    to: Option<String>,
    /// Units of the file, such as mm-t-s (default: LS-DYNA the study's, csv SI)
    #[arg(long, value_parser = units)]
    units: Option<UnitSystem>,
    /// Which force [default: body; a JSON file of crumple predict holds both]
    #[arg(long, value_parser = one_of(FORCES))]
    force: Option<ForceKind>,
    /// Number of the curve in the target's deck
    #[arg(long, default_value_t = 101, value_parser = clap::value_parser!(u32).range(1..=99_999_999))]
    curve_id: u32,
}

/// Forces of a curve.
const FORCES: &[(&str, ForceKind, &str)] = &[
    ("body", ForceKind::Body, "The force that moves a body of one mass"),
    (
        "contact",
        ForceKind::Contact,
        "What the obstacle feels: for bodies whose crush zone is a mass of its own",
    ),
];

fn units(text: &str) -> Result<UnitSystem, String> {
    UnitSystem::parse(text).map_err(|e| e.to_string())
}

impl Target {
    /// The format by `--to`, else by the extension of the file.
    pub fn format(&self, path: Option<&Path>) -> Result<&'static Format, Failure> {
        let found = match (&self.to, path) {
            (Some(name), _) => formats::by_name(name),
            (None, Some(path)) => formats::by_extension(path),
            (None, None) => {
                let names: Vec<&str> = FORMATS.iter().map(|f| f.name).collect();
                return Err(Failure::Usage(format!(
                    "name the format with --to ({}) or by the extension of -o",
                    names.join(", ")
                )));
            }
        };
        found.map_err(|e: ExportError| Failure::Usage(e.to_string()))
    }

    /// The file's bytes of the force that was asked for, or of the body's.
    pub fn encode(&self, format: &Format, curve: &PredictedCurve) -> Result<Vec<u8>, Failure> {
        let options = Options { units: self.units, id: self.curve_id };
        let kind = self.force.unwrap_or(ForceKind::Body);
        let alone = curve.of_force(kind).map_err(|error| match (error, self.force) {
            (PredictError::NoBodyForce, None) => Failure::Usage(
                "the curve has no force that moves a body of one mass (its runs record no velocities): say --force contact to export the force that the obstacle feels".into(),
            ),
            (error, _) => error.into(),
        })?;
        Ok(format.encode(&alone, &options)?)
    }

    /// As [`encode`](Self::encode), but with both forces where the format holds them and none
    /// was asked for.
    pub fn encode_whole(
        &self,
        format: &Format,
        curve: &PredictedCurve,
    ) -> Result<Vec<u8>, Failure> {
        match format.holds_both_forces() && self.force.is_none() {
            true => Ok(format.encode(curve, &Options { units: self.units, id: self.curve_id })?),
            false => self.encode(format, curve),
        }
    }
}

#[derive(Serialize)]
struct List {
    formats: Vec<Listed>,
}

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    extensions: &'static [&'static str],
    description: &'static str,
}

/// A file that would go to standard output, within a JSON document.
#[derive(Serialize)]
struct Text {
    format: &'static str,
    text: String,
}

#[derive(Serialize)]
struct Document {
    format: &'static str,
    bytes: usize,
    output: String,
}

pub fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let Some(input) = args.input.as_ref().filter(|_| !args.list) else {
        return list(options);
    };
    let format = args.target.format(args.output.as_deref())?;
    let output = args.output.as_deref().filter(|path| !is_stdout(path));
    if let Some(output) = output {
        keep_input(input, output)?;
    }
    if format.takes_model() && (args.target.units.is_some() || args.target.force.is_some()) {
        return Err(Failure::Usage(format!(
            "{} holds a whole model in SI, of the recipe's force: remove --units and --force",
            format.name
        )));
    }
    let bytes = match format.takes_model() {
        true => format.encode_model(&Model::read(input)?)?,
        false => args.target.encode(format, &formats::read::json::predicted(input)?)?,
    };
    match output {
        None if options.json && format.takes_model() => {
            return Err(Failure::Usage(format!("{} is binary: name a file with -o", format.name)));
        }
        None if options.json => {
            let text = String::from_utf8_lossy(&bytes).into_owned();
            output::print_json(&Text { format: format.name, text })?;
        }
        None => output::print_data(|out| out.write_all(&bytes))?,
        Some(path) => {
            write_whole(path, &bytes)?;
            if options.json {
                output::print_json(&Document {
                    format: format.name,
                    bytes: bytes.len(),
                    output: path.display().to_string(),
                })?;
            } else {
                output::print(|out| writeln!(out, "wrote {}", path.display()))?;
            }
        }
    }
    Ok(Outcome::Clean)
}

fn list(options: GlobalOptions) -> CommandResult {
    if options.json {
        let listed = |f: &Format| Listed {
            name: f.name,
            extensions: f.extensions,
            description: f.description,
        };
        output::print_json(&List { formats: FORMATS.iter().map(listed).collect() })?;
    } else {
        output::print(|out| {
            FORMATS.iter().try_for_each(|f| {
                writeln!(out, "{:<8} .{:<14} {}", f.name, f.extensions.join(" ."), f.description)
            })
        })?;
    }
    Ok(Outcome::Clean)
}
