"""Milliseconds of CPU that it takes to register two clouds, to judge the result and, if it is wrong, to put it right.

    python benchmarks/repair.py [--pairs 24] [--points 512] [--model results/full/model.pt]

On one thread, by `gpca.Explainer.repair`, on pairs of a procedural object with a pose error, every second one noisy,
every third cropped. The last line is a JSON object: repair_ms and repaired_ms (medians over all pairs, and over those
whose pose is replaced), slowest_ms, registered_ms (the registration alone), pairs, replaced, and right (of the replaced
poses, those within 3 % of the diameter).
"""

import argparse
import json
import sys
from pathlib import Path
from statistics import median
from time import process_time

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

LIMIT = 0.03  # diameters


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=24)
    parser.add_argument("--points", type=int, default=512, help="of either cloud")
    parser.add_argument("--model", type=Path, help="by default, the one that 'gpca repair' takes")
    options = parser.parse_args(arguments)
    prepare()
    import numpy as np

    from benchmarks.causes import procedural
    from gpca import Explainer
    from gpca.alignment.batched_icp import BatchedICP
    from gpca.causes.candidate import draw_candidate
    from gpca.causes.measuring import read_subjects
    from gpca.causes.settings import CauseSettings
    from gpca.model.repair import REPAIRED
    from gpca.reenactment.surface import ModelSurface
    from gpca.rigid import transform

    explainer = Explainer.load(options.model)
    settings = CauseSettings(points=(options.points, options.points))
    subjects = read_subjects(procedural("ycb"))
    repair_s, registered_s, errors = [], [], {}
    for number in range(-1, options.pairs):  # the first compiles
        applied = np.array([number % 2 == 0, True, number % 3 == 0])
        surface = subjects[number % len(subjects)].surface
        candidate = draw_candidate(surface, applied, settings, np.random.default_rng(100 + number))
        source = transform(candidate.T_init, candidate.observed(tuple(np.flatnonzero(applied).tolist())))
        started = process_time()
        repair = explainer.repair(source, candidate.model)
        repaired = process_time()
        BatchedICP(candidate.model, explainer.model.icp).register(source, np.eye(4)[None])
        if number >= 0:
            repair_s.append(repaired - started)
            registered_s.append(process_time() - repaired)
            if repair.verdict == REPAIRED:
                from_truth = repair.T_target_source @ candidate.T_init
                errors[number] = float(ModelSurface(candidate.model).errors(from_truth[None])[0])
    result = {
        "repair_ms": 1e3 * median(repair_s),
        "repaired_ms": 1e3 * median([repair_s[number] for number in errors] or [0.0]),
        "slowest_ms": 1e3 * max(repair_s),
        "registered_ms": 1e3 * median(registered_s),
        "pairs": len(repair_s),
        "replaced": len(errors),
        "right": sum(error <= LIMIT for error in errors.values()),
    }
    for name, value in result.items():
        print(f"{name:16s}{value:10.3g}")
    print(json.dumps({name: float(f"{value:.4g}") for name, value in result.items()}))


if __name__ == "__main__":
    main()
