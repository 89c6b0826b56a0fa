//! Escapes foreign text for HTML.

use std::fmt::Write;

use super::Language;

/// Text escaped for an element or a quoted attribute.
pub(in crate::commands) fn text(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// JSON escaped for a script element: without characters that could end it or begin a comment.
pub(in crate::commands) fn json(json: &str) -> String {
    // JSON has these characters only inside strings, where the escapes mean the same.
    json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

/// The replacement of a chart in a browser without scripts.
pub(in crate::commands) const fn without_script(language: Language) -> &'static str {
    language.pick(
        "This chart needs JavaScript; the tables do without.",
        "Dieses Diagramm braucht JavaScript; die Tabellen nicht.",
    )
}

/// A table. The first column holds row headers; columns in `numbers` are aligned right.
pub(in crate::commands) struct Table {
    html: String,
    numbers: &'static [bool],
}

impl Table {
    /// Begins a table with a caption and columns, which ` | ` separates.
    pub(in crate::commands) fn new(caption: &str, columns: &str, numbers: &'static [bool]) -> Self {
        let mut html = format!("<div class=\"wide\"><table><caption>{}</caption><thead><tr>", text(caption));
        for (column, number) in columns.split(" | ").zip(numbers) {
            let class = if *number { " class=\"number\"" } else { "" };
            let _ = write!(html, "<th scope=\"col\"{class}>{}</th>", text(column));
        }
        html.push_str("</tr></thead><tbody>\n");
        Self { html, numbers }
    }

    /// Adds a row of plain text.
    pub(in crate::commands) fn row(&mut self, cells: &[String]) {
        let escaped: Vec<String> = cells.iter().map(|cell| text(cell)).collect();
        self.row_of_markup(&escaped);
    }

    /// Adds a row of markup.
    pub(in crate::commands) fn row_of_markup(&mut self, cells: &[String]) {
        self.html.push_str("<tr>");
        for (place, (cell, number)) in cells.iter().zip(self.numbers).enumerate() {
            let class = if *number { " class=\"number\"" } else { "" };
            let _ = if place == 0 {
                write!(self.html, "<th scope=\"row\"{class}>{cell}</th>")
            } else {
                write!(self.html, "<td{class}>{cell}</td>")
            };
        }
        self.html.push_str("</tr>\n");
    }

    pub(in crate::commands) fn end(self) -> String {
        self.html + "</tbody></table></div>\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_others_stay_text() {
        assert_eq!(text("<b a='1'>&\"</b>"), "&lt;b a=&#39;1&#39;&gt;&amp;&quot;&lt;/b&gt;");
        let name = serde_json::to_string("</script><!-- & ü").unwrap();
        let safe = json(&name);
        assert!(!safe.contains(['<', '>', '&']), "{safe}");
        assert_eq!(serde_json::from_str::<String>(&safe).unwrap(), "</script><!-- & ü");
    }

    #[test]
    fn a_table_names_its_rows() {
        let mut table = Table::new("Speeds", "step | speed", &[true, false]);
        table.row(&["8".into(), "<fast>".into()]);
        let html = table.end();
        assert!(html.contains("<th scope=\"row\" class=\"number\">8</th><td>&lt;fast&gt;</td>"), "{html}");
    }
}
