"""`gpca explain` and `gpca label` with what a plain `pip install .` brings: all other packages are hidden from them."""

import json
import os
import subprocess
import sys
from importlib.metadata import packages_distributions

from packaging.utils import canonicalize_name

from gpca.process.environment import MODULES

from ..documents import ROOT
from ..test_requirements import needed_by, requirements
from .command_lines import arguments

CODE = """
import sys

hidden = set(sys.argv[1].split())

class Hiding:
    def __init__(self, finder):
        self.finder = finder
    def find_spec(self, name, *where):
        return None if name.partition(".")[0] in hidden else self.finder.find_spec(name, *where)
    def __getattr__(self, name):
        return getattr(self.finder, name)

sys.meta_path[:] = map(Hiding, sys.meta_path)
from gpca.__main__ import main
import gpca.commands.label, gpca.commands.tracks
print(main(sys.argv[2:]), file=sys.stderr)
print(main([*sys.argv[2:], "--method", "gicp"]), file=sys.stderr)
print(main([*sys.argv[2:], "--png", "figure.png"]), file=sys.stderr)
"""


def hidden():
    """Modules of installed packages that neither the library's requirements are nor theirs."""
    brought = needed_by(requirements())
    return [
        module
        for module, packages in packages_distributions().items()
        if not brought & set(map(canonicalize_name, packages)) and module not in ("gpca", "baselines")
    ]


def test_an_explanation_needs_no_package_of_an_extra(folder):
    assert {"matplotlib", *MODULES["suite"]} - {"manifold3d"} <= set(hidden())
    words = arguments("explain", {"--uncertainty": [], "--html": "page.html", "--queue": "queued.npz"})
    done = subprocess.run(
        [sys.executable, "-c", CODE, " ".join(hidden()), *map(str, words)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert json.loads(done.stdout)["diagnosis"]["state"] in ("nominal", "failed")
    assert (folder / "page.html").is_file()
    *_, explained, no_open3d, method, no_matplotlib, figure = done.stderr.splitlines()
    assert (explained, method, figure) == ("0", "2", "2")
    assert no_open3d == (
        "gpca explain: Open3D: is not installed; install it, 'pip install \".[suite]\"' in the folder of the suite"
    )
    assert no_matplotlib.endswith("needs the package matplotlib, which is not installed; pip install matplotlib")
