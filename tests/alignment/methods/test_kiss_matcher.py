import os
import subprocess
import sys

import pytest


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one processor: no thread could be started")
def test_kiss_matcher_starts_no_thread_since_its_threads_would_race():
    pytest.importorskip("kiss_matcher")
    code = """
import os
import numpy as np
from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.matching import align_by_kiss_matcher as align
from gpca.process.processor import prepare

prepare()
points = np.random.default_rng(0).normal(size=(2000, 3))
points *= np.array([0.5, 0.3, 0.2]) / np.linalg.norm(points, axis=1, keepdims=True)
allowed, threads = os.sched_getaffinity(0), os.listdir("/proc/self/task")
align(Pair(points[:1000], points[1000:]), 0.05)
assert os.sched_getaffinity(0) == allowed
print(len(os.listdir("/proc/self/task")) - len(threads))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "0"
