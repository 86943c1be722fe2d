//! Writes a recording as one HTML page that plays it, without a network. The same page plays the
//! frames that a server sends while a board steps.
//!
//! The page's parts are the files beside this module; their data comes from `quantise`.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use scene::Geometry;
use serde_json::{Value, json};

use crate::error::ViewError;
use crate::kinds::{COLOURS, surfaces};
use crate::mesh::{Mesh, dot};
use crate::quantise;
use crate::recording::Recording;

pub use crate::quantise::Error;

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// The scripts, in the order in which they use each other.
const SCRIPTS: [&str; 8] = [
    include_str!("decode.js"),
    include_str!("poses.js"),
    include_str!("camera.js"),
    include_str!("hidden.js"),
    include_str!("draw.js"),
    include_str!("colours.js"),
    include_str!("player.js"),
    include_str!("live.js"),
];

/// The page of a recording.
#[derive(Debug)]
pub struct Page {
    /// Its text.
    pub html: String,
    /// The largest error of a pose on the page, as it stands among its facts.
    pub error: Error,
}

/// Makes the page; `facts` are labels and texts about the run.
///
/// # Errors
/// [`ViewError`]: the bodies have too many kinds, or a geometry has no surface.
pub fn page(
    recording: &Recording,
    title: &str,
    facts: &[(&str, String)],
) -> Result<Page, ViewError> {
    let found = quantise::quantise(recording)?;
    let error = found.error;
    let mut head = head(recording)?;
    head["times"] = recording.frames().iter().map(|frame| frame.time).collect();
    head["low"] = found.low.as_slice().into();
    head["quantum"] = found.quantum.into();
    let poses = format!("{} frames, {}", recording.frames().len(), error.text());
    let facts: Vec<_> = facts.iter().cloned().chain([("poses", poses)]).collect();
    let html = html(&head, title, &facts, &BASE64_STANDARD.encode(&found.bytes));
    Ok(Page { html, error })
}

/// The page that plays the frames of the server it comes from; a recording of the start tells the
/// bodies and the first view.
///
/// # Errors
/// As for [`page`].
#[cfg(feature = "live")]
pub(crate) fn live(
    start: &Recording,
    title: &str,
    facts: &[(&str, String)],
) -> Result<String, ViewError> {
    let mut head = head(start)?;
    head["live"] = true.into();
    // The bodies will fall: the first view has the ground, too.
    head["view"]["low"][1] = 0.into();
    Ok(html(&head, title, facts, ""))
}

/// The facts of all pages of a recording.
fn head(recording: &Recording) -> Result<Value, ViewError> {
    let surfaces = surfaces(recording.geometries())?;
    let kinds = recording.geometries().iter().zip(&surfaces).zip(COLOURS.iter().cycle());
    let (low, high) = view(recording);
    Ok(json!({
        "of": quantise::kinds(recording)?,
        "kinds": kinds.map(|(of, colour)| kind(of, colour)).collect::<Vec<_>>(),
        "componentMost": quantise::COMPONENT_MOST,
        "view": { "low": low, "high": high },
    }))
}

/// The text of a page.
fn html(head: &Value, title: &str, facts: &[(&str, String)], poses: &str) -> String {
    let fact = |(label, text): &(&str, String)| {
        format!("<dt>{}</dt><dd>{}</dd>\n", escaped(label), escaped(text))
    };
    filled(
        PAGE,
        &[
            ("title", &escaped(title)),
            ("style", STYLE),
            ("facts", &facts.iter().map(fact).collect::<String>()),
            // Nothing in a JSON text may end the element around it.
            ("head", &head.to_string().replace('<', "\\u003c")),
            ("poses", poses),
            ("script", &SCRIPTS.join("\n")),
        ],
    )
}

impl Error {
    /// The error for people.
    #[must_use]
    pub fn text(&self) -> String {
        format!(
            "largest error from rounding {:.2} mm and {:.2} degrees",
            1e3 * self.distance,
            self.angle
        )
    }
}

/// The box around all centres of the last frame and of the first, where most of the motion is.
fn view(recording: &Recording) -> ([f32; 3], [f32; 3]) {
    let frames = recording.frames();
    let poses = || frames.first().into_iter().chain(frames.last()).flat_map(|frame| &frame.poses);
    let most = |axis: usize, sign: f32| {
        let values = poses().map(|pose| sign * pose.position[axis]);
        sign * values.fold(f32::NEG_INFINITY, |most, value| if value > most { value } else { most })
    };
    if poses().next().is_none() {
        return ([-1.0; 3], [1.0; 3]);
    }
    ([0, 1, 2].map(|axis| most(axis, -1.0)), [0, 1, 2].map(|axis| most(axis, 1.0)))
}

/// The surface that the page draws for a geometry: a box by its size, all others by triangles; its
/// name and colour, and the radii of the balls inside and around it.
fn kind((geometry, mesh): (&Geometry, &Mesh), colour: &[f32; 3]) -> Value {
    let places = mesh.positions.iter().zip(&mesh.normals);
    let inside = places.map(|(position, normal)| dot(*position, *normal));
    let inside =
        inside.fold(
            geometry.bounding_radius(),
            |least, height| {
                if height < least { height } else { least }
            },
        );
    let mut kind = json!({ "covering": inside, "around": geometry.bounding_radius() });
    kind["name"] = geometry.name().into();
    kind["colour"] = colour.as_slice().into();
    if let Geometry::Box { half_extents } = geometry {
        kind["box"] = json!(half_extents);
    } else {
        kind["positions"] = json!(mesh.positions.concat());
        kind["normals"] = json!(mesh.normals.concat());
        kind["triangles"] = json!(mesh.triangles().flatten().collect::<Vec<_>>());
    }
    kind
}

/// Text as the content of an element.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The template with each `{{name}}` replaced; values are not searched for further names.
fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        text.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        let value = values.iter().find(|(known, _)| *known == name);
        text.push_str(value.map_or("", |(_, value)| value));
        rest = after;
    }
    text.push_str(rest);
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture;

    fn page_of_six() -> Page {
        let facts = [("board", "emulated <&>".to_owned())];
        page(&fixture(6), "18 bodies </title>", &facts).expect("six kinds")
    }

    #[test]
    fn the_page_stands_alone_and_keeps_its_facts_as_text() {
        let Page { html, error } = page_of_six();
        assert!(html.contains("<title>18 bodies &lt;/title&gt;</title>"));
        assert!(html.contains("<dt>board</dt><dd>emulated &lt;&amp;&gt;</dd>"));
        assert!(html.contains(&format!("6 frames, {}", error.text())), "{}", error.text());
        for outside in ["http://", "https://", "src=", "import ", "@import", "url("] {
            assert!(!html.contains(outside), "{outside}");
        }
        assert!(!html.contains("{{"), "a place that nothing fills");
        assert_eq!(html.matches("</script>").count(), 3);
    }

    #[test]
    fn the_head_has_a_surface_for_each_kind() {
        let (Page { html, .. }, recording) = (page_of_six(), fixture(6));
        let (_, head) = html.split_once("id=\"head\">").expect("the head");
        let (head, _) = head.split_once("</script>").expect("its end");
        let head: Value = serde_json::from_str(head).expect("JSON");
        assert_eq!(head["of"].as_array().map(Vec::len), Some(18));
        assert_eq!(head["times"].as_array().map(Vec::len), Some(6));
        let kinds = head["kinds"].as_array().expect("kinds");
        for (kind, geometry) in kinds.iter().zip(recording.geometries()) {
            let number = |name: &str| kind[name].as_f64().expect("a number");
            assert!(number("covering") > 0.0 && number("covering") <= number("around") + 1e-6);
            if let Geometry::Capsule { radius, .. } = geometry {
                assert!((number("covering") - f64::from(*radius)).abs() < 1e-6);
            }
            let length = |name: &str| kind[name].as_array().map(Vec::len);
            match length("box") {
                Some(axes) => assert_eq!(axes, 3),
                None => {
                    assert_eq!(length("positions"), length("normals"));
                    let corners = length("positions").expect("positions") / 3;
                    let triangles = kind["triangles"].as_array().expect("triangles");
                    assert!(triangles.iter().all(|corner| corner.as_u64() < Some(corners as u64)));
                }
            }
        }
    }
}
