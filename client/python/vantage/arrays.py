"""The type of arrays; what they hold, and their shapes, stand in the docstrings."""

from typing import Any

from numpy.typing import NDArray

Array = NDArray[Any]
