//! Radiosity of rooms against exact values: every solver, the furnace, convergence, the energy ledger.

use glam::DVec3;
use luxel_scenes::{Exitance, Irradiance, Radiosity, Reflectance, Rgb};
use luxel_solver::form_factors::{
    AnalyticConfig, AnalyticFactors, Polygon, analytic, closure, unoccluded_matrix,
};
use luxel_solver::solvers::{
    Ambient, Config, Ledger, Outcome, Solution, System, SystemError, Tolerance, conjugate_gradient,
    direct, gauss_seidel, jacobi, no_progress, source, southwell,
};
use luxel_solver::transport::{Dense, Transport};
use luxel_tests::cases;
use serde::Deserialize;
use std::f64::consts::PI;

#[derive(Deserialize)]
struct File {
    enclosures: Vec<Room>,
}

/// A room and what is known of its radiosity.
#[derive(Deserialize)]
struct Room {
    id: String,
    geometry: Geometry,
    #[serde(default)]
    emission: Emission,
    #[serde(default)]
    reflectance: Channels,
    reference: Reference,
}

#[derive(Deserialize)]
struct Geometry {
    #[serde(default)]
    faces: Vec<Face>,
}

#[derive(Deserialize)]
struct Face {
    vertices: Vec<[f64; 3]>,
}

/// Emission per face, of a point source, or none.
#[derive(Default, Deserialize)]
#[serde(untagged)]
enum Emission {
    Faces(Channels),
    Point {
        point_source: PointSource,
    },
    #[default]
    Unknown,
}

#[derive(Deserialize)]
struct PointSource {
    /// In lm or W, in all directions alike.
    flux: f64,
}

/// A value per face, the same in all channels or not.
#[derive(Default, Deserialize)]
#[serde(untagged)]
enum Channels {
    Three([Vec<f64>; 3]),
    One(Vec<f64>),
    #[default]
    None,
    Same(#[expect(dead_code, reason = "the reflectance of curved rooms is not read here")] f64),
}

impl Channels {
    fn colours(&self) -> Option<Vec<Rgb>> {
        match self {
            Self::One(values) => Some(values.iter().copied().map(Rgb::splat).collect()),
            Self::Three([r, g, b]) => Some(
                r.iter()
                    .zip(g)
                    .zip(b)
                    .map(|((&r, &g), &b)| Rgb::new(r, g, b))
                    .collect(),
            ),
            Self::None | Self::Same(_) => None,
        }
    }
}

#[derive(Deserialize)]
struct Reference {
    #[serde(rename = "B_everywhere")]
    everywhere: Option<String>,
    #[serde(rename = "constant_per_face_B")]
    constant_per_face: Option<Numbers>,
    #[serde(rename = "converged_face_average_B")]
    converged: Option<Channels>,
    #[serde(rename = "converged_abs_uncertainty")]
    converged_uncertainty: Option<Channels>,
    escaped_flux_constant_per_face: Option<String>,
    at_edge_limit: Option<serde_json::Value>,
    area_average_total_irradiance: Option<String>,
}

/// Decimal strings per face, the same in all channels or not.
#[derive(Deserialize)]
#[serde(untagged)]
enum Numbers {
    One(Vec<String>),
    Three([Vec<String>; 3]),
}

fn number(text: &str) -> f64 {
    text.parse().expect("a decimal number")
}

impl Numbers {
    fn colours(&self) -> Vec<Rgb> {
        match self {
            Self::One(values) => values.iter().map(|v| Rgb::splat(number(v))).collect(),
            Self::Three([r, g, b]) => r
                .iter()
                .zip(g)
                .zip(b)
                .map(|((r, g), b)| Rgb::new(number(r), number(g), number(b)))
                .collect(),
        }
    }
}

fn rooms() -> Vec<Room> {
    cases::load::<File>("enclosures.json").enclosures
}

/// Rooms of planar faces none of which stands between two others: their number of faces tells.
fn open_rooms() -> impl Iterator<Item = Room> {
    rooms()
        .into_iter()
        .filter(|room| (2..=6).contains(&room.geometry.faces.len()))
}

fn points(face: &Face) -> Vec<DVec3> {
    face.vertices
        .iter()
        .copied()
        .map(DVec3::from_array)
        .collect()
}

/// One patch per face.
fn whole_faces(room: &Room) -> Vec<Polygon> {
    room.geometry
        .faces
        .iter()
        .map(|face| Polygon::new(&points(face)).expect("faces have an area"))
        .collect()
}

/// A face cut into patches, finer towards its edges: nodes at (1 − cos πk/m)/2 along each side. For
/// triangles the last two corners of a quadrilateral coincide.
fn graded(face: &Face, across: usize) -> Vec<Polygon> {
    let v = points(face);
    let (a, b, c, d) = (v[0], v[1], v[2], v[v.len() - 1]);
    let sides = [a.distance(b), a.distance(d)];
    let shortest = sides[0].min(sides[1]);
    // Long sides get more patches, less than in proportion.
    let counts = sides.map(|side| (across as f64 * (side / shortest).sqrt()).round() as usize);
    let node = |k: usize, m: usize| 0.5 - 0.5 * (PI * k as f64 / m as f64).cos();
    let at = |i: usize, j: usize| {
        let (s, t) = (node(i, counts[0]), node(j, counts[1]));
        a.lerp(b, s).lerp(d.lerp(c, s), t)
    };
    let mut patches = Vec::new();
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            patches.push(Polygon::new(&corners).expect("patches have an area"));
        }
    }
    patches
}

/// The values of faces handed to their patches.
struct Lit {
    areas: Vec<f64>,
    face: Vec<usize>,
    matrix: Dense,
    reflectance: Vec<Reflectance>,
    emission: Vec<Exitance>,
    source: Vec<Radiosity>,
}

fn lit(room: &Room, patches: Vec<Vec<Polygon>>, accuracy: f64) -> Option<Lit> {
    let rho = room.reflectance.colours()?;
    let Emission::Faces(emission) = &room.emission else {
        return None;
    };
    let emission = emission.colours()?;
    let face: Vec<usize> = patches
        .iter()
        .enumerate()
        .flat_map(|(k, p)| vec![k; p.len()])
        .collect();
    let polygons: Vec<Polygon> = patches.into_iter().flatten().collect();
    let reflectance: Vec<_> = face.iter().map(|&k| Reflectance(rho[k])).collect();
    let emission: Vec<_> = face.iter().map(|&k| Exitance(emission[k])).collect();
    let no_light = vec![Irradiance::ZERO; face.len()];
    Some(Lit {
        areas: polygons.iter().map(Polygon::area).collect(),
        matrix: unoccluded_matrix(&polygons, accuracy),
        source: source(&emission, &reflectance, &no_light),
        face,
        reflectance,
        emission,
    })
}

fn one_patch_per_face(room: &Room) -> Option<Lit> {
    let faces = whole_faces(room).into_iter().map(|f| vec![f]).collect();
    lit(room, faces, 1e-12)
}

impl Lit {
    fn system(&self) -> System<'_> {
        System::new(&self.matrix, &self.areas, &self.reflectance, &self.source)
            .expect("rooms contract")
    }
}

/// Every solver, at an error bound of 1e-12 of the largest radiosity.
fn every_solver(system: &System) -> [(&'static str, Solution); 6] {
    let config = Config {
        tolerance: Tolerance::Error(1e-12),
        max_iterations: 1_000_000,
    };
    [
        ("jacobi", jacobi(system, &config, no_progress)),
        ("gauss-seidel", gauss_seidel(system, &config, no_progress)),
        (
            "southwell",
            southwell(system, Ambient::None, &config, no_progress),
        ),
        (
            "southwell with ambient",
            southwell(system, Ambient::Estimated, &config, no_progress),
        ),
        (
            "conjugate gradient",
            conjugate_gradient(system, &config, no_progress).expect("reciprocal"),
        ),
        ("direct", direct(system).expect("a regular matrix")),
    ]
}

/// The largest relative difference over the channels, against the larger of the exact value and
/// `floor`.
fn error(value: Rgb, exact: Rgb, floor: Rgb) -> f64 {
    ((value - exact).abs() / exact.max(floor)).max_element()
}

#[test]
fn every_solver_has_the_exact_radiosity_of_one_patch_per_face() {
    let mut checked = 0;
    for room in open_rooms() {
        let Some(reference) = &room.reference.constant_per_face else {
            continue;
        };
        let exact = reference.colours();
        let lit = one_patch_per_face(&room).expect("faces emit");
        let system = lit.system();
        for (name, solution) in every_solver(&system) {
            assert_eq!(solution.outcome, Outcome::Converged, "{} {name}", room.id);
            let largest = solution.radiosity.iter().fold(Rgb::ZERO, |m, b| m.max(b.0));
            for (b, &exact) in solution.radiosity.iter().zip(&exact) {
                // Form factors to 1e-12, amplified by 1/(1 - rho) <= 20; the solver's bound is
                // relative to the largest radiosity.
                let e = error(b.0, exact, largest * 1e-3);
                assert!(
                    e <= 1e-9,
                    "{} {name}: {b:?} against {exact}, {e:e}",
                    room.id
                );
            }
            let none = vec![Irradiance::ZERO; lit.areas.len()];
            let ledger = Ledger::new(&system, &solution, &lit.emission, &none);
            // Sums of at most six terms of one sign, and B, E consistent to rounding.
            assert!(
                ledger.imbalance().abs().max_element() < 1e-13,
                "{} {name}: {ledger:?}",
                room.id
            );
            // What is asked of the solver, and the rounding of reciprocal factors.
            assert!(
                ledger.unaccounted().max_element() < 1e-12 + 1e-13,
                "{} {name}: {ledger:?}",
                room.id
            );
            if let Some(escaped) = &room.reference.escaped_flux_constant_per_face {
                let exact = number(escaped);
                let e = (ledger.escaped.0.x / exact - 1.0).abs();
                assert!(e <= 1e-9, "{} {name}: escaped, error {e:e}", room.id);
            }
        }
        checked += 1;
    }
    assert!(checked >= 8, "the file holds the rooms: {checked}");
}

#[test]
fn a_furnace_has_one_radiosity_everywhere() {
    let mut checked = 0;
    for room in open_rooms() {
        let Some(reference) = &room.reference.everywhere else {
            continue;
        };
        let exact = Rgb::splat(number(reference));
        for patches in [1, 3] {
            let faces = room
                .geometry
                .faces
                .iter()
                .map(|f| graded(f, patches))
                .collect();
            let lit = lit(&room, faces, 1e-12).expect("faces emit");
            let system = lit.system();
            let gain = system.gain().max_element();
            let defect = closure(&lit.matrix).largest_defect;
            assert!(defect < 1e-12, "{}: closure {defect:e}", room.id);
            for (name, solution) in every_solver(&system) {
                for b in &solution.radiosity {
                    let e = error(b.0, exact, Rgb::ZERO);
                    // dB/B <= (closure defect) rho/(1 - rho), and the solver's bound.
                    let tolerance = defect * gain / (1.0 - gain) + 1e-12 + 1e-14 / (1.0 - gain);
                    assert!(e <= tolerance, "{} {name}: {b:?}, {e:e}", room.id);
                }
            }
        }
        checked += 1;
    }
    assert!(checked >= 3, "the file holds furnaces: {checked}");
}

#[test]
fn a_furnace_with_a_box_in_it_has_one_radiosity_everywhere() {
    let mut checked = 0;
    for room in rooms().into_iter().filter(|r| r.geometry.faces.len() > 6) {
        let (Some(exact), Some(rho), Emission::Faces(emission)) = (
            &room.reference.everywhere,
            room.reflectance.colours(),
            &room.emission,
        ) else {
            continue;
        };
        if room.geometry.faces.iter().any(|f| !is_convex(&points(f))) {
            continue;
        }
        let exact = number(exact);
        let faces = whole_faces(&room);
        let patches: Vec<_> = faces.iter().cloned().map(|f| vec![f]).collect();
        let config = AnalyticConfig {
            accuracy: 1e-11,
            points: 4096,
            seed: 0,
        };
        let AnalyticFactors { matrix, .. } = analytic(&patches, &faces, &config);
        let reflectance: Vec<_> = rho.into_iter().map(Reflectance).collect();
        let emission = emission.colours().expect("faces emit");
        let source: Vec<_> = emission.into_iter().map(Radiosity).collect();
        let areas: Vec<f64> = faces.iter().map(Polygon::area).collect();
        let system = System::new(&matrix, &areas, &reflectance, &source).expect("a valid system");
        let defect = closure(&matrix).largest_defect;
        // Eight lattices of 610 points each see the shadows of a box: O(1/M²) of each entry.
        assert!(defect < 1e-4, "{}: closure {defect:e}", room.id);
        let gain = system.gain().max_element();
        for b in &direct(&system).expect("a regular matrix").radiosity {
            let e = (b.0.x / exact - 1.0).abs();
            let tolerance = defect * gain / (1.0 - gain) + 1e-12;
            assert!(e <= tolerance, "{}: {b:?}, {e:e}", room.id);
        }
        checked += 1;
    }
    assert!(checked >= 1, "the file holds rooms with boxes");
}

/// True when all corners turn the same way.
fn is_convex(polygon: &[DVec3]) -> bool {
    let n = polygon.len();
    let turn = |k: usize| {
        let [a, b, c] = [polygon[k], polygon[(k + 1) % n], polygon[(k + 2) % n]];
        (b - a).cross(c - b)
    };
    (0..n).all(|k| turn(k).dot(turn(0)) >= 0.0)
}

fn cube() -> Vec<Polygon> {
    let room = rooms().into_iter().find(|r| r.id == "EN-FUR-01");
    whole_faces(&room.expect("the unit cube is among the cases"))
}

#[test]
fn sweeps_in_a_closed_cube_are_those_of_theory() {
    let matrix = unoccluded_matrix(&cube(), 1e-13);
    for (rho, jacobi_sweeps, gauss_seidel_sweeps) in [
        (0.5, 20, 11),
        (0.9, 132, 67),
        (0.99, 1375, 689),
        (0.999, 13809, 6906),
        (0.9999, 138_149, 69_075),
    ] {
        let reflectance = [Reflectance::splat(rho); 6];
        let source = [Radiosity::splat(1.0); 6];
        let system =
            System::new(&matrix, &[1.0; 6], &reflectance, &source).expect("a valid system");
        let config = Config {
            tolerance: Tolerance::Residual(1e-6),
            max_iterations: 200_000,
        };
        let slow = jacobi(&system, &config, no_progress).iterations;
        let fast = gauss_seidel(&system, &config, no_progress).iterations;
        for (name, sweeps, theory) in [
            ("jacobi", slow, jacobi_sweeps),
            ("gauss-seidel", fast, gauss_seidel_sweeps),
        ] {
            // ln 1e-6 / ln rate, rounded up; the first sweep may differ from the asymptotic rate by one.
            assert!(
                (sweeps as f64 - f64::from(theory)).abs() <= 1.0,
                "rho {rho} {name}: {sweeps} sweeps, theory {theory}"
            );
        }
    }
}

#[test]
fn gauss_seidel_converges_at_the_rate_of_the_cube() {
    let matrix = unoccluded_matrix(&cube(), 1e-13);
    // Spectral radii of the Gauss-Seidel matrix of the unit cube.
    for (rho, rate) in [
        (0.5, 0.274),
        (0.9, 0.812),
        (0.99, 0.980_122),
        (0.9999, 0.9998),
    ] {
        let reflectance = [Reflectance::splat(rho); 6];
        let source = [Radiosity::splat(1.0); 6];
        let system =
            System::new(&matrix, &[1.0; 6], &reflectance, &source).expect("a valid system");
        let residual = |sweeps| {
            let config = Config {
                tolerance: Tolerance::Residual(0.0),
                max_iterations: sweeps,
            };
            gauss_seidel(&system, &config, no_progress).residual.x
        };
        let measured = residual(11) / residual(10);
        // Three printed digits; after ten sweeps the other eigenvalues have died out.
        assert!((measured - rate).abs() <= 6e-4, "rho {rho}: {measured}");
        let ratio = measured.ln() / rho.ln();
        assert!(
            (1.85..=2.0).contains(&ratio),
            "rho {rho}: log rates {ratio}"
        );
    }
}

#[test]
fn converged_meshes_have_the_exact_face_averages() {
    let mut checked = 0;
    for room in open_rooms() {
        let (Some(reference), Some(uncertainty)) = (
            room.reference
                .converged
                .as_ref()
                .and_then(Channels::colours),
            room.reference
                .converged_uncertainty
                .as_ref()
                .and_then(Channels::colours),
        ) else {
            continue;
        };
        let faces = room.geometry.faces.iter().map(|f| graded(f, 12)).collect();
        let lit = lit(&room, faces, 1e-6).expect("faces emit");
        let config = Config {
            tolerance: Tolerance::Error(1e-7),
            max_iterations: 1000,
        };
        let solution = jacobi(&lit.system(), &config, no_progress);
        for (face, (&exact, &uncertainty)) in reference.iter().zip(&uncertainty).enumerate() {
            let mut flux = Rgb::ZERO;
            let mut area = 0.0;
            for (k, b) in solution.radiosity.iter().enumerate() {
                if lit.face[k] == face {
                    flux += b.0 * lit.areas[k];
                    area += lit.areas[k];
                }
            }
            let average = flux / area;
            // Piecewise constants on m graded elements a side: averages are O(1/m^2). Measured 1.5e-3 for
            // m = 8, so below 7e-4 for m = 12.
            let tolerance = exact * 1e-3 + uncertainty * 4.0;
            assert!(
                (average - exact).abs().cmple(tolerance).all(),
                "{} face {face}: {average} against {exact}",
                room.id
            );
        }
        checked += 1;
    }
    assert!(checked >= 5, "the file holds converged rooms: {checked}");
}

#[test]
fn the_dark_side_of_a_corner_tends_to_its_limit_at_the_edge() {
    let room = rooms()
        .into_iter()
        .find(|r| r.id == "EN-LCO-01")
        .expect("the corner is a case");
    assert!(
        room.reference.at_edge_limit.is_some(),
        "the limit is stated"
    );
    let faces = room.geometry.faces.iter().map(|f| graded(f, 24)).collect();
    let lit = lit(&room, faces, 1e-6).expect("faces emit");
    let b = direct(&lit.system()).expect("a regular matrix").radiosity;
    // The patches nearest to the edge, half way along it, on both faces.
    let brightest = |face: usize| {
        b.iter()
            .zip(&lit.face)
            .filter(|&(_, &f)| f == face)
            .map(|(b, _)| b.0.x)
            .fold(0.0, f64::max)
    };
    let (lit_side, dark_side) = (brightest(0), brightest(1));
    // In the corner E2 = B1/2 as between half planes; elements at the edge are 0.4 % of the side.
    let ratio = dark_side / (0.8 * lit_side / 2.0);
    assert!((ratio - 1.0).abs() < 0.02, "{dark_side} beside {lit_side}");
}

#[test]
fn light_from_no_patch_enters_through_the_source() {
    let room = rooms()
        .into_iter()
        .find(|r| r.id == "EN-AVG-01")
        .expect("the room is a case");
    let Emission::Point { point_source } = &room.emission else {
        panic!("a point source lights the room");
    };
    let faces = whole_faces(&room);
    let areas: Vec<f64> = faces.iter().map(Polygon::area).collect();
    let matrix = unoccluded_matrix(&faces, 1e-12);
    let rho = room.reflectance.colours().expect("faces reflect");
    let reflectance: Vec<_> = rho.into_iter().map(Reflectance).collect();
    // From the centre of a cube each face takes a sixth.
    let direct_light: Vec<_> = areas
        .iter()
        .map(|a| Irradiance::splat(point_source.flux / 6.0 / a))
        .collect();
    let emission = vec![Exitance::ZERO; areas.len()];
    let s = source(&emission, &reflectance, &direct_light);
    let system = System::new(&matrix, &areas, &reflectance, &s).expect("a valid system");
    let solution = direct(&system).expect("a regular matrix");
    let exact = number(
        room.reference
            .area_average_total_irradiance
            .as_deref()
            .expect("given"),
    );
    for (e, d) in solution.irradiance.iter().zip(&direct_light) {
        let total = e.0.x + d.0.x;
        assert!(
            (total / exact - 1.0).abs() < 1e-11,
            "{total} against {exact}"
        );
    }
    let ledger = Ledger::new(&system, &solution, &emission, &direct_light);
    assert!(
        (ledger.direct.0.x / point_source.flux - 1.0).abs() < 1e-14,
        "all of it arrives"
    );
    assert!(ledger.imbalance().abs().max_element() < 1e-13, "{ledger:?}");
}

#[test]
fn solutions_are_linear_in_the_light_over_eight_decades() {
    let matrix = unoccluded_matrix(&cube(), 1e-13);
    let reflectance = [0.2, 0.5, 0.9, 0.3, 0.7, 0.99].map(Reflectance::splat);
    let solve = |source: [f64; 6], f: &dyn Fn(&System) -> Solution| {
        let source = source.map(Radiosity::splat);
        f(&System::new(&matrix, &[1.0; 6], &reflectance, &source).expect("a valid system"))
            .radiosity
    };
    let by_lu = |system: &System| direct(system).expect("a regular matrix");
    let both = solve([1.0, 0.0, 0.0, 0.0, 0.0, 1e8], &by_lu);
    let dim = solve([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], &by_lu);
    let bright = solve([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], &by_lu);
    for k in 0..6 {
        let sum = bright[k].0 * 1e8 + dim[k].0;
        // LU of a matrix of condition 100 in six unknowns.
        assert!(error(both[k].0, sum, Rgb::ZERO) < 1e-12, "face {k}");
    }
}

#[test]
fn what_does_not_contract_is_refused() {
    let matrix = unoccluded_matrix(&cube(), 1e-13);
    let source = [Radiosity::splat(1.0); 6];
    for bad in [1.0, 1.5, -0.1, f64::NAN] {
        let mut reflectance = [Reflectance::splat(0.5); 6];
        reflectance[4].0.y = bad;
        assert!(
            matches!(
                System::new(&matrix, &[1.0; 6], &reflectance, &source),
                Err(SystemError::Reflectance { unknown: 4, .. })
            ),
            "reflectance {bad}"
        );
    }
    let doubled: Vec<f64> = (0..6)
        .flat_map(|i| matrix.row(i).to_vec())
        .map(|f| 2.0 * f)
        .collect();
    let doubled = Dense::new(6, doubled).expect("a matrix");
    let reflectance = [Reflectance::splat(0.6); 6];
    assert!(
        matches!(
            System::new(&doubled, &[1.0; 6], &reflectance, &source),
            Err(SystemError::NotContracting { .. })
        ),
        "rows that sum to two"
    );
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        let mut source = source;
        source[2].0.z = bad;
        assert!(
            matches!(
                System::new(&matrix, &[1.0; 6], &reflectance, &source),
                Err(SystemError::Source { unknown: 2, .. })
            ),
            "source {bad}"
        );
    }
    assert!(
        (matrix.row_sum(0) - 1.0).abs() < 1e-13,
        "the cube itself is closed"
    );
}
