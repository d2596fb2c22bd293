"""The regression forest as a scikit-learn estimator. Needs scikit-learn 1.6 or later."""

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, column_or_1d, validate_data

from crumple import _crumple


class RegressionForest(RegressorMixin, BaseEstimator):
    """A forest of regression trees, the one that crumple's models use.

    Parameters are named as in scikit-learn's RandomForestRegressor: `max_features` is a number, or None for all;
    `random_thresholds` draws one threshold per feature (extra-trees). The same `random_state` gives the same forest on any
    number of threads. After `fit` there are `n_features_in_` and `feature_importances_`.
    """

    def __init__(
        self,
        n_estimators=100,
        *,
        max_depth=None,
        min_samples_leaf=1,
        max_features=None,
        bootstrap=True,
        random_thresholds=False,
        random_state=None,
    ):
        self.n_estimators = n_estimators
        self.max_depth = max_depth
        self.min_samples_leaf = min_samples_leaf
        self.max_features = max_features
        self.bootstrap = bootstrap
        self.random_thresholds = random_thresholds
        self.random_state = random_state

    def fit(self, X, y):
        """Fit the forest to X (samples, features) and y (samples,)."""
        X, y = validate_data(self, X, y, dtype=np.float64, order="C", y_numeric=True, multi_output=True)
        y = column_or_1d(y, warn=True, dtype=np.float64)
        seed = int(check_random_state(self.random_state).randint(np.iinfo(np.int32).max))
        self.forest_ = _crumple.Forest.fit(
            np.ascontiguousarray(X).tobytes(), X.shape[1], np.ascontiguousarray(y).tobytes(), self.n_estimators, seed,
            self.max_depth, self.min_samples_leaf, self.max_features, self.bootstrap, self.random_thresholds,
        )
        return self

    def predict(self, X):
        """Mean over the trees, of shape (samples,)."""
        check_is_fitted(self)
        X = validate_data(self, X, dtype=np.float64, order="C", reset=False)
        predicted = self.forest_.predict(np.ascontiguousarray(X).tobytes(), X.shape[1])
        return np.frombuffer(predicted, dtype=np.float64).copy()

    @property
    def feature_importances_(self):
        check_is_fitted(self)
        return np.frombuffer(self.forest_.importance(), dtype=np.float64).copy()

    def __getstate__(self):
        state = super().__getstate__().copy()
        if "forest_" in state:
            state["forest_"] = state["forest_"].to_json()
        return state

    def __setstate__(self, state):
        state = dict(state)
        if isinstance(state.get("forest_"), str):
            state["forest_"] = _crumple.Forest.of_json(state["forest_"])
        super().__setstate__(state)
