//! Tables that are wider than the terminal, row by row in place of wrapped.

use std::ops::Range;

/// The text with each table that is wider than `width` characters stacked: a row becomes a line for each of its columns.
pub(super) fn fitted(text: &str, width: usize) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let mut fitted = String::with_capacity(text.len());
    let mut at = 0;
    while let Some(line) = lines.get(at) {
        let columns = lines.get(at + 1).and_then(|rule| columns(rule));
        let Some(columns) = columns else {
            fitted.push_str(line);
            fitted.push('\n');
            at += 1;
            continue;
        };
        let rows = lines[at + 2..].iter().take_while(|row| is_row(row, &columns)).count();
        let table = &lines[at..at + 2 + rows];
        if table.iter().all(|line| line.chars().count() <= width) {
            table.iter().for_each(|line| {
                fitted.push_str(line);
                fitted.push('\n');
            });
        } else {
            stack(table, &columns, &mut fitted);
        }
        at += table.len();
    }
    if !text.ends_with('\n') {
        fitted.pop();
    }
    fitted
}

/// The columns of a table, in characters, by the rule under its heading: groups of dashes two blanks apart.
fn columns(rule: &str) -> Option<Vec<Range<usize>>> {
    let mut columns = Vec::new();
    let mut at = 0;
    for group in rule.split("  ") {
        if group.is_empty() || group.chars().any(|c| c != '-') {
            return None;
        }
        columns.push(at..at + group.len());
        at += group.len() + 2;
    }
    (columns.len() > 1).then_some(columns)
}

/// Whether a line is a row: blank between the columns.
fn is_row(line: &str, columns: &[Range<usize>]) -> bool {
    let between = |c: &Range<usize>| line.chars().skip(c.end).take(2).all(|c| c == ' ');
    !line.trim().is_empty() && columns.iter().all(between)
}

fn stack(table: &[&str], columns: &[Range<usize>], into: &mut String) {
    let cell = |line: &str, column: &Range<usize>| -> String {
        let cell: String = line.chars().skip(column.start).take(column.len()).collect();
        cell.trim().to_string()
    };
    let names: Vec<String> = columns.iter().map(|c| cell(table[0], c)).collect();
    let widest = names.iter().skip(1).map(|name| name.chars().count()).max().unwrap_or(0);
    for row in &table[2..] {
        into.push_str(&format!("{} {}\n", names[0], cell(row, &columns[0])));
        for (name, column) in names.iter().zip(columns).skip(1) {
            let blank = " ".repeat(widest - name.chars().count());
            into.push_str(format!("  {name}{blank}  {}", cell(row, column)).trim_end());
            into.push('\n');
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "run: RMSE_2D in px\n\nestimate  depth  est 1pt px\n--------  -----  ----------\nodom      floor  1.20 ± 0.3\nslam      -      2\n\
                        a note that stands right below the table and is long\n\nend\n";

    #[test]
    fn a_wide_table_is_stacked_and_nothing_else_is_touched() {
        assert_eq!(fitted(TEXT, 60), TEXT);
        assert_eq!(
            fitted(TEXT, 20),
            "run: RMSE_2D in px\n\nestimate odom\n  depth       floor\n  est 1pt px  1.20 ± 0.3\nestimate slam\n  depth       -\n  est 1pt px  2\n\
             a note that stands right below the table and is long\n\nend\n"
        );
        for other in ["", "one line", "a\n--\nb\n", "x  y\n-- --\n", "# heading\n---\ntext"] {
            assert_eq!(fitted(other, 1), other);
        }
    }
}
