//! A baked folder as one HTML page that needs nothing else: the scene with its maps, to be looked at from all sides.
//!
//! Style, scripts, three.js and the content are in it; its policy (`Content-Security-Policy`) forbids the browser to load anything
//! else. The same content gives the same bytes. `page/README.md` says what the files beside this one are.
//!
//! Size: 4/3 of the scene's file and of 8 bytes a texel, the pictures of charts, and 0.7 MB.

mod content;
mod encode;
mod summary;

pub use content::{Content, Maps};

use super::manifest::{Manifest, Page};
use crate::report::html::{base64, escape};
use serde::Serialize;

/// The frame, with `{{names}}` where parts go.
const FRAME: &str = include_str!("page/view.html");
const STYLE: &str = include_str!("page/view.css");
const THREE: &str = include_str!("page/three.bundle.js");
const SURFACE: &str = include_str!("page/surface.js");
const VIEW: &str = include_str!("page/view.js");

/// What the scripts read.
#[derive(Serialize)]
struct Data<'a> {
    manifest: &'a Manifest,
    glb: String,
    pages: Vec<PageData>,
}

/// The maps of a page; bytes are in base 64.
#[derive(Serialize)]
struct PageData {
    width: usize,
    height: usize,
    /// What a stored 1 stands for.
    scale: f32,
    light: String,
    info: String,
    charts: String,
}

impl PageData {
    fn new(page: &Page, maps: &Maps) -> Self {
        let (scale, light) = encode::light(&maps.light);
        let info = encode::info(&maps.light, &maps.error, &maps.validity);
        Self {
            width: page.width,
            height: page.height,
            scale,
            light: base64(&light),
            info: base64(&info),
            charts: base64(&maps.charts),
        }
    }
}

/// The page.
///
/// # Errors
/// When a number of the manifest cannot be written as JSON.
///
/// # Panics
/// When the maps of a page differ in size.
pub fn page(content: &Content) -> Result<String, serde_json::Error> {
    let manifest = &content.manifest;
    let pages = manifest.lightmap.pages.iter().zip(&content.pages);
    let data = Data {
        manifest,
        glb: base64(&content.glb),
        pages: pages
            .map(|(page, maps)| PageData::new(page, maps))
            .collect(),
    };
    // Within a script element the letters of markup would end it.
    let data = serde_json::to_string(&data)?.replace('<', "\\u003c");
    Ok(filled(FRAME, |name| match name {
        "scene" => escape(&manifest.scene).into(),
        "software" => escape(&manifest.software).into(),
        "subtitle" => summary::subtitle(manifest).into(),
        "summary" => summary::summary(manifest).into(),
        "content" => data.as_str().into(),
        "style" => STYLE.into(),
        "three" => THREE.into(),
        "surface" => SURFACE.into(),
        "view" => VIEW.into(),
        other => unreachable!("the frame names {other}, which is no part"),
    }))
}

/// A frame with its names replaced; what they are replaced by is not looked at again.
fn filled<'a>(frame: &str, part: impl Fn(&str) -> std::borrow::Cow<'a, str>) -> String {
    let mut pieces = frame.split("{{");
    let mut text = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").unwrap_or((piece, ""));
        text.push_str(&part(name));
        text.push_str(rest);
    }
    text
}

#[cfg(test)]
mod tests;
