"""Several strands as one TCA: side by side they are single TCAs in parallel, to rounding; wound
round each other they pull as their energy says."""

import math
from dataclasses import replace

import numpy as np
import pytest

import tca_mj
from tca_mj.certify.robots import certify_robot
from tca_mj.modules.bending import silicone_cylinder
from tca_mj.tca import (
    CATALOGUE,
    CoilRods,
    CreepBank,
    Load,
    LoadedTcas,
    Plies,
    TcaBank,
    calibrate,
    coil_tension,
    hanging_length,
    law_at,
    tension,
)

ONE = CATALOGUE["free-stroke"]
THREE = replace(ONE, plies=Plies(strands=3))
ROPE = replace(ONE, plies=Plies(strands=2, lay_angle=0.4))
HOT = np.array([25.0, 90.0, 160.0])


def bender(tca, times=1):
    """A soft cylinder that `times` TCAs on one route bend."""
    part = tca_mj.Part(tca_mj.new_spec("bender"))
    chain = tca_mj.add_chain(part, silicone_cylinder(45e-3, 8e-3, 8e-3), nodes=6, name="body")
    for _ in range(times):
        tca_mj.add_tca(part, chain, tca_mj.Helix(3e-3), tca)
    return part


def test_strands_side_by_side_are_tcas_in_parallel_in_mujoco():
    """Every TCA is 1e-10 N tauter than its law, which is the largest difference there is."""
    each = tca_mj.Simulation(bender(ONE, 3))
    all_in_one = tca_mj.Simulation(bender(THREE))
    for power in (0.6, 2.4, 0.0):
        each.step(np.full(3, power / 3.0), 1.5)
        all_in_one.step([power], 1.5)
        assert abs(each.data.qpos).max() > 1e-3
        np.testing.assert_allclose(all_in_one.data.qpos, each.data.qpos, rtol=0, atol=1e-8)
        np.testing.assert_allclose(all_in_one.tension, each.tension.sum(), rtol=0, atol=3e-10)
        np.testing.assert_allclose(all_in_one.temperature, each.temperature[0], rtol=1e-9)
        for name in ("energy_in", "energy_lost"):
            energy = getattr(each.tca, name).sum()
            np.testing.assert_allclose(getattr(all_in_one.tca, name), energy, rtol=1e-12)
        conductance = (1.0 / each.resistance).sum()
        np.testing.assert_allclose(1.0 / all_in_one.resistance, conductance, rtol=1e-8)
    assert all_in_one.model.body_mass.sum() == pytest.approx(each.model.body_mass.sum(), rel=1e-14)


@pytest.mark.parametrize("law", ["rod", "surface"])
def test_a_bank_has_three_times_everything_but_length_and_temperature(law):
    one, three = TcaBank([ONE], law), TcaBank([THREE], law)
    for name in ("rest_length", "minimum_length", "shortest", "longest"):
        np.testing.assert_allclose(getattr(three, name), getattr(one, name), rtol=1e-15)
    length = np.linspace(1.01 * one.shortest[0], 0.99 * one.longest[0], 9)[:, None]
    for temperature in HOT:
        state = one.steady(np.full_like(length, temperature))[0]
        alone, together = one.pull(state, length), three.pull(state, length)
        np.testing.assert_allclose(together.tension, 3.0 * alone.tension, rtol=1e-12)
        np.testing.assert_allclose(together.stiffness, 3.0 * alone.stiffness, rtol=1e-12)
    state = one.rest((9,))
    stretched = length[one.resistance(state, length, strict=False)[:, 0] > 0.0][:5]
    state = one.rest((len(stretched),))
    np.testing.assert_allclose(
        three.resistance(state, stretched), one.resistance(state, stretched) / 3.0, rtol=1e-14
    )
    hot, lost = three.warmed(three.rest(), [3.0], three.rest_length, 2.0), one.warmed(
        one.rest(), [1.0], one.rest_length, 2.0
    )  # fmt: skip
    np.testing.assert_allclose(hot.temperature, lost.temperature, rtol=1e-13)
    kept = three.energy_stored(hot) + hot.energy_lost
    np.testing.assert_allclose(kept, hot.energy_in, rtol=1e-13)
    assert three.breaking_force == pytest.approx(3.0 * 0.78)
    assert THREE.mass == pytest.approx(3.0 * ONE.mass) and THREE.strand == ONE


def test_statics_share_the_load():
    load = np.array([0.0, 0.2, 0.5])
    for spin in ("locked", "free"):
        for model in ("rod", "love", "cst"):
            how = {"spin": spin, "model": model}
            alone = hanging_length(ONE, HOT, load, **how)
            shared = hanging_length(THREE, HOT, 3.0 * load, **how)
            np.testing.assert_allclose(shared, alone, rtol=1e-14)
            pulled = tension(THREE, alone, HOT, **how)[0]
            np.testing.assert_allclose(pulled, 3.0 * load, rtol=1e-8, atol=1e-9)
    lifting = LoadedTcas([THREE], Load.weight(0.09))
    single = LoadedTcas([ONE], Load.weight(0.03))
    np.testing.assert_allclose(lifting.rest().length, single.rest().length, rtol=1e-10)


def test_wound_strands_pull_as_their_energy_says():
    """Work on the TCA = work on its strands, at any temperature; and dF/dl is the slope."""
    rods, wound = CoilRods([ONE]), ROPE.wound
    length = np.linspace(1.02 * ROPE.minimum_length, 2.0 * ROPE.rest_length, 4001)
    strand = np.hypot(length, wound)
    for temperature in HOT:
        pull, slope = tension(ROPE, length, temperature)
        single, _ = rods.tension(strand[:, None], np.full((4001, 1), temperature))
        work, theirs = np.trapezoid(pull, length), np.trapezoid(2.0 * single[:, 0], strand)
        assert work == pytest.approx(theirs, rel=1e-6)
        np.testing.assert_allclose(np.gradient(pull, length)[1:-1], slope[1:-1], rtol=1e-4)
        state = TcaBank([ROPE]).steady([temperature])[0]
        at = np.array([1.3 * ROPE.rest_length])
        exact = tension(ROPE, at, temperature)
        assert TcaBank([ROPE]).pull(state, at).tension == pytest.approx(exact[0], rel=1e-12)
        assert TcaBank([ROPE], "surface").pull(state, at).tension == pytest.approx(
            exact[0], rel=calibrate(ONE).bound.relative, abs=1e-4
        )
        assert law_at(ROPE, temperature)(at)[0] == pytest.approx(np.maximum(exact[0], 0.0))


def test_a_rope_hangs_where_its_tension_is_the_load():
    load = np.array([0.05, 0.4, 1.2])
    for spin in ("locked", "free"):
        length = hanging_length(ROPE, HOT, load, spin=spin)
        np.testing.assert_allclose(tension(ROPE, length, HOT, spin=spin)[0], load, rtol=1e-9)


def test_a_rope_is_shorter_and_strokes_more_than_its_strands():
    """sin of the touching strands' angle: their winding over their length. By hand."""
    assert ROPE.rest_length == pytest.approx(45e-3 * math.cos(0.4), rel=1e-12)
    touching = math.sqrt(ONE.minimum_length**2 - (45e-3 * math.sin(0.4)) ** 2)
    assert ROPE.minimum_length == pytest.approx(touching, rel=1e-12)
    assert ROPE.free_stroke > ONE.free_stroke
    half = ROPE.of_length(20e-3)
    assert half.rest_length == pytest.approx(20e-3, rel=1e-12) and half.plies == ROPE.plies
    crept = ROPE.of_pitch(0.35)
    assert crept.wound == pytest.approx(ROPE.wound, rel=1e-12)
    assert crept.minimum_length == pytest.approx(ROPE.minimum_length, rel=1e-12)
    assert ROPE.outer_radius == pytest.approx(2.0 * ONE.outer_radius)
    bank = TcaBank([ROPE])  # R of a strand that is 1 % longer, by the cold slope; two conduct
    at = np.array([math.sqrt((1.01 * 45e-3) ** 2 - ROPE.wound**2)])
    ohms = 0.5 * ONE.resistance_per_length * 45e-3 * (1.0 - 0.01 * ONE.stretch_resistance)
    assert bank.resistance(bank.rest(), at) == pytest.approx(ohms, rel=1e-5)


def test_the_law_of_ones_own_is_that_of_a_strand():
    seen = []

    def own(specs):
        seen.extend(specs)
        return CoilRods(specs)

    bank = TcaBank([ROPE, ONE], own)
    assert seen == [ONE, ONE]
    state, length = bank.steady([90.0, 90.0])[0], 1.2 * bank.rest_length
    rods = TcaBank([ROPE, ONE], "rod")
    np.testing.assert_array_equal(
        bank.pull(state, length).tension, rods.pull(state, length).tension
    )


def test_a_robot_of_plied_tcas_is_certified():
    result = certify_robot(bender(ROPE), hot=110.0)
    assert result["within"], result["text"]


@pytest.mark.parametrize(
    ("plies", "said"),
    [
        ({"strands": 1}, "strands must be at least 2, got 1"),
        ({"strands": 2.0}, "strands must be a whole number, got 2.0"),
        ({"strands": 2, "lay_angle": -0.1}, "lay_angle must be .*at least 0 .*, got -0.1"),
        ({"strands": 2, "lay_angle": 20.0}, "lay_angle must be .*below 0.785398 rad, got 20"),
    ],
)
def test_what_are_no_plies_is_refused(plies, said):
    with pytest.raises(ValueError, match=said):
        Plies(**plies)


def test_what_knows_single_coils_only_says_so():
    with pytest.raises(ValueError, match=r"plies.lay_angle must be .*below 0.69\d* rad"):
        replace(ONE, plies=Plies(strands=2, lay_angle=0.75))  # the strands lie across at contact
    for call in (lambda: CoilRods([THREE]), lambda: coil_tension(THREE, 0.05, 25.0),
                 lambda: CreepBank([THREE])):  # fmt: skip
        with pytest.raises(ValueError, match="specs must be single coils .*got Plies"):
            call()
