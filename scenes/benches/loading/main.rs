//! Bytes per second of [`luxel_scenes::load`] on halls of 25 000 to a million triangles, as OBJ (vertices
//! with their objects, and all before the first face) and as GLB, from a warm cache of files.
//!
//! `cargo bench -p luxel-scenes --bench loading`

mod hall;
mod write;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::fs;
use write::Layout;

/// Triangles of the halls.
const TRIANGLES: [u32; 4] = [25_000, 100_000, 400_000, 1_000_000];

fn bench(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut group = criterion.benchmark_group("loading");
    group.sample_size(10);
    for triangles in TRIANGLES {
        let meshes = hall::hall(triangles);
        let count = hall::triangle_count(&meshes);
        let files = ["obj", "vertices-first.obj", "glb"].map(|ending| {
            let file = folder.path().join(format!("hall-{triangles}.{ending}"));
            match ending {
                "obj" => write::obj(&file, &meshes, Layout::ByObject),
                "glb" => write::glb(&file, &meshes),
                _ => write::obj(&file, &meshes, Layout::VerticesFirst),
            }
            .expect("the temporary folder takes files");
            (ending, file)
        });
        for (ending, file) in files {
            let bytes = fs::metadata(&file).expect("it was just written").len();
            println!("{ending}: {count} triangles, {bytes} bytes");
            group.throughput(Throughput::Bytes(bytes));
            group.bench_function(BenchmarkId::new(ending, triangles), |bencher| {
                bencher.iter(|| luxel_scenes::load(&file).expect("a valid scene"));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
