//! Quantiles of the target given a record (Meinshausen, "Quantile Regression Forests",
//! JMLR 7, 2006): the training targets of the leaves it falls into, weighted.
//!
//! A sample counts as often as the tree drew it, so that the mean of the distribution is the prediction. The samples of the
//! leaves come from a walk of the training records after the fit, so that trees grow the same with and without them.

use linfa::Float;
use ndarray::{Array2, ArrayView2, Axis};
use rayon::prelude::*;

use super::forest::RegressionForest;
use super::params::ForestError;

impl<F: Float> RegressionForest<F> {
    /// Quantiles of the target at `levels` (0 to 1) for each record, as records × levels, in
    /// the unit of the target: the smallest training target at which the weights of the
    /// samples, summed by increasing target, reach the level.
    ///
    /// A sample's weight is the mean over the trees of its share in the leaf that the record
    /// falls into, counted as often as the tree drew it (Meinshausen 2006, eqs. 4 to 6), so
    /// the weighted mean is the forest's prediction. Leaves of one sample make rough
    /// quantiles: see [`min_samples_leaf`](super::ForestParams::min_samples_leaf).
    ///
    /// # Errors
    /// [`ForestError`] if the forest was not fitted with
    /// [`quantiles(true)`](super::ForestParams::quantiles), a level is not between 0 and 1,
    /// or the records have another number of features.
    pub fn quantiles(
        &self,
        records: ArrayView2<'_, F>,
        levels: &[f64],
    ) -> Result<Array2<F>, ForestError> {
        let members = self.members.as_ref().ok_or(ForestError::NoMembers)?;
        if let Some(&level) = levels.iter().find(|level| !(0.0..=1.0).contains(*level)) {
            return Err(ForestError::Level { level });
        }
        if records.ncols() != self.features() {
            let (found, fitted) = (records.ncols(), self.features());
            return Err(ForestError::Features { found, fitted });
        }
        let mut found = Array2::zeros((records.nrows(), levels.len()));
        found.axis_iter_mut(Axis(0)).into_par_iter().zip(records.axis_iter(Axis(0))).for_each(
            |(mut row, record)| {
                let quantiles = members.quantiles(self.trees(), &record, levels);
                row.iter_mut().zip(quantiles).for_each(|(to, quantile)| *to = quantile);
            },
        );
        Ok(found)
    }
}
