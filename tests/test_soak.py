"""A soak takes the steps that it says, finds what is planted, and goes on where it was killed."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tca_mj import cli
from tca_mj.bench import soak as module
from tca_mj.bench.soak import WAYS, drawn, faults, report, soak
from tca_mj.envs.reach import BendReach
from tca_mj.registry import TASKS, make

QUICK = "TCA/BendReach-v0"
FEW: dict[str, Any] = {"ids": [QUICK], "turn": 5, "say": lambda _: None}


def known(result: dict[str, Any]) -> list[dict[str, Any]]:
    """What does not depend on the machine."""
    times = ("seconds", "turns", "steps")
    return [{k: v for k, v in way.items() if k not in times} for way in result["ways"]]


def test_every_way_has_its_turn_and_nothing_is_wrong(tmp_path: Path) -> None:
    said: list[str] = []
    result = soak(steps=40, out=tmp_path, **FEW | {"say": said.append})
    assert [(way["task"], way["way"]) for way in result["ways"]] == [(QUICK, w) for w in WAYS]
    turn = [5, 20, 20]  # four tasks at once
    assert [way["steps"] for way in result["ways"]] == turn
    assert faults(result) == 0 and result["examples"] == []
    assert all(25.0 < way["hottest"] < 180.0 for way in result["ways"])
    assert said[-1].startswith("45 of 40 steps, 0 episodes")
    assert json.loads((tmp_path / "soak.json").read_text()) == json.loads(json.dumps(result))
    page = (tmp_path / "soak.md").read_text()
    assert page == report(result) + "\n" and f"| {QUICK}, vector, power | 20 |" in page


def test_it_goes_on_where_it_was_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = soak(steps=45, **FEW)

    def killed(line: str) -> None:  # after a turn; only what is in the folder is left
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(module, "_LINE", -1.0)
        for _ in range(2):
            with pytest.raises(KeyboardInterrupt):
                soak(steps=45, out=tmp_path, **FEW | {"say": killed})
    broken = soak(steps=45, out=tmp_path, **FEW)
    assert [row[0] for row in broken["memory"]] == [1, 2, 3]
    assert known(broken) == known(whole)
    assert soak(steps=45, out=tmp_path, **FEW)["memory"] == broken["memory"]  # there is no more
    with pytest.raises(ValueError, match="without another soak"):
        soak(steps=45, out=tmp_path, seed=1, **FEW)


def test_what_is_planted_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = BendReach.finish
    calls = 0

    def broken(task: BendReach, drive: Any, error: Any) -> Any:
        nonlocal calls
        calls += 1
        observation, reward, terminated, truncated, info = plain(task, drive, error)
        if calls == 1:
            observation[0] = np.nan
        elif calls == 2:
            observation[:] = 1e9
        elif calls == 3:
            reward = np.inf
        elif calls == 4:
            info["tension"] = info["tension"] * np.nan
        elif calls == 5:
            task.data.qvel[:] = np.nan
        elif calls == 8:
            truncated, info["truncation_reason"] = True, "overheated: a TCA"
            info["temperature"] = info["temperature"] + 200.0
        elif calls > 10:
            raise ZeroDivisionError("by nothing")
        return observation, reward, terminated, truncated, info

    monkeypatch.setattr(BendReach, "finish", broken)
    result = soak(steps=1, ids=[QUICK], turn=20, say=lambda _: None)
    single = result["ways"][0]
    assert single["faults"] == dict.fromkeys(
        ("observation is no number", "observation outside its space", "reward is no number",
         "tension in info is no number", "diverged", "TCA too hot", "ZeroDivisionError"), 1,
    )  # fmt: skip
    assert single["endings"] == {"diverged": 1, "overheated": 1}
    assert (single["steps"], single["episodes"], faults(result)) == (10, 2, 7)
    assert result["examples"][-1] == (
        f"{QUICK}, single, turn 0, step 10: ZeroDivisionError, by nothing"
    )
    assert f"Fault: {result['examples'][-1]}" in report(result)


@pytest.mark.parametrize("id", [task.id for task in TASKS])
def test_options_are_drawn_within_their_bounds(id: str) -> None:
    task = make(id, disable_env_checker=True).unwrapped
    random = np.random.default_rng(0)
    found = [drawn(task.options, random) for _ in range(60)]
    assert 15 < sum(each is None for each in found) < 45
    named = {name for each in found for name in each or ()}
    bounded = {row.name for row in task.options.rows if row.choices or np.isfinite(row.high)}
    checked = {row.name for row in task.options.rows if row.check is not None}
    assert bounded - checked <= named <= bounded
    assert "randomise" in named
    for each in found[:6]:
        task.reset(seed=0, options=each)


def test_the_command_says_whether_it_found_something(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = module.soak
    monkeypatch.setattr(module, "soak", lambda **told: plain(**told | {"turn": 5}))
    told = ["bench", "soak", "--steps", "300", "--quick", "--task", QUICK, "--out", str(tmp_path)]
    assert cli.main(told) == 0
    assert f"{tmp_path / 'soak.md'}" in capsys.readouterr().out
    path = tmp_path / "soak.json"
    result = json.loads(path.read_text())
    result["ways"][0]["faults"] = {"reward is no number": 1}
    path.write_text(json.dumps(result))
    assert cli.main(told) == 1


def test_wrong_soaks_are_refused() -> None:
    for wrong in ({"steps": 0}, {"turn": 0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            soak(**{"ids": [QUICK], **wrong})
    with pytest.raises(ValueError, match="task must be"):
        soak(ids=["TCA/Nothing-v0"])
