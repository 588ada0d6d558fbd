"""What all tests share."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tca_mj.model.mujoco_warnings import count_warnings


@pytest.fixture(scope="session", autouse=True)
def no_litter(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """MuJoCo writes no log where the tests run, and nothing stays in the folder for temporary files
    but torch's cache, which it makes empty when it is imported.
    """
    usual, temporary = tempfile.gettempdir(), tmp_path_factory.mktemp("temporary")
    os.environ["TMPDIR"] = tempfile.tempdir = str(temporary)
    log = Path("MUJOCO_LOG.TXT").absolute()
    before = log.stat().st_size if log.exists() else 0
    count_warnings()
    yield
    os.environ["TMPDIR"] = tempfile.tempdir = usual
    left = [path.name for path in temporary.iterdir() if "torchinductor" not in path.name]
    assert left == []
    assert (log.stat().st_size if log.exists() else 0) == before, f"{log} was written to"
