"""The groups of descriptors and some of their columns by name; nothing here needs the code that computes them."""

GROUPS = ("distances", "planes", "motion", "starts", "remedied", "entropy")
QUANTILES = 13  # of each distance
MOTION = (
    *("rotation", "translation", "displacement", "fitness", "inlier_rmse"),
    *("spread_rotation", "spread_translation", "log_determinant"),
)
# Of the groups distances and motion, joined: every other quantile of the three distances, and all of the motion.
RESIDUALS = (*range(0, 3 * QUANTILES, 2), *range(4 * QUANTILES, 4 * QUANTILES + len(MOTION)))
DENSITIES = tuple(range(3 * QUANTILES, 3 * QUANTILES + 6))  # of the planes: spacings, extents, numbers of points
