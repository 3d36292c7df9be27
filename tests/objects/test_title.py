from gpca.objects.entry import stand_in_clause, title_of

REAL = {"title": "YCB", "stand_in": False}
STAND_IN = {"title": "YCB", "stand_in": True}


def test_only_a_stand_in_is_called_one():
    assert title_of(REAL) == "YCB"
    assert title_of(STAND_IN) == "YCB (procedural stand-in)"


def test_a_caption_tells_stand_ins_from_a_mixture():
    assert stand_in_clause([REAL, REAL]) == stand_in_clause([]) == ""
    whole, partly = stand_in_clause([STAND_IN, STAND_IN]), stand_in_clause([STAND_IN, REAL])
    assert "stand-in" in whole and "partly" not in whole
    assert partly.replace("partly ", "") == whole == stand_in_clause([STAND_IN, REAL], partly=False)
