//! The findings in words: each value of a proposal with its source.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::UserHints;
use super::agree::{Agreed, names_centre_of_gravity, percent};
use super::explain::FOLLOWS;
use super::folders::{Reason, speed_in};
use super::measure::{self, MassEstimates, Measured, SAME_SPEED, SiRun, is_near};
use super::proposal::{Evidence, Proposal, Proposed, ProposedRun};
use super::record::Recorded;
use super::sources::MOTION;
use super::units::digits;
use crate::curve::recipe::{DeflectionSource, Filter, ForceSource, RecordedMotion};
use crate::signal::cfc;
use crate::study::StudyKind;
use crate::study::files::shown_name;
use crate::unit::{SPEED, UnitSystem, km_per_h};

/// Bodies whose speed lies along an axis by less than this share move obliquely.
const ALONG: f64 = 0.99;

/// How a path is written in the study.
pub(super) type Seen<'a> = &'a dyn Fn(&PathBuf) -> Option<String>;

/// The proposal for runs that were measured; `group`: name of the folder above them.
pub(super) fn proposal(
    measured: &Measured<'_>,
    given: &UserHints,
    group: String,
    seen: Seen<'_>,
    warnings: &mut Vec<String>,
) -> Proposal {
    let agreed = measured.agreed;
    let group = match &given.group {
        Some(name) => Proposed::found(name.clone(), Evidence::UserHints("by --group".into())),
        None => {
            let from = "name of the folder above the runs".into();
            Proposed::found(group, Evidence::Guessed(from))
        }
    };
    let (filter, truncated) = filter(measured);
    let runs = runs(measured, given, &truncated, seen, warnings);
    let times: Vec<measure::Times> = measured.runs.iter().map(|run| run.times).collect();
    let no_units = || Proposed::missing("the times are unknown without units");
    doubts(measured, warnings);
    Proposal {
        group,
        units: measured.units.clone(),
        kind: kind(measured, given),
        half_model: given.half_model,
        deflection: deflection(measured, given),
        node_titles: agreed.nodes.iter().map(|node| node.title.clone()).collect(),
        other_nodes: agreed.nodes.iter().map(|node| node.others.clone()).collect(),
        force: force(measured, given),
        force_title: agreed.force.as_ref().and_then(|force| force.title.clone()),
        other_side: agreed.force.as_ref().is_some_and(|force| force.other_side),
        other_forces: agreed.force.as_ref().map_or(Vec::new(), |force| force.others.clone()),
        filter,
        sampling: measure::sampling(&times).unwrap_or_else(no_units),
        runs,
        left_out: Vec::new(),
        notes: notes(measured),
        warnings: Vec::new(),
    }
}

fn kind(measured: &Measured<'_>, given: &UserHints) -> Proposed<StudyKind> {
    let Agreed { kind, force, .. } = measured.agreed;
    if given.half_model {
        let from = "by --half-model: the other body is this one's mirror image".into();
        return Proposed::found(StudyKind::Pair, Evidence::UserHints(from));
    }
    if given.kind.is_some() {
        return Proposed::found(*kind, Evidence::UserHints("by --kind".into()));
    }
    if given.minus_node.is_some() {
        return Proposed::found(*kind, Evidence::UserHints("by --minus-node".into()));
    }
    let evidence = match (kind, force) {
        (StudyKind::Pair, Some(force)) => Evidence::Computed(format!(
            "two bodies move, and {} {} drives them apart",
            force.file, force.id
        )),
        (StudyKind::Pair, None) => Evidence::Guessed(format!(
            "two bodies move, and their changes of momentum balance within {} %; no force shows whether they meet",
            percent(measured.agreed.opposed.unwrap_or(1.0))
        )),
        (StudyKind::Wall, None) if measured.agreed.bodies > 1 => Evidence::Guessed(
            "several bodies move, no force shows which of them meet, and no two changes of momentum balance: the fastest is taken, as if it hit a wall".into(),
        ),
        (StudyKind::Wall, Some(force)) if force.file == "rwforc" => Evidence::Guessed(
            "one body moves, and a rigid wall stops it (which may be the symmetry plane of a pair: see half_model)".into(),
        ),
        (StudyKind::Wall, _) => Evidence::Guessed(
            "one body moves in the files: if what it meets moves too, write one of its nodes to nodout".into(),
        ),
    };
    Proposed::found(*kind, evidence)
}

fn deflection(measured: &Measured<'_>, given: &UserHints) -> Proposed<DeflectionSource> {
    let agreed = measured.agreed;
    let Some(node) = agreed.nodes.first() else {
        return Proposed::missing("no node of the runs moves with the body: name one with --node");
    };
    let source = DeflectionSource {
        file: MOTION.into(),
        node: node.id,
        minus_node: agreed.nodes.get(1).map(|other| other.id),
        component: agreed.direction,
    };
    if given.node.is_some() {
        return Proposed::found(source, Evidence::UserHints("by --node".into()));
    }
    let mut because = vec![format!("the bodies start along {}", agreed.direction.axis())];
    let runs = measured.recorded.len();
    let of_runs = match runs {
        1 => "the run".into(),
        2 => "both runs".into(),
        _ => format!("all {runs} runs"),
    };
    if agreed.force.is_some() {
        because.push(format!(
            "change of velocity and impulse of the force agree within {} % in {of_runs}",
            percent(agreed.residual)
        ));
    }
    if agreed.nodes.iter().all(|node| names_centre_of_gravity(node.title.as_deref())) {
        because.push("the title says centre of gravity".into());
    }
    let is_only = agreed.nodes.iter().all(|node| node.others.is_empty()) && agreed.force.is_some();
    let from = because.join("; ");
    let evidence = if is_only { Evidence::Computed(from) } else { Evidence::Guessed(from) };
    Proposed::found(source, evidence)
}

fn force(measured: &Measured<'_>, given: &UserHints) -> Proposed<ForceSource> {
    let agreed = measured.agreed;
    let Some(force) = &agreed.force else {
        let Some(node) = agreed.nodes.first() else {
            return Proposed::missing(
                "no force of the runs acts on the bodies: name one with --force",
            );
        };
        let component = agreed.direction.velocity();
        let source = ForceSource::Body {
            file: MOTION.into(),
            node: node.id,
            motion: RecordedMotion::Velocity,
            component: component.into(),
        };
        let from = "no wall, contact or section of the runs moves the body, so its mass times its acceleration is taken as the force".into();
        return Proposed::found(source, Evidence::Guessed(from));
    };
    let named = given.force.as_ref();
    let source = ForceSource::Contact {
        file: force.file.into(),
        id: force.id,
        side: named.and_then(|named| named.side).or(force.side),
        component: named.and_then(|n| n.component.clone()).unwrap_or(force.component.clone()),
    };
    if named.is_some() {
        return Proposed::found(source, Evidence::UserHints("by --force".into()));
    }
    let evidence = if force.others.is_empty() {
        Evidence::Computed("the only force along the motion, and the bodies follow it".into())
    } else {
        Evidence::Guessed(
        "of the forces that the bodies follow, the one with the largest impulse along the motion".into(),
    )
    };
    Proposed::found(source, evidence)
}

/// The filter, and for each run a state that has to be cut for it: a solver's last state often
/// comes right after the one before.
fn filter(measured: &Measured<'_>) -> (Proposed<Filter>, Vec<Option<f64>>) {
    let runs = measured.runs;
    let none = vec![None; runs.len()];
    let means = measured.agreed.force.as_ref().and_then(|force| {
        let source = measured.recorded.first()?.run.sources.force(force.file)?;
        source.means.clone()
    });
    let coarsest = runs.iter().map(|run| run.times.interval_s).fold(0.0, f64::max);
    let proposed = measure::filter(means.as_deref(), coarsest);
    let Some(Filter::Cfc(class)) = proposed.value() else { return (proposed, none) };
    let fits = |time: &[f64], force: &[f64]| cfc::filter(*class, time, force).map(|_| ());
    let mut cut = none.clone();
    for (run, cut) in runs.iter().zip(&mut cut) {
        let Some((time, force)) = &run.force else { continue };
        let Err(error) = fits(time, force) else { continue };
        let last = time.len() - 1;
        if fits(&time[..last], &force[..last]).is_ok() {
            *cut = Some(0.5 * (time[last - 1] + time[last]));
            continue;
        }
        let from = format!("run {}: {error}", run.recorded.run.name);
        return (Proposed::found(Filter::None, Evidence::Computed(from)), none);
    }
    (proposed, cut)
}

/// What the user should check.
fn doubts(measured: &Measured<'_>, warnings: &mut Vec<String>) {
    let agreed = measured.agreed;
    if agreed.force.is_some() && agreed.residual > FOLLOWS {
        warnings.push(format!(
            "no node's velocity follows the impulse of a force closely (residual {} %): several bodies in a row, or a force on part of the body? Check node and force",
            percent(agreed.residual)
        ));
    }
    if agreed.force.as_ref().is_some_and(|force| force.file == "secforc") {
        warnings.push(
            "the force is that of a section, which may carry only part of what stops the body"
                .into(),
        );
    }
    let oblique = measured.recorded.iter().find(|run| run.run.survey.aligned < ALONG);
    if let Some(run) = oblique {
        warnings.push(format!(
            "run {}: only {:.0} % of the initial speed lie along {}: deflection and speed of a recipe are along an axis",
            run.run.name,
            run.run.survey.aligned * 100.0,
            agreed.direction.axis()
        ));
    }
    for run in measured.recorded {
        warnings.extend(run.run.sources.unread.iter().map(|why| format!("not read: {why}")));
        warnings.extend(run.record.damage.iter().map(|d| format!("run {}: {d}", run.run.name)));
    }
}

/// What was chosen on the way: of several files with the same histories, one.
fn notes(measured: &Measured<'_>) -> Vec<String> {
    let mut chosen: BTreeMap<String, usize> = BTreeMap::new();
    for recorded in measured.recorded {
        let sources = &recorded.run.sources;
        let used = measured.agreed.force.as_ref().and_then(|force| sources.force(force.file));
        for source in [Some(&sources.motion), used].into_iter().flatten() {
            if !source.others.is_empty() {
                let note = format!(
                    "{} is read, {} holds it too",
                    source.shown(),
                    source.others.join(" and ")
                );
                *chosen.entry(note).or_default() += 1;
            }
        }
    }
    let all = measured.recorded.len();
    let of_runs = |runs: usize| match runs {
        runs if runs == all => String::new(),
        1 => " (in 1 run)".into(),
        runs => format!(" (in {runs} runs)"),
    };
    chosen.into_iter().map(|(note, runs)| format!("{note}{}", of_runs(runs))).collect()
}

/// The units that the runs' decks state, with the place; warns where they contradict each other.
pub(super) fn stated_units(
    runs: &[Recorded],
    warnings: &mut Vec<String>,
) -> Option<(UnitSystem, String)> {
    let mut stated = runs.iter().filter_map(|run| {
        let (path, deck) = run.run.sources.deck.as_ref()?;
        let units = deck.units.as_ref()?;
        let is_own = path.parent() == Some(&run.run.path);
        let above = if is_own { "" } else { " above the runs" };
        let place = format!("the deck {}{above}, line {}", shown_name(path), units.at.line);
        Some((units.system?, format!("{place}: \"{}\"", units.text.trim())))
    });
    let first = stated.next()?;
    if let Some(other) = stated.find(|(system, _)| *system != first.0) {
        warnings.push(format!("units: {} and {} differ", first.1, other.1));
        return None;
    }
    Some(first)
}

/// Commented entries of the runs that are left out, so that the user can take them all the same.
pub(super) fn entries_of_left_out(proposal: &mut Proposal, seen: Seen<'_>) {
    for out in &mut proposal.left_out {
        out.entry = match out.reason {
            Reason::Empty | Reason::NoSolverFiles | Reason::OnlyDeck => None,
            _ => seen(&out.path),
        };
    }
}

/// Masses of a pair that differ by more, according to their velocities, are not equal.
const UNEQUAL: f64 = 0.1;

/// The runs by speed, then by name.
pub(super) fn runs(
    measured: &Measured<'_>,
    given: &UserHints,
    truncated: &[Option<f64>],
    seen: Seen<'_>,
    warnings: &mut Vec<String>,
) -> Vec<ProposedRun> {
    let (bodies, others) = masses(measured, given, warnings);
    let is_half = names_say_half(measured, given);
    if is_half {
        warnings.push("the folders' names state twice the recorded speeds: closing speeds of half models? Then use --half-model".into());
    }
    let mut runs: Vec<ProposedRun> = measured
        .recorded
        .iter()
        .enumerate()
        .map(|(k, recorded)| {
            let run = measured.runs.get(k);
            let folder = recorded.run.path.clone();
            let no_units = || Proposed::missing("it is unknown without units");
            ProposedRun {
                path: seen(&folder).unwrap_or_default(),
                folder,
                name: recorded.run.name.clone(),
                speed_m_per_s: run.map_or_else(no_units, |run| speed(run, measured, given)),
                mass_kg: bodies.get(k).cloned().unwrap_or_else(no_units),
                other_mass_kg: others.as_ref().and_then(|others| others.get(k)).cloned(),
                truncate_s: truncated.get(k).copied().flatten().map(|s| {
                    let from = "the last state follows the previous one too soon for the filter";
                    Proposed::found(s, Evidence::Computed(from.into()))
                }),
                crush_m: run.map(|run| run.crush_m),
                states: recorded.record.states,
                notes: run.filter(|_| !is_half).map_or(Vec::new(), doubts_of_speed),
            }
        })
        .collect();
    let speed = |run: &ProposedRun| run.speed_m_per_s.value().copied().unwrap_or_default();
    runs.sort_by(|a, b| speed(a).total_cmp(&speed(b)).then(a.name.cmp(&b.name)));
    let alike = runs.windows(2).filter(|pair| {
        let (a, b) = (speed(&pair[0]), speed(&pair[1]));
        a > 0.0 && is_near(a, b, SAME_SPEED)
    });
    let alike: Vec<String> =
        alike.map(|pair| format!("{} and {}", pair[0].name, pair[1].name)).collect();
    if !alike.is_empty() {
        warnings.push(format!(
            "runs of one speed with different histories: {}; a group holds one design",
            alike.join(", ")
        ));
    }
    runs
}

/// Speed of a run, from its first velocities or those right before the contact.
fn speed(run: &SiRun<'_>, measured: &Measured<'_>, given: &UserHints) -> Proposed<f64> {
    let (state, time_s) = run.state;
    let record = &run.recorded.record;
    let values: Vec<String> = record.velocities.iter().map(|v| v[state].to_string()).collect();
    let nodes: Vec<String> = measured.agreed.nodes.iter().map(|n| n.id.to_string()).collect();
    let when = match state {
        0 => "in the first state".into(),
        _ => format!("in the last state before the contact, at {:.3} ms", time_s * 1e3),
    };
    let of = format!("{} of {} {when}", measured.agreed.direction.velocity(), nodes.join(" and "));
    let unit = measured.units.value().and_then(|units| SPEED.name_of(units.speed()));
    let values = format!("{} {}", values.join(" and "), unit.unwrap_or_default());
    let evidence = match (record.velocities.len(), given.half_model) {
        (1, false) => Evidence::Read(format!("{of}: {values}")),
        (1, true) => Evidence::Computed(format!("twice the {of}: {values}")),
        _ => Evidence::Computed(format!("difference of the {of}: {values}")),
    };
    Proposed::found(run.speed_m_per_s, evidence)
}

/// Whether the folders' names state twice the recorded speeds, for all runs whose name contains one.
fn names_say_half(measured: &Measured<'_>, given: &UserHints) -> bool {
    let said: Vec<bool> = measured
        .runs
        .iter()
        .filter_map(|run| Some((run, speed_in(&run.recorded.run.name)?)))
        .map(|(run, said)| is_near(said, 2.0 * run.speed_m_per_s, SAME_SPEED))
        .collect();
    let is_single = measured.agreed.kind == StudyKind::Wall && !given.half_model;
    is_single && !said.is_empty() && said.into_iter().all(|is_twice| is_twice)
}

/// Speeds in a folder's name and the run's own deck that contradict the record.
fn doubts_of_speed(run: &SiRun<'_>) -> Vec<String> {
    let Recorded { run: of, record } = run.recorded;
    let first = record.closing(run.state.0);
    let mut notes = Vec::new();
    let said = speed_in(&of.name);
    if let Some(said) = said.filter(|said| !is_near(*said, run.speed_m_per_s, SAME_SPEED)) {
        notes.push(format!(
            "the folder's name states {}, the record {}",
            km_per_h(said),
            km_per_h(run.speed_m_per_s)
        ));
    }
    if let Some((path, deck)) = &of.sources.deck
        && path.parent() == Some(&of.path)
        && let Some(said) =
            deck.impact_speed().filter(|said| !is_near(said.speed, first, SAME_SPEED))
    {
        notes.push(format!(
            "the deck {}, line {}, states {} in its units, the record {first}",
            shown_name(path),
            said.at.line,
            said.speed
        ));
    }
    notes
}

/// Masses of the bodies and of the other bodies, where these are others.
fn masses(
    measured: &Measured<'_>,
    given: &UserHints,
    warnings: &mut Vec<String>,
) -> (Vec<Proposed<f64>>, Option<Vec<Proposed<f64>>>) {
    let agreed = measured.agreed;
    let is_weak = agreed.force.is_some() && agreed.residual > FOLLOWS;
    let is_part = agreed.force.as_ref().is_some_and(|force| force.file == "secforc");
    let why = match &agreed.force {
        Some(_) if is_weak => format!(
            "impulse and change of velocity differ by {} %, so momentum gives no mass: use --mass",
            percent(agreed.residual)
        ),
        Some(_) if is_part => {
            "a section may carry only part of what stops the body, so momentum gives no mass: use --mass".into()
        }
        _ => "no force and no energy give it: use --mass".into(),
    };
    let of =
        |weighed: fn(&SiRun<'_>) -> Option<MassEstimates>| -> Option<Vec<(String, MassEstimates)>> {
            let all = measured.runs.iter().map(|run| {
                let weighed = match (is_weak, is_part) {
                    (true, _) => MassEstimates::default(),
                    (false, true) => MassEstimates { by_momentum: None, ..weighed(run)? },
                    (false, false) => weighed(run)?,
                };
                Some((run.recorded.run.name.clone(), weighed))
            });
            all.collect()
        };
    let stated = |kg: Option<f64>, by: &str| {
        kg.map(|kg| {
            let one = Proposed::found(kg, Evidence::UserHints(format!("by {by}")));
            vec![one; measured.recorded.len()]
        })
    };
    let of_bodies = of(|run| Some(run.body)).unwrap_or_default();
    let bodies = stated(given.mass_kg, "--mass")
        .unwrap_or_else(|| measure::agree(&of_bodies, &why, warnings));
    let others = stated(given.other_mass_kg, "--other-mass").or_else(|| {
        let of_others = of(|run| run.other).filter(|_| given.mass_kg.is_none())?;
        Some(measure::agree(&of_others, &why, &mut Vec::new()))
    });
    warnings.extend(measure::differ(&bodies));
    let (bodies, others) = match others {
        Some(others) if given.other_mass_kg.is_none() => one_mass(bodies, others),
        others => (bodies, others),
    };
    let is_weighed = given.mass_kg.is_none() && bodies.iter().any(|mass| mass.value().is_some());
    match others {
        None if !is_weighed => {
            let others = by_ratio(&bodies, measured, given, warnings);
            (bodies, others)
        }
        others => (bodies, others),
    }
}

/// If nothing determines the masses, what the velocities show of the other body: nothing, if they are
/// as heavy as the first ones.
fn by_ratio(
    bodies: &[Proposed<f64>],
    measured: &Measured<'_>,
    given: &UserHints,
    warnings: &mut Vec<String>,
) -> Option<Vec<Proposed<f64>>> {
    let times = digits(unequal(measured)?);
    if given.mass_kg.is_some() {
        warnings.push(format!(
            "mass: by their velocities the other body is {times} times as heavy, and --mass alone would apply to both: use --other-mass"
        ));
        return None;
    }
    let why = format!("by their velocities {times} times the mass: use --other-mass");
    Some(vec![Proposed::missing(why); bodies.len()])
}

/// Mass of the other bodies over that of the first ones, if the velocities of the runs say in
/// the mean that they differ.
fn unequal(measured: &Measured<'_>) -> Option<f64> {
    if measured.agreed.residual > FOLLOWS {
        return None;
    }
    let ratios: Option<Vec<f64>> =
        measured.recorded.iter().map(|run| run.record.mass_ratio()).collect();
    let ratios = ratios.filter(|ratios| !ratios.is_empty())?;
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    (!is_near(mean, 1.0, UNEQUAL)).then_some(mean)
}

/// Masses of both bodies, as one where they are equal in all runs.
fn one_mass(
    bodies: Vec<Proposed<f64>>,
    others: Vec<Proposed<f64>>,
) -> (Vec<Proposed<f64>>, Option<Vec<Proposed<f64>>>) {
    let pairs = || bodies.iter().zip(&others);
    let are_equal = |(a, b): (&Proposed<f64>, &Proposed<f64>)| match (a.value(), b.value()) {
        (Some(a), Some(b)) => measure::are_equal(*a, *b),
        (None, None) => true,
        _ => false,
    };
    if pairs().all(are_equal) { (bodies, None) } else { (bodies, Some(others)) }
}
