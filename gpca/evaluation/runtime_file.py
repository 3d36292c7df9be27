"""The file of runtimes: a row per component and device, as the step ``runtime`` measures them."""

from pathlib import Path

from gpca.io.csv_file import read_numbers
from gpca.io.frame import Frame

RUNTIME_COLUMNS = ("component", "device", "hardware", "threads", "repeats", "mean_s", "deviation_s", "median_s")
COMPONENTS = {  # what the table calls them, in its order
    "icp": "ICP alignment",
    "icp_open3d": "ICP alignment by Open3D",
    "features": "Feature extraction",
    "sampling": "GPC posterior sampling",
    "scores": "GP-CA score computation",
    "bald": "BALD selection (optional)",
    "retraining": "GPC retraining (optional)",
    "explanation": "One explanation",
    "explanation_512": "One explanation, 512 points",
}


def read_runtime(path: str | Path) -> Frame:
    return read_numbers(path, RUNTIME_COLUMNS, ("threads", "repeats", "mean_s", "deviation_s", "median_s"))
