"""The task of all shapes, the gaits that come first in its memories, and the quicker course."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tca_mj.agents.policies.actors import first_gaits
from tca_mj.agents.scripts.course import Bend, CourseWalker, stages
from tca_mj.agents.scripts.course_quick import SCRIPTED, Learned, quick
from tca_mj.agents.scripts.tetrapod import GAITS, EveryGait, gait_policy
from tca_mj.envs.course import TetrapodCourse
from tca_mj.envs.gaits import OBSERVATION, SPREAD, TASKS
from tca_mj.envs.shapes import OBSERVATION as SHAPED
from tca_mj.envs.shapes import TetrapodShapes
from tca_mj.envs.tetrapod import TetrapodGait

VARIED = {"randomise": 0.2}


@pytest.fixture(scope="module")
def shapes():
    return TetrapodShapes(action="power")


@pytest.fixture(scope="module")
def course():
    return TetrapodCourse(action="power", fan=True)


@pytest.mark.parametrize("gait", TASKS)
def test_it_is_the_task_of_that_shape(shapes, gait):
    """The same robot, put down the same; that a beam stands 5 m away changes nothing but digits."""
    alone = TetrapodGait(gait=gait, action="power")
    seen, info = shapes.reset(seed=3, options={"gait": gait, **VARIED})
    other, expected = alone.reset(seed=3, options=VARIED)
    assert info["variation"] == expected["variation"]
    mine, its = gait_policy(gait), gait_policy(gait)
    paid = 0.0
    for _ in range(10):
        seen, _, _, _, info = shapes.step(mine.act(seen))
        paid += info["reward_terms"]["progress"]
        other, _, _, _, expected = alone.step(its.act(other))
    assert info["distance"] == pytest.approx(expected["distance"], rel=1e-3, abs=1e-6)
    assert info["tension"] == pytest.approx(expected["tension"], rel=1e-3)
    rows, same = SHAPED.read(seen), OBSERVATION.read(other)
    assert rows["height"] == pytest.approx(same["height"], abs=1e-5)
    assert paid == pytest.approx(info["distance"] / TASKS[gait].scripted, rel=1e-9)


def test_all_shapes_are_drawn_and_a_given_one_shifts_no_other_draw(shapes):
    drawn = [shapes.options.setup(np.random.default_rng(seed), {}) for seed in range(60)]
    assert {setup["gait"] for setup in drawn} == set(TASKS)
    for setup in drawn:
        assert abs(setup["bend"] - TASKS[setup["gait"]].bend) <= shapes.bend_range + 1e-12
    told = shapes.options.setup(np.random.default_rng(5), {"gait": "walk"})
    assert told["push_direction"] == drawn[5]["push_direction"]
    wide = {"gait": "walk", "bend_spread": SPREAD}
    bends = [shapes.options.setup(np.random.default_rng(k), wide)["bend"] for k in range(40)]
    assert np.ptp(bends) > 1.5 * SPREAD


def test_a_bend_that_is_of_no_gait_is_refused(shapes):
    with pytest.raises(ValueError, match="bend must be within .* for crawl, got 1.5"):
        shapes.reset(seed=0, options={"gait": "crawl", "bend": 1.5})


def test_a_state_brings_its_shape_back(shapes):
    shapes.reset(seed=0, options={"gait": "shimmy"})
    state = shapes.get_state()
    first = shapes.step(shapes.action.still)[0]
    shapes.reset(seed=1, options={"gait": "crawl"})
    shapes.set_state(state)
    assert shapes.gait == "shimmy"
    assert (shapes.step(shapes.action.still)[0] == first).all()


def test_the_script_knows_the_shape_by_the_bend_and_memories_by_the_task(shapes):
    policy, first = EveryGait(shapes), first_gaits("TCA/TetrapodShapes-v0", "scripted")
    for gait in TASKS:
        seen, _ = shapes.reset(seed=0, options={"gait": gait})
        policy.reset()
        alone = gait_policy(gait)
        if gait != "crawl":  # whose legs trot here
            assert (policy.act(seen) == alone.act(seen)).all()
        assert first(shapes).period == GAITS[gait].period
    assert first_gaits("TCA/TetrapodWalk-v0", "scripted")(None) == GAITS["walk"]


@pytest.mark.parametrize("gait", ["crawl", "walk"])
def test_the_course_shows_a_learned_gait_what_its_own_task_does(course, gait):
    """On the first desk, in the shape of the gait: the same rows but for the other spine."""
    alone = TetrapodGait(gait=gait)
    seen, _ = alone.reset(seed=0, options={"yaw": 0.0, "bend": TASKS[gait].bend})
    course.reset(seed=0)
    course.sim.reset(course.stance.placer(bend=TASKS[gait].bend))
    course.sim.step(np.zeros(course.sim.n), 0.5)  # it comes to rest, as there
    learned, shown = Learned(course, {gait: f"tetrapod-{gait}-sac"}), []
    network = learned.gaits[gait].network

    def watched(observation):
        shown.append(observation)
        return network(observation)

    learned.gaits[gait] = replace(learned.gaits[gait], network=watched)
    asked = [learned(gait, 0.0, begins=k == 0) for k in range(5)]
    assert len(shown) == 2 and asked[0].shape == (4, 3)  # held for 0.4 s
    assert (asked[0] == asked[3]).all()
    mine, its = OBSERVATION.read(shown[0]), OBSERVATION.read(seen)
    for name, apart in {"height": 3e-3, "foot position": 4e-3, "body bend": 0.03,
                        "commanded direction": 0.01, "commanded speed": 1e-6,
                        "heading error": 0.01, "TCA length": 1e-3}.items():  # fmt: skip
        assert mine[name] == pytest.approx(its[name], abs=apart), name


def test_a_fan_halves_the_cooling_and_is_off_without(course):
    """Sun, Section 6.1.3: 12 s instead of 25 s from where 9.5 V hold to 80 °C."""
    still = np.append(course.action.still[:-1], -1.0).astype(np.float32)
    times = []
    for fan in (-1.0, 1.0):
        course.reset(seed=0)
        heat = course.sim.spines.state.heat
        heat.temperature[:] = 120.0
        still[-1], steps = fan, 0
        while course.sim.spines.temperature.max() > 80.0:
            course.step(still)
            steps += 1
        times.append(0.1 * steps)
    assert times[0] == pytest.approx(25.0, abs=0.5)
    assert times[1] == pytest.approx(12.0, abs=1.0)
    assert TetrapodCourse().action.size == course.action.size - 1


def test_the_quick_plan_goes_where_the_plan_goes(course):
    slow, fast = stages(course.places), quick(course.places, SCRIPTED)
    first = next(i for i, stage in enumerate(slow) if stage.name == "open")
    rest = [stage.name for stage in slow[first:] if stage.name != "open"]
    assert [stage.name for stage in fast] == [
        *(stage.name for stage in slow[:first]), *["open"] * 8, *rest
    ]  # fmt: skip
    for one, other in [*zip(slow[:first], fast, strict=False),
                       *zip(slow[-len(rest) :], fast[-len(rest) :], strict=True)]:  # fmt: skip
        if isinstance(one, Bend):  # it clamps by what its TCAs can
            assert other.brisk and not one.brisk
            assert one.angle == other.angle or (one.name == "clamp" and other.angle > one.angle)
        else:  # the last spine is just off the beam, all of the body on the target
            less = {"step off": 2.5e-3, "walk on": 14e-3}.get(one.name, 0.0)
            assert one.until - other.until == pytest.approx(less, abs=1e-9)
    assert fast[-2].until > course.places.target - course.places.target_size[0] + 0.075
    assert math.isclose(course.places.beam_top, 45e-3)
    assert math.isclose(course.places.lower, -59e-3)


def test_spines_are_warmed_on_the_way_and_held_until_they_are_rigid(course):
    walker = CourseWalker(course, quick(course.places, SCRIPTED))
    observation, _ = course.reset(seed=0)
    rows = course.observation.slices
    seen = observation.copy()
    seen[rows["position"]] = [course.places.stand - 0.02, 0.0, 0.013]
    assert (walker.act(seen)[15:18] == 1.0).all()  # 25 V while it crawls
    seen[rows["spine temperature"]] = walker.warm + 1.0
    assert (walker.act(seen)[15:18] == -1.0).all()  # and no warmer: still rigid
    walker._number = 2
    walker._enter()
    walker._held = 150.0
    seen[rows["TCA temperature"].start + 12 : rows["TCA temperature"].stop] = 140.0
    assert (walker.act(seen)[12:15] > -1.0).all() and walker._held < 150.0
    seen[rows["spine temperature"]] = walker.rigid - 1.0
    assert (walker.act(seen)[12:15] == -1.0).all()
