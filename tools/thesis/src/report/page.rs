//! The report as one page of HTML, without anything to load.

use std::fmt::Write as _;

use super::parts::Report;
use super::text::{preface, without_counterpart};
use crate::figure::Figure;
use crate::index::{Origin, Row};
use crate::table::escaped;

const STYLE: &str = include_str!("page.css");

pub(super) fn html(report: &Report) -> String {
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta \
         name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta \
         name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" \
         href=\"data:,\">\n<title>zynq-pgs: the thesis' figures from our own \
         numbers</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>The thesis' \
         figures, from our own numbers</h1>\n<p>{}</p>\n<ul class=\"legend\">\n",
        escaped(&preface(report))
    );
    for origin in Origin::ALL {
        let _ = writeln!(text, "<li>{} {}</li>", tag(origin), escaped(origin.meaning()));
    }
    text.push_str(
        "</ul>\n<nav><a href=\"#figures\">Figures</a> <a href=\"#index\">Index</a> \
         <a href=\"#tables\">Tables</a></nav>\n</header>\n<main>\n<section \
         class=\"numbers\">\n",
    );
    for Row { thesis, subject, recorded, ours, origin, shown, .. } in &report.numbers {
        let _ = writeln!(
            text,
            "<a href=\"#{shown}\"><b>{}</b> {} {}<br>thesis, {}: {}</a>",
            escaped(ours),
            escaped(subject),
            tag(*origin),
            escaped(thesis),
            escaped(recorded)
        );
    }
    text.push_str("</section>\n");
    text.push_str("<section id=\"figures\">\n<h2>Figures</h2>\n");
    for figure in &report.part.figures {
        self::figure(&mut text, figure);
    }
    text.push_str("</section>\n");
    index(&mut text, &report.part.rows);
    text.push_str("<section id=\"tables\">\n<h2>Tables</h2>\n");
    for table in &report.part.tables {
        text.push_str(&table.to_html());
    }
    text.push_str("</section>\n</main>\n</body>\n</html>\n");
    text
}

/// The mark and the word of an origin.
fn tag(origin: Origin) -> String {
    let word = origin.word();
    format!("<span class=\"origin {word}\">{} {word}</span>", origin.mark())
}

fn index(text: &mut String, rows: &[Row]) {
    text.push_str(
        "<section id=\"index\">\n<h2>Index</h2>\n<div class=\"wide\"><table class=\"index\">\n\
         <thead><tr><th>Thesis</th><th>Subject</th><th>Its figure</th><th>Ours</th><th></th>\
         <th>Command</th></tr></thead>\n<tbody>\n",
    );
    for row in rows {
        let _ = writeln!(
            text,
            "<tr><td>{}</td><td><a href=\"#{}\">{}</a></td><td>{}</td><td>{}</td><td>{}</td>\
             <td><code>{}</code></td></tr>",
            escaped(&row.thesis),
            escaped(&row.shown),
            escaped(&row.subject),
            escaped(&row.recorded),
            escaped(&row.ours),
            tag(row.origin),
            escaped(&row.command)
        );
    }
    let _ = writeln!(
        text,
        "</tbody>\n</table></div>\n<p>{}</p>\n</section>",
        escaped(&without_counterpart())
    );
}

fn figure(text: &mut String, figure: &Figure) {
    let title = format!("{}: {}", figure.thesis, figure.title);
    let _ = writeln!(
        text,
        "<figure id=\"{}\">\n<h3>{}</h3>\n{}<figcaption>{} {}</figcaption>",
        figure.id,
        escaped(&title),
        named(&figure.svg, &title),
        tag(figure.origin),
        escaped(&figure.caption)
    );
    if let Some(playback) = &figure.playback {
        let _ = writeln!(
            text,
            "<details><summary>Play it</summary>\n<iframe loading=\"lazy\" title=\"Playback\" \
             srcdoc=\"{}\"></iframe></details>",
            escaped(playback)
        );
    }
    text.push_str("</figure>\n");
}

/// The picture with a name for people who cannot see it.
fn named(svg: &str, title: &str) -> String {
    let start = svg.find("<svg").unwrap_or(0);
    let label = format!("<svg role=\"img\" aria-label=\"{}\"", escaped(title));
    svg[start..].replacen("<svg", &label, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(escaped("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
    }

    #[test]
    fn a_picture_has_a_name() {
        let text = named("<?xml?>\n<svg viewBox=\"0 0 1 1\"></svg>", "Figure 1: a < b");
        assert_eq!(
            text,
            "<svg role=\"img\" aria-label=\"Figure 1: a &lt; b\" viewBox=\"0 0 1 1\"></svg>"
        );
    }
}
