"""What all tests share."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

# Before NumPy is loaded: the matrices are small, and threads that wait for each other on a busy
# machine make some tests twenty times as long.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from tca_mj.model.mujoco_warnings import count_warnings


@pytest.fixture(scope="session", autouse=True)
def no_litter(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Tests run in a working folder of their own and have one for temporary files. Nothing stays in
    either, no log of MuJoCo's or of a learner's, but torch's cache, which it makes empty when it is
    imported.
    """
    usual, here = tempfile.gettempdir(), Path.cwd()
    temporary, working = map(tmp_path_factory.mktemp, ("temporary", "working"))
    os.environ["TMPDIR"] = tempfile.tempdir = str(temporary)
    os.chdir(working)
    count_warnings()
    yield
    os.chdir(here)
    os.environ["TMPDIR"] = tempfile.tempdir = usual
    left = [path for folder in (temporary, working) for path in folder.iterdir()]
    assert [path for path in left if "torchinductor" not in path.name] == []


@pytest.fixture
def without_board(monkeypatch: pytest.MonkeyPatch) -> None:
    """No TensorBoard, which takes longer than the rest of a small run."""
    from tca_mj.agents.train.runs import RunFolder

    class Board:
        def add_scalar(self, *_: object) -> None:
            pass

        flush = close = lambda self: None

    monkeypatch.setattr(RunFolder, "tensorboard", lambda self, step: Board())
