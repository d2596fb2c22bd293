"""Held-out error of scikit-learn's forest on the CSV file given: mean over seeds of the
rmse over all rows and splits, each row predicted by the forest fitted without its fold.

Columns are one fold number per split, the features, the target. Settings are those of the
test: 50 trees, bootstrap, unpruned, all features at every split. Also the mean of the
feature importances of a forest of each seed fitted to all rows. Prints JSON.
"""

import json
import sys

import numpy as np
from sklearn.ensemble import RandomForestRegressor

seeds, splits = int(sys.argv[2]), int(sys.argv[3])
table = np.loadtxt(sys.argv[1], delimiter=",")
folds, records, targets = table[:, :splits], table[:, splits:-1], table[:, -1]
errors, importances = [], []
for seed in range(seeds):
    residuals = np.empty((splits, len(targets)))
    for split in range(splits):
        for fold in np.unique(folds[:, split]):
            held_out = folds[:, split] == fold
            forest = RandomForestRegressor(n_estimators=50, random_state=seed, n_jobs=1)
            forest.fit(records[~held_out], targets[~held_out])
            residuals[split, held_out] = forest.predict(records[held_out]) - targets[held_out]
    errors.append(float(np.sqrt(np.mean(residuals**2))))
    forest = RandomForestRegressor(n_estimators=50, random_state=seed, n_jobs=1)
    importances.append(forest.fit(records, targets).feature_importances_)
importance = np.mean(importances, axis=0).tolist()
print(json.dumps({"rmse": float(np.mean(errors)), "importance": importance}))
