//! The regression forest as a user of linfa meets it.

use base64::{Engine, prelude::BASE64_STANDARD};
use crumple::forest::{
    FeaturesPerSplit, ForestError, ForestParams, RegressionForest, StopRule, Thresholds,
};
use linfa::prelude::*;
use ndarray::{Array1, Array2, ArrayView1, array};

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

/// The tree by its definition, on the rows given: the node's prediction for `record`.
fn by_definition(
    data: &Dataset<f64, f64, ndarray::Ix1>,
    rows: &[usize],
    record: ArrayView1<f64>,
) -> f64 {
    let (x, y) = (data.records(), data.targets());
    let mean = |rows: &[usize]| rows.iter().map(|&r| y[r]).sum::<f64>() / rows.len() as f64;
    let squares = |rows: &[usize]| {
        let mean = mean(rows);
        rows.iter().map(|&r| (y[r] - mean).powi(2)).sum::<f64>()
    };
    let all = squares(rows);
    let mut best: Option<(f64, usize, f64)> = None;
    for feature in 0..x.ncols() {
        let mut values: Vec<f64> = rows.iter().map(|&r| x[[r, feature]]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        for pair in values.windows(2) {
            let threshold = 0.5 * pair[0] + 0.5 * pair[1];
            let (left, right): (Vec<usize>, Vec<usize>) =
                rows.iter().partition(|&&r| x[[r, feature]] < threshold);
            let gain = all - squares(&left) - squares(&right);
            if gain > best.map_or(0.0, |best| best.0) + 1e-11 {
                best = Some((gain, feature, threshold));
            }
        }
    }
    let Some((_, feature, threshold)) = best else { return mean(rows) };
    let below = record[feature] < threshold;
    let side: Vec<usize> =
        rows.iter().copied().filter(|&r| (x[[r, feature]] < threshold) == below).collect();
    by_definition(data, &side, record)
}

/// Values that repeat, in every feature, so that there are ties of all kinds.
#[test]
fn trees_are_those_of_the_definition() {
    let mut data = data();
    data.records.mapv_inplace(|v| (v * 20.0).floor());
    let forest = ForestParams::new(1).bootstrap(false).fit(&data).unwrap();
    let rows: Vec<usize> = (0..300).collect();
    for row in 0..60 {
        let record = array![row as f64 / 3.0, (row * 7 % 20) as f64, (row * 11 % 20) as f64];
        let expected = by_definition(&data, &rows, record.view());
        let found = forest.predict_one(&record.view());
        assert!((found - expected).abs() < 1e-12, "{record}: {found} against {expected}");
    }
}

/// Larger than what is numbered again: every sample is still found where it belongs.
#[test]
fn large_trees_repeat_their_data() {
    let x = Array2::from_shape_fn((20_000, 3), |(i, k)| {
        (0.5 + i as f64 * [0.819_172_5, 0.671_043_6, 0.549_700_5][k]).fract()
    });
    let y = x.map_axis(ndarray::Axis(1), |r| (50.0 * r[0]).sin() * r[1] + (90.0 * r[2]).cos());
    let data = Dataset::new(x, y);
    let forest = ForestParams::new(1).bootstrap(false).fit(&data).unwrap();
    assert_eq!(forest.trees()[0].nodes(), 2 * 20_000 - 1);
    let p: Array1<f64> = forest.predict(data.records());
    assert!(p.iter().zip(data.targets()).all(|(p, y)| (p - y).abs() < 1e-12));
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

/// One target for all samples: nothing is explained, and many trees give that target, in either precision.
#[test]
fn one_target_is_predicted_as_it_is() {
    let x = data().records().clone();
    let y = Array1::from_elem(x.nrows(), 0.1);
    let params = ForestParams::new(20).out_of_bag(true);
    let forest = params.fit(&Dataset::new(x.clone(), y)).unwrap();
    assert_eq!(forest.out_of_bag().unwrap().r2, None);
    let (x, y) = (x.mapv(|v| v as f32), Array1::from_elem(x.nrows(), 0.1_f32));
    let forest = ForestParams::<f32>::new(2000).fit(&Dataset::new(x.clone(), y)).unwrap();
    let p: Array1<f32> = forest.predict(&x);
    assert!(p.iter().all(|p| *p == 0.1) && forest.predict_one(&x.row(0)) == 0.1);
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

/// Few rows, whole batches, and trees so large that rows walk in another order.
#[test]
fn batches_and_single_rows_agree() {
    let x = Array2::from_shape_fn((5_000, 3), |(i, k)| ((i * 7 + k * 13) % 4_999) as f64 / 4_999.0);
    let y = x.map_axis(ndarray::Axis(1), |r| (50.0 * r[0]).sin() + r[1] * r[2]);
    let large = ForestParams::new(9).fit(&Dataset::new(x.clone(), y)).unwrap();
    for forest in [fit(ForestParams::new(9)), large] {
        for rows in [3, 1_300, 5_000] {
            let mut x = x.slice(ndarray::s![..rows, ..]).to_owned();
            x[[1, 0]] = f64::NAN;
            x[[2, 1]] = f64::INFINITY;
            let p: Array1<f64> = forest.predict(&x);
            for (row, p) in x.rows().into_iter().zip(&p) {
                assert_eq!(forest.predict_one(&row), *p);
            }
        }
    }
}

/// The squares about the mean fall from 104 to 4 by the first split, to 0 by the two below.
#[test]
fn importance_by_hand() {
    let x = array![[0.0, 0.0, 3.0], [0.0, 1.0, 3.0], [1.0, 0.0, 3.0], [1.0, 1.0, 3.0]];
    let fit = |y| {
        let data = Dataset::new(x.clone(), y);
        ForestParams::new(3).bootstrap(false).fit(&data).unwrap()
    };
    let forest = fit(array![0.0, 2.0, 10.0, 12.0]);
    let share = forest.feature_importance().unwrap();
    let expected = array![100.0 / 104.0, 4.0 / 104.0, 0.0];
    assert!((&share - &expected).iter().all(|d: &f64| d.abs() < 1e-14), "{share}");
    assert_eq!(
        fit(array![1.0, 1.0, 1.0, 1.0]).feature_importance().unwrap(),
        array![0.0, 0.0, 0.0]
    );
}

/// The weights spelled out: each tree's leaf is known by its mean.
#[test]
fn quantiles_by_definition() {
    let all = data();
    let params = ForestParams::new(7).bootstrap(false).thresholds(Thresholds::Random);
    let forest = fit(params.min_samples_leaf(8).quantiles(true));
    let levels = [0.0, 0.1, 0.5, 0.83, 1.0];
    let records = Array2::from_shape_fn((40, 3), |(i, k)| ((i * 7 + k * 13) % 40) as f64 / 40.0);
    let found = forest.quantiles(records.view(), &levels).unwrap();
    for (record, found) in records.rows().into_iter().zip(found.rows()) {
        let mut weighted: Vec<(f64, f64)> = all.targets().iter().map(|&y| (y, 0.0)).collect();
        for tree in forest.trees() {
            let value = tree.predict(&record);
            let rows = all.records().rows().into_iter();
            let leaf: Vec<usize> = rows
                .enumerate()
                .filter_map(|(row, x)| (tree.predict(&x) == value).then_some(row))
                .collect();
            leaf.iter().for_each(|&row| weighted[row].1 += 1.0 / (7 * leaf.len()) as f64);
        }
        weighted.retain(|(_, weight)| *weight > 0.0);
        weighted.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (&level, &found) in levels.iter().zip(found) {
            let mut sum = 0.0;
            let reaches = |(_, weight): &&(f64, f64)| {
                sum += weight;
                sum >= level - 1e-9
            };
            assert_eq!(found, weighted.iter().find(reaches).unwrap().0, "level {level}");
        }
    }
}

/// Over all levels alike, quantiles have the prediction as their mean: samples count as
/// often as they were drawn.
#[test]
fn mean_of_quantiles_is_the_prediction() {
    let forest = fit(ForestParams::new(5).min_samples_leaf(3).quantiles(true));
    let levels: Vec<f64> = (0..20_000).map(|k| (f64::from(k) + 0.5) / 20_000.0).collect();
    let records = data().records.slice(ndarray::s![..20, ..]).to_owned();
    let found = forest.quantiles(records.view(), &levels).unwrap();
    let p: Array1<f64> = forest.predict(&records);
    for (p, quantiles) in p.iter().zip(found.rows()) {
        assert!((p - quantiles.mean().unwrap()).abs() < 1e-3);
    }
}

#[test]
fn wrong_quantiles_are_refused() {
    let t = |forest: &RegressionForest<f64>, features: usize, level: f64, expected: &str| {
        let error = forest.quantiles(Array2::zeros((1, features)).view(), &[level]).unwrap_err();
        assert_eq!(error.to_string(), expected);
    };
    let without = "the forest has not kept the samples of its leaves: fit it with quantiles(true)";
    t(&fit(ForestParams::new(1)), 3, 0.5, without);
    let forest = fit(ForestParams::new(1).quantiles(true));
    t(&forest, 2, 0.5, "the records have 2 features, the forest was fitted to 3");
    t(&forest, 3, 1.5, "the level of a quantile must be between 0 and 1, found 1.5");
    t(&forest, 3, f64::NAN, "the level of a quantile must be between 0 and 1, found NaN");
}

/// Files of programs that knew neither importance nor quantiles are read, and files whose
/// parts do not fit are not trusted.
#[test]
fn stored_forests() {
    let forest = fit(ForestParams::new(3).quantiles(true));
    let stored = serde_json::to_value(&forest).unwrap();
    let read = |value| serde_json::from_value::<RegressionForest<f64>>(value).unwrap();
    assert_eq!(read(stored.clone()), forest);
    assert!(forest.check().is_ok());
    let mut old = stored.clone();
    for (part, key) in [("", "importance"), ("", "members"), ("/params", "quantiles")] {
        assert!(old.pointer_mut(part).unwrap().as_object_mut().unwrap().remove(key).is_some());
    }
    let old = read(old);
    assert!(old.check().is_ok());
    assert_eq!(old.feature_importance(), None);
    assert_eq!(predicted(&old), predicted(&forest));
    // The first node's left child, 1, becomes the node itself.
    let left = stored["trees"][2]["left"].as_str().unwrap().replacen("AQAA", "AAAA", 1);
    #[rustfmt::skip]
    let cases = [
        ("/members/trees/0/first/1", 9.into(), "the samples of the leaves do not fit the trees"),
        ("/members/trees/1/members/0", 300.into(), "the samples of the leaves do not fit the trees"),
        ("/importance", vec![1.0].into(), "the shares of the features do not fit their number"),
        ("/trees/2/left", left.into(), "node 0 has children that are not next to each other after it"),
    ];
    for (part, wrong, expected) in cases {
        let mut damaged = stored.clone();
        let wrong: serde_json::Value = wrong;
        *damaged.pointer_mut(part).unwrap() = wrong;
        assert_eq!(read(damaged).check().unwrap_err().to_string(), expected, "{part}");
    }
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut damaged = stored.clone();
        let number = &mut damaged["trees"][0]["number"];
        let mut numbers = BASE64_STANDARD.decode(number.as_str().unwrap()).unwrap();
        numbers[..8].copy_from_slice(&wrong.to_le_bytes());
        *number = BASE64_STANDARD.encode(numbers).into();
        let error = read(damaged).check().unwrap_err().to_string();
        assert_eq!(error, "node 0 holds a value that is not finite", "{wrong}");
    }
    for (text, expected) in [
        ("AAAA", "the node arrays of a tree differ in length"),
        ("*", "number of a tree: Invalid symbol 42, offset 0."),
    ] {
        let mut damaged = stored.clone();
        damaged["trees"][0]["number"] = text.into();
        let error = serde_json::from_value::<RegressionForest<f64>>(damaged).unwrap_err();
        assert_eq!(error.to_string(), expected);
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
    #[rustfmt::skip]
    let cases = [
        (new(0), x.clone(), y.clone(), "a forest needs at least 1 tree, found 0"),
        (new(1).min_samples_leaf(0), x.clone(), y.clone(), "min_samples_leaf must be at least 1, found 0"),
        (new(1).max_depth(Some(0)), x.clone(), y.clone(), "max_depth must be at least 1, found 0"),
        (new(1).stop(StopRule::StdOverMean(f64::NAN)), x.clone(), y.clone(), "the stop rule's threshold must be a finite number of at least 0, found NaN"),
        (new(1).features_per_split(FeaturesPerSplit::Count(2)), x.clone(), y.clone(), "features per split are 2, but the records have 1 features"),
        (new(1).bootstrap(false).out_of_bag(true), x.clone(), y.clone(), "out-of-bag error needs bootstrap samples: set bootstrap(true)"),
        (new(1), array![[1.0], [f64::NAN]], y.clone(), "record 1, feature 0 is NaN: expected a finite number"),
        (new(1), x.clone(), array![1.0, f64::INFINITY], "target 1 is inf: expected a finite number"),
        (new(1), Array2::zeros((0, 1)), Array1::zeros(0), "there are no samples to fit"),
        (new(1), Array2::zeros((2, 0)), y, "there are no features to split on"),
    ];
    cases.into_iter().for_each(|(params, x, y, expected)| t(params, x, y, expected));
}

/// The same sources as a crate of their own, without threads, give the same bits, in f32 too.
#[test]
fn the_crate_of_its_own_grows_the_same_forest() {
    fn both<F: linfa::Float + serde::Serialize + serde::de::DeserializeOwned>() {
        let data = data();
        let x = data.records().mapv(F::cast);
        let data = Dataset::new(x, data.targets().mapv(F::cast));
        let params = |seed| {
            let here = ForestParams::new(12).seed(seed).out_of_bag(true).quantiles(true);
            let there = linfa_forest::RegressionForest::params(12).seed(seed);
            (here, there.out_of_bag(true).quantiles(true))
        };
        for seed in [0, 7] {
            let (here, there) = params(seed);
            let (here, there) = (here.fit(&data).unwrap(), there.fit(&data).unwrap());
            let text = serde_json::to_string(&here).unwrap();
            assert_eq!(text, serde_json::to_string(&there).unwrap());
            let (ours, theirs): (Array1<F>, Array1<F>) =
                (here.predict(data.records()), there.predict(data.records()));
            assert_eq!(ours, theirs);
            // A few rows walk one by one.
            let few = data.records().slice(ndarray::s![..2, ..]).to_owned();
            let theirs: Array1<F> = there.predict(&few);
            assert_eq!(theirs, ours.slice(ndarray::s![..2]));
            assert_eq!(here.feature_importance(), there.feature_importance());
            let (ours, theirs) =
                (here.quantiles(few.view(), &[0.1]), there.quantiles(few.view(), &[0.1]));
            assert_eq!(ours.unwrap(), theirs.unwrap());
            let read: linfa_forest::RegressionForest<F> = serde_json::from_str(&text).unwrap();
            read.check().unwrap();
            assert_eq!(read, there);
        }
    }
    both::<f32>();
    both::<f64>();
}
