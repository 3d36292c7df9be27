"""Hashes of what fits are made of, to be compared between a processor and an emulated one."""

import hashlib

import numpy as np

CONCEPTS = ("noise", "pose", "overlap")


def _sha256(*arrays: np.ndarray) -> str:
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


def fits() -> dict[str, str]:
    """Return the hashes of Adam, of a GPC with each kernel, of a trained head, and of elementary functions."""
    import torch

    from baselines.heads import Heads
    from gpca.classifier.gpc import GPC, GPCSettings
    from gpca.portable import Adam, logarithm, square_root

    random = np.random.default_rng(0)
    weights = torch.from_numpy(random.normal(size=5000).astype(np.float32)).requires_grad_()
    optimizer = Adam([weights], 0.01)
    for _ in range(5):
        optimizer.zero_grad()
        (weights * torch.from_numpy(random.normal(size=5000).astype(np.float32))).square().sum().backward()
        optimizer.step()
    hashes = {"adam": _sha256(weights.detach().numpy())}
    h_N_d = random.normal(size=(60, 8))
    concept_N = np.array(CONCEPTS)[np.arange(60) % 3]
    for kernel in ("rbf", "matern32", "polynomial"):
        gpc = GPC(CONCEPTS, GPCSettings(kernel=kernel, iterations=5, inducing=6, draws=20), "emulated", 0)
        hashes[kernel] = _sha256(*gpc.fit(h_N_d, concept_N).attribute(h_N_d))
    heads = Heads("emulated", heads=2, hidden=16, steps=5)
    heads.fit(h_N_d, np.arange(60) % 3)
    hashes["heads"] = _sha256(heads.hidden(h_N_d))
    positive = torch.from_numpy(random.lognormal(0, 3, 100_000))
    for function in (square_root, logarithm):
        hashes[function.__name__] = _sha256(function(positive).numpy(), function(positive.float()).numpy())
    return hashes | {"torch.sqrt": _sha256(positive.sqrt().numpy())}
