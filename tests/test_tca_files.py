"""TCAs as files: nothing is lost, and what is no such file is refused with what is wrong."""

import math
import re
from dataclasses import fields, replace

import pytest

from tca_mj import BendingSpec
from tca_mj.tca import (
    CATALOGUE,
    BodyHeat,
    FibreSpec,
    Plies,
    Source,
    TcaFile,
    TcaSpec,
    find_tca,
    read_tca,
    write_tca,
)
from tca_mj.tca import files as tca_files

FREE_STROKE = CATALOGUE["free-stroke"]
ODD = replace(  # numbers that need all their digits, and a body
    BendingSpec().embedded, coil_radius=0.1 * 0.0043, heat_loss=math.pi / 40.0,
    fibre=replace(FREE_STROKE.fibre, young=1e10 / 9.0, section="hot"), breaking_force=None,
    plies=Plies(strands=3, lay_angle=1.0 / 7.0),
)  # fmt: skip
KINDS = (FibreSpec, "fibre."), (TcaSpec, ""), (BodyHeat, "body."), (Plies, "plies.")
SOURCES = {
    "fibre.young": Source(kind="fitted", error=1e7 / 3.0, data="pull.csv"),
    "fibre.expansion": Source(kind="published", error=(1e-7, 1e-6, 0.0), data="Sun, 3.1.2"),
    "fibre.line_density": Source(kind="weighed"), "heat_loss": Source(kind="estimate"),
}  # fmt: skip


@pytest.fixture
def path(tmp_path):
    return tmp_path / "mine.json"


@pytest.mark.parametrize("spec", [*CATALOGUE.values(), ODD])
def test_no_digit_is_lost(spec, path):
    assert write_tca(path, spec, SOURCES, note="die blaue Rolle, 20 °C") == path
    assert read_tca(path) == TcaFile(spec=spec, provenance=SOURCES, note="die blaue Rolle, 20 °C")
    content = path.read_bytes()
    found = read_tca(path)
    assert write_tca(path, found.spec, found.provenance, found.note).read_bytes() == content


def test_units_are_those_of_the_docstrings():
    """Every number of the specifications has a unit in a file, and it is the documented one."""
    documented = {}
    for kind, before in KINDS:
        for name in (field.name for field in fields(kind)):
            rows = rf"^ +{name}: (.*?)(?=^ {{8}}\w+: |\Z|^ *$)"
            about = re.search(rows, kind.__doc__, re.MULTILINE | re.DOTALL)
            documented[before + name] = re.findall(r"\[([^\[\]]+)\]", about[1])[-1:]
    for part in ("fibre", "body", "plies"):
        del documented[part]
    units = tca_files._UNITS
    assert units.keys() == documented.keys()
    for name in documented.keys() - {"fibre.section", "fibre.load_softening", "fibre.expansion"}:
        assert documented[name] == [units[name]], name


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"Pa"', '"MPa"', r"unit of fibre\.young must be Pa, got 'MPa'"),
        ('"unit": "m"', '"unit": "mm"', r"unit of fibre\.radius must be m, got 'mm'"),
        ('"value": 0.175,', '"value": 175,', r"fibre_length must be at most 10 m .* mean 0\.175"),
        ('"value": 0.00021,', '"value": 210.0,', r"fibre\.radius must be at most 0\.005 m"),
        ("1200000000.0", "NaN", "finite numbers, got NaN"),
        ("1200000000.0", "1e999", r"fibre\.young must be finite"),
        ("1200000000.0", '"1.2e9"', r"fibre\.young must be a real number"),
        ("1200000000.0", "true", r"fibre\.young must be a real number"),
        ("1200000000.0", "[1.2e9]", r"fibre\.young must be one finite number"),
        ('"fibre.young"', '"fibre.yuong"', "got 'fibre.yuong'; did you mean 'fibre.young'"),
        ('"ambient"', '"heat_loss"', "got 'heat_loss' twice"),
        ('  "ambient": {"value": 25.0, "unit": "°C"},\n', "", r"values must have 'ambient' \[°C\]"),
        ('"value": 25.0, ', "", "fibre.reference_temperature must have 'value', it is missing"),
        ("tca-mj TCA 1", "tca-mj TCA 2", "format must be 'tca-mj TCA 1', got 'tca-mj TCA 2'"),
        ('"note": ""', '"nota": ""', "got 'nota'; did you mean 'note'"),
        ('"note": ""', '"note": 3', "note must be a text, got 3"),
        ('"kind": "fitted"', '"kind": "guessed"', r"fibre\.young: kind must be one of"),
        ('"kind": "fitted", ', "", "fibre.young must have 'kind', it is missing"),
        ('"error": 5.0', '"error": -5.0', r"fibre\.young: error must be .*at least 0, got -5"),
        ('"error": 5.0', '"error": [5.0]', r"provenance\['fibre.young'\].error must have the form"),
        ('"value": "cold"', '"value": "warm"', r"fibre\.section must be one of"),
        ("}}\n", "}\n", "Expecting"),
        ("{", "[" * 5000 + "{", "recursion"),
        ("{", " " * 2**20 + "{", "at most 1048576 bytes"),
    ],
)  # fmt: skip
def test_what_is_no_tca_is_refused_with_what_is_wrong(old, new, said, path):
    write_tca(path, FREE_STROKE, {"fibre.young": Source(kind="fitted", error=5.0)})
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=f"mine.json is no TCA: .*{said}"):
        read_tca(path)


def test_a_part_of_a_body_is_refused(path):
    write_tca(path, ODD)
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(line for line in lines if "body.loss" not in line), encoding="utf-8")
    with pytest.raises(ValueError, match=r"values must have 'body.loss' \[W/\(m K\)\]"):
        read_tca(path)
    path.write_bytes(b"\xff\xfe\0")
    with pytest.raises(ValueError, match="is no TCA"):
        read_tca(path)
    with pytest.raises(FileNotFoundError):
        read_tca(path.with_name("none.json"))


def test_sources_are_of_numbers_that_there_are(path):
    for name in ("fibre.yuong", "body.loss"):
        with pytest.raises(ValueError, match=f"provenance must be of .*, got '{name}'"):
            write_tca(path, FREE_STROKE, {name: Source(kind="weighed")})
    for error in (1.0, (1.0, 2.0)):
        with pytest.raises(ValueError, match=r"error must have the form of the value \(3.5e-06"):
            write_tca(path, FREE_STROKE, {"fibre.expansion": Source(kind="fitted", error=error)})
    with pytest.raises(ValueError, match=r"path must end in .json, got .*mine.csv"):
        write_tca(path.with_suffix(".csv"), FREE_STROKE)
    assert not path.exists()


def test_a_tca_is_found_by_name_and_file(path):
    write_tca(path, ODD)
    assert find_tca(path) == find_tca(str(path)) == find_tca(ODD) == ODD
    assert find_tca("free-stroke") is FREE_STROKE
    with pytest.raises(ValueError, match="got 'free-strok'; did you mean 'free-stroke'"):
        find_tca("free-strok")
