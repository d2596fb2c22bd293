//! Speeds of a train's vehicles: FE's run beside the methods.

use crate::assess::train::TrainComparison;
use crate::plot::{Axis, Chart, Panel, Series, Shown};

/// Methods that are parts of another; they stand in the table, and more lines than looks would be
/// told apart by nothing.
const ON_THE_WAY: [&str; 2] = ["rate_only", "rate_live"];

/// A panel for each vehicle, with FE's speed and that of every method, but for those that are parts
/// of `split_ends`.
pub fn train_speeds(title: &str, comparison: &TrainComparison) -> Chart {
    let speeds =
        comparison.fe.values().chain(comparison.rows.iter().flat_map(|r| r.velocities.values()));
    let (low, high) = speeds
        .flatten()
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let room = 0.05 * (high - low);
    let panels = comparison.fe.iter().map(|(vehicle, fe)| {
        // One span for all, so that vehicles can be compared.
        let y = Axis::new("speed", "m/s", 1.0).over(low - room, high + room);
        let mut panel = Panel::new(Axis::new("time", "ms", 1e3), y);
        panel.title = vehicle.clone();
        let time_s = &comparison.time_s;
        panel.series.push(Series::line("FE", 3, time_s.clone(), fe.clone()).shown(Shown::Emphasis));
        // The look of FE is left out of those of the methods.
        let looks = [1, 0, 2, 4, 5, 6, 7].into_iter().cycle();
        let rows = comparison.rows.iter().filter(|row| !ON_THE_WAY.contains(&row.method.as_str()));
        for (row, look) in rows.zip(looks) {
            if let Some(speeds) = row.velocities.get(vehicle) {
                panel.series.push(Series::line(&row.method, look, time_s.clone(), speeds.clone()));
            }
        }
        panel
    });
    Chart::row(title, panels.collect())
}
