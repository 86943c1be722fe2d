//! Writes rectangles and words as SVG, with colours for light and for dark pages.

use std::fmt::Write as _;

/// Width of a letter of the labels, at most, by its size.
const LETTER: f64 = 0.58;
/// Size of the labels in boxes.
const LABEL: f64 = 11.0;

const STYLE: &str = "\
<style>
.bg{fill:#ffffff}.t{fill:#1b1f24}.s{fill:#57606a;font-size:12px}.b{fill:#1b1f24;font-size:11px}
.lane{fill:#f3f4f6}.cpu{fill:#d0d7de}.vel{fill:#9ecbff}.con{fill:#ffd8a8}.fri{fill:#ffc9c9}.pos{fill:#b2f2bb}
.res{fill:#8ce99a}.irq{fill:#d8b9ff}.wait{fill:#57606a}.line{stroke:#8c959f;stroke-width:1;fill:none}
.bell{stroke:#1b1f24;stroke-width:1.2;fill:none}
@media (prefers-color-scheme: dark){
.bg{fill:#0d1117}.t{fill:#e6edf3}.s{fill:#9198a1}.b{fill:#f0f6fc}
.lane{fill:#1c2128}.cpu{fill:#3d444d}.vel{fill:#1f5f9e}.con{fill:#8a5a1c}.fri{fill:#8c3d3d}.pos{fill:#2b6a3b}
.res{fill:#347d39}.irq{fill:#6e4aa5}.wait{fill:#adbac7}.line{stroke:#656c76}.bell{stroke:#e6edf3}}
</style>
";

/// A picture under way.
#[derive(Debug, Default)]
pub(crate) struct Picture(String);

/// Letters that are marks of the language.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The place of a text beside its coordinate.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Picture {
    pub(crate) fn rectangle(
        &mut self,
        class: &str,
        [x, y, width, height]: [f64; 4],
        title: Option<&str>,
    ) {
        let shape = format!(
            "<rect class=\"{class}\" x=\"{x:.2}\" y=\"{y:.1}\" width=\"{width:.2}\" \
             height=\"{height:.1}\" rx=\"2\""
        );
        match title {
            None => self.0 += &format!("{shape}/>\n"),
            Some(title) => {
                self.0 += &format!("{shape}><title>{}</title></rect>\n", escaped(title));
            }
        }
    }

    pub(crate) fn text(&mut self, class: &str, [x, y]: [f64; 2], anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escaped(text);
        // Writing to a string cannot fail.
        let _ = writeln!(
            self.0,
            "<text class=\"{class}\" x=\"{x:.2}\" y=\"{y:.1}\" \
             text-anchor=\"{anchor}\">{text}</text>"
        );
    }

    /// The first of `texts` that fits a box, in its middle.
    pub(crate) fn label(&mut self, [x, y, width, height]: [f64; 4], texts: &[&str]) {
        let fits = |text: &&&str| text.len() as f64 * LABEL * LETTER + 4.0 <= width;
        if let Some(text) = texts.iter().find(fits) {
            self.text("b", [x + width / 2.0, y + height / 2.0 + 4.0], Anchor::Middle, text);
        }
    }

    /// A path.
    pub(crate) fn path(&mut self, class: &str, path: &str) {
        let _ = writeln!(self.0, "<path class=\"{class}\" d=\"{path}\"/>");
    }

    /// The whole document.
    pub(crate) fn document(self, [width, height]: [f64; 2], title: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             font-family=\"sans-serif\" font-size=\"13\">\n<title>{}</title>\n{STYLE}\
             <rect class=\"bg\" width=\"{width:.0}\" height=\"{height:.0}\"/>\n{}</svg>\n",
            escaped(title),
            self.0
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_is_left_out_where_it_does_not_fit() {
        let mut picture = Picture::default();
        picture.label([0.0, 0.0, 12.0, 20.0], &["contact 1", "1"]);
        picture.label([0.0, 0.0, 5.0, 20.0], &["contact 1", "1"]);
        let document = picture.document([10.0, 10.0], "a < b");
        assert_eq!(document.matches("<text").count(), 1);
        assert!(document.contains(">1</text>") && document.contains("a &lt; b"));
    }
}
