//! Tables: as wide as the terminal allows, or CSV.

use std::borrow::Cow;

use console::{Style, Term, measure_text_width, truncate_str};
use serde::Serialize;
use serde_json::Value;
use swarm_telemetry::escape;

/// Space between columns.
const GAP: &str = "  ";
/// Replaces the end of a text that is cut off.
const ELLIPSIS: &str = "…";
/// Characters that begin a formula in a spreadsheet.
const FORMULA_STARTS: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];
/// Columns of text are not made narrower than this.
const COLUMN_WIDTH_MIN: usize = 8;
/// Columns of text keep this width as long as other columns can be left out.
const TEXT_WIDTH: usize = 32;
/// The same for columns of names, whose two ends tell them apart.
const NAME_WIDTH: usize = 20;

/// The terminal of standard output.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Screen {
    /// Characters per line; none if it is not a terminal.
    pub width: Option<usize>,
    /// Whether colours are wanted.
    pub has_colours: bool,
}

impl Screen {
    /// The screen of standard output.
    pub fn of_stdout() -> Self {
        // As `NO_COLOR` is defined: an empty value does not count.
        let no_colour = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        Self { width: width(&Term::stdout()), has_colours: !no_colour && console::colors_enabled() }
    }
}

/// Characters per line of standard error; none if it is not a terminal.
pub fn stderr_width() -> Option<usize> {
    width(&Term::stderr())
}

fn width(term: &Term) -> Option<usize> {
    term.size_checked().filter(|_| term.is_term()).map(|(_, width)| width.into())
}

/// The part of a cell that is left out if space is short.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cut {
    Nothing,
    End,
    /// Names often differ at their ends.
    Middle,
}

/// A column's heading and properties.
#[derive(Debug, Clone)]
pub struct Column {
    heading: String,
    is_number: bool,
    is_wide: bool,
    cut: Cut,
    /// If space is short, columns are left out, the largest rank first; 0: never.
    drop_rank: u8,
    paint: fn(&str) -> Style,
}

impl Column {
    /// A column of words that are never cut.
    pub fn new(heading: &str) -> Self {
        let heading = heading.to_owned();
        Self {
            heading,
            is_number: false,
            is_wide: false,
            cut: Cut::Nothing,
            drop_rank: 0,
            paint: |_| Style::new(),
        }
    }

    /// A column of numbers, aligned on the right.
    pub fn number(heading: &str) -> Self {
        Self { is_number: true, ..Self::new(heading) }
    }

    /// A column of text that may be cut if space is short.
    pub fn text(heading: &str) -> Self {
        Self { cut: Cut::End, ..Self::new(heading) }
    }

    /// A column of names, which lose their middle if space is short.
    pub fn name(heading: &str) -> Self {
        Self { cut: Cut::Middle, ..Self::new(heading) }
    }

    /// Shown with `--output wide` only.
    pub fn wide(self) -> Self {
        Self { is_wide: true, ..self }
    }

    /// Left out if space is short, before columns of a smaller rank.
    pub fn dropped(self, drop_rank: u8) -> Self {
        Self { drop_rank, ..self }
    }

    /// Coloured by the text of the cell.
    pub fn painted(self, paint: fn(&str) -> Style) -> Self {
        Self { paint, ..self }
    }
}

/// Columns of measures: if space is short, the first ones stay.
pub fn measures<'a>(names: impl IntoIterator<Item = &'a str>) -> impl Iterator<Item = Column> {
    (1..=u8::MAX)
        .chain(std::iter::repeat(u8::MAX))
        .zip(names)
        .map(|(rank, name)| Column::number(name).dropped(rank))
}

/// Rows of as many cells as there are columns.
#[derive(Debug, Clone)]
pub struct Table {
    columns: Vec<Column>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new(columns: impl Into<Vec<Column>>) -> Self {
        Self { columns: columns.into(), rows: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, cells: impl Into<Vec<String>>) {
        let cells = cells.into();
        debug_assert_eq!(cells.len(), self.columns.len());
        // Names are untrusted: they must not move the cursor.
        self.rows.push(cells.iter().map(|cell| escape(cell).into_owned()).collect());
    }

    /// The default columns, within the width of the screen.
    pub fn to_text(&self, screen: Screen) -> String {
        self.render(|column| !column.is_wide, screen)
    }

    /// All columns, whole.
    pub fn to_wide_text(&self, screen: Screen) -> String {
        self.render(|_| true, Screen { width: None, ..screen })
    }

    fn render(&self, is_shown: impl Fn(&Column) -> bool, screen: Screen) -> String {
        let mut shown: Vec<usize> =
            (0..self.columns.len()).filter(|&i| is_shown(&self.columns[i])).collect();
        self.drop_columns(&mut shown, screen.width);
        let widths = self.widths(&shown, screen.width);
        let headings = self.columns.iter().map(|column| column.heading.clone()).collect();
        let mut lines = Vec::with_capacity(1 + self.rows.len());
        for (i_line, row) in std::iter::once(&headings).chain(&self.rows).enumerate() {
            let cells: Vec<String> = shown
                .iter()
                .zip(&widths)
                .map(|(&i, &width)| {
                    let column = &self.columns[i];
                    let style =
                        if i_line == 0 { Style::new().bold() } else { (column.paint)(&row[i]) };
                    let text = cut(&row[i], width, column.cut);
                    let room = " ".repeat(width - measure_text_width(&text));
                    let text = style.force_styling(screen.has_colours).apply_to(text);
                    if column.is_number { format!("{room}{text}") } else { format!("{text}{room}") }
                })
                .collect();
            let line = cells.join(GAP);
            let line = line.trim_end();
            lines.push(match screen.width {
                Some(width) => truncate_str(line, width, ELLIPSIS).into_owned(),
                None => line.to_owned(),
            });
        }
        lines.join("\n")
    }

    /// Leaves out columns until the others fit the screen.
    fn drop_columns(&self, shown: &mut Vec<usize>, screen_width: Option<usize>) {
        let Some(screen_width) = screen_width else { return };
        let width = |i: usize| match self.columns[i].cut {
            Cut::Nothing => self.width(i),
            Cut::End => self.width(i).min(TEXT_WIDTH),
            Cut::Middle => self.width(i).min(NAME_WIDTH),
        };
        loop {
            let gaps = GAP.len() * shown.len().saturating_sub(1);
            if shown.iter().map(|&i| width(i)).sum::<usize>() + gaps <= screen_width {
                return;
            }
            let rank = |&(_, &i): &(usize, &usize)| self.columns[i].drop_rank;
            let Some((place, _)) =
                shown.iter().enumerate().filter(|column| rank(column) > 0).max_by_key(rank)
            else {
                return;
            };
            shown.remove(place);
        }
    }

    /// The width of a column's longest cell.
    fn width(&self, i: usize) -> usize {
        let cells = self.rows.iter().map(|row| &row[i]).chain([&self.columns[i].heading]);
        cells.map(|cell| measure_text_width(cell)).max().unwrap_or(0)
    }

    /// The widths of the shown columns; if they exceed the screen, the widest columns
    /// that may be cut become narrower.
    fn widths(&self, shown: &[usize], screen_width: Option<usize>) -> Vec<usize> {
        let mut widths: Vec<usize> = shown.iter().map(|&i| self.width(i)).collect();
        let gaps = GAP.len() * shown.len().saturating_sub(1);
        let Some(room) = screen_width.map(|width| width.saturating_sub(gaps)) else {
            return widths;
        };
        while widths.iter().sum::<usize>() > room {
            let cuttable = (0..shown.len()).filter(|&i| self.columns[shown[i]].cut != Cut::Nothing);
            let Some(widest) = cuttable.max_by_key(|&i| widths[i]) else { break };
            if widths[widest] <= COLUMN_WIDTH_MIN {
                break;
            }
            widths[widest] -= 1;
        }
        widths
    }
}

/// A text of at most `width` columns.
fn cut(text: &str, width: usize, part: Cut) -> Cow<'_, str> {
    if part != Cut::Middle || measure_text_width(text) <= width {
        return truncate_str(text, width, ELLIPSIS);
    }
    let room = width.saturating_sub(measure_text_width(ELLIPSIS));
    let start = truncate_str(text, room.div_ceil(2), "");
    let room = room - measure_text_width(&start);
    let mut ends = text.char_indices().map(|(at, _)| &text[at..]);
    let end = ends.find(|end| measure_text_width(end) <= room).unwrap_or_default();
    Cow::Owned(format!("{start}{ELLIPSIS}{end}"))
}

/// Records as CSV (RFC 4180, but for the line ends), one column per key; `a.b` is the value `b` of
/// the object `a`, in a column `a_b`. Numbers read back to the same bits; cells of missing values,
/// and of those that are not finite, are empty. Text that a spreadsheet would read as a formula
/// gets an apostrophe.
pub fn csv(keys: &[&str], records: &[impl Serialize]) -> String {
    let paths: Vec<Vec<&str>> = keys.iter().map(|key| key.split('.').collect()).collect();
    csv_at(&paths, records)
}

/// The same by paths, for keys that people choose.
pub fn csv_at(paths: &[Vec<&str>], records: &[impl Serialize]) -> String {
    let text = |text: String| quoted(&without_formula(text));
    let headings: Vec<String> = paths.iter().map(|path| text(path.join("_"))).collect();
    let mut lines = vec![headings.join(",")];
    for record in records {
        let record = serde_json::to_value(record).expect("plain data serialises");
        let fields: Vec<String> = paths
            .iter()
            .map(|path| match path.iter().fold(&record, |value, key| &value[key]) {
                Value::Number(number) => number.to_string(),
                value => text(cell(value)),
            })
            .collect();
        lines.push(fields.join(","));
    }
    lines.join("\n")
}

/// A value in one cell; semicolons separate the elements of an object or a list.
fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Array(values) => values.iter().map(cell).collect::<Vec<_>>().join("; "),
        Value::Object(values) => {
            let pairs = values.iter().map(|(key, value)| format!("{key}={}", cell(value)));
            pairs.collect::<Vec<_>>().join("; ")
        }
        value => value.to_string(),
    }
}

/// Text that a spreadsheet does not read as a formula.
fn without_formula(text: String) -> String {
    if text.starts_with(FORMULA_STARTS) { format!("'{text}") } else { text }
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn table() -> Table {
        let columns = [
            Column::number("id"),
            Column::new("state").painted(|_| Style::new().green()),
            Column::text("name"),
            Column::text("reason").wide(),
        ];
        let mut table = Table::new(columns);
        table.push(["3", "running", "leader", ""].map(String::from));
        table.push(["12", "failed", "größe 漢字 of a long name", "why"].map(String::from));
        table
    }

    fn on(width: Option<usize>) -> String {
        table().to_text(Screen { width, has_colours: false })
    }

    #[test]
    fn without_a_terminal_nothing_is_cut_or_coloured() {
        assert_eq!(
            on(None),
            "id  state    name\n \
             3  running  leader\n\
             12  failed   größe 漢字 of a long name"
        );
        let wide = table().to_wide_text(Screen { width: Some(10), has_colours: false });
        assert!(wide.ends_with("12  failed   größe 漢字 of a long name  why"), "{wide}");
    }

    #[test]
    fn no_line_is_longer_than_the_screen() {
        for width in 1..40 {
            let text = on(Some(width));
            assert!(text.lines().all(|line| measure_text_width(line) <= width), "{width}:\n{text}");
        }
        assert!(on(Some(30)).ends_with("12  failed   größe 漢字 of a …"), "{}", on(Some(30)));
        assert!(on(Some(12)).contains("12  failed"), "numbers and states are cut last");
    }

    #[test]
    fn names_keep_both_ends() {
        let name = "flocking_漢字_ga";
        for width in 1..=measure_text_width(name) {
            let cut = cut(name, width, Cut::Middle);
            assert!(measure_text_width(&cut) <= width, "{width}: {cut}");
        }
        assert_eq!(cut(name, 9, Cut::Middle), "floc…_ga");
        assert_eq!(cut(name, 11, Cut::Middle), "flock…字_ga");
        assert_eq!(cut(name, 40, Cut::Middle), name);
    }

    #[test]
    fn colours_do_not_move_columns() {
        let coloured = table().to_text(Screen { width: Some(30), has_colours: true });
        assert!(coloured.contains("\u{1b}[32mrunning\u{1b}[0m"), "{coloured:?}");
        assert_eq!(console::strip_ansi_codes(&coloured), on(Some(30)));
    }

    #[test]
    fn names_do_not_move_the_cursor() {
        let mut table = Table::new([Column::text("name")]);
        table.push(["a\u{1b}[2J\nb".to_owned()]);
        assert_eq!(table.to_text(Screen::default()), "name\na\\u001b[2J\\u000ab");
    }

    #[test]
    fn csv_has_no_formulas_and_numbers_stay_numbers() {
        for start in ["=", "+", "-", "@", "\t"] {
            let record = json!({"name": format!("{start}1+1"), "n": -1.5});
            assert_eq!(csv(&["name", "n"], &[record]), format!("name,n\n'{start}1+1,-1.5"));
        }
        assert_eq!(csv(&["name"], &[json!({"name": "\r=1"})]), "name\n\"'\r=1\"");
        assert_eq!(csv(&["name"], &[json!({"name": "a=1"})]), "name\na=1");
    }

    #[test]
    fn csv_has_nested_values() {
        let record = json!({
            "labels": {"user": "ada", "for": "a, b"},
            "changes": ["-x=1", "y=2"],
            "latest": {"best": -9e98},
        });
        let keys = ["labels", "changes", "latest.best", "latest.mean", "none.best"];
        assert_eq!(
            csv(&keys, &[record]),
            "labels,changes,latest_best,latest_mean,none_best\n\
             \"for=a, b; user=ada\",'-x=1; y=2,-9e+98,,"
        );
    }

    #[test]
    fn keys_that_people_choose_are_text() {
        let record = json!({"aims": {"x.y": 1, "a,b": 2, "=c": 3}});
        let paths = ["x.y", "a,b", "=c"].map(|key| vec!["aims", key]);
        assert_eq!(csv_at(&paths, &[&record]), "aims_x.y,\"aims_a,b\",aims_=c\n1,2,3");
        assert_eq!(csv_at(&[vec!["=c"]], &[json!({"=c": 3})]), "'=c\n3");
    }

    #[test]
    fn csv_keeps_bits_and_quotes_text_where_necessary() {
        let records = [json!({"n": 0.1 + 0.2, "s": "a, \"b\""}), json!({"n": null, "s": "c"})];
        let expected = "s,n\n\"a, \"\"b\"\"\",0.30000000000000004\nc,";
        assert_eq!(csv(&["s", "n"], &records), expected);
    }
}
