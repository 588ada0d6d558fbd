"""Two solvers that share the energy of a section and no more find the same shapes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tca_mj.rod import BeamSpec, Segment, solve_series, solve_static
from tca_mj.routes import Helix, UTurn, leg_length


class Spring:
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
        law = Spring(rest * rng.uniform(0.7, 1.1), stiffness, stiffness / rest * rng.choice([0, 1]))
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
