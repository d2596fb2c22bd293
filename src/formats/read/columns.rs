//! Columns as a file holds them, and the curve made of them: one sign, one direction, without
//! the points that other tools need.

use crate::error::{Error, error};
use crate::guess;
use std::cmp::Ordering;

use super::MIN_POINTS;
use super::curve::{Place, ReadCurve, shown};
use crate::curve::loading::STEP_WIDTH_SHARE;
use crate::curve::{Envelope, ForceCurve};

/// Maximum number of points of a curve: guards memory. Test records have some ten thousand.
pub(super) const MAX_POINTS: usize = 1_000_000;

/// Maximum number of curves of a file: guards memory, which a curve takes even without points.
pub(super) const MAX_CURVES: usize = 10_000;

/// Refuses one curve more than a file may have.
pub(super) fn check_curves(curves: usize) -> Result<(), Error> {
    if curves > MAX_CURVES {
        let most = MAX_CURVES;
        return Err(error!(
            CurveFile,
            "the file has more than {most} curves: extract the one you need"
        ));
    }
    Ok(())
}

/// Refuses one point more than a curve may have.
pub(super) fn check_points(points: usize) -> Result<(), Error> {
    if points > MAX_POINTS {
        let most = MAX_POINTS;
        return Err(error!(CurveFile, "the curve has more than {most} points: thin it out"));
    }
    Ok(())
}

/// Curves and columns that a message lists.
pub(super) const LISTED: usize = 20;

/// Which of a file's curves was requested by its name, else the only one; each with its name and title.
pub(super) fn choose(
    curves: impl Iterator<Item = (String, String)> + Clone,
    asked: Option<&str>,
) -> Result<usize, Error> {
    let known = || {
        let name = |(name, title): (String, String)| match title.trim() {
            "" => shown(&name),
            title => format!("{} (\"{}\")", shown(&name), shown(title)),
        };
        curves.clone().take(LISTED).map(name).collect::<Vec<_>>().join(", ")
    };
    let is_asked = |(name, _): &(String, String)| asked.is_none_or(|asked| name == asked.trim());
    let mut found = curves.clone().enumerate().filter(|(_, curve)| is_asked(curve));
    match (found.next(), found.count(), asked) {
        (Some((at, _)), 0, _) => Ok(at),
        (None, _, Some(asked)) => Err(no_curve(asked, &known())),
        (_, more, Some(asked)) => Err(error!(
            CurveFile,
            "the file has {count} curves \"{asked}\": leave one of them in it",
            asked = shown(asked),
            count = more + 1
        )),
        (_, _, None) => Err(several_curves(&known())),
    }
}

pub(super) fn no_curve(asked: &str, known: &str) -> Error {
    let asked = shown(asked);
    let hint = guess::hint(&asked, known);
    error!(CurveFile, "the file has no curve \"{asked}\": it has {known}{hint}")
}

pub(super) fn several_curves(known: &str) -> Error {
    error!(CurveFile, "the file holds several curves: choose one with --curve: {known}")
}

/// Deflections and forces below this share of the largest are zero.
const ZERO_SHARE: f64 = 1e-9;
/// Distances of two guard points that agree this well are one.
const SAME_DISTANCE: f64 = 1e-6;

/// Jumps of the force that a note names.
const STEPS: usize = 3;

impl ReadCurve {
    /// The curve that drives an interface, without any change: increasing deflections from 0, forces of 0 or above.
    pub(super) fn as_they_stand(&self) -> Result<ForceCurve, Error> {
        let envelope = Envelope::new(self.deflection_m.clone(), self.force_n.clone())?;
        match envelope.first_pulling_point() {
            Some(point) => Err(error!(
                CurveFile,
                "the force of point {point} is below 0: an interface only pushes, so write compression positive and tension as 0"
            )),
            None => Ok(self.facts.driving(envelope)),
        }
    }

    /// The curve of the columns as they are in the file. A record over time keeps its signs, which follow from its motion.
    pub(super) fn sorted(mut self) -> Result<Self, Error> {
        let points = self.force_n.len();
        if self.is_ready {
            return Ok(self);
        }
        if points < MIN_POINTS {
            return Err(too_few(points, ""));
        }
        self.check_finite()?;
        self.put_times_in_order()?;
        if self.time_s.is_none() {
            let mut points = Points::of(&self);
            let crush_m = self.facts.max_deflection_m;
            let table = points.loading_then_unloading(crush_m, &mut self.notes)?;
            (self.deflection_m, self.force_n) = table.iter().map(|p| (p.d, p.f)).unzip();
        }
        Ok(self)
    }

    /// Reverses a record whose times fall from row to row, and refuses one of which some do.
    fn put_times_in_order(&mut self) -> Result<(), Error> {
        let Some(time_s) = &mut self.time_s else { return Ok(()) };
        if time_s.windows(2).all(|w| w[1] <= w[0]) && time_s.last() < time_s.first() {
            time_s.reverse();
            self.deflection_m.reverse();
            self.force_n.reverse();
            self.lines.reverse();
            self.notes.push("times: they fall from row to row, and the rows are reversed".into());
            return Ok(());
        }
        let Some(i) = time_s.windows(2).position(|w| w[1] < w[0]) else { return Ok(()) };
        // To a nanosecond, since times in milliseconds are not exact in seconds.
        let [before, after] = [i, i + 1].map(|i| (time_s[i] * 1e9).round() / 1e9);
        Err(error!(
            CurveFile,
            "{place}: the time {after} s comes after {before} s: expected times that increase; sort the rows, or remove those that a restart has written again",
            place = self.place(i + 1)
        ))
    }

    fn place(&self, point: usize) -> Place {
        self.lines.get(point).map_or(Place::Row(point + 1), |line| Place::Line(*line))
    }

    fn check_finite(&self) -> Result<(), Error> {
        let columns = [
            ("deflection", Some(&self.deflection_m)),
            ("force", Some(&self.force_n)),
            ("time", self.time_s.as_ref()),
        ];
        for (what, values) in columns {
            let Some(values) = values else { continue };
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let place = self.place(i);
                return Err(error!(
                    CurveFile,
                    "{place}: the {what} is {value}: expected a finite number",
                    value = values[i]
                ));
            }
            if what != "time" && values.iter().all(|v| *v == 0.0) {
                return Err(error!(CurveFile, "the {what} is 0 in every point: expected a curve"));
            }
        }
        Ok(())
    }
}

/// A point of a table without times.
#[derive(Clone, Debug, PartialEq)]
struct Point {
    d: f64,
    f: f64,
    place: Place,
}

/// The points of a table without times; deflection and force have the file's signs at first.
struct Points {
    list: Vec<Point>,
    /// Maximum deflection and force, without signs.
    most: (f64, f64),
}

/// Of values, the one that is largest without its sign.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a })
}

impl Points {
    fn of(columns: &ReadCurve) -> Self {
        let most = |values: &[f64]| largest(values.iter().copied()).abs();
        let most = (most(&columns.deflection_m), most(&columns.force_n));
        let pairs = columns.deflection_m.iter().zip(&columns.force_n).enumerate();
        let list = pairs.map(|(i, (&d, &f))| Point { d, f, place: columns.place(i) }).collect();
        Self { list, most }
    }

    /// The loading branch from (0, 0), then the unloading branch if there is one.
    /// `crush_m`: the maximum crush, if the file states it.
    fn loading_then_unloading(
        &mut self,
        crush_m: Option<f64>,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Point>, Error> {
        self.turn(notes);
        self.check_sides()?;
        self.put_in_order(notes);
        self.remove_guards(notes);
        self.remove_repeated(notes);
        self.remove_tail(crush_m, notes);
        self.set_steps_apart(notes);
        let points = self.list.len();
        if points < MIN_POINTS {
            return Err(too_few(points, " without guard points and repeats"));
        }
        self.check_order()?;
        if self.list[0].d > 0.0 {
            let (d, place) = (self.list[0].d, self.list[0].place.clone());
            notes.push(format!(
                "points: the curve starts at {d} m; a point (0, 0) is added in front"
            ));
            self.list.insert(0, Point { d: 0.0, f: 0.0, place });
        }
        Ok(std::mem::take(&mut self.list))
    }

    /// Makes compression positive: springs of finite elements have it in the third quadrant.
    fn turn(&mut self, notes: &mut Vec<String>) {
        let side = largest(self.list.iter().map(|p| p.d)).signum();
        let on_side = self.list.iter().filter(|p| p.d * side > 0.0);
        let push = on_side.map(|p| p.f).sum::<f64>();
        let push = if push < 0.0 { -1.0 } else { 1.0 };
        let what = match (side < 0.0, push < 0.0) {
            (true, true) => {
                "the curve lies in the third quadrant; deflection and force are reversed"
            }
            (true, false) => "the deflection is reversed",
            (false, true) => "the force is reversed",
            (false, false) => return,
        };
        notes.push(format!("sign: {what}, positive in compression"));
        for point in &mut self.list {
            // A negative zero would only puzzle readers.
            point.d = point.d * side + 0.0;
            point.f = point.f * push + 0.0;
        }
    }

    /// Refuses tension, and forces beyond zero deflection.
    fn check_sides(&mut self) -> Result<(), Error> {
        let (most_d, most_f) = self.most;
        for point in &mut self.list {
            let place = || point.place.clone();
            if point.d.abs() <= ZERO_SHARE * most_d {
                point.d = 0.0;
            }
            if point.d < 0.0 && point.f.abs() > ZERO_SHARE * most_f {
                let (deflection_m, force_n) = (point.d, point.f);
                return Err(error!(
                    CurveFile,
                    "{place}: the force is {force_n} N on the other side of zero deflection ({deflection_m} m): expected one side, compression; remove the points of tension",
                    place = place()
                ));
            }
            if point.f < -ZERO_SHARE * most_f {
                return Err(error!(
                    CurveFile,
                    "{place}: the force is {force_n} N, opposite in sign to the others: an interface only pushes, so write tension as 0",
                    force_n = point.f,
                    place = place()
                ));
            }
            point.f = point.f.max(0.0);
        }
        Ok(())
    }

    /// A table that falls from its maximum deflection is a reversed loading branch.
    fn put_in_order(&mut self, notes: &mut Vec<String>) {
        if self.list.windows(2).all(|w| w[1].d <= w[0].d) {
            self.list.reverse();
            notes.push(
                "points: in reverse order, from the maximum deflection to the smallest".into(),
            );
        }
    }

    /// Removes the guard points for tools that extrapolate: points below zero deflection, and the last
    /// force once more, as far beyond the end as the first lies before the start.
    fn remove_guards(&mut self, notes: &mut Vec<String>) {
        let before = self.list.len();
        let first = self.list.first().map_or(0.0, |p| p.d);
        self.list.retain(|p| p.d >= 0.0);
        let removed = before - self.list.len();
        if removed > 0 {
            notes.push(format!(
                "points: {removed} below zero deflection, with no force, removed (guard points)"
            ));
        }
        if let [.., last, held] = &self.list[..]
            && held.f == last.f
            && held.d > last.d
            && first < 0.0
            && ((held.d - last.d) / -first - 1.0).abs() < SAME_DISTANCE
        {
            notes.push(format!(
                "points: the last, at {} m, repeats the previous force and is removed (guard point)",
                held.d
            ));
            self.list.pop();
        }
    }

    fn remove_repeated(&mut self, notes: &mut Vec<String>) {
        let before = self.list.len();
        self.list.dedup_by(|b, a| a.d == b.d && a.f == b.f);
        let removed = before - self.list.len();
        if removed > 0 {
            notes.push(format!("points: {removed} removed (repeats of the previous one)"));
        }
    }

    /// Removes the points beyond the maximum crush, which our exports add for other tools.
    fn remove_tail(&mut self, crush_m: Option<f64>, notes: &mut Vec<String>) {
        let Some(crush_m) = crush_m else { return };
        // As many digits as exports have.
        let is_beyond = |p: &Point| p.d > crush_m * (1.0 + SAME_DISTANCE);
        let Some(first) = self.list.iter().position(is_beyond).filter(|&i| i > 0) else { return };
        let (last, next) = (self.list[first - 1].clone(), self.list[first].clone());
        let before = self.list.len();
        self.list.retain(|p| !is_beyond(p));
        let removed = before - self.list.len();
        notes.push(format!(
            "points: {removed} removed beyond the maximum crush of {crush_m} m that the file states"
        ));
        if last.d < crush_m * (1.0 - SAME_DISTANCE) {
            let f = last.f + (next.f - last.f) * (crush_m - last.d) / (next.d - last.d);
            self.list.insert(first, Point { d: crush_m, f, place: next.place });
            notes.push("points: one interpolated at the maximum crush".into());
        }
    }

    /// Sets points of one deflection slightly apart: forces that jump there are kept, and the deflection still increases.
    /// Up to the maximum deflection the later ones go forward; where the force has its peak at the maximum
    /// deflection, those after the peak are unloading and go back, as all after it do.
    fn set_steps_apart(&mut self, notes: &mut Vec<String>) {
        let largest_m = self.list.iter().map(|p| p.d).fold(0.0, f64::max);
        let end = self.list.iter().position(|p| p.d == largest_m).unwrap_or(0);
        let mut steps = Vec::new();
        let (mut apart, mut first) = (Vec::with_capacity(self.list.len()), 0);
        while first < self.list.len() {
            let d = self.list[first].d;
            let count = self.list[first..].iter().take_while(|p| p.d == d).count();
            let next = self.list.get(first + count);
            let mut step = outline(&self.list[first..first + count]);
            if step.len() > 1 {
                steps.push((d, step[0].clone(), step[step.len() - 1].f));
                // After the last point there is room, but none below zero.
                let behind = if first > end { d } else { largest_m };
                let room = next.map_or(behind, |next| (next.d - d).abs());
                let hair = (STEP_WIDTH_SHARE * largest_m).min(0.5 * room) / (step.len() - 1) as f64;
                let peak = match first.cmp(&end) {
                    Ordering::Less => step.len() - 1,
                    Ordering::Equal => peak(&step),
                    Ordering::Greater => 0,
                };
                for (k, point) in step.iter_mut().enumerate() {
                    point.d += hair * (peak.min(k) as f64 - k.saturating_sub(peak) as f64);
                }
            }
            apart.append(&mut step);
            first += count;
        }
        self.list = apart;
        notes.extend(steps_note(&steps));
    }

    /// Up to the maximum deflection it must increase, after it decrease.
    fn check_order(&self) -> Result<(), Error> {
        let d: Vec<f64> = self.list.iter().map(|p| p.d).collect();
        let end = (1..d.len()).fold(0, |best, i| if d[i] > d[best] { i } else { best });
        for i in 1..d.len() {
            let (fits, way) = if i <= end {
                (d[i] > d[i - 1], "increase up to the largest")
            } else {
                (d[i] < d[i - 1], "decrease after the largest")
            };
            if !fits {
                return Err(error!(
                    CurveFile,
                    "{place}: the deflection must {way}, found {deflection_m} m after {before_m} m: give the loading branch and at most one unloading branch after it, or a time column",
                    before_m = d[i - 1],
                    deflection_m = d[i],
                    place = self.list[i].place
                ));
            }
        }
        Ok(())
    }
}

pub(super) fn too_few(points: usize, of: &str) -> Error {
    let (points, least) = (crate::words::counted(points, "point"), MIN_POINTS);
    error!(CurveFile, "the curve has {points}{of}: expected at least {least}")
}

/// Of points at one deflection, the first, the last and the extremes between.
fn outline(points: &[Point]) -> Vec<Point> {
    let last = points.len() - 1;
    let by_force = |a: &usize, b: &usize| points[*a].f.total_cmp(&points[*b].f);
    let low = (0..=last).min_by(by_force).unwrap_or(0);
    let high = (0..=last).max_by(by_force).unwrap_or(0);
    let mut kept = vec![0, low.min(high), low.max(high), last];
    kept.dedup();
    kept.into_iter().map(|k| points[k].clone()).collect()
}

/// Where the force of points at one deflection is largest.
fn peak(points: &[Point]) -> usize {
    (1..points.len()).fold(0, |best, k| if points[k].f > points[best].f { k } else { best })
}

/// Changes where the deflection is constant: the first jumps, and how many more.
fn steps_note(steps: &[(f64, Point, f64)]) -> Option<String> {
    let shown = steps.iter().take(STEPS).map(|(d, first, to_n)| {
        let shown_m = (d * 1e6).round() / 1e6;
        format!("from {} to {to_n} N at {shown_m} m ({})", first.f, first.place)
    });
    let shown: Vec<String> = shown.collect();
    let more = match steps.len().saturating_sub(STEPS) {
        0 => String::new(),
        more => format!(" and at {more} more"),
    };
    (!steps.is_empty()).then(|| {
        format!(
            "points: the force jumps {}{more}: the points there are set apart by {STEP_WIDTH_SHARE} of the maximum deflection, at most halfway to the next",
            shown.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points and notes of a table, or its error.
    fn sorted_loading(points: &[(f64, f64)]) -> Result<(Vec<(f64, f64)>, usize), String> {
        let mut columns =
            ReadCurve { lines: (1..=points.len() as u64).collect(), ..ReadCurve::default() };
        (columns.deflection_m, columns.force_n) = points.iter().copied().unzip();
        let curve = columns.sorted().map_err(|e| e.to_string())?;
        let points = curve.deflection_m.into_iter().zip(curve.force_n).collect();
        Ok((points, curve.notes.len()))
    }

    #[test]
    fn every_change_is_one_that_a_note_says() {
        fn t(points: &[(f64, f64)], expected: &[(f64, f64)], notes: usize) {
            assert_eq!(sorted_loading(points).unwrap(), (expected.to_vec(), notes), "{points:?}");
        }
        let plain = [(0.0, 0.0), (1.0, 5.0), (2.0, 3.0), (3.0, 3.0)];
        t(&plain, &plain, 0);
        t(&plain.map(|(d, f)| (-d, -f)), &plain, 1);
        t(&plain.map(|(d, f)| (d, -f)), &plain, 1);
        t(&plain.map(|(d, f)| (-d, f)), &plain, 1);
        let mut behind = plain;
        behind.reverse();
        t(&behind, &plain, 1);
        t(&behind.map(|(d, f)| (-d, -f)), &plain, 2);
        let guarded = [&[(-0.5, 0.0)], &plain[..], &[(3.5, 3.0)]].concat();
        t(&guarded, &plain, 2);
        // A plateau is not a guard point.
        t(&guarded[1..], &guarded[1..], 0);
        t(&[&plain[..1], &plain[..]].concat(), &plain, 1);
        let unloading = [&plain[..], &[(2.9, 1.0), (2.8, 0.0)]].concat();
        t(&unloading, &unloading, 0);
        t(&[&plain[1..], &[(4.0, 2.0)]].concat(), &[&plain[..], &[(4.0, 2.0)]].concat(), 1);
    }

    #[test]
    fn points_beyond_the_stated_crush_are_removed() {
        let points = [(0.0, 0.0), (1.0, 5.0), (2.0, 3.0), (3.0, 3.0), (4.0, 1.0), (6.0, 9.0)];
        for (crush_m, end) in [(3.0, (3.0, 3.0)), (3.5, (3.5, 2.0))] {
            let mut columns = ReadCurve::default();
            (columns.deflection_m, columns.force_n) = points.iter().copied().unzip();
            columns.facts.max_deflection_m = Some(crush_m);
            let curve = columns.sorted().unwrap();
            let last = (curve.deflection_m.last(), curve.force_n.last());
            assert_eq!(last, (Some(&end.0), Some(&end.1)));
            assert!(curve.notes[0].starts_with("points: 2 removed beyond the maximum crush"));
        }
    }

    /// Jumps of the force at one deflection stay, next to each other; the energy hardly changes.
    #[test]
    fn points_of_one_deflection_are_set_apart() {
        fn t(points: &[(f64, f64)], expected: &[(f64, f64)], note: &str) {
            let mut columns =
                ReadCurve { lines: (1..=points.len() as u64).collect(), ..ReadCurve::default() };
            (columns.deflection_m, columns.force_n) = points.iter().copied().unzip();
            let curve = columns.sorted().unwrap();
            let found = curve.deflection_m.iter().zip(&curve.force_n);
            for ((d, f), (de, fe)) in found.zip(expected) {
                assert!((d - de).abs() < 1e-12 && f == fe, "{points:?}: {curve:?}");
            }
            assert_eq!(curve.force_n.len(), expected.len(), "{curve:?}");
            assert!(curve.notes.iter().any(|n| n.contains(note)), "{note}: {:?}", curve.notes);
        }
        let h = 4e-4;
        let drop = [(0.0, 0.0), (1.0, 5.0), (1.0, 2.0), (2.0, 3.0), (4.0, 3.0)];
        let apart = [(0.0, 0.0), (1.0, 5.0), (1.0 + h, 2.0), (2.0, 3.0), (4.0, 3.0)];
        t(
            &drop,
            &apart,
            "the force jumps from 5 to 2 N at 1 m (line 2): the points there are set apart by 0.0001 of the maximum deflection",
        );
        // Of many points, the ends and the extremes; at contact, too.
        let many = [(0.0, 0.0), (0.0, 2.0), (1.0, 5.0), (1.0, 6.0), (1.0, 4.0), (1.0, 1.0)];
        let many = [&many[..], &[(1.0, 2.0), (4.0, 3.0)]].concat();
        let kept = [(0.0, 0.0), (h, 2.0), (1.0, 5.0), (1.0 + h / 3.0, 6.0)];
        let kept = [&kept[..], &[(1.0 + h / 1.5, 1.0), (1.0 + h, 2.0), (4.0, 3.0)]].concat();
        t(&many, &kept, "from 0 to 2 N at 0 m (line 1), from 5 to 2 N at 1 m (line 3)");
        // At most half the way to the next point.
        let close = [(0.0, 0.0), (1.0, 5.0), (1.0, 2.0), (1.0001, 3.0), (4.0, 3.0)];
        let halved = [(0.0, 0.0), (1.0, 5.0), (1.00005, 2.0), (1.0001, 3.0), (4.0, 3.0)];
        t(&close, &halved, "at most halfway to the next");
        // At the end a rise is loading and a fall is unloading.
        let rise = [(0.0, 0.0), (1.0, 5.0), (2.0, 3.0), (4.0, 3.0), (4.0, 9.0)];
        t(&rise, &[&rise[..4], &[(4.0 + h, 9.0)]].concat(), "from 3 to 9 N at 4 m (line 4)");
        let fall = [(0.0, 0.0), (1.0, 5.0), (2.0, 3.0), (4.0, 3.0), (4.0, 0.0), (3.0, 0.0)];
        t(&fall, &[&fall[..4], &[(4.0 - h, 0.0), (3.0, 0.0)]].concat(), "from 3 to 0 N at 4 m");
        let both = [&rise[..], &[(4.0, 0.0), (3.0, 0.0)]].concat();
        let set = [(4.0, 3.0), (4.0 + h / 2.0, 9.0), (4.0, 0.0), (3.0, 0.0)];
        t(&both, &[&rise[..3], &set].concat(), "from 3 to 0 N at 4 m");
        let behind = [&plain_unloading()[..], &[(2.0, 1.0), (2.0, 0.0), (1.0, 0.0)]].concat();
        let set = [(2.0, 1.0), (2.0 - h, 0.0), (1.0, 0.0)];
        t(&behind, &[&plain_unloading()[..], &set].concat(), "from 1 to 0 N at 2 m");
    }

    /// A loading branch and the first point after it.
    fn plain_unloading() -> [(f64, f64); 5] {
        [(0.0, 0.0), (1.0, 5.0), (2.0, 3.0), (4.0, 3.0), (3.0, 2.0)]
    }

    #[test]
    fn what_is_no_curve_is_refused_with_its_line() {
        fn t(points: &[(f64, f64)], expected: &str) {
            let error = sorted_loading(points).unwrap_err();
            assert!(error.contains(expected), "{points:?}: {error}");
        }
        let plain = [(0.0, 0.0), (1.0, 5.0), (2.0, 3.0), (3.0, 3.0)];
        t(&plain[..3], "the curve has 3 points: expected at least 4");
        t(&[(0.0, 0.0), (0.0, 0.0), (1.0, 5.0), (2.0, 3.0)], "expected at least 4");
        t(&[(0.0, f64::NAN), (1.0, 5.0), (2.0, 3.0), (3.0, 3.0)], "line 1: the force is NaN");
        t(&plain.map(|(d, _)| (d, 0.0)), "the force is 0 in every point");
        t(&plain.map(|(_, f)| (0.0, f)), "the deflection is 0 in every point");
        let wave = [&plain[..], &[(2.5, 1.0), (2.8, 0.0)]].concat();
        t(&wave, "line 6: the deflection must decrease after the largest, found 2.8 m after 2.5 m");
        let back = [(0.0, 0.0), (2.0, 5.0), (1.0, 3.0), (3.0, 3.0)];
        t(&back, "line 3: the deflection must increase up to the largest, found 1 m after 2 m");
        t(&[&plain[..], &[(3.5, -1.0)]].concat(), "line 5: the force is -1 N, opposite in sign");
        t(&[&[(-1.0, -4.0)], &plain[..]].concat(), "line 1: the force is -4 N on the other side");
    }
}
