//! Lines for a picture: cut at the area of a panel, and fewer points that look the same.

type Point = (f64, f64);

/// How far the thinned line may lie from the whole one, in pixels.
const TOLERANCE: f64 = 0.15;
/// Points of one column of this width become four at the most, in pixels.
const COLUMN: f64 = 0.25;

/// The line through fewer of its points.
pub(super) fn thinned(points: &[Point]) -> Vec<Point> {
    kept(points).into_iter().map(|i| points[i]).collect()
}

/// Which points the thinned line goes through, rising.
pub(super) fn kept(points: &[Point]) -> Vec<usize> {
    simplified(points, &columns(points))
}

/// Of points one after the other in a narrow column: the first, lowest, highest and last. It bounds the number of
/// points by the size of the picture wherever a line runs to one side.
fn columns(points: &[Point]) -> Vec<usize> {
    let column = |i: &usize| (points[*i].0 / COLUMN).floor();
    let all: Vec<usize> = (0..points.len()).collect();
    let mut kept = Vec::new();
    for run in all.chunk_by(|a, b| column(a) == column(b)) {
        let order = |a: &&usize, b: &&usize| points[**a].1.total_cmp(&points[**b].1);
        let mut ordinals = vec![run[0], run[run.len() - 1]];
        ordinals.extend(run.iter().min_by(order));
        ordinals.extend(run.iter().max_by(order));
        ordinals.sort_unstable();
        ordinals.dedup();
        kept.extend(ordinals);
    }
    kept
}

/// Points that lie near the line through the others are left out (Douglas and Peucker, Cartographica 10, 1973).
fn simplified(points: &[Point], ordinals: &[usize]) -> Vec<usize> {
    if ordinals.len() < 3 {
        return ordinals.to_vec();
    }
    let mut is_kept = vec![false; ordinals.len()];
    (is_kept[0], is_kept[ordinals.len() - 1]) = (true, true);
    let mut open = vec![(0, ordinals.len() - 1)];
    while let Some((from, to)) = open.pop() {
        let (worst, at) = farthest(points, ordinals, from, to);
        if worst > TOLERANCE {
            is_kept[at] = true;
            open.extend([(from, at), (at, to)]);
        }
    }
    ordinals.iter().zip(is_kept).filter(|(_, kept)| *kept).map(|(i, _)| *i).collect()
}

/// The point between two that lies farthest from the segment through them.
fn farthest(points: &[Point], ordinals: &[usize], from: usize, to: usize) -> (f64, usize) {
    let (a, b) = (points[ordinals[from]], points[ordinals[to]]);
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let square = dx * dx + dy * dy;
    let mut worst = (0.0, from);
    for (k, i) in ordinals.iter().enumerate().take(to).skip(from + 1) {
        let p = points[*i];
        let (px, py) = (p.0 - a.0, p.1 - a.1);
        let t = if square > 0.0 { ((px * dx + py * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
        let (ex, ey) = (px - t * dx, py - t * dy);
        let off = (ex * ex + ey * ey).sqrt();
        if off > worst.0 {
            worst = (off, k);
        }
    }
    worst
}

/// The parts of a line within `[left, top, right, bottom]`. Points that are not finite end a part.
pub(super) fn clipped_line(points: &[Point], area: [f64; 4]) -> Vec<Vec<Point>> {
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

    #[test]
    fn a_thinned_line_stays_near() {
        let wave: Vec<Point> = (0..100_000)
            .map(|i| (f64::from(i) * 0.006, 100.0 + 50.0 * f64::from(i % 977) / 977.0))
            .collect();
        let thin = thinned(&wave);
        assert!(thin.len() < 1_000, "{}", thin.len());
        let tops = |points: &[Point]| points.iter().filter(|p| p.1 > 149.9).count();
        assert!(tops(&thin) >= 100, "the teeth are still there: {}", tops(&thin));
        assert_eq!((thin[0], thin[thin.len() - 1]), (wave[0], wave[wave.len() - 1]));
        let straight: Vec<Point> = (0..100).map(|i| (f64::from(i), f64::from(i))).collect();
        assert_eq!(thinned(&straight), [(0.0, 0.0), (99.0, 99.0)]);
        assert_eq!(thinned(&[]), []);
    }
}

#[cfg(test)]
mod clip_tests {
    use super::*;

    const AREA: [f64; 4] = [0.0, 0.0, 10.0, 10.0];

    #[test]
    fn lines_end_at_the_area() {
        let through = clipped_line(&[(-5.0, 5.0), (15.0, 5.0)], AREA);
        assert_eq!(through, [[(0.0, 5.0), (10.0, 5.0)]]);
        // Out and in again: two parts.
        let parts = clipped_line(&[(5.0, 5.0), (5.0, 20.0), (6.0, 20.0), (6.0, 5.0)], AREA);
        assert_eq!(parts, [[(5.0, 5.0), (5.0, 10.0)], [(6.0, 10.0), (6.0, 5.0)]]);
        assert!(clipped_line(&[(-1.0, 2.0), (-1.0, 8.0)], AREA).is_empty());
        let gap =
            clipped_line(&[(1.0, 1.0), (2.0, 2.0), (f64::NAN, 3.0), (4.0, 4.0), (5.0, 5.0)], AREA);
        assert_eq!(gap.len(), 2);
    }

    #[test]
    fn bands_end_at_the_area() {
        let kept = band(&[(-10.0, 0.0, 2.0), (10.0, 20.0, 2.0), (20.0, 5.0, 2.0)], AREA);
        assert_eq!(kept, [(0.0, 10.0, 2.0), (10.0, 10.0, 2.0)]);
    }
}
