//! The scenes of the direct-light cases: closed forms of irradiance, as geometry and lights.

use crate::builder::{Part, Polygon, disk, flipped, parallelogram, polygon, sphere};
use crate::cases::{IrradianceFieldCase, Receiver};
use glam::DVec3;
use luxel_scenes::Exitance;
use serde_json::Value;
use std::f64::consts::PI;

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_array(serde_json::from_value(value.clone()).expect("three numbers"))
}

fn polygons(value: &Value) -> Vec<Polygon> {
    let list: Vec<Vec<[f64; 3]>> = serde_json::from_value(value.clone()).expect("polygons");
    list.iter().map(|vertices| polygon(vertices)).collect()
}

/// A diffuse lamp of the given exitance M (W/m²).
fn lamp(exitance: f64, faces: Vec<Polygon>) -> Part {
    Part::lamp("lamp", Exitance::splat(exitance).to_radiance().0.x, faces)
}

/// A black polygon far below, so that a scene with nothing but a light has a face, and that all
/// points lie within its bounds. It neither reflects nor hides anything above a point's horizon.
fn speck() -> Part {
    let corner = DVec3::new(-0.5, -0.5, -20.0);
    Part::grey(
        "speck",
        0.0,
        vec![parallelogram(corner, DVec3::X, DVec3::Y)],
    )
}

/// What a case consists of, and how far its scene is from it.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Its surfaces.
    pub parts: Vec<Part>,
    /// The lights of its scene file.
    pub toml: String,
    /// Error that the geometry and rounding cause, relative to the brightest value of the case: dark
    /// points see the same light.
    pub relative: f64,
    /// Arguments of the command that the case needs.
    pub arguments: Vec<String>,
}

/// Rounding of coordinates on rays and of the light's formula, relative to the value.
pub const ROUNDING: f64 = 2e-6;

/// The scene of a case.
///
/// # Panics
/// When the case is not known or does not hold what it should.
pub fn setup(case: &IrradianceFieldCase) -> Setup {
    let s = &case.setup;
    // All surfaces are black, so that all light is direct; light of the sky is found by rays of the
    // gather, though.
    let arguments: Vec<String> = if s.get("sky").is_some() {
        Vec::new()
    } else {
        ["--components", "direct"].map(str::to_owned).to_vec()
    };
    let exact = |parts, toml: String| Setup {
        parts,
        toml,
        relative: ROUNDING,
        arguments: arguments.clone(),
    };
    match case.id.as_str() {
        "IR-REC-01" | "IR-REC-03" | "IR-PEN-01" => {
            let luminaire: Vec<[f64; 3]> =
                serde_json::from_value(s["luminaire"].clone()).expect("a polygon");
            let mut parts = vec![lamp(number(&s["exitance"]), vec![polygon(&luminaire)])];
            if let Some(occluders) = s.get("occluders") {
                parts.push(Part::grey("occluder", 0.0, polygons(occluders)));
            }
            exact(parts, String::new())
        }
        "IR-DSK-01" => {
            let d = &s["disk"];
            // 48 sides of the same area: second moments differ by (π/48)²/3 = 1.4e-3, which enters
            // multiplied by (r/h)² ≤ 1/16.
            let face = flipped(disk(vector(&d["center"]), number(&d["radius"]), 48));
            Setup {
                parts: vec![lamp(number(&s["exitance"]), vec![face])],
                toml: String::new(),
                relative: 1.4e-3 / 16.0 + ROUNDING,
                arguments,
            }
        }
        "IR-SKY-01" => exact(
            vec![speck()],
            format!(
                "[[light]]\nkind = \"sky\"\nmodel = \"uniform\"\nup = [0, 0, 1]\nradiance = {}\n",
                number(&s["L"])
            ),
        ),
        "IR-SKY-02" => exact(
            vec![speck()],
            format!(
                "[[light]]\nkind = \"sky\"\nmodel = \"cie-overcast\"\nup = [0, 0, 1]\nradiance = {}\n",
                number(&s["Lz"])
            ),
        ),
        "IR-PNT-01" => {
            let light = &s["point_light"];
            let position = vector(&light["position"]).to_array();
            exact(
                vec![speck()],
                format!(
                    "[[light]]\nkind = \"point\"\nposition = {position:?}\nwatts_per_steradian = {}\n",
                    number(&light["intensity"])
                ),
            )
        }
        "IR-SUN-01" => {
            let light = &s["directional"];
            let direction = (-vector(&light["to_light"])).to_array();
            exact(
                vec![speck()],
                format!(
                    "[[light]]\nkind = \"directional\"\ndirection = {direction:?}\nwatts_per_square_metre = {}\n",
                    number(&light["E_normal"])
                ),
            )
        }
        "IR-SPH-01" => {
            let light = &s["sphere_light"];
            // 24 segments: the silhouette is narrower than the sphere's by (π/24)²/2 = 0.9 % at
            // most, and its area, hence the irradiance from far away, smaller by twice that.
            let faces = sphere(DVec3::ZERO, number(&light["radius"]), 24);
            Setup {
                parts: vec![Part::lamp("lamp", number(&light["L"]), faces), speck()],
                toml: String::new(),
                relative: 1.8e-2,
                arguments,
            }
        }
        "IR-LIN-01" => {
            let line = &s["line"];
            let (start, end) = (vector(&line["p0"]), vector(&line["p1"]));
            // A strip of width w and exitance πI/w.
            let width = 1e-3;
            let corner = start - DVec3::X * (width / 2.0);
            let strip = parallelogram(corner, end - start, DVec3::X * width);
            Setup {
                parts: vec![lamp(PI * number(&line["I_per_m"]) / width, vec![strip])],
                toml: String::new(),
                // Of the width, (w/h)²/2, and of rounding.
                relative: 5e-7 + ROUNDING,
                arguments,
            }
        }
        other => panic!("no scene for case {other}"),
    }
}

/// Position and normal of each receiver.
pub fn points(case: &IrradianceFieldCase) -> Vec<(DVec3, DVec3)> {
    let place = |receiver: &Receiver| match (receiver.distance, receiver.angle_deg) {
        // Below the sphere's centre, the normal turned away from it by the angle.
        (Some(distance), Some(angle)) => {
            let (sin, cos) = angle.to_radians().sin_cos();
            (DVec3::new(0.0, 0.0, -distance), DVec3::new(sin, 0.0, cos))
        }
        _ => (receiver.position(), receiver.normal()),
    };
    case.receivers.iter().map(place).collect()
}
