"""The studies of docs/studies.md: what they state, by closed forms and published facts."""

import importlib
import math
from pathlib import Path

import numpy as np
import pytest

from tca_mj.model import settle
from tca_mj.rod import solve_static
from tca_mj.routes import parallel

pytest.importorskip("matplotlib")
ROOT = Path(__file__).resolve().parent.parent
GRAVITY = 9.81


@pytest.fixture
def load(monkeypatch):
    """A script as a module."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return importlib.import_module


def test_the_printed_laws_are_those_printed(load):
    s = load("studies")
    assert pytest.approx(8.149e6, rel=1e-4) == s.COMPLIANCE  # of the printed numbers, by hand
    assert s.linear_law(75.0)(0.05)[1] == pytest.approx(27.0, rel=1e-3)
    assert s.linear_law(25.0)(45e-3) == (0.0, 0.0)  # at rest when cold, unless as printed
    assert s.linear_law(25.0, ambient=None)(45e-3)[0] == pytest.approx(27.0 * 0.62e-3, rel=0.01)
    law = s.passive_law()
    assert law(44e-3) == law(45e-3) == (0.0, 0.0)
    assert law(45.001e-3)[1] == pytest.approx(0.104, rel=0.01)
    for longer in (1e-3, 30e-3, 66e-3):
        force, slope = law(45e-3 + longer)
        modulus = (37.58 * force**2 + 111.33 * force + 0.85) * 1e6
        assert s.COMPLIANCE * force / modulus == pytest.approx(longer, rel=1e-9)
        near = [law(45e-3 + longer + d)[0] for d in (-1e-8, 1e-8)]
        assert slope == pytest.approx((near[1] - near[0]) / 2e-8, rel=1e-3)
    assert pytest.approx(0.1504, abs=1e-4) == s.FOLD
    assert pytest.approx(66.4e-3, abs=1e-4) == s.LONGEST
    assert law(45e-3 + 0.999999 * s.LONGEST)[0] < s.FOLD
    with pytest.raises(ValueError, match="elongation must be below"):
        law(45e-3 + 1.0001 * s.LONGEST)


@pytest.mark.parametrize("hot", [75.0, 125.0])
def test_a_linear_antagonist_halves_the_bend_as_in_closed_form(load, hot):
    """Straight linear TCAs without load: curvature u and stretch e solve two linear equations."""
    study, s = load("study_antagonists"), load("studies")
    body, a, k = study.SPEC.body, study.SPEC.offset, s.SHEAR / s.COMPLIANCE
    length, short = body.length, s.UNTWIST * (s.untwist(hot) - s.untwist(25.0))

    def angle(count):
        """With `count` antagonists; lengths L (1 + e + u a) and L (1 + e - u a/2)."""
        cold, warm = np.array([a, 1.0]) * length, np.array([-a / 2.0, 1.0]) * length
        matrix = np.diag([body.bending[1], body.stretching]) + k / length * (
            count * np.outer(cold, cold) + 2.0 * np.outer(warm, warm)
        )
        u, _ = np.linalg.solve(matrix, 2.0 * k * warm / length * short)
        return math.degrees(abs(u)) * length

    (alone, chain), (held, chain_held) = study.larger(hot, s.linear_law, s.linear_law(25.0))
    assert alone == pytest.approx(angle(0), rel=1e-6) and chain == pytest.approx(alone, rel=1e-4)
    assert held == pytest.approx(angle(1), rel=1e-6)
    assert chain_held == pytest.approx(held, rel=1e-4)
    assert alone / held - 1.0 == pytest.approx(1.07, abs=0.005)


def test_the_printed_passive_law_leaves_hardly_an_antagonist(load):
    study, s = load("study_antagonists"), load("studies")
    (alone, chain), (held, chain_held) = study.larger(100.0, s.linear_law, s.passive_law())
    assert 100.0 * (alone / held - 1.0) == pytest.approx(1.3, abs=0.05)
    assert chain / chain_held == pytest.approx(alone / held, rel=1e-4)


@pytest.mark.parametrize("hot", [75.0, 125.0])
def test_a_small_push_moves_the_hot_module_as_in_closed_form(load, hot):
    """Small deflection of a beam that three equal linear TCAs shorten.

    The section's moment is the push's, P z (L - s), z = 1 + e, as TCAs pull from inside; theirs is
    -3/2 K a² times the tip's angle; and their tension F resists shear with 3 F/z.
    """
    study, s = load("study_stiffness"), load("studies")
    law, body, a = s.linear_law(hot), study.SPEC.body, study.SPEC.offset
    k, length, push = s.SHEAR / s.COMPLIANCE, body.length, 1e-6
    short = s.UNTWIST * (s.untwist(hot) - s.untwist(25.0))
    z = 1.0 + 3.0 * k * short / (body.stretching + 3.0 * k * length)
    bending, stiff = body.bending[1], 1.5 * k * a**2
    angle = push * z * length**2 / 2.0 / (bending + stiff * length)
    aside = z * (push * z * length**3 / 3.0 - stiff * angle * length**2 / 2.0) / bending
    sheared = push * length / (body.shearing + 3.0 * law(z * length)[0] / z)
    assert study.theory(law, push) == pytest.approx(1e3 * (aside + sheared), rel=1e-4)
    assert study.chain(law, push) == pytest.approx(
        study.theory(law, push, shearable=False), rel=0.02
    )


def test_five_millinewton_move_the_tip_less_when_it_is_hotter(load):
    study = load("study_stiffness")
    printed = [study.theory(study.LAWS["printed"](t)) for t in (75.0, 125.0)]
    assert printed == pytest.approx([14.6, 10.9], abs=0.05)
    for name in ("printed, at rest at 25 °C", "this package"):
        laws = [study.LAWS[name](t) for t in (75.0, 125.0)]
        assert study.theory(laws[1]) < 0.8 * study.theory(laws[0])
        for law in laws:
            exact = study.theory(law, shearable=False)
            assert study.chain(law) == pytest.approx(exact, rel=0.01)


def test_a_gripper_pulled_open_is_a_half_ring_of_castigliano(load):
    study = load("study_gripper")
    for body in (study.SPEC.body, study.printed_body()):
        shape = solve_static(body, [], [], tip_force=(0.0, 0.0, 1e-7))
        assert study.opening(shape) == pytest.approx(1e3 * study.softness(body) * 1e-7, rel=1e-4)


def test_the_gripping_force_is_monotone_and_nearly_linear_and_the_tca_slack(load):
    study = load("study_gripper")
    for solve, more in ((solve_static, {}), (settle, {"nodes": study.SPEC.nodes})):
        width, force = study.pulled(study.SPEC.body, solve, widest=10.0, **more)
        assert (np.diff(width) > 0.0).all() and (np.diff(force) > 0.0).all()
        assert study.bow(width, force) < 0.05
    shape = solve_static(study.SPEC.body, [study.SPEC.route], [0.0], tip_force=(0, 0, 0.04))
    assert study.half(25.0)(shape.tca_length[0]) == (0.0, 0.0)


def test_the_gripper_opens_ever_faster_with_power(load):
    study, s = load("study_gripper"), load("studies")
    power = np.array([2.0, 4.0, 6.0, 8.0])
    hot = s.heated(study.tca(), power)
    wide = [study.opening(solve_static(study.SPEC.body, [study.SPEC.route], [study.half(t)]))
            for t in hot]  # fmt: skip
    assert (np.diff(wide, 2) > 0.0).all() and wide[0] > 0.5
    assert study.powered(8.0) == pytest.approx(wide[-1], abs=0.1)


def test_the_double_helix_turns_further_only_in_a_thick_body(load):
    study = load("study_twist")
    assert study.ratio(4.5e-3) < 1.0 < study.ratio(6e-3) < study.ratio(7e-3)
    for d in (4.5e-3, 7e-3):
        assert study.ratio(d, settle) == pytest.approx(study.ratio(d, shearable=False), rel=3e-3)
    # A body that only twists: the printed stiffness of the TCA needs the 5.7 mm of the estimate.
    stiffness = 27.0 * 45e-3 / math.hypot(10.0 * math.pi * 3.5e-3, 16e-3)
    assert study.estimate(stiffness) == pytest.approx(5.65e-3, abs=0.05e-3)


def test_the_direction_is_that_of_symmetry_and_does_not_depend_on_size(load):
    study = load("study_direction")
    for laws in (study.LAWS["this package"], study.LAWS["TCA 3 printed passive"]):
        assert study.both(study.shape(laws, (0.4, 0.4)))[1] == pytest.approx(60.0, abs=1e-3)
        bends, ways = np.array([study.both(study.shape(laws, (3 * p, p))) for p in (0.2, 0.4)]).T
        assert abs(ways[0] - ways[1]) < 3.0 and bends[1] > 2.5 * bends[0]


def test_theory_and_mujoco_agree_on_the_bend_and_its_heat_with_any_law(load):
    """By the tangent, without weight; a conductance is found for the reported 120°."""
    study = load("study_direction")
    for name, angle in (("this package", 92.0), ("TCA 3 printed passive", 129.0),
                        ("all as printed", 140.0)):  # fmt: skip
        laws = study.LAWS[name]
        exact, mujoco = study.both(study.shape(laws, (2.0, 0.4))), study.chain(laws, (2.0, 0.4))
        assert exact[0] == pytest.approx(angle, abs=0.5)
        assert mujoco == pytest.approx(exact, abs=0.3)
        fitted = study.conductance_for(laws, 120.0)
        assert 0.2 < fitted < 0.5
        assert study.both(study.shape(laws, (2.0, 0.4), fitted))[0] == pytest.approx(120.0)


def test_a_heated_tca_has_two_nodes(load):
    """Against the balance of heat in small steps, and without a body against eq. (3.1)."""
    study, s = load("study_direction"), load("studies")
    heat, hot, body, dt = study.EMBEDDED.heat, 25.0, 25.0, 1e-4
    for _ in range(20000):
        into = heat.conductance * (hot - body)
        hot, body = (hot + dt * (2.0 - into) / heat.capacity,
                     body + dt * (into - heat.body_loss * (body - 25.0)) / heat.body_capacity)
    assert s.heated(study.EMBEDDED, 2.0) == pytest.approx(hot, rel=1e-4)
    bare = study.TCA.heat
    rise = 2.0 / bare.loss * -math.expm1(-2.0 * bare.loss / bare.capacity)
    assert s.heated(study.TCA, 2.0) == pytest.approx(25.0 + rise)


def test_the_arm_hangs_by_its_weight_and_as_in_mujoco(load):
    study = load("study_arm")
    case = (70, 115, 70)
    first, second = study.theory(case)
    spec = study.SPEC
    weight = [mass * GRAVITY for mass in (sum(m for m, _ in hung) for hung in study.loads())]
    last = weight[1] + spec.twisting.body.mass * GRAVITY
    whole = last + weight[0] + spec.bending.body.mass * GRAVITY
    np.testing.assert_allclose(first.base_force, (0.0, 0.0, -whole), atol=1e-8)
    np.testing.assert_allclose(second.base_force, (0.0, 0.0, -last), atol=1e-8)
    found = study.chain(case)
    reach = spec.bending.length + spec.connector + spec.twisting.length
    assert np.linalg.norm(found["place"][1] - second.tip) < 2e-3 * reach
    assert study.angles(found["turn"]) == pytest.approx(study.exact((first, second)), abs=1.0)


def test_three_equal_tcas_do_not_bend_and_angles_are_counted_beyond_half_a_turn(load):
    s = load("studies")
    body = load("study_stiffness").SPEC.body
    shape = solve_static(body, parallel(3, 4e-3), [0.02] * 3)
    assert s.bend(shape) == pytest.approx(0.0, abs=1e-6)
    pure = solve_static(body, [], [], tip_moment=(0.0, body.bending[1] * 4.0 / body.length, 0.0))
    assert s.bend(pure) == pytest.approx(math.degrees(4.0), rel=1e-6)
    turned = solve_static(body, [], [], tip_moment=(0.0, 0.0, body.torsion * 4.0 / body.length))
    assert s.twist(turned) == pytest.approx(math.degrees(4.0), rel=1e-6)


def test_the_page_has_what_the_scripts_compute(load):
    """After a change run the scripts; each writes its table into the page and its figure."""
    page = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
    for script in sorted((ROOT / "scripts").glob("study_*.py")):
        mark = f"<!-- scripts/{script.name} -->\n| "
        assert mark in page and f"pictures/{script.stem}.png" in page
    study = load("study_stiffness")
    for name, law in study.LAWS.items():
        row = f"| {name}, 75 °C | {study.theory(law(75.0)):.2f} mm |"
        assert row in page
