"""What `gpca explain` loads: everyone waits for a library that it could do without."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh

from gpca.process.code_files import ROOT

# Each takes from a tenth of a second to more than one.
WITHOUT = {
    "gpytorch",
    "linear_operator",
    "matplotlib",
    "networkx",
    "open3d",
    "pandas",
    "pydantic",
    "scipy.optimize",
    "scipy.stats",
    "sklearn",
    "torch",
    "trimesh",
}
PRINTED = f"print(*sorted({WITHOUT} & set(sys.modules)), file=sys.stderr)"


@pytest.mark.parametrize(
    ("target", "more"),
    [("target.stl", []), ("target.obj", []), ("target.off", []), ("cloud.ply", ["--method", "point_to_point"])],
)
def test_an_explanation_loads_no_library_that_it_does_without(target, more, saved, tmp_path):
    ball = trimesh.creation.icosphere(3, radius=0.05)
    for name in ("target.stl", "target.obj", "target.off"):
        ball.export(tmp_path / name)
    trimesh.PointCloud(np.array(ball.vertices)).export(tmp_path / "cloud.ply")
    words = ["explain", "cloud.ply", target, "--model", str(saved), "--json", "--html", "page.html", *more]
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from gpca.__main__ import main; main({words}); {PRINTED}"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.startswith('{"T_target_source"')
    assert done.stderr.splitlines()[-1] == ""
