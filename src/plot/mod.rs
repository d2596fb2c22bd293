//! Charts: axes, series, bands and a legend, as SVG and PNG of one drawing.
//!
//! A [`Chart`] defines the content. [`Chart::drawing`] lays it out: every line, and every text with the size that its
//! font gives it. Both writers only output that drawing, so both pictures show the same. The font is part of the
//! program; system fonts and platform functions are not used, so the bytes are the same everywhere.
//!
//! ```
//! use crumple::plot::{Axis, Chart, Panel, Series};
//!
//! let mut panel = Panel::new(Axis::new("deflection", "m", 1.0), Axis::new("force", "MN", 1e-6));
//! panel.series.push(Series::line("FE at 36 km/h", 0, vec![0.0, 0.1, 0.2], vec![0.0, 3.1e6, 1.2e6]));
//! let drawing = Chart::of("Lead car against a wall", panel).drawing();
//! assert!(drawing.svg().starts_with("<svg"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod chart;
mod font;
mod layout;
mod style;
mod svg;
mod thin;

pub(crate) use chart::PanelPlace;
pub use chart::{Axis, Band, Cell, Chart, Drawing, Mark, Panel, Series, Shown};
pub(crate) use style::looks_for_pages;
pub(crate) use svg::SvgFor;
