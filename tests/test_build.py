"""A robot of one's own: what builds it, what it refuses, and that it is where theory says."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import tca_mj
from tca_mj.model.build import VIEW
from tca_mj.modules.bending import silicone_cylinder
from tca_mj.rod import Segment, solve_series

EXAMPLE = runpy.run_path(str(Path(__file__).parent.parent / "examples" / "own_robot.py"))


def bare():
    part = tca_mj.Part(tca_mj.new_spec("own"))
    soft = silicone_cylinder(45e-3, 8e-3, 8e-3)
    return part, tca_mj.add_chain(part.spec.worldbody, soft, nodes=8, name="body")


def test_two_modules_with_nine_tcas_are_where_rod_theory_says():
    """At three sets of temperatures: the tip within 0.1 % of the length, by the tensions there."""
    part = EXAMPLE["two_modules"]()
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    assert len(part.tcas) == 9
    length, radius = EXAMPLE["LENGTH"], EXAMPLE["RADIUS"]
    soft = silicone_cylinder(length, 8e-3, 8e-3)
    lower = [*tca_mj.parallel(3, radius)]
    lower += [tca_mj.Helix(radius, turns=0.25, phase=np.radians(60.0 + 120.0 * i))
              for i in range(3)]  # fmt: skip
    upper = tca_mj.parallel(3, radius, phase=np.radians(30.0))
    sim = tca_mj.Simulation(part)
    for temperatures in ([110, 25, 25, 25, 25, 25, 25, 100, 25],
                         [25, 25, 25, 90, 90, 90, 25, 25, 25],
                         [60, 90, 25, 25, 80, 25, 100, 25, 60]):  # fmt: skip
        sim.reset()
        sim.rest(np.array(temperatures, dtype=float))
        shapes = solve_series(
            [Segment(soft, lower, sim.tension[:6].tolist()),
             Segment(soft, upper, sim.tension[6:].tolist())], shearable=False
        )  # fmt: skip
        gap = np.linalg.norm(sim.data.site("tip").xpos - shapes[-1].position[-1])
        assert gap < 1e-3 * 2.0 * length


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


def test_a_stage_may_have_a_floor():
    part, chain = bare()
    tca_mj.add_tca(part, chain, tca_mj.Helix(3e-3), "free-stroke")
    tca_mj.stage(part, floor=-0.1)
    assert tca_mj.Simulation(part).model.geom("stage.floor").pos[2] == -0.1
