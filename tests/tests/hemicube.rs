//! Hemicube form factors against exact values: the error falls with the resolution.

use glam::DVec3;
use luxel_solver::form_factors::{Facet, FacetSide, HemicubeConfig, Polygon, hemicube};
use luxel_tests::cases;
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    cases: Vec<Pair>,
}

#[derive(Deserialize)]
struct Pair {
    id: String,
    group: String,
    from: Surface,
    to: Surface,
    occluders: Vec<Surface>,
    value: f64,
}

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Surface {
    Polygon {
        vertices: Vec<[f64; 3]>,
    },
    #[serde(other)]
    Other,
}

impl Surface {
    fn polygon(&self) -> Option<Polygon> {
        let Self::Polygon { vertices } = self else {
            return None;
        };
        let vertices: Vec<_> = vertices.iter().copied().map(DVec3::from_array).collect();
        Some(Polygon::new(&vertices).expect("cases hold polygons with an area"))
    }
}

/// A pair of polygons, what stands between them, and its exact form factor.
struct Case {
    id: String,
    group: String,
    pair: [Polygon; 2],
    occluders: Vec<Polygon>,
    exact: f64,
}

/// Pairs that a hemicube can see: of a form factor of a few pixels at least.
fn pairs() -> Vec<Case> {
    cases::load::<File>("viewfactors.json")
        .cases
        .into_iter()
        .filter_map(|case| {
            Some(Case {
                pair: [case.from.polygon()?, case.to.polygon()?],
                occluders: case
                    .occluders
                    .iter()
                    .map(Surface::polygon)
                    .collect::<Option<_>>()?,
                id: case.id,
                group: case.group,
                exact: case.value,
            })
        })
        .filter(|case| case.exact >= 1e-2)
        .collect()
}

/// The form factor of a case, estimated.
fn estimate(case: &Case, resolution: usize) -> f64 {
    let facet = |polygon, front| Facet {
        vertices: Polygon::vertices(polygon),
        normal: polygon.normal(),
        front,
        back: FacetSide::Black,
    };
    // Only the row of the first is wanted: the second takes its place as the one patch that counts.
    let mut facets = vec![
        facet(&case.pair[0], FacetSide::Black),
        facet(&case.pair[1], FacetSide::Counted(0)),
    ];
    facets.extend(case.occluders.iter().map(|o| facet(o, FacetSide::Black)));
    let config = HemicubeConfig::balanced(resolution);
    hemicube(&case.pair[..1], &facets, &config).get(0, 0)
}

#[test]
fn the_error_falls_at_first_order_in_every_group() {
    const RESOLUTIONS: [usize; 4] = [64, 128, 256, 512];
    let cases = pairs();
    let mut groups: Vec<String> = cases.iter().map(|c| c.group.clone()).collect();
    groups.dedup();
    println!("| group | 64 | 128 | 256 | 512 | order |");
    println!("|---|---|---|---|---|---|");
    for group in &groups {
        let members: Vec<&Case> = cases.iter().filter(|c| &c.group == group).collect();
        let errors = RESOLUTIONS.map(|resolution| {
            let squares: f64 = members
                .iter()
                .map(|case| (estimate(case, resolution) / case.exact - 1.0).powi(2))
                .sum();
            (squares / members.len() as f64).sqrt()
        });
        let order = (errors[0] / errors[3]).log2() / 3.0;
        let cells: Vec<_> = errors.iter().map(|e| format!("{e:.1e}")).collect();
        println!("| {group} | {} | {order:.1} |", cells.join(" | "));
        let names: Vec<_> = members.iter().map(|c| &c.id).collect();
        // Eight times the resolution: an error at least eight times smaller.
        assert!(order >= 1.0, "{group} {names:?}: {errors:?}, order {order}");
        // A jump of F across the patch (a plane of another that cuts it) costs 2/M = 8/N.
        assert!(errors[3] <= 8.0 / 512.0, "{group} {names:?}: {errors:?}");
    }
    assert!(groups.len() >= 6, "the file holds the groups: {groups:?}");
}
