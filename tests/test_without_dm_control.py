"""Without dm-control, as on Python 3.13, everything works but its named view and its window."""

import json
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from tca_mj.envs import rewards
from tca_mj.registry import TASKS

# A step of every task, and what says that dm-control is missing.
HIDDEN = """
import json, sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("dm_control", "labmaze"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hidden())
import gymnasium as gym
from tca_mj.envs import rewards, viewer
from tca_mj.registry import TASKS
assert rewards.tolerance is rewards.closed_form
earned = {}
for task in TASKS:
    env = gym.make(task.id, disable_env_checker=True)
    env.reset(seed=1)
    env.action_space.seed(1)
    earned[task.id] = [env.step(env.action_space.sample())[1] for _ in range(2)]
viewer.need_display = lambda: None
said = []
for missing in (env.unwrapped.sim.physics, lambda: viewer.launch(env, None)):
    try:
        missing()
    except ImportError as error:
        said.append(str(error))
print(json.dumps([earned, said]))
"""


def test_every_task_steps_and_earns_the_same_to_the_last_bit():
    pytest.importorskip("dm_control")
    done = subprocess.run(
        [sys.executable, "-c", HIDDEN], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    earned, said = json.loads(done.stdout)
    missing = " is that of dm-control, which is not installed"
    assert [text.partition(missing)[0] for text in said] == [
        "the named view", "the window",
    ]  # fmt: skip
    assert list(earned) == [task.id for task in TASKS]
    for task in TASKS:
        env = gym.make(task.id, disable_env_checker=True)
        env.reset(seed=1)
        env.action_space.seed(1)
        assert earned[task.id] == [env.step(env.action_space.sample())[1] for _ in range(2)]


@pytest.mark.parametrize("sigmoid", [{}, {"sigmoid": "linear", "value_at_margin": 0.0}])
def test_the_closed_form_is_dm_controls(sigmoid):
    theirs = pytest.importorskip("dm_control.utils.rewards").tolerance
    x = np.concatenate([np.linspace(-0.2, 0.3, 1001), [0.0, 4e-3, 0.054, np.inf, np.nan]])
    for each in x.tolist():
        ours = rewards.closed_form(each, (0.0, 4e-3), 0.05, **sigmoid)
        assert repr(ours) == repr(float(theirs(each, (0.0, 4e-3), 0.05, **sigmoid)))
    assert rewards.closed_form(0.054, (0.0, 4e-3), 0.05) == pytest.approx(0.1)
    if not sigmoid:
        assert rewards.tolerance is theirs
