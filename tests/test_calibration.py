"""Surfaces that are kept: what is read, what is made anew, and where it is kept."""

import math
import multiprocessing
from dataclasses import fields, replace

import numpy as np
import pytest

import tca_mj.tca.calibration as calibration
from tca_mj.tca import CATALOGUE, calibrate
from tca_mj.tca.calibration import cache_folder, load_or_build
from tca_mj.tca.surface import build, coil_alone

FREE_STROKE = CATALOGUE["free-stroke"]
HOT_SECTION = replace(FREE_STROKE, fibre=replace(FREE_STROKE.fibre, section="hot"), ambient=20.0)
SPECS = [*CATALOGUE.values(), HOT_SECTION]


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    """Every test has an empty cache folder, and memory keeps nothing between tests."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    calibration._calibrated.cache_clear()
    yield
    calibration._calibrated.cache_clear()


def only_file(folder):
    (path,) = folder.iterdir()
    return path


def same(a, b):
    """Whether two surfaces are equal bit for bit."""
    return all(np.array_equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))


def refuse(*_):
    raise AssertionError("built anew")


def test_a_file_is_read_back_bit_for_bit(tmp_path, monkeypatch):
    built = load_or_build(FREE_STROKE, tmp_path)
    monkeypatch.setattr(calibration, "build", refuse)
    assert same(load_or_build(FREE_STROKE, tmp_path), built)
    assert same(load_or_build(FREE_STROKE.of_length(0.2), tmp_path), built)


def changed_coils():
    """The free-stroke TCA with each number changed that its tension follows from."""
    for name in ("radius", "young", "shear", "filament_young", "softening", "inserted_twist",
                 "untwist_scale", "reference_temperature"):  # fmt: skip
        value = getattr(FREE_STROKE.fibre, name)
        nearest = math.nextafter(value, math.inf)
        yield name, replace(FREE_STROKE, fibre=replace(FREE_STROKE.fibre, **{name: nearest}))
    for name, value in (("load_softening", (0.0, 0.0, 1.0)), ("section", "hot"),
                        ("expansion", (3.5e-6, -6.6e-5, 1.0)),
                        ("temperature_range", (20.0, 160.0))):  # fmt: skip
        yield name, replace(FREE_STROKE, fibre=replace(FREE_STROKE.fibre, **{name: value}))
    for name in ("coil_radius", "pitch_angle", "minimum_pitch_angle"):
        nearest = math.nextafter(getattr(FREE_STROKE, name), math.inf)
        yield name, replace(FREE_STROKE, **{name: nearest})


@pytest.mark.parametrize(("name", "spec"), list(changed_coils()))
def test_another_spec_reads_another_file(tmp_path, name, spec):
    inputs = calibration._inputs(coil_alone(spec))
    assert inputs != calibration._inputs(coil_alone(FREE_STROKE))
    assert calibrate(spec) is not calibrate(FREE_STROKE)
    assert len(list((tmp_path / "tca-mj").iterdir())) == 2


@pytest.mark.parametrize(
    ("module", "name", "value"),
    [
        (calibration, "__version__", "99.0"),
        (calibration, "_FORMAT", 99),
        (calibration.surface, "FINER", 9),
    ],
)
def test_another_version_reads_another_file(tmp_path, monkeypatch, module, name, value):
    load_or_build(FREE_STROKE, tmp_path)
    monkeypatch.setattr(module, name, value)
    load_or_build(FREE_STROKE, tmp_path)
    assert len(list(tmp_path.iterdir())) == 2


def test_another_source_of_the_law_reads_another_file(tmp_path, monkeypatch):
    load_or_build(FREE_STROKE, tmp_path)
    edited = tmp_path / "edited.py"
    edited.write_text("# another law")
    monkeypatch.setattr(calibration.coilrod, "__file__", str(edited))
    load_or_build(FREE_STROKE, tmp_path)
    assert len(list(tmp_path.glob("*.bin"))) == 2


def test_an_edited_law_in_use_reads_another_file(tmp_path, monkeypatch):
    """The source may not be what runs: the rod's answers count, too."""
    load_or_build(FREE_STROKE, tmp_path)
    growth = calibration.coilrod.untwist
    monkeypatch.setattr(calibration.coilrod, "untwist", lambda f, t: 1.001 * growth(f, t))
    load_or_build(FREE_STROKE, tmp_path)
    assert len(list(tmp_path.glob("*.bin"))) == 2


def test_a_file_under_the_wrong_name_is_not_read(tmp_path):
    """The inputs stand in the file, too."""
    load_or_build(FREE_STROKE, tmp_path)
    path = only_file(tmp_path)
    content = path.read_bytes()
    path.unlink()
    built = load_or_build(HOT_SECTION, tmp_path)
    only_file(tmp_path).write_bytes(content)
    assert same(load_or_build(HOT_SECTION, tmp_path), built)
    assert only_file(tmp_path).read_bytes() != content


@pytest.mark.parametrize("damage", ["empty", "cut", "one bit", "text"])
def test_a_damaged_file_is_made_again(tmp_path, damage):
    built = load_or_build(FREE_STROKE, tmp_path)
    path = only_file(tmp_path)
    good = path.read_bytes()
    flipped = bytearray(good)
    flipped[len(good) // 2] ^= 1
    bad = {"empty": b"", "cut": good[:-9], "one bit": bytes(flipped), "text": b"no table\n" * 99}
    path.write_bytes(bad[damage])
    assert same(load_or_build(FREE_STROKE, tmp_path), built)
    assert only_file(tmp_path).read_bytes() == good


def test_no_place_to_write_is_no_error(tmp_path, monkeypatch):
    built = build(FREE_STROKE)
    (tmp_path / "a file").write_text("not a folder")
    assert same(load_or_build(FREE_STROKE, tmp_path / "a file"), built)
    assert same(load_or_build(FREE_STROKE, None), built)

    def full(*_):
        raise OSError("disk full")

    monkeypatch.setattr(calibration.os, "replace", full)
    assert same(load_or_build(FREE_STROKE, tmp_path / "new"), built)
    assert list((tmp_path / "new").iterdir()) == []  # nothing half written is left


def test_the_folder_is_the_users(tmp_path, monkeypatch):
    assert cache_folder() == tmp_path / "tca-mj"
    monkeypatch.setenv("XDG_CACHE_HOME", "not/absolute")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(calibration.sys, "platform", "linux")
    assert cache_folder() == tmp_path / "home" / ".cache" / "tca-mj"
    monkeypatch.setattr(calibration.sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert cache_folder() == tmp_path / "local" / "tca-mj" / "Cache"

    def homeless():
        raise RuntimeError

    monkeypatch.delenv("LOCALAPPDATA")
    monkeypatch.setattr(calibration.Path, "home", homeless)
    assert cache_folder() is None


def calibrate_in(folder, barrier, results):
    barrier.wait()
    surfaces = [load_or_build(spec, folder) for spec in SPECS[:3] * 3]
    results.put([surface.tension.tobytes() for surface in surfaces[:3]])


def test_two_processes_at_once(tmp_path):
    context = multiprocessing.get_context("spawn")
    barrier, results = context.Barrier(2), context.Queue()
    arguments = (tmp_path, barrier, results)
    workers = [context.Process(target=calibrate_in, args=arguments) for _ in range(2)]
    for worker in workers:
        worker.start()
    first, second = results.get(timeout=60), results.get(timeout=60)
    for worker in workers:
        worker.join()
        assert worker.exitcode == 0
    assert first == second == [build(spec).tension.tobytes() for spec in SPECS[:3]]
    assert len(list(tmp_path.iterdir())) == 3
