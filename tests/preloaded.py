"""What the server behind `tests.hostile` holds when it forks. It alone imports this, as that takes seconds.

It is what the steps load before they look at their input, and what each of hundreds of cases would load again.
"""

from importlib import import_module

from gpca.__main__ import STEPS
from gpca.explainers.registry import explainers

OURS = ("gpca.config.check", "gpca.encoders.dgcnn", "gpca.objects.uw_rgbd", "gpca.objects.shapes.linemod")
LIBRARIES = (
    *("pydantic", "open3d", "pandas", "PIL.PngImagePlugin", "sklearn.pipeline", "trimesh"),
    # torch imports these only where a model is first run, and sympy with them
    *("torch.fx.experimental.symbolic_shapes", "torch.utils.serialization"),
)

for module in (*(f"gpca.steps.{name.replace('-', '_')}" for name in STEPS), *OURS, *LIBRARIES):
    import_module(module)
explainers()
