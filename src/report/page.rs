//! The page: content into the template.

use std::collections::BTreeMap;
use std::path::Path;

use minijinja::value::{Serde, Value};
use minijinja::{Environment, context};

use super::figure::Figure;
use super::{Content, Part};
use crate::plot::looks_for_pages;
use crate::unit::Shown;

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The whole page.
pub(super) fn html(content: &Content) -> String {
    let mut environment = Environment::new();
    // The name's end makes every text of the content be escaped.
    environment.add_template("page.html", TEMPLATE).expect("the template is part of the program");
    let parts = content.sections.iter().flat_map(|section| &section.parts);
    let figures: Vec<&Figure> = parts
        .filter_map(|part| match part {
            Part::Figure(figure) => Some(figure),
            Part::Heading(_) | Part::Text(_) | Part::Table { .. } => None,
        })
        .collect();
    let looks =
        looks_for_pages(figures.iter().map(|figure| figure.looks()).max().unwrap_or(1).max(8));
    let figures: BTreeMap<&str, &serde_json::Value> =
        figures.into_iter().map(|figure| (figure.id(), figure.data())).collect();
    let data = serde_json::json!({ "figures": figures, "looks": looks.data });
    let page = environment.get_template("page.html").expect("it was added");
    let style = format!("{STYLE}{}", looks.style);
    page.render(context! {
        content => Value::from(Serde(content)),
        style => Value::from_safe_string(style),
        script => Value::from_safe_string(SCRIPT.into()),
        data => Value::from_safe_string(in_script(&data.to_string())),
    })
    .expect("the template asks for what the content has")
}

/// JSON that may be in a script element, whatever its strings hold.
fn in_script(json: &str) -> String {
    json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

/// The last part of a path.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name()
        .map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// `4.5 %`.
pub(super) fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:.1} %", 100.0 * share) } else { "–".into() }
}

/// `−4.5 %`, `+4.5 %`.
pub(super) fn signed_percent(share: f64) -> String {
    format!("{:+.1} %", 100.0 * share).replace('-', "−")
}

/// `3.214 MN`.
pub(super) fn force(force_n: f64) -> String {
    Shown::force(force_n).text(force_n)
}

/// `2.31 MJ`, `25.1 kJ`.
pub(super) fn energy(energy_j: f64) -> String {
    Shown::energy(energy_j).text(energy_j)
}

/// `1.087 m`.
pub(super) fn metres(length_m: f64) -> String {
    format!("{length_m:.3} m")
}

/// `24.00 t`.
pub(super) fn mass(mass_kg: f64) -> String {
    Shown::mass(mass_kg).text(mass_kg)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{KeyFigure, Section};
    use crate::table::{Cell, Table};

    #[test]
    fn names_of_files_are_text() {
        let name = "</script><b>\"'&";
        let cell = |_: &&str| Cell { text: name.into(), title: name.into(), is_chosen: true };
        let table = Table::of([name]).column(name, cell);
        let chart = crate::plot::Chart::of(
            name,
            crate::plot::Panel {
                series: vec![crate::plot::Series::line(name, 0, vec![0.0, 1.0], vec![0.0, 1.0])],
                ..crate::plot::Panel::new(
                    crate::plot::Axis::new(name, name, 1.0),
                    crate::plot::Axis::new(name, name, 1.0),
                )
            },
        );
        let figure = super::super::figure::Figure::new("f1".into(), chart);
        let content = Content {
            title: name.into(),
            subtitle: name.into(),
            figures: vec![KeyFigure { value: name.into(), name: name.into() }],
            warnings: vec![name.into()],
            sections: vec![Section {
                id: "s1".into(),
                title: name.into(),
                parts: vec![
                    Part::Heading(name.into()),
                    Part::Text(name.into()),
                    Part::Figure(figure),
                    Part::table(name, table),
                ],
            }],
        };
        let html = html(&content);
        assert!(!html.contains("<b>"), "{html}");
        assert_eq!(html.matches("</script>").count(), 2);
    }
}
