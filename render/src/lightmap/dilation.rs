//! Fills texels that got no light from their neighbours, so that filtering finds nothing dark beside a chart.
//!
//! Ring by ring outwards from the charts: an empty texel becomes the mean of its filled neighbours (of eight) that belong to the
//! same chart, that of the first filled of them, until every texel of the page is filled. A texel between two charts thus
//! continues one of them, the nearer; nothing is mixed. Luxels that geometry buries are filled by their own chart, and only as many
//! rings as there is padding, which is all that filtering reads: no light gets deeper, and their value stays zero.
//! Cost: linear in the texels.

use super::atlas::Atlas;
use super::luxels::{Luxel, Placed};
use super::map::{Lightmap, Texel};
use luxel_scenes::Rgb;

const NO_CHART: u32 = u32::MAX;

/// Fills the texels of a map that are not lit.
pub fn dilate(atlas: &Atlas, luxels: &[Luxel], triangles: &[Placed], map: &mut Lightmap) {
    let mut charts = vec![NO_CHART; map.texels.len()];
    let mut front: Vec<usize> = luxels.iter().map(|luxel| luxel.texel as usize).collect();
    front.dedup();
    for luxel in luxels {
        charts[luxel.texel as usize] = luxel.chart.0;
    }
    let buried = charts_of_buried(atlas, triangles, map);
    let mut ring = 0;
    while !front.is_empty() {
        ring += 1;
        let mut next = Vec::new();
        for &texel in &front {
            let chart = charts[texel];
            let may_be_filled = |&neighbour: &usize| {
                charts[neighbour] == NO_CHART
                    && match map.texels[neighbour] {
                        Texel::Buried => ring <= atlas.padding && buried[neighbour] == chart,
                        _ => true,
                    }
            };
            next.extend(neighbours(map.size, texel).filter(may_be_filled));
        }
        next.sort_unstable();
        next.dedup();
        let filled: Vec<Filled> = next
            .iter()
            .map(|&texel| match map.texels[texel] {
                Texel::Buried => fill(map, &charts, texel, buried[texel]),
                _ => fill(map, &charts, texel, first_chart(map, &charts, texel)),
            })
            .collect();
        for filled in filled {
            charts[filled.texel] = filled.chart;
            map.values[filled.texel] = filled.value;
            map.errors[filled.texel] = filled.error;
        }
        front = next;
    }
}

/// By texel the chart of the first triangle that touches it, where it is buried; empty where none is.
fn charts_of_buried(atlas: &Atlas, triangles: &[Placed], map: &Lightmap) -> Vec<u32> {
    if !map.texels.contains(&Texel::Buried) {
        return Vec::new();
    }
    let mut charts = vec![NO_CHART; map.texels.len()];
    for triangle in triangles {
        let [columns, rows] = triangle.texels(atlas.size);
        for row in rows {
            for column in columns.clone() {
                let texel = atlas.texel(triangle.page, column, row);
                let is_wanted = map.texels[texel] == Texel::Buried && charts[texel] == NO_CHART;
                if is_wanted && triangle.overlaps(column, row) {
                    charts[texel] = triangle.chart.0;
                }
            }
        }
    }
    charts
}

/// What a texel becomes.
struct Filled {
    texel: usize,
    chart: u32,
    value: Rgb,
    error: Rgb,
}

/// The chart of the first filled neighbour.
fn first_chart(map: &Lightmap, charts: &[u32], texel: usize) -> u32 {
    let mut filled = neighbours(map.size, texel).map(|neighbour| charts[neighbour]);
    filled.find(|&chart| chart != NO_CHART).unwrap_or(NO_CHART)
}

/// The mean of the neighbours that belong to a chart; there is one.
fn fill(map: &Lightmap, charts: &[u32], texel: usize, chart: u32) -> Filled {
    let (mut value, mut square, mut count) = (Rgb::ZERO, Rgb::ZERO, 0.0);
    for neighbour in neighbours(map.size, texel).filter(|&n| charts[n] == chart) {
        value += map.values[neighbour];
        square += map.errors[neighbour] * map.errors[neighbour];
        count += 1.0;
    }
    Filled {
        texel,
        chart,
        value: value / count,
        // Neighbours err alike: their errors do not average out.
        error: (square / count).map(f64::sqrt),
    }
}

/// The neighbours of a texel in its page: those at its sides, then those at its corners.
fn neighbours(size: [usize; 2], texel: usize) -> impl Iterator<Item = usize> {
    const AROUND: [(isize, isize); 8] = [
        (0, -1),
        (-1, 0),
        (1, 0),
        (0, 1),
        (-1, -1),
        (1, -1),
        (-1, 1),
        (1, 1),
    ];
    let [width, height] = size;
    let page = texel / (width * height);
    let (column, row) = (texel % width, texel / width % height);
    AROUND.into_iter().filter_map(move |(dx, dy)| {
        let column = column.checked_add_signed(dx).filter(|&x| x < width)?;
        let row = row.checked_add_signed(dy).filter(|&y| y < height)?;
        Some((page * height + row) * width + column)
    })
}
