//! Form factors: time and error side by side.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec3;
use luxel_solver::form_factors::point_to_polygon;
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

criterion_group!(benches, elements);
criterion_main!(benches);
