"""What each backbone costs: time of training and of inference, parameters, memory.

    python benchmarks/backbones.py [--threads 1] [--batch 16] [--points 512] [--repeats 5] [--backbones dgcnn …]

All have their default options and see the same clouds, in one process and in turn (A B C A B C …), so that whatever
else the machine does meets all. Times are medians. A training step is forward and backward, without an optimiser. For
those built of group MLPs the last column is the time of the plain form, which evaluates every slot of every group with
torch operations alone, over that of theirs: the median over pairs. The memory is the peak of a process of its own that
does some training steps, libraries included. The last line is a JSON object: for each backbone train_ms_, ms_ (per
cloud), parameters_, peak_mb_, and train_speedup_ where there is a plain form.
"""

import argparse
import json
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from unittest.mock import patch

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

WARM_UP = 1
PEAK = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from benchmarks.backbones import make_clouds, make_network
from benchmarks.edge_conv import training_step
batch, points = int(sys.argv[3]), int(sys.argv[4])
network, clouds = make_network(sys.argv[2]), make_clouds(batch, points)
for _ in range(3):
    training_step(network, clouds)
# Not ru_maxrss, which a process inherits from the one that started it.
status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
print(int(status["VmHWM"].split()[0]) / 1024)
"""


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    # Before torch and numba are imported: both read their threads once.
    prepare(options.threads)
    import torch

    from gpca.encoders.registry import parameter_count

    torch.set_num_threads(options.threads)
    clouds_B_N_3 = make_clouds(options.batch, options.points)
    networks = {backbone: make_network(backbone) for backbone in options.backbones}
    seconds = measure(networks, clouds_B_N_3, options.repeats)

    print(
        f"{options.batch} clouds of {options.points} points, {options.threads} thread(s), {options.repeats} repeats\n"
    )
    print(f"{'':12}{'training':>12}{'inference':>12}{'parameters':>13}{'memory':>10}{'every slot':>12}")
    print(f"{'':12}{'ms/cloud':>12}{'ms/cloud':>12}{'':13}{'MB':>10}{'×':>12}")
    result = {}
    for backbone, network in networks.items():
        ms = {name: 1e3 * median(times) / options.batch for name, times in seconds[backbone].items()}
        numbers = {
            "train_ms": ms["train"],
            "ms": ms["infer"],
            "parameters": parameter_count(network),
            "peak_mb": peak_mb(backbone, options.batch, options.points),
        }
        if "plain" in seconds[backbone]:
            pairs = zip(seconds[backbone]["plain"], seconds[backbone]["train"], strict=True)
            numbers["train_speedup"] = median(plain / ours for plain, ours in pairs)
        row = (
            f"{backbone:12}{ms['train']:12.2f}{ms['infer']:12.2f}{numbers['parameters']:13,}{numbers['peak_mb']:10.0f}"
        )
        print(row + (f"{numbers['train_speedup']:12.1f}" if "train_speedup" in numbers else f"{'–':>12}"))
        result |= {f"{name}_{backbone}": value for name, value in numbers.items()}
    print(
        json.dumps({key: value if isinstance(value, int) else float(f"{value:.4g}") for key, value in result.items()})
    )


def parse(arguments: list[str] | None) -> argparse.Namespace:
    from gpca.encoders.registry import ENCODERS

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in {"threads": 1, "batch": 16, "points": 512, "repeats": 5}.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    parser.add_argument("--backbones", nargs="+", choices=ENCODERS, default=list(ENCODERS))
    options = parser.parse_args(arguments)
    if min(options.threads, options.batch, options.repeats) < 1 or options.points < 20:
        parser.error("every number must be at least 1, and points at least 20, which is DGCNN's k")
    return options


def make_clouds(batch: int, n_points: int):
    """Return points (B, N, 3) on ellipsoids of diameter one: surfaces about as large as those of the objects."""
    import torch

    torch.manual_seed(0)
    axes_3 = torch.tensor([1.0, 0.6, 0.4])
    return torch.nn.functional.normalize(torch.randn(batch, n_points, 3), dim=-1) * axes_3 / 2


def make_network(backbone: str):
    import torch

    from gpca.encoders.registry import make_encoder

    torch.manual_seed(0)
    return make_encoder(backbone, {})


def measure(networks: dict, clouds_B_N_3, repeats: int) -> dict[str, dict[str, list[float]]]:
    """Return the seconds of every repeat for each network; a first round, unmeasured, warms up."""
    from benchmarks.edge_conv import inference, training_step

    seconds = {backbone: {"train": [], "infer": []} for backbone in networks}
    for repeat in range(WARM_UP + repeats):
        for backbone, network in networks.items():
            elapsed = {"train": training_step(network, clouds_B_N_3)}
            if backbone != "dgcnn":
                with every_slot():
                    elapsed["plain"] = training_step(network, clouds_B_N_3)
            elapsed["infer"] = inference(network, clouds_B_N_3)
            for name, value in elapsed.items() if repeat >= WARM_UP else ():
                seconds[backbone].setdefault(name, []).append(value)
    return seconds


@contextmanager
def every_slot():
    """Let group MLPs evaluate every slot of every group meanwhile."""
    from gpca.encoders.groups import GroupMLP

    with patch.object(GroupMLP, "forward", GroupMLP.plain):
        yield


def peak_mb(backbone: str, batch: int, n_points: int) -> float:
    """Return the peak memory of a fresh process that trains the backbone."""
    command = [sys.executable, "-c", PEAK, str(ROOT), backbone, str(batch), str(n_points)]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


if __name__ == "__main__":
    main()
