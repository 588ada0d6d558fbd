"""Files that are whole at any moment, and files that one writes and nobody else."""

import os
import sys
from contextlib import suppress
from pathlib import Path

if sys.platform != "win32":
    import fcntl


def write_whole(path: Path, content: bytes) -> Path:
    """Replaces a file in one go, after its content has reached the disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.tmp")
    try:
        with beside.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    return path


class Claim:
    """A file that nobody else who claims it may write, until ``close`` or the end of the process.

    The file and its folder are made if they are missing; what it holds is left as it is. Where
    there are no such locks, as on Windows and on some network drives, nothing is refused.
    """

    def __init__(self, path: Path) -> None:
        """Claims a file.

        Raises:
            ValueError: If it is claimed already, by this process or another one.
            OSError: If it cannot be written.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path, self._new = path, not path.exists()
        self._file = path.open("ab")
        if sys.platform == "win32":
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            self._file.close()
            raise ValueError(f"path must be a file that nothing writes now, got {path}") from error
        except OSError:  # no locks here
            return

    def close(self) -> None:
        """Gives the file back, and removes it if it was new and is empty; may be called again."""
        if self._file.closed:
            return
        if self._new and self._path.is_file() and not self._path.stat().st_size:
            self._path.unlink()
        if sys.platform != "win32":
            with suppress(OSError):  # also for processes that have inherited it
                fcntl.flock(self._file, fcntl.LOCK_UN)
        self._file.close()
