"""What all tests share."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tca_mj.model.mujoco_warnings import count_warnings


@pytest.fixture(scope="session", autouse=True)
def no_litter() -> Iterator[None]:
    """MuJoCo writes no log where the tests run."""
    log = Path("MUJOCO_LOG.TXT").absolute()
    before = log.stat().st_size if log.exists() else 0
    count_warnings()
    yield
    assert (log.stat().st_size if log.exists() else 0) == before, f"{log} was written to"
