//! Form factors: time and error side by side.
//!
//! The error stands in the name of each benchmark, measured against a reference that is more exact by
//! orders of magnitude.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use luxel_solver::form_factors::{
    AnalyticConfig, Facet, FacetSide, HemicubeConfig, Polygon, closure, exchange_area, hemicube,
    occluded_exchange_area, point_to_polygon, unoccluded_matrix,
};
use std::hint::black_box;

/// A square of side 1 at height z, facing down.
fn ceiling(z: f64) -> [DVec3; 4] {
    [
        DVec3::new(-0.5, 0.5, z),
        DVec3::new(0.5, 0.5, z),
        DVec3::new(0.5, -0.5, z),
        DVec3::new(-0.5, -0.5, z),
    ]
}

fn polygon(vertices: &[DVec3]) -> Polygon {
    Polygon::new(vertices).expect("a polygon")
}

/// A square of side 1 on the floor.
fn floor() -> Polygon {
    let mut vertices = ceiling(0.0);
    vertices.reverse();
    polygon(&vertices)
}

/// One element and one quad: general formula, small polygon, horizon crossing.
fn elements(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("point_to_polygon");
    let tilted = DVec3::new(0.9, 0.1, 0.2).normalize();
    for (name, polygon, normal) in [
        ("near", ceiling(1.0), DVec3::Z),
        ("far", ceiling(100.0), DVec3::Z),
        ("horizon", ceiling(0.1), tilted),
    ] {
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| {
                point_to_polygon(
                    black_box(DVec3::new(0.1, 0.2, 0.0)),
                    black_box(normal),
                    black_box(&polygon),
                )
            });
        });
    }
    group.finish();
}

/// One pair of unit squares over their distance and the accuracy asked for.
fn pairs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("exchange_area");
    let floor = floor();
    let turned = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.2, 0.3, 0.4);
    for distance in [1.2, 3.0, 10.0, 100.0] {
        let vertices = ceiling(0.0).map(|v| turned * v + DVec3::Z * distance);
        let other = polygon(&vertices);
        let exact = exchange_area(&floor, &other, 1e-13);
        for accuracy in [1e-3, 1e-6, 1e-10] {
            let error = (exchange_area(&floor, &other, accuracy) / exact - 1.0).abs();
            let name = format!("skew at {distance}, asked {accuracy:.0e}, error {error:.0e}");
            group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
                bencher.iter(|| exchange_area(black_box(&floor), black_box(&other), accuracy));
            });
        }
    }
    group.finish();
}

/// The faces of a unit cube, each cut into k×k squares.
fn cube(k: usize) -> Vec<Polygon> {
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
    let mut squares = Vec::with_capacity(6 * k * k);
    for [corner, u, v] in [
        [o, y, z],
        [x, z, y],
        [o, z, x],
        [y, x, z],
        [o, x, y],
        [z, y, x],
    ] {
        let at = |i: usize, j: usize| corner + (u * i as f64 + v * j as f64) / k as f64;
        for i in 0..k {
            for j in 0..k {
                squares.push(polygon(&[
                    at(i, j),
                    at(i + 1, j),
                    at(i + 1, j + 1),
                    at(i, j + 1),
                ]));
            }
        }
    }
    squares
}

/// The whole matrix of a cube over the number of patches; the error is that of the row sums.
fn assembly(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("unoccluded_matrix");
    group.sample_size(10);
    for k in [4, 8, 13] {
        let squares = cube(k);
        let n = squares.len();
        for accuracy in [1e-4, 1e-6, 1e-10] {
            let defect = closure(&unoccluded_matrix(&squares, accuracy)).largest_defect;
            let name = format!("n = {n}, asked {accuracy:.0e}, closure {defect:.0e}");
            group.throughput(Throughput::Elements((n * (n - 1) / 2) as u64));
            group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
                bencher.iter(|| unoccluded_matrix(black_box(&squares), accuracy));
            });
        }
    }
    group.finish();
}

/// Two unit squares with a smaller one between them, over the number of points and pixels.
fn occluded(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("occluded");
    group.sample_size(10);
    let (floor, above) = (floor(), polygon(&ceiling(1.0)));
    let blocker = polygon(&ceiling(0.5).map(|v| v * DVec3::new(0.5, 0.5, 1.0)));
    let estimate = |points| {
        let config = AnalyticConfig {
            accuracy: 1e-10,
            points,
            seed: 0,
        };
        occluded_exchange_area(&floor, &above, std::slice::from_ref(&blocker), &config, 0).area
    };
    let exact = estimate(1 << 17);
    for points in [64, 1024, 4096] {
        let error = (estimate(points) / exact - 1.0).abs();
        let name = format!("{points} points, error {error:.0e}");
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| estimate(black_box(points)));
        });
    }
    let facet = |polygon, front| Facet {
        vertices: Polygon::vertices(polygon),
        normal: polygon.normal(),
        front,
        back: FacetSide::Black,
    };
    let facets = [
        facet(&above, FacetSide::Counted(0)),
        facet(&blocker, FacetSide::Black),
    ];
    for resolution in [64, 128, 256] {
        let run = |resolution| {
            let config = HemicubeConfig::balanced(resolution);
            hemicube(std::slice::from_ref(&floor), &facets, &config).get(0, 0)
        };
        let error = (run(resolution) / exact - 1.0).abs();
        let name = format!("hemicube of {resolution}, error {error:.0e}");
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| run(black_box(resolution)));
        });
    }
    group.finish();
}

criterion_group!(benches, elements, pairs, assembly, occluded);
criterion_main!(benches);
