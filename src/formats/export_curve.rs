//! A curve prepared for another tool's file: one force, its unloading, its tail, its notes.

use super::Options;
use super::text::nine_digits;
use super::thin::{Softened, from_origin, set_apart, softened, thinned};
use crate::curve::force_curve::{FULLY_CRUSHED, with_tail};
use crate::curve::{Envelope, ForceCurve, ForceKind, Tail};
use crate::dataset::{MASS, OTHER_MASS};
use crate::error::{Error, error};
use crate::multibody::{EnvelopeEnd, ForceLaw};
use crate::signal::l1_ratio;
use crate::surrogate::PredictedCurve;
use crate::surrogate::recorded::RECORDED;
use crate::unit::{Shown, km_per_h};

/// One curve of one force, as writers take it; SI.
#[derive(Clone, Debug)]
pub struct ExportCurve {
    /// The curve of this force alone, as it was predicted or recorded.
    pub predicted: PredictedCurve,
    /// Loading branch with its tail.
    pub loading: Envelope,
    /// Index of the maximum crush among the points of `loading`.
    pub end: usize,
    /// Lower and upper edge of the band at the points of `loading`, in N.
    pub band: Option<(Vec<f64>, Vec<f64>)>,
    /// Why a predicted curve has none.
    pub no_band: Option<&'static str>,
    /// How the target continues beyond the maximum crush.
    pub tail: Tail,
    follows_faster_runs: bool,
    /// Whether its force is that of a recorded motion, beside another that was declared.
    is_of_motion: bool,
    /// What was changed of the forces of `predicted`, in words.
    pub changes: Vec<String>,
    /// Ordinal among the curves of the same group and speed of one export, counted from 1.
    pub ordinal: usize,
}

/// Name of a line's stiffness that returns as much energy as the curve's own law.
pub(super) const LINE_STIFFNESS: &str = "line_stiffness_N_per_m";

/// Share of the energy that a rise from the origin to the first force may change unsaid.
const RAMP: f64 = 1e-3;

/// Change of a force in % of the peak force that a file with fewer points need not state.
const MOST_UNSAID: f64 = 2.0;

/// How a target releases the energy stored at the maximum crush.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TargetUnloading {
    /// On a straight line of this stiffness in N/m.
    Line(f64),
    /// Along the loading branch: all energy is returned.
    Elastic,
}

impl ExportCurve {
    /// Makes the curve of one force ready for a target.
    ///
    /// # Errors
    /// If the curve does not have that force or is damaged, or the tail does not form a valid curve.
    pub fn new(
        curve: &PredictedCurve,
        force: ForceKind,
        tail: Tail,
        soften: bool,
    ) -> Result<Self, Error> {
        let predicted = curve.of_force(force)?;
        let mut loading = predicted.envelope()?;
        let end = loading.deflection_m().len() - 1;
        let stiffness = predicted.unloading_stiffness_n_per_m;
        let own_peak_n = loading.peak_force_n();
        let mut changes = Vec::new();
        if soften {
            match softened(&loading, stiffness, end) {
                Softened::Nothing => {}
                Softened::Curve(soft) => {
                    let end_m = loading.deflection_m()[end];
                    let even = |curve: &Envelope| -> Vec<f64> {
                        (0..=1000).map(|k| curve.force_at(end_m * f64::from(k) / 1e3)).collect()
                    };
                    let changed = l1_ratio(&even(&loading), &even(&soft));
                    changes.push(format!(
                        "rises steeper than {} have been made less steep, with the same energy up to the maximum crush; the peak force changes from {} to {}, and forces by {:.1} % of their mean on average",
                        Shown::one_stiffness(stiffness),
                        Shown::one_force(own_peak_n),
                        Shown::one_force(soft.peak_force_n()),
                        100.0 * changed
                    ));
                    loading = soft;
                }
                Softened::Impossible => {
                    return Err(error!(
                        Export,
                        "{} {}{}: no steep rise can be reduced to {} at equal energy without changing the curve's end, or raising other forces by more than a quarter: export it without --soften",
                        predicted.provenance.group,
                        km_per_h(predicted.speed_m_per_s),
                        own_name(&predicted).map_or(String::new(), |name| format!(", {name}")),
                        Shown::one_stiffness(stiffness)
                    ));
                }
            }
        }
        let beyond = predicted.beyond_envelope()?;
        let follows_faster_runs = beyond.as_ref().is_some_and(|b| b.end_m() > loading.end_m());
        let with = |curve: &Envelope| {
            with_tail(curve, beyond.as_ref(), predicted.data_end_m(), stiffness, tail)
        };
        let continued = set_apart(&with(&loading)?)?;
        let band = predicted.force_low_n.as_ref().zip(predicted.force_high_n.as_ref());
        // An edge goes on by the rule of the curve. It is not that of a softened curve.
        let edge = |edge: &[f64]| -> Result<Vec<f64>, Error> {
            let edge_n = with(&Envelope::new(predicted.deflection_m.clone(), edge.to_vec())?)?;
            let own = predicted.force_n.len();
            let tail = continued.deflection_m()[own..].iter().map(|&d| edge_n.force_at(d));
            Ok(edge.iter().copied().chain(tail).collect())
        };
        let no_band = match (band.is_some(), curve.force_low_n.is_some()) {
            (true, _) => changes.first().map(|_| "it is not that of a softened curve"),
            (false, true) => Some(
                "only that of the contact force is known (--force contact), until the model is trained again",
            ),
            (false, false) => Some("the model gives none here"),
        };
        let band = match band.filter(|_| changes.is_empty()) {
            Some((low, high)) => Some((edge(low)?, edge(high)?)),
            None => None,
        };
        // A curve without times moves by the force that was declared.
        let has_other = curve.body_force_n.as_ref().is_some_and(|body_n| *body_n != curve.force_n);
        let is_recorded = predicted.provenance.max_crush_rule.is_none();
        Ok(Self {
            loading: continued,
            end,
            band,
            no_band: no_band.filter(|_| !is_recorded),
            tail,
            follows_faster_runs,
            is_of_motion: is_recorded && force == ForceKind::Body && has_other,
            changes,
            ordinal: 1,
            predicted,
        })
    }

    /// The same curve through other points; `end` is the index of the maximum crush among them.
    pub fn through(self, loading: Envelope, end: usize) -> Self {
        Self { loading, end, band: None, ..self }
    }

    /// The same curve with at most `most` points, for a target that `takes` no more; the notes and `changes` say what that changes.
    ///
    /// # Errors
    /// If the result is not a valid curve.
    pub(crate) fn of_at_most(
        &self,
        most: usize,
        takes: &str,
        notes: &mut Vec<String>,
    ) -> Result<Self, Error> {
        let points = self.deflection_m().len();
        let loading = thinned(&self.loading, most, self.end)?;
        let left = loading.deflection_m().len();
        if left == points {
            return Ok(self.clone());
        }
        let own = || self.deflection_m()[..=self.end].iter().zip(self.force_n());
        let off_n = own().map(|(&d, f)| (loading.force_at(d) - f).abs()).fold(0.0, f64::max);
        let share = 100.0 * off_n / own().map(|(_, f)| *f).fold(0.0, f64::max);
        let by = match share < 0.05 {
            true => "less than 0.1".into(),
            false => format!("up to {share:.1}"),
        };
        let changed = format!(
            "{left} of {points} points are kept{takes}, with the same energy up to the maximum crush, where forces change by {by} % of the peak force"
        );
        notes.push(format!("{}: {changed}", self.headline()));
        let end = loading.deflection_m().partition_point(|&d| d < self.max_crush_m());
        let mut curve = self.clone().through(loading, end);
        if share > MOST_UNSAID {
            curve.changes.push(changed);
        }
        Ok(curve)
    }

    /// The same curve for tools that need the origin: a force at contact is reached as steeply as the curve rises or unloads,
    /// for an elastic target so steeply that hardly any energy is missing, with the same energy. The notes say what that changes.
    ///
    /// # Errors
    /// If the result is not a valid curve.
    pub(crate) fn begun_at_origin(
        &self,
        is_elastic: bool,
        notes: &mut Vec<String>,
    ) -> Result<Self, Error> {
        let first_n = self.force_n()[0];
        let steep = match is_elastic {
            true => first_n.powi(2) / (2.0 * RAMP * self.loading.work_to(self.max_crush_m())),
            false => 0.0,
        };
        let slope = self.stiffness_n_per_m().max(steep);
        let Some((loading, end)) = from_origin(&self.loading, self.end, slope)? else {
            return Ok(self.clone());
        };
        let raised = loading.force_n()[end] / self.end_n() - 1.0;
        let slope_n_per_m = loading.force_n()[1] / loading.deflection_m()[1];
        let mut begun = self.clone().through(loading, end);
        if raised > 2.0 * RAMP {
            begun.changes.push(format!(
                "the force begins with {}, which the file reaches on a line of {} from the origin; its forces are {:.1} % larger, so that the energy up to the maximum crush is the same",
                Shown::one_force(first_n),
                Shown::one_stiffness(slope_n_per_m),
                100.0 * raised
            ));
            notes.extend(begun.change_notes().pop());
        }
        Ok(begun)
    }

    /// What was changed, with the name of the curve.
    pub(crate) fn change_notes(&self) -> Vec<String> {
        let headline = self.headline();
        self.changes.iter().map(|change| format!("{headline}: {change}")).collect()
    }

    /// Why there is no band, in one line; nothing for a recorded curve, which needs none.
    pub(crate) fn no_band_note(&self) -> Option<String> {
        Some(format!("{}: written without a band: {}", self.headline(), self.no_band?))
    }

    /// Deflection at each point, in m.
    pub fn deflection_m(&self) -> &[f64] {
        self.loading.deflection_m()
    }

    /// Force at each point, in N.
    pub fn force_n(&self) -> &[f64] {
        self.loading.force_n()
    }

    /// Maximum crush of the curve's own impact, in m.
    pub fn max_crush_m(&self) -> f64 {
        self.deflection_m()[self.end]
    }

    /// Force at the maximum crush, in N.
    pub fn end_n(&self) -> f64 {
        self.force_n()[self.end]
    }

    /// Unloading stiffness from the maximum crush, in N/m.
    pub fn stiffness_n_per_m(&self) -> f64 {
        self.predicted.unloading_stiffness_n_per_m
    }

    /// Stiffness in N/m of the straight line on which a target unloads whatever the curve's slopes are: the curve's own, or
    /// where that would return more energy than crumple's law, which unloads no less steeply than the curve rises,
    /// the one that returns as much.
    pub(crate) fn line_stiffness_n_per_m(&self) -> f64 {
        let own = self.stiffness_n_per_m();
        let more = self.restitution(TargetUnloading::Line(own)) / self.own_restitution();
        if more > 1.01 && more.is_finite() { own * more.powi(2) } else { own }
    }

    /// What states that stiffness, for files that hold it, where it is not the curve's own.
    pub(crate) fn line_facts(&self) -> Vec<(&'static str, String)> {
        let line = nine_digits(self.line_stiffness_n_per_m());
        if line == nine_digits(self.stiffness_n_per_m()) {
            return Vec::new();
        }
        let used = "the file unloads on a straight line of line_stiffness_N_per_m, which returns as much energy as runs of crumple do";
        vec![(LINE_STIFFNESS, line), ("line", used.into())]
    }

    /// The curve as it drives an interface, tail included.
    pub fn driving(&self) -> ForceCurve {
        ForceCurve {
            kind: Some(self.predicted.provenance.force_kind),
            speed_kind: Some(self.predicted.speed_kind),
            speed_m_per_s: Some(self.predicted.speed_m_per_s),
            data_end_m: Some(self.predicted.data_end_m()),
            ..ForceCurve::bare(self.loading.clone()).unloading_with(self.stiffness_n_per_m())
        }
    }

    /// Mass of the other body of a pair, in kg; `None` against a wall.
    pub fn other_mass_kg(&self) -> Option<f64> {
        self.predicted.other_mass_kg()
    }

    /// Mass that moves along the deflection, in kg: the reduced one of a pair.
    pub(crate) fn effective_mass_kg(&self) -> f64 {
        let mass = self.predicted.mass_kg;
        self.other_mass_kg().map_or(mass, |other| mass * other / (mass + other))
    }

    /// Separation speed over impact speed, as the target unloads from the maximum crush.
    pub(crate) fn restitution(&self, unloading: TargetUnloading) -> f64 {
        let stop_m = self.stop_m(&self.loading);
        let stored_j = match unloading {
            TargetUnloading::Line(stiffness) => {
                0.5 * self.loading.force_at(stop_m).powi(2) / stiffness
            }
            TargetUnloading::Elastic => self.loading.work_to(stop_m),
        };
        self.restitution_of(stored_j)
    }

    /// The law of crumple's own runs: it unloads with its stiffness. Beyond the last point the force
    /// continues rising if it bottoms, else it is held.
    pub fn law(&self) -> ForceLaw {
        let end = match self.tail {
            Tail::Bottom => EnvelopeEnd::Bottom,
            Tail::None | Tail::Hold => EnvelopeEnd::Hold,
        };
        ForceLaw::of_curve(&self.driving(), None, end)
    }

    /// Separation speed over impact speed in crumple's own runs, whose curve is not softened.
    pub fn own_restitution(&self) -> f64 {
        let own = self.predicted.envelope().map(ForceCurve::bare);
        let own = own.map(|curve| curve.unloading_with(self.stiffness_n_per_m()));
        let curve = own.unwrap_or_else(|_| self.driving());
        let stop_m = self.stop_m(&curve.loading);
        let law = ForceLaw::of_curve(&curve, None, EnvelopeEnd::Hold);
        self.restitution_of(law.energies_j(stop_m, stop_m).0)
    }

    /// The same in words; a recorded case runs on its own unloading branch, which no export has.
    pub(crate) fn own_restitution_text(&self, wording: &str) -> String {
        let (own, of) = (self.own_restitution(), &self.predicted);
        let recorded = of.rebound.filter(|_| of.model == RECORDED);
        match recorded.map(|rebound| rebound.speed_m_per_s / of.speed_m_per_s) {
            Some(case) if (case - own).abs() >= 0.0005 => {
                format!(
                    "{own:.3} {wording} crumple's own runs of this curve, {case:.3} in those of the case"
                )
            }
            _ => format!("{own:.3} {wording} crumple's own runs"),
        }
    }

    /// Where a curve has taken up the energy of its own impact, in m: at its maximum crush at the latest.
    fn stop_m(&self, curve: &Envelope) -> f64 {
        let kinetic_j = self.predicted.provenance.kinetic_energy_j;
        curve
            .deflection_for_work(kinetic_j)
            .map_or(self.max_crush_m(), |d| d.min(self.max_crush_m()))
    }

    /// Separation speed over impact speed, from the energy in J that is returned.
    fn restitution_of(&self, stored_j: f64) -> f64 {
        (2.0 * stored_j / self.effective_mass_kg()).sqrt() / self.predicted.speed_m_per_s
    }

    /// The target's restitution compared with ours, in one line.
    pub(crate) fn restitution_note(&self, target: &str, unloading: TargetUnloading) -> String {
        let ours = self.own_restitution_text("in");
        let theirs = self.restitution(unloading);
        let how = match unloading {
            TargetUnloading::Elastic => "it has no memory: all energy comes back".into(),
            TargetUnloading::Line(k) => format!("it unloads with {}", Shown::one_stiffness(k)),
        };
        format!("{}: restitution {theirs:.3} in {target} ({how}), {ours}", self.headline())
    }

    /// Notes for a target that unloads with the steepest rise if that is more than the
    /// curve's own stiffness.
    pub(crate) fn steepest_notes(&self, target: &str, other: &str) -> Vec<String> {
        let (own, steepest) = (self.stiffness_n_per_m(), self.loading.max_slope());
        let unloading = TargetUnloading::Line(own.max(steepest));
        let mut notes = vec![self.restitution_note(target, unloading)];
        if steepest > own * 1.01 {
            let own_curve = self.predicted.envelope();
            let is_softened = own_curve.is_ok_and(|curve| {
                matches!(softened(&curve, own, curve.deflection_m().len() - 1), Softened::Curve(_))
            });
            let soften = "--soften makes the steep rise less steep at equal energy";
            let ways = [is_softened.then_some(soften), (!other.is_empty()).then_some(other)];
            let ways: Vec<&str> = ways.into_iter().flatten().collect();
            notes.push(format!(
                "{target} unloads with the steepest rise, {}, which is more than the curve's own {}{}{}",
                Shown::one_stiffness(steepest),
                Shown::one_stiffness(own),
                if ways.is_empty() { "" } else { ": " },
                ways.join(", ")
            ));
        }
        notes
    }

    /// What a deck of the curve moves, for titles.
    pub(crate) fn bodies(&self) -> &'static str {
        if self.other_mass_kg().is_some() { "two masses" } else { "one mass" }
    }

    /// Description of the curve in one line, for headers and titles.
    pub(crate) fn headline(&self) -> String {
        let group = self.predicted.provenance.group.replace(char::is_control, " ");
        let run = own_name(&self.predicted).map_or(String::new(), |name| format!(", {name}"));
        format!(
            "{group} {} ({}){}",
            km_per_h(self.predicted.speed_m_per_s),
            self.predicted.speed_kind.name(),
            run.replace(char::is_control, " ")
        )
    }

    /// Group and speed as a file's name without its extension.
    pub fn file_stem(&self) -> String {
        let name = file_stem(&self.predicted);
        if self.ordinal > 1 { format!("{name}-{}", self.ordinal) } else { name }
    }

    /// Group and speed as an identifier of letters, digits and underscores.
    pub(crate) fn identifier(&self) -> String {
        identifier(&self.file_stem())
    }

    /// [`facts`](Self::facts) for tools whose springs are positive in elongation.
    pub(crate) fn facts_by_elongation(&self) -> Vec<(&'static str, String)> {
        let mut facts = self.facts();
        if let Some((_, sign)) = facts.iter_mut().find(|(key, _)| *key == "sign") {
            *sign = "elongation positive, so a crush has a negative deflection and force".into();
        }
        facts
    }

    /// The masses of its impact, and the values of the model's or the run's further parameters.
    pub(crate) fn conditions(&self) -> Vec<(&'static str, String)> {
        let curve = &self.predicted;
        let mut facts = vec![("mass_kg", curve.mass_kg.to_string())];
        facts.extend(self.other_mass_kg().map(|other| ("other_mass_kg", other.to_string())));
        let others = curve.provenance.parameters.iter();
        let others = others.filter(|(name, _)| *name != MASS && *name != OTHER_MASS);
        let others: Vec<String> = others.map(|(name, value)| format!("{name} = {value}")).collect();
        if !others.is_empty() {
            facts.push(("parameters", others.join(", ").replace(char::is_control, " ")));
        }
        facts
    }

    /// Description of a curve and its use, as keys and values of a file's header; SI.
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let curve = &self.predicted;
        let kind = curve.provenance.force_kind;
        let steepest = self.loading.max_slope();
        let is_far = self.max_crush_m() > FULLY_CRUSHED * curve.data_end_m();
        let tail = match self.tail {
            Tail::Bottom if is_far => {
                "from max_deflection_m on, which is beyond 1.5 times data_end_m, the force rises with the unloading stiffness; runs of crumple let it rise from 1.5 times data_end_m on"
            }
            tail => tail.rule(self.follows_faster_runs),
        };
        let mut facts = vec![
            ("curve", self.headline()),
            ("force_kind", kind.name().into()),
            ("drives", kind.drives().into()),
            ("sign", "deflection and force positive in compression".into()),
            ("speed_m_per_s", curve.speed_m_per_s.to_string()),
            ("speed_kind", curve.speed_kind.name().into()),
            ("impact", self.impact()),
            ("energy_J", nine_digits(curve.energy_j)),
            ("max_deflection_m", nine_digits(self.max_crush_m())),
            ("tail", tail.into()),
            ("unloading_stiffness_N_per_m", nine_digits(self.stiffness_n_per_m())),
            ("unloading", self.unloading(steepest)),
            ("steepest_rise_N_per_m", nine_digits(steepest)),
            ("model", curve.model.clone()),
            ("training_hash", curve.provenance.training_hash.clone()),
            ("written_by", curve.provenance.written_by.clone()),
        ];
        facts.splice(6..6, self.conditions());
        if curve.data_end_m() != curve.max_deflection_m {
            facts.push(("data_end_m", nine_digits(curve.data_end_m())));
        }
        if self.is_of_motion {
            facts.push((
                "filter",
                "none beyond the recipe's, so that a body moves as in the run; body_force_N in the database is filtered, and its peaks are lower".into(),
            ));
        }
        facts.extend(self.changes.iter().map(|change| ("changed", change.clone())));
        if let Some(case) = &curve.provenance.case {
            facts.insert(1, ("case", case.replace(char::is_control, " ")));
        }
        facts.extend(curve.warnings.iter().flat_map(|warning| in_lines(&warning.message)));
        facts
    }

    /// Effect of the unloading stiffness.
    fn unloading(&self, steepest_n_per_m: f64) -> String {
        if self.predicted.rebound.is_none() {
            return "no run shows the rebound: at least the steepest rise, so as to generate no energy".into();
        }
        let (stop_m, max_crush_m) = (self.stop_m(&self.loading), self.max_crush_m());
        // A force that does more work than the body has energy, as a contact force does, stops one mass sooner.
        let from = match stop_m < 0.99 * max_crush_m {
            true => format!("{stop_m:.3} m, where it has stopped a single-mass body,"),
            false => "the maximum crush".into(),
        };
        let softer = self.stiffness_n_per_m() < steepest_n_per_m * (1.0 - 1e-9);
        let creates = "; from a point of the steepest rise it would generate energy";
        let creates = if softer { creates } else { "" };
        format!("along this stiffness from {from} it gives the rebound{creates}")
    }

    /// Kind of impact.
    fn impact(&self) -> String {
        match self.other_mass_kg() {
            None => "one body of this mass against a rigid wall".into(),
            Some(other) if other == self.predicted.mass_kg => {
                "two bodies of this mass each; the speed is their closing speed".into()
            }
            Some(other) => {
                format!(
                    "two bodies, of this mass and of {other} kg; the speed is their closing speed"
                )
            }
        }
    }
}

/// Group and speed of a curve as a file's name without its extension.
pub(super) fn file_stem(curve: &PredictedCurve) -> String {
    let name = own_name(curve).map_or_else(|| speed_name(curve), Into::into);
    stem_of(&curve.provenance.group, &name)
}

/// Maximum length of a file's name without its extension: file systems take 255 bytes, Radioss names a run by it.
const LONGEST_STEM: usize = 80;

/// Group and name as a file's name without its extension. Of long ones the group's end is left out first; names that get equal
/// by that are numbered.
pub(super) fn stem_of(group: &str, name: &str) -> String {
    let room = LONGEST_STEM - 1;
    let name_room = (room / 2).max(room.saturating_sub(group.chars().count()));
    let name: String = name.chars().map(plain).take(name_room).collect();
    let group: String = group.chars().map(plain).take(room - name.len()).collect();
    format!("{group}-{name}")
}

/// The speed as runs are named by it: `48kmh`.
fn speed_name(curve: &PredictedCurve) -> String {
    km_per_h(curve.speed_m_per_s).replace([' ', '/'], "")
}

/// The name of a recorded case if it distinguishes one of several runs at a speed.
fn own_name(curve: &PredictedCurve) -> Option<&str> {
    curve.provenance.case.as_deref().filter(|name| *name != speed_name(curve))
}

/// Maximum number of characters of a line of a header.
const LINE: usize = 180;

/// A warning as lines of a header, which some tools read only up to a certain width.
pub(super) fn in_lines(warning: &str) -> Vec<(&'static str, String)> {
    let mut lines = vec![String::new()];
    for word in warning.split(|c: char| c.is_control() || c == ' ').filter(|w| !w.is_empty()) {
        let last = lines.len() - 1;
        let line = &mut lines[last];
        if !line.is_empty() && line.len() + 1 + word.len() > LINE {
            lines.push(word.into());
        } else {
            *line += if line.is_empty() { "" } else { " " };
            *line += word;
        }
    }
    lines.into_iter().map(|line| ("warning", line)).collect()
}

/// A name as an identifier of letters, digits and underscores that begins with a letter.
pub(super) fn identifier(name: &str) -> String {
    let text: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if text.starts_with(|c: char| c.is_ascii_alphabetic()) { text } else { format!("curve_{text}") }
}

/// A character that every file system accepts in a name.
pub(super) fn plain(c: char) -> char {
    if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }
}

impl Options {
    /// The curves prepared for a target whose own tail is `usual`.
    pub(super) fn ready(
        &self,
        inputs: &[PredictedCurve],
        usual: Tail,
    ) -> Result<Vec<ExportCurve>, Error> {
        let tail = self.tail.unwrap_or(usual);
        let mut curves: Vec<ExportCurve> = Vec::new();
        for input in inputs {
            let mut curve = ExportCurve::new(input, self.force, tail, self.soften)?;
            // As file systems without upper and lower case and languages with identifiers distinguish them.
            let name = |of: &PredictedCurve| identifier(&file_stem(of)).to_lowercase();
            let own = name(&curve.predicted);
            let same = curves.iter().filter(|c| name(&c.predicted) == own);
            curve.ordinal = 1 + same.count();
            curves.push(curve);
        }
        Ok(curves)
    }
}
