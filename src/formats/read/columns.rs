//! Columns as a file holds them, and the curve made of them: one sign, one direction, without
//! the points that other tools need.

use super::MIN_POINTS;
use super::curve::{Facts, ReadCurve, ReadFile};
use super::error::{ContentError, Place};
use crate::unit::UnitSystem;

/// Most points of a curve: guards memory. Test records have some ten thousand.
pub(super) const MAX_POINTS: usize = 1_000_000;

/// Most curves of a file: guards memory, which a curve takes even without points.
pub(super) const MAX_CURVES: usize = 10_000;

/// Refuses one curve more than a file may have.
pub(super) fn check_curves(curves: usize) -> Result<(), ContentError> {
    match curves > MAX_CURVES {
        true => Err(ContentError::TooManyCurves { most: MAX_CURVES }),
        false => Ok(()),
    }
}

/// Deflections and forces below this share of the largest are zero.
const NOTHING: f64 = 1e-9;
/// Distances of two guard points that agree this well are one.
const SAME_DISTANCE: f64 = 1e-6;

/// Columns in SI, in the order and with the signs of the file.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub deflection_m: Vec<f64>,
    pub force_n: Vec<f64>,
    pub time_s: Option<Vec<f64>>,
    /// Where each point stands, for messages.
    pub places: Places,
    pub facts: Facts,
    pub title: Option<String>,
    pub units: Option<UnitSystem>,
    pub notes: Vec<String>,
    /// Files that were read beside the one that was given.
    pub files: Vec<ReadFile>,
}

/// Where the points of a curve stand.
#[derive(Clone, Debug)]
pub(super) enum Places {
    /// In these lines.
    Lines(Vec<u64>),
    /// In the rows of a matrix.
    Rows,
}

impl Places {
    fn of(&self, point: usize) -> Place {
        match self {
            Self::Lines(lines) => {
                lines.get(point).map_or(Place::Row(point + 1), |l| Place::Line(*l))
            }
            Self::Rows => Place::Row(point + 1),
        }
    }
}

impl Columns {
    /// No points yet.
    pub fn at(places: Places) -> Self {
        Self {
            deflection_m: Vec::new(),
            force_n: Vec::new(),
            time_s: None,
            places,
            facts: Facts::default(),
            title: None,
            units: None,
            notes: Vec::new(),
            files: Vec::new(),
        }
    }

    /// The curve of these columns. A record over time keeps its signs, which its motion tells.
    ///
    /// # Errors
    /// [`ContentError`] names the first point that does not fit.
    pub fn curve(mut self) -> Result<ReadCurve, ContentError> {
        let points = self.force_n.len();
        if points < MIN_POINTS {
            return Err(ContentError::TooFew { points, of: "", least: MIN_POINTS });
        }
        self.check_finite()?;
        if self.time_s.is_none() {
            let mut points = Points::of(&self)?;
            let crush_m = self.facts.max_deflection_m;
            let table = points.loading_then_unloading(crush_m, &mut self.notes)?;
            (self.deflection_m, self.force_n) = table.iter().map(|p| (p.d, p.f)).unzip();
        }
        Ok(ReadCurve {
            deflection_m: self.deflection_m,
            force_n: self.force_n,
            time_s: self.time_s,
            body_force_n: None,
            facts: self.facts,
            title: self.title,
            units: self.units,
            notes: self.notes,
            files: self.files,
        })
    }

    fn check_finite(&self) -> Result<(), ContentError> {
        let columns = [
            ("deflection", Some(&self.deflection_m)),
            ("force", Some(&self.force_n)),
            ("time", self.time_s.as_ref()),
        ];
        for (what, values) in columns {
            let Some(values) = values else { continue };
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let place = self.places.of(i);
                return Err(ContentError::NotFinite { place, what, value: values[i] });
            }
            if what != "time" && values.iter().all(|v| *v == 0.0) {
                return Err(ContentError::Nothing { what });
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
    /// Largest deflection and force, without signs.
    most: (f64, f64),
}

/// Of values, the one that is largest without its sign.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a })
}

impl Points {
    fn of(columns: &Columns) -> Result<Self, ContentError> {
        let most = (
            largest(columns.deflection_m.iter().copied()).abs(),
            largest(columns.force_n.iter().copied()).abs(),
        );
        let pairs = columns.deflection_m.iter().zip(&columns.force_n).enumerate();
        let list = pairs.map(|(i, (&d, &f))| Point { d, f, place: columns.places.of(i) }).collect();
        Ok(Self { list, most })
    }

    /// The loading branch from (0, 0), then the unloading branch if there is one.
    /// `crush_m`: the largest crush, if the file says it.
    fn loading_then_unloading(
        &mut self,
        crush_m: Option<f64>,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Point>, ContentError> {
        self.turn(notes);
        self.check_sides()?;
        self.put_in_order(notes);
        self.remove_guards(notes);
        self.remove_repeated(notes);
        self.remove_tail(crush_m, notes);
        let points = self.list.len();
        if points < MIN_POINTS {
            let of = " without those of guard and repetition";
            return Err(ContentError::TooFew { points, of, least: MIN_POINTS });
        }
        self.check_order()?;
        if self.list[0].d > 0.0 {
            let (d, place) = (self.list[0].d, self.list[0].place.clone());
            notes.push(format!("points: the curve begins at {d} m, a point (0, 0) is put before"));
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
        match (side < 0.0, push < 0.0) {
            (true, true) => {
                notes.push("sign: the curve lies in the third quadrant; deflection and force are turned, positive in compression".into());
            }
            (true, false) => {
                notes.push("sign: the deflection is turned, positive in compression".into());
            }
            (false, true) => {
                notes.push("sign: the force is turned, positive in compression".into())
            }
            (false, false) => return,
        }
        for point in &mut self.list {
            // A negative zero would only puzzle readers.
            point.d = point.d * side + 0.0;
            point.f = point.f * push + 0.0;
        }
    }

    /// Refuses pull, and forces beyond zero deflection.
    fn check_sides(&mut self) -> Result<(), ContentError> {
        let (most_d, most_f) = self.most;
        for point in &mut self.list {
            let place = || point.place.clone();
            if point.d.abs() <= NOTHING * most_d {
                point.d = 0.0;
            }
            if point.d < 0.0 && point.f.abs() > NOTHING * most_f {
                let (deflection_m, force_n) = (point.d, point.f);
                return Err(ContentError::BothSides { place: place(), deflection_m, force_n });
            }
            if point.f < -NOTHING * most_f {
                return Err(ContentError::PullsAt { place: place(), force_n: point.f });
            }
            point.f = point.f.max(0.0);
        }
        Ok(())
    }

    /// A table that falls from its largest deflection is a loading branch from behind.
    fn put_in_order(&mut self, notes: &mut Vec<String>) {
        if self.list.windows(2).all(|w| w[1].d <= w[0].d) {
            self.list.reverse();
            notes.push(
                "points: in reverse order, from the largest deflection to the smallest".into(),
            );
        }
    }

    /// Removes what tools that extrapolate are given: points below zero deflection, and the last
    /// force once more, as far behind the end as the first lies before the beginning.
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
                "points: the last, at {} m, repeats the force before and is removed (guard point)",
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
            notes.push(format!("points: {removed} that repeat the one before removed"));
        }
    }

    /// Removes the points beyond the largest crush, which our exports add for other tools.
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
            "points: {removed} beyond the maximal crush of {crush_m} m, which the file states, removed"
        ));
        if last.d < crush_m * (1.0 - SAME_DISTANCE) {
            let f = last.f + (next.f - last.f) * (crush_m - last.d) / (next.d - last.d);
            self.list.insert(first, Point { d: crush_m, f, place: next.place });
            notes.push("points: one put at the maximal crush, between its neighbours".into());
        }
    }

    /// Up to the largest deflection it must increase, behind it decrease.
    fn check_order(&self) -> Result<(), ContentError> {
        let d: Vec<f64> = self.list.iter().map(|p| p.d).collect();
        let end = (1..d.len()).fold(0, |best, i| if d[i] > d[best] { i } else { best });
        for i in 1..d.len() {
            let (fits, way) = match i <= end {
                true => (d[i] > d[i - 1], "increase up to the largest"),
                false => (d[i] < d[i - 1], "decrease behind the largest"),
            };
            if !fits {
                return Err(ContentError::Order {
                    place: self.list[i].place.clone(),
                    way,
                    deflection_m: d[i],
                    before_m: d[i - 1],
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points and notes of a table, or its error.
    fn tidied(points: &[(f64, f64)]) -> Result<(Vec<(f64, f64)>, usize), String> {
        let mut columns = Columns::at(Places::Lines((1..=points.len() as u64).collect()));
        (columns.deflection_m, columns.force_n) = points.iter().copied().unzip();
        let curve = columns.curve().map_err(|e| e.to_string())?;
        let points = curve.deflection_m.into_iter().zip(curve.force_n).collect();
        Ok((points, curve.notes.len()))
    }

    #[test]
    fn every_change_is_one_that_a_note_says() {
        fn t(points: &[(f64, f64)], expected: &[(f64, f64)], notes: usize) {
            assert_eq!(tidied(points).unwrap(), (expected.to_vec(), notes), "{points:?}");
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
        // A plateau is no guard point.
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
            let mut columns = Columns::at(Places::Rows);
            (columns.deflection_m, columns.force_n) = points.iter().copied().unzip();
            columns.facts.max_deflection_m = Some(crush_m);
            let curve = columns.curve().unwrap();
            let last = (curve.deflection_m.last(), curve.force_n.last());
            assert_eq!(last, (Some(&end.0), Some(&end.1)));
            assert!(curve.notes[0].starts_with("points: 2 beyond the maximal crush"));
        }
    }

    #[test]
    fn what_is_no_curve_is_refused_with_its_line() {
        fn t(points: &[(f64, f64)], expected: &str) {
            let error = tidied(points).unwrap_err();
            assert!(error.contains(expected), "{points:?}: {error}");
        }
        let plain = [(0.0, 0.0), (1.0, 5.0), (2.0, 3.0), (3.0, 3.0)];
        t(&plain[..3], "the curve has 3 points: expected at least 4");
        t(&[(0.0, 0.0), (0.0, 0.0), (1.0, 5.0), (2.0, 3.0)], "expected at least 4");
        t(&[(0.0, f64::NAN), (1.0, 5.0), (2.0, 3.0), (3.0, 3.0)], "line 1: the force is NaN");
        t(&plain.map(|(d, _)| (d, 0.0)), "the force is 0 in every point");
        t(&plain.map(|(_, f)| (0.0, f)), "the deflection is 0 in every point");
        let step = [&plain[..], &[(3.0, 9.0)]].concat();
        t(&step, "line 5: the deflection must decrease behind the largest, found 3 m after 3 m");
        let wave = [&plain[..], &[(2.5, 1.0), (2.8, 0.0)]].concat();
        t(
            &wave,
            "line 6: the deflection must decrease behind the largest, found 2.8 m after 2.5 m",
        );
        let back = [(0.0, 0.0), (2.0, 5.0), (1.0, 3.0), (3.0, 3.0)];
        t(&back, "line 3: the deflection must increase up to the largest, found 1 m after 2 m");
        t(&[&plain[..], &[(3.5, -1.0)]].concat(), "line 5: the force is -1 N against");
        t(&[&[(-1.0, -4.0)], &plain[..]].concat(), "line 1: the force is -4 N on the other side");
    }
}
