"""The door: what comes from outside is what its type says, or it is refused by name and bound.

``Checked`` checks the fields of a dataclass and ``door`` the arguments of a function, both by
their types; what a type cannot say is checked by ``within`` and its like where it is needed.
Every message reads ``name must ..., got ...``.
"""

import inspect
import math
import reprlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import cache, partial, wraps
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    ParamSpec,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Check = Callable[[str, Any], Any]
"""From a name and a value to the value, as it goes on; it raises ValueError."""

LARGEST, SMALLEST = 1e30, 1e-30
"""No quantity of this field, in SI units, is larger or, but for 0, smaller; products overflow."""

P = ParamSpec("P")
R = TypeVar("R")

_DOUBLE = np.dtype(np.float64)
_FEW = 8  # numbers that Python compares faster than NumPy
_SHORT = reprlib.Repr()
_SHORT.maxother, _SHORT.maxstring, _SHORT.maxlist, _SHORT.maxtuple = 160, 80, 8, 8


def shown(value: Any) -> str:
    """A value as a message shows it, short and on one line."""
    try:
        return " ".join(_SHORT.repr(value).split())
    except ValueError:  # Python does not write whole numbers of thousands of digits
        return f"a whole number of {value.bit_length()} bits"


def floats(name: str, values: ArrayLike, *, empty: bool = False) -> Array:
    """``values`` as an array of floats, without a copy if they are one.

    Args:
        name: What they are, for the message.
        values: A real number or an array of them; NaN and infinity pass.
        empty: Whether a list without a number passes, too, as an empty array always does.

    Raises:
        ValueError: If they are complex, text, dates, masked, true or false, ragged or no numbers at
            all, which NumPy would partly convert with a warning or none.
    """
    if type(values) is np.ndarray:
        kind = values.dtype
        if kind is _DOUBLE or kind == _DOUBLE:
            return values
    if type(values) is float:
        return np.array(values)
    try:
        array = np.asarray(values)
        listed = not isinstance(values, np.ndarray)
        masked = np.ma.isMaskedArray(values)
        if array.dtype.kind not in "iuf" or masked or (listed and not array.size and not empty):
            raise TypeError
        if array.dtype.itemsize <= 8:
            return array.astype(np.float64)
        with np.errstate(over="ignore"):  # long doubles
            return array.astype(np.float64)
    except (OverflowError, TypeError, ValueError) as error:
        raise ValueError(
            f"{name} must be a real number or an array of them, got {shown(values)}"
        ) from error


def every(flags: Any) -> bool:
    """Whether all flags of an array hold: as its ``all``, in a tenth of the time for a few."""
    return 0 not in flags.tobytes()


def some(flags: Any) -> bool:
    """Whether one flag of an array holds: as its ``any``, in a tenth of the time for a few."""
    return 1 in flags.tobytes()


def within(
    name: str,
    values: ArrayLike,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    at_most: float = math.inf,
    unit: str = "",
    shape: tuple[int, ...] | None = None,
) -> Array:
    """``values`` as floats within bounds, none larger than ``LARGEST``.

    Args:
        name: What they are, for the message.
        values: A real number or an array of them.
        above, at_least: Lower bound, without and with it.
        below, at_most: Upper bound, without and with it.
        unit: Unit of the bounds, for the message.
        shape: Shape that they must have; None for any.

    Raises:
        ValueError: If one is no real number, not finite or out of bounds, or the shape another.
    """
    array = floats(name, values, empty=shape is not None)
    if shape is not None and array.shape != shape:
        kind = f"finite numbers of shape {shape}" if shape else "one finite number"
        raise ValueError(f"{name} must be {kind}, got {shown(values)}")
    least, most = max(at_least, -LARGEST), min(at_most, LARGEST)
    if array.size <= _FEW:
        good = True
        for one in (array if array.ndim == 1 else array.ravel()).tolist():
            good &= above < one >= least and below > one <= most
    else:
        low = array > above if above >= least else array >= least
        good = every(low) and every(array < below if below <= most else array <= most)
    if good:
        return array
    bounds = {"above": above, "at least": at_least, "below": below, "at most": at_most}
    said = [f"{word} {bound:.6g}" for word, bound in bounds.items() if math.isfinite(bound)]
    tail = f" {unit}" if unit and said else ""
    if np.isfinite(array).all() and np.abs(array).max() > LARGEST:
        said.append(f"at most {LARGEST:g} in size")
    must = " and ".join(["finite", *said])
    raise ValueError(f"{name} must be {must}{tail}, got {shown(values)}")


def number(name: str, value: Any, **bounds: Any) -> float:
    """One number within bounds, which are those of ``within``; errors as there."""
    return float(within(name, value, shape=(), **bounds))


def quantity(name: str, value: Any, **bounds: Any) -> float:
    """A number within bounds that is 0 or no smaller than ``SMALLEST``; errors as ``within``."""
    found = number(name, value, **bounds)
    if 0.0 < abs(found) < SMALLEST:
        raise ValueError(f"{name} must be 0 or at least {SMALLEST:g} in size, got {shown(value)}")
    return found


def instance(name: str, value: Any, kind: Any) -> None:
    """Raises ValueError unless a value is of a kind: for what is called too often for ``door``."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} must be {_word(kind)}, got {shown(value)}")


def numbers(name: str, values: Any, **bounds: Any) -> float | Array:
    """A number or an array of them within bounds, as it comes; errors as ``within``."""
    array = within(name, values, **bounds)
    return array if array.ndim else float(array)


def limits(name: str, values: Any, *, above: float = -math.inf) -> float | Array:
    """Upper limits, one or an array of them; infinity is none.

    Raises:
        ValueError: If one is no real number or not above the bound.
    """
    array = floats(name, values)
    if not (array > above).all():
        bound = f"above {above:.6g}" if above > -math.inf else "numbers or infinity"
        raise ValueError(f"{name} must be {bound}, got {shown(values)}")
    return array if array.ndim else float(array)


def edge(name: str, value: Any) -> float:
    """One number or infinity, of either sign; ValueError if it is neither."""
    array = floats(name, value)
    if array.shape != () or math.isnan(array):
        raise ValueError(f"{name} must be one number or infinity, got {shown(value)}")
    return float(array)


def row(name: str, values: Any, **bounds: Any) -> tuple[float, ...]:
    """Numbers in a row within bounds, which are those of ``within``; errors as there."""
    if isinstance(values, str | Mapping) or np.ndim(array := within(name, values, **bounds)) != 1:
        raise ValueError(f"{name} must be a row of finite numbers, got {shown(values)}")
    return tuple(array.tolist())


def whole(name: str, value: Any, *, at_least: int | None = None, at_most: int | None = None) -> int:
    """A whole number within bounds.

    Raises:
        ValueError: If it is none or out of bounds; 2.0 is none.
    """
    if not isinstance(value, int | np.integer) or isinstance(value, bool):
        raise ValueError(f"{name} must be a whole number, got {shown(value)}")
    low = at_least is not None and value < at_least
    if low or (at_most is not None and value > at_most):
        said = f"at least {at_least}" if low else f"at most {at_most}"
        raise ValueError(f"{name} must be {said}, got {shown(value)}")
    return int(value)


def flag(name: str, value: Any) -> bool:
    """True or False; ValueError if it is neither, as 1 and "yes" are."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} must be True or False, got {shown(value)}")
    return bool(value)


def flags(name: str, values: ArrayLike) -> Flags:
    """Trues and falses as an array; 1 and 0 will do.

    Raises:
        ValueError: If one of them is neither.
    """
    if type(values) is bool:
        return np.array(values)
    try:
        array = np.asarray(values)
    except ValueError:  # ragged
        array = np.empty(0, dtype=object)
    known = array.dtype == np.bool_ or array.dtype.kind in "iuf"
    if known and not np.ma.isMaskedArray(values) and ((array == 0) | (array == 1)).all():
        return array.astype(np.bool_, copy=False)
    raise ValueError(f"{name} must be True or False, got {shown(values)}")


def text(name: str, value: Any) -> str:
    """A text; ValueError if it is none."""
    if not isinstance(value, str):
        raise ValueError(f"{name} must be a text, got {shown(value)}")
    return value


def require_positive(**values: Any) -> None:
    """Checks fields of a specification by name.

    Raises:
        ValueError: If one of them is no single number, not finite or not above 0.
    """
    for name, value in values.items():
        quantity(name, value, above=0.0)


def require_count(**values: Any) -> None:
    """Checks fields of a specification that count something.

    Raises:
        ValueError: If one of them is no whole number or below 1.
    """
    for name, value in values.items():
        whole(name, value, at_least=1)


def require_one_of(name: str, value: Any, choices: Sequence[Any]) -> Any:
    """Returns ``value``; raises ValueError unless it is one of the choices, in kind, too."""
    if not any(isinstance(value, type(choice)) and value == choice for choice in choices):
        raise ValueError(f"{name} must be one of {tuple(choices)}, got {shown(value)}")
    return value


# Types of fields and of arguments. The plurals are numbers or arrays of them.
Finite = Annotated[float, quantity]
Positive = Annotated[float, partial(quantity, above=0.0)]
NotNegative = Annotated[float, partial(quantity, at_least=0.0)]
Share = Annotated[float, partial(quantity, at_least=0.0, at_most=1.0)]
Angle = Annotated[float, partial(quantity, at_least=-1e3, at_most=1e3, unit="rad")]
Temperature = Annotated[float, partial(number, above=-273.15)]
Count = Annotated[int, partial(whole, at_least=1)]
Seed = Annotated[int, partial(whole, at_least=0)]
Triple = Annotated[tuple[float, float, float], partial(row, shape=(3,))]
Positives = Annotated[float | Array, partial(numbers, above=0.0)]
NotNegatives = Annotated[float | Array, partial(numbers, at_least=0.0)]
Edge = Annotated[float, edge]
Limits = Annotated[float | Array, partial(limits, above=0.0)]
# Array-likes, which are arrays behind the door.
Numbers = Annotated[Any, within]
Temperatures = Annotated[Any, partial(within, above=-273.15)]


class Checked:
    """A dataclass that checks itself: each field by what its type says.

    A number is finite, a count whole, a specification one of its kind; ``Annotated[..., check]``
    says more. What passes is kept in one form: a number as a float, a row as a tuple. What ties
    fields together is checked in a ``__post_init__`` that calls this one first.

    Raises:
        ValueError: If a field is not what its type says.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name, check in _fields(kind):
            given = getattr(self, name)
            kept = check(name, given)
            if kept is not given:
                object.__setattr__(self, name, kept)


def door(function: Callable[P, R]) -> Callable[P, R]:
    """A function whose arguments are checked by their types, as fields of ``Checked`` are.

    It costs some microseconds a call: what runs in a loop checks what it needs by itself.
    """

    @wraps(function)
    def entered(*args: P.args, **kwargs: P.kwargs) -> R:
        signature, checks = _arguments(function)
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError:
            bound = None
        if bound is None:  # Python says what is missing or too many
            return function(*args, **kwargs)
        given = bound.arguments
        for name, check in checks:
            if name in given:
                given[name] = check(name, given[name])
        return function(*bound.args, **bound.kwargs)

    return entered


@cache
def _fields(kind: Any) -> tuple[tuple[str, Check], ...]:
    hints = get_type_hints(kind, include_extras=True)
    found = ((field.name, by_type(hints[field.name])) for field in fields(kind))
    return tuple((name, check) for name, check in found if check is not None)


@cache
def _arguments(function: Any) -> tuple[inspect.Signature, tuple[tuple[str, Check], ...]]:
    signature = inspect.signature(function)
    hints = get_type_hints(function, include_extras=True)
    single = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    named = [p.name for p in signature.parameters.values() if p.kind in single and p.name in hints]
    found = ((name, by_type(hints[name])) for name in named)
    return signature, tuple((name, check) for name, check in found if check is not None)


def bounds(hint: Any) -> tuple[float, float]:
    """Least and largest value that a type lets pass; infinite where it has no bound."""
    said = [getattr(check, "keywords", {}) for check in getattr(hint, "__metadata__", ())]
    low = [each[name] for each in said for name in ("above", "at_least") if name in each]
    high = [each[name] for each in said for name in ("below", "at_most") if name in each]
    return max(low, default=-math.inf), min(high, default=math.inf)


def by_type(hint: Any) -> Check | None:
    """What checks a value of a type; None for a type that says nothing, as ``Any``."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        own = [check for check in hint.__metadata__ if callable(check)]
        return partial(_in_turn, checks=own) if own else by_type(inner[0])
    if hint in _PLAIN:
        return _PLAIN[hint]
    if origin is Literal:
        return partial(require_one_of, choices=inner)
    if origin in (Union, UnionType):
        return _union(inner)
    if origin is tuple:
        return _tuple(inner)
    if origin is Sequence or origin is list:
        return partial(_sequence, each=by_type(inner[0]))
    if origin is Mapping or origin is dict:
        return partial(_mapping, key=by_type(inner[0]), each=by_type(inner[1]))
    if origin is Callable:
        return _callable
    if inspect.isclass(hint) and getattr(hint, "_is_protocol", False):
        return partial(_alike, protocol=hint, members=_members(hint))
    kind = hint if origin in (None, np.ndarray) else origin  # of Env[...] and its like
    if _is_kind(kind):
        return partial(_instance, kinds=(kind,), words=_word(kind))
    return None


def _is_kind(hint: Any) -> bool:
    """Whether ``isinstance`` knows a type, and not everything is one."""
    if not inspect.isclass(hint) or get_origin(hint):
        return False
    return hint not in (Any, object) and not getattr(hint, "_is_protocol", False)


def _members(protocol: Any) -> tuple[str, ...]:
    """What a protocol asks for, by name; a call operator is one of them."""
    own = [vars(kind) for kind in protocol.__mro__ if getattr(kind, "_is_protocol", False)]
    names = {name for each in own for name in (*each, *each.get("__annotations__", ()))}
    return tuple(sorted(n for n in names if not n.startswith("_") or n == "__call__"))


def _alike(name: str, value: Any, protocol: Any, members: Sequence[str]) -> Any:
    missing = [member for member in members if not hasattr(value, member)]
    if missing or (isinstance(value, type) and "__call__" not in members):
        raise ValueError(f"{name} must be {_word(protocol)}, got {shown(value)}, without {missing}")
    return value


_PLAIN: dict[Any, Check] = {float: quantity, int: whole, bool: flag, str: text}
_WORDS = {float: "a number", int: "a whole number", bool: "True or False", str: "a text",
          NoneType: "None"}  # fmt: skip


def _word(hint: Any) -> str:
    if hint in _WORDS:
        return _WORDS[hint]
    if get_origin(hint) is Annotated:
        return _word(get_args(hint)[0])
    if get_origin(hint) in (Union, UnionType):
        return " or ".join(map(_word, get_args(hint)))
    if get_origin(hint) is Literal:
        return f"one of {get_args(hint)}"
    name = str(getattr(get_origin(hint) or hint, "__name__", hint)).lstrip("_")
    return f"{'an' if name[:1] in 'AEIOU' else 'a'} {name}"


def _in_turn(name: str, value: Any, checks: Sequence[Check]) -> Any:
    """What a check returns goes on to the next; what returns nothing has let the value pass."""
    for check in checks:
        kept = check(name, value)
        value = value if kept is None else kept
    return value


def _union(members: Sequence[Any]) -> Check | None:
    """None passes if it is a member; a number may be an array, if that is; else any will do."""
    left = [member for member in members if member is not NoneType]
    optional = len(left) < len(members)
    if set(left) == {float, Array}:
        found: Check | None = numbers
    elif all(_is_kind(each) and each not in _PLAIN for each in left):
        words = " or ".join(map(_word, members))
        return partial(_instance, kinds=tuple(members), words=words)
    elif len(left) == 1:
        found = by_type(left[0])
    else:
        left.sort(key=lambda each: each is float)  # a whole number stays one
        checks = [check for each in left if (check := by_type(each)) is not None]
        if len(checks) < len(left):
            return None
        found = partial(_any_of, checks=checks, words=" or ".join(map(_word, members)))
    return partial(_optional, check=found) if optional and found else found


def _optional(name: str, value: Any, check: Check) -> Any:
    return None if value is None else check(name, value)


def _any_of(name: str, value: Any, checks: Sequence[Check], words: str) -> Any:
    for check in checks:
        try:
            return check(name, value)
        except ValueError:
            continue
    raise ValueError(f"{name} must be {words}, got {shown(value)}")


def _instance(name: str, value: Any, kinds: tuple[type, ...], words: str) -> Any:
    if not isinstance(value, kinds):
        raise ValueError(f"{name} must be {words}, got {shown(value)}")
    return value


def _callable(name: str, value: Any) -> Any:
    if not callable(value):
        raise ValueError(f"{name} must be a function, got {shown(value)}")
    return value


def _tuple(inner: Sequence[Any]) -> Check | None:
    endless = len(inner) == 2 and inner[1] is Ellipsis
    if set(inner) - {Ellipsis} == {float}:
        return partial(row, shape=None if endless else (len(inner),))
    if endless:
        return partial(_sequence, each=by_type(inner[0]), kind=tuple)
    return partial(_sequence, each=[by_type(each) for each in inner], kind=tuple)


def _sequence(name: str, value: Any, each: Any, kind: type | None = None) -> Any:
    """A sequence of what ``each`` lets pass, or as many as ``each`` has checks."""
    array = isinstance(value, np.ndarray) and value.ndim and not np.ma.isMaskedArray(value)
    if not (array or isinstance(value, Sequence)) or isinstance(value, str | bytes):
        raise ValueError(f"{name} must be a sequence, got {shown(value)}")
    checks = each if isinstance(each, list) else [each] * len(value)
    if len(checks) != len(value):
        raise ValueError(f"{name} must have {len(checks)} entries, got {shown(value)}")
    pairs = enumerate(zip(checks, value, strict=True))
    found = [check(f"{name}[{i}]", item) if check else item for i, (check, item) in pairs]
    return value if kind is None else kind(found)


def _mapping(name: str, value: Any, key: Check | None, each: Check | None) -> Any:
    if not isinstance(value, Mapping):
        raise ValueError(f"{name} must be a mapping, got {shown(value)}")
    for word, item in value.items():
        if key is not None:
            key(f"keys of {name}", word)
        if each is not None:
            each(f"{name}[{word!r}]", item)
    return value
