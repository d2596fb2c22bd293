//! `crumple predict`: the curve at a new speed.

use crate::plural::counted;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::curve::{ForceKind, Parameter};
use crate::file::write_all_whole;
use crate::formats::{Exported, Format};
use crate::surrogate::band::{Band, LeftOutSpeeds};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::{Model, PredictedCurve, Query, predict};
use crate::unit::{Shown, km_per_h};
use serde::Serialize;

use super::arguments::{self, MAX_CRUSH_RULES, one_of};
use super::file_kind::FileKind;
use super::output;
use super::{CommandResult, Failure, GlobalOptions, Outcome, is_stdout, keep_input};

/// Predict the force-deflection curve at a speed, with energy audit and warnings
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple predict lead.model --speed 50km/h
  crumple predict lead.model --speed 50km/h -o lead50.json -o lead50.csv -o lead50.k
  crumple predict lead.model --speed 14m/s --max-crush energy --json")]
pub(super) struct Args {
    /// Model file made by crumple train
    model: PathBuf,
    /// Impact speed with its unit, of the kind the model was trained on
    #[arg(long, value_parser = arguments::speed, allow_hyphen_values = true)]
    speed: f64,
    /// Mass of the body, or of each body of a pair, with its unit (default: the training runs')
    #[arg(long, value_parser = arguments::mass, allow_hyphen_values = true)]
    mass: Option<f64>,
    /// Rule for the maximum crush [default: the best one when speeds were left out]
    #[arg(long, value_parser = one_of(MAX_CRUSH_RULES))]
    max_crush: Option<MaxCrushRule>,
    /// The reference method's choices: maximum crush by the cubic spline
    #[arg(long, conflicts_with = "max_crush")]
    paper: bool,
    /// Value of a further parameter of the training cases, as NAME=VALUE; may be repeated
    #[arg(long, value_parser = arguments::parameter, value_name = "NAME=VALUE")]
    parameter: Vec<(String, Parameter)>,
    /// Scale the force so that the curve absorbs the impact's kinetic energy (by 0.8 to 1.25)
    #[arg(long)]
    energy_correct: bool,
    /// Allow speeds outside the training speeds by more than a third of their range
    #[arg(long)]
    extrapolate: bool,
    /// File to write, in the format of its extension or of --to; may be repeated
    #[arg(short, long)]
    output: Vec<PathBuf>,
    #[command(flatten)]
    target: super::export::Target,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let rule = if args.paper { Some(MaxCrushRule::Spline) } else { args.max_crush };
    let formats = args
        .output
        .iter()
        .map(|path| args.target.format(Some(path.as_path()).filter(|path| !is_stdout(path))))
        .collect::<Result<Vec<_>, _>>()?;
    args.target.check(&formats)?;
    let to_stdout = args.output.iter().filter(|path| is_stdout(path)).count();
    if to_stdout > 1 || to_stdout == 1 && options.json {
        return Err(Failure::Usage(
            "standard output can take only one of them: one \"-o -\", or --json".into(),
        ));
    }
    args.output.iter().try_for_each(|output| keep_input(&args.model, output))?;
    args.output.iter().try_for_each(|output| options.keep_others(output, FileKind::Curve))?;
    let model = Model::read(&args.model)?;
    let query = Query {
        speed_m_per_s: args.speed,
        mass_kg: args.mass,
        rule,
        parameters: args.parameter.iter().cloned().collect(),
        energy_correct: args.energy_correct,
        extrapolate: args.extrapolate,
    };
    let curve = &predict(&model, &query)?;
    let files = files(args, &formats, curve, options)?;
    let named = files.iter().map(|file| (file.path, &*file.bytes));
    let (printed, written): (Vec<_>, Vec<_>) = named.partition(|(path, _)| is_stdout(path));
    write_all_whole(&written)?;
    for warning in &curve.warnings {
        options.warn(&warning.to_string());
    }
    if let Some((_, bytes)) = printed.first() {
        output::print(|out| out.write_all(bytes))?;
    } else if options.json {
        let exports = files.iter().map(|file| Export {
            output: file.path.display().to_string(),
            format: file.format,
            notes: &file.notes,
        });
        output::print_json(&Document { curve, exports: exports.collect() })?;
    } else {
        options.print(|out| {
            print(out, curve)?;
            args.output.iter().try_for_each(|path| writeln!(out, "wrote {}", path.display()))
        })?;
    }
    Ok(if curve.warnings.is_empty() { Outcome::Clean } else { Outcome::Warned })
}

/// The curve, and notes on its files.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    curve: &'a PredictedCurve,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    exports: Vec<Export<'a>>,
}

#[derive(Serialize)]
struct Export<'a> {
    output: String,
    format: &'static str,
    notes: &'a [String],
}

/// An output that is to be written.
struct File<'a> {
    path: &'a Path,
    format: &'static str,
    bytes: Vec<u8>,
    notes: Vec<String>,
}

/// Every output: all are encoded before the first is written.
fn files<'a>(
    args: &'a Args,
    formats: &[&Format],
    curve: &PredictedCurve,
    options: GlobalOptions,
) -> Result<Vec<File<'a>>, Failure> {
    let mut files = Vec::new();
    for (path, format) in args.output.iter().zip(formats) {
        let Exported { files: mut exported, notes, .. } =
            args.target.export(format, std::slice::from_ref(curve), Some(path))?;
        match (exported.pop(), exported.is_empty()) {
            (Some((_, bytes)), true) => {
                if !options.quiet && !options.json {
                    notes.iter().for_each(|note| output::say(&format!("note: {note}")));
                }
                files.push(File { path, format: format.name, bytes, notes });
            }
            _ => {
                return Err(Failure::Usage(format!(
                    "-o {}: this gives several files: crumple export --to {} -o FOLDER",
                    path.display(),
                    format.name
                )));
            }
        }
    }
    Ok(files)
}

/// Where a band's curve lies, and what the band comes from.
fn rests_on(band: &Band, in_range: bool) -> String {
    let place = if in_range { "between training speeds" } else { "outside the training speeds" };
    let (one, how) = match band.left_out {
        LeftOutSpeeds::Inner => {
            ("curve", "left out in turn, scaled to the interval between the neighbouring speeds")
        }
        LeftOutSpeeds::Ends => ("end", "of the range left out, growing with the distance"),
    };
    format!("{place}, from {} {how}", counted(band.curves, one))
}

/// The unloading stiffness of each force, and the rebound.
fn print_unloading(out: &mut dyn Write, curve: &PredictedCurve) -> io::Result<()> {
    let unloading = |out: &mut dyn Write, kind: ForceKind, stiffness: f64| {
        writeln!(
            out,
            "  unloading            {} of the {} force, which drives {}",
            Shown::stiffness(stiffness).text(stiffness),
            kind.name(),
            kind.drives()
        )
    };
    unloading(out, curve.provenance.force_kind, curve.unloading_stiffness_n_per_m)?;
    if let Some(stiffness) = curve.body_unloading_stiffness_n_per_m {
        unloading(out, ForceKind::Body, stiffness)?;
    }
    if let Some(rebound) = curve.rebound {
        writeln!(out, "  rebound              {}", km_per_h(rebound.speed_m_per_s))?;
    }
    Ok(())
}

/// How far FE may lie from each force of the curve, and what of it lies between repeated runs.
fn print_bands(out: &mut dyn Write, curve: &PredictedCurve) -> io::Result<()> {
    for (force, band) in curve.provenance.bands() {
        writeln!(
            out,
            "  band                 ±{:.1} % of the local {} force: empirical range for {:.0} % {}",
            band.pointwise_share * 100.0,
            force.name(),
            band.level * 100.0,
            rests_on(&band, curve.provenance.in_range)
        )?;
        let Some(scatter) = band.scatter else { continue };
        writeln!(
            out,
            "  of this              interpolation ±{:.1} %, scatter between repeated runs ±{:.1} %",
            band.interpolation_share() * 100.0,
            scatter.pointwise_share * 100.0
        )?;
    }
    let provenance = &curve.provenance;
    if provenance.band.is_some() && provenance.body_band.is_none() && curve.body_force_n.is_some() {
        writeln!(out, "  band of body force   unknown until the model is trained again")?;
    }
    Ok(())
}

fn print(out: &mut dyn Write, curve: &PredictedCurve) -> io::Result<()> {
    let provenance = &curve.provenance;
    let crush = provenance.max_crush;
    let metres = |d: Option<f64>| d.map_or("-".into(), |d| format!("{d:.4} m"));
    let speed = km_per_h(curve.speed_m_per_s);
    writeln!(
        out,
        "{} at {speed} ({}) by {}",
        provenance.group,
        curve.speed_kind.name(),
        curve.model
    )?;
    let energy = Shown::energy(provenance.kinetic_energy_j);
    let peak = curve.force_n.iter().copied().fold(0.0, f64::max);
    let kind = provenance.force_kind.name();
    writeln!(out, "  peak force           {} ({kind})", Shown::force(peak).text(peak))?;
    writeln!(
        out,
        "  max crush            {:.4} m ({}); spline {}, monotone {}, energy {}, motion {}",
        curve.max_deflection_m,
        provenance.max_crush_rule.map_or("recorded", |rule| rule.name()),
        metres(crush.spline_m),
        metres(crush.monotone_m),
        metres(crush.energy_m),
        metres(crush.motion_m)
    )?;
    writeln!(
        out,
        "  energy               {}, {:.1} % of the impact's {}",
        energy.text(curve.energy_j),
        provenance.energy_over_kinetic * 100.0,
        energy.text(provenance.kinetic_energy_j)
    )?;
    if let Some(share) = provenance.body_energy_over_kinetic {
        writeln!(out, "  energy of body force {:.1} %", share * 100.0)?;
    }
    print_unloading(out, curve)?;
    print_bands(out, curve)?;
    writeln!(
        out,
        "  nearest training     {} away",
        km_per_h(provenance.distance_to_nearest_m_per_s)
    )?;
    for warning in &curve.warnings {
        writeln!(out, "  warning              {warning}")?;
    }
    writeln!(out, "\nforce over deflection")?;
    draw_curve(out, &curve.deflection_m, &curve.force_n)
}

/// Characters across, at most, and down.
const SIZE: (usize, usize) = (70, 13);
/// Fewer characters show no curve.
const LEAST: usize = 20;
/// Bits of a Braille character's dots, by row and column.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// Draws force in N over deflection in m, which increases; the force axis includes 0.
pub(super) fn draw_curve(
    out: &mut dyn Write,
    deflection_m: &[f64],
    force_n: &[f64],
) -> io::Result<()> {
    let end_m = deflection_m.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let low = force_n.iter().copied().fold(0.0, f64::min);
    let high = force_n.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let labels = [high, low].map(|force| format!(" {}", Shown::force(high.max(-low)).text(force)));
    let beside = labels.iter().map(String::len).max().unwrap_or(0);
    let room = output::width().map_or(SIZE.0, |width| width.saturating_sub(beside));
    let across = room.clamp(LEAST, SIZE.0);
    let (width, height) = (2 * across, 4 * SIZE.1);
    // Row of dots from the top.
    let row = |force: f64| ((high - force) / (high - low) * (height - 1) as f64).round() as usize;
    let column = |d: f64| (d / end_m * (width - 1) as f64).round().max(0.0) as usize;
    let mut cells = vec![vec![0_u32; across]; SIZE.1];
    let mut dot = |x: usize, y: usize| cells[y / 4][x / 2] |= DOTS[y % 4][x % 2];
    let points: Vec<(usize, usize)> =
        deflection_m.iter().zip(force_n).map(|(&d, &f)| (column(d), row(f))).collect();
    for pair in points.windows(2) {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        let steps = x0.abs_diff(x1).max(y0.abs_diff(y1)).max(1);
        let between = |a: usize, b: usize, k: usize| {
            (a as f64 + (b as f64 - a as f64) * k as f64 / steps as f64).round() as usize
        };
        (0..=steps).for_each(|k| dot(between(x0, x1, k), between(y0, y1, k)));
    }
    for (i, line) in cells.iter().enumerate() {
        let label = match i {
            0 => labels[0].as_str(),
            i if i + 1 == SIZE.1 => &labels[1],
            _ => "",
        };
        let braille = line.iter().filter_map(|&bits| char::from_u32(0x2800 + bits));
        writeln!(out, "{}{label}", braille.collect::<String>())?;
    }
    writeln!(out, "0 m{:>1$}", format!("{end_m:.3} m"), across - 3)
}
