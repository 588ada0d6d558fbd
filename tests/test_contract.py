"""A policy says what it was made for, and is refused where that is not what there is."""

import json
from dataclasses import replace

import numpy as np
import pytest

import tca_mj
from tca_mj.agents.policies import (
    Network,
    Origin,
    SavedPolicy,
    contract,
    differences,
    digest,
    load_policy,
)
from tca_mj.modules import BendingSpec
from tca_mj.tca import Plies, with_tca

REACH = "TCA/BendReach-v0"


@pytest.fixture(scope="module")
def env():
    return tca_mj.make(REACH)


@pytest.fixture(scope="module")
def saved(env):
    inputs, outputs = env.observation_space.shape[0], env.action_space.shape[0]
    network = Network(
        weights=(np.zeros((outputs, inputs)),), biases=(np.zeros(outputs),),
        mean=np.zeros(inputs), var=np.ones(inputs),
    )  # fmt: skip
    return SavedPolicy(
        task=REACH, origin=Origin(algorithm="by hand", seed=0, steps=0), network=network,
        arguments={"action": "temperature"}, made_for=contract(env),
        evaluation={"episodes": 2, "figures": {"return": {"mean": 1.0}}},
    )  # fmt: skip


def test_a_file_keeps_contract_and_evaluation(env, saved, tmp_path):
    path = saved.save(tmp_path / "policy.npz")
    found = SavedPolicy.read(path)
    assert found.made_for == saved.made_for == contract(env)
    assert found.evaluation == saved.evaluation
    header = json.loads(str(np.load(path)["header"]))
    assert header["contract"] == digest(saved.made_for)
    observation, _ = env.reset(seed=0)
    assert load_policy(path, env).act(observation).tolist() == [0.0] * 3


def test_another_robot_is_refused_unless_it_is_wanted(saved, tmp_path):
    path = saved.save(tmp_path / "policy.npz")
    other = tca_mj.make(REACH, module_spec=BendingSpec(length=0.05))
    with pytest.raises(ValueError, match=r"robot: 'length' 0\.045, not 0\.05 .*other_robot=True"):
        load_policy(path, other)
    load_policy(path, other, other_robot=True)


def _changed(made_for, part, name, row):
    return {**made_for, part: {**made_for[part], name: row}}


def test_what_differs_is_said(saved, tmp_path, env):
    made_for = saved.made_for
    less = {name: row for name, row in made_for["observation"].items() if name != "TCA length"}
    smell = _changed(made_for, "observation", "smell", [1, "-", 0.0, None])
    for changed, message in (
        (smell, "'smell' .*, not missing"),
        ({**made_for, "observation": less}, "'TCA length' missing, not "),
        (_changed(made_for, "action", "TCA heating", [4, "-", 0.0, None]), "action: 'TCA heating'"),
        (_changed(made_for, "timing", "control_period", 0.5), "'control_period' 0.5, not 0.1"),
        ({**made_for, "observation": dict(reversed(made_for["observation"].items()))}, "order"),
    ):
        path = replace(saved, made_for=changed).save(tmp_path / "other.npz")
        with pytest.raises(ValueError, match=message):
            load_policy(path, env)
        assert digest(changed) != digest(made_for) or "order" in message
    assert differences(made_for, made_for) == []


def test_what_is_none_is_as_good_as_missing_and_figures_have_no_order(saved):
    """Files from before a robot could have a part, or its figures stood elsewhere, stay good."""
    made_for, robot = saved.made_for, saved.made_for["robot"]
    assert robot["tca.plies"] is None
    older = {name: robot[name] for name in reversed(robot) if name != "tca.plies"}
    assert differences({**made_for, "robot": older}, made_for) == []
    assert differences(made_for, {**made_for, "robot": older}) == []
    plied = with_tca(BendingSpec(), replace(BendingSpec().tca, plies=Plies(strands=2)))
    apart = differences(made_for, contract(tca_mj.make(REACH, module_spec=plied)))
    assert "'tca.plies.strands' missing, not 2" in apart[-1]


def test_a_contract_is_plain_and_complete(env):
    made_for = contract(env)
    assert json.loads(json.dumps(made_for)) == made_for
    assert sum(row[0] for row in made_for["observation"].values()) == env.observation_space.shape[0]
    assert made_for["robot"]["length"] == 0.045 and len(made_for["robot"]) > 20


@pytest.mark.parametrize("broken", ["x", [1], {"robot": 3}])
def test_a_broken_contract_is_no_policys(saved, tmp_path, broken):
    path = saved.save(tmp_path / "policy.npz")
    arrays = dict(np.load(path))
    header = json.loads(str(arrays["header"]))
    arrays["header"] = np.array(json.dumps(header | {"made_for": broken}))
    np.savez(path, **arrays)
    with pytest.raises(ValueError, match="made_for must be"):
        SavedPolicy.read(path)
