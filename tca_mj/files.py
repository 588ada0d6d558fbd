"""Files that are whole at any moment."""

import os
from pathlib import Path


def write_whole(path: Path, content: bytes) -> Path:
    """Replaces a file in one go, after its content has reached the disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.tmp")
    with beside.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)
    return path
