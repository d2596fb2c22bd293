//! The regression forest as a user of linfa meets it.

use crumple::forest::{
    FeaturesPerSplit, ForestError, ForestParams, RegressionForest, StopRule, Thresholds,
};
use linfa::prelude::*;
use ndarray::{Array1, Array2, array};

/// A smooth function with a bend and a jump, 300 points.
fn data() -> Dataset<f64, f64, ndarray::Ix1> {
    let x = Array2::from_shape_fn((300, 3), |(i, k)| {
        (0.5 + i as f64 * [0.819_172_5, 0.671_043_6, 0.549_700_5][k]).fract()
    });
    let y =
        x.map_axis(ndarray::Axis(1), |r| (5.0 * r[0]).sin() + if r[1] > 0.5 { 1.0 } else { 0.0 });
    Dataset::new(x, y)
}

fn fit(params: ForestParams<f64>) -> RegressionForest<f64> {
    params.fit(&data()).unwrap()
}

fn predicted(forest: &RegressionForest<f64>) -> Array1<f64> {
    forest.predict(data().records())
}

#[test]
fn unpruned_tree_without_bootstrap_repeats_its_data() {
    let forest = fit(ForestParams::new(1).bootstrap(false));
    for (p, y) in predicted(&forest).iter().zip(data().targets()) {
        assert!((p - y).abs() < 1e-12);
    }
}

/// The first split of a step is at the midpoint, and of equal splits the lowest wins.
#[test]
fn splits_by_hand() {
    let fit = |x: Array2<f64>, y: Array1<f64>| {
        ForestParams::new(1).bootstrap(false).max_depth(Some(1)).fit(&Dataset::new(x, y)).unwrap()
    };
    let forest = fit(array![[1.0], [2.0], [4.0], [5.0]], array![0.0, 0.0, 6.0, 6.0]);
    let p: Array1<f64> = forest.predict(&array![[2.999], [3.0]]);
    assert_eq!(p, array![0.0, 6.0], "left if x < 3");
    // Both features split equally well: the first is taken, at its lowest threshold.
    let forest = fit(array![[0.0, 9.0], [1.0, 8.0], [2.0, 7.0]], array![0.0, 1.0, 0.0]);
    let p: Array1<f64> = forest.predict(&array![[0.4, 0.0], [0.6, 100.0]]);
    assert_eq!(p, array![0.0, 0.5]);
}

/// Targets that are equal are one leaf, whatever rounding says of their variance.
#[test]
fn plateaus_are_not_split() {
    let x = Array2::from_shape_fn((100, 1), |(i, _)| i as f64);
    let y = Array1::from_shape_fn(100, |i| if i < 37 { 0.1 } else { 1.0 / 3.0 * 1e6 });
    let forest = ForestParams::new(20).fit(&Dataset::new(x, y)).unwrap();
    assert!(forest.trees().iter().all(|t| t.nodes() == 3));
}

#[test]
fn one_sample_and_equal_records_are_one_leaf() {
    let fit = |x: Array2<f64>, y: Array1<f64>| {
        ForestParams::new(1).bootstrap(false).fit(&Dataset::new(x, y)).unwrap()
    };
    let one = fit(array![[1.0]], array![5.0]);
    assert_eq!(one.trees()[0].nodes(), 1);
    let equal = fit(array![[1.0], [1.0]], array![5.0, 7.0]);
    let p: Array1<f64> = equal.predict(&array![[9.0]]);
    assert_eq!(p, array![6.0]);
}

#[test]
fn gain_counts_repeated_samples() {
    // Ten copies of one point weigh more than one: the split follows them.
    let x = Array2::from_shape_fn((12, 1), |(i, _)| if i < 10 { 0.0 } else { i as f64 - 9.0 });
    let y = Array1::from_shape_fn(12, |i| if i < 10 { 0.0 } else { 3.0 * (i as f64 - 9.0) });
    let forest =
        ForestParams::new(1).bootstrap(false).max_depth(Some(1)).fit(&Dataset::new(x, y)).unwrap();
    let p: Array1<f64> = forest.predict(&array![[0.4], [0.6]]);
    assert_eq!(p, array![0.0, 4.5]);
}

#[test]
fn stop_rules_limit_the_tree() {
    let nodes = |params: ForestParams<f64>| fit(params.bootstrap(false)).trees()[0].nodes();
    let full = nodes(ForestParams::new(1));
    assert_eq!(full, 2 * 300 - 1);
    assert!(nodes(ForestParams::new(1).min_samples_leaf(10)) < 2 * 30);
    assert_eq!(nodes(ForestParams::new(1).max_depth(Some(3))), 15);
    assert!(nodes(ForestParams::new(1).stop(StopRule::StdOverMean(0.1))) < full / 2);
    assert!(nodes(ForestParams::new(1).stop(StopRule::VarOverMean(0.1))) < full / 2);
    assert_eq!(nodes(ForestParams::new(1).stop(StopRule::StdOverMean(0.0))), full);
}

#[test]
fn same_seed_same_forest_on_any_number_of_threads() {
    let params = || {
        ForestParams::new(20)
            .seed(3)
            .thresholds(Thresholds::Random)
            .features_per_split(FeaturesPerSplit::Count(2))
    };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fit(params()))
    };
    assert_eq!(on(1), on(2));
    assert_eq!(on(1), on(7));
    assert_ne!(on(1), fit(params().seed(4)));
}

#[test]
fn more_trees_contain_the_fewer() {
    let few = fit(ForestParams::new(3).seed(9));
    let many = fit(ForestParams::new(8).seed(9));
    assert_eq!(few.trees(), &many.trees()[..3]);
}

/// Midpoint forests jump between training values; random thresholds are nearly continuous.
#[test]
fn random_thresholds_smooth_the_jump() {
    let x = Array2::from_shape_fn((200, 1), |(i, _)| (i / 50) as f64);
    let y = x.column(0).to_owned();
    let jump = |thresholds| {
        let params = ForestParams::new(500).thresholds(thresholds).bootstrap(false);
        let forest = params.fit(&Dataset::new(x.clone(), y.clone())).unwrap();
        let p: Array1<f64> = forest.predict(&array![[1.499], [1.501]]);
        p[1] - p[0]
    };
    assert_eq!(jump(Thresholds::Midpoint), 1.0);
    assert!(jump(Thresholds::Random) < 0.02);
}

#[test]
fn out_of_bag_error_is_like_a_held_out_error() {
    let all = data();
    let forest = ForestParams::new(200).seed(1).out_of_bag(true).fit(&all).unwrap();
    let oob = forest.out_of_bag().unwrap();
    assert_eq!(oob.samples, 300);
    // Ten-fold cross-validation as the second route to the same error.
    let mut squares = 0.0;
    for (train, test) in all.fold(10) {
        let forest = ForestParams::new(200).seed(1).fit(&train).unwrap();
        let p: Array1<f64> = forest.predict(test.records());
        squares += (&p - test.targets()).mapv(|r| r * r).sum();
    }
    let held_out = (squares / 300.0).sqrt();
    assert!((oob.rmse / held_out - 1.0).abs() < 0.15, "{} against {held_out}", oob.rmse);
    assert!(oob.r2.unwrap() > 0.9);
}

#[test]
fn f32_and_views_work() {
    let all = data();
    let (x, y) = (all.records().mapv(|v| v as f32), all.targets().mapv(|v| v as f32));
    let forest = ForestParams::<f32>::new(5).fit(&Dataset::new(x.clone(), y.clone())).unwrap();
    let of_views = ForestParams::<f32>::new(5).fit(&DatasetBase::new(x.view(), y.view())).unwrap();
    assert_eq!(forest, of_views);
    let p: Array1<f32> = forest.predict(&x.view());
    assert_eq!(p, forest.predict(&x));
}

#[test]
fn columns_in_any_memory_order_give_the_same() {
    let all = data();
    let mut fortran = Array2::zeros(ndarray::ShapeBuilder::f((300, 3)));
    fortran.assign(all.records());
    let forest = fit(ForestParams::new(5));
    let other =
        ForestParams::new(5).fit(&Dataset::new(fortran.clone(), all.targets().clone())).unwrap();
    assert_eq!(forest, other);
    let p: Array1<f64> = forest.predict(&fortran);
    assert_eq!(p, predicted(&forest));
}

#[test]
fn batches_and_single_rows_agree() {
    let x = Array2::from_shape_fn((1_300, 3), |(i, k)| ((i * 7 + k * 13) % 100) as f64 / 100.0);
    let forest = fit(ForestParams::new(9));
    let p: Array1<f64> = forest.predict(&x);
    for (row, p) in x.rows().into_iter().zip(&p) {
        assert_eq!(forest.predict_one(&row), *p);
    }
}

#[test]
fn wrong_parameters_and_data_are_refused() {
    fn t(params: ForestParams<f64>, x: Array2<f64>, y: Array1<f64>, expected: &str) {
        let error: ForestError = params.fit(&Dataset::new(x, y)).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
    let (x, y) = (array![[1.0], [2.0]], array![1.0, 2.0]);
    let new = ForestParams::new;
    t(new(0), x.clone(), y.clone(), "a forest needs at least 1 tree, found 0");
    t(
        new(1).min_samples_leaf(0),
        x.clone(),
        y.clone(),
        "min_samples_leaf must be at least 1, found 0",
    );
    t(new(1).max_depth(Some(0)), x.clone(), y.clone(), "max_depth must be at least 1, found 0");
    t(
        new(1).stop(StopRule::StdOverMean(f64::NAN)),
        x.clone(),
        y.clone(),
        "the stop rule's threshold must be a finite number of at least 0, found NaN",
    );
    t(
        new(1).features_per_split(FeaturesPerSplit::Count(2)),
        x.clone(),
        y.clone(),
        "features per split are 2, but the records have 1 features",
    );
    t(
        new(1).bootstrap(false).out_of_bag(true),
        x.clone(),
        y.clone(),
        "out-of-bag error needs bootstrap samples: set bootstrap(true)",
    );
    t(
        new(1),
        array![[1.0], [f64::NAN]],
        y.clone(),
        "record 1, feature 0 is NaN: expected a finite number",
    );
    t(new(1), x.clone(), array![1.0, f64::INFINITY], "target 1 is inf: expected a finite number");
    t(new(1), Array2::zeros((0, 1)), Array1::zeros(0), "there are no samples to fit");
    t(new(1), Array2::zeros((2, 0)), y, "there are no features to split on");
}
