"""How long one explanation takes, from two clouds to scores, against the same steps by plain means.

    python benchmarks/latency.py [--threads 1] [--points 512] [--pairs 12] [--repeats 50] [--draws 1000]
    python benchmarks/latency.py --model results/full/model.pt [--points 512] ...

Both register the same clouds and hold the same weights and posterior, in one process and in turn (A B A B …), so that
whatever else the machine does meets both. Ours is the explainer of `python -m gpca explain` with its model loaded. The
plain composition calls Open3D's ICP, a DGCNN with one linear layer per edge (tests/encoders/per_edge.py) and gpytorch's
own classes (gpca/classifier/gpytorch_classes.py), from which it draws, and works scores, variances and BALD out of the
draws as Eqs. 4, 5 and 7 read. Of a cloud of exactly as many points as the encoder sees, all draws of the protocol are
the same cloud: ours embeds it once, and `speedup` is over a plain composition that does so too. `speedup_all_draws` is
over one that embeds every draw, as the protocol reads. The clouds are perturbed ellipsoids, the encoder is not trained.
Both sides draw their own numbers, so their scores differ by the error of sampling, which is printed beside the
difference. The last line is a JSON object: median_ms, speedup, speedup_all_draws (medians over the repeats),
max_score_difference.

With a model of your own, whole explanations by it are timed in turn: with the diagnosis, with the fast one, with none.
The last line is then a JSON object of their medians: median_ms, median_ms_fast, median_ms_gpca_alone.

    python benchmarks/latency.py --installed env/bin/python [other/bin/python ...] [--repeats 5]

Whole commands `gpca explain` are timed in turn, by Pythons in whose environments the package is installed: the first
call in a fresh home, and later ones. Of each environment, the last lines are JSON objects: CPU seconds and peak memory
of both (medians), size and number of its packages.
"""

import argparse
import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from types import SimpleNamespace

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

WARM_UP = 3
TRAINING = 45  # registrations that the classifier is fitted to
SIZE = """
from importlib.metadata import distributions
from pathlib import Path
from sysconfig import get_paths
files = [path.stat().st_size for path in Path(get_paths()["purelib"]).rglob("*") if path.is_file()]
print(sum(files), len([*distributions()]))
"""


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    prepare(options.threads)
    if options.installed:
        time_processes(options)
        return
    import numpy as np
    import torch

    torch.set_num_threads(options.threads)
    if options.model is not None:
        time_model(options)
        return
    explainer = make_explainer(options)
    explain = partial(explainer.explain, diagnose=False)
    plain = PlainComposition(explainer.model)
    pairs = [make_pair(options.points, "latency", n) for n in range(options.pairs)]
    ours_s, plain_s, all_draws_s, stages_s, differences, errors = [], [], [], [], [], []
    for repeat in range(WARM_UP + options.repeats):
        source, target = pairs[repeat % len(pairs)]
        elapsed, explanation = timed(explain, source, target)
        plain_elapsed, (scores_C, variances_C, _) = timed(plain.explain, source, target)
        all_draws_elapsed, _ = timed(plain.explain, source, target, explainer.model.encoder.settings.draws)
        if repeat < WARM_UP:
            continue
        ours_s.append(elapsed)
        plain_s.append(plain_elapsed)
        all_draws_s.append(all_draws_elapsed)
        stages_s.append(explanation.seconds)
        differences.append(np.abs(scores_C - list(explanation.scores.values())).max())
        errors.append(np.sqrt(2 * variances_C.max() / options.draws))

    of_plain = {"one draw": plain_s, "all draws": all_draws_s}
    speedups = [median(b / a for a, b in zip(ours_s, seconds, strict=True)) for seconds in of_plain.values()]
    print(f"one explanation, {options.points} points, {options.draws} posterior draws, {options.threads} thread(s),")
    print(f"{options.repeats} repeats in turn; ms: median (least)\n")
    for name, seconds in ({"explainer": ours_s} | {f"plain, {name}": s for name, s in of_plain.items()}).items():
        print(f"{name:20}{1e3 * median(seconds):8.1f} ({1e3 * min(seconds):.1f})")
    print(f"{'ratios':20}{speedups[0]:8.1f} and {speedups[1]:.1f}\n")
    for stage in stages_s[0]:
        print(f"{stage:20}{1e3 * median(seconds[stage] for seconds in stages_s):8.2f}")
    print(f"\nlargest difference of a score {max(differences):.3f}; its standard error there at most {max(errors):.3f}")
    result = {
        "median_ms": 1e3 * median(ours_s), "speedup": speedups[0], "speedup_all_draws": speedups[1],
        "max_score_difference": float(max(differences)),
    }  # fmt: skip
    print(json.dumps({key: float(f"{value:.4g}") for key, value in result.items()}))


def time_model(options: argparse.Namespace) -> None:
    """Print the times of explanations by the model file that is named."""
    from gpca.model.explainer import Explainer

    explainer = Explainer.load(options.model)
    pairs = [make_pair(options.points, "latency", n) for n in range(options.pairs)]
    kinds = {"with diagnosis": {}, "fast": {"fast": True}, "GP-CA alone": {"diagnose": False}}
    seconds: dict[str, list[float]] = {kind: [] for kind in kinds}
    stages_s = []
    for repeat in range(WARM_UP + options.repeats):
        for kind, how in kinds.items():
            elapsed, said = timed(lambda pair, how=how: explainer.explain(*pair, **how), pairs[repeat % len(pairs)])
            if repeat >= WARM_UP:
                seconds[kind].append(elapsed)
                stages_s += [] if how else [said.seconds]
    print(f"one explanation, {options.points} points, {options.threads} thread(s), {options.repeats} repeats in turn;")
    print("ms: median (least, largest)\n")
    for kind, of_kind in seconds.items():
        print(f"{kind:20}{1e3 * median(of_kind):8.1f} ({1e3 * min(of_kind):.1f}, {1e3 * max(of_kind):.1f})")
    for stage in stages_s[0]:
        print(f"{stage:20}{1e3 * median(of_stage[stage] for of_stage in stages_s):8.2f}")
    names = dict(zip(kinds, ("median_ms", "median_ms_fast", "median_ms_gpca_alone"), strict=True))
    print(json.dumps({names[kind]: float(f"{1e3 * median(of_kind):.4g}") for kind, of_kind in seconds.items()}))


def time_processes(options: argparse.Namespace) -> None:
    """Print what whole commands take by each of the given Pythons."""
    import numpy as np

    taken: dict[Path, dict[str, list[tuple[float, float]]]] = {}
    with TemporaryDirectory() as folder:
        for role, cloud in zip(("source", "target"), make_pair(2000, "latency", 0), strict=True):
            np.save(Path(folder, f"{role}.npy"), 100 * cloud)
        for repeat in range(options.repeats):
            for python in options.installed:
                home = Path(folder, f"{python.absolute().as_posix().replace('/', '_')}-{repeat}")
                home.mkdir()
                for call in ("first", "later"):
                    taken.setdefault(python, {}).setdefault(call, []).append(run_command(python, home))
    for python, calls in taken.items():
        result = {
            f"{call}_{unit}": median(values)
            for call, pairs in calls.items()
            for unit, values in zip(("cpu_s", "peak_mb"), zip(*pairs, strict=True), strict=True)
        }
        asked = subprocess.run([python, "-c", SIZE], capture_output=True, text=True, check=True).stdout.split()
        result |= {"packages_mb": int(asked[0]) / 1e6, "packages": int(asked[1])}
        print(json.dumps({"python": str(python)} | {name: float(f"{value:.3g}") for name, value in result.items()}))


def run_command(python: Path, home: Path) -> tuple[float, float]:
    """Return CPU seconds and peak memory (MB) of an explanation of the pair in the folder of a user's home."""
    command = [python.absolute(), "-m", "gpca", "explain", "../source.npy", "../target.npy", "--unit", "mm", "--json"]
    folders = {name: str(home) for name in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "GPCA_MODEL")}
    process = subprocess.Popen(command, cwd=home, env=environment | folders, stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{python}: the command failed")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in {"threads": 1, "points": 512, "pairs": 12, "repeats": 50, "draws": 1000}.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    parser.add_argument("--model", type=Path, help="model file whose explanations are timed")
    parser.add_argument("--installed", type=Path, nargs="+", help="Pythons whose whole commands are timed")
    options = parser.parse_args(arguments)
    if options.points < 64 or options.draws < 2 or min(options.threads, options.pairs, options.repeats) < 1:
        parser.error("points must be at least 64, draws 2 and the others 1")
    return options


def make_pair(n_points: int, *axes: object):
    """Return source and target (N, 3) on an ellipsoid of diameter one; the source noisy, moved or cropped."""
    import numpy as np

    from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, Severities
    from gpca.seeds import generator

    random = generator("benchmark", *axes)
    clouds = random.normal(size=(2, 2 * n_points, 3))
    clouds *= np.array([0.5, 0.3, 0.2]) / np.linalg.norm(clouds, axis=-1, keepdims=True)
    perturbed = PERTURBATIONS[CONCEPTS[axes[-1] % 3]](clouds[0], Severities(crop=(0.2, 0.5)), random)
    return perturbed.points[:n_points], clouds[1, :n_points]


def make_explainer(options: argparse.Namespace):
    """Return the explainer of an encoder that is not trained, and of a classifier fitted to its embeddings."""
    import numpy as np
    import torch

    from gpca.alignment.icp import ICPSettings
    from gpca.causes.policy import RecoveryPolicy
    from gpca.classifier.gpc import GPC
    from gpca.classifier.settings import GPCSettings
    from gpca.encoders.inference import TrainedEncoder
    from gpca.encoders.registry import EncoderSettings
    from gpca.encoders.training import make_model
    from gpca.model.clouds import Familiarity
    from gpca.model.explainer import Explainer
    from gpca.model.file import Model
    from gpca.pairs.perturbation import CONCEPTS

    torch.manual_seed(0)
    settings = EncoderSettings(draw_points=options.points)
    encoder = make_model(settings).encoder.train()
    clouds = [make_pair(options.points, "training", n)[0].astype(np.float32) for n in range(TRAINING)]
    with torch.no_grad():
        encoder(torch.from_numpy(np.stack(clouds[:12])))  # running statistics of such clouds instead of zeros and ones
        h_N_d = encoder.eval()(torch.from_numpy(np.stack(clouds))).numpy()
    gpc = GPC(CONCEPTS, GPCSettings(learning_rate=0.1, draws=options.draws), "benchmark", 0)
    gpc.fit(h_N_d, np.array([CONCEPTS[n % 3] for n in range(TRAINING)]))
    familiar = Familiarity.of(make_pair(options.points, "training", n)[:2] for n in range(TRAINING))
    parts = (TrainedEncoder.of(encoder, settings), gpc, ICPSettings(), options.points, RecoveryPolicy())
    model = Model(SimpleNamespace(levels=()), *parts, "ellipsoids", stand_in=True, familiar=familiar)
    return Explainer(model, device="cpu")


class PlainComposition:
    """The same model by the usual means."""

    def __init__(self, model) -> None:
        import numpy as np
        import torch

        from benchmarks.edge_conv import per_edge_form
        from gpca.classifier.gpytorch_classes import LatentGPs, gpytorch_kernel

        self._model = model
        self._encoder = per_edge_form(model.encoder.module).eval()
        state = model.gpc.state()
        self._mean, self._scale = state["scaler_mean"], state["scaler_scale"]
        kernel = gpytorch_kernel(model.gpc._prior.covariance)
        self._gps = LatentGPs(kernel, torch.from_numpy(state["inducing"].copy()))
        strategy, posterior = self._gps.strategy, self._gps.strategy._variational_distribution
        posterior.variational_mean.data = torch.from_numpy(state["mean"]).float()
        posterior.chol_variational_covar.data = torch.from_numpy(np.linalg.cholesky(state["covariance"])).float()
        strategy.variational_params_initialized.fill_(1)  # else the first call sets them to the prior's
        self._gps.eval()

    def explain(self, source, target, draws: int = 1):
        """Return scores, variances (C,) and BALD of the mean embedding of so many draws, all of the whole cloud."""
        import numpy as np
        import torch

        from gpca.alignment.icp import ICP
        from gpca.objects.canonical import CanonicalFrame
        from gpca.rigid import transform

        frame = CanonicalFrame.of(target)
        source, target = frame.coordinates(source), frame.coordinates(target)
        T_icp = ICP(target, None, self._model.icp).register(source, np.eye(4)).T_target_source
        cloud = torch.from_numpy(transform(T_icp, source).astype(np.float32))
        with torch.no_grad():
            h_1_d = torch.stack([self._encoder(cloud[None]) for _ in range(draws)]).mean(dim=0)
            inputs_1_d = ((h_1_d - torch.from_numpy(self._mean)) / torch.from_numpy(self._scale)).float()
            logits_M_C = self._gps(inputs_1_d).sample(torch.Size([self._model.gpc.settings.draws]))[:, 0]
            p_M_C = torch.softmax(logits_M_C, dim=1)
            scores_C = p_M_C.mean(dim=0)
            variances_C = (p_M_C - scores_C).square().mean(dim=0)
            bald = torch.special.entr(scores_C).sum() - torch.special.entr(p_M_C).sum(dim=1).mean()
        return scores_C.numpy(), variances_C.numpy(), float(bald)


def timed(function, *arguments):
    """Return the wall time of one call, and its result."""
    started = perf_counter()
    result = function(*arguments)
    return perf_counter() - started, result


if __name__ == "__main__":
    main()
