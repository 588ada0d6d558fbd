"""A robot of one's own: what builds it, what it refuses, and that it is where theory says."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import tca_mj
from tca_mj.model.build import VIEW
from tca_mj.modules.bending import silicone_cylinder
from tca_mj.rod import Segment, bend, solve_series

EXAMPLE = runpy.run_path(str(Path(__file__).parent.parent / "examples" / "own_robot.py"))


def bare():
    part = tca_mj.Part(tca_mj.new_spec("own"))
    soft = silicone_cylinder(45e-3, 8e-3, 8e-3)
    return part, tca_mj.add_chain(part.spec.worldbody, soft, nodes=8, name="body")


def test_two_modules_with_nine_tcas_are_where_rod_theory_says():
    """At three sets of temperatures: the tip within 0.1 % of the length, by the tensions there."""
    part, spec = EXAMPLE["two_modules"](), EXAMPLE["TwoModules"]()
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    assert len(part.tcas) == 9
    soft = silicone_cylinder(spec.length, 8e-3, 8e-3)
    upper = [*tca_mj.parallel(3, spec.radius)]
    upper += [tca_mj.Helix(spec.radius, turns=0.25, phase=np.radians(60.0 + 120.0 * i))
              for i in range(3)]  # fmt: skip
    lower = tca_mj.parallel(3, spec.radius)
    sim = tca_mj.Simulation(part)
    for temperatures in ([110, 25, 25, 25, 25, 25, 25, 100, 25],
                         [25, 25, 25, 90, 90, 90, 25, 25, 25],
                         [60, 90, 25, 25, 80, 25, 100, 25, 60]):  # fmt: skip
        sim.reset()
        sim.rest(np.array(temperatures, dtype=float))
        shapes = solve_series(
            [Segment(soft, upper, sim.tension[:6].tolist(), rotation=np.diag([1.0, -1.0, -1.0])),
             Segment(soft, lower, sim.tension[6:].tolist())], shearable=False
        )  # fmt: skip
        gap = np.linalg.norm(sim.data.site("tip").xpos - shapes[-1].position[-1])
        assert gap < 1e-3 * 2.0 * spec.length
        exact = bend(np.concatenate([shape.rotation[:, :, 2] for shape in shapes]))
        assert sim.bend("upper", "lower") == pytest.approx(exact, abs=2e-3)


def test_a_tca_is_cut_to_its_route():
    part, chain = bare()
    route = tca_mj.Helix(3e-3, turns=0.5)
    laid = tca_mj.add_tca(part, chain, route, "free-stroke")
    assert laid.spec.rest_length == pytest.approx(np.hypot(45e-3, np.pi * 3e-3))
    assert (laid.name, part.tcas) == ("tca0", (laid,))
    tca_mj.add_tca(part, chain, tca_mj.Helix(3e-3), tca_mj.CATALOGUE["free-stroke"], name="own")
    assert [tca.name for tca in part.tcas] == ["tca0", "own"]


@pytest.mark.parametrize(
    ("route", "tca", "name", "said"),
    [
        (tca_mj.parallel(3, 3e-3), "free-stroke", None, r"route must be a Helix .* parallel\("),
        ((0.0, 0.0), "free-stroke", None, "route must be a Helix or a UTurn"),
        (tca_mj.Helix(3e-3), "free-strok", None, "did you mean 'free-stroke'"),
        (tca_mj.Helix(3e-3), "free-stroke", "taken", "name must be new in this part, got 'taken'"),
        (tca_mj.Helix(9e-3), "free-stroke", None, "must stay inside the body"),
    ],
)
def test_what_cannot_be_laid_is_refused_in_words(route, tca, name, said):
    part, chain = bare()
    tca_mj.add_tca(part, chain, tca_mj.Helix(1e-3), "free-stroke", name="taken")
    with pytest.raises(ValueError, match=said):
        tca_mj.add_tca(part, chain, route, tca, name=name)
    assert len(part.tcas) == 1


def test_a_bare_part_can_be_seen():
    from tca_mj.record.render import Offscreen, RenderingUnavailable

    part, chain = bare()
    tca_mj.add_tca(part, chain, tca_mj.Helix(3e-3), "free-stroke")
    sim = tca_mj.Simulation(part)
    assert sim.model.nlight == 1 and sim.model.camera(VIEW).id == 0
    tca_mj.Simulation(part)  # again: it has a light now
    try:
        picture = Offscreen(sim.model, width=64, height=48, camera=VIEW).draw(sim.data)
    except RenderingUnavailable:
        pytest.skip("no OpenGL")
    assert picture.mean() > 100.0 and picture.std() > 2.0


@pytest.mark.parametrize("length", [0.02, 0.5])
def test_the_camera_sees_robots_of_any_size(length):
    """All of it is in the picture, and fills a third of it at least."""
    part = tca_mj.Part(tca_mj.new_spec("long"))
    soft = silicone_cylinder(length, 0.1 * length, 0.1 * length)
    place = (0.3, 0.1, -0.2)
    chain = tca_mj.add_chain(part, soft, nodes=6, name="body", quat=(0, 1, 0, 0), pos=place)
    chain.mark_tip("tip")
    tca_mj.add_tca(part, chain, tca_mj.Helix(1e-3), "free-stroke")
    sim = tca_mj.Simulation(part)
    camera = sim.data.camera(VIEW)
    axes = camera.xmat.reshape(3, 3)
    ends = [sim.data.body("body.piece0").xpos, sim.data.site("tip").xpos]
    seen = [axes.T @ (end - camera.xpos) for end in ends]
    heights = [x[1] / -x[2] / np.tan(np.radians(35.0 / 2.0)) for x in seen]
    assert max(abs(x[0] / x[2]) for x in seen) < 0.01  # in the middle
    assert max(np.abs(heights)) < 1.0 and heights[0] - heights[1] > 2.0 / 3.0


def test_a_stage_may_have_a_floor():
    part, chain = bare()
    tca_mj.add_tca(part, chain, tca_mj.Helix(3e-3), "free-stroke")
    tca_mj.stage(part, floor=-0.1)
    assert tca_mj.Simulation(part).model.geom("stage.floor").pos[2] == -0.1


def test_bends_go_on_beyond_half_a_turn():
    """Of a soft module that one hot TCA curls, by its curvature times its length."""
    part = tca_mj.Part(tca_mj.new_spec("curled"))
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    soft = silicone_cylinder(60e-3, 5e-3, 8e-3)
    chain = tca_mj.add_chain(part, soft, nodes=12, name="body")
    tca_mj.add_tca(part, chain, tca_mj.Helix(3e-3), "free-stroke")
    sim = tca_mj.Simulation(part)
    sim.rest(140.0)
    angle = sim.tension[0] * 3e-3 / soft.bending[0] * soft.length
    assert 1.1 * np.pi < angle < 1.9 * np.pi
    assert sim.bend("body") == pytest.approx(angle, rel=1e-4)
    with pytest.raises(ValueError, match=r"chains must be some of \['body'\], got \['tail'\]"):
        sim.bend("tail")


def test_a_robot_is_put_into_the_arena():
    part = tca_mj.in_arena(EXAMPLE["two_modules"](), pos=(0.0, 0.01, 0.13))
    sim = tca_mj.Simulation(part)
    assert sim.data.body("robot.upper.piece0").xpos == pytest.approx([0.0, 0.01, 0.13])
    assert sim.model.ncam == 3 and list(sim.chains) == ["robot.upper", "robot.lower"]


def test_a_route_through_two_chains_is_laid_in_one_go():
    """A U up and down both: its length, and half of its weight in each."""
    part, chain = bare()
    more = tca_mj.add_chain(part, chain.beam, nodes=4, name="more", on=chain)
    before = sum(geom.mass for geom in part.spec.geoms)
    laid = tca_mj.add_tca(
        part, [chain, more], tca_mj.UTurn.double_helix(3e-3, 0.5), "free-stroke"
    )
    assert laid.spec.rest_length == pytest.approx(2.0 * np.hypot(90e-3, np.pi * 3e-3))
    assert [run.chain.name for run in laid.runs] == ["body", "more", "more", "body"]
    assert [run.down for run in laid.runs] == [False, False, True, True]
    assert laid.runs[1].leg.phase == pytest.approx(laid.runs[0].leg.phase + 0.5 * np.pi)
    assert [run.mass for run in laid.runs] == pytest.approx([laid.spec.mass / 4.0] * 4)
    after = sum(geom.mass for geom in part.spec.geoms)
    assert after - before == pytest.approx(laid.spec.mass)
