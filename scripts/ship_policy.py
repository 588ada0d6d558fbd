"""Measures a policy of a training run and puts it beside those that come with the package.

    python scripts/ship_policy.py runs/gaits/TetrapodWalk/seed_0 tetrapod-walk-sac

It walks 16 robots that are off by 20 %, with seeds that no training draws; what that gave goes into
the policy's file, as its ``evaluation``. The run's learning curve goes beside it.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from tca_mj.agents.evaluate import Evaluation, evaluate, report
from tca_mj.agents.policies import SavedPolicy
from tca_mj.agents.policies.load import find

POLICIES = Path(__file__).resolve().parent.parent / "agents" / "policies"
ROBOTS = {"episodes": 16, "seed": 1000, "randomise": 0.2}
KEPT = ("speed", "energy_per_metre", "peak_temperature", "return", "success", "duration")


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="folder of a training run, or a policy in it")
    parser.add_argument("name", help="of the policy")
    parser.add_argument("--workers", type=int, default=1)
    arguments = parser.parse_args(argv)
    file = find(arguments.run)
    saved = SavedPolicy.read(file)
    evaluation = Evaluation(task=saved.task, policy=str(file), **ROBOTS)
    summary = evaluate(evaluation, workers=arguments.workers)
    figures = {name: summary["figures"][name] for name in KEPT if name in summary["figures"]}
    path = replace(saved, evaluation={**ROBOTS, "figures": figures}).save(
        POLICIES / f"{arguments.name}{file.suffix}"
    )
    curves = (file.parent / name for name in ("evaluations.csv", "curve.csv"))
    curve = next(path for path in curves if path.is_file())
    path.with_suffix(".csv").write_bytes(curve.read_bytes())
    print(f"{report(summary)}\n\n{path}")


if __name__ == "__main__":
    main()
