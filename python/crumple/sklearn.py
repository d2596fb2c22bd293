"""The regression forest and the blend of curves as scikit-learn estimators. Need scikit-learn 1.6 or later."""

from numbers import Integral, Real

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, column_or_1d, validate_data

from crumple import _crumple


class RegressionForest(RegressorMixin, BaseEstimator):
    """A forest of regression trees, the one that crumple's models use.

    Parameters are named as in scikit-learn's RandomForestRegressor: `max_features` is a number, a share (a float), "sqrt", "log2", or
    None for all;
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
        for name in ("n_estimators", "max_depth", "min_samples_leaf", "max_features"):
            value = getattr(self, name)
            if isinstance(value, Integral) and value < 1:
                raise ValueError(f"{name} is {value}: expected 1 or more")
        X, y = validate_data(self, X, y, dtype=np.float64, order="C", y_numeric=True, multi_output=True)
        y = column_or_1d(y, warn=True, dtype=np.float64)
        seed = int(check_random_state(self.random_state).randint(np.iinfo(np.int32).max))
        self.forest_ = _crumple.Forest.fit(
            np.ascontiguousarray(X).tobytes(), X.shape[1], np.ascontiguousarray(y).tobytes(), self.n_estimators, seed,
            self.max_depth, self.min_samples_leaf, self._features_of(X.shape[1]), self.bootstrap, self.random_thresholds,
        )
        return self

    def _features_of(self, n):
        """`max_features` as a number, or None for all of `n`."""
        given = self.max_features
        if given is None or isinstance(given, Integral):
            return given
        if isinstance(given, Real) and 0 < given <= 1:
            return max(1, int(given * n))
        if given in ("sqrt", "log2"):
            return max(1, int(n**0.5 if given == "sqrt" else np.log2(n)))
        raise ValueError(f'max_features is {given!r}: expected a number, a share above 0 up to 1.0, "sqrt", "log2" or None')

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


class CurveRegressor(RegressorMixin, BaseEstimator):
    """Curves over the last column of X, blended by the conditions in the others: X is (v, d), y is F.

    Rows with the same conditions are the points of one curve. With one condition it is crumple's model `linear` (beyond the
    contact, and but for the nodes of a model's curves): the force at equal deflection is interpolated linearly in speed between the neighbouring curves that reach this deflection, and held
    beyond the outermost. With several conditions the two nearest such curves count, each by the inverse of its distance (in
    standard deviations of the training conditions). Points of one curve at one deflection are averaged; beyond the
    longest curve its end holds.
    """

    def fit(self, X, y):
        """Fit to X (samples, conditions and then deflection) and y (samples,)."""
        X, y = validate_data(self, X, y, dtype=np.float64, y_numeric=True, multi_output=True)
        y = column_or_1d(y, warn=True, dtype=np.float64)
        order = np.lexsort(X.T[::-1])
        X, y = X[order], y[order]
        new = np.any(X[1:, :-1] != X[:-1, :-1], axis=1)
        starts = np.r_[0, np.flatnonzero(new) + 1, len(X)]
        self.conditions_ = X[starts[:-1], :-1]
        self.curves_ = []
        for start, end in zip(starts[:-1], starts[1:]):
            d, point = np.unique(X[start:end, -1], return_inverse=True)
            self.curves_.append((d, np.bincount(point, y[start:end]) / np.bincount(point)))
        self.ends_ = np.array([d[-1] for d, _ in self.curves_])
        spread = self.conditions_.std(axis=0)
        self.scale_ = np.where(spread > 0, spread, 1.0)
        return self

    def predict(self, X):
        """Force of shape (samples,)."""
        check_is_fitted(self)
        X = validate_data(self, X, dtype=np.float64, reset=False)
        predicted = np.empty(len(X))
        conditions, which = np.unique(X[:, :-1], axis=0, return_inverse=True) if X.shape[1] > 1 else (X[:1, :0], 0)
        which = np.broadcast_to(np.reshape(which, -1), len(X))
        deflection = np.minimum(X[:, -1], self.ends_.max())
        for k, condition in enumerate(conditions):
            rows = np.flatnonzero(which == k)
            offsets = (self.conditions_ - condition) / self.scale_
            # The same neighbours as long as the same curves reach.
            reached = np.searchsorted(np.sort(self.ends_), deflection[rows])
            for level in np.unique(reached):
                at = rows[reached == level]
                reaching = np.flatnonzero(self.ends_ >= deflection[at].max())
                predicted[at] = self._blended(offsets, reaching, deflection[at])
        return predicted

    def _blended(self, offsets, reaching, deflection):
        """The blend of the nearest curves among those that reach."""
        distance = np.sqrt((offsets[reaching] ** 2).sum(axis=1))
        if offsets.shape[1] == 1:
            below, above = (
                reaching[side][np.argmin(distance[side])] if side.any() else None
                for side in (offsets[reaching, 0] <= 0, offsets[reaching, 0] >= 0)
            )
            nearest = [k for k in (below, above) if k is not None]
        else:
            nearest = reaching[np.argsort(distance, kind="stable")[:2]]
        forces = [np.interp(deflection, *self.curves_[k]) for k in nearest]
        away = [np.sqrt((offsets[k] ** 2).sum()) for k in nearest]
        if len(forces) == 1 or away[0] == 0:
            return forces[0]
        if away[1] == 0:
            return forces[1]
        share = away[0] / (away[0] + away[1])
        return (1 - share) * forces[0] + share * forces[1]
