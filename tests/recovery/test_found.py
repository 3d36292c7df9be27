"""What the documentation says was found about recovery, held against the reference run on real objects."""

import pandas as pd

from gpca.code_files import ROOT
from tests.documents import unwrapped


def test_what_was_found_stands_in_the_reference():
    found = unwrapped("docs/recovery.md")
    tidy = pd.read_csv(ROOT / "results/reference/real/tables/table8_recovery.csv")
    rows = tidy.pivot(index="policy", columns="metric", values="mean")
    one, two, three = (rows[f"recovered_within_{actions}"] for actions in (1, 2, 3))
    assert f"{tidy['n_test'].max()} failures" in found
    fixed = [policy for policy in rows.index if policy.startswith("always_")]
    assert one[fixed].idxmax() == two[fixed].idxmax() == "always_reinitialize"
    assert (one["utility_acting"], two["utility_acting"]) > (one[fixed].max(), two[fixed].max())
    for policy, words in (
        ("utility_acting", "`utility` recovers {:.1f} % within one action and {:.1f} % within two"),
        ("always_reinitialize", "the best fixed action, recovers {:.1f} and {:.1f} %"),
        ("oracle", "which treats the true cause, {:.1f} and {:.1f} %"),
    ):
        assert words.format(one[policy], two[policy]) in found
    assert f"on** ({two['gpca_acting']:.1f} %), and so is the softmax head ({two['softmax_head']:.1f} %)" in found
    learnt = rows.loc["utility"]
    assert f"act on {learnt['acted_nominal']:.0f} % of the registrations that are right" in found
    assert f"leaves {learnt['left_alone']:.0f} % of the failures" in found
    assert f"queues {rows.loc['gpca', 'queued']:.0f} % of the failures and recovers {three['gpca']:.1f} %" in found
    assert f"against {three['gpca_acting']:.1f} % if it never queues" in found
