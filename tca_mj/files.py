"""Files that are whole at any moment, files that one writes and nobody else, folders likewise."""

import errno
import os
import secrets
import shutil
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

if sys.platform != "win32":
    import fcntl
    import resource

LOCK, PART = ".tca-mj.lock", ".tca-mj.part"


def write_whole(path: Path, content: bytes) -> Path:
    """Replaces a file in one go, after its content has reached the disk.

    It is written beside the old one under a name that nobody else has. If that fails, as on a full
    disk, the old one stays as it is and nothing is left beside it.

    Raises:
        OSError: If it cannot be written, with the name of the file.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{secrets.token_hex(8)}{PART}")
    try:
        with beside.open("xb") as file:  # made anew: no link that lies there is followed
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    except BaseException as error:
        beside.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise
    return path


def append_whole(path: Path, content: bytes) -> None:
    """Appends to a file and waits until that has reached the disk; all of it or, failing, nothing.

    Raises:
        OSError: If it cannot be written, with the name of the file.
    """
    with path.open("ab", buffering=0) as file:
        size, left, whole = file.tell(), memoryview(content), False
        try:
            while left:
                left = left[file.write(left) :]
            os.fsync(file.fileno())
            whole = True
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from error
        finally:
            if not whole:
                file.truncate(size)


def require_room(path: Path, size: int, *, later: int = 0) -> None:
    """Makes sure that a file can grow now, for those who do not say so if it cannot.

    Args:
        path: The file, which is left as it is.
        size: By how many bytes; it is tried beside it.
        later: For how many more the disk must have room; it is asked.

    Raises:
        OSError: If it cannot, with the name of the file.
    """
    held = path.stat().st_size if path.is_file() else 0
    limit = sys.maxsize
    if sys.platform != "win32":
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    over = limit != -1 and held + size + later > limit
    number = errno.EFBIG if over else errno.ENOSPC
    if over or shutil.disk_usage(path.parent).free < size + later:
        raise OSError(number, os.strerror(number), str(path))
    beside = path.with_name(f".{secrets.token_hex(8)}{PART}")
    try:
        beside.write_bytes(bytes(size))
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        beside.unlink(missing_ok=True)


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


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """A folder for this process alone, made if it is missing, as long as the context lasts.

    The lock, ``flock`` of the hidden file ``LOCK``, goes with the process, however that ends. What
    one that was killed has left half done (names that end in ``PART``) is removed. Where there are
    no such locks (Windows, some network drives) nothing is locked or removed; on such a drive a
    warning says so.

    Raises:
        BlockingIOError: If another process has it.
        OSError: If the folder cannot be made or written to.
    """
    made = not folder.exists()
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / LOCK
    lock = None if sys.platform == "win32" else _locked(path)
    try:
        if lock is not None:
            for part in folder.glob(f".*{PART}"):
                if part.is_dir() and not part.is_symlink():
                    shutil.rmtree(part)
                else:
                    part.unlink(missing_ok=True)
        yield
    finally:
        if lock is not None:
            if _same(lock, path):
                path.unlink()
            os.close(lock)
        if made:
            with suppress(OSError):
                folder.rmdir()  # if nothing came of it


def _locked(path: Path) -> int | None:
    """A descriptor of the locked file; None where there are no locks."""
    while True:
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(lock, 200, 0).decode(errors="replace") or "another process"
            os.close(lock)
            raise BlockingIOError(
                f"{path.parent} is in use by {holder}: wait for its end, or take another folder"
            ) from None
        except OSError as error:
            os.close(lock)
            path.unlink(missing_ok=True)
            warnings.warn(
                f"{path.parent} cannot be locked: {error}; no other process must work in it",
                RuntimeWarning, stacklevel=5,
            )
            return None
        if _same(lock, path):
            with suppress(OSError):  # on a full disk the message is less exact
                os.ftruncate(lock, 0)
                os.write(lock, f"process {os.getpid()} on {os.uname().nodename}".encode())
            return lock
        os.close(lock)  # whoever had it has just removed it


def _same(lock: int, path: Path) -> bool:
    """Whether an open file is still the one of that name."""
    try:
        return os.path.samestat(os.fstat(lock), os.stat(path))
    except FileNotFoundError:
        return False
