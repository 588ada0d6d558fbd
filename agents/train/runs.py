"""The folder of a training run: its settings, its state, its curves, each file whole at any moment.

The state is one file that is replaced in one go; what else lies in the folder follows from it, or
only explains it. So a run that is killed goes on from its last state when it is called again.
"""

import csv
import io
import json
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tca_mj.files import write_whole
from tca_mj.machine import machine, versions

RUN, STATE, CURVE, TENSORBOARD = "run.json", "state.pkl", "curve.csv", "tensorboard"
LIBRARIES = ("torch", "stable-baselines3", "cmaes")

Row = Mapping[str, float | int | str]


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
            ValueError: If the folder holds a run with other settings.
        """
        self.path = path
        settings = json.loads(json.dumps(asdict(config)))
        file = path / RUN
        if file.is_file():
            held = json.loads(file.read_text(encoding="utf-8"))["config"]
            other = [
                f"{name} {held.get(name)!r}, not {settings.get(name)!r}"
                for name in sorted(held.keys() | settings.keys())
                if held.get(name) != settings.get(name) and name != "steps"
            ]
            if other:
                raise ValueError(f"{path} holds a run with {'; '.join(other)}")
        about = {
            "config": settings,
            "command": command,
            "versions": versions(*LIBRARIES),
            "machine": machine(),
        }
        text = json.dumps(about, indent=2, ensure_ascii=False) + "\n"
        write_whole(file, text.encode())

    def load(self) -> Any:
        """The last state, or None. It is a pickle: only load runs that you trust."""
        file = self.path / STATE
        return pickle.loads(file.read_bytes()) if file.is_file() else None

    def save(self, state: Any) -> None:
        """Replaces the state by what ``load`` is to give back."""
        write_whole(self.path / STATE, pickle.dumps(state, protocol=pickle.HIGHEST_PROTOCOL))

    def write_curves(self, curves: Mapping[str, Sequence[Row]]) -> None:
        """Writes CSV files, whose columns are all keys in the order in which they come up."""
        for name, rows in curves.items():
            columns = list(dict.fromkeys(key for row in rows for key in row))
            text = io.StringIO()
            table = csv.DictWriter(text, columns, lineterminator="\n")
            table.writeheader()
            table.writerows(rows)
            write_whole(self.path / name, text.getvalue().encode())

    def tensorboard(self, step: int) -> Any:
        """A writer for TensorBoard that hides what an interrupted run wrote from ``step`` on."""
        from torch.utils.tensorboard import SummaryWriter

        return SummaryWriter(str(self.path / TENSORBOARD), purge_step=step)
