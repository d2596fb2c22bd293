//! Results as they are shown: tables of texts, of which a column is stated once, by its name and what it shows of an item; objects for JSON.

use serde::Serialize;

/// An object for JSON with these fields in this order, made where it is printed; a field marked
/// `if_any` is left out where it is null or empty.
macro_rules! document {
    ($($(#[$attribute:meta])* $key:ident $($if_any:ident)?: $value:expr),* $(,)?) => {{
        #[derive(serde::Serialize)]
        #[allow(non_snake_case)]
        struct Document<$($key),*> {
            $(
                $(
                    #[doc = stringify!($if_any)]
                    #[serde(skip_serializing_if = "crate::table::is_empty")]
                )?
                $(#[$attribute])*
                $key: $key,
            )*
        }
        Document { $($key: $value),* }
    }};
}

/// Whether there is nothing in a value.
pub(crate) fn is_empty(value: &impl Serialize) -> bool {
    serde_json::to_string(value).is_ok_and(|json| ["null", "[]", "{}"].contains(&json.as_str()))
}

/// A table of texts; the first column names, the others hold values.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Table {
    pub heading: Vec<String>,
    pub rows: Vec<Vec<Cell>>,
}

/// A text with details.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Cell {
    pub text: String,
    /// Shown where the pointer rests; empty for nothing.
    pub title: String,
    /// Whether its row is what was chosen.
    pub is_chosen: bool,
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self { text: text.into(), ..Self::default() }
    }
}

/// A table in the making, with a row for each item.
pub(crate) struct TableOf<T> {
    items: Vec<T>,
    table: Table,
}

impl Table {
    pub(crate) fn of<T>(items: impl IntoIterator<Item = T>) -> TableOf<T> {
        let items: Vec<T> = items.into_iter().collect();
        let rows = vec![Vec::new(); items.len()];
        TableOf { items, table: Self { heading: Vec::new(), rows } }
    }

    /// Apart from what is generic, which is compiled for every column.
    fn add_column(&mut self, name: String, cell: &dyn Fn(usize) -> Cell) {
        self.heading.push(name);
        self.rows.iter_mut().enumerate().for_each(|(k, row)| row.push(cell(k)));
    }
}

impl<T> TableOf<T> {
    pub(crate) fn items(&self) -> &[T] {
        &self.items
    }

    pub(crate) fn column<C: Into<Cell>>(
        mut self,
        name: impl Into<String>,
        cell: impl Fn(&T) -> C,
    ) -> Self {
        let items = &self.items;
        self.table.add_column(name.into(), &|row| cell(&items[row]).into());
        self
    }

    /// Adds a row below those of the items, with dashes but for these cells; after the columns.
    pub(crate) fn row(mut self, cells: &[(&str, String)]) -> Self {
        let cell = |name: &String| {
            let of_name = cells.iter().find(|(column, _)| column == name);
            of_name.map_or("-".into(), |(_, text)| text.clone().into())
        };
        self.table.rows.push(self.table.heading.iter().map(cell).collect());
        self
    }

    /// Marks the rows of chosen items.
    pub(crate) fn chosen(mut self, is_chosen: impl Fn(&T) -> bool) -> Self {
        for (row, item) in self.table.rows.iter_mut().zip(&self.items) {
            let is_chosen = is_chosen(item);
            row.iter_mut().for_each(|cell| cell.is_chosen = is_chosen);
        }
        self
    }
}

impl<T> From<TableOf<T>> for Table {
    fn from(made: TableOf<T>) -> Self {
        made.table
    }
}
