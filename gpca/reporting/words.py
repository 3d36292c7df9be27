"""Writes numbers and names as words, the same way in every table and figure."""

import re
from collections.abc import Iterable

_LINEMOD = (
    *("ape", "benchvise", "bowl", "camera", "can", "cat", "cup", "driller", "duck", "eggbox", "glue", "holepuncher"),
    *("iron", "lamp", "phone"),
)
BOP_NAMES = {  # what datasets of the BOP benchmark call their objects, from number 1 on
    "lm": _LINEMOD,
    "lmo": _LINEMOD,
    "ycbv": (
        *("master chef can", "cracker box", "sugar box", "tomato soup can", "mustard bottle", "tuna fish can"),
        *("pudding box", "gelatin box", "potted meat can", "banana", "pitcher base", "bleach cleanser", "bowl", "mug"),
        *("power drill", "wood block", "scissors", "large marker", "large clamp", "extra large clamp", "foam brick"),
    ),
    "icbin": ("coffee cup", "juice carton"),
    "visp": ("toy cube", "dragon"),
}
BOP_TITLES = {"lm": "LINEMOD", "lmo": "LINEMOD-Occlusion", "ycbv": "YCB-Video", "icbin": "IC-BIN", "visp": "ViSP"}


def plural(count: int | str, noun: str) -> str:
    """Return e.g. ``1 seed``, ``5 seeds`` or ``2 to 3 seeds``."""
    return f"{count} {noun}" if str(count) == "1" else f"{count} {noun}s"


def span(numbers: Iterable[float]) -> str:
    """Return the least and the largest of some whole numbers, such as ``15 to 200``, or the one that all are."""
    distinct = sorted({int(number) for number in numbers})
    return str(distinct[0]) if len(distinct) == 1 else f"{distinct[0]} to {distinct[-1]}"


def dataset_in_words(name: str) -> str:
    """Return the usual name of a dataset of depth frames: ``YCB-Video`` for ``ycbv``."""
    return BOP_TITLES.get(name, in_words(name))


def in_words(name: object) -> str:
    """Return a name from a file or a config as words: ``coffee cup`` for ``coffee_cup``."""
    return str(name).replace("_", " ")


def object_in_words(name: object, dataset: str = "") -> str:
    """Return the usual name of an object: ``mug`` for ``ycb_025_mug``, ``cat`` for ``obj_000006`` of ``lmo``.

    A number alone says nothing without its dataset, so that it is ``object 6 of mine`` where the names are not known.
    """
    if numbered := re.fullmatch(r"obj_0*(\d+)", str(name)):
        number, names = int(numbered[1]), BOP_NAMES.get(dataset, ())
        if 0 < number <= len(names):
            return names[number - 1]
        return f"object {number} of {dataset}" if dataset else f"object {number}"
    if listed := re.match(r"(?:ycb_|linemod_)?\d+(?:-([a-z]))?_", str(name)):
        return in_words(str(name)[listed.end() :]) + (f" ({listed[1]})" if listed[1] else "")
    return in_words(name)


def object_of_frames(name: object) -> str:
    """Return the usual name of an object of depth frames, whose files name it by dataset and model."""
    dataset, _, model = str(name).partition(" ")
    return object_in_words(model, dataset) if model else object_in_words(dataset)
