"""Verdicts: the rule at its edges, which each can be, and the page."""

import math
import re
from dataclasses import replace

import pandas as pd
import pytest
import yaml
from scipy.stats import chi2

from gpca.comparison import verdicts
from gpca.comparison.markdown import comparison_markdown, summary
from gpca.comparison.published import NONE_YET, UNITS, Reason, read_published, read_reasons, reason_of
from gpca.comparison.readings import READINGS
from gpca.comparison.values import Reproduced, read_results, value_of_run
from gpca.declarations.registry import experiments
from gpca.errors import InputError
from gpca.process.code_files import ROOT

from .made_up import ACCURACY, OBJECTS, TIME, TOLERANCES, compared, number, runtime, tidy

NAN = math.nan
POINTS = verdicts.Tolerance(1, 3)
FACTOR = verdicts.Tolerance(1.5, 3, factor=True)


def printed(value=90.0, upper=None, decimals=1, low=None, high=None):
    upper = upper or value
    return verdicts.Printed(
        value, upper, 0.5 * 10.0**-decimals, value if low is None else low, upper if high is None else high
    )


@pytest.mark.parametrize(
    ("verdict", "found"),
    {
        # A tolerance of 1, and half a digit of rounding; 92 ± 2 holds the printed value.
        "reproduced": [(90.0, 0.0), (91.04, 0.0), (88.96, 0.1), (92.0, 2.0), (90.0, 3.0)],
        "close": [(91.06, 0.0), (92.0, 1.9), (93.04, 0.0)],
        "not reproduced": [(93.06, 0.0), (86.94, 0.1), (83.0, 3.9)],  # however wide, all of the last is beyond
        "inconclusive": [(90.0, 3.1), (86.0, 3.1), (90.0, NAN), (50.0, NAN)],  # it could be anything near
    }.items(),
)
def test_the_rule_in_percentage_points(verdict, found):
    for value, half_width in found:
        reproduced = Reproduced(value, value - half_width, value + half_width, 5)
        assert verdicts.verdict_of(printed(90.0), reproduced, POINTS) == verdict, value


def test_a_printed_range_is_a_band():
    edges = {84.96: "reproduced", 92.9: "reproduced", 95: "close", 95.1: "not reproduced", 83: "close"}
    for value, verdict in edges.items():
        assert verdicts.verdict_of(printed(86.0, upper=92.0), Reproduced(value, value, value, 5), POINTS) == verdict


def test_the_papers_own_error_adds_to_that_of_the_run_whose_wider_interval_counts():
    found = Reproduced(94.0, 92.8, 95.2, 5)  # 4 points above, less half a digit
    assert verdicts.verdict_of(printed(90.0), found, POINTS) == "not reproduced"
    for own, verdict in ((2, "not reproduced"), (3, "inconclusive")):  # 1.2 and 2 make 2.3, 1.2 and 3 make 3.2
        assert verdicts.verdict_of(printed(90.0, low=90.0 - own, high=90.0 + own), found, POINTS) == verdict
    near = Reproduced(92.2, 91.0, 93.4, 5)
    assert verdicts.verdict_of(printed(90.0), near, POINTS) == "close"
    assert verdicts.verdict_of(printed(90.0, low=88.0, high=92.0), near, POINTS) == "reproduced"


def test_objects_are_fixed_in_a_verdict_and_not_in_the_one_beside_it():
    wide = Reproduced(92.0, 91.5, 92.5, 5, cluster_low=80.0, cluster_high=92.1)
    assert verdicts.verdict_of(printed(90.0), wide, POINTS) == "close"
    assert verdicts.verdict_of(printed(90.0), wide.over_objects(), POINTS) == "inconclusive"
    assert (wide.over_objects().low, wide.over_objects().high) == (80.0, 92.5)
    alone = Reproduced(92.0, NAN, NAN, 1, cluster_low=91.0, cluster_high=93.0).over_objects()
    assert (alone.low, alone.high) == (91.0, 93.0)


def test_an_undecided_number_says_how_many_repeats_would_decide_it():
    """The fewest, for which Student's interval of the same mean and spread is narrow enough."""
    percent, counted = UNITS["%"], UNITS["labels"]
    found = Reproduced(90.0, NAN, NAN, 5, deviation=4.0).repeated(5, percent)
    assert verdicts.verdict_of(printed(90.0), found, POINTS) == "inconclusive"
    needed = verdicts.repeats_needed(printed(90.0), found, POINTS, percent)
    half_widths = [found.repeated(n, percent).high - 90 for n in (needed - 1, needed)]
    assert half_widths[0] > 3 >= half_widths[1]
    wide = printed(90.0, low=86.0, high=94.0)  # wider than what is close, whatever the run
    assert verdicts.repeats_needed(wide, found, POINTS, percent) is None
    far = Reproduced(80.0, NAN, NAN, 5, deviation=8.0).repeated(5, percent)
    assert verdicts.verdict_of(wide, far, POINTS) == "inconclusive"
    assert verdicts.verdict_of(wide, far.repeated(verdicts.repeats_needed(wide, far, POINTS, percent), percent), POINTS)
    assert verdicts.repeats_needed(printed(14), Reproduced(14, NAN, NAN, 5, at_least=True), FACTOR, counted) is None
    results = {"metrics.csv": tidy([0.86, 0.94, 0.9, 0.9])}
    [row] = (rows := compared([number()], results)).itertuples()
    assert (row.verdict, row.n_needed > row.n) == ("inconclusive", True)
    assert f"inconclusive means, 1 need {row.n_needed} seeds." in summary(rows)
    rows = compared([number(paper_n=50)], results)
    assert (rows["reason"][0], rows["n_needed"][0] is pd.NA) == (verdicts.PAPER_TOO_WIDE, True)
    assert "means, no run can decide 1, as the paper's own interval is too wide." in summary(rows)


@pytest.mark.parametrize(
    ("verdict", "found"),
    {
        "reproduced": [(0.67, 0.66, 0.68), (1.5, 1.5, 1.5)],
        "close": [(1.6, 1.59, 1.61), (0.35, 0.35, 0.35)],
        "not reproduced": [(3.2, 3.1, 3.3), (0.004, 0.003, 0.005), (0.02, -0.1, 0.1), (0.0, 0.0, 0.0)],
        "inconclusive": [(0.5, -0.2, 1.2)],  # down to nothing: no factor
    }.items(),
)
def test_times_and_counts_are_compared_by_factor(verdict, found):
    for interval in found:
        assert verdicts.verdict_of(printed(1.0, decimals=2), Reproduced(*interval, 5), FACTOR) == verdict, interval


def test_tolerances_have_an_order_and_a_lower_bound_is_judged_only_where_it_is_beyond():
    for order in ((3, 1), (-1, 1), (0.9, 2, True)):
        with pytest.raises(InputError, match="must satisfy"):
            verdicts.Tolerance(*order)
    labels = printed(14, decimals=0)
    assert verdicts.verdict_of(labels, Reproduced(44, NAN, NAN, 5, at_least=True), FACTOR) == "not reproduced"
    assert verdicts.verdict_of(labels, Reproduced(14, NAN, NAN, 5, at_least=True), FACTOR) == "inconclusive"


def test_every_verdict_and_its_reason():
    results = {
        "metrics.csv": pd.concat(
            [tidy([0.9, 0.9]), tidy([0.98, 0.98], method="gpca"), tidy([0.8, 0.99], method="wide"),
             tidy([0.9], method="one")]
        )
    }  # fmt: skip

    def of(method):
        return replace(ACCURACY, methods=(method,))

    numbers = [
        number(row="YCB"),
        number(row="close", value=92.0),
        number(row="far", counterpart=of("gpca")),
        number(row="wide", counterpart=of("wide")),
        number(row="one", counterpart=of("one")),
        number(row="none", counterpart=None, note="nobody measured it"),
        number(row="not run", counterpart=of("shap_additive")),
        number(row="no file", counterpart=TIME, unit="s"),
    ]
    rows = compared(numbers, results, reasons=[Reason("I", "far", "*", "Other data.")])
    assert tuple(rows.columns) == verdicts.COMPARISON_COLUMNS
    assert list(zip(rows["verdict"], rows["reason"], strict=True)) == [
        ("reproduced", ""),
        ("close", NONE_YET),
        ("not reproduced", "Other data."),
        ("inconclusive", verdicts.TOO_WIDE),
        ("inconclusive", verdicts.ONE_REPEAT),
        ("not comparable", "nobody measured it"),
        ("not run", "metrics.csv holds no such value"),
        ("not run", "runtime.csv holds no such value"),
    ]
    assert list(rows["difference"][:3]) == pytest.approx([0, -2, 8])
    assert verdicts.counts(rows) == dict(zip(verdicts.VERDICTS, (1, 1, 2, 1, 1, 2), strict=True))


def test_a_value_is_judged_once_and_its_repeats_are_marked():
    first, other = number(), number(row="other", counterpart=replace(ACCURACY, methods=("gpca",)))
    repeat = number(99.0, row="again", counterpart=replace(ACCURACY, methods=("same",)), same_as=first.key)
    same = [tidy([0.9, 0.9], method=method) for method in ("gpca_paper", "gpca", "same")]
    rows = compared([first, other, repeat], {"metrics.csv": pd.concat(same)})
    assert rows["repeat_of"].tolist() == ["", "", "I / YCB / GP-CA"]
    assert rows["verdict"].tolist() == ["reproduced", "reproduced", "not reproduced"]
    assert verdicts.counts(verdicts.judged_once(rows)) == dict.fromkeys(verdicts.VERDICTS, 0) | {"reproduced": 2}
    results = {"metrics.csv": pd.concat([tidy([0.9, 0.9]), tidy([0.9, 0.92], method="same")])}
    assert compared([first, repeat], results)["repeat_of"].tolist() == ["", ""]  # the run has made it another value


def test_stand_ins_are_shown_but_never_compared_and_units_need_a_tolerance():
    stand_ins = OBJECTS | {"ycb": {"title": "YCB", "stand_in": True}}
    numbers = [number(), number(row="LINEMOD", counterpart=replace(ACCURACY, methods=("nothing",)))]
    rows = compared(numbers, {"metrics.csv": tidy([0.9, 0.9])}, stand_ins, [Reason("*", "*", "*", "A reason.")])
    assert set(rows["verdict"]) == {"not comparable"}
    assert set(rows["reason"]) == {"procedural stand-in"}
    assert rows["reproduced"][0] == pytest.approx(90)
    assert set(rows["objects"]) == {"YCB (procedural stand-in)"}
    assert "only real ones are compared" in summary(rows)
    with pytest.raises(InputError, match=r"comparison\.tolerances: has no unit '%'; add its tolerance"):
        verdicts.compare([number()], {}, OBJECTS, {}, [])


def test_a_printed_deviation_belongs_to_the_mean_of_the_same_counterpart_and_is_counted_apart():
    spread = replace(ACCURACY, statistic="deviation")
    deviation = replace(number(3.0, counterpart=spread, paper_n=5), column="Std. Dev.")
    rows = compared([number(94.5), deviation], {"metrics.csv": tidy([0.89, 0.9, 0.91])})
    assert (rows["deviation"][0], rows["statistic"].tolist()) == (3.0, ["mean", "deviation"])
    assert rows["paper_high"][0] == pytest.approx(94.5 + 2.776445 * 3 / 5**0.5)  # Student's of five repeats
    assert math.isnan(rows["deviation"][1])
    assert len(verdicts.judged_once(rows)) == 1
    assert "1 are standard deviations: 1 inconclusive." in summary(rows)


def test_the_page_counts_first_and_gives_each_reason_once():
    numbers = [
        number(),
        number(97.0, row="LINEMOD"),
        number(98.0, row="Coffee Cup"),
        replace(number(1.0, 2.0, 0, "s", TIME), table="VII", row="ICP alignment", column="Time"),
    ]
    results = {"metrics.csv": tidy([0.9, 0.9]), "runtime.csv": runtime(icp=0.001, features=0.003)}
    page = comparison_markdown(compared(numbers, results, reasons=[Reason("*", "*", "*", "Other | data.")]), TOLERANCES)
    first, second, *_ = [line for line in page.splitlines() if line]
    assert first.startswith("# ")
    assert re.findall(r"\d+", second) == ["4", "4", "4", "1", "3"]  # numbers, means, decided, as which
    assert "| YCB | GP-CA | % | 90.0 | 90.0 (90.0 to 90.0) | – | 2 | – | +0.0 | **reproduced** |" in page
    assert "| LINEMOD | GP-CA | % | 97.0 | 90.0 (90.0 to 90.0) | – | 2 | – | -7.0 | not reproduced [1] |" in page
    assert "| ICP alignment | Time | s | 1 to 2 | 0.004 (0.0039 to 0.0041) | – | 100 | – | × 0.004 | not rep" in page
    assert "| All, by intervals over objects too | 1 |  |  | 3 |" in page
    assert page.count("1. Other | data.") == 2
    assert "| Table I: Single-concept attribution | 1 |  |  | 2 |  |  | 1.0 | 1.00 | – |\n" in page
    assert "| All | 1 | 0 | 0 | 3 | 0 | 0 | 1.0 | 1.00 | – |\n" in page
    assert "## Table VII: Runtime" in page
    assert "Objects here: MODEL. Hardware here: A processor." in page
    assert "Intel i7-12700K and NVIDIA RTX 3090" in page


def test_printed_shares_deviations_and_means_have_the_interval_of_their_samples():
    printed = verdicts.printed_of(number(97.8, paper_n=180))
    centre, half_width = 96.753, 2.360  # of 176 in 180, by the formula of Wilson (1927)
    assert (printed.low, printed.high) == pytest.approx((centre - half_width, centre + half_width), abs=0.05)
    assert verdicts.printed_of(number(100.0, paper_n=300)).high == 100
    assert verdicts.printed_of(number(100.0, paper_n=300)).low == pytest.approx(100 * 300 / (300 + 1.959964**2))
    deviation = number(2.0, counterpart=replace(ACCURACY, statistic="deviation"), paper_n=5)
    own = verdicts.printed_of(deviation)
    assert chi2.cdf(4 * (2.0 / own.low) ** 2, 4) == pytest.approx(0.975)
    assert chi2.cdf(4 * (2.0 / own.high) ** 2, 4) == pytest.approx(0.025)
    mean = verdicts.printed_of(number(85.0), deviation)
    assert mean.high - 85 == pytest.approx(2.776445 * 2 / 5**0.5)
    assert 85 - mean.low == pytest.approx(mean.high - 85)
    printed = verdicts.printed_of(number(350.0, 550.0, -1, "labels"))
    assert (printed.low, printed.high, printed.rounding) == (350, 550, 5)


REFERENCE = ROOT / "results/reference/full"
NUMBERS, REASONS = read_published(), read_reasons()
OF_REASONS = {reason: [n for n in NUMBERS if reason_of(n, [reason]) == reason.text] for reason in REASONS}


@pytest.fixture(scope="module")
def reference():
    files = {fields["file"] for reason in REASONS for fields in verdicts.citations(reason.text)}
    return read_results(path for path in sorted(REFERENCE.glob("*.csv")) if path.name in files)


def test_a_reason_is_filled_with_what_was_run_in_the_unit_that_it_names():
    text = "Longer training gives {metrics.csv attribution @ gpca accuracy all %} %. The paper is silent."
    results = {"metrics.csv": pd.concat([tidy([0.9, 0.8], method="gpca"), tidy([0.1, 0.1])])}
    assert verdicts.filled(text, number(50.0), results) == "Longer training gives 85.0 %. The paper is silent."
    own = "Here it is {metrics.csv attribution @ @ @ @ share}."
    assert verdicts.filled(own, number(50.0), results) == "Here it is 0.1."
    text = "It is {metrics.csv attribution @ gpca accuracy all %} %. The paper is silent."
    assert verdicts.filled(text, number(50.0), {"metrics.csv": tidy([0.1])}) == "The paper is silent."
    assert verdicts.filled(text, number(50.0), {}) == "The paper is silent."
    values = {"labels_to_target": [60], "reached": [0]}
    rows = [tidy(value, metric=metric, concept="overlap") for metric, value in values.items()]
    text = "It takes {a.csv attribution @ @ labels_to_target overlap labels} labels."
    assert verdicts.filled(text, number(50.0), {"a.csv": pd.concat(rows)}) == "It takes more than 60 labels."


@pytest.mark.parametrize("reason", REASONS, ids=lambda reason: f"{reason.table} {reason.row} {reason.column}")
def test_every_reason_cites_a_run_of_the_suite(reason, reference):
    cited = verdicts.citations(reason.text)
    assert cited
    assert {fields["unit"] for fields in cited} <= set(UNITS)
    assert {fields["file"] for fields in cited} <= {tidy.file for each in experiments() for tidy in each.tidy}
    kept = [fields for fields in cited if fields["file"] in reference]
    found = [
        value_of_run(asked, reference)
        for fields in kept
        for of in OF_REASONS[reason]
        if (asked := verdicts.cited_number(of, fields)) is not None
    ]
    # What the reference does not keep was made by the same steps.
    assert not kept or any(value is not None for value in found)


def test_no_reason_gives_up_and_none_quotes_a_number_that_stands_on_no_page():
    pages = " ".join(path.read_text() for path in sorted((ROOT / "docs").glob("*.md")))
    pages += " ".join(path.read_text() for path in sorted((ROOT / "config").glob("*.yaml")))
    for reason in REASONS:
        assert not re.search("not known|not measured", reason.text)
        plain = re.sub(r"\{[^}]*\}|[\w/]+\.\w+|Table [IV]+|1e-\d+|3/2", "", reason.text)
        for typed in re.findall(r"\d+(?:\.\d+)?", plain):
            assert re.search(rf"(?<![\d.]){re.escape(typed)}(?![\d])", pages), (reason, typed)


def test_readings_that_reasons_cite_are_of_the_grid():
    grid = yaml.safe_load((ROOT / "config/readings.yaml").read_text())["readings"]["groups"]
    for reason in REASONS:
        for fields in verdicts.citations(reason.text):
            if fields["file"] == READINGS:
                group, *values = fields["table"].split("/")
                assert len(values) == len(grid[group])
                for value, choice in zip(values, grid[group].values(), strict=True):
                    assert value in {f"{known:g}" if isinstance(known, float) else str(known) for known in choice}
