"""Measures a policy of a training run and puts it beside those that come with the package.

    python scripts/ship_policy.py runs/gaits/TetrapodWalk/seed_0 tetrapod-walk-sac
    python scripts/ship_policy.py runs/command tetrapod-command --alike     left and right the same

It walks 16 robots that are off by 20 %, with seeds that no training draws; what that gave goes into
the policy's file, as its ``evaluation``. The run's learning curve goes beside it.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from tca_mj.agents.evaluate import Evaluation, evaluate, report
from tca_mj.agents.policies import SavedPolicy
from tca_mj.agents.policies.load import find
from tca_mj.registry import make

POLICIES = Path(__file__).resolve().parent.parent / "agents" / "policies"
ROBOTS = {"episodes": 16, "seed": 1000, "randomise": 0.2}
KEPT = ("speed", "energy_per_metre", "peak_temperature", "return", "success", "duration")


def alike(saved: SavedPolicy) -> SavedPolicy:
    """A policy whose network treats left and right alike; its file says so."""
    assert saved.network is not None
    task = make(saved.task, **saved.arguments).unwrapped
    network = saved.network.alike(task.table.mirror, task.action.mirror)
    source = "; ".join(filter(None, (saved.origin.source, "made alike on both sides")))
    return replace(saved, network=network, origin=replace(saved.origin, source=source))


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="folder of a training run, or a policy in it")
    parser.add_argument("name", help="of the policy")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--alike", action="store_true", help="see Network.alike")
    arguments = parser.parse_args(argv)
    file = find(arguments.run)
    saved = SavedPolicy.read(file)
    curves = (file.parent / name for name in ("evaluations.csv", "curve.csv"))
    curve = next((path for path in curves if path.is_file()), file.with_suffix(".csv")).read_bytes()
    path = POLICIES / f"{arguments.name}{file.suffix}"
    if arguments.alike:
        saved = alike(saved)
    saved.save(path)
    evaluation = Evaluation(task=saved.task, policy=str(path), **ROBOTS)
    summary = evaluate(evaluation, workers=arguments.workers)
    figures = {name: summary["figures"][name] for name in KEPT if name in summary["figures"]}
    replace(saved, evaluation={**ROBOTS, "figures": figures}).save(path)
    path.with_suffix(".csv").write_bytes(curve)
    print(f"{report(summary)}\n\n{path}")


if __name__ == "__main__":
    main()
