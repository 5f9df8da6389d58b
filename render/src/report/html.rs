//! HTML text.

use std::fmt::Display;

/// What a column of a table holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// Numbers, to the right.
    Number(&'static str),
    /// A few words.
    Text(&'static str),
    /// Sentences, which may be broken into lines.
    Prose(&'static str),
}

impl Column {
    fn class(self) -> &'static str {
        match self {
            Self::Number(_) => "",
            Self::Text(_) => " class=\"text\"",
            Self::Prose(_) => " class=\"prose\"",
        }
    }

    fn title(self) -> &'static str {
        let (Self::Number(title) | Self::Text(title) | Self::Prose(title)) = self;
        title
    }
}

/// A table; titles and cells are HTML already.
pub(super) fn table(columns: &[Column], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let titles = columns.iter().map(|column| {
        format!(
            "<th{} scope=\"col\">{}</th>",
            column.class(),
            column.title()
        )
    });
    let body = rows.into_iter().map(|cells| {
        let cells = cells
            .iter()
            .zip(columns)
            .map(|(cell, column)| format!("<td{}>{cell}</td>", column.class()));
        format!("<tr>{}</tr>\n", concat(cells))
    });
    format!(
        "<div class=\"wide\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody>\n</table></div>\n",
        concat(titles),
        concat(body)
    )
}

/// All parts in a row.
pub(crate) fn concat(parts: impl IntoIterator<Item = String>) -> String {
    parts.into_iter().fold(String::new(), |mut text, part| {
        text.push_str(&part);
        text
    })
}

/// `text` as HTML: whatever a scene file calls its things, it cannot leave the text or an attribute in
/// double quotes.
pub(crate) fn escape(text: impl Display) -> String {
    let text = text.to_string();
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // HTML forbids control characters, however they are written.
            control if control.is_control() && !control.is_whitespace() => {
                escaped.push(char::REPLACEMENT_CHARACTER);
            }
            other => escaped.push(other),
        }
    }
    escaped
}

/// `bytes` in base 64 (RFC 4648, section 4).
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = group.iter().enumerate().fold(0_u32, |word, (i, &byte)| {
            word | u32::from(byte) << (16 - 8 * i)
        });
        for digit in 0..4 {
            if digit <= group.len() {
                let index = (word >> (18 - 6 * digit)) & 63;
                text.push(char::from(DIGITS[index as usize]));
            } else {
                text.push('=');
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_names_stays_text() {
        assert_eq!(
            escape("<script>\"a\" & 'b'\u{0}"),
            "&lt;script&gt;&quot;a&quot; &amp; &#39;b&#39;\u{fffd}"
        );
    }

    #[test]
    fn tables_have_their_cells_in_order() {
        let columns = [Column::Text("name"), Column::Number("n")];
        let html = table(&columns, [vec!["a".to_owned(), "1".to_owned()]]);
        assert!(
            html.contains("<th class=\"text\" scope=\"col\">name</th><th scope=\"col\">n</th>")
        );
        assert!(html.contains("<tr><td class=\"text\">a</td><td>1</td></tr>"));
    }

    #[test]
    fn base64_of_the_standard() {
        // RFC 4648, section 10.
        for (plain, encoded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), encoded);
        }
    }
}
