//! Fills texels that got no light from their neighbours, so that filtering finds nothing dark beside a chart.
//!
//! Ring by ring outwards from the charts: an empty texel becomes the mean of its filled neighbours (of eight) that belong to the
//! same chart, that of the first filled of them, until every texel of the page is filled; a buried luxel is filled by luxels of its
//! own chart alone, as long as it has any. A texel between two charts thus continues one of them, the nearer; nothing
//! is mixed. Cost: linear in the texels.

use super::atlas::{Atlas, ChartId};
use super::luxels::{Luxel, Placed};
use super::map::{Lightmap, Texel};
use luxel_scenes::Rgb;

/// The chart that each texel belongs to, nearest first: filled by [`dilate`].
const NO_CHART: u32 = u32::MAX;

/// Fills all texels of a map that are not lit. Returns the chart that each texel continues; `None` where a page has no luxels.
pub fn dilate(
    atlas: &Atlas,
    luxels: &[Luxel],
    triangles: &[Placed],
    map: &mut Lightmap,
) -> Vec<Option<ChartId>> {
    let mut charts = vec![NO_CHART; map.texels.len()];
    for luxel in luxels {
        charts[luxel.texel as usize] = luxel.chart.0;
    }
    // Which chart a buried luxel belongs to.
    let mut buried = vec![
        NO_CHART;
        if map.texels.contains(&Texel::Buried) {
            map.texels.len()
        } else {
            0
        }
    ];
    if !buried.is_empty() {
        mark_buried(atlas, triangles, map, &mut buried);
    }
    let mut front: Vec<usize> = luxels.iter().map(|luxel| luxel.texel as usize).collect();
    front.dedup();
    while !front.is_empty() {
        let mut next = Vec::new();
        for &texel in &front {
            for neighbour in neighbours(map.size, texel) {
                let own = buried.get(neighbour).copied().unwrap_or(NO_CHART);
                if charts[neighbour] == NO_CHART && (own == NO_CHART || own == charts[texel]) {
                    next.push(neighbour);
                }
            }
        }
        next.sort_unstable();
        next.dedup();
        let filled: Vec<(usize, u32, Rgb, Rgb)> = next
            .iter()
            .map(|&texel| {
                let own = buried.get(texel).copied().unwrap_or(NO_CHART);
                fill(map, &charts, texel, own)
            })
            .collect();
        for &(texel, chart, value, error) in &filled {
            charts[texel] = chart;
            map.values[texel] = value;
            map.errors[texel] = error;
        }
        // Buried luxels without a lit neighbour in their chart are filled by whatever comes near.
        front = next;
        if front.is_empty() && !buried.is_empty() {
            front = (0..charts.len())
                .filter(|&texel| charts[texel] != NO_CHART)
                .collect();
            buried = Vec::new();
        }
    }
    charts
        .into_iter()
        .map(|chart| (chart != NO_CHART).then_some(ChartId(chart)))
        .collect()
}

/// The charts of buried luxels: that of the first triangle that touches them.
fn mark_buried(atlas: &Atlas, triangles: &[Placed], map: &Lightmap, buried: &mut [u32]) {
    for triangle in triangles {
        let [columns, rows] = triangle.texels(atlas.size);
        for row in rows {
            for column in columns.clone() {
                let texel = atlas.texel(triangle.page, column, row);
                if map.texels[texel] == Texel::Buried
                    && buried[texel] == NO_CHART
                    && triangle.overlaps(column, row)
                {
                    buried[texel] = triangle.chart.0;
                }
            }
        }
    }
}

/// What a texel becomes: its chart is that of the first filled neighbour, or its own.
fn fill(map: &Lightmap, charts: &[u32], texel: usize, own: u32) -> (usize, u32, Rgb, Rgb) {
    let chart = if own == NO_CHART {
        let mut filled = neighbours(map.size, texel).map(|n| charts[n]);
        filled.find(|&chart| chart != NO_CHART).unwrap_or(NO_CHART)
    } else {
        own
    };
    let (mut value, mut square, mut count) = (Rgb::ZERO, Rgb::ZERO, 0.0);
    for neighbour in neighbours(map.size, texel).filter(|&n| charts[n] == chart) {
        value += map.values[neighbour];
        square += map.errors[neighbour] * map.errors[neighbour];
        count += 1.0;
    }
    // Neighbours err alike: their errors do not average out.
    let error = (square / count).map(f64::sqrt);
    (texel, chart, value / count, error)
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
