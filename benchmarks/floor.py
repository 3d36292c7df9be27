"""How much the floor ε under the covariances of the poses decides: SHAP, SA and who is causal, at floors 1e-9 to 1e-3.

    python benchmarks/floor.py results/full

No ICP runs: the covariances of a run that is there give every uncertainty anew (gpca.uncertainty.spread.divergence),
and `shap_additive` and `sa_local_additive` are asked again. `clean` is the uncertainty of a clean pair against another
one of the same object (design `causal`), in nats: what lies above its 95th percentile, in one source and seed, is
causal. Numbers are means over the seeds. The last line is a JSON object: per source and floor the accuracies,
clean_median, clean_95th, and the share of causal samples, of all and of each concept.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
from gpca.attribution.metrics import CAUSAL_QUANTILE  # noqa: E402
from gpca.errors import InputError  # noqa: E402
from gpca.explainers.registry import explainer_entry  # noqa: E402
from gpca.pairs.dataset import Registrations  # noqa: E402 (the script runs from a plain checkout)
from gpca.pairs.perturbation import CONCEPTS  # noqa: E402
from gpca.uncertainty.designs import DESIGNS  # noqa: E402
from gpca.uncertainty.outcomes import Outcomes  # noqa: E402
from gpca.uncertainty.settings import CONDITIONS  # noqa: E402
from gpca.uncertainty.spread import divergence  # noqa: E402

FLOORS = tuple(float(f"1e-{digits}") for digits in range(9, 2, -1))
EXPLAINERS = ("shap_additive", "sa_local_additive")
DESIGNS_READ = ("additive", "causal")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="folder of a run, e.g. results/full")
    folder = parser.parse_args(arguments).run
    result = {}
    try:
        for source in find_sources(folder):
            evaluated = read_source(folder, source)
            result[source] = {f"{floor:.0e}": mean_numbers(source, evaluated, floor) for floor in FLOORS}
            print_table(source, evaluated, result[source])
    except InputError as fault:
        print(f"floor: {fault}", file=sys.stderr)
        return 2
    print(json.dumps(result))
    return 0


def find_sources(folder: Path) -> list[str]:
    """Return the sources of a run for which SHAP or SA read the uncertainty."""
    if sources := sorted({path.parent.parent.name for path in folder.glob("uncertainty/*/additive/seed*.npz")}):
        return sources
    fault = "has no uncertainty/{source}/additive/seed*.npz"
    raise InputError(folder, fault, "name the folder of a run with shap_additive")


def read_source(folder: Path, source: str) -> dict[int, dict[str, Registrations]]:
    """Return by seed and design the registrations of a source, with the design's outcomes attached.

    Raises:
        InputError: no registrations, a seed without outcomes of both designs, or a damaged file.
    """
    evaluated = {}
    for path in sorted((folder / "registrations" / source).glob("seed*.npz")):
        registrations = Registrations.load(path)
        of_design = {}
        for design in DESIGNS_READ:
            outcomes = Outcomes.load(folder / "uncertainty" / source / design / path.name)
            no_seconds = np.zeros_like(outcomes.uncertainty)  # times are not asked for
            of_design[design] = outcomes.attach_to(registrations, no_seconds, no_seconds)
        evaluated[int(path.stem.removeprefix("seed"))] = of_design
    if not evaluated:
        raise InputError(folder, f"has no registrations/{source}/seed*.npz", "the run is incomplete")
    return evaluated


def mean_numbers(source: str, evaluated: dict[int, dict[str, Registrations]], floor: float) -> dict[str, float]:
    """Return the numbers of :func:`seed_numbers` as means over the seeds; a concept absent from a seed is left out."""
    of_seeds = [seed_numbers(source, seed, floor, **of_design) for seed, of_design in evaluated.items()]
    names = dict.fromkeys(name for numbers in of_seeds for name in numbers)
    return {name: float(f"{np.mean([numbers[name] for numbers in of_seeds if name in numbers]):.4g}") for name in names}


def seed_numbers(
    source: str, seed: int, floor: float, additive: Registrations, causal: Registrations
) -> dict[str, float]:
    """Return accuracies, median and 95th percentile of the clean uncertainties, and shares of causal samples."""
    additive = at_floor(additive, "additive", floor)
    numbers = {}
    for name in EXPLAINERS:
        attribution = explainer_entry(name).make(source, seed).explain(additive.without_labels())
        numbers[name] = np.mean(attribution.predicted_N == additive.concept)  # abstained is wrong
    uncertainty_S_K = at_floor(causal, "causal", floor).attached["uncertainty"]
    clean_S, observed_S = (uncertainty_S_K[:, CONDITIONS["causal"].index(name)] for name in ("clean", "observed"))
    numbers |= {"clean_median": np.median(clean_S), "clean_95th": np.quantile(clean_S, CAUSAL_QUANTILE)}
    causal_S = observed_S > numbers["clean_95th"]
    shares = {f"causal_{c}": causal_S[causal.concept == c].mean() for c in CONCEPTS if c in causal.concept}
    return numbers | {"causal": causal_S.mean()} | shares


def at_floor(registrations: Registrations, design: str, floor: float) -> Registrations:
    """Return the same registrations with the uncertainty that another floor gives."""
    covariance_S_K_6_6 = registrations.attached["covariance"]
    reference = covariance_S_K_6_6[:, DESIGNS[design].reference, None]
    uncertainty = {"uncertainty": divergence(reference, covariance_S_K_6_6, floor)}
    return replace(registrations, attached={**registrations.attached, **uncertainty})


def print_table(source: str, evaluated: dict, by_floor: dict[str, dict[str, float]]) -> None:
    counts = (
        f"{sum(len(of_design[design]) for of_design in evaluated.values())} ({design})" for design in DESIGNS_READ
    )
    print(f"{source}: {len(evaluated)} seed(s), samples {', '.join(counts)}; clean in nats, the rest in %\n")
    names = list(dict.fromkeys(name for numbers in by_floor.values() for name in numbers))
    print(f"{'floor':7}" + "".join(f"{name:>{len(name) + 2}}" for name in names))
    for floor, numbers in by_floor.items():
        cells = (
            f"{numbers[name] if name.startswith('clean') else 100 * numbers[name]:>{len(name) + 2}.1f}"
            for name in names
        )
        print(f"{floor:7}" + "".join(cells))
    print()


if __name__ == "__main__":
    sys.exit(main())
