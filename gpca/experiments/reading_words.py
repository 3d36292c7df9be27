"""Readings in words: the values of each group's choices, as :class:`gpca.comparison.readings.Words` wants them."""

from gpca.steps.readings.groups import GROUPS

WORDS = {  # field of a group's choices -> what its values are called
    "quantity": {
        "divergence": "KL divergence",
        "divergence_reversed": "reversed KL divergence",
        "log_determinant": "log determinant",
        "trace": "trace",
        "residual": "residual",
        "inlier_rmse": "inlier RMSE",
        "inlier_rmse_of_one": "inlier RMSE of one run",
    },
    "sign": {"signed": "largest value", "absolute": "largest magnitude", "lowest": "smallest value"},
    "unit": {"range": "knobs in units of their range", "own": "knobs in their own units"},
    "step": {"small": "small step", "middle": "step to the middle"},
    "background": {"observed": "from the observed pair", "clean": "from the clean pair"},
    "part": {
        "all": "all severities",
        "weakest": "weakest third",
        "middle": "middle third",
        "strongest": "strongest third",
    },
    "range": {"weaker": "weaker perturbations", "stronger": "stronger perturbations"},
    "classifier": {"paper": "the paper's setting", "converged": "trained longer"},
    "inputs": {
        "pool": "inputs scaled by the pool too",
        "labeled": "inputs scaled by the labeled samples alone",
        "standardised": "standardized inputs",
        "unit_norm": "inputs of unit norm",
        "raw": "raw inputs",
    },
    "inducing": {"kmeans": "inducing inputs by k-means", "random": "random inducing inputs"},
    "lengthscale": {"median": "lengthscale from the median distance", "default": "default lengthscale"},
    "batch": {"full": "all samples at once", "minibatch": "minibatches"},
    "kernel": {"rbf": "RBF", "matern32": "Matérn 3/2", "polynomial": "polynomial"},
    "start": {"warm": "warm start", "cold": "cold start", "posterior": "the posterior alone moves"},
    "machine": {"svc": "SVC", "linear_svc": "LinearSVC"},
    "probability": {"platt": "Platt scaling", "softmax": "softmax of the decision values"},
    "head": {"linear": "linear head", "two_layer": "head of two layers"},
    "set": {
        "in_distribution": "samples as in training",
        "severity": "severer perturbations",
        "source": "another dataset",
        "objects": "unseen objects",
        "seen_objects": "seen objects",
    },
    "distance": {
        "knn_analytical": "distance to neighbors in classic features",
        "mahalanobis_analytical": "Mahalanobis distance in classic features",
        "knn_embedding": "distance to neighbors in the embedding",
        "mahalanobis_embedding": "Mahalanobis distance in the embedding",
    },
    "score": {"max_score": "1 - largest score", "entropy": "entropy", "bald": "BALD"},
    "area": {"aurc": "AURC", "auroc_error": "1 - AUROC of errors"},
    "labels": {"at_target": "labels at the target", "all": "all labels"},
    "repeats": {
        "everything": "everything varies",
        "classifiers": "only the classifier varies",
        "samples": "classifier and training samples vary",
    },
    "objects": {"all": "all objects", "seen": "seen objects", "unseen": "unseen objects"},
    "architecture": {"judged": "judged encoder", "published": "encoder as published"},
    "initial_pose": {"true_pose": "ICP from near the true pose", "estimated": "ICP from estimators' poses"},
    "features": {
        "all": "all features",
        "no_counts": "without point counts",
        "no_residual": "without residuals",
        "residual": "residuals alone",
        "counts": "point counts alone",
    },
}
NUMBERS = {  # field -> the words around a number
    "starts": "{} starts",
    "noise": "noise of {}",
    "spread": "starts spread × {}",
    "overlap": "{} cut off",
    "floor": "variances of at least {}",
    "iterations": "{} iterations",
    "batch": "batches of {}",
    "new_share": "{} of the pool is new",
    "initial": "{} labels at the start",
    "learning_rate": "rate {}",
}


def reading(group: str, name: str) -> str:
    """A reading as words: ``RBF, 100 iterations`` for ``rbf/100`` of ``kernel``; unknown values stay as they are."""
    values, choices = name.split("/"), list(GROUPS[group].choices) if group in GROUPS else []
    return ", ".join(map(value, choices, values) if len(choices) == len(values) else values)


def value(choice: str, name: str) -> str:
    words = WORDS.get(choice, {})
    if name not in words and choice in NUMBERS:
        return NUMBERS[choice].format(name)
    return " and ".join(words.get(part, part) for part in name.split("+"))


def group(name: str) -> str:
    """What a group leaves open: ``How the GPC starts``; an unknown name stays as it is."""
    return GROUPS[name].title if name in GROUPS else name
