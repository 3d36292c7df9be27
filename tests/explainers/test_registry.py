"""The registry of explainers, which every plan of the workflow and every explainer's job loads."""

import subprocess
import sys

from gpca.process.code_files import ROOT


def test_no_explainer_brings_a_slow_library_before_it_is_made():
    code = (
        "import sys; from gpca.explainers.registry import CAUSES, CONCEPTS, explainer_entry;"
        "[explainer_entry('gpca', kind) for kind in (CAUSES, CONCEPTS)];"
        "print({'gpytorch', 'matplotlib', 'numba', 'open3d', 'shap', 'sklearn', 'torch'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
