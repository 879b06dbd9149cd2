//! Whole frames: every available scene, at 1 and 4 samples, on 1 and 2 threads. Shadow rays are included in the ray
//! counts.

mod common;

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use rayfarm_tracer::scene::FrameView;

fn frames(criterion: &mut Criterion) {
    let pools = [1, 2].map(|threads| (threads, common::pool(threads)));
    let mut group = criterion.benchmark_group("frames");
    group.sampling_mode(SamplingMode::Flat);
    for workload in common::workloads() {
        let (scene, view) = workload.load();
        for samples in [1, 4] {
            let frame = common::prepare(&scene, &FrameView { samples, ..view });
            let mut pixels = common::room_for(&frame);
            for (threads, pool) in &pools {
                let counts = common::render(pool, &frame, &mut pixels);
                group.throughput(Throughput::Elements(common::rays(counts)));
                let id = BenchmarkId::new(&workload.name, format!("{samples} samples, {threads} threads"));
                group.bench_function(id, |bencher| {
                    bencher.iter(|| common::render(pool, &frame, &mut pixels));
                });
            }
        }
    }
    group.finish();
}

criterion_group!(benches, frames);
criterion_main!(benches);
