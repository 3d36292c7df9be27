"""Seconds that the truth of one candidate takes, and what the candidates are before any is refused.

    python benchmarks/causes.py [--candidates 60] [--starts 13] [--family ycb] [--objects objects.npz]

On one thread, on procedural objects or on those of a file. For every candidate all subsets of its causes are
registered, from two sets of starts in turn: the second is the ceiling, what the truth of the first says of it. The
plain reference calls Open3D once for each start and subset, on a sixth of the candidates. The last line is a JSON
object: truth_s (mean of one truth, with drawing the candidate), speedup (median ratio to the reference),
max_error_difference (of v, between the two, median over the candidates), shares of the states and of the dominant
causes, several (share of the failed), refused (without a truth, or off when clean), ceiling (state, and of the failed
dominant cause, the same; borderline left out).
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

SEED = 100  # no config's


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--candidates", type=int, default=60)
    parser.add_argument("--starts", type=int, default=13)
    parser.add_argument("--family", default="ycb", help="family of procedural objects")
    parser.add_argument("--objects", type=Path, help="file of canonical clouds, in place of procedural objects")
    options = parser.parse_args(arguments)
    prepare()
    from gpca.causes.measuring import measure_clean_pairs, read_subjects
    from gpca.causes.settings import CauseSettings
    from gpca.objects.canonical import ObjectClouds

    source = options.objects.stem if options.objects else options.family
    settings = CauseSettings(starts=options.starts)
    objects = ObjectClouds.load(options.objects) if options.objects else procedural(options.family)
    subjects, limit = measure_clean_pairs(read_subjects(objects), source, SEED, settings)
    result = measure(subjects, source, settings, limit, options.candidates)
    for name, value in result.items():
        print(f"{name:24s} {value:.4g}")
    print(json.dumps(result))


def procedural(family: str):
    """Return the canonical clouds of a procedural family."""
    from gpca.objects.canonical import ObjectClouds, write_objects
    from gpca.objects.procedural import surfaces

    with tempfile.TemporaryDirectory() as folder:
        write_objects(surfaces(family), family, Path(folder, "objects.npz"))
        return ObjectClouds.load(Path(folder, "objects.npz"))


def measure(subjects, source: str, settings, uncertainty_limit: float, candidates: int) -> dict[str, float]:
    """Measure the candidates; see the head of the file."""
    import numpy as np

    from gpca.causes.candidate import Counterfactuals, Registrar, Unmeasurable, draw_applied, draw_candidate
    from gpca.causes.truth import ALL, BORDERLINE, FAILED, SUBSETS, Truth
    from gpca.seeds import generator

    worths, seconds, ratios, differences = [], [], [], []
    for number in range(candidates):
        subject = subjects[number % len(subjects)]
        random = generator(source, SEED, "benchmark", number)
        started = perf_counter()
        candidate = draw_candidate(subject.surface, draw_applied(settings, random), settings, random)
        xi_2_n_6 = random.normal(size=(2, settings.starts, 6)) * settings.deviation_6()
        try:
            pair = []
            for xi_n_6 in xi_2_n_6:
                measured = Counterfactuals(Registrar(candidate, settings), subject.errors, xi_n_6, settings)
                errors = [measured.error(subset) for subset in range(len(SUBSETS))]
                pair.append((errors, [measured.uncertainty(subset) for subset in range(len(SUBSETS))]))
                seconds.append(perf_counter() - started)
                started = perf_counter()
        except Unmeasurable:
            continue
        worths.append(pair)
        if number % 6 == 0:
            started = perf_counter()
            plain = plain_error(candidate, subject, xi_2_n_6[0], settings)
            subsets = 2 ** int(candidate.applied.sum())
            ratios.append((perf_counter() - started) * subsets / np.mean(seconds[-2:]))
            differences.append(abs(plain - pair[0][0][ALL]))
    limits = settings.limits
    own = (limits.nominal, limits.failed, limits.cause, uncertainty_limit)
    first, again = (Truth(*(np.array([pair[k][j] for pair in worths]) for j in range(2)), *own) for k in range(2))
    fine = ~first.geometry
    failed = fine & (first.state == FAILED)
    judged = fine & (first.state != BORDERLINE)
    same = (first.state == again.state) & ((first.state != FAILED) | (first.dominant == again.dominant))
    result = {"truth_s": np.mean(seconds[2:]), "speedup": median(ratios), "max_error_difference": median(differences)}
    result |= {state: np.mean(first.state[fine] == state) for state in ("nominal", BORDERLINE, FAILED)}
    result |= {f"failed_by_{name}": np.mean(first.dominant[failed] == name) for name in ("noise", "pose", "overlap")}
    result |= {"several": np.mean(first.causes[failed].sum(axis=1) > 1), "refused": 1 - fine.sum() / candidates}
    result["ceiling"] = same[judged].mean()
    return {name: float(value) for name, value in result.items()}


def plain_error(candidate, subject, xi_n_6, settings) -> float:
    """Return v of all causes by one call of Open3D for each start."""
    import numpy as np

    from gpca.alignment.icp import ICP
    from gpca.alignment.pose_error import pose_error
    from gpca.causes.measuring import JUDGED_POINTS
    from gpca.rigid import exp

    causes = tuple(np.flatnonzero(candidate.applied).tolist())
    errors = []
    for T_start in exp(xi_n_6) @ candidate.start(causes):
        icp = ICP(candidate.observed(causes), None, settings.icp)
        pose = icp.register(candidate.model, np.linalg.inv(T_start)).T_target_source
        if subject.symmetric:
            errors.append(subject.errors(pose[None])[0])
        else:
            errors.append(pose_error(subject.surface[:JUDGED_POINTS], pose, np.eye(4), symmetric=False))
    return float(np.minimum(errors, 0.5).mean())


if __name__ == "__main__":
    main()
