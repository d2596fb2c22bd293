//! Fit and prediction at the sizes of linfa's guide: 1 000 to 100 000 samples of 5 and 10 features.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use linfa::prelude::*;
use linfa_forest::RegressionForest;
use ndarray::{Array1, Array2};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

fn data(samples: usize, features: usize) -> Dataset<f64, f64, ndarray::Ix1> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(42);
    let x = Array2::from_shape_simple_fn((samples, features), || random.r#gen::<f64>());
    let y = x.sum_axis(ndarray::Axis(1));
    Dataset::new(x, y)
}

fn forest(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("forest");
    group.sample_size(10);
    for features in [5, 10] {
        for samples in [1_000, 10_000, 100_000] {
            let size = format!("{features}feats-{samples}samples");
            let data = data(samples, features);
            let params = RegressionForest::params(10);
            group.bench_with_input(BenchmarkId::new("fit", &size), &data, |b, data| {
                b.iter(|| params.fit(black_box(data)).expect("finite data"));
            });
            let forest = params.fit(&data).expect("finite data");
            let predict = BenchmarkId::new("predict", &size);
            group.bench_with_input(predict, data.records(), |b, records| {
                b.iter(|| -> Array1<f64> { forest.predict(black_box(records)) });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, forest);
criterion_main!(benches);
