"""Numbers from outside: real floats or a clear refusal."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def floats(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """``values`` as an array of floats, without a copy if they are one.

    Args:
        name: What they are, for the message.
        values: A real number or an array of them; NaN and infinity pass.

    Returns:
        The array.

    Raises:
        ValueError: If they are complex, text, ragged or no numbers at all, which NumPy would
            partly convert with a warning or none.
    """
    if type(values) is np.ndarray and values.dtype == np.float64:
        return values
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biuf":
            raise TypeError
        return array.astype(np.float64)
    except (OverflowError, TypeError, ValueError) as error:
        text = f"{name} = {values!r} must be a real number or an array of them"
        raise ValueError(text) from error
