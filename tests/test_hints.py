"""Slips of a user: another unit, degrees, a name that is none, several routes where one belongs."""

import math
from dataclasses import replace
from functools import partial

import pytest

import tca_mj
from tca_mj import (
    CATALOGUE,
    ArmSpec,
    BendingSpec,
    FingerPairSpec,
    Helix,
    LegSpec,
    MorphingSpec,
    Outline,
    Part,
    TcaSpec,
    TetrapodSpec,
    TwistingSpec,
    UTurn,
    add_chain,
    add_tca,
    hints,
    leg_length,
    new_spec,
    parallel,
)
from tca_mj.assets import mjcf
from tca_mj.model import lay_tca, path_length, route_passes, settle
from tca_mj.modules import silicone_cylinder, straight_module
from tca_mj.rod import solve_static
from tca_mj.smp import SmpSpec, SpineSpec
from tca_mj.tca import FREE_STROKE_CREPT, MODULE_TCAS

TCA = CATALOGUE["free-stroke"]
BEAM = silicone_cylinder(45e-3, 4.5e-3, 9e-3)
FIBRE = partial(replace, TCA.fibre)
MANDREL = {"fibre": TCA.fibre, "fibre_length": 0.35, "core_diameter": 1.3e-3,
           "groove_pitch_angle": 0.4, "resistance_per_length": 67.0}  # fmt: skip


def mandrel(**change):
    return TcaSpec.from_mandrel(**{**MANDREL, **change})


@pytest.mark.parametrize(
    ("make", "field", "typed", "meant"),
    [
        (mandrel, "core_diameter", 1.3, "0.0013 m"),
        (mandrel, "fibre_length", 350, "0.35 m"),
        (mandrel, "groove_pitch_angle", 22.9, "0.3997 rad"),
        (mandrel, "minimum_pitch_angle", 11.5, "0.2007 rad"),
        (FIBRE, "radius", 0.21, "0.00021 m"),
        (FIBRE, "radius", 210, "0.00021 m"),
        (FIBRE, "young", 1.2, "1.2e+09 Pa"),
        (FIBRE, "line_density", 117, "0.000117 kg/m"),
        (lambda **change: replace(TCA, **change), "coil_radius", 0.427, "0.000427 m"),
        (lambda **change: replace(TCA, **change), "fibre_length", 175.0, "0.175 m"),
        (lambda **change: replace(TCA, **change), "pitch_angle", 14.9, "0.2601 rad"),
        (TCA.of_length, "rest_length", 45, "0.045 m"),
        (TCA.of_pitch, "pitch_angle", 15, "0.2618 rad"),
        (BendingSpec, "length", 45, "0.045 m"),
        (BendingSpec, "diameter", 4.5, "0.0045 m"),
        (BendingSpec, "outer_diameter", 9.0, "0.009 m"),
        (BendingSpec, "offset", 4, "0.004 m"),
        (TwistingSpec, "length", 16, "0.016 m"),
        (TwistingSpec, "radius", 3.5, "0.0035 m"),
        (TwistingSpec, "tube", 3.2, "0.0032 m"),
        (FingerPairSpec, "core", 3, "0.003 m"),
        (FingerPairSpec, "half_width", 1.5, "0.0015 m"),
        (FingerPairSpec, "layer_young", 0.25, "2.5e+05 Pa"),
        (FingerPairSpec, "closure", 180.0, "3.142 rad"),
        (LegSpec, "rod_diameter", 0.5, "0.0005 m"),
        (LegSpec, "plate_thickness", 1, "0.001 m"),
        (LegSpec, "foot_mass", 0.56, "0.00056 kg"),
        (MorphingSpec, "mass", 3.5, "0.0035 kg"),
        (MorphingSpec, "tip_mass", 15, "0.015 kg"),
        (SpineSpec, "length", 115, "0.115 m"),
        (SpineSpec, "thickness", 2.5, "0.0025 m"),
        (SmpSpec, "glassy", 2.5, "2.5e+09 Pa"),
        (SmpSpec, "rubbery", 6, "6e+06 Pa"),
        (ArmSpec, "connector", 1.5, "0.0015 m"),
        (ArmSpec, "height", 140, "0.14 m"),
        (ArmSpec, "travel", (70, 180), "0.18 m"),
        (ArmSpec, "speed", 40.0, "0.04 m/s"),
        (TetrapodSpec, "spacing", 40, "0.04 m"),
        (TetrapodSpec, "memory_angle", 20, "0.3491 rad"),
        (lambda radius: Helix(radius), "radius", 3, "0.003 m"),
        (lambda radius: parallel(3, radius), "radius", 3, "0.003 m"),
        (lambda half_width: Outline(half_width, half_width), "half_width", 4.5, "0.0045 m"),
        (lambda length: replace(BEAM, length=length), "length", 45, "0.045 m"),
    ],
)
def test_another_unit_is_refused_with_the_number_that_was_meant(make, field, typed, meant):
    with pytest.raises(ValueError) as error:
        make(**{field: typed})
    assert str(error.value).startswith(f"{field} must be ")
    assert str(error.value).endswith(f"; did you mean {meant}?")
    make(**{field: float(meant.split()[0]) if field != "travel" else (0.07, 0.18)})


def test_what_no_slip_explains_gets_no_hint():
    for value, said in ((-45, "above 0, got -45"), (0, "above 0, got 0"), (1e9, "got 1000000000.0"),
                        (math.nan, "got nan"), ("45", "got '45'")):  # fmt: skip
        with pytest.raises(ValueError, match=rf"length must .*{said}$"):
            BendingSpec(length=value)
    assert BendingSpec(length=2.0).length == 2.0  # the bound itself


@pytest.mark.parametrize(
    ("call", "error", "said"),
    [
        (lambda: CATALOGUE["free-strok"], KeyError, "'type-2-200'.*did you mean 'free-stroke'"),
        (lambda: FREE_STROKE_CREPT["30"], KeyError, "did you mean '30 g'"),
        (lambda: MODULE_TCAS["grip"], KeyError, "did you mean 'gripper'"),
        (lambda: straight_module("x", BEAM, 8, "free strok", {"a": Helix(3e-3)}), ValueError,
         "one of .*'self-coiled'.*did you mean 'free-stroke'"),
        (lambda: tca_mj.make("TCA/TetrapodWlk-v0"), ValueError, "one of .*TetrapodWalk-v0"),
        (lambda: mjcf("pbc.xml"), ValueError, "did you mean 'pcb.xml'"),
        (lambda: tca_mj.agents.policies.find("tetrapod-wlk"), FileNotFoundError,
         "did you mean 'tetrapod-walk'"),
        (lambda: tca_mj.agents.designed(BendingSpec(), {"lenght": 0.05}), ValueError,
         "did you mean 'length'"),
        (lambda: tca_mj.agents.designed(BendingSpec(), {"tca": "type-2-20"}), ValueError,
         "did you mean 'type-2-200'"),
        (lambda: tca_mj.make("TCA/BendReach-v0").reset(options={"targe": 1}), ValueError,
         "did you mean 'target'"),
    ],
)  # fmt: skip
def test_a_name_that_is_none_is_answered_with_those_that_are(call, error, said):
    with pytest.raises(error, match=said):
        call()


def test_the_catalogue_is_still_a_mapping():
    assert "free-strok" not in CATALOGUE and CATALOGUE.get("free-strok") is None
    assert dict(CATALOGUE)["free-stroke"] is TCA
    with pytest.raises(TypeError):
        CATALOGUE["mine"] = TCA


def chain():
    part = Part(new_spec("x"))
    return part, add_chain(part.spec.worldbody, BEAM, nodes=8, name="b")


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: add_tca(*chain(), parallel(3, 3e-3), TCA), "route must be a Helix .* several"),
        (lambda: add_tca(*chain(), (3e-3, 0.0), TCA), r"route must be a Helix .* got \(0.003"),
        (lambda: route_passes(chain()[1], parallel(3, 3e-3)), "route must be .* several"),
        (lambda: leg_length(parallel(3, 3e-3), 45e-3), "leg must be .* several"),
        (lambda: leg_length(UTurn.parallel(1e-3, 1e-3), 45e-3), "one leg, got a route with 2"),
        (lambda: lay_tca(chain()[0].spec, TCA, parallel(3, 3e-3), name="x"), "passes must be"),
        (lambda: path_length(Helix(3e-3)), r"passes must be those of route_passes\("),
        (lambda: solve_static(BEAM, Helix(3e-3), [0.01]), "routes must be a sequence"),
        (lambda: solve_static(BEAM, [parallel(3, 3e-3)], [0.01]), r"routes\[0\] must .* several"),
        (lambda: settle(BEAM, [parallel(3, 3e-3)], [0.01], nodes=4), r"routes\[0\] .* several"),
        (lambda: straight_module("x", BEAM, 8, TCA, parallel(3, 3e-3)), "routes must be .* names"),
    ],
)  # fmt: skip
def test_what_is_no_route_is_refused_in_words(call, said):
    with pytest.raises(ValueError, match=said):
        call()


def test_the_hints_themselves():
    assert hints.nearest("wlk", ["walk", "crawl"]) == "; did you mean 'walk'?"
    assert hints.nearest("zzz", ["walk"]) == hints.nearest(3, ["walk"]) == ""
    assert hints.size("x", 0.5, kind="boxes", at_most=0.5) == 0.5
    assert hints.angle("x", 1.5, below=math.pi / 2) == 1.5
    assert hints.modulus("x", 100.0) == 100.0
