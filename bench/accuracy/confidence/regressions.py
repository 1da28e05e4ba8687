# SPDX-License-Identifier: BSD-3-Clause
"""The regressions of the confidence: which models there are, and how one is fitted to features. Needs numpy;
fits need scipy and scikit-learn."""

import itertools
from typing import NamedTuple

import numpy as np


class Model(NamedTuple):
    """The evidence beside the overlap that a model has."""

    free_space: bool
    surface_sides: bool
    model: bool = False  # one of the clouds is a closed surface
    flat: bool = False  # scans of 2-D scanners

    @property
    def additive(self):
        return not self.model and not self.flat and not self.overlap_alone

    @property
    def overlap_alone(self):
        return not self.free_space and not self.surface_sides


MODELS = {
    "free_space_and_surface_sides": Model(True, True),
    "surface_sides": Model(False, True),
    "free_space": Model(True, False),
    "overlap_alone": Model(False, False),
    "model": Model(False, True, True),
}
# Of 2-D scans, which have the same features; see bench/flat_scans.
FLAT_MODELS = {
    "flat": Model(True, True, False, True),
    "flat_surface_sides": Model(False, True, False, True),
}
ALL_MODELS = {**MODELS, **FLAT_MODELS}
REGRESSIONS = ("ranking", "confidence", "overlap")

# Of the additive regressions: the direction in which each feature may move the odds. Others are left
# out: what has no direction belongs to a sensor or a building.
SIGNS = {
    **dict.fromkeys(
        (
            "log_match_support",
            "log_match_inliers",
            "log_lower_weighted_overlap",
            "log_lower_overlap",
            "log_first_eigenvalue",
            "log_second_eigenvalue",
            "log_third_eigenvalue",
            "information_volume",
            "lower_normal_agreement",
            "higher_normal_agreement",
            "share",
            "match_inliers_lead",
            "match_support_lead",
            "weighted_overlap_lead",
        ),
        1,
    ),
    **dict.fromkeys(
        (
            "higher_violation_of_all",
            "lower_violation_of_all",
            "higher_violation",
            "lower_violation",
            "log_higher_violation",
            "log_violation_of_all",
            "log_front_violation_near",
            "log_front_violation_far",
            "log_behind_surface",
            "higher_front_share",
            "lower_front_share",
            "higher_behind_share",
            "lower_behind_share",
            "distinct_share",
            "rival_match_inliers",
            "third_match_inliers",
            "rival_match_support",
            "rival_weighted_overlap",
        ),
        -1,
    ),
}
KNOTS = 5  # of a feature: quantiles from END to 1 - END
END = 0.005
STEP_PENALTY = 30.0  # half of it times the square of each rise; pairs count one on average
RANK_PENALTY = 3.0  # the same of the weights of standardised features in the ranking
MIN_RISE = 5e-4  # of a step that the header keeps
LINEAR_RANK = ("log_odds", "margin", "distinct_share")  # the rank in regressions linear in it

NO_PENALTY = 1e6  # for slope and intercept, which two numbers cannot overfit
MAX_DESCENT = 200  # iterations of the additive regressions and of the ranking
MAX_ITERATIONS = 5000  # of the solver, which warns where they are too few
MIN_SCALE = 1e-9  # bounds the standard deviation of a constant feature


def library():
    """The compiled module, which has the features."""
    from gpureg import _core

    return _core


class Regression:
    """weights: one per feature of the library; steps: (feature, from, to, rise)."""

    def __init__(self, weights, bias, steps=()):
        self.weights, self.bias, self.steps = weights, bias, list(steps)

    def log_odds(self, x):
        out = x @ self.weights + self.bias
        for feature, start, end, rise in self.steps:
            out = out + rise * np.clip((x[:, feature] - start) / (end - start), 0, 1)
        return out


def minimised(objective, start, bounds=None):
    """objective: value and gradient."""
    from scipy.optimize import minimize  # only fits need it

    return minimize(
        objective,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": MAX_DESCENT, "maxfun": 2 * MAX_DESCENT},
    ).x


def conditional_logit(x, correct, modes_per_pair, weight):
    """Weights under which the correct modes of each pair get their share of the odds of all its
    modes. Every pair has a correct one. weight: of each pair.
    """
    used = np.flatnonzero(x.std(0) > MIN_SCALE)
    scale = x[:, used].std(0)
    z = (x[:, used] - x[:, used].mean(0)) / scale
    first = np.r_[0, np.cumsum(modes_per_pair)[:-1]]
    pair = np.repeat(np.arange(len(first)), modes_per_pair)
    weight = weight / weight.mean()

    def objective(w):
        odds = z @ w
        odds = np.exp(odds - np.maximum.reduceat(odds, first)[pair])
        of_all = np.add.reduceat(odds, first)
        of_correct = np.maximum(np.add.reduceat(odds * correct, first), np.finfo(float).tiny)
        share = odds / of_all[pair] - odds * correct / of_correct[pair]
        value = -(weight * np.log(of_correct / of_all)).sum() + RANK_PENALTY / 2 * w @ w
        return value, z.T @ (weight[pair] * share) + RANK_PENALTY * w

    weights = np.zeros(x.shape[1])
    weights[used] = minimised(objective, np.zeros(len(used))) / scale
    # The search for degenerate directions asks how likely a mode is by itself.
    odds, of_mode = x @ weights, weight[pair]

    def likelihood(bias):
        z = odds + bias[0]
        error = of_mode * (1 / (1 + np.exp(-z)) - correct)
        return (of_mode * (np.logaddexp(0, z) - correct * z)).sum(), error.sum(keepdims=True)

    return Regression(weights, float(minimised(likelihood, np.array([-odds.mean()]))[0]))


def monotone(x, y, weight, names=None, signs=SIGNS, steps_at=None):
    """The additive regression of features with these names, by default those of pairs; see SIGNS.

    steps_at: features whose quantiles the steps begin and end at; by default all of them."""
    weight = weight / weight.mean()
    names = library()._confidence_feature_names() if names is None else names
    steps_at = x if steps_at is None else steps_at
    steps, columns, bounds = [], [], [(None, None)]
    for feature, name in enumerate(names):
        knots = np.unique(np.quantile(steps_at[:, feature], np.linspace(END, 1 - END, KNOTS)))
        if name not in signs or not np.ptp(knots) > MIN_SCALE:
            continue
        for start, end in itertools.pairwise(knots):
            if end - start > MIN_SCALE:
                steps.append((feature, start, end))
                columns.append(np.clip((x[:, feature] - start) / (end - start), 0, 1))
                bounds.append((0, None) if signs[name] > 0 else (None, 0))
    ramps = np.stack(columns, 1)

    def objective(p):
        odds = ramps @ p[1:] + p[0]
        value = (weight * (np.logaddexp(0, odds) - y * odds)).sum()
        error = weight * (1 / (1 + np.exp(-odds)) - y)
        gradient = np.r_[error.sum(), ramps.T @ error + STEP_PENALTY * p[1:]]
        return value + STEP_PENALTY / 2 * p[1:] @ p[1:], gradient

    start = np.zeros(len(bounds))
    start[0] = np.log((weight * y).sum() / (weight * ~y).sum())
    bias, *rises = minimised(objective, start, bounds)
    kept = [(*step, rise) for step, rise in zip(steps, rises) if abs(rise) > MIN_RISE]
    return Regression(np.zeros(x.shape[1]), float(bias), kept)


# The same of the linear regressions for models.
MODEL_SIGNS = {
    "log_uncovered": -1,
    "log_higher_violation": -1,
    "log_higher_weighted_overlap": 1,
    "log_odds": 1,
    "margin": 1,
    "distinct_share": -1,
}


def signed_logistic(x, y, weight, strength):
    """As logistic(), for models: no weight has another sign than MODEL_SIGNS."""
    names = library()._confidence_feature_names()
    used = np.array([k for k, name in enumerate(names) if name in MODEL_SIGNS and x[:, k].any()])
    mean, scale = x[:, used].mean(0), np.maximum(x[:, used].std(0), MIN_SCALE)
    z = np.c_[(x[:, used] - mean) / scale, np.ones(len(x))]

    def objective(b):
        odds = z @ b
        residual = weight * (1 / (1 + np.exp(-odds)) - y)
        loss = weight @ np.logaddexp(0, np.where(y, -odds, odds))
        plain = np.r_[b[:-1], 0]
        return strength * loss + plain @ b / 2, strength * (z.T @ residual) + plain

    bounds = [(0, None) if MODEL_SIGNS[names[k]] > 0 else (None, 0) for k in used]
    b = minimised(objective, np.zeros(len(used) + 1), [*bounds, (None, None)])
    weights = np.zeros(x.shape[1])
    weights[used] = b[:-1] / scale
    return Regression(weights, float(b[-1] - weights[used] @ mean))


def logistic(x, y, weight, strength):
    """Logistic regression on standardised features, written as weights of the features themselves.

    strength: inverse of the L2 penalty. Where few buildings leave weights undetermined, a strong
    penalty shares them out among similar features, which orders the poses of other buildings better. It also draws
    all odds together, so slope and intercept are fitted again without it."""
    from sklearn.linear_model import LogisticRegression  # only fits need it

    used = np.flatnonzero((x != 0).any(0))  # others belong to another model
    mean, scale = x[:, used].mean(0), np.maximum(x[:, used].std(0), MIN_SCALE)
    fit = LogisticRegression(C=strength, max_iter=MAX_ITERATIONS).fit(
        (x[:, used] - mean) / scale, y, weight
    )
    weights = np.zeros(x.shape[1])
    weights[used] = fit.coef_[0] / scale
    first = Regression(weights, float(fit.intercept_[0] - (weights[used] * mean).sum()))
    again = LogisticRegression(C=NO_PENALTY, max_iter=MAX_ITERATIONS).fit(
        first.log_odds(x)[:, None], y, weight
    )
    slope, intercept = float(again.coef_[0, 0]), float(again.intercept_[0])
    return Regression(slope * first.weights, slope * first.bias + intercept)
