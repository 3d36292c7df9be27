import pytest

from gpca.errors import InputError
from gpca.page.comparison import page_comparison

HEAD = (
    "table,row,column,unit,published,upper,deviation,decimals,reproduced,ci_low,ci_high,n,at_least,difference,factor,"
)
HEAD += "verdict,reason,objects,statistic,repeat_of,hardware,paper_low,paper_high,cluster_low,cluster_high,"
HEAD += "n_needed,over_objects\n"
LINES = (
    "I,YCB,GP-CA,%,99.6,,,1,97.44,95.41,99.4,5,False,-2.16,,close,too few epochs,YCB,mean,,,,,,,12,\n",
    "I,YCB,SHAP,%,31.4,,,1,31.42,26.0,27.0,5,False,0.02,,reproduced,,YCB,mean,,,,,,,,\n",
    "III,YCB,random,labels,350.0,550.0,,-1,812.4,,,5,True,262.4,1.477,not reproduced,easier pool,YCB,mean,,,,,,,,\n",
    "VI,DGCNN,none,%,85.2,,2.43,1,,,,,False,,,not run,asked for alone,,mean,,,,,,,,\n",
)


def written(folder, text):
    path = folder / "comparison.csv"
    path.write_text(text)
    return path


def rows_of(shown):
    return [row for table in shown["tables"] for row in table["rows"]]


def test_numbers_have_the_papers_digits_and_verdicts_a_tone(tmp_path):
    shown = page_comparison(written(tmp_path, HEAD + "".join(LINES)))
    close, same, bound, not_run = rows_of(shown)
    assert (close["published"], close["reproduced"], close["interval"]) == ("99.6", "97.4", "[95.4, 99.4]")
    assert (close["difference"], close["tone"]) == ("-2.2", "near")
    assert close["reason"] == "too few epochs; n = 12 would decide"
    assert same["difference"] == "0.02"  # not "0.0", which would claim more
    assert (bound["published"], bound["reproduced"], bound["interval"]) == ("350 to 550", "> 812", "")
    assert (bound["difference"], bound["factor"]) == ("262", "× 1.5")
    assert (not_run["published"], not_run["reproduced"], not_run["tone"]) == ("85.2 ± 2.4", "", "")
    assert [table["name"] for table in shown["tables"]] == ["I", "III", "VI"]
    assert shown["tables"][0]["title"] == "Table I: Single-concept attribution"


def test_verdicts_are_counted_from_the_best_to_the_worst_repeats_and_deviations_apart(tmp_path):
    shown = page_comparison(written(tmp_path, HEAD + "".join(LINES) + LINES[0]))
    expected = [("reproduced", "good", 1), ("close", "near", 2), ("not reproduced", "bad", 1), ("not run", "", 1)]
    assert shown["verdicts"] == expected
    repeat = LINES[0].replace("mean,,", "mean,I / YCB / SA,")
    deviation = LINES[1].replace("mean,", "deviation,")
    shown = page_comparison(written(tmp_path, HEAD + repeat + deviation))
    assert shown["verdicts"] == [("standard deviation", "", 1), ("repeat", "", 1)]
    assert rows_of(shown)[0]["reason"] == "repeat of I / YCB / SA; too few epochs; n = 12 would decide"
    assert (rows_of(shown)[0]["group"], rows_of(shown)[0]["verdict"]) == ("repeat", "close")


def test_a_comparison_may_be_absent_is_of_one_form_and_says_once_what_a_table_was_measured_on(tmp_path):
    assert page_comparison(tmp_path / "comparison.csv") is None
    with pytest.raises(InputError, match="column 'decimals' is missing"):
        page_comparison(written(tmp_path, HEAD.replace("decimals", "digits") + LINES[0]))
    cups = LINES[0].replace("I,YCB,", "I,Coffee Cup,").replace(",YCB,mean", ",Coffee Cup (scans),mean")
    other = LINES[0].replace("I,YCB,", "I,All,").replace(",YCB,mean", ",Coffee Cup (scans),mean")
    table_i, table_iii = page_comparison(written(tmp_path, HEAD + LINES[0] + cups + other + LINES[2]))["tables"]
    assert table_i["objects"] == "YCB; Coffee Cup (scans)"
    assert [row["objects"] for row in table_i["rows"]] == ["", "", "Coffee Cup (scans)"]
    assert (table_iii["objects"], table_iii["rows"][0]["objects"]) == ("YCB", "")
