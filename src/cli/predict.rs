//! `crumple predict`: the curve at a new speed.

use crate::words::counted;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::curve::{ForceKind, Parameter};
use crate::file::write_all_whole;
use crate::surrogate::band::{Band, LeftOutSpeeds};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::{Model, PredictedCurve, Query, SpeedOfCrush, predict, speed_of_crush};
use crate::unit::{Shown, km_per_h, length_m, mass_kg, speed_m_per_s};

use super::arguments::{self, FileKind, MAX_CRUSH_RULES, one_of};
use super::{CommandResult, GlobalOptions, is_stdout, keep_input, output, usage};

/// Predict the force-deflection curve at a speed, with energy audit and warnings
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple predict lead.model --speed 50km/h
  crumple predict lead.model --speed 50km/h -o lead50.json -o lead50.csv -o lead50.k
  crumple predict lead.model --crush 620mm      # the speed that gives this crush, and its curve
  crumple predict lead.model --speed 14m/s --max-crush energy --json")]
pub(super) struct Args {
    /// Model file made by crumple train
    model: PathBuf,
    /// Impact speed with its unit, of the kind the model was trained on
    #[arg(long, value_parser = speed_m_per_s, allow_hyphen_values = true, required_unless_present = "crush")]
    speed: Option<f64>,
    /// Maximum crush with its unit, in place of the speed: the speed between the runs that gives it is found
    #[arg(long, value_parser = length_m, allow_hyphen_values = true, conflicts_with_all = ["speed", "extrapolate"])]
    crush: Option<f64>,
    /// Mass of the body, or of each body of a pair (the first, if the two bodies of a run differ), with its unit (default: the training runs')
    #[arg(long, value_parser = mass_kg, allow_hyphen_values = true)]
    mass: Option<f64>,
    /// Rule for the maximum crush [default: the model's own, mostly motion]
    #[arg(long, value_parser = one_of(MAX_CRUSH_RULES))]
    max_crush: Option<MaxCrushRule>,
    /// The reference method's choices: maximum crush by the cubic spline
    #[arg(long, conflicts_with = "max_crush")]
    paper: bool,
    /// Value of a further parameter of the training cases, as NAME=VALUE; may be repeated
    #[arg(long, value_parser = arguments::parameter, value_name = "NAME=VALUE")]
    parameter: Vec<(String, Parameter)>,
    /// Scale the forces so that the one that moves the body absorbs the impact's kinetic energy (by 0.8 to 1.25)
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
    options.on_stdout(&args.output)?;
    args.output.iter().try_for_each(|output| keep_input(&args.model, output))?;
    args.output.iter().try_for_each(|output| options.keep_others(output, FileKind::Curve))?;
    let model = Model::read(&args.model)?;
    let query = Query {
        speed_m_per_s: args.speed.unwrap_or_else(|| model.range_m_per_s().0),
        mass_kg: args.mass,
        rule,
        parameters: arguments::parameters(&args.parameter)?,
        energy_correct: args.energy_correct,
        extrapolate: args.extrapolate,
    };
    let found = args.crush.map(|crush_m| speed_of_crush(&model, &query, crush_m)).transpose()?;
    let query = match &found {
        Some(found) => Query { speed_m_per_s: found.speed_m_per_s, ..query },
        None => query,
    };
    let curve = &predict(&model, &query)?;
    // All are encoded before the first is written.
    let mut files: Vec<(&Path, Vec<u8>)> = Vec::new();
    let mut exports = Vec::new();
    for (path, format) in args.output.iter().zip(&formats) {
        let (exported, name) =
            (args.target.export(format, std::slice::from_ref(curve), Some(path))?, format.name);
        let shown = path.display();
        let Ok([(_, bytes)]) = <[_; 1]>::try_from(exported.files) else {
            return usage(format!(
                "-o {shown}: this gives several files: crumple export --to {name} -o FOLDER"
            ));
        };
        options.say_notes(&exported.notes);
        files.push((path, bytes));
        exports.push(document! { output: shown.to_string(), format: name, notes: exported.notes });
    }
    let named = files.iter().map(|(path, bytes)| (*path, &**bytes));
    let (printed, written): (Vec<_>, Vec<_>) = named.partition(|(path, _)| is_stdout(path));
    write_all_whole(&written)?;
    let outcome = options.warn_all(&curve.warnings);
    if let Some((_, bytes)) = printed.first() {
        output::print(|out| out.write_all(bytes))?;
        return Ok(outcome);
    }
    options.show(
        &document! { #[serde(flatten)] curve: curve, found_by_crush if_any: found, exports if_any: &exports },
        |out| {
            if let Some(found) = &found {
                print_found(out, found)?;
            }
            print(out, curve)?;
            args.output.iter().try_for_each(|path| writeln!(out, "wrote {}", path.display()))
        },
    )?;
    Ok(outcome)
}

/// The speed of a crush, and how far it may be off.
fn print_found(out: &mut dyn Write, found: &SpeedOfCrush) -> io::Result<()> {
    // As the message of a crush that no speed gives.
    let crush_m = (found.crush_m * 1e4).round() / 1e4;
    write!(out, "crush of {crush_m} m: {}", km_per_h(found.speed_m_per_s))?;
    if let Some(error) = found.crush_error {
        let end = |speed: Option<f64>| speed.map_or("beyond the runs".into(), km_per_h);
        let (low, high) = (end(found.low_m_per_s), end(found.high_m_per_s));
        let error = 100.0 * error;
        write!(
            out,
            " ({low} to {high}: crush is off by {error:.1} % on average at left-out speeds)"
        )?;
    }
    writeln!(out)
}

/// Where a band's curve lies, and what the band comes from.
fn rests_on(band: &Band, in_range: bool) -> String {
    let place = if in_range { "between training speeds" } else { "outside the training speeds" };
    let (one, how) = match band.left_out {
        LeftOutSpeeds::Inner if !in_range => {
            ("curve", "left out in turn, as wide as at the nearest training speed")
        }
        LeftOutSpeeds::Inner => {
            ("curve", "left out in turn, scaled to the interval between the neighbouring speeds")
        }
        LeftOutSpeeds::Ends => ("end", "left out in turn, growing with the distance"),
    };
    format!("{place}, from {} {how}", counted(band.curves, one))
}

/// The lines about a curve: name and text of each.
fn lines(curve: &PredictedCurve) -> Vec<(&'static str, String)> {
    let provenance = &curve.provenance;
    let crush = provenance.max_crush;
    let metres = |d: Option<f64>| d.map_or("-".into(), |d| format!("{d:.4} m"));
    let percent = |share: f64| format!("{:.1} %", share * 100.0);
    let energy = Shown::energy(provenance.kinetic_energy_j);
    let peak = curve.peak_force_n();
    let kind = provenance.force_kind.name();
    let mut lines = vec![
        ("peak force", format!("{} ({kind})", Shown::one_force(peak))),
        (
            "max crush",
            format!(
                "{:.4} m ({}); spline {}, monotone {}, energy {}, motion {}",
                curve.max_deflection_m,
                provenance.max_crush_rule.map_or("recorded", |rule| rule.name()),
                metres(crush.spline_m),
                metres(crush.monotone_m),
                metres(crush.energy_m),
                metres(crush.motion_m)
            ),
        ),
        (
            "energy",
            format!(
                "{}, {} of the impact's {}",
                energy.text(curve.energy_j),
                percent(provenance.energy_over_kinetic),
                energy.text(provenance.kinetic_energy_j)
            ),
        ),
    ];
    let of_body = provenance.body_energy_over_kinetic;
    lines.extend(of_body.map(|share| ("energy of body force", percent(share))));
    for (kind, stiffness) in [
        (provenance.force_kind, Some(curve.unloading_stiffness_n_per_m)),
        (ForceKind::Body, curve.body_unloading_stiffness_n_per_m),
    ] {
        let Some(stiffness) = stiffness else { continue };
        let (shown, name) = (Shown::one_stiffness(stiffness), kind.name());
        let drives = kind.drives();
        lines.push(("unloading", format!("{shown} of the {name} force, which drives {drives}")));
    }
    lines.extend(curve.rebound.map(|rebound| {
        let error = rebound.left_out_error.map(percent);
        let error = error.map(|e| format!(", off by {e} on average at the left-out speeds"));
        ("rebound", km_per_h(rebound.speed_m_per_s) + &error.unwrap_or_default())
    }));
    for (force, band) in provenance.bands() {
        let (share, level) = (percent(band.pointwise_share), band.level * 100.0);
        let (force, rests_on) = (force.name(), rests_on(&band, provenance.in_range));
        lines.push((
            "band",
            format!(
                "±{share} of the local {force} force: empirical range for {level:.0} % {rests_on}"
            ),
        ));
        lines.extend(band.scatter.map(|scatter| {
            let interpolation = percent(band.interpolation_share());
            let scatter = percent(scatter.pointwise_share);
            (
                "of this",
                format!("interpolation ±{interpolation}, scatter between repeated runs ±{scatter}"),
            )
        }));
    }
    if provenance.band.is_some() && provenance.body_band.is_none() && curve.body_force_n.is_some() {
        lines.push(("band of body force", "unknown until the model is trained again".into()));
    }
    let away = km_per_h(provenance.distance_to_nearest_m_per_s);
    lines.push(("nearest training", format!("{away} away")));
    lines.extend(curve.warnings.iter().map(|warning| ("warning", warning.to_string())));
    lines
}

fn print(out: &mut dyn Write, curve: &PredictedCurve) -> io::Result<()> {
    let (speed, kind) = (km_per_h(curve.speed_m_per_s), curve.speed_kind.name());
    writeln!(out, "{} at {speed} ({kind}) by {}", curve.provenance.group, curve.model)?;
    for (name, line) in lines(curve) {
        writeln!(out, "  {name:<20} {line}")?;
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
