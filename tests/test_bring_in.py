"""The commands take models of Stable-Baselines3, also for a task outside the package."""

import json
import pickle
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import onnx
import onnxruntime
import pytest
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize

from tca_mj import cli
from tca_mj.agents import sweep as sweeping
from tca_mj.agents.evaluate import Evaluation, evaluate
from tca_mj.agents.policies import Preprocessing, SavedPolicy, Statistics, load_policy
from tca_mj.agents.rollout import rollout
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.envs import viewer
from tca_mj.machine import how_to_install

ROOT = Path(__file__).parent.parent
NOD = "own_task:Example/Turn-v0"
MADE = {"action": "power", "control_period": 0.2}
TOLD = ["--action", "power", "--control-period", "0.2"]
REACH = "TCA/BendReach-v0"


@pytest.fixture
def nod(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A model for ``NOD``, which heats all the time, made with ``MADE`` and scaled observations."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    monkeypatch.chdir(tmp_path)
    model = PPO("MlpPolicy", TaskVecEnv.make(NOD, 1, scaled=True, **MADE), n_steps=4, batch_size=4,
                device="cpu", seed=0)  # fmt: skip
    model.policy.action_net.bias.data.fill_(2.0)  # type: ignore[operator, union-attr]
    model.save("nod.zip")
    return Path("nod.zip")


def test_it_is_evaluated_and_shown_as_it_was_trained(nod: Path, capsys: Any) -> None:
    command = ["eval", str(nod), "--task", NOD, "--episodes", "1", "--steps", "5", "--out", "e"]
    assert cli.main([*command, *TOLD]) == 0
    summary = json.loads(Path("e/summary.json").read_text())
    assert summary["settings"]["arguments"] == MADE
    # Five steps of 0.2 s at the full power of nine TCAs, 2 W each.
    assert summary["episodes"][0]["energy"] == pytest.approx(18.0, rel=1e-6)
    demo = ["demo", "--policy", str(nod), "--task", NOD, "--no-video", "--out", "d"]
    assert cli.main([*demo, *TOLD]) in (0, 1)
    assert json.loads(Path("d/summary.json").read_text())["policy"] == "nod.zip"
    assert "nod.zip in own_task" in capsys.readouterr().out


def test_it_is_viewed_and_swept(nod: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Any] = []
    monkeypatch.setattr(viewer, "need_display", lambda: None)
    monkeypatch.setattr(viewer, "launch", lambda env, policy, **_: shown.append((env, policy)))
    assert cli.main(["view", NOD, "--policy", str(nod), *TOLD]) == 0
    ((env, _),) = shown
    assert (env.unwrapped.heating, env.unwrapped.control_period) == ("power", 0.2)
    swept: list[Any] = []
    monkeypatch.setattr(sweeping, "run_sweep", lambda sweep, out, **_: swept.append(sweep))
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: "")
    command = ["sweep", str(nod), "--task", NOD, "--out", "s", "--set", "seed=0,1", "--scaled"]
    assert cli.main([*command, *TOLD]) == 0
    (first, _) = (trial.evaluation(Path()) for trial in swept[0].trials())
    assert first.arguments == MADE and first.preprocessing == Preprocessing(scaled=True)


def test_a_sweep_that_trains_is_not_told_how(capsys: Any, tmp_path: Path) -> None:
    command = ["sweep", "--algo", "sac", "--task", REACH, "--out", str(tmp_path), "--scaled"]
    assert cli.main(command) == 2
    assert "is said of POLICY, not with --algo" in capsys.readouterr().err


def test_it_becomes_a_policy_of_this_package_and_onnx(nod: Path, capsys: Any) -> None:
    command = ["export", str(nod), "--task", NOD, *TOLD]
    assert cli.main([*command, "--npz", "nod.npz"]) == 0
    assert cli.main([*command, "--onnx", "nod.onnx"]) == 0
    assert capsys.readouterr().out.split() == ["nod.npz", "nod.onnx"]
    saved = SavedPolicy.read("nod.npz")
    assert (saved.task, saved.arguments) == (NOD, MADE)
    # From here on nobody says how it was trained.
    assert cli.main(["export", "nod.npz", "--onnx", "again.onnx"]) == 0
    assert Path("again.onnx").read_bytes() == Path("nod.onnx").read_bytes()
    command = ["eval", "nod.npz", "--task", NOD, "--episodes", "1", "--steps", "5", "--out", "e"]
    assert cli.main(command) == 0
    model = onnx.load("nod.onnx")
    noted = {entry.key: entry.value for entry in model.metadata_props}
    assert noted["task"] == NOD and json.loads(noted["arguments"]) == MADE
    assert [(kind.domain, kind.version) for kind in model.opset_import] == [("", 17)]
    (given,), (found,) = model.graph.input, model.graph.output
    assert (given.name, found.name) == ("observation", "action")
    env = gym.make(NOD, **MADE)
    row = env.reset(seed=0)[0]
    session = onnxruntime.InferenceSession("nod.onnx")
    (action,) = session.run(None, {"observation": np.stack([row, row])})
    expected = load_policy("nod.npz", env).act(row)
    np.testing.assert_allclose(action, [expected, expected], rtol=0.0, atol=1e-6)


def test_shipped_networks_become_onnx_and_gaits_do_not(tmp_path: Path, capsys: Any) -> None:
    assert cli.main(["export", "bend-reach", "--onnx", str(tmp_path / "a.onnx")]) == 0
    policy = load_policy("bend-reach", env := gym.make(REACH, action="power"))
    rows = np.array([step.observation for seed in range(36) for step in rollout(
        env, policy, seed=seed)])[:1000]  # fmt: skip
    (actions,) = onnxruntime.InferenceSession(str(tmp_path / "a.onnx")).run(
        None, {"observation": rows}
    )
    expected = np.array([policy.act(row) for row in rows])
    assert len(rows) == 1000
    np.testing.assert_allclose(actions, expected, rtol=0.0, atol=1e-6)
    capsys.readouterr()
    assert cli.main(["export", "tetrapod-walk", "--onnx", str(tmp_path / "b.onnx")]) == 2
    assert "must be a network to become ONNX, got a gait" in capsys.readouterr().err
    assert cli.main(["export", "bend-reach", "--onnx", str(tmp_path / "b.txt")]) == 2
    assert "must end in .onnx" in capsys.readouterr().err
    walk, reach = (SavedPolicy.read(ROOT / "agents" / "policies" / name)
                   for name in ("tetrapod-walk.json", "bend-reach.npz"))  # fmt: skip
    residual = SavedPolicy(task=walk.task, origin=walk.origin, gait=walk.gait, bound=20.0,
                           steering=walk.steering, network=reach.network)  # fmt: skip
    with pytest.raises(ValueError, match="got a residual"):
        residual.to_onnx(tmp_path / "b.onnx")


def test_without_onnx_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Any
) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "onnx", None)
    assert cli.main(["export", "bend-reach", "--onnx", str(tmp_path / "a.onnx")]) == 2
    assert how_to_install("onnx") in capsys.readouterr().err


def test_statistics_need_no_trust_without_a_pickle(tmp_path: Path, capsys: Any) -> None:
    tasks = VecNormalize(TaskVecEnv.make(REACH, 1), clip_obs=5.0)
    model = SAC("MlpPolicy", tasks, buffer_size=4, device="cpu", seed=0,
                policy_kwargs={"net_arch": [8]})  # fmt: skip
    model.save(tmp_path / "reach.zip")
    tasks.reset()
    tasks.save(str(tmp_path / "reach.pkl"))
    rms: Any = tasks.obs_rms
    np.savez(tmp_path / "reach.npz", mean=rms.mean, var=rms.var, clip=5.0, epsilon=tasks.epsilon)
    command = ["eval", str(tmp_path / "reach.zip"), "--task", REACH, "--episodes", "1", "--steps",
               "3", "--out", str(tmp_path / "e"), "--normalize"]  # fmt: skip
    assert cli.main([*command, str(tmp_path / "reach.pkl")]) == 2
    said = capsys.readouterr().err
    assert "reach.pkl must be trusted or an .npz" in said and said.count("\n") == 1
    assert cli.main([*command, str(tmp_path / "nothing.npz")]) == 2
    assert "nothing.npz" in capsys.readouterr().err
    returns = []
    for more in ([str(tmp_path / "reach.pkl"), "--trust"], [str(tmp_path / "reach.npz")]):
        assert cli.main([*command, *more]) == 0
        summary = json.loads((tmp_path / "e" / "summary.json").read_text())
        returns.append(summary["episodes"][0]["return"])
    assert returns[0] == returns[1]
    bare = Evaluation(task=REACH, policy=str(tmp_path / "reach.zip"), episodes=1, steps=3)
    assert evaluate(bare, progress=False)["episodes"][0]["return"] != returns[0]


def test_what_differs_in_how_it_was_trained_is_not_mixed(nod: Path) -> None:
    statistics = Statistics(mean=(0.0,) * 3, var=(1.0,) * 3, clip=None, epsilon=0.0)
    ways: list[dict[str, Any]] = [
        {}, {"arguments": MADE}, {"arguments": {"action": "power"}},
        {"preprocessing": Preprocessing(scaled=True)},
        {"preprocessing": Preprocessing(statistics=statistics)},
    ]  # fmt: skip
    made = [Evaluation(task=NOD, policy=str(nod), **way) for way in ways]
    assert len({evaluation.key() for evaluation in made}) == len(ways)
    assert pickle.loads(pickle.dumps(made)) == made  # as processes get them


@pytest.mark.parametrize("policy", ["scripted", "bend-reach"])
def test_who_knows_how_it_sees_is_not_told(policy: str, capsys: Any, tmp_path: Path) -> None:
    command = ["eval", policy, "--task", REACH, "--out", str(tmp_path), "--scaled"]
    assert cli.main(command) == 2
    assert "must be a .zip to be told how it sees the task" in capsys.readouterr().err


def test_a_broken_model_is_one_line(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "bad.zip").write_bytes(b"PK\x03\x04 nothing")
    for command in (
        ["eval", str(tmp_path / "bad.zip"), "--task", REACH, "--out", str(tmp_path / "e")],
        ["demo", "--policy", str(tmp_path / "bad.zip"), "--task", REACH],
        ["export", str(tmp_path / "bad.zip"), "--task", REACH, "--npz", str(tmp_path / "a.npz")],
    ):
        assert cli.main(command) == 2
        said = capsys.readouterr().err
        assert "bad.zip is no model of Stable-Baselines3" in said and said.count("\n") == 1


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "soon"])
def test_a_period_is_a_time(text: str, capsys: Any) -> None:
    with pytest.raises(SystemExit):
        cli.main(["view", REACH, "--control-period", text])
    assert f"must be a number above 0 s, got {text!r}" in capsys.readouterr().err


def test_the_folder_of_the_best_model_is_a_policy(tmp_path: Path) -> None:
    """As Stable-Baselines3's own callback leaves it."""
    model = SAC("MlpPolicy", TaskVecEnv.make(REACH, 1), buffer_size=4, device="cpu", seed=0,
                policy_kwargs={"net_arch": [8]})  # fmt: skip
    model.save(tmp_path / "best_model.zip")
    env = gym.make(REACH)
    row = env.reset(seed=0)[0]
    np.testing.assert_allclose(
        load_policy(tmp_path, env).act(row), model.predict(row, deterministic=True)[0],
        rtol=0.0, atol=1e-6,
    )  # fmt: skip
