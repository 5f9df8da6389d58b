//! Form factors against exact values: pairs of polygons, elements, closed rooms.

use glam::DVec3;
use luxel_solver::form_factors::{
    AnalyticConfig, Polygon, exchange_area, occluded_exchange_area, point_to_polygon,
    polygon_to_polygon,
};
use luxel_tests::cases;
use serde::Deserialize;

/// A file of form factors.
#[derive(Deserialize)]
struct File {
    cases: Vec<Pair>,
    matrices: Vec<Room>,
}

/// A form factor from one surface to another.
#[derive(Deserialize)]
struct Pair {
    id: String,
    group: String,
    from: Surface,
    to: Surface,
    occluders: Vec<Surface>,
    value: f64,
}

/// A closed room: all form factors between its faces.
#[derive(Deserialize)]
struct Room {
    id: String,
    faces: Vec<Vec<[f64; 3]>>,
    matrix: Vec<Vec<f64>>,
}

/// A surface of a pair.
#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Surface {
    Polygon { vertices: Vec<[f64; 3]> },
    Element { point: [f64; 3], normal: [f64; 3] },
    Disk {},
    Sphere {},
    Cylinder {},
}

fn points(vertices: &[[f64; 3]]) -> Vec<DVec3> {
    vertices.iter().copied().map(DVec3::from_array).collect()
}

fn polygon(vertices: &[[f64; 3]]) -> Polygon {
    Polygon::new(&points(vertices)).expect("cases hold polygons with an area")
}

/// The accuracy asked of the analytic form factors: a tenth of the tightest tolerance below.
const ACCURACY: f64 = 1e-11;

/// Relative error, or absolute where the exact value is zero.
fn error(value: f64, exact: f64) -> f64 {
    (value - exact).abs() / if exact > 0.0 { exact } else { 1.0 }
}

/// Stated limits: 1e-10 for everything that is well conditioned; 1e-6 for slivers, whose exchange
/// area is a millionth of the terms it is made of, and for far pairs.
fn tolerance(group: &str) -> f64 {
    match group {
        "sliver" | "tiny_far" => 1e-6,
        _ => 1e-10,
    }
}

#[test]
fn unoccluded_polygons_have_their_exact_form_factor_both_ways() {
    let file: File = cases::load("viewfactors.json");
    let mut checked = 0;
    for case in &file.cases {
        let (Surface::Polygon { vertices: from }, Surface::Polygon { vertices: to }) =
            (&case.from, &case.to)
        else {
            continue;
        };
        if !case.occluders.is_empty() {
            continue;
        }
        let (from, to) = (polygon(from), polygon(to));
        let tolerance = tolerance(&case.group);
        let f = polygon_to_polygon(&from, &to, ACCURACY);
        let e = error(f, case.value);
        assert!(
            e <= tolerance,
            "{}: {f:e} against {:e}, error {e:e}",
            case.id,
            case.value
        );
        let back = polygon_to_polygon(&to, &from, ACCURACY);
        let reverse = case.value * from.area() / to.area();
        let e = error(back, reverse);
        assert!(
            e <= tolerance,
            "{} back: {back:e} against {reverse:e}, error {e:e}",
            case.id
        );
        checked += 1;
    }
    assert!(checked >= 30, "the file holds the pairs: {checked}");
}

#[test]
fn elements_have_their_exact_form_factor() {
    let file: File = cases::load("viewfactors.json");
    let mut checked = 0;
    for case in &file.cases {
        let (Surface::Element { point, normal }, Surface::Polygon { vertices }) =
            (&case.from, &case.to)
        else {
            continue;
        };
        let f = point_to_polygon(
            DVec3::from_array(*point),
            DVec3::from_array(*normal).normalize(),
            &points(vertices),
        );
        let e = error(f, case.value);
        // Some twenty rounded operations of one magnitude; normals are given to 16 digits.
        assert!(e <= 1e-13, "{}: {f} against {}", case.id, case.value);
        checked += 1;
    }
    assert!(checked >= 5, "the file holds the elements: {checked}");
}

#[test]
fn closed_rooms_have_their_matrix_and_rows_that_sum_to_one() {
    let file: File = cases::load("viewfactors.json");
    for room in &file.matrices {
        let faces: Vec<_> = room.faces.iter().map(|f| polygon(f)).collect();
        for (i, from) in faces.iter().enumerate() {
            let mut row_sum = 0.0;
            for (j, to) in faces.iter().enumerate() {
                let f = exchange_area(from, to, ACCURACY) / from.area();
                let e = error(f, room.matrix[i][j]);
                assert!(e <= 1e-10, "{} F[{i}][{j}]: {f}, error {e:e}", room.id);
                row_sum += f;
            }
            assert!(
                (row_sum - 1.0).abs() <= 1e-10,
                "{} row {i}: {row_sum}",
                room.id
            );
        }
    }
}

#[test]
fn occluded_pairs_are_right_within_their_stated_error() {
    let file: File = cases::load("viewfactors.json");
    let config = AnalyticConfig {
        accuracy: ACCURACY,
        points: 4096,
        seed: 0,
    };
    let mut checked = 0;
    for (item, case) in file.cases.iter().enumerate() {
        let (Surface::Polygon { vertices: from }, Surface::Polygon { vertices: to }) =
            (&case.from, &case.to)
        else {
            continue;
        };
        let occluders: Vec<Polygon> = case
            .occluders
            .iter()
            .filter_map(|occluder| match occluder {
                Surface::Polygon { vertices } => Some(polygon(vertices)),
                _ => None,
            })
            .collect();
        if occluders.is_empty() {
            continue;
        }
        let (from, to) = (polygon(from), polygon(to));
        let s = occluded_exchange_area(&from, &to, &occluders, &config, item as u64);
        let (f, error) = (s.area / from.area(), s.standard_error / from.area());
        if case.value == 0.0 {
            assert_eq!(f.to_bits(), 0, "{}: full cover hides all", case.id);
            checked += 1;
            continue;
        }
        // Eight shifts leave seven degrees of freedom: six standard errors are passed once in two
        // thousand pairs.
        let e = (f - case.value).abs();
        assert!(e <= 6.0 * error, "{}: {f}, {e:e} with {error:e}", case.id);
        // A blocker 2^-10 above P makes a step of F across P, worth 2/M; shadows of edges are kinks.
        assert!(e <= 4e-3 * case.value, "{}: {f}, {e:e}", case.id);
        assert!(error <= 4e-3 * case.value, "{}: {error:e}", case.id);
        checked += 1;
    }
    assert!(checked >= 5, "the file holds occluded pairs: {checked}");
}
