"""A mode of torch that notes the calls which leave a rounding to the processor's vendor.

``rsqrtps`` and ``rcpps`` estimate 1 / √x and 1 / x to twelve bits, by a table of each vendor's own. MKL starts from
them in the functions below even where it is held to one branch, and so ends in another last bit on AMD's processors
than on Intel's. The list was found by comparing some 1,200 calls on an Intel Xeon with the same calls under QEMU, whose
estimates are exact; of NumPy's and SciPy's functions none differed.
"""

import json
import sys

import torch
from torch.utils._python_dispatch import TorchDispatchMode

ANY, SINGLE, DOUBLE = {torch.float32, torch.float64}, {torch.float32}, {torch.float64}
DEFINED_BY_VENDOR = {
    "sqrt": ANY,
    "sqrt_": ANY,
    "_foreach_sqrt": ANY,
    "_foreach_sqrt_": ANY,
    "_cdist_forward": ANY,
    "_euclidean_dist": ANY,
    "atan": ANY,
    "tan": ANY,
    "asin": ANY,
    "acos": ANY,
    "linalg_lstsq": ANY,
    "linalg_cholesky_ex": SINGLE,
    # Of a million arguments a few end in another bit; the last two take the logarithm inside.
    "log": DOUBLE,
    "log_": DOUBLE,
    "logsumexp": DOUBLE,
    "_linalg_slogdet": DOUBLE,
    "log2": ANY,
    "log10": ANY,
}


class VendorGuard(TorchDispatchMode):
    """Within it, the calls of torch in the list above are noted in `calls`."""

    def __init__(self) -> None:
        super().__init__()
        self.calls: set[str] = set()

    def __torch_dispatch__(self, function, types, arguments=(), keywords=None):
        name = function._schema.name.removeprefix("aten::")
        first = arguments[0] if arguments else None
        dtype = getattr(first[0] if isinstance(first, (list, tuple)) and first else first, "dtype", None)
        is_root = name in ("pow", "pow_", "_foreach_pow", "_foreach_pow_") and arguments[1] == 0.5
        if is_root or dtype in DEFINED_BY_VENDOR.get(name, ()):
            self.calls.add(f"{name} of {dtype}")
        return function(*arguments, **(keywords or {}))


def main() -> int:
    """Run the steps that standard input names with words, and print which calls left a rounding to the vendor."""
    from tests.steps.by_words import main as run_step

    with VendorGuard() as guard:
        failed = any(run_step(words) for words in json.load(sys.stdin))
    print(json.dumps(sorted(guard.calls)))
    return int(failed)
