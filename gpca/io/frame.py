"""Frames of pandas in annotations, for which modules do not import pandas."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pandas import DataFrame as Frame
    from pandas import Series as Series
else:
    Frame = Series = Any
