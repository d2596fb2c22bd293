//! A drawing as SVG and as PNG.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::{self, Write as _};

use super::chart::{Drawing, Paint, Shape, Shows, Stroke, Text};
use super::font::{self, Piece};
use super::style;
use crate::error::{Error, error};
use crate::words::escaped;
use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};
use tiny_skia::{
    Color, FillRule, LineJoin, Paint as Ink, Path, PathBuilder, Pixmap, StrokeDash, Transform,
};

/// Default size of texts, in pixels: that of the numbers at ticks.
const SIZE: f64 = 12.0;

/// Where an SVG is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SvgFor {
    /// A file: colours are written out, and texts are outlines, so that no font is needed.
    File,
    /// Within an HTML page: texts are texts, and colours are classes (`ink`, `grid`, `s0` to `s7`) of its styles.
    Page,
}

impl Drawing {
    /// The drawing as a file.
    pub fn svg(&self) -> String {
        self.svg_for(SvgFor::File)
    }

    /// The drawing as SVG 1.1; in a page without its namespace.
    pub(crate) fn svg_for(&self, target: SvgFor) -> String {
        let mut out = String::new();
        let (width, height) = (number(self.width), number(self.height));
        let namespaces = match target {
            SvgFor::File => {
                r#" xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink""#
            }
            SvgFor::Page => "",
        };
        let size = match target {
            SvgFor::File => format!(r#" width="{width}" height="{height}""#),
            SvgFor::Page => String::new(),
        };
        let title = escaped(&self.title);
        let _ = writeln!(
            out,
            r#"<svg{namespaces} viewBox="0 0 {width} {height}"{size} fill="none" stroke-linejoin="round" font-size="12" role="img" aria-label="{title}">"#
        );
        if target == SvgFor::File {
            let _ = writeln!(out, "<title>{title}</title>");
            self.define_glyphs(&mut out);
            let paper = colour(Paint::Paper);
            let _ = writeln!(out, r#"<rect width="{width}" height="{height}" fill="{paper}"/>"#);
        }
        for shape in &self.shapes {
            match shape {
                Shape::Text(text) => write_text(&mut out, text, target),
                Shape::Path { lines, is_closed, stroke, fill, shows } => {
                    let data = path_data(lines, *is_closed);
                    if !data.is_empty() {
                        let looks = looks(stroke.as_ref(), *fill, target);
                        let _ =
                            writeln!(out, r#"<path{} d="{data}"{looks}/>"#, tag(*shows, target));
                    }
                }
            }
        }
        out.push_str("</svg>\n");
        out
    }

    /// Outlines of all characters in use, once each.
    fn define_glyphs(&self, out: &mut String) {
        let texts = self.shapes.iter().filter_map(|shape| match shape {
            Shape::Text(text) => Some(&text.text),
            Shape::Path { .. } => None,
        });
        let glyphs: BTreeSet<u16> =
            texts.flat_map(|text| font::place(text).0).map(|placed| placed.glyph).collect();
        out.push_str("<defs>\n");
        for glyph in glyphs {
            let mut data = String::new();
            for piece in font::outline(glyph) {
                let _ = match piece {
                    Piece::Move(x, y) => write!(data, "M{x} {y}"),
                    Piece::Line(x, y) => write!(data, "L{x} {y}"),
                    Piece::Quad(a, b, x, y) => write!(data, "Q{a} {b} {x} {y}"),
                    Piece::Close => write!(data, "Z"),
                };
            }
            if !data.is_empty() {
                let _ = writeln!(out, r#"<path id="g{glyph}" d="{data}"/>"#);
            }
        }
        out.push_str("</defs>\n");
    }
}

/// Digits after the point: a tenth of a pixel.
fn number(value: f64) -> String {
    let text = format!("{value:.1}");
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" { "0".into() } else { text.into() }
}

/// Lines with coordinates from point to point, in whole tenths of a pixel: half as long as places.
fn path_data(lines: &[Vec<(f64, f64)>], is_closed: bool) -> String {
    let tenths = |v: f64| (v * 10.0).round() as i64;
    let mut data = String::new();
    for line in lines.iter().filter(|line| line.len() > 1) {
        let (mut x, mut y) = (tenths(line[0].0), tenths(line[0].1));
        let _ = write!(data, "M{} {}l", number(line[0].0), number(line[0].1));
        let mut needs_space = false;
        for (px, py) in &line[1..] {
            let (next_x, next_y) = (tenths(*px), tenths(*py));
            for step in [next_x - x, next_y - y] {
                if needs_space && step >= 0 {
                    data.push(' ');
                }
                data.push_str(&short(step));
                needs_space = true;
            }
            (x, y) = (next_x, next_y);
        }
        if is_closed {
            data.push('Z');
        }
    }
    data
}

/// Tenths as a number: `-.3`, `12`, `1.5`.
fn short(tenths: i64) -> String {
    let sign = if tenths < 0 { "-" } else { "" };
    match (tenths.abs() / 10, tenths.abs() % 10) {
        (whole, 0) => format!("{sign}{whole}"),
        (0, part) => format!("{sign}.{part}"),
        (whole, part) => format!("{sign}{whole}.{part}"),
    }
}

/// Colour of a paint in a file, on white.
pub(super) fn colour(paint: Paint) -> &'static str {
    match paint {
        Paint::Paper => "#ffffff",
        Paint::Ink => "#222222",
        Paint::Faint => "#595959",
        Paint::Grid => "#dddddd",
        Paint::Series(look) => style::colour(look),
    }
}

/// Class of a paint in a page.
fn class(paint: Paint) -> String {
    match paint {
        Paint::Paper => "paper".into(),
        Paint::Ink => "ink".into(),
        Paint::Faint => "faint".into(),
        Paint::Grid => "grid".into(),
        Paint::Series(look) => format!("s{}", look % 8),
    }
}

fn looks(stroke: Option<&Stroke>, fill: Option<(Paint, f64)>, target: SvgFor) -> String {
    let mut looks = String::new();
    let in_page = target == SvgFor::Page;
    let mut classes = Vec::new();
    if let Some((paint, opacity)) = fill {
        if in_page {
            classes.push(format!("f-{}", class(paint)));
        } else {
            let _ = write!(looks, r#" fill="{}""#, colour(paint));
        }
        if opacity < 1.0 {
            let _ = write!(looks, r#" fill-opacity="{opacity}""#);
        }
    }
    if let Some(Stroke { paint, width, dash }) = stroke {
        if in_page {
            classes.push(format!("l-{}", class(*paint)));
        } else {
            let _ = write!(looks, r#" stroke="{}""#, colour(*paint));
        }
        if *width != 1.0 {
            let _ = write!(looks, r#" stroke-width="{}""#, number(*width));
        }
        if !dash.is_empty() {
            let lengths: Vec<String> = dash.iter().map(|l| number(*l)).collect();
            let _ = write!(looks, r#" stroke-dasharray="{}""#, lengths.join(" "));
        }
    }
    if !classes.is_empty() {
        let _ = write!(looks, r#" class="{}""#, classes.join(" "));
    }
    looks
}

/// In a page: what a script finds a shape by.
fn tag(shows: Option<Shows>, target: SvgFor) -> String {
    match shows.filter(|_| target == SvgFor::Page) {
        Some(Shows::Series(panel, k)) => format!(r#" data-series="{panel}.{k}""#),
        Some(Shows::Band(panel, k)) => format!(r#" data-band="{panel}.{k}""#),
        Some(Shows::Ticks(panel)) => format!(r#" data-ticks="{panel}""#),
        Some(Shows::Legend) => r#" data-legend="""#.into(),
        None => String::new(),
    }
}

fn write_text(out: &mut String, text: &Text, target: SvgFor) {
    let (x, y, said) = (number(text.x), number(text.y), escaped(&text.text));
    let turned = if text.is_upright { " rotate(-90)" } else { "" };
    if target == SvgFor::Page {
        let place = if text.is_upright {
            format!(r#"transform="translate({x} {y}){turned}""#)
        } else {
            format!(r#"x="{x}" y="{y}""#)
        };
        let size = match text.size {
            SIZE => String::new(),
            size => format!(r#" font-size="{}""#, number(size)),
        };
        let (tag, class) = (tag(text.shows, target), class(text.paint));
        let _ = writeln!(out, r#"<text{tag} {place}{size} class="f-{class}">{said}</text>"#);
        return;
    }
    // Outlines have y upwards.
    let scale = format!("{:.6}", text.size / font::units_per_em());
    let _ = write!(
        out,
        r#"<g transform="translate({x} {y}){turned} scale({scale} -{scale})" fill="{}" aria-label="{said}">"#,
        colour(text.paint)
    );
    for placed in font::place(&text.text).0 {
        if !font::outline(placed.glyph).is_empty() {
            let _ = write!(out, r##"<use xlink:href="#g{}" x="{}"/>"##, placed.glyph, placed.x);
        }
    }
    out.push_str("</g>\n");
}

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
            "a picture of {width} by {height} pixels cannot be drawn: expected 1 to {MOST} each way; draw less in it, with fewer pixels (--scale), or as .svg",
            height = height as u64,
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
        encoded(&map).map_err(|e| error!(Plot, "the picture cannot be encoded: {}", e))
    }
}

/// The file of an opaque picture, as ISO/IEC 15948 has it: three bytes a pixel, deflated. tiny-skia's own encoder would bring
/// a second deflate.
fn encoded(map: &Pixmap) -> io::Result<Vec<u8>> {
    let mut rows = ZlibEncoder::new(Vec::new(), Compression::default());
    for row in map.pixels().chunks(map.width() as usize) {
        // Each row begins with the filter of its bytes: none.
        let mut bytes = vec![0];
        row.iter().for_each(|p| bytes.extend([p.red(), p.green(), p.blue()]));
        rows.write_all(&bytes)?;
    }
    // Eight bits of red, green and blue; deflate, the filters of the standard, not interlaced.
    let sides = [map.width().to_be_bytes(), map.height().to_be_bytes()].concat();
    let header = [&sides[..], &[8, 2, 0, 0, 0]].concat();
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    for (name, content) in [(b"IHDR", header), (b"IDAT", rows.finish()?), (b"IEND", Vec::new())] {
        let mut sum = Crc::new();
        sum.update(name);
        sum.update(&content);
        file.extend((content.len() as u32).to_be_bytes());
        file.extend(name);
        file.extend(content);
        file.extend(sum.sum().to_be_bytes());
    }
    Ok(file)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_decoder_reads_the_same_pixels() {
        let mut map = Pixmap::new(70, 40).unwrap();
        map.fill(Color::WHITE);
        let line = path(&[vec![(3.0, 5.0), (60.0, 33.0), (66.0, 2.0)]], false).unwrap();
        let pen = tiny_skia::Stroke { width: 3.0, ..Default::default() };
        map.stroke_path(&line, &Ink::default(), &pen, Transform::identity(), None);
        let file = encoded(&map).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(file)).read_info().unwrap();
        let mut found = vec![0; reader.output_buffer_size().unwrap()];
        let read = reader.next_frame(&mut found).unwrap();
        reader.finish().unwrap();
        assert_eq!((read.width, read.height, read.color_type), (70, 40, png::ColorType::Rgb));
        let expected: Vec<u8> =
            map.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        assert!(expected.contains(&0) && expected.contains(&255) && found == expected);
    }
}
