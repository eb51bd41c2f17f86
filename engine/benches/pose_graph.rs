//! Time of the optimiser on public pose graphs, one thread.
//!
//! `LOCUTION_DATASETS=… cargo bench -p locution-engine --bench pose_graph`; graphs that are absent are skipped. The
//! time covers ordering, symbolic analysis and all iterations, not the reading of the file.

use std::hint::black_box;
use std::io::Read;
use std::path::PathBuf;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use locution_engine::formats::read_g2o;
use locution_engine::pose_graph::{
    CovarianceSolver, PoseGraph, PoseGraphConfig, RobustConfig, Start, optimize, optimize_robust,
};

fn load(name: &str) -> Option<PoseGraph> {
    let folder = std::env::var_os("LOCUTION_DATASETS").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/datasets"),
        PathBuf::from,
    );
    let Ok(file) = std::fs::File::open(folder.join("posegraphs").join(format!("{name}.g2o.gz"))) else {
        println!("skipped: the data set posegraphs/{name}.g2o.gz is absent");
        return None;
    };
    let mut text = String::new();
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).ok()?;
    read_g2o(&text).ok().map(|document| document.graph)
}

fn optimizing(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("pose_graph");
    group.sample_size(20);
    for name in ["intel", "mit", "manhattan", "city10000"] {
        let Some(graph) = load(name) else { continue };
        for (label, start) in [("given", Start::Given), ("chordal", Start::Chordal)] {
            let config = PoseGraphConfig { start, ..PoseGraphConfig::default() };
            group.bench_function(format!("{name}/{label}"), |bencher| {
                bencher.iter_batched(
                    || graph.clone(),
                    |mut graph| black_box(optimize(&mut graph, &config)),
                    BatchSize::LargeInput,
                );
            });
        }
    }
    if let Some(graph) = load("manhattanOlson3500") {
        group.bench_function("manhattanOlson3500/robust", |bencher| {
            let (config, robust) = (PoseGraphConfig::default(), RobustConfig::default());
            bencher.iter_batched(
                || graph.clone(),
                |mut graph| black_box(optimize_robust(&mut graph, &config, &robust)),
                BatchSize::LargeInput,
            );
        });
        group.bench_function("manhattanOlson3500/all marginals", |bencher| {
            bencher.iter(|| {
                CovarianceSolver::new(black_box(&graph))
                    .map(|mut solver| solver.marginals().len())
                    .unwrap_or_default()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, optimizing);
criterion_main!(benches);
