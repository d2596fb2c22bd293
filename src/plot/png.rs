//! A drawing as PNG.

use tiny_skia::{
    Color, FillRule, LineJoin, Paint as Ink, Path, PathBuilder, Pixmap, StrokeDash, Transform,
};

use super::drawing::{Drawing, Paint, Shape, Stroke, Text};
use super::font::{self, Piece};
use super::svg::colour;
use crate::error::{Error, error};

/// Most pixels each way: 400 MB of memory.
const MOST: u32 = 10_000;

impl Drawing {
    /// The drawing with `scale` pixels for each of its own; 2 suits print and dense screens.
    ///
    /// # Errors
    /// For a picture of no or of too many pixels.
    pub fn png(&self, scale: f64) -> Result<Vec<u8>, Error> {
        let (width, height) = ((self.width * scale).ceil(), (self.height * scale).ceil());
        let fits = |side: f64| (1.0..=f64::from(MOST)).contains(&side);
        let size = error!(
            Plot,
            "a picture of {width} by {height} pixels cannot be drawn: expected 1 to {most} each way",
            height = height as u64,
            most = MOST,
            width = width as u64
        );
        if !fits(width) || !fits(height) {
            return Err(size);
        }
        let mut map = Pixmap::new(width as u32, height as u32).ok_or(size)?;
        map.fill(Color::WHITE);
        let whole = Transform::from_scale(scale as f32, scale as f32);
        for shape in &self.shapes {
            match shape {
                Shape::Text(text) => draw_text(&mut map, text, whole),
                Shape::Path { lines, is_closed, stroke, fill, .. } => {
                    let Some(path) = path(lines, *is_closed) else { continue };
                    if let Some((paint, opacity)) = fill {
                        map.fill_path(
                            &path,
                            &ink(*paint, *opacity),
                            FillRule::Winding,
                            whole,
                            None,
                        );
                    }
                    if let Some(stroke) = stroke {
                        map.stroke_path(&path, &ink(stroke.paint, 1.0), &pen(stroke), whole, None);
                    }
                }
            }
        }
        map.encode_png().map_err(|e| error!(Plot, "the picture cannot be encoded: {}", e))
    }
}

fn path(lines: &[Vec<(f64, f64)>], is_closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for line in lines.iter().filter(|line| line.len() > 1) {
        builder.move_to(line[0].0 as f32, line[0].1 as f32);
        line[1..].iter().for_each(|(x, y)| builder.line_to(*x as f32, *y as f32));
        if is_closed {
            builder.close();
        }
    }
    builder.finish()
}

fn ink(paint: Paint, opacity: f64) -> Ink<'static> {
    let hex = colour(paint);
    let part = |k: usize| u8::from_str_radix(&hex[k..k + 2], 16).unwrap_or_default();
    let mut ink = Ink { anti_alias: true, ..Ink::default() };
    ink.set_color_rgba8(part(1), part(3), part(5), (opacity * 255.0).round() as u8);
    ink
}

fn pen(stroke: &Stroke) -> tiny_skia::Stroke {
    let lengths: Vec<f32> = stroke.dash.iter().map(|l| *l as f32).collect();
    tiny_skia::Stroke {
        width: stroke.width as f32,
        line_join: LineJoin::Round,
        dash: StrokeDash::new(lengths, 0.0),
        ..tiny_skia::Stroke::default()
    }
}

fn draw_text(map: &mut Pixmap, text: &Text, whole: Transform) {
    let mut builder = PathBuilder::new();
    for placed in font::place(&text.text).0 {
        let from = placed.x as f64;
        let (px, py) = (|x: f64| (from + x) as f32, |y: f64| y as f32);
        for piece in font::outline(placed.glyph) {
            match piece {
                Piece::Move(x, y) => builder.move_to(px(x), py(y)),
                Piece::Line(x, y) => builder.line_to(px(x), py(y)),
                Piece::Quad(a, b, x, y) => builder.quad_to(px(a), py(b), px(x), py(y)),
                Piece::Close => builder.close(),
            }
        }
    }
    let Some(path) = builder.finish() else { return };
    let s = (text.size / font::units_per_em()) as f32;
    let (x, y) = (text.x as f32, text.y as f32);
    // Outlines have y upwards; an upright text runs upwards.
    let place = if text.is_upright {
        Transform::from_row(0.0, -s, -s, 0.0, x, y)
    } else {
        Transform::from_row(s, 0.0, 0.0, -s, x, y)
    };
    map.fill_path(&path, &ink(text.paint, 1.0), FillRule::Winding, place.post_concat(whole), None);
}
