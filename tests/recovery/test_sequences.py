from gpca.recovery.policies import best_order, next_of, sequences, title_of_sequence

COSTS = {"a": 0.01, "b": 0.03, "c": 0.02}


def test_all_orders_of_two_and_more_actions_have_a_name():
    named = sequences(("a", "b_b", "c"))
    assert len(named) == 6 + 6
    assert named["sequence_b_b_a"] == ("b_b", "a")
    assert title_of_sequence(named["sequence_b_b_a"]) == "B b, then a"
    assert sequences(("a",)) == {}


def test_an_ended_sequence_begins_anew():
    assert [next_of(("a", "b"), taken) for taken in ((), ("a",), ("a", "b"))] == ["a", "b", "a"]


def helped_by(*actions):
    asked = []

    def solved(taken):
        asked.append(taken)
        return taken[-1] in actions

    solved.asked = asked
    return solved


def test_the_order_that_recovers_failures_soonest_is_chosen():
    failures = [helped_by("c"), helped_by("c"), helped_by("b")]
    assert best_order(("a", "b", "c"), COSTS, failures, 3) == ("c", "b", "a")
    assert all(len(taken) <= 3 for taken in failures[0].asked)
    assert ("c", "b") not in failures[0].asked  # nothing is tried after success
    assert ("c", "b", "a") not in failures[2].asked  # nothing is left to compare


def test_of_orders_that_are_as_soon_the_cheapest_is_chosen():
    assert best_order(("b", "a", "c"), COSTS, [helped_by("a", "b", "c")], 3)[0] == "a"
    assert best_order(("b", "a", "c"), COSTS, [helped_by()], 2) == ("a", "c", "b")
