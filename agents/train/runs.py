"""The folder of a training run: its settings, its state, its curves, each file whole at any moment.

The state is one file that is replaced in one go; what else lies in the folder follows from it, or
only explains it. So a run that is killed goes on from its last state when it is called again.
"""

import hashlib
import json
import pickle
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from tca_mj.agents.output import read_json, write_json
from tca_mj.agents.policies import Origin
from tca_mj.checks import shown
from tca_mj.files import require_room, write_whole
from tca_mj.machine import machine, versions

RUN, STATE, CURVE, TENSORBOARD = "run.json", "state.pkl", "curve.csv", "tensorboard"
_DIGEST = hashlib.sha256  # of the state, which it ends with
_REMOVE = "remove it to begin the run anew, or take another folder"
_ROOM = 1 << 18  # for points of curves [bytes]
LIBRARIES = ("torch", "stable-baselines3", "cmaes")


def drawn(seed: int, stream: int, count: int) -> list[int]:
    """Seeds of episodes: those of a stream of a run are always the same."""
    return np.random.default_rng((seed, stream)).integers(2**31, size=count).tolist()


class RunFolder:
    """Where a run writes to.

    Attributes:
        path: The folder.
    """

    def __init__(self, path: Path, config: Any, command: str) -> None:
        """Makes the folder, or finds the run that it holds.

        Args:
            path: The folder.
            config: Settings of the run, a dataclass. Called again with others it is refused; only
                ``steps`` may change, so that a run can be made longer.
            command: Command that starts the run.

        Raises:
            ValueError: If the folder holds a run with other settings, or files that are broken.
        """
        self.path, self.seed, self.command = path, config.seed, command
        settings = json.loads(json.dumps(asdict(config)))
        file = path / RUN
        if not file.is_file() and (path / STATE).exists():
            raise ValueError(f"{path} holds {STATE} without {RUN}: {_REMOVE}")
        if file.is_file():
            held = read_json(file).get("config")
            if not isinstance(held, dict):
                raise ValueError(f"{file} must have a config: it is broken, or another file")
            other = [
                f"{name:.80} {shown(held.get(name))}, not {shown(settings.get(name))}"
                for name in sorted(held.keys() | settings.keys())
                if held.get(name) != settings.get(name) and name != "steps"
            ]
            kinds = [str(each.get("algorithm", "cma")) for each in (held, settings)]
            if kinds[0] != kinds[1]:  # of which no setting means the same
                other = [f"algorithm {kinds[0]:.80}, not {kinds[1]}"]
            if other:
                raise ValueError(
                    f"{file} holds a run with {'; '.join(other[:5])}; take another folder"
                )
        made = {"versions": versions(*LIBRARIES), "machine": machine()}
        write_json(file, {"config": settings, "command": command, **made})

    def origin(self, algorithm: str, steps: int, source: str) -> Origin:
        """Where a policy of the run comes from; arguments as those of ``Origin``."""
        return Origin(
            algorithm=algorithm, seed=self.seed, steps=steps, command=self.command, source=source,
            versions=versions(*LIBRARIES),
        )  # fmt: skip

    def load(self) -> Any:
        """The last state, or None. It is a pickle: only load runs that you trust.

        Raises:
            ValueError: If it is not whole, or of another version.
        """
        file = self.path / STATE
        if not file.is_file():
            return None
        content = memoryview(file.read_bytes())
        state, digest = content[: -_DIGEST().digest_size], content[-_DIGEST().digest_size :]
        if _DIGEST(state).digest() != digest:
            raise ValueError(f"{file} is broken, or of an older version: {_REMOVE}")
        try:
            return pickle.loads(state)
        except Exception as error:
            raise ValueError(f"{file} is of another version ({error!r}): {_REMOVE}") from error

    def save(self, state: Any) -> None:
        """Replaces the state by what ``load`` is to give back."""
        content = pickle.dumps(state, protocol=pickle.HIGHEST_PROTOCOL)
        write_whole(self.path / STATE, content + _DIGEST(content).digest())

    def require_room(self) -> None:
        """Raises OSError on a full disk: TensorBoard would say so from a thread of its own."""
        require_room(self.path / TENSORBOARD, _ROOM)

    def tensorboard(self, step: int) -> Any:
        """A writer for TensorBoard that hides what an interrupted run wrote from ``step`` on.

        What the state knows of ``step`` itself is to be written again; before anything is,
        ``require_room``.
        """
        from torch.utils.tensorboard import SummaryWriter

        return SummaryWriter(str(self.path / TENSORBOARD), purge_step=step)
