"""Archives from outside: arrays of NumPy's ``.npz``, tensors of torch's ``.pth``, as numbers only.

Nothing in them is looked up, called or unpickled, and no more memory is taken than ``LARGEST`` for
a file and once more for what is unpacked from it, whatever it declares. So torch is not needed.
"""

from __future__ import annotations

import io
import math
import pickletools
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import numpy as np
from numpy.typing import NDArray

LARGEST = 2**28  # bytes of a file, and again of what it unpacks to: estimate
LONGEST = 2**22  # bytes of a text, or of the pickle of a dictionary of tensors: estimate
MEMBERS = 2**12  # estimate: a network of Stable-Baselines3 has 10 to 100 tensors

_ENTRY = b"PK\x01\x02"  # every member has one in the directory of a zip
_DTYPES = {
    "torch HalfStorage": "<f2", "torch FloatStorage": "<f4", "torch DoubleStorage": "<f8",
    "torch LongStorage": "<i8",
}  # fmt: skip
_SHORT_TUPLES = {"EMPTY_TUPLE": 0, "TUPLE1": 1, "TUPLE2": 2, "TUPLE3": 3}
_GET, _PUT = ("BINGET", "LONG_BINGET"), ("BINPUT", "LONG_BINPUT")
_CONSTANTS = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False}
_PLAIN = ("GLOBAL", "BINUNICODE", "BININT", "BININT1", "BININT2", "LONG1")


def content_of(path: str | Path) -> bytes:
    """A file's content.

    Raises:
        FileNotFoundError: If there is none.
        ValueError: If it is larger than ``LARGEST``.
    """
    with Path(path).open("rb") as file:
        content = file.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise ValueError(f"file must have at most {LARGEST} bytes, got more")
    return content


def why(error: Exception) -> str:
    """What is wrong with a file: the words of a refusal, or an error of who tried to read it."""
    return str(error) if type(error) is ValueError else f"{type(error).__name__}: {error}"


class Archive:
    """A zip of which no more than ``LARGEST`` bytes are unpacked.

    Attributes:
        names: Of its members.
    """

    def __init__(self, content: bytes) -> None:
        """Reads the directory.

        Raises:
            ValueError: If it is no zip, or two members have the same name.
            Exception: Others of ``zipfile``'s, if it is broken.
        """
        if content.count(_ENTRY) > MEMBERS:
            raise ValueError(f"a zip must have at most {MEMBERS} members, got more")
        self._zip = ZipFile(io.BytesIO(content))
        self.names = self._zip.namelist()
        self._left = LARGEST
        if len(set(self.names)) != len(self.names):
            raise ValueError("members must have different names, got two of the same")

    def read(self, name: str, longest: int | None = None) -> bytes:
        """Unpacks a member, of at most ``longest`` bytes if that is said.

        Raises:
            ValueError: If there is none, or it is too large.
            Exception: Others of ``zipfile``'s, if it is broken.
        """
        if name not in self.names:
            raise ValueError(f"a member {name!r} is missing")
        about = self._zip.getinfo(name)
        if about.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
            raise ValueError(f"{name!r} must be stored or deflated")
        most = self._left if longest is None else min(longest, self._left)
        if about.file_size > most:
            raise ValueError(f"{name!r} must unpack to at most {most} bytes, got {about.file_size}")
        self._left -= about.file_size
        with self._zip.open(name) as file:
            content = file.read(about.file_size)  # no more, even if there is more
        return content


def arrays(content: bytes) -> dict[str, NDArray[Any]]:
    """The arrays of an ``.npz`` file, read-only, by name.

    Raises:
        ValueError: If it holds something else.
        Exception: Others, if it is broken.
    """
    archive = Archive(content)
    return {name.removesuffix(".npy"): _array(archive.read(name)) for name in archive.names}


def _array(content: bytes) -> NDArray[Any]:
    """An array of NumPy's format 1.0 or 2.0, which is not larger than its file."""
    file = io.BytesIO(content)
    readers = {(1, 0): np.lib.format.read_array_header_1_0,
               (2, 0): np.lib.format.read_array_header_2_0}  # fmt: skip
    shape, fortran, dtype = readers[np.lib.format.read_magic(file)](file)
    # Refuses objects, and what is said to be larger than it is.
    flat = np.frombuffer(content, dtype, count=math.prod(shape), offset=file.tell())
    return flat.reshape(shape, order="F" if fortran else "C")


def tensors(content: bytes, prefixes: tuple[str, ...]) -> tuple[list[str], dict[str, NDArray[Any]]]:
    """A dictionary of tensors that ``torch.save`` has written.

    Args:
        content: The file.
        prefixes: Tensors whose names begin so are read.

    Returns:
        The names of all tensors, and by name those that are read, read-only.

    Raises:
        ValueError: If it holds something else.
        Exception: Others, if it is broken.
    """
    archive = Archive(content)
    roots = [name.removesuffix("data.pkl") for name in archive.names if name.endswith("/data.pkl")]
    if len(roots) != 1:
        raise ValueError("a file of torch's must have one data.pkl, got none or several")
    order = f"{roots[0]}byteorder"
    if order in archive.names and archive.read(order) != b"little":
        raise ValueError("byteorder must be little")
    said = _said(archive.read(f"{roots[0]}data.pkl", LONGEST))
    read = {}
    for name in (name for name in said if name.startswith(prefixes)):
        (_, storage, key, _, _), start, shape, strides, *_ = said[name]
        if storage not in _DTYPES:
            raise ValueError(f"{name:.80} must be a tensor of numbers, got {storage!r:.80}")
        if len(shape) > 2 or any(type(number) is not int for number in (start, *shape)):
            raise ValueError(f"{name:.80} must be a row or a matrix, got {shape!r:.80}")
        if strides != tuple(math.prod(shape[i + 1 :]) for i in range(len(shape))):
            raise ValueError(f"{name:.80} must be contiguous, got strides {strides!r:.80}")
        dtype = np.dtype(_DTYPES[storage])
        stored = archive.read(f"{roots[0]}data/{key}")
        flat = np.frombuffer(stored, dtype, math.prod(shape), offset=start * dtype.itemsize)
        read[name] = flat.reshape(shape)
    return list(said), read


def _said(pickled: bytes) -> dict[str, Any]:
    """What the pickle of a dictionary of tensors says, word by word, as inert values.

    Of each tensor: its storage, start, shape, strides and what else ``_rebuild_tensor_v2`` takes.
    Words that such a pickle does not need are refused.
    """
    stack: list[Any] = []
    marks: list[int] = []
    memo: dict[Any, Any] = {}

    def popped(start: int) -> list[Any]:
        found = stack[start:]
        del stack[start:]
        return found

    for opcode, value, _ in pickletools.genops(pickled):
        word = opcode.name
        if word == "MARK":
            marks.append(len(stack))
        elif word in _PUT:
            memo[value] = stack[-1]
        elif word in _GET:
            stack.append(memo[value])
        elif word in _PLAIN:
            stack.append(value)
        elif word in _CONSTANTS:
            stack.append(_CONSTANTS[word])
        elif word == "EMPTY_DICT":
            stack.append({})
        elif word in _SHORT_TUPLES:
            stack.append(tuple(popped(len(stack) - _SHORT_TUPLES[word])))
        elif word == "TUPLE":
            stack.append(tuple(popped(marks.pop())))
        elif word in ("SETITEM", "SETITEMS"):
            items = popped(len(stack) - 2 if word == "SETITEM" else marks.pop())
            stack[-1].update(zip(items[::2], items[1::2], strict=True))
        elif word == "REDUCE":
            name, given = popped(len(stack) - 2)
            if name == "torch._utils _rebuild_tensor_v2":
                stack.append(given)
            elif name == "collections OrderedDict" and given == ():
                stack.append({})
            else:
                raise ValueError(f"a dictionary of tensors must not call {name!r:.80}")
        elif word == "BUILD":  # versions of the modules, which torch notes on the dictionary
            stack.pop()
        elif word not in ("PROTO", "BINPERSID", "STOP"):  # a storage stays what it is called
            raise ValueError(f"a dictionary of tensors must not hold {word}")
    (said,) = stack
    if not isinstance(said, dict) or not all(isinstance(name, str) for name in said):
        raise ValueError("tensors must have names")
    return said
