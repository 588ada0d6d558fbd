"""Facts of the modules: eq. (4.1) by closed forms, and verdicts that follow from numbers."""

import math

import numpy as np
import pytest

from tca_mj.modules.bending import BendingSpec
from tca_mj.modules.bistable import BistableSpec
from tca_mj.rod import solve_static
from tca_mj.routes import parallel
from tca_mj.tca.embedding import CHANNEL_CONTACT
from tca_mj.validation import attitude, modules, replay
from tca_mj.validation.attitude import Bend, arc, bent, by_place
from tca_mj.validation.facts import table

LENGTH = 45e-3


@pytest.fixture(scope="module")
def found():
    return modules.findings(full=False)


@pytest.fixture(scope="module")
def attitudes():
    return {(name, p): bent(name, (p, p / 5.0)) for name in attitude.ATTITUDES for p in (1.0, 2.0)}


def value_of(found, fact):
    (value,) = (row.value for row in found if row.fact == fact)
    return value


@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.3, math.pi / 2.0, 2.5, math.pi])
@pytest.mark.parametrize("direction", [0.0, 1.0, -2.0, 3.0])
def test_the_bend_of_an_arc_is_found_from_its_tip(angle, direction):
    got = by_place(arc(Bend(angle, direction), LENGTH), LENGTH)
    assert got.angle == pytest.approx(angle, abs=1e-7)
    assert got.direction == pytest.approx(direction if angle else 0.0)


def test_an_arc_ends_where_a_circle_of_its_length_does():
    """And a straight one at its length, which the printed cosine would not give."""
    assert arc(Bend(0.0, 1.0), LENGTH) == pytest.approx([0.0, 0.0, LENGTH])
    for angle in (0.5, 2.0):
        radius = LENGTH / angle
        end = [0.0, radius * (1.0 - math.cos(angle)), radius * math.sin(angle)]
        assert arc(Bend(angle, math.pi / 2.0), LENGTH) == pytest.approx(end)


def test_no_other_bend_is_nearer():
    """A tip that lies on no arc: against a grid over angle and direction."""
    tip = np.array([14e-3, -9e-3, 21e-3])
    got = by_place(tip, LENGTH)
    least = np.linalg.norm(arc(got, LENGTH) - tip)
    for angle in np.linspace(0.0, math.pi, 91):
        for direction in np.linspace(-math.pi, math.pi, 73):
            other = np.linalg.norm(arc(Bend(angle, direction), LENGTH) - tip)
            assert least <= other + 1e-12


@pytest.mark.parametrize("tension", [0.01, 0.03])
def test_place_and_tangent_agree_for_a_constant_curvature(tension):
    """A moment on the tip: to 1e-6. That a TCA also shortens the module makes them differ."""
    spec = BendingSpec()
    moment = (0.0, tension * spec.offset, 0.0)
    shape = solve_static(spec.body, [], [], tip_moment=moment)
    tangent = tension * spec.offset / spec.body.bending[1] * spec.length
    assert by_place(shape.tip, spec.length).angle == pytest.approx(tangent, rel=1e-6)
    pulled = solve_static(spec.body, parallel(3, spec.offset), [tension, 0.0, 0.0])
    short = spec.length * (1.0 - tension / spec.body.stretching)
    assert by_place(pulled.tip, short).angle == pytest.approx(tangent, rel=1e-3)
    assert tangent < by_place(pulled.tip, spec.length).angle < 1.06 * tangent


def test_what_is_no_place_is_refused():
    for tip in ([0.0, 0.0], [0.0, math.nan, 0.0]):
        with pytest.raises(ValueError, match="tip must be finite"):
            by_place(tip, LENGTH)
    with pytest.raises(ValueError, match="length must be finite and above 0, got 0.0"):
        by_place([0.0, 0.0, 0.04], 0.0)
    with pytest.raises(ValueError, match="attitude must be one of"):
        bent("floating", (1.0, 0.2))


def test_weight_makes_place_and_tangent_differ(attitudes):
    """It adds to the bend of a standing module and straightens a hanging one."""
    for power in (1.0, 2.0):
        stand, hang, none = (attitudes[n, power] for n in ("standing", "hanging", "weightless"))
        assert hang.place < hang.tangent < none.tangent < stand.tangent < stand.place
        assert none.tangent == pytest.approx(none.place, abs=2.0)
        assert max(none.cold, stand.cold, hang.cold) < 1e-3
        assert np.ptp([a.temperature for a in (stand, hang, none)], axis=0) == pytest.approx(0.0)


def test_the_cold_lying_module_hangs_to_its_side(attitudes):
    """By the tip's place as theory has it, with taut TCAs; far more than the reported 10°."""
    spec = BendingSpec()
    got = attitudes["lying", 1.0].cold
    bare = solve_static(spec.body, [], [], gravity=attitude.ATTITUDES["lying"])
    assert 3.0 * modules.INITIAL < got < math.degrees(by_place(bare.tip, spec.length).angle)


def test_with_the_weight_of_its_outline_the_module_falls():
    """Greenhill: a column stands up to q L³/EI = 7.84."""
    assert attitude.slenderness() < 7.84 < attitude.slenderness(9e-3)
    fallen = bent("standing", (1.0, 0.2), weight=9e-3)
    assert fallen.cold > 150.0


def test_the_contact_is_that_of_the_reported_angle_standing():
    assert attitude.contact_for("standing") == pytest.approx(CHANNEL_CONTACT, rel=0.01)
    assert attitude.conductance(CHANNEL_CONTACT) == pytest.approx(
        BendingSpec().embedded.body.conductance
    )
    # Hanging would take less than free air, and a channel wider than twice the coil.
    hanging = attitude.contact_for("hanging")
    assert hanging < 0.8 * attitude.in_free_air()
    assert attitude.ring_of_air(4.0 * BendingSpec().tca.outer_radius) > hanging


def test_only_these_facts_are_fitted_and_missed(found):
    verdicts = {row.fact: row.verdict for row in found}
    assert len(verdicts) == len(found) and table(found).count("\n") == len(found) + 1
    assert [fact for fact, verdict in verdicts.items() if verdict == "fitted"] == [
        "bends by 2 W + 0.4 W for 2 s", "bistable module: F_t2 at 100°",
        "bistable gripper: weight without base",
    ]  # fmt: skip
    missed = [fact for fact, verdict in verdicts.items() if "missed" in verdict]
    assert missed == ["wrist turned by 28 W for 2 s", "weight of the arm"]


def test_the_printed_turns_of_the_wrist_are_quadratic_and_the_models_are_not(found):
    quadratic = [45.0 / 14.0**2, 58.0 / 16.0**2, 180.0 / 28.0**2]
    assert np.ptp(quadratic) < 0.02 * quadratic[0]
    model = [value_of(found, f"wrist turned by {p} W for 2 s") / p**2 for p in (14, 16, 28)]
    assert model[0] > model[1] > model[2] and model[2] < 0.85 * model[0]


def test_the_gripper_closes_faster_than_a_single_node(found):
    """A node of 5 s loses a tenth of its heat in 0.5 s, and less than a fifth of the opening."""
    lost = value_of(found, "gripper closes")
    assert 60.0 < lost < 95.0


def test_the_bistable_fingers_silicone_takes_up_what_is_put_in(found):
    """34.7 J into one finger; a sixth is still in the TCA, a tenth beside the channels of 90 mm."""
    energy = 1.5**2 * modules.CUT * (0.8 + 1.5)
    silicone = BistableSpec().fill * 45e-3 * 10e-3 * 8e-3  # [m³]
    rise = energy / (silicone * 1070.0 * 1300.0)
    mean = value_of(found, "bistable gripper, closed and opened: hottest surface") - 25.0
    assert 0.7 * rise < mean < rise


def test_the_replay_follows_the_figure(monkeypatch):
    monkeypatch.setattr(replay, "LONGEST", 1.0)
    course = replay.replay(replay.PRINTED["screwdriver"])
    phases = course.phases()
    assert [name for name, _ in phases] == ["rotate", "open", "close", "lift", "bend", "release"]
    ends = [course.time[part.stop - 1] for _, part in phases]
    assert ends == pytest.approx([2.0, 4.0, 4.5, 6.0, 7.0, 9.0])
    rotate, opened, closed = (part.stop - 1 for _, part in phases[:3])
    assert course.wrist[rotate] == pytest.approx(45.0, rel=0.15)
    assert course.wrist[opened] < 0.5 * course.wrist[rotate]  # cooled by its tube
    assert course.opening[closed] < 0.5 * course.opening[opened]
    energy = np.sum(course.power[1:], axis=0) * replay.PERIOD
    assert energy == pytest.approx([0.6 * 3.0, 0.6 * 3.0, 0.0, 28.0, 40.0])


def test_the_mass_of_the_object_hangs_on_the_arm():
    light, heavy = (replay.loaded_arm(mass).model.body_mass.sum() for mass in (0.0, 2e-3))
    assert heavy - light == pytest.approx(2e-3)


def test_the_script_is_taken_down_in_the_same_way():
    course = replay.scripted("pcb", limit=0.5)
    assert course.ending == "stopped after 0.5 s" and course.phase[0] == "align"
    assert len(course.time) == len(course.bend) == 6
    assert course.bend[0] == course.place[0] == 0.0
