//! Draws the picture of the README: the FE curves of the bundled runs, and the predicted
//! curve with its band at a speed between them, as SVG on standard output.
//!
//!     cargo run --example picture > examples/picture.svg

use std::error::Error;
use std::path::Path;

use crumple::assess::Purpose;
use crumple::assess::{Choice, train};
use crumple::build::build;
use crumple::charts;
use crumple::curve::ForceKind;
use crumple::surrogate::{Query, predict};

const GROUP: &str = "lead-car-wall";
const SPEED_M_PER_S: f64 = 50.0 / 3.6;
/// Looks of the runs, without that of predictions.
const LOOKS: [usize; 7] = [5, 6, 4, 2, 0, 3, 8];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe").join(GROUP);
    let report = build(&study.join("study.toml"), &folder.path().join("curves.h5"), |_| {})?;
    let cases = report.database.cases(GROUP);
    let model =
        train(GROUP, cases, Choice::Auto { purpose: Purpose::Vehicle, seed: 0, trees: None })?;
    let curve = predict(&model, &Query::at(SPEED_M_PER_S))?.of_force(ForceKind::Contact)?;

    let mut chart = charts::group_curves(GROUP, cases, ForceKind::Contact);
    let panel = &mut chart.panels[0];
    for (series, look) in panel.series.iter_mut().zip(LOOKS) {
        series.look = look;
    }
    let prediction = charts::prediction(&curve, &[]).panels.remove(0);
    panel.bands.extend(prediction.bands);
    panel.series.extend(prediction.series);
    chart.title =
        "A lead car against a wall: FE at seven speeds, and the curve predicted at 50 km/h".into();
    print!("{}", chart.drawing().svg());
    Ok(())
}
