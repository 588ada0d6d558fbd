"""Loops of chains, which MuJoCo's tree of bodies does not know, closed by welds."""

import mujoco

# A weld hardly gives: MuJoCo's default is softer than spines in their plane. It takes a time
# constant that is so short only with its flag ``refsafe`` disabled, else two time steps.
_SOLREF = (2e-4, 1.0)
_SOLIMP = (0.999, 0.9999, 1e-4, 0.5, 2.0)
# Zeros: as they are when all joints are at 0, in line; 1 m/rad by which errors of rotation count.
_WELD = [0.0] * 10 + [1.0, 0.0]


def weld(
    mjspec: mujoco.MjSpec, one: mujoco.MjsBody, other: mujoco.MjsBody, *, name: str
) -> None:
    """Holds two bodies to each other as they are when all joints are at 0.

    Args:
        mjspec: Their specification.
        one: A body.
        other: Another one.
        name: Name of the weld.
    """
    mjspec.add_equality(
        name=name, type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1=one.name, name2=other.name, data=_WELD, solref=_SOLREF, solimp=_SOLIMP,
    )  # fmt: skip
