//! The page as HTML: every text of the content is escaped here, and nowhere else.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde_json::{Value, json};

use super::figure::Figure;
use super::{Content, Part, Section};
use crate::plot::looks_for_pages;
use crate::table::Table;
use crate::words::escaped;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The head up to the title.
const HEAD: &str = r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
"#;

/// The whole page.
pub(super) fn html(content: &Content) -> String {
    let parts = content.sections.iter().flat_map(|section| &section.parts);
    let figures: Vec<&Figure> = parts
        .filter_map(|part| match part {
            Part::Figure(figure) => Some(figure),
            Part::Heading(_) | Part::Text(_) | Part::Table { .. } => None,
        })
        .collect();
    let looks =
        looks_for_pages(figures.iter().map(|figure| figure.looks).max().unwrap_or(1).max(8));
    let figures: BTreeMap<&str, &Value> =
        figures.into_iter().map(|figure| (&*figure.id, &figure.data)).collect();
    let data = in_script(&json!({ "figures": figures, "looks": looks.data }).to_string());
    let style = looks.style;
    let title = escaped(&content.title);
    let mut page = format!(
        "{HEAD}<title>{title}</title>\n<style>{STYLE}{style}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n"
    );
    add_head(&mut page, content);
    page += "</header>\n<main>\n";
    add_verdicts(&mut page, content);
    content.sections.iter().for_each(|section| add_section(&mut page, section));
    add_warnings(&mut page, content);
    page += "</main>\n";
    add(&mut page, format_args!("<script type=\"application/json\" id=\"data\">{data}</script>\n"));
    add(&mut page, format_args!("<script>{SCRIPT}</script>\n</body>\n</html>"));
    page
}

fn add(page: &mut String, text: std::fmt::Arguments<'_>) {
    page.write_fmt(text).expect("a string takes any text");
}

/// What the page is about, what stands out, and the contents.
fn add_head(page: &mut String, content: &Content) {
    for line in &content.about {
        add(page, format_args!("<p class=\"faint\">{}</p>\n", escaped(line)));
    }
    *page += "<dl class=\"key\">";
    for figure in &content.figures {
        let (name, value) = (escaped(&figure.name), escaped(&figure.value));
        add(page, format_args!("\n<div><dt>{name}</dt><dd>{value}</dd></div>"));
    }
    *page += "\n</dl>\n<nav aria-label=\"Contents\"><ul>";
    let results = (!content.verdicts.is_empty()).then_some(("verdicts", "Results"));
    let sections = content.sections.iter().map(|section| (&*section.id, &*section.title));
    let warnings = (!content.warnings.is_empty()).then_some(("warnings", "Warnings"));
    for (id, title) in results.into_iter().chain(sections).chain(warnings) {
        add(page, format_args!("\n<li><a href=\"#{}\">{}</a></li>", escaped(id), escaped(title)));
    }
    *page += "\n</ul></nav>\n";
}

fn add_verdicts(page: &mut String, content: &Content) {
    if content.verdicts.is_empty() {
        return;
    }
    *page += "<section id=\"verdicts\">\n<h2>Results</h2>\n<ul class=\"verdicts\">";
    for verdict in &content.verdicts {
        let (state, about, text) = (verdict.state, escaped(&verdict.about), escaped(&verdict.text));
        add(page, format_args!("\n<li class=\"{state}\"><strong>{about}</strong>: {text}</li>"));
    }
    *page += "\n</ul>\n</section>\n";
}

fn add_section(page: &mut String, section: &Section) {
    let (id, title) = (escaped(&section.id), escaped(&section.title));
    add(page, format_args!("<section id=\"{id}\">\n<h2>{title}</h2>\n"));
    for part in &section.parts {
        match part {
            Part::Heading(text) => add(page, format_args!("<h3>{}</h3>\n", escaped(text))),
            Part::Text(text) => add(page, format_args!("<p>{}</p>\n", escaped(text))),
            Part::Figure(figure) => add_figure(page, figure),
            Part::Table { caption, table } => add_table(page, caption, table),
        }
    }
    *page += "</section>\n";
}

fn add_figure(page: &mut String, figure: &Figure) {
    let (id, caption) = (escaped(&figure.id), escaped(&figure.caption));
    add(page, format_args!("<figure data-figure=\"{id}\">\n<figcaption>{caption}</figcaption>\n"));
    for (view, svg) in [("wide", &figure.svg), ("narrow", &figure.narrow_svg)] {
        let picture = format_args!(
            "<div class=\"view {view}-view\"><div class=\"picture\">{svg}</div></div>\n"
        );
        add(page, picture);
    }
    for note in &figure.notes {
        add(page, format_args!("<p class=\"note\">{}</p>\n", escaped(note)));
    }
    *page += "</figure>\n";
}

fn add_table(page: &mut String, caption: &str, table: &Table) {
    let is_word =
        |text: &str| !text.is_empty() && !text.starts_with(|c| "0123456789+−–±".contains(c));
    let caption = escaped(caption);
    add(
        page,
        format_args!(
            "<div class=\"wide\" tabindex=\"0\" role=\"group\" aria-label=\"{caption}\"><table>\n<caption>{caption}</caption>\n<thead><tr>"
        ),
    );
    for (column, name) in table.heading.iter().enumerate() {
        let is_word = table
            .rows
            .first()
            .is_some_and(|row| row.get(column).is_some_and(|cell| is_word(&cell.text)));
        let class = if is_word { " class=\"word\"" } else { "" };
        add(page, format_args!("<th scope=\"col\"{class}>{}</th>", escaped(name)));
    }
    *page += "</tr></thead>\n<tbody>";
    for row in &table.rows {
        *page += "\n<tr>";
        for (column, (cell, name)) in row.iter().zip(&table.heading).enumerate() {
            let element = if column == 0 { "th" } else { "td" };
            *page += if column == 0 { "<th scope=\"row\"" } else { "<td" };
            if !cell.title.is_empty() {
                add(page, format_args!(" title=\"{}\"", escaped(&cell.title)));
            }
            *page += if cell.is_chosen {
                " class=\"chosen\""
            } else if cell.text.chars().count() > 40 {
                " class=\"long\""
            } else if is_word(&cell.text) {
                " class=\"word\""
            } else {
                ""
            };
            if column > 0 {
                add(page, format_args!(" data-name=\"{}\"", escaped(name)));
            }
            add(page, format_args!(">{}</{element}>", escaped(&cell.text)));
        }
        *page += "</tr>";
    }
    *page += "\n</tbody></table></div>\n";
}

fn add_warnings(page: &mut String, content: &Content) {
    if content.warnings.is_empty() {
        return;
    }
    *page += "<section id=\"warnings\">\n<h2>Warnings</h2>\n";
    for group in &content.warnings {
        add(page, format_args!("<h3>{}</h3>\n<ul>", escaped(group.what_to_do)));
        for warning in &group.texts {
            let about: Vec<String> = warning.about.iter().map(|about| escaped(about)).collect();
            let (about, text) = (about.join(", "), escaped(&warning.text));
            add(page, format_args!("\n<li><strong>{about}</strong>: {text}</li>"));
        }
        *page += "\n</ul>\n";
    }
    *page += "</section>\n";
}

/// JSON that may be in a script element, whatever its strings hold.
fn in_script(json: &str) -> String {
    json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}
