//! The starter deck of OpenRadioss (`…_0000.rad`): title and units; its model is not kept.

use std::io::{self, BufRead};

use crate::solver::lsdyna::deck::{Deck, DeckPlace, StatedUnits, unit_system};
use crate::solver::lsdyna::line::{Lines, shown};

/// Whether only a starter deck has such a line.
pub(crate) fn signature(line: &[u8]) -> bool {
    line.trim_ascii_end() == b"/BEGIN"
}

/// Reads what stands above the model: `/BEGIN` (name, version, units of the input, units of the run and so of its results)
/// and `/TITLE`.
///
/// # Errors
/// Those of reading `source`.
pub(crate) fn read(source: &mut dyn BufRead) -> io::Result<Deck> {
    let (mut deck, mut lines) = (Deck { is_starter: true, ..Deck::default() }, Lines::new(source));
    let (mut keyword, mut cards) = (Vec::new(), 0);
    while let Some(line) = lines.next_line()? {
        let text = line.text.trim_ascii();
        match text.first() {
            Some(b'#') => continue,
            Some(b'/') => {
                (keyword, cards) = (text.to_ascii_uppercase(), 0);
                if keyword == b"/NODE" || keyword == b"/END" {
                    break;
                }
            }
            _ => cards += 1,
        }
        match (&keyword[..], cards) {
            // Those of the run count; without them it is in those of the input.
            (b"/BEGIN", 3 | 4) if text.split(|b| b.is_ascii_whitespace()).count() > 1 => {
                let text = shown(text);
                let words =
                    text.split_whitespace().map(|word| if word == "mus" { "us" } else { word });
                let text: Vec<&str> = words.collect();
                let text = text.join(" ");
                let at = DeckPlace { line: line.number, include: None };
                deck.units = Some(StatedUnits { system: unit_system(&text), text, at });
            }
            (b"/TITLE", 1) if !text.is_empty() => deck.title = Some(shown(text)),
            _ => {}
        }
    }
    Ok(deck)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::UnitSystem;

    #[test]
    fn the_run_has_its_own_units() {
        fn t(deck: &str, title: Option<&str>, units: Option<(&str, u64, Option<&str>)>) {
            let read = read(&mut deck.as_bytes()).unwrap();
            assert_eq!(read.title.as_deref(), title, "{deck}");
            let found = read.units.as_ref().map(|u| (&*u.text, u.at.line, u.system));
            let expected = units.map(|(text, line, system)| {
                (text, line, system.map(|s| UnitSystem::parse(s).unwrap()))
            });
            assert_eq!(found, expected, "{deck}");
        }
        let head = "#RADIOSS STARTER\n/BEGIN\nrun\n      2022         0\n";
        let t_of = |units: &str, rest: &str| format!("{head}{units}{rest}");
        t(
            &t_of(
                "   Mg  mm   s\n# of the run\n   kg  mm  ms\n",
                "/TITLE\nfront\n/NODE\n/TITLE\nb\n",
            ),
            Some("front"),
            Some(("kg mm ms", 7, Some("kg-mm-ms"))),
        );
        t(&t_of("   Mg  mm   s\n", "/END\n"), None, Some(("Mg mm s", 5, Some("mm-t-s"))));
        t(&t_of(" g cm mus\n g cm mus\n", ""), None, Some(("g cm us", 6, Some("cm-g-us"))));
        t(&t_of(" 1000. 0.001 1.\n\n", ""), None, Some(("1000. 0.001 1.", 5, None)));
        t("/BEGIN\nrun\n", None, None);
        t("", None, None);
    }
}
