//! Rays per second of the batch interface: camera rays, diffuse rays (64 from a point, and each from
//! a point of its own) and shadow rays, in a bare room of 12 triangles, an office, a tessellated room
//! of 100 000 and a cluttered hall of a million; by the processor's kernel and by the portable twin.
//!
//! Before the times, each scene prints its error: how many rays from inside the closed scene leak,
//! of rays in general position and of rays aimed exactly at edges and corners.
//!
//! `cargo bench -p luxel-solver --bench rays`

mod sets;

use criterion::measurement::WallTime;
use criterion::{
    BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main,
};
use luxel_solver::bvh::{Bvh, Hit, Ray};
use luxel_solver::geometry::Geometry;

/// Rays of one call.
const BATCH: usize = 1024;

type ClosestHits = fn(&Bvh, &[Ray], &mut [Hit]);
type Occluded = fn(&Bvh, &[Ray], &mut [bool]);

const CLOSEST: [(&str, ClosestHits); 2] = [
    ("wave", Bvh::closest_hits),
    ("portable", Bvh::closest_hits_portable),
];
const OCCLUDED: [(&str, Occluded); 2] = [
    ("wave", Bvh::occluded),
    ("portable", Bvh::occluded_portable),
];

fn batches<T>(rays: &[Ray], answers: &mut [T], mut trace: impl FnMut(&[Ray], &mut [T])) {
    for (rays, answers) in rays.chunks(BATCH).zip(answers.chunks_mut(BATCH)) {
        trace(rays, answers);
    }
}

fn leaks(bvh: &Bvh, rays: &[Ray]) -> String {
    let mut hits = vec![Hit::MISS; rays.len()];
    bvh.closest_hits(rays, &mut hits);
    let leaks = hits.iter().filter(|hit| hit.triangle().is_none()).count();
    format!("{leaks} of {}", rays.len())
}

fn bench_closest(
    group: &mut BenchmarkGroup<'_, WallTime>,
    (scene, set): (&str, &str),
    bvh: &Bvh,
    rays: &[Ray],
) {
    let mut hits = vec![Hit::MISS; rays.len()];
    group.throughput(Throughput::Elements(rays.len() as u64));
    for (kernel, trace) in CLOSEST {
        let id = BenchmarkId::new(format!("{set}/{kernel}"), scene);
        group.bench_function(id, |bencher| {
            bencher.iter(|| batches(rays, &mut hits, |rays, hits| trace(bvh, rays, hits)));
        });
    }
}

fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("rays");
    group.sample_size(10);
    for (name, scene) in &sets::scenes() {
        let geometry = Geometry::new(scene);
        let start = std::time::Instant::now();
        let bvh = Bvh::build(&geometry);
        let seconds = start.elapsed().as_secs_f64();
        let (camera, diffuse) = (sets::camera(), sets::diffuse(&geometry));
        println!(
            "{name}: {} triangles, built in {seconds:.3} s; leaks: camera {}, diffuse {}, aimed at \
             edges and corners {}",
            geometry.len(),
            leaks(&bvh, &camera),
            leaks(&bvh, &diffuse),
            leaks(&bvh, &sets::stress(&geometry)),
        );
        bench_closest(&mut group, (name, "camera"), &bvh, &camera);
        bench_closest(&mut group, (name, "diffuse"), &bvh, &diffuse);
        let random = sets::random_diffuse(&geometry);
        bench_closest(&mut group, (name, "random diffuse"), &bvh, &random);
        let shadow = sets::shadow(&geometry);
        let mut blocked = vec![false; shadow.len()];
        for (kernel, trace) in OCCLUDED {
            let id = BenchmarkId::new(format!("shadow/{kernel}"), name);
            group.bench_function(id, |bencher| {
                bencher.iter(|| {
                    batches(&shadow, &mut blocked, |rays, blocked| {
                        trace(&bvh, rays, blocked);
                    });
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
