"""What limits that were set on n labeled registrations of a user promise, where the promise of the model does not hold.

    python benchmarks/calibration.py [--model results/default/model.pt] [--pairs 600] [--tolerance 3%] [--whole]

The user's registrations differ from those of the training: the target lacks 30 % of the surface, and the source shows
one side of it alone. Objects are the package's stand-ins; starts are 0 to 60° off. Each of `REPEATS` draws labels n
registrations, sets the limits on them, and tests these on the others; a promise holds on average over the draws. "none"
are the limits of the model itself. The last line is a JSON object of the means.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

SEED = 100  # of development
MISSING = 0.3  # share of the target
POINTS = 1024  # of the target, and twice those of the source
FAR_DEG, FAR = 60.0, 0.1  # largest rotation and shift (diameters) of a start
NOISE = 0.005  # diameters
COUNTS = 20, 50, 100, 200  # labeled registrations
REPEATS = 200
MEASURES = "failures called good", "good called failed", "not sure", "sets hold the truth"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, help="default: the model that gpca explain takes")
    parser.add_argument("--pairs", type=int, default=600)
    parser.add_argument("--tolerance", default="3%")
    parser.add_argument("--whole", action="store_true", help="target and source show the whole object: no shift")
    options = parser.parse_args(arguments)
    prepare()
    from gpca.model.explainer import Explainer

    explainer = Explainer.load(options.model)
    pairs = registered(explainer, options.pairs, options.tolerance, not options.whole)
    diagnoses, right = zip(*pairs, strict=True)
    print(json.dumps(compared(explainer.model.diagnoser, diagnoses, right)))


def registered(explainer, count: int, tolerance: str, shifted: bool) -> Iterator[tuple]:
    """Yield the diagnosis of each registration, and whether the result is right."""
    import numpy as np

    from gpca.objects.canonical import canonical_cloud
    from gpca.objects.procedural import FAMILIES, surfaces
    from gpca.reenactment.surface import ModelSurface
    from gpca.rigid import exp, inverses, transform
    from gpca.seeds import generator

    objects = [surface for family in FAMILIES for surface in surfaces(family)]
    for number in range(count):
        random = generator("calibration benchmark", SEED, number)
        points, normals, diameter = canonical_cloud(objects[number % len(objects)], "calibration benchmark")
        directions = random.normal(size=(2, 3))
        height = points @ directions[0]
        target = points[height <= np.quantile(height, 1 - MISSING * shifted)]
        target = target[random.permutation(len(target))[:POINTS]]
        seen = points[normals @ directions[1] > 0] if shifted else points
        source = seen[random.permutation(len(seen))[: POINTS // 2]]
        source = source + random.normal(scale=NOISE * diameter, size=source.shape)
        axis, way = random.normal(size=(2, 3))
        turn = np.deg2rad(random.uniform(0, FAR_DEG)) * axis / np.linalg.norm(axis)
        shift = random.uniform(0, FAR) * diameter * way / np.linalg.norm(way)
        T_off = exp(np.append(turn, shift)[None])[0]
        explanation = explainer.explain(transform(T_off, source), target, tolerance=tolerance)
        surface = ModelSurface(points[: 2 * POINTS] / diameter)
        T_error = explanation.T_target_source @ T_off
        T_error[:3, 3] /= diameter
        error = diameter * float(surface.errors(inverses(T_error[None]))[0])
        yield explanation.diagnosis, error <= explanation.diagnosis.tolerance
        if number % 50 == 49:
            print(f"{number + 1} of {count}", file=sys.stderr)


def compared(diagnoser, diagnoses: Sequence, right: Sequence[bool]) -> dict[str, float]:
    """Print the risks of the model's own limits and of those that were set on n of the registrations."""
    import numpy as np

    from gpca.model.calibration import RIGHT, WRONG, LabeledRegistrations
    from gpca.model.diagnosis import state_probabilities
    from gpca.model.result import level_at
    from gpca.seeds import generator

    known = [number for number, diagnosis in enumerate(diagnoses) if not diagnosis.void]
    diagnoses, right_N = [diagnoses[number] for number in known], np.array(right)[known]
    causes_N_3 = np.array([[*diagnosis.causes.values()] for diagnosis in diagnoses])
    scores_N_5 = state_probabilities(causes_N_3, np.array([diagnosis.result for diagnosis in diagnoses]))
    own = level_at(diagnoser.levels, diagnoses[0].tolerance_share).guarantee
    print(f"{len(known)} registrations of a known state, {right_N.sum()} right; mean (5 to 95 % of the draws)")
    print(f"{'labeled':>7}", *(f"{name:>24}" for name in MEASURES))
    result = {"samples": len(known), "right": int(right_N.sum())}
    if own:
        result |= printed("none", [risks(own, scores_N_5, right_N)])
        call_N = own.alarm(1 - scores_N_5[:, 0])
        for call in np.unique(call_N):
            print(
                f"{call:>15}: {(call_N == call).mean():.1%}, of which {(~right_N)[call_N == call].mean():.1%} are wrong"
            )
    for count in COUNTS:
        draws = []
        for number in range(REPEATS):
            order = generator("calibration benchmark", SEED, count, number).permutation(len(known))
            labeled, others = order[:count], order[count:]
            labels = np.where(right_N[labeled], RIGHT, WRONG).tolist()
            if len(set(labels)) == 2:
                [level] = LabeledRegistrations.of([diagnoses[row] for row in labeled], labels).levels()
                draws.append(risks(level.guarantee, scores_N_5[others], right_N[others]))
        result |= printed(str(count), draws) if draws else {}
    return result


def risks(guarantee, scores_M_5, right_M) -> list[float]:
    """Return `MEASURES`; a set that holds any cause holds a wrong result."""
    call_M, inside_M_K = guarantee.alarm(1 - scores_M_5[:, 0]), guarantee.sets(scores_M_5)
    holds_M = (inside_M_K[:, 0] & right_M) | (inside_M_K[:, 1:].any(axis=1) & ~right_M)
    missed, alarms = (call_M == "good")[~right_M].mean(), (call_M == "failed")[right_M].mean()
    return [missed, alarms, (call_M == "not sure").mean(), holds_M.mean()]


def printed(name: str, draws: Sequence[Sequence[float]]) -> dict[str, float]:
    import numpy as np

    mean_4, low_4, high_4 = np.mean(draws, axis=0), *np.quantile(draws, [0.05, 0.95], axis=0)
    cells = [f"{mean:.1%} ({low:.1%} to {high:.1%})" for mean, low, high in zip(mean_4, low_4, high_4, strict=True)]
    print(f"{name:>7}", *(f"{cell:>24}" for cell in cells))
    return {
        f"{measure}_{name}".replace(" ", "_"): round(float(x), 4) for measure, x in zip(MEASURES, mean_4, strict=True)
    }


if __name__ == "__main__":
    main()
