"""What tendons move: less of a robot than MuJoCo reckons with.

MuJoCo keeps the derivatives of each tendon's length in a row of a sparse matrix. In it is every
joint below a site of the tendon, also those that all of its sites stand on, which turn and shift
the tendon as a whole: there the derivative is zero but for rounding, some 1e-17. The integrator
that solves for TCAs and springs implicitly lists, for each joint, what tendons couple it with, and
sorts the list in a time that grows with the square of its length. A robot whose legs have many
TCAs spends a third of a step on sorting zeros, and more on reckoning with them.
"""

import mujoco
import numpy as np

# Tendons that move nothing of a joint from which on it is taken out of their rows: with fewer
# hardly anything is gained, 2 % for the arm with five, and steps stay what they were to the bit.
_MANY = 6


def spare_joints(model: mujoco.MjModel) -> None:
    """Takes joints that move all sites of a tendon alike out of its row, if that saves time.

    To be called before a state of the model is made.

    Args:
        model: The compiled model, which is changed.
    """
    if not mujoco.mj_isSparse(model):  # lists nothing
        return
    idle = [_carriers(model, tendon) for tendon in range(model.ntendon)]
    often = np.bincount(np.concatenate([[], *idle]).astype(np.int64), minlength=model.nv) >= _MANY
    if not often.any():
        return
    start = 0
    for tendon, carriers in enumerate(idle):
        first, count = model.ten_J_rowadr[tendon], model.ten_J_rownnz[tendon]
        row = model.ten_J_colind[first : first + count]
        row = row[~np.isin(row, carriers) | ~often[row]]
        model.ten_J_rowadr[tendon], model.ten_J_rownnz[tendon] = start, row.size
        model.ten_J_colind[start : start + row.size] = row
        start += row.size


def _carriers(model: mujoco.MjModel, tendon: int) -> list[int]:
    """Degrees of freedom that all sites of a tendon stand on; none of a tendon of another kind."""
    wraps = range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
    if not all(model.wrap_type[i] == mujoco.mjtWrap.mjWRAP_SITE for i in wraps):
        return []
    below = [_below(model, int(model.site_bodyid[model.wrap_objid[i]])) for i in wraps]
    return sorted(set.intersection(*below))


def _below(model: mujoco.MjModel, body: int) -> set[int]:
    """Degrees of freedom that move a body."""
    found: set[int] = set()
    while body:
        first = int(model.body_dofadr[body])
        found.update(range(first, first + int(model.body_dofnum[body])))
        body = int(model.body_parentid[body])
    return found
