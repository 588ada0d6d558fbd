"""A published fact, what the model gives for it, and the verdict, which follows from numbers.

Facts are of two kinds. A *check* has a band, and the model's value lies in it or not. A *trend* has
a sign or an order only, because the measured curve behind it was not published. A fact that fixed
a constant of the model is *fitted*, whatever its value: agreement with it proves nothing.

``facts.toml`` holds what is printed and how it is told; ``finding`` judges one fact of it.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from tca_mj import pages

# What the numbers say of a fact; see the top of this file.
Verdict = Literal["held", "missed", "trend held", "trend missed", "fitted", "not covered"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
_UNKNOWN = "No reason is known."


@dataclass(frozen=True, slots=True)
class Finding:
    """One row of a report.

    Attributes:
        source: Where the fact is printed: section or table of Sun, dissertation, Colorado State
            University.
        fact: What it is about, and the case.
        published: What is printed.
        band: What the model must give to hold it.
        model: What the model gives.
        verdict: See the top of this file.
        reason: Why it is missed, to what it was fitted, or what limits the statement.
        value: The number that was judged, in the unit of ``model``; None if there is no single one.
    """

    source: str
    fact: str
    published: str
    band: str
    model: str
    verdict: Verdict
    reason: str = ""
    value: float | None = None

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(f"verdict must be one of {VERDICTS}, got {self.verdict!r}")
        if not self.verdict.endswith("held") and not self.reason:
            raise ValueError(f"reason must say why {self.fact!r} is {self.verdict}, got none")


def check(
    source: str, fact: str, published: str, value: float, low: float, high: float, unit: str, *,
    digits: int = 1, reason: str = "", note: str = "",
) -> Finding:
    """A fact with a band: held if low <= value <= high.

    Args:
        source: As in ``Finding``.
        fact: As in ``Finding``.
        published: As in ``Finding``.
        value: What the model gives, in ``unit``.
        low: Lower end of the band; -inf if there is none.
        high: Upper end; inf if there is none.
        unit: Unit of the three.
        digits: Decimals that are printed.
        reason: Said only if the fact is missed; by default that none is known.
        note: Said in any case.

    Raises:
        ValueError: If the band is empty or is all numbers.
    """
    if not (low < high and (low > -math.inf or high < math.inf)):
        raise ValueError(f"band must hold some numbers and not all, got {low} to {high}")
    least, most, model = (f"{number:.{digits}f}" for number in (low, high, value))
    band = f"{least} to {most} {unit}"
    if low == -math.inf:
        band = f"at most {most} {unit}"
    elif high == math.inf:
        band = f"at least {least} {unit}"
    return trend(source, fact, published, band, f"{model} {unit}", low <= value <= high,
                 reason=reason, note=note, value=float(value), strict=True)  # fmt: skip


def trend(
    source: str, fact: str, published: str, order: str, model: str, held: bool, *,
    reason: str = "", note: str = "", value: float | None = None, strict: bool = False,
) -> Finding:
    """A fact with a sign or an order.

    Args:
        source: As in ``Finding``.
        fact: As in ``Finding``.
        published: As in ``Finding``.
        order: The order that is asked for.
        model: The model's numbers.
        held: Whether they have it.
        reason: Said only if not; by default that none is known.
        note: Said in any case.
        value: As in ``Finding``.
        strict: Whether the order is all that the source states, so that it is a check.
    """
    verdict: Verdict = "trend held" if held else "trend missed"
    if strict:
        verdict = "held" if held else "missed"
    said = " ".join(part for part in (note, "" if held else reason or _UNKNOWN) if part)
    return Finding(source, fact, published, order, model, verdict, said, value)


def fitted(
    source: str, fact: str, published: str, model: str, to: str, *, value: float | None = None
) -> Finding:
    """A fact that fixed a constant; ``to`` says which constant."""
    return Finding(source, fact, published, "-", model, "fitted", to, value)


def not_covered(source: str, fact: str, published: str, reason: str) -> Finding:
    """A fact that needs something that is not in these models."""
    return Finding(source, fact, published, "-", "-", "not covered", reason)


@cache
def _file() -> dict[str, dict[str, Any]]:
    """Tables of ``facts.toml``, each text on one line, read once."""
    tables = tomllib.loads(Path(__file__).with_name("facts.toml").read_text(encoding="utf-8"))
    return {key: {name: " ".join(cell.split()) if isinstance(cell, str) else cell
                  for name, cell in rows.items()} for key, rows in tables.items()}  # fmt: skip


def words(key: str, **fields: Any) -> str:
    """A text of ``facts.toml`` that is no fact, from its table ``words``, filled with fields."""
    text: str = _file()["words"][key].format(**fields)
    return text


def finding(
    key: str, value: float | None = None, held: bool | None = None, **fields: Any
) -> Finding:
    """A fact of ``facts.toml``, judged.

    The keys of its table are arguments of ``check`` if it has a unit, of ``trend`` if it has an
    order, of ``fitted`` if it says to what, and otherwise of ``not_covered``.

    Args:
        key: Name of the table.
        value: What the model gives, in the unit of the fact; only a check needs it.
        held: Whether a trend is there.
        fields: What fills the texts, as in ``str.format``, besides ``value``; ``low`` and ``high``
            are the band of a check where the file has none.

    Raises:
        KeyError: If there is no such table, or a text names a field that is not given.
        ValueError: As ``check``; or if the value of a check or the outcome of a trend is missing.
    """
    row = _file()[key]
    told: dict[str, Any] = {
        name: cell.format(value=value, **fields) if isinstance(cell, str) else cell
        for name, cell in row.items()
    }
    if "to" in row:
        return fitted(**told, value=value)
    if "order" in row:
        if held is None:
            raise ValueError(f"held must say whether {key!r} is, got none")
        return trend(**told, held=held, value=value)
    if "unit" in row:
        if value is None:
            raise ValueError(f"value must be what the model gives for {key!r}, got none")
        band = {"low": -math.inf, "high": math.inf} | fields | told
        return check(**told | {name: band[name] for name in ("low", "high")}, value=value)
    return not_covered(**told)


def table(findings: Iterable[Finding]) -> str:
    """The findings as a table in Markdown, reasons not included: see ``reasons``.

    Args:
        findings: The rows.
    """
    rows = []
    for row in findings:
        verdict = f"**{row.verdict}**" if "missed" in row.verdict else row.verdict
        cells = (row.source, row.fact, row.published, row.band, row.model, verdict)
        rows.append([cell.replace("|", "/") for cell in cells])
    heads = ["source", "fact", "published", "band", "model", "verdict"]
    return "\n".join(pages.table(heads, rows))


def reasons(findings: Iterable[Finding]) -> str:
    """What there is to say about single rows, as a list in Markdown; equal reasons once."""
    said: dict[str, list[str]] = {}
    for row in findings:
        if row.reason:
            said.setdefault(row.reason, []).append(f"*{row.fact}* ({row.verdict})")
    return "\n".join(f"* {'; '.join(rows)}: {reason}" for reason, rows in said.items())


def tally(findings: Sequence[Finding]) -> dict[Verdict, int]:
    """Number of findings by verdict."""
    return {verdict: sum(row.verdict == verdict for row in findings) for verdict in VERDICTS}
