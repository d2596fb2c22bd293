//! The findings in words: each value of a proposal with its source.

use std::collections::BTreeMap;
use std::path::Path;

use super::UserHints;
use super::folders::{seen_from, speed_in};
use super::measure::{
    self, Impact, MassEstimates, SAME_EXACT_MASS, SAME_MASS, SAME_SPEED, is_near,
};
use super::recipe::{CommonRecipe, FOLLOWS, names_centre_of_gravity, percent};
use super::record::Record;
use super::sources::MOTION;
use super::units::{digits, shown_mass};
use super::write::Evidence::{Computed, Given, Guessed, Read};
use super::write::{Proposal, Proposed, ProposedRun};
use crate::curve::recipe::{DeflectionSource, Filter, ForceSource, RecordedMotion};
use crate::order;
use crate::signal::cfc;
use crate::solver::lsdyna::deck::Deck;
use crate::study::StudyKind;
use crate::study::files::shown_name;
use crate::unit::{SPEED, UnitSystem, km_per_h};

/// Bodies whose speed lies along an axis by less than this share move obliquely.
const ALONG: f64 = 0.99;
/// A wall with more than this share of the chosen one's impulse is named.
const ANOTHER: f64 = 0.01;
/// A record with so many times the usual interval makes the study coarse.
const COARSE: f64 = 2.0;
/// Masses of a pair that differ by more, according to their velocities, are not equal.
const UNEQUAL: f64 = 0.1;

/// What is known of the runs together; most functions of it make one choice of the proposal.
pub(super) struct Facts<'a> {
    pub recipe: &'a CommonRecipe,
    pub records: &'a [Record],
    pub units: Proposed<UnitSystem>,
    pub hints: &'a UserHints,
    /// Of the study: paths in it begin there.
    pub folder: &'a Path,
}

impl Facts<'_> {
    /// The proposal; `group`: name of the folder above the runs.
    pub(super) fn proposal(&self, group: String, mut warnings: Vec<String>) -> Proposal {
        let recipe = self.recipe;
        let group = match &self.hints.group {
            Some(name) => Proposed::found(name.clone(), Given, "by --group"),
            None => Proposed::found(group, Guessed, "name of the folder above the runs"),
        };
        let (filter, cuts) = self.filter();
        let runs = self.runs(&cuts, &mut warnings);
        self.warn(&mut warnings);
        let impacts: Vec<&Impact> = self.impacts().map(|(_, impact)| impact).collect();
        let no_units = || Proposed::missing("the times are unknown without units");
        Proposal {
            group,
            units: self.units.clone(),
            kind: self.kind(),
            half_model: self.hints.half_model,
            deflection: self.deflection(),
            node_titles: recipe.nodes.iter().map(|node| node.title.clone()).collect(),
            other_nodes: recipe.nodes.iter().map(|node| node.others.clone()).collect(),
            force: self.force(),
            force_title: recipe.force.as_ref().and_then(|force| force.title.clone()),
            other_side: recipe.force.as_ref().is_some_and(|force| force.other_side),
            other_forces: recipe.other_forces.clone(),
            filter,
            sampling: measure::sampling(&impacts).unwrap_or_else(no_units),
            runs,
            left_out: Vec::new(),
            notes: self.notes(),
            warnings,
        }
    }

    /// The runs with their values in SI: none if the units are unknown.
    fn impacts(&self) -> impl Iterator<Item = (&Record, &Impact)> {
        self.records.iter().filter_map(|record| Some((record, record.impact.as_ref()?)))
    }

    fn force_is_of_section(&self) -> bool {
        self.recipe.force.as_ref().is_some_and(|force| force.file == "secforc")
    }

    fn kind(&self) -> Proposed<StudyKind> {
        let CommonRecipe { kind, force, opposed, bodies, .. } = self.recipe;
        if self.hints.half_model {
            let from = "by --half-model: the other body is this one's mirror image";
            return Proposed::found(StudyKind::Pair, Given, from);
        }
        if self.hints.kind.is_some() {
            return Proposed::found(*kind, Given, "by --kind");
        }
        if self.hints.minus_node.is_some() {
            return Proposed::found(*kind, Given, "by --minus-node");
        }
        let from = match (kind, force) {
            (StudyKind::Pair, Some(force)) => {
                let from = format!("two bodies move, and {} drives them apart", force.label());
                return Proposed::found(*kind, Computed, from);
            }
            (StudyKind::Pair, None) => format!(
                "two bodies move, and their changes of momentum balance within {} %; no force shows whether they meet",
                percent(opposed.unwrap_or(1.0))
            ),
            (StudyKind::Wall, None) if *bodies > 1 => "several bodies move, no force shows which of them meet, and no two changes of momentum balance: the fastest is taken, as if it hit a wall".into(),
            (StudyKind::Wall, Some(force)) if force.file == "rwforc" => "one body moves, and a rigid wall stops it (which may be the symmetry plane of a pair: see half_model)".into(),
            (StudyKind::Wall, _) => "one body moves in the files: if the object that it hits moves too, write one of its nodes to nodout".into(),
        };
        Proposed::found(*kind, Guessed, from)
    }

    fn deflection(&self) -> Proposed<DeflectionSource> {
        let CommonRecipe { nodes, direction, force, .. } = self.recipe;
        let Some(node) = nodes.first() else {
            return Proposed::missing(
                "no node of the runs moves with the body: name one with --node",
            );
        };
        let source = DeflectionSource {
            file: MOTION.into(),
            node: node.id,
            minus_node: nodes.get(1).map(|other| other.id),
            component: *direction,
        };
        if self.hints.node.is_some() {
            return Proposed::found(source, Given, "by --node");
        }
        let mut because = format!("the bodies start along {}", direction.axis());
        if force.is_some() {
            let of_runs = match self.records.len() {
                1 => "the run".into(),
                2 => "both runs".into(),
                runs => format!("all {runs} runs"),
            };
            because += &format!(
                "; change of velocity and impulse of the force agree within {} % in {of_runs}",
                percent(self.recipe.residual)
            );
        }
        if nodes.iter().all(|node| names_centre_of_gravity(node.title.as_deref())) {
            because += "; the title says centre of gravity";
        }
        let is_only = nodes.iter().all(|node| node.others.is_empty()) && force.is_some();
        Proposed::found(source, if is_only { Computed } else { Guessed }, because)
    }

    fn force(&self) -> Proposed<ForceSource> {
        let CommonRecipe { nodes, direction, force, other_forces, .. } = self.recipe;
        let (Some(force), named) = (force, &self.hints.force) else {
            let Some(node) = nodes.first() else {
                return Proposed::missing(
                    "no force of the runs acts on the bodies: name one with --force",
                );
            };
            let source = ForceSource::Body {
                file: MOTION.into(),
                node: node.id,
                motion: RecordedMotion::Velocity,
                component: direction.velocity().into(),
            };
            let from = "no wall, contact or section of the runs moves the body, so its mass times its acceleration is taken as the force";
            return Proposed::found(source, Guessed, from);
        };
        let component = named.as_ref().and_then(|named| named.component.clone());
        let source = ForceSource::Contact {
            file: force.file.into(),
            id: force.ids[0],
            also: force.ids[1..].to_vec(),
            side: named.as_ref().and_then(|named| named.side).or(force.side),
            component: component.unwrap_or_else(|| force.component.into()),
        };
        if named.is_some() {
            Proposed::found(source, Given, "by --force")
        } else if force.ids.len() > 1 && self.recipe.beside.ids.is_empty() {
            let from = "they act together or one after the other: the bodies follow their sum far more closely than any of them";
            Proposed::found(source, Computed, from)
        } else if force.ids.len() > 1 {
            let from = "they share the load: together they give the bodies their mass";
            Proposed::found(source, Computed, from)
        } else if other_forces.is_empty() {
            let from = "the only force along the motion, and the bodies follow it";
            Proposed::found(source, Computed, from)
        } else {
            let from = "of the walls and contacts (else supports and sections) that the bodies follow closely, the one with the largest impulse along the motion";
            Proposed::found(source, Guessed, from)
        }
    }

    /// The filter, and for each run a time at which it has to be cut for it: a solver's last state
    /// often comes right after the one before.
    fn filter(&self) -> (Proposed<Filter>, Vec<Option<f64>>) {
        let means = self.records.first().and_then(|record| record.force_means.as_deref());
        let coarsest = self.impacts().map(|(_, impact)| impact.interval_s).fold(0.0, f64::max);
        let proposed = measure::filter(means, coarsest);
        let none = vec![None; self.records.len()];
        if *proposed.value().unwrap_or(&Filter::None) == Filter::None {
            return (proposed, none);
        }
        let (cuts, by_usual) = match self.filtered(measure::CLASSES[0]) {
            Ok((cuts, kept)) if kept >= cfc::KEPT => return (proposed, cuts),
            Ok(found) => found,
            Err(from) => return (Proposed::found(Filter::None, Computed, from), none),
        };
        let higher = measure::CLASSES[1..].iter().find_map(|&class| {
            let (cuts, kept) = self.filtered(class).ok()?;
            (kept >= cfc::KEPT).then_some((Filter::Cfc(class), cuts))
        });
        let (filter, cuts) = higher.unwrap_or((Filter::None, vec![None; cuts.len()]));
        (Proposed::found(filter, Computed, taken(by_usual)), cuts)
    }

    /// For each run a time at which a filter needs it to be cut, and the smallest share of a run's work that it keeps; else
    /// why it cannot be used.
    fn filtered(&self, class: u32) -> Result<(Vec<Option<f64>>, f64), String> {
        let (mut cuts, mut least) = (vec![None; self.records.len()], 1.0_f64);
        for ((record, impact), cut) in self.impacts().zip(&mut cuts) {
            let (time, force) = (&impact.force_time_s, &impact.force_n);
            let fits = |states: usize| cfc::filter(class, &time[..states], &force[..states]);
            let Some(last) = force.len().checked_sub(1) else { continue };
            let filtered = match fits(last + 1) {
                Ok(filtered) => filtered,
                Err(error) => {
                    *cut = Some(0.5 * (time[last - 1] + time[last]));
                    fits(last).map_err(|_| format!("run {}: {error}", record.run.name))?
                }
            };
            let path = record.path_while_loading();
            // Filtered, a force begins ahead of the contact, where the curve does not.
            let contact = time.partition_point(|&t| t < impact.contact_s);
            let loading = contact.min(path.len())..path.len().min(filtered.values.len());
            let of = |force: &[f64]| force[loading.clone()].to_vec();
            let kept = cfc::work_kept(&of(&filtered.values), &of(force), &of(&path));
            // Without a path there is no work.
            least = least.min(if kept.is_nan() { 1.0 } else { kept });
        }
        Ok((cuts, least))
    }

    /// What the user should check.
    fn warn(&self, warnings: &mut Vec<String>) {
        let recipe = self.recipe;
        if recipe.force.is_some() && recipe.residual > FOLLOWS {
            warnings.push(format!(
                "no node's velocity follows the impulse of a force closely (residual {} %): several bodies in a row, or a force on part of the body? Check node and force",
                percent(recipe.residual)
            ));
        }
        if let (Some(larger), [node, ..], None) =
            (&recipe.beside.larger, &recipe.nodes[..], &self.hints.force)
        {
            warnings.push(format!(
                "force: {larger}, which the body of node {} follows more closely: if several bodies move in a row, this is the force on that one alone, and its way against the ground; choose with --force and --node",
                node.id
            ));
        }
        let given = self.hints.mass_kg.zip(self.units.value()).map(|(kg, u)| kg / u.mass_kg);
        let is_whole = |record: &Record| {
            record.over_momentum(given).is_some_and(|ratio| is_near(ratio, 1.0, SAME_MASS))
        };
        if let Some(force) = &recipe.force
            && let [id] = force.ids[..]
            && self.hints.force.is_none()
            && !self.records.iter().any(is_whole)
        {
            let (file, whole) = (force.file, recipe.beside.whole);
            let listed =
                |ids: &[i64]| ids.iter().map(i64::to_string).collect::<Vec<_>>().join(", ");
            let ids = listed(&recipe.beside.ids);
            if !ids.is_empty() {
                warnings.push(format!(
                    "the bodies follow {file} {ids} as they follow {file} {id}: if these share the load, write id = [{id}, {ids}] in force, and {whole:.2} times the masses"
                ));
            }
            let opposite = listed(&recipe.beside.opposite);
            if !opposite.is_empty() {
                warnings.push(format!(
                    "the bodies follow {file} {opposite} as they follow {file} {id}, on opposite sides: if these share the load, force and masses are those of a part, and a recipe cannot add them: let the deck's contacts name the bodies in one order"
                ));
            }
        }
        // A wall acts on the bodies from outside, whatever they follow.
        if let Some(chosen) = recipe.force.as_ref().filter(|f| f.file == "rwforc")
            && self.hints.force.is_none()
        {
            let known = [&chosen.ids, &recipe.beside.ids, &recipe.beside.opposite];
            let another = self.records.iter().find_map(|Record { run, .. }| {
                let own = run.survey.force(chosen.file, &chosen.ids)?;
                let size = run.survey.forces[own].size();
                let walls = run.survey.forces.iter().filter(|wall| {
                    wall.file == chosen.file && !known.iter().any(|ids| ids.contains(&wall.ids[0]))
                });
                let shares = walls.map(|wall| (&run.name, wall.ids[0], wall.size() / size));
                shares.into_iter().find(|(.., share)| *share > ANOTHER)
            });
            if let Some((run, id, share)) = another {
                let (label, percent) = (chosen.label(), percent(share));
                let ids = chosen.ids.iter().map(i64::to_string).collect::<Vec<_>>().join("+");
                warnings.push(format!(
                    "rwforc {id} also acts along the motion, in {run} with {percent} % of the impulse of {label}: if it stops the body, use --force rwforc:{ids}+{id}"
                ));
            }
        }
        if self.force_is_of_section() {
            warnings.push(
                "the force is that of a section, which may carry only part of what stops the body"
                    .into(),
            );
        }
        let mut intervals: Vec<f64> = self.impacts().map(|(_, impact)| impact.interval_s).collect();
        intervals.sort_by(f64::total_cmp);
        let usual = intervals.get(intervals.len().saturating_sub(1) / 2).copied();
        let coarse = self
            .impacts()
            .filter(|(_, impact)| Some(impact.interval_s) > usual.map(|s| COARSE * s));
        let coarse: Vec<String> = coarse
            .map(|(record, impact)| {
                format!("{} every {} ms", record.run.name, digits(impact.interval_s * 1e3))
            })
            .collect();
        if let (false, Some(usual)) = (coarse.is_empty(), usual) {
            warnings.push(format!(
                "states: {}, most of the others every {} ms: sampling and filter of all runs follow the coarsest; leave such runs out if the others matter more",
                coarse.join(", "),
                digits(usual * 1e3)
            ));
        }
        let oblique = self.records.iter().find(|record| record.run.survey.aligned < ALONG);
        if let Some(Record { run, .. }) = oblique {
            warnings.push(format!(
                "run {}: only {:.0} % of the initial speed lies along {}: deflection and speed of a recipe are along an axis",
                run.name,
                run.survey.aligned * 100.0,
                recipe.direction.axis()
            ));
        }
        for Record { run, damage, .. } in self.records {
            warnings.extend(run.sources.unread.iter().map(|why| format!("not read: {why}")));
            warnings.extend(damage.iter().map(|damage| format!("run {}: {damage}", run.name)));
        }
    }

    /// What was chosen on the way: of several files with the same histories, one.
    fn notes(&self) -> Vec<String> {
        let mut chosen: BTreeMap<String, usize> = BTreeMap::new();
        for Record { run, .. } in self.records {
            let force = self.recipe.force.as_ref();
            let force = force.and_then(|force| run.sources.force(force.file));
            for source in [&run.sources.motion].into_iter().chain(force) {
                if !source.others.is_empty() {
                    let (read, others) = (source.shown(), source.others.join(" and "));
                    *chosen
                        .entry(format!("{read} is read; {others} also holds it"))
                        .or_default() += 1;
                }
            }
        }
        let of_runs = |runs: usize| match runs {
            runs if runs == self.records.len() => String::new(),
            1 => " (in 1 run)".into(),
            runs => format!(" (in {runs} runs)"),
        };
        chosen.into_iter().map(|(note, runs)| note + &of_runs(runs)).collect()
    }

    /// The runs by speed, then by name; `cuts`: where their records have to end.
    fn runs(&self, cuts: &[Option<f64>], warnings: &mut Vec<String>) -> Vec<ProposedRun> {
        let (bodies, others) = self.masses(warnings);
        let is_half = self.names_say_half();
        if is_half {
            warnings.push("the folders' names state twice the recorded speeds: closing speeds of half models? Then use --half-model".into());
        }
        let no_units = || Proposed::missing("it is unknown without units");
        let mut runs = Vec::new();
        for (k, record) in self.records.iter().enumerate() {
            let (run, impact) = (&record.run, record.impact.as_ref());
            let cut_because = "the last state follows the previous one too soon for the filter";
            runs.push(ProposedRun {
                folder: run.path.clone(),
                path: seen_from(self.folder, &run.path).unwrap_or_default(),
                name: run.name.clone(),
                speed_m_per_s: impact.map_or_else(no_units, |impact| self.speed(record, impact)),
                mass_kg: bodies.get(k).cloned().unwrap_or_else(no_units),
                other_mass_kg: others.as_ref().and_then(|others| others.get(k)).cloned(),
                truncate_s: cuts[k].map(|s| Proposed::found(s, Computed, cut_because)),
                // Without a force, only the build finds the contact.
                crush_m: impact.filter(|of| !of.force_n.is_empty()).map(|impact| impact.crush_m),
                truncated: false,
                states: record.states,
                notes: impact.filter(|_| !is_half).map_or(Vec::new(), |impact| {
                    doubts_of_speed(record, impact, self.hints.half_model)
                }),
            });
        }
        sort(&mut runs);
        let speed = |run: &ProposedRun| run.speed_m_per_s.value().copied().unwrap_or_default();
        let alike: Vec<String> = runs
            .windows(2)
            .filter(|pair| speed(&pair[0]) > 0.0)
            .filter(|pair| is_near(speed(&pair[0]), speed(&pair[1]), SAME_SPEED))
            .map(|pair| format!("{} and {}", pair[0].name, pair[1].name))
            .collect();
        if !alike.is_empty() {
            warnings.push(format!(
                "runs of one speed with different histories: {}; a group holds one design",
                alike.join(", ")
            ));
        }
        runs
    }

    /// A run whose record ends while loading, if it fits the recipe and the masses of the whole ones and holds most of a crash.
    pub(super) fn cut_run(&self, record: &Record, whole: &Proposal) -> Option<ProposedRun> {
        let units = *self.units.value()?;
        let path = seen_from(self.folder, &record.run.path)?;
        let one = |of: fn(&ProposedRun) -> Option<&Proposed<f64>>| {
            let first = of(whole.runs.first()?)?;
            let kg = |run| of(run)?.value();
            whole.runs.iter().all(|run| kg(run) == first.value()).then_some(*first.value()?)
        };
        let kg = one(|run| Some(&run.mass_kg))?;
        let other_kg = one(|run| run.other_mass_kg.as_ref());
        let are_equal = whole.runs.iter().all(|run| run.other_mass_kg.is_none());
        if record.magnitudes().impossible(&units).is_some()
            || !(are_equal || other_kg.is_some())
            || !record.holds_most_of_a_crash(kg / units.mass_kg)
        {
            return None;
        }
        let impact = &Impact::of(record, units, self.hints.half_model);
        let (end, share) = record.end_while_loading(Some(&units));
        let sampling = whole.sampling.value()?;
        let window_s = impact.contact_s + (sampling.states - 1) as f64 * sampling.interval_s;
        let of_others = |kg: f64| Proposed::found(kg, Computed, "that of the other runs");
        let mut notes = doubts_of_speed(record, impact, self.hints.half_model);
        notes.push(format!(
            "the record ends at {end}, while the bodies still close at {} % of their first speed: the curve goes up to there, and the maximum crush is larger{}",
            percent(share),
            record.other_files()
        ));
        Some(ProposedRun {
            folder: record.run.path.clone(),
            path,
            name: record.run.name.clone(),
            speed_m_per_s: self.speed(record, impact),
            mass_kg: of_others(kg),
            other_mass_kg: other_kg.map(of_others),
            truncate_s: (impact.last_s > window_s).then(|| {
                Proposed::found(window_s, Computed, "the sampling of the others ends there")
            }),
            crush_m: Some(impact.crush_m),
            truncated: true,
            states: record.states,
            notes,
        })
    }

    /// Speed of a run, from its first velocities or those right before the contact.
    fn speed(&self, record: &Record, impact: &Impact) -> Proposed<f64> {
        let (state, time_s) = impact.state;
        let values: Vec<String> = record.velocities.iter().map(|v| v[state].to_string()).collect();
        let nodes: Vec<String> = self.recipe.nodes.iter().map(|n| n.id.to_string()).collect();
        let when = match state {
            0 => "in the first state".into(),
            _ => format!("in the last state before the contact, at {:.3} ms", time_s * 1e3),
        };
        let unit = self.units.value().and_then(|units| SPEED.name_of(units.speed()));
        let direction = self.recipe.direction;
        let is_read = record.run.sources.motion.has(direction.velocity());
        let of = format!(
            "{} of {} {when}: {} {}",
            match is_read {
                true => direction.velocity().into(),
                false => format!("rate of the {}", direction.name()),
            },
            nodes.join(" and "),
            values.join(" and "),
            unit.unwrap_or_default()
        );
        let (evidence, from) = match (values.len(), self.hints.half_model) {
            (1, false) => (if is_read { Read } else { Computed }, of),
            (1, true) => (Computed, format!("twice the {of}")),
            _ => (Computed, format!("difference of the {of}")),
        };
        Proposed::found(impact.speed_m_per_s, evidence, from)
    }

    /// Whether the folders' names state twice the recorded speeds, for all runs whose name contains one.
    fn names_say_half(&self) -> bool {
        let mut named = self
            .impacts()
            .filter_map(|(record, impact)| Some((speed_in(&record.run.name)?, impact)))
            .peekable();
        self.recipe.kind == StudyKind::Wall
            && !self.hints.half_model
            && named.peek().is_some()
            && named.all(|(named, impact)| is_near(named, 2.0 * impact.speed_m_per_s, SAME_SPEED))
    }

    /// Masses of the bodies and of the other bodies, where these are others.
    fn masses(
        &self,
        warnings: &mut Vec<String>,
    ) -> (Vec<Proposed<f64>>, Option<Vec<Proposed<f64>>>) {
        let UserHints { mass_kg, other_mass_kg, .. } = *self.hints;
        let is_weak = self.recipe.force.is_some() && self.recipe.residual > FOLLOWS;
        let is_part = self.force_is_of_section();
        let why = if is_weak {
            format!(
                "impulse and change of velocity differ by {} %, so momentum gives no mass: use --mass",
                percent(self.recipe.residual)
            )
        } else if is_part {
            "a section may carry only part of what stops the body, so momentum gives no mass: use --mass".into()
        } else {
            "no force and no energy give it: use --mass".into()
        };
        let estimates = |body: usize| -> Option<Vec<(String, MassEstimates)>> {
            let of_runs = self.impacts().map(|(record, impact)| {
                let mut estimates = *impact.masses.get(body)?;
                estimates.by_momentum = estimates.by_momentum.filter(|_| !is_weak && !is_part);
                estimates.by_energy = estimates.by_energy.filter(|_| !is_weak);
                Some((record.run.name.clone(), estimates))
            });
            of_runs.collect()
        };
        let stated = |kg: f64, by: &str| vec![Proposed::found(kg, Given, by); self.records.len()];
        let mut bodies = match mass_kg {
            Some(kg) => stated(kg, "by --mass"),
            None => measure::agree("mass", &estimates(0).unwrap_or_default(), &why, warnings),
        };
        if let Some(given) = mass_kg {
            warnings.extend(measure::contradicts(
                &estimates(0).unwrap_or_default(),
                "--mass",
                given,
            ));
        }
        warnings.extend(measure::differ("mass", &bodies));
        if let Some(kg) = other_mass_kg {
            let of_runs = estimates(1).unwrap_or_default();
            warnings.extend(measure::contradicts(&of_runs, "--other-mass", kg));
            return (bodies, Some(stated(kg, "by --other-mass")));
        }
        if mass_kg.is_none()
            && let Some(estimates) = estimates(1)
        {
            let mut of_others = Vec::new();
            let others = measure::agree("other mass", &estimates, &why, &mut of_others);
            let are_near = |k: usize, same: f64| match (bodies[k].value(), others[k].value()) {
                (Some(a), Some(b)) => is_near(*a, *b, same),
                (a, b) => a.is_none() && b.is_none(),
            };
            if !(0..bodies.len()).all(|k| are_near(k, estimates[k].1.same())) {
                warnings.extend(of_others);
                warnings.extend(measure::differ("other mass", &others));
                return (bodies, Some(others));
            }
            for (body, other) in bodies.iter_mut().zip(&others) {
                if let (Proposed::Found { value, from, .. }, Some(other)) = (body, other.value())
                    && !is_near(*value, *other, SAME_EXACT_MASS)
                {
                    *from +=
                        &format!("; the other body's, {}, is taken as equal", shown_mass(*other));
                }
            }
        }
        let is_weighed = mass_kg.is_none() && bodies.iter().any(|mass| mass.value().is_some());
        let why = if is_weighed { None } else { self.why_other_masses_differ(warnings) };
        let missing = |why: String| vec![Proposed::missing(why); bodies.len()];
        let others = why.map(missing);
        (bodies, others)
    }

    /// If nothing determines the masses, what the velocities show of the other body in the mean of the
    /// runs: nothing, if it is as heavy as the first one.
    fn why_other_masses_differ(&self, warnings: &mut Vec<String>) -> Option<String> {
        let ratios: Option<Vec<f64>> = self.records.iter().map(Record::mass_ratio).collect();
        let ratios = ratios.filter(|all| !all.is_empty() && self.recipe.residual <= FOLLOWS)?;
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        if is_near(mean, 1.0, UNEQUAL) {
            return None;
        }
        let times = digits(mean);
        if self.hints.mass_kg.is_some() {
            warnings.push(format!(
                "mass: judging by their velocities, the other body is {times} times as heavy, and --mass alone would apply to both: use --other-mass"
            ));
            return None;
        }
        Some(format!("judging by their velocities, {times} times the mass: use --other-mass"))
    }
}

/// By speed, then by name.
pub(super) fn sort(runs: &mut [ProposedRun]) {
    let speed = |run: &ProposedRun| run.speed_m_per_s.value().copied().unwrap_or_default();
    order::sort(runs, |a, b| speed(a).total_cmp(&speed(b)).then(a.name.cmp(&b.name)));
}

/// Why not the usual class, which keeps so much of the work.
fn taken(kept: f64) -> String {
    let (usual, taken) = (measure::CLASSES[0], 100.0 * (1.0 - kept));
    format!(
        "the impacts are short or begin with a sharp peak: CFC {usual} would remove {taken:.1} % of the work of the force"
    )
}

/// Speeds in a folder's name and the run's own deck that contradict the record.
fn doubts_of_speed(record: &Record, impact: &Impact, half_model: bool) -> Vec<String> {
    let (run, first) = (&record.run, record.closing(impact.state.0));
    let mut notes = Vec::new();
    let named = speed_in(&run.name);
    // Of half a model, folders may be named after the record's own speed or after the closing speed.
    let bodies = if half_model { 2.0 } else { 1.0 };
    let own_m_per_s = impact.speed_m_per_s / bodies;
    let is_as_named = named.is_some_and(|named| {
        [1.0, bodies].iter().any(|times| is_near(named, times * own_m_per_s, SAME_SPEED))
    });
    if record.starts_in_contact() && !is_as_named {
        notes.push(
            "the record starts in contact, so the speed of its first state is not that of the impact: write the impact's speed, or provide the earlier states"
                .into(),
        );
    } else if record.may_start_in_contact() && !is_as_named {
        notes.push(
            "the record may start in contact: the body had moved before its first state, and the force begins at once after it; if so, write the impact's speed, or provide the earlier states"
                .into(),
        );
    }
    if record.velocities.len() == 1
        && let Some((path, deck)) = &run.sources.deck
        && let Some(wall) = deck.moving_wall(&record.wall_ids)
    {
        notes.push(format!(
            "the wall of the deck {}, {}, moves: speed and crush of the record are the body's own",
            shown_name(path),
            deck.line(wall.at)
        ));
    }
    if let Some(named) = named
        && !is_as_named
    {
        notes.push(format!(
            "the folder's name states {}, the record {}",
            km_per_h(named),
            km_per_h(own_m_per_s)
        ));
    }
    if let Some((path, deck)) = &run.sources.deck
        && path.parent() == Some(&run.path)
        && let Some((speed, at)) = deck.impact_speed()
        && !is_near(speed, first, SAME_SPEED)
    {
        notes.push(format!(
            "the deck {}, {}, states {speed} in its units, the record {first}",
            shown_name(path),
            deck.line(at)
        ));
    }
    notes
}

/// The units that the runs' decks state, and those in which their materials are metals, each with the place; warns where
/// decks contradict each other.
pub(super) fn units_of_decks(
    runs: &[Record],
    warnings: &mut Vec<String>,
) -> [Option<(UnitSystem, String)>; 2] {
    let stated = |deck: &Deck, name: &str| {
        let units = deck.units.as_ref()?;
        let place = format!("the deck {name}, {}", deck.line(units.at));
        Some((units.system?, format!("{place}: \"{}\"", units.text.trim())))
    };
    let mut first = |of: fn(&Deck, &str) -> Option<(UnitSystem, String)>| {
        let mut found = runs.iter().filter_map(|Record { run, .. }| {
            let (path, deck) = run.sources.deck.as_ref()?;
            let above = if path.parent() == Some(&run.path) { "" } else { " above the runs" };
            of(deck, &(shown_name(path) + above))
        });
        let first = found.next()?;
        if let Some(other) = found.find(|(system, _)| *system != first.0) {
            warnings.push(format!("units differ: {}; {}", first.1, other.1));
            return None;
        }
        Some(first)
    };
    [first(stated), first(Deck::units_of_metals)]
}
