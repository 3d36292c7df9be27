"""The step ``train`` stopped in the middle, which then continues."""

import pytest

from .by_words import main, run_apart
from .command_lines import arguments, settings

# Where the tests run in the background of a shell, SIGINT is ignored, and children inherit that.
STOPPED_IN_EPOCH_3 = """
import os, signal, sys
from tests.steps.by_words import main
from gpca.encoders import training

class Deleted:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)

def write(path, content):
    written(path, content)
    if len(content.get("curve", ())) == 3:
        {stop}

written, training.write_tensors = training.write_tensors, write
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.exit(main(sys.argv[1:]))
"""


LONGER = settings("train", epochs=5)


@pytest.fixture(scope="module")
def unbroken(made, tmp_path_factory):
    folder = tmp_path_factory.mktemp("unbroken")
    files = {"--weights": folder / "weights.pt", "--curve": folder / "curve.csv"}
    assert main(arguments("train", LONGER | files | {"--registrations": made / "registrations.npz"})) == 0
    return folder


@pytest.mark.parametrize("stop", ["os.kill(os.getpid(), signal.SIGINT)", "Deleted()"], ids=["raised", "swallowed"])
def test_ctrl_c_stops_a_training_that_then_continues_to_the_same_bytes(folder, unbroken, stop):
    before = (folder / "weights.pt").read_bytes()
    done = run_apart(arguments("train", LONGER), folder, STOPPED_IN_EPOCH_3.format(stop=stop))
    assert done.returncode == 130, done.stderr
    assert done.stderr.splitlines()[-1] == "gpca train: stopped; repeat the command to continue"
    assert ("Exception ignored in" in done.stderr) == (stop == "Deleted()")
    assert (folder / "weights.pt").read_bytes() == before
    assert (folder / "weights.checkpoint").exists()
    assert main(arguments("train", LONGER)) == 0
    assert not (folder / "weights.checkpoint").exists()
    for name in ("weights.pt", "curve.csv"):
        assert (folder / name).read_bytes() == (unbroken / name).read_bytes()
