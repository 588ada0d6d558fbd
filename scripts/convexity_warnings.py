"""Why MuJoCo warns that a line search is not convex; prints the table of docs/tetrapod.md.

    python scripts/convexity_warnings.py    two minutes

Robots are put down 150 times, and every physics step that was warned of is computed again from the
same state with other settings. Warned: how many of these steps still are. Velocity: the largest
difference of a joint's velocity after the step from what the solver finds to its last digits, over
the largest velocity. Elsewhere: how many of the other steps are warned of, all 150 times again.
"""

import copy
from collections.abc import Callable
from typing import Any, NamedTuple
from unittest.mock import patch

import mujoco
import numpy as np
from numpy.typing import NDArray

from tca_mj.envs.tetrapod import TetrapodGait
from tca_mj.model.mujoco_warnings import warning_counts
from tca_mj.pages import command_line, table

EPISODES = 150
STEP = mujoco.mj_step
STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
WARNING = "Linesearch objective is not convex"


class Warned(NamedTuple):
    """A physics step: the model as it was, and the state before it."""

    model: mujoco.MjModel
    state: NDArray[np.float64]


def change(**options: Any) -> Callable[[mujoco.MjModel], None]:
    """Changes options of a model."""

    def apply(model: mujoco.MjModel) -> None:
        for name, value in options.items():
            setattr(model.opt, name, value)

    return apply


def cold(model: mujoco.MjModel) -> None:
    """Begins the search without the last step's solution."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_WARMSTART)


SETTINGS: dict[str, Callable[[mujoco.MjModel], None]] = {
    "as it is": change(),
    "dense Jacobian": change(jacobian=int(mujoco.mjtJacobian.mjJAC_DENSE)),
    "not begun at the last solution": cold,
    "tolerance of 1e-6 for 1e-8": change(tolerance=1e-6),
    "tolerance of 1e-12": change(tolerance=1e-12),
    "line search to 1e-4 for 1e-2": change(ls_tolerance=1e-4),
    "200 evaluations in a line search for 50": change(ls_iterations=200),
    "10 evaluations": change(ls_iterations=10),
    "friction ten times as soft (ratio 300)": change(impratio=300.0),
    "conjugate gradients": change(solver=int(mujoco.mjtSolver.mjSOL_CG)),
    "pyramids for cones": change(cone=int(mujoco.mjtCone.mjCONE_PYRAMIDAL)),
}


def warned_steps(setting: Callable[[mujoco.MjModel], None]) -> tuple[list[Warned], int]:
    """Steps that are warned of while robots are put down, and how many there are in all."""
    found: list[Warned] = []
    steps = 0

    def watch(model: mujoco.MjModel, data: mujoco.MjData, count: int = 1) -> None:
        nonlocal steps
        state = np.empty(mujoco.mj_stateSize(model, STATE))
        for _ in range(count):
            mujoco.mj_getState(model, data, state, STATE)
            before = warning_counts()[WARNING]
            STEP(model, data)
            steps += 1
            if warning_counts()[WARNING] > before:
                found.append(Warned(copy.copy(model), state.copy()))

    env = TetrapodGait(gait="crawl")
    setting(env.model)
    with patch.object(mujoco, "mj_step", watch):
        for seed in range(EPISODES):
            env.reset(seed=seed, options={"randomise": 0.2})
    return found, steps


def again(step: Warned, setting: Callable[[mujoco.MjModel], None]) -> tuple[Any, bool]:
    """Velocities after a step with other settings, and whether it is warned of."""
    model = copy.copy(step.model)
    setting(model)
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, step.state, STATE)
    before = warning_counts()[WARNING]
    STEP(model, data)
    return data.qvel.copy(), warning_counts()[WARNING] > before


def main() -> None:
    """Prints the table."""
    command_line(__doc__).parse_args()
    found, steps = warned_steps(SETTINGS["as it is"])
    exact = [again(step, change(tolerance=0.0, iterations=1000))[0] for step in found]
    rows = []
    for name, setting in SETTINGS.items():
        results = [again(step, setting) for step in found]
        off = max(
            float(np.abs(velocity - true).max() / np.abs(true).max())
            for (velocity, _), true in zip(results, exact, strict=True)
        )
        elsewhere = len(warned_steps(setting)[0])
        rows.append([name, f"{sum(warned for _, warned in results)}", f"{off:.0e}", f"{elsewhere}"])
    print(f"{len(found)} of {steps} steps of {EPISODES} robots put down\n")
    print("\n".join(table(["", "of these warned", "velocity", "warned of 150 put down"], rows)))


if __name__ == "__main__":
    main()
