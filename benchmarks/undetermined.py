"""Which directions of a pose are free, by method; and the scale of the source.

    python benchmarks/undetermined.py [--repeats 2] [--methods likelihood censi]
    python benchmarks/undetermined.py --scale [--repeats 6]

Protocols: docs/appendix.md. The last line is a JSON object: auroc_, named_, unnamed_ and ms_<method>, or the shares
of false alarms and of found scales.
"""

import argparse
import json
import sys
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

SEED = 100  # no config's
FREE, HELD = 0.002, 0.02  # shares of squared displacement along the normals
THRESHOLD = 0.015  # diameters
NOISES, COUNTS, HIDDEN = (0.002, 0.01, 0.03), (256, 1024), (0.0, 0.5)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=2, help="pairs of each shape and condition")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--scale", action="store_true", help="measure the scale")
    parser.add_argument("--every", type=int, default=1, help="use every so manieth stand-in")
    parser.add_argument("--skip", type=int, default=0, help="the first of these")
    parser.add_argument("--out", type=Path, help="CSV file for what was measured of every direction or pair")
    options = parser.parse_args(arguments)
    prepare()
    found = measure_scale(options) if options.scale else measure_freedom(options)
    print(json.dumps({name: round(float(value), 4) for name, value in found.items()}))


# Shapes: functions of a count and a generator that return points and unit normals (n, 3).


def rectangle(n, random, wide, long, normal="z"):
    points = np.zeros((n, 3))
    i, j, k = {"z": (0, 1, 2), "y": (0, 2, 1), "x": (1, 2, 0)}[normal]
    points[:, i], points[:, j] = random.uniform(-wide / 2, wide / 2, n), random.uniform(-long / 2, long / 2, n)
    return points, np.tile(np.eye(3)[k], (n, 1))


def joined(parts):
    return tuple(np.concatenate(column) for column in zip(*parts, strict=True))


def plane(n, random, larger=1.0):
    return rectangle(n, random, 0.6 * larger, 0.5 * larger)


def corridor(n, random, larger=1.0):
    parts = []
    for normal, offset in (("z", (0, 0, -0.15)), ("x", (0.15, 0, 0)), ("x", (-0.15, 0, 0))):
        points, normals = rectangle(n // 3, random, 0.3, 0.8 * larger, "z")
        if normal == "x":
            points, normals = points[:, [2, 1, 0]], normals[:, [2, 1, 0]]
        parts.append((points + offset, normals))
    return joined(parts)


def shaft(n, random, larger=1.0):
    turn, along = random.uniform(0, 2 * np.pi, n), random.uniform(-0.35, 0.35, n) * larger
    normals = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    return 0.12 * normals + np.outer(along, [0, 0, 1]), normals


def box(n, random, larger=1.0):
    extents, parts = np.array([0.7, 0.5, 0.4]), []
    for axis in range(3):
        for sign in (-1, 1):
            others = np.delete(np.arange(3), axis)
            count = round(n * extents[others].prod() / (2 * sum(np.delete(extents, k).prod() for k in range(3))))
            points = random.uniform(-0.5, 0.5, (count, 3)) * extents
            points[:, axis] = sign * extents[axis] / 2
            parts.append((points, np.tile(sign * np.eye(3)[axis], (count, 1))))
    return joined(parts)


def sphere(n, random, larger=1.0):
    normals = random.normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / 2, normals


def vase(n, random, larger=1.0):
    z, turn = random.uniform(-0.45, 0.45, n), random.uniform(0, 2 * np.pi, n)
    radius, slope = 0.2 + 0.06 * np.sin(8 * z), 0.48 * np.cos(8 * z)
    out = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    normals = out - np.outer(slope, [0, 0, 1]) * 1.0
    points = radius[:, None] * out + np.outer(z, [0, 0, 1])
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def handled(n, random, larger=1.0):
    body, body_normals = vase(n - n // 8, random)
    along, turn, count = random.uniform(0, np.pi, n // 8), random.uniform(0, 2 * np.pi, n // 8), n // 8
    out = np.column_stack([np.sin(along), np.zeros(count), np.cos(along)])
    normals = np.cos(turn)[:, None] * out + np.outer(np.sin(turn), [0, 1, 0])
    return joined([(body, body_normals), (0.18 * out + 0.02 * normals + [0.18, 0, 0], normals)])


def outline(corners, n, random):
    corners = np.array(corners, float)
    ends = np.roll(corners, -1, axis=0)
    lengths = np.linalg.norm(ends - corners, axis=1)
    side = random.choice(len(corners), n, p=lengths / lengths.sum())
    points = corners[side] + random.random(n)[:, None] * (ends - corners)[side]
    along = ((ends - corners) / lengths[:, None])[side]
    flat = np.column_stack([points, np.zeros(n)])
    return flat, np.column_stack([along[:, 1], -along[:, 0], np.zeros(n)])


def flat_room(n, random, larger=1.0):
    return outline([(-0.4, -0.3), (0.4, -0.3), (0.4, 0.1), (0.1, 0.1), (0.1, 0.3), (-0.4, 0.3)], n, random)


def flat_corridor(n, random, larger=1.0):
    side, along = random.choice([-1, 1], n), random.uniform(-0.35, 0.35, n) * larger
    return np.column_stack([along, 0.12 * side, np.zeros(n)]), np.outer(side, [0.0, 1.0, 0.0])


OPEN_ENDED, LARGER = ("plane", "corridor", "shaft", "flat_corridor"), 1.6
SYNTHETIC = (plane, corridor, shaft, box, sphere, vase, handled, flat_room, flat_corridor)


def shapes():
    """Yield name and function of every shape; stand-ins are measured in diameters."""
    from gpca.objects.canonical import CanonicalFrame, bounding_center, diameter
    from gpca.objects.procedural import surfaces

    for shape in SYNTHETIC:
        yield shape.__name__, shape
    for family in ("ycb", "linemod"):
        for surface in surfaces(family):
            frame = CanonicalFrame(bounding_center(surface), diameter(surface.vertices_m, surface.name))
            corners = frame.coordinates(surface.vertices_m)[surface.faces]
            yield f"{family}/{surface.name}", lambda n, random, larger=1.0, corners=corners: on_mesh(corners, n, random)


def on_mesh(corners_F_3_3, n, random):
    crosses = np.cross(corners_F_3_3[:, 1] - corners_F_3_3[:, 0], corners_F_3_3[:, 2] - corners_F_3_3[:, 0])
    areas = np.linalg.norm(crosses, axis=1)
    face = random.choice(len(areas), n, p=areas / areas.sum())
    a, b = np.sort(random.random((2, n)), axis=0)
    weights = np.column_stack([a, b - a, 1 - b])
    return np.einsum("nk,nki->ni", weights, corners_F_3_3[face]), (crosses / areas[:, None])[face]


def true_directions(points, normals, flat):
    """Return the true twists (6, m) of unit displacement, and which are free (m,); those between are left out."""
    from scipy.linalg import eigh

    from gpca.rigid import point_jacobians

    jacobians = point_jacobians(points)
    if flat:
        jacobians = jacobians[:, :, [2, 3, 4]]
    rows = np.einsum("ni,nij->nj", normals, jacobians)
    metric = np.einsum("nij,nik->jk", jacobians, jacobians) / len(points)
    holds, twists = eigh(rows.T @ rows / len(points), metric + 1e-12 * np.eye(len(metric)))
    if flat:
        twists = np.array([np.eye(6)[[2, 3, 4]].T @ twist for twist in twists.T]).T
    clear = (holds < FREE) | (holds > HELD)
    return twists[:, clear], (holds < FREE)[clear]


# Methods: functions of the source at its pose and the target that return a covariance (6, 6).


def freedom(source, target, open_ends):
    from scipy.spatial import cKDTree

    from gpca.reenactment.freedom import Holder
    from gpca.rigid import adjoint, rigid_motion

    found = Holder(target, cKDTree(target), open_ends).freedom(source)
    about_origin = adjoint(rigid_motion(np.eye(3), found.center_3))
    return about_origin @ found.covariance @ about_origin.T


def likelihood(source, target):
    return freedom(source, target, open_ends=False)


def planes(source, target):
    return freedom(source, target, open_ends=True)


def registry(name, method):
    def estimate(source, target):
        from gpca.alignment.methods.interface import Outcome, Pair
        from gpca.uncertainty.estimators.interface import RegisteredPair
        from gpca.uncertainty.estimators.registry import make_estimator
        from gpca.uncertainty.settings import UncertaintySettings

        pair = Pair(source, target).with_normals()
        estimated = make_estimator(name, {})(
            RegisteredPair(pair, Outcome(np.eye(4), 1.0, 0.01), method, UncertaintySettings().deviation_6())
        )
        return estimated.covariance_6_6

    return estimate


METHODS = {
    "censi": registry("censi", "point_to_point"),
    "bonnabel": registry("bonnabel", "point_to_plane"),
    "brossard": registry("brossard", "point_to_plane"),
    "monte_carlo": registry("monte_carlo", "point_to_point"),
    "likelihood": likelihood,
    "planes": planes,
}


def measure_freedom(options):
    from gpca.alignment.batched_icp import BatchedICP
    from gpca.alignment.icp import ICPSettings
    from gpca.pairs.perturbation import displacement
    from gpca.rigid import point_jacobians, random_direction, transform
    from gpca.seeds import generator

    rows = []
    conditions = product(chosen(options), NOISES, COUNTS, HIDDEN, range(options.repeats))
    for (name, shape), noise, count, hidden, repeat in conditions:
        random = generator("undetermined", SEED, name, noise, count, hidden, repeat)
        flat, open_ended = name.startswith("flat"), name in OPEN_ENDED
        in_plane = np.array([1, 1, 0]) if flat else np.ones(3)
        points, normals = shape(round(count / (1 - hidden)), random)
        kept = seen(points, hidden, random, in_plane)
        points, normals = points[kept], normals[kept]
        target = shape(round(count * LARGER), random, LARGER)[0] if open_ended else shape(count, random)[0]
        source = points + noise * random.normal(size=points.shape) * in_plane
        target = target + min(noise, 0.005) * random.normal(size=target.shape) * in_plane
        axis = np.eye(3)[2] if flat else random_direction(random)
        T_start = displacement(np.deg2rad(3) * axis, 0.03 * np.eye(3)[0])
        T = BatchedICP(target, ICPSettings()).register(source, T_start[None])[0][0]
        twists, free = true_directions(transform(T, points), normals @ T[:3, :3].T, flat)
        moved = transform(T, source)
        jacobians = point_jacobians(moved)
        metric = np.einsum("nij,nik->jk", jacobians, jacobians) / len(moved)
        for method in options.methods:
            started = process_time()
            covariance = METHODS[method](moved, target)
            ms = 1e3 * (process_time() - started)
            for twist, is_free in zip(twists.T, free, strict=True):
                along = metric @ twist
                deviation = np.nan if covariance is None else np.sqrt(max(along @ covariance @ along, 0.0))
                rows.append((name, noise, count, hidden, method, bool(is_free), float(deviation), ms))
    return summed(rows, options)


def chosen(options):
    """Return the shapes that are asked for: all synthetic ones only with the first of the stand-ins."""
    every = list(shapes())
    synthetic = every[: len(SYNTHETIC)] if options.skip == 0 and not options.scale else []
    return synthetic + every[len(SYNTHETIC) + options.skip :: options.every]


def seen(points, hidden, random, in_plane=1):
    """Return which points a half-space leaves that hides this share."""
    from gpca.rigid import random_direction

    along = points @ (random_direction(random) * in_plane)
    return along <= np.quantile(along, 1 - hidden)


def summed(rows, options):
    import pandas as pd
    from sklearn.metrics import roc_auc_score

    table = pd.DataFrame(rows, columns=["shape", "noise", "count", "hidden", "method", "free", "deviation", "ms"])
    if options.out:
        table.to_csv(options.out, index=False)
    result = {}
    for method in options.methods:
        part = table[table["method"] == method]
        deviation = part["deviation"].fillna(1.0)  # no covariance: everything would be free
        result[f"auroc_{method}"] = roc_auc_score(part["free"], deviation)
        result[f"named_{method}"] = (deviation[part["free"]] > THRESHOLD).mean()
        result[f"unnamed_{method}"] = (deviation[~part["free"]] <= THRESHOLD).mean()
        result[f"failed_{method}"] = part["deviation"].isna().mean()
        result[f"ms_{method}"] = part["ms"].median()
    count = len(options.methods)
    print(f"{table['free'].sum() // count} free and {(~table['free']).sum() // count} held directions")
    for name, value in result.items():
        print(f"{name:28}{value:10.3f}")
    return result


# Condition -> size of the source, most noise, hidden share of the source, at least and at most, and of the target.
SCALES = {
    "noise": (1.0, 0.06, (0.0, 0.0), 0.0),
    "hidden": (1.0, 0.005, (0.75, 0.75), 0.0),
    "partial": (1.0, 0.005, (0.0, 0.0), 0.5),
    **{f"{size:g}": (size, 0.01, (0.0, 0.3), 0.0) for size in (0.5, 0.8, 0.9, 1.1, 1.25, 2.0)},
}


def measure_scale(options):
    from gpca.alignment.batched_icp import BatchedICP
    from gpca.alignment.icp import ICPSettings
    from gpca.objects.canonical import CanonicalFrame
    from gpca.pairs.perturbation import displacement
    from gpca.reenactment.hypotheses import find_hypotheses
    from gpca.reenactment.scale import find_scale
    from gpca.reenactment.settings import ReenactmentSettings
    from gpca.reenactment.surface import ModelSurface
    from gpca.rigid import random_direction, transform
    from gpca.seeds import generator

    rows = []
    for (name, shape), condition, repeat in product(chosen(options), SCALES, range(options.repeats)):
        size, most_noise, hidden, missing = SCALES[condition]
        random = generator("scale", SEED, name, condition, repeat)
        if size != 1 and repeat % 3:
            continue  # there are twice as many conditions
        target = shape(round(512 / (1 - missing)), random)[0]
        target = target[seen(target, missing, random)]
        frame = CanonicalFrame.of(target, None)
        points = shape(2048, random)[0]
        source = points[seen(points, random.uniform(*hidden), random)][
            : round(np.exp(random.uniform(*np.log([256, 512]))))
        ]
        source = source + random.uniform(0, most_noise) * random.normal(size=source.shape)
        T_start = displacement(
            np.deg2rad(random.uniform(0, 5)) * random_direction(random), 0.01 * random_direction(random)
        )
        before = transform(T_start, frame.coordinates(size * source))
        model = frame.coordinates(target)
        T = BatchedICP(model, ICPSettings()).register(before, np.eye(4)[None])[0][0]
        surface = ModelSurface(model)
        error = surface.errors((T @ T_start)[None])[0]
        first = find_hypotheses(before, surface, T[None], ReenactmentSettings(), random)[0].T
        started = process_time()
        T_k = [first] if surface.apart((T @ np.linalg.inv(first))[None])[0] < 0.012 else [first, T]
        found = find_scale(before, T_k, surface, random)
        rows.append(
            (name, condition, size, error, found.factor, found.nats, found.off, 1e3 * (process_time() - started))
        )
    return summed_scales(rows, options)


def summed_scales(rows, options):
    import pandas as pd

    from gpca.evaluation.intervals import wilson_interval

    table = pd.DataFrame(rows, columns=["shape", "condition", "size", "error", "factor", "nats", "off", "ms"])
    if options.out:
        table.to_csv(options.out, index=False)
    change = (table["size"] - 1).abs()
    close = (table["factor"] - table["size"]).abs() <= np.maximum(0.1 * change, 0.02)
    result = {"ms": table["ms"][change == 0].median()}
    for condition, part in table.groupby("condition"):
        right = part[(part["error"] <= 0.03) | (part["size"] != 1)]
        n, off = len(right), int(right["off"].sum())
        low, high = wilson_interval(off, n) if n else (0, 1)
        kind = "false" if SCALES[condition][0] == 1 else "named"
        near = close[right.index].mean()
        print(f"{condition:8} {kind} {off:4} of {n:4} ({low:.3f} to {high:.3f}), close {near:.3f}")
        result |= {f"{kind}_{condition}": off / max(n, 1), f"close_{condition}": near}
    return result


if __name__ == "__main__":
    main()
