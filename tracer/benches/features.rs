//! Cost of each feature, and that unused features cost nothing: variants of one scene, on one thread.

mod common;

use common::variants::VARIANTS;
use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};

fn features(criterion: &mut Criterion) {
    let pool = common::pool(1);
    let mut group = criterion.benchmark_group("features");
    group.sampling_mode(SamplingMode::Flat);
    for variant in &VARIANTS {
        let frame = variant.prepare(640, 480);
        let mut pixels = common::room_for(&frame);
        let counts = common::render(&pool, &frame, &mut pixels);
        group.throughput(Throughput::Elements(common::rays(counts)));
        group.bench_function(BenchmarkId::new(variant.name, variant.baseline), |bencher| {
            bencher.iter(|| common::render(&pool, &frame, &mut pixels));
        });
    }
    group.finish();
}

criterion_group!(benches, features);
criterion_main!(benches);
