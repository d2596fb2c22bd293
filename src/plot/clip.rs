//! What of a line lies within an area.

type Point = (f64, f64);

/// The parts of a line within `[left, top, right, bottom]`. Points that are not finite end a part.
pub(super) fn line(points: &[Point], area: [f64; 4]) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut last: Option<Point> = None;
    for pair in points.windows(2) {
        let Some((a, b)) = segment(pair[0], pair[1], area) else {
            last = None;
            continue;
        };
        match parts.last_mut() {
            Some(part) if last == Some(a) => part.push(b),
            _ => parts.push(vec![a, b]),
        }
        last = Some(b);
    }
    parts
}

/// The part of a segment within the area (Liang and Barsky, ACM Transactions on Graphics 3, 1984).
fn segment(a: Point, b: Point, [left, top, right, bottom]: [f64; 4]) -> Option<(Point, Point)> {
    if ![a.0, a.1, b.0, b.1].iter().all(|v| v.is_finite()) {
        return None;
    }
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (towards, room) in
        [(-dx, a.0 - left), (dx, right - a.0), (-dy, a.1 - top), (dy, bottom - a.1)]
    {
        if towards == 0.0 {
            if room < 0.0 {
                return None;
            }
            continue;
        }
        let share = room / towards;
        if towards < 0.0 { from = from.max(share) } else { to = to.min(share) }
    }
    let at = |t: f64, end: Point| match t {
        0.0 | 1.0 => end,
        t => (a.0 + t * dx, a.1 + t * dy),
    };
    (from <= to).then(|| (at(from, a), at(to, b)))
}

/// Whether a point lies within the area.
pub(super) fn holds([left, top, right, bottom]: [f64; 4], (x, y): Point) -> bool {
    (left - 1e-9..=right + 1e-9).contains(&x) && (top - 1e-9..=bottom + 1e-9).contains(&y)
}

/// Edges of a band within the area: x between left and right, heights no further than top and bottom.
pub(super) fn band(
    edges: &[(f64, f64, f64)],
    [left, top, right, bottom]: [f64; 4],
) -> Vec<(f64, f64, f64)> {
    let mut kept: Vec<(f64, f64, f64)> = Vec::new();
    let mut keep = |(x, low, high): (f64, f64, f64)| {
        kept.push((x, low.clamp(top, bottom), high.clamp(top, bottom)));
    };
    let is_finite = |e: &(f64, f64, f64)| e.0.is_finite() && e.1.is_finite() && e.2.is_finite();
    let edges: Vec<_> = edges.iter().copied().filter(is_finite).collect();
    for (k, edge) in edges.iter().enumerate() {
        if let Some(before) = k.checked_sub(1).map(|k| edges[k]) {
            for bound in [left, right] {
                if (before.0 - bound) * (edge.0 - bound) < 0.0 {
                    let t = (bound - before.0) / (edge.0 - before.0);
                    keep((
                        bound,
                        before.1 + t * (edge.1 - before.1),
                        before.2 + t * (edge.2 - before.2),
                    ));
                }
            }
        }
        if (left..=right).contains(&edge.0) {
            keep(*edge);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: [f64; 4] = [0.0, 0.0, 10.0, 10.0];

    #[test]
    fn lines_end_at_the_area() {
        let through = line(&[(-5.0, 5.0), (15.0, 5.0)], AREA);
        assert_eq!(through, [[(0.0, 5.0), (10.0, 5.0)]]);
        // Out and in again: two parts.
        let parts = line(&[(5.0, 5.0), (5.0, 20.0), (6.0, 20.0), (6.0, 5.0)], AREA);
        assert_eq!(parts, [[(5.0, 5.0), (5.0, 10.0)], [(6.0, 10.0), (6.0, 5.0)]]);
        assert!(line(&[(-1.0, 2.0), (-1.0, 8.0)], AREA).is_empty());
        let gap = line(&[(1.0, 1.0), (2.0, 2.0), (f64::NAN, 3.0), (4.0, 4.0), (5.0, 5.0)], AREA);
        assert_eq!(gap.len(), 2);
    }

    #[test]
    fn bands_end_at_the_area() {
        let kept = band(&[(-10.0, 0.0, 2.0), (10.0, 20.0, 2.0), (20.0, 5.0, 2.0)], AREA);
        assert_eq!(kept, [(0.0, 10.0, 2.0), (10.0, 10.0, 2.0)]);
    }
}
