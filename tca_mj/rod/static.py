"""Static shape of soft bodies with strands inside: the public functions and the solvers' door."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any

from numpy.typing import ArrayLike

from tca_mj.checks import door, require_one_of, whole
from tca_mj.rod.beam import BeamSpec
from tca_mj.rod.energy.solver import minimise
from tca_mj.rod.problem import Segment, StaticProblem, StrandLaw
from tca_mj.rod.shape import RodShape
from tca_mj.rod.shooting.solver import solve
from tca_mj.routes import AnyRoute

SOLVERS = ("shooting", "energy")


@door
def solve_static(
    beam: BeamSpec, routes: Sequence[AnyRoute], tensions: Sequence[float | StrandLaw],
    **options: Any,
) -> RodShape:  # fmt: skip
    """Static shape of a clamped soft body with strands on arbitrary routes, by rod theory.

    Args:
        beam: The body, its base at the origin, along +z.
        routes: Routes of the k strands: straight, U, helix, or any object with the legs that
            ``routes.Route`` tells of. They may lie outside the body.
        tensions: For each strand its tension, at least 0 [N], or its law, for a TCA at a
            temperature: from the length of its route to tension and slope.
        **options: ``tip_force``, ``tip_moment``, ``gravity``, ``solver``, ``shearable`` and
            ``points``, as in ``solve_series``.

    Returns:
        The shape at the points from base to tip, the strands' lengths, and what holds the base:
        nothing if only strands pull, because they pull between two sections of one body.

    Raises:
        ValueError, RodSolveError: As in ``solve_series``.

    Example:
        >>> from tca_mj import parallel
        >>> from tca_mj.modules import silicone_cylinder
        >>> from tca_mj.rod import solve_static
        >>> beam = silicone_cylinder(45e-3, 4.5e-3, 9e-3)
        >>> shape = solve_static(beam, parallel(1, 4e-3), [0.02])  # one TCA pulls with 0.02 N
        >>> (1e3 * shape.position[-1]).round(1)  # of the tip [mm]
        array([26.8,  0. , 30.8])
    """
    return solve_series([Segment(beam, routes, tensions)], **options)[0]


@door
def solve_series(
    segments: Sequence[Segment],
    *,
    tip_force: ArrayLike = (0.0, 0.0, 0.0),
    tip_moment: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    solver: str = "shooting",
    shearable: bool = True,
    points: Annotated[int, partial(whole, at_least=2, at_most=10_000)] = 65,
) -> tuple[RodShape, ...]:
    """Static shapes of soft bodies in series, each on the tip of the one before, or in a tree.

    The exact theory of a Cosserat rod (bending, twist, shear and stretch of any size, linear
    elastic in them), whose strands slide without friction on their routes and are fixed at the
    base and the tip. Loads are dead: they keep their direction. The state is the one
    that continues the unloaded bodies when loads and tensions grow together.

    Args:
        segments: The bodies from base to tip, with what is rigid between them. Where one stands
            on another than the one before it (``Segment.base``) they are a tree.
        tip_force: Force on the last tip, world frame, shape (3,) [N].
        tip_moment: Moment on it, world frame, shape (3,) [N m].
        gravity: Acceleration of gravity, world frame, shape (3,) [m/s²].
        solver: "shooting", on the balance of sections, or "energy", the minimum of the total
            energy over the motions of the sections. They share the section's energy, no more. A
            tree, springs, and segments with a start are for "energy" alone.
        shearable: Whether sections shear. Without, the rod still stretches: what a chain of
            hinges and slides is.
        points: Number of points of each segment, at equal distances, 2 to 10 000. It has no
            influence on accuracy.

    Returns:
        One shape per segment, all in the world's frame. ``tca_length`` is what of a strand lies in
        that segment. ``base_force`` and ``base_moment`` are what holds the base of that segment,
        the moment about the world's origin.

    Raises:
        ValueError: If an argument has a wrong shape, is not finite, a tension is negative, or the
            solver is not for what the segments are.
        RodSolveError: If no state is found, with what is left of the equations.
    """
    require_one_of("solver", solver, SOLVERS)
    problem = StaticProblem(segments, tip_force, tip_moment, gravity, shearable)
    if solver == "energy":
        return minimise(problem, points)
    for what, held in (
        ("branch", problem.bases != tuple(range(-1, len(problem.segments) - 1))),
        ("have springs", any(each.springs for each in problem.segments)),
        ("have a start", any(each.start is not None for each in problem.segments)),
    ):
        if held:
            raise ValueError(f"solver must be 'energy' where segments {what}, got {solver!r}")
    return solve(problem, points)
