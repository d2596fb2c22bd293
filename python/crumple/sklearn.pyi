from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, RegressorMixin

class RegressionForest(RegressorMixin, BaseEstimator):
    n_estimators: int
    max_depth: int | None
    min_samples_leaf: int
    max_features: int | float | str | None
    bootstrap: bool
    random_thresholds: bool
    random_state: int | np.random.RandomState | None
    n_features_in_: int
    def __init__(
        self,
        n_estimators: int = 100,
        *,
        max_depth: int | None = None,
        min_samples_leaf: int = 1,
        max_features: int | float | str | None = None,
        bootstrap: bool = True,
        random_thresholds: bool = False,
        random_state: int | np.random.RandomState | None = None,
    ) -> None: ...
    def fit(self, X: ArrayLike, y: ArrayLike) -> Self: ...
    def predict(self, X: ArrayLike) -> NDArray[np.float64]: ...
    @property
    def feature_importances_(self) -> NDArray[np.float64]: ...
    def set_score_request(self, *, sample_weight: bool | None | str = "$UNCHANGED$") -> Self: ...
    def __getstate__(self) -> dict[str, Any]: ...
    def __setstate__(self, state: dict[str, Any]) -> None: ...

class CurveRegressor(RegressorMixin, BaseEstimator):
    n_features_in_: int
    conditions_: NDArray[np.float64]
    curves_: list[tuple[NDArray[np.float64], NDArray[np.float64]]]
    ends_: NDArray[np.float64]
    scale_: NDArray[np.float64]
    def fit(self, X: ArrayLike, y: ArrayLike) -> Self: ...
    def predict(self, X: ArrayLike) -> NDArray[np.float64]: ...
    def set_score_request(self, *, sample_weight: bool | None | str = "$UNCHANGED$") -> Self: ...
