"""What became of an observation before a model saw it, which the model's own file does not say."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.agents.policies.archives import arrays, content_of, why
from tca_mj.checks import Checked, NotNegative, Positive, door, floats


@dataclass(frozen=True, kw_only=True, slots=True)
class Statistics(Checked):
    """By what ``VecNormalize`` normalised the observations of a model.

    Attributes:
        mean: Of each number of an observation as the model saw it [their units].
        var: Variance of each [their units squared].
        clip: Largest size of a normalised number [1]; None for no limit.
        epsilon: Added to the variance [as ``var``].

    Raises:
        ValueError: If clip or epsilon is out of range.
    """

    mean: tuple[float, ...]
    var: tuple[float, ...]
    clip: Positive | None
    epsilon: NotNegative

    @classmethod
    @door
    def read(cls, path: str | Path, *, trust: bool = False) -> Statistics:
        """Reads ``mean``, ``var``, ``clip`` and ``epsilon`` of an ``.npz`` file, or a pickle.

        Args:
            path: The file; what does not end in ``.npz`` is taken for a pickle of ``VecNormalize``.
            trust: Whether a pickle may be read, which runs whatever is in it.

        Raises:
            FileNotFoundError: If there is none.
            ValueError: If it is a pickle that is not trusted, or cannot be read.
        """
        safe = Path(path).suffix == ".npz"
        if not (safe or trust):
            raise ValueError(
                f"{path} must be trusted or an .npz: it is taken for a pickle, and to read one is"
                " to run whatever is in it. Say --trust (trust=True) if you know who wrote it, or"
                " save its numbers as an .npz (docs/training.md has the lines)"
            )
        try:
            content = content_of(path)
            said = arrays(content) if safe else _unpickled(content)
            clip = float(said["clip"])
            return cls(
                mean=tuple(np.ravel(floats("mean", said["mean"])).tolist()),
                var=tuple(np.ravel(floats("var", said["var"])).tolist()),
                clip=None if clip == np.inf else clip,
                epsilon=float(said["epsilon"]),
            )
        except FileNotFoundError:
            raise
        except Exception as error:
            raise ValueError(f"{path} has no statistics of VecNormalize: {why(error)}") from error


@dataclass(frozen=True, kw_only=True, slots=True)
class Preprocessing(Checked):
    """What became of an observation before a model saw it.

    Attributes:
        scaled: Whether it was scaled as by ``ScaledObservation``; None to find out from the bounds
            of the model's observations.
        statistics: By what it was then normalised; None if it was not.
    """

    scaled: bool | None = None
    statistics: Statistics | None = None


def _unpickled(content: bytes) -> dict[str, Any]:
    """The statistics of a pickled ``VecNormalize``; only for files that are trusted."""
    found: Any = pickle.loads(content)
    if not found.norm_obs:
        raise ValueError("it does not normalise observations")
    return {"mean": found.obs_rms.mean, "var": found.obs_rms.var,
            "clip": found.clip_obs, "epsilon": found.epsilon}  # fmt: skip
