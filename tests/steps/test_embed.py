"""The step ``embed`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import refused, removed, settings, truncated, untouched, written

FAULTS = [
    (removed("weights.pt"), {}, r"weights.pt: no such weights; regenerate them with Snakemake"),
    (truncated("weights.pt"), {}, r"weights.pt: not the weights of backbone 'dgcnn'"),
    (written("weights.pt", "no weights"), {}, r"weights.pt: not the weights of backbone 'dgcnn'"),
    (untouched, settings("embed", options={"k": 8}), r"weights.pt: not the weights of backbone 'dgcnn'"),
    (removed("icp.csv"), {}, r"icp.csv: no such file"),
    (written("icp.csv", ""), {}, r"icp.csv: is empty"),
    (written("icp.csv", 'sample,"split\n1'), {}, r"icp.csv: is not a readable CSV file"),
    (written("icp.csv", "sample,split,seconds,icp_seconds\n0,train,1,1\n"), {}, r"icp.csv: does not contain the t"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "embed", *FAULTS[fault])
