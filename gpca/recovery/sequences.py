"""Fixed sequences of actions: what a robot can do that knows that it failed, but not why."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import permutations

SEQUENCE = "sequence"  # begins the name of a policy, which its actions follow: sequence_reinitialize_new_view
Order = tuple[str, ...]


def sequences(actions: Sequence[str]) -> dict[str, Order]:
    """Return the sequences of two and more different actions, by the policy's name."""
    lengths = range(2, len(actions) + 1)
    orders = [order for length in lengths for order in permutations(actions, length)]
    return {"_".join((SEQUENCE, *order)): order for order in orders}


def title_of_sequence(order: Order) -> str:
    """Return what tables call it, such as ``Reinitialize, then new view``."""
    return ", then ".join(action.replace("_", " ") for action in order).capitalize()


def next_of(order: Order, taken: Sequence[str]) -> str:
    """Return the action after so many; a sequence that has ended begins anew."""
    return order[len(taken) % len(order)]


def best_order(
    actions: Sequence[str], costs: Mapping[str, float], solved: Sequence[Callable[[Order], bool]], budget: int
) -> Order:
    """Return the order of all actions that recovers failures soonest.

    The first action solves the most failures, the next one the most of those that are left, and so on. Of equal ones it
    is the cheapest, and of these the first.

    Args:
        costs: action -> what it costs.
        solved: of each rehearsed failure the function that tells whether it is solved after actions, of which all but
            the last were taken without success.
        budget: how many actions a failure may take; what comes after is no longer compared.
    """
    order: Order = ()
    left, remaining = list(solved), list(actions)
    while remaining:
        counts = dict.fromkeys(remaining, 0)
        if len(remaining) > 1 and len(order) < budget:
            counts = {action: sum(of_failure((*order, action)) for of_failure in left) for action in remaining}
        best = max(remaining, key=lambda action: (counts[action], -costs[action]))
        order = (*order, best)
        remaining.remove(best)
        if len(remaining) > 1 and len(order) < budget:
            left = [of_failure for of_failure in left if not of_failure(order)]
    return order
