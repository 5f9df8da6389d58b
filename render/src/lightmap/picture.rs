//! The atlas as a picture: charts in colours of their own, dark where nothing is, hatched where geometry buries them.

use super::atlas::Atlas;
use super::luxels::Placed;
use super::map::{Lightmap, Texel};
use luxel_solver::sampling::hash;

/// Grey of texels without a face.
const EMPTY: [u8; 3] = [24, 24, 24];

/// sRGB samples of a page, row by row from the top, three to a texel.
pub fn page(atlas: &Atlas, triangles: &[Placed], map: &Lightmap, page: usize) -> Vec<u8> {
    let [width, height] = atlas.size;
    let mut pixels = vec![EMPTY; width * height];
    for triangle in triangles.iter().filter(|t| t.page as usize == page) {
        let object = atlas.charts[triangle.chart.index()].object;
        let colour = colour(u64::from(object.0), u64::from(triangle.chart.0));
        let [columns, rows] = triangle.texels(atlas.size);
        for row in rows {
            for column in columns.clone() {
                if !triangle.overlaps(column, row) {
                    continue;
                }
                let is_buried =
                    map.texels[atlas.texel(triangle.page, column, row)] == Texel::Buried;
                let is_hatched = is_buried && (column + row) % 4 < 2;
                pixels[row * width + column] = if is_hatched { EMPTY } else { colour };
            }
        }
    }
    pixels.into_flattened()
}

/// Charts of one object have one hue and differ in lightness.
fn colour(object: u64, chart: u64) -> [u8; 3] {
    let hue = (hash::mix64(object) >> 40) as f64 / f64::from(1_u32 << 24) * 6.0;
    let light =
        0.55 + 0.4 * (hash::mix64(chart ^ 0x5bd1_e995) >> 40) as f64 / f64::from(1_u32 << 24);
    // The channels of a pure hue: 1 within one sixth of their own, falling to 0 at two.
    [0.0, 2.0, 4.0].map(|own| {
        let away = (hue - own).abs().min(6.0 - (hue - own).abs());
        let pure = (2.0 - away).clamp(0.0, 1.0);
        (255.0 * light * (0.35 + 0.65 * pure)) as u8
    })
}
