"""What the server behind `tests.hostile` holds when it forks. It alone imports this, as that takes seconds.

It is what the steps load before they look at their input, and what each of hundreds of cases would load again.
"""

from importlib import import_module

from gpca.config.check import check
from gpca.config.layers import with_defaults
from gpca.explainers.registry import explainers
from gpca.process.code_files import ROOT

OURS = ("gpca.encoders.dgcnn", "gpca.objects.point_files", "gpca.objects.procedural", "manifold3d")
LIBRARIES = (
    *("pydantic", "open3d", "pandas", "PIL.PngImagePlugin", "sklearn.pipeline", "trimesh"),
    # torch imports these only where a model is first run, and sympy with them
    *("torch.fx.experimental.symbolic_shapes", "torch.utils.serialization"),
)

STEPS = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for pattern in ("steps/[!_]*.py", "experiments/*/*step.py", "commands/[!_]*.py")
    for path in sorted((ROOT / "gpca").glob(pattern))
]

for module in (*STEPS, *OURS, *LIBRARIES):
    import_module(module)
explainers()
check(with_defaults())  # which makes the classes that settings are read by
