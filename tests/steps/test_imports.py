"""What the jobs that a run has most of do not import: libraries that take seconds and that they do without."""

import pytest

from tests.steps.by_words import run_apart

from .command_lines import arguments

LIBRARIES = {"IPython", "dash", "gpytorch", "matplotlib", "networkx", "open3d", "pandas", "sklearn", "torch", "trimesh"}
CODE = """
import sys
from tests.steps.by_words import main
status = main(sys.argv[1:])
print(*{name.partition(".")[0] for name in sys.modules})
sys.exit(status)
"""
NEEDED = {  # step, and what is changed of its words -> the libraries among those above
    "registrations": ({}, {"open3d"}),
    "causes": ({}, set()),
    "describe": ({}, set()),
    "reenact": ({}, set()),
    "uncertainty": ({}, set()),
    "embed": ({}, {"torch"}),
    "attribute": ({}, {"pandas", "sklearn", "torch"}),
    "attribute by a rule": ({"--explainer": "rule", "--settings": {}}, set()),
}


@pytest.mark.parametrize("name", NEEDED)
def test_a_job_imports_the_libraries_that_it_needs(folder, name):
    changes, expected = NEEDED[name]
    done = run_apart(arguments(name.split()[0], changes), folder, CODE)
    assert done.returncode == 0, done.stderr[-2000:]
    assert LIBRARIES & {*done.stdout.split()} == expected
