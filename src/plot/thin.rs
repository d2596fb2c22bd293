//! Fewer points through which a line looks the same.

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

/// Of points one behind the other in a narrow column: the first, lowest, highest and last. It bounds the number of
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
