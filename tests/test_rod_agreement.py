"""Two solvers that share the energy of a section and no more find the same shapes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tca_mj.rod import BeamSpec, Segment, Spring, solve_series, solve_static
from tca_mj.routes import Helix, UTurn, leg_length


class Cord:
    """Law of a strand that is slack below its rest length and stiffens above."""

    def __init__(self, rest, stiffness, hardening):
        self.rest, self.stiffness, self.hardening = rest, stiffness, hardening

    def __call__(self, length):
        over = max(length - self.rest, 0.0)
        slope = self.stiffness + 2.0 * self.hardening * over
        return (self.stiffness + self.hardening * over) * over, slope if over > 0.0 else 0.0


def random_beam(rng):
    length, young = rng.uniform(10e-3, 80e-3), 10.0 ** rng.uniform(5.0, 6.5)
    bent = rng.normal(size=3) * rng.choice([0.0, 0.5, 2.0]) / length
    common = {
        "length": length,
        "young": young,
        "shear": young / rng.uniform(2.2, 3.2),
        "density": 1070.0,
        "curvature": tuple(bent),
    }
    if rng.random() < 0.6:
        return BeamSpec.circular(diameter=length * rng.uniform(0.05, 0.25), **common)
    width, height = length * rng.uniform(0.05, 0.25, size=2)
    return BeamSpec.box(width=width, height=height, **common)


def random_route(rng, beam):
    radius = max(beam.outline.half_width, beam.outline.half_height) * rng.uniform(0.3, 1.5)
    phase, turns = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.3, 4.0)
    return [
        Helix(radius, phase=phase),
        Helix(radius, rng.choice([-1.0, 1.0]) * turns, phase),
        UTurn.parallel(radius, radius * rng.uniform(0.1, 0.8), phase),
        UTurn.double_helix(radius, 0.6 * turns, phase),
    ][rng.integers(4)]


def random_segment(rng, level, first):
    beam = random_beam(rng)
    routes = [random_route(rng, beam) for _ in range(rng.integers(0, 4))]
    tensions = []
    for route in routes:
        lever = route.legs[0].radius * len(route.legs)
        tension = rng.uniform(0.1, 1.0) * level * min(beam.bending) / beam.length / lever
        rest = sum(leg_length(leg, beam.length, beam.curvature) for leg in route.legs)
        stiffness = tension / (0.15 * rest)
        law = Cord(rest * rng.uniform(0.7, 1.1), stiffness, stiffness / rest * rng.choice([0, 1]))
        tensions.append(law if rng.random() < 0.4 else tension)
    place = {}
    if not first or rng.random() < 0.3:
        place = {
            "rotation": Rotation.from_rotvec(rng.normal(size=3)).as_matrix(),
            "offset": 3e-3 * rng.normal(size=3),
        }
    return Segment(
        beam,
        routes,
        tensions,
        mass=rng.choice([0.0, 1e-3]),
        centre=2e-3 * rng.normal(size=3),
        **place,
    )


def random_case(seed):
    """Up to three modules, each with up to three strands, and loads that bend by radians."""
    rng = np.random.default_rng(seed)
    level, count = rng.choice([1.5, 4.0]), int(rng.choice([1, 1, 2, 3]))
    segments = [random_segment(rng, level / count, i == 0) for i in range(count)]
    length = sum(segment.beam.length for segment in segments)
    bending = min(min(segment.beam.bending) for segment in segments)
    mass = sum(segment.beam.mass + segment.mass for segment in segments)
    down = rng.normal(size=3)
    down *= min(9.81, 2.0 * level * bending / length**2 / mass) / np.linalg.norm(down)
    loads = {
        "tip_force": rng.normal(size=3) * level * bending / length**2 * rng.choice([0.0, 1.0]),
        "tip_moment": rng.normal(size=3) * level / 2 * bending / length * rng.choice([0.0, 1.0]),
        "gravity": down * rng.choice([0.0, 1.0]),
        "shearable": bool(rng.random() < 0.75),
    }
    return segments, loads


def assert_same(shapes, others):
    for one, other in zip(shapes, others, strict=True):
        assert np.abs(one.position - other.position).max() < 1e-9  # asked for: 1e-7 m
        assert np.abs(one.rotation - other.rotation).max() < 1e-8
        assert one.tca_length == pytest.approx(other.tca_length, abs=1e-9)
        scale = 1.0 + np.abs(other.strain).max(axis=0)
        assert np.abs((one.strain - other.strain) / scale).max() < 1e-6
        assert np.abs(one.base_force - other.base_force).max() < 1e-12
        assert np.abs(one.base_moment - other.base_moment).max() < 1e-11
        assert one.arc_length == pytest.approx(other.arc_length, rel=1e-14)


@pytest.mark.parametrize("seed", range(12))
def test_random_series(seed):
    segments, loads = random_case(seed)
    assert_same(
        solve_series(segments, solver="shooting", **loads),
        solve_series(segments, solver="energy", **loads),
    )


ROUND = BeamSpec.circular(
    length=45e-3, diameter=4.5e-3, young=0.125e6, shear=0.125e6 / 3.0, density=1070.0
)
FLAT = BeamSpec.box(
    length=45e-3, width=6e-3, height=4e-3, young=0.125e6, shear=0.125e6 / 3.0, density=1070.0
)


@pytest.mark.parametrize(
    ("beam", "routes", "tensions", "loads"),
    [
        (ROUND, [Helix(4e-3)], [0.04], {}),
        (ROUND, [Helix(4e-3)], [0.08], {"tip_force": (0.0, 3e-3, 0.0)}),
        (ROUND, [Helix(4e-3, 5.0)], [0.02], {"tip_force": (1e-3, 0.0, 0.0)}),
        (ROUND, [UTurn.parallel(4e-3, 1e-3)], [0.02], {"gravity": (0.0, 9.81, 0.0)}),
        (ROUND, [], [], {"tip_moment": (0.0, 3e-4, 5e-5)}),
        # Pushed far beyond the first load at which it buckles, a little to one side.
        (FLAT, [], [], {"tip_force": (-3e-4, -8e-4, -1e-1)}),
        (FLAT, [], [],
         {"tip_force": (-4e-4, -6e-4, -1.2e-2), "tip_moment": (1e-5, 2e-5, -7e-5)}),
    ],
)  # fmt: skip
def test_large_loads(beam, routes, tensions, loads):
    shapes = [solve_static(beam, routes, tensions, solver=name, **loads)
              for name in ("shooting", "energy")]  # fmt: skip
    assert_same(shapes[:1], shapes[1:])


@pytest.mark.parametrize(
    ("spring", "loads"),
    [
        (Spring(stiffness=2.0, length=5e-3, start=(30e-3, 5e-3, 10e-3)), {}),
        (Spring(stiffness=5.0, length=10e-3, start=(0.0, 0.0, 60e-3), end=(3e-3, 0.0, 1e-3)),
         {"gravity": (0.0, 9.81, 0.0)}),
        (Spring(stiffness=0.2, length=0.0, start=(-20e-3, 10e-3, 40e-3), end=(0.0, 4e-3, 0.0)),
         {"tip_force": (1e-3, 0.0, 0.0)}),
        (Spring(stiffness=100.0, length=70e-3), {"gravity": (9.81, 0.0, 0.0)}),  # slack
    ],
)  # fmt: skip
def test_a_spring_is_the_force_with_which_it_pulls_in_the_end(spring, loads):
    """One solver knows the spring, the other one only what it pulls with, as dead loads."""
    segment = Segment(ROUND, [Helix(4e-3)], [0.02])
    (found,) = solve_series([replace(segment, springs=(spring,))], solver="energy", **loads)
    arm = found.rotation[-1] @ spring.end
    force = spring.pull(found.tip + arm - spring.start)
    dead = loads | {"tip_force": np.asarray(loads.get("tip_force", np.zeros(3))) + force}
    other = solve_series([segment], tip_moment=np.cross(arm, force), **dead)
    assert_same([found], other)
    assert (np.linalg.norm(force) > 2e-3) == (spring.length < 50e-3)


def test_a_body_sets_out_to_the_state_that_is_meant():
    """A band pulls the ends of a straight rod together: it rests to either side, as a mirror."""
    band = Spring(stiffness=10.0, length=20e-3)
    bent = []
    for side in (-1.0, 1.0):
        segment = Segment(FLAT, [], [], springs=(band,), start=(20.0 * side, 0.0, 0.0))
        (shape,) = solve_series([segment], solver="energy")
        bent.append(shape.position)
    assert bent[0][-1, 1] > 10e-3
    assert bent[1] == pytest.approx(bent[0] * [1.0, -1.0, 1.0], abs=1e-9)
    with pytest.raises(ValueError, match="solver must be 'energy' where segments have springs"):
        solve_series([segment])
    with pytest.raises(ValueError, match="solver must be 'energy' where segments have a start"):
        solve_series([replace(segment, springs=())])
    with pytest.raises(ValueError, match=r"springs of segments\[0\] must be none"):
        solve_series([segment, segment], solver="energy")
