"""How often, and how fast, the scripted controller finishes the tetrapod's course.

    python scripts/course_table.py --seeds 10 --friction 0.2 --out runs/course/friction
    python scripts/course_table.py --seeds 10 --everything 0.2 --out runs/course/everything
    python scripts/course_table.py --first 210 --everything 0.2 --out runs/course/quick
        --policy tca_mj.agents.scripts.course_quick:specialists

Prints a Markdown table, one row per seed, and writes each row to the folder as soon as it is known;
rows that lie there already are not run again unless --fresh is given.
"""

import argparse
import json
import shutil
from pathlib import Path

import numpy as np

from tca_mj.agents.demo import play
from tca_mj.envs.course import TetrapodCourse


def row(
    seed: int, options: dict[str, float], out: Path, policy: str = "scripted"
) -> dict[str, object]:
    """The summary of one episode, from the folder or run now."""
    path = out / f"seed{seed}.json"
    if path.is_file():
        return json.loads(path.read_text(encoding="utf-8"))
    result = play("TCA/TetrapodCourse-v0", policy, seed=seed, options=options, progress=False)
    path.write_text(json.dumps(result, indent=2), encoding="utf-8")
    return result


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--friction", type=float, default=0.0, help="share by which it is off")
    parser.add_argument("--everything", type=float, default=0.0, help="the same of the robot")
    parser.add_argument("--policy", default="scripted", help="who walks; each into its own --out")
    parser.add_argument("--out", type=Path, default=Path("runs/course"))
    parser.add_argument("--fresh", action="store_true")
    args = parser.parse_args(argv)
    if args.fresh:
        shutil.rmtree(args.out, ignore_errors=True)
    args.out.mkdir(parents=True, exist_ok=True)
    names = list(TetrapodCourse.published_speed)
    options = {"randomise_friction": args.friction, "randomise": args.everything}
    print("| seed | friction | finished | time | " + " | ".join(f"{n} [mm/s]" for n in names)
          + " | energy | hottest | largest tension |")  # fmt: skip
    print("|---" * (7 + len(names)) + "|", flush=True)
    rows = []
    for seed in range(args.first, args.first + args.seeds):
        result = row(seed, options, args.out, args.policy)
        rows.append(result)
        speeds = {r["name"]: 1e3 * r["speed"] for r in result["speeds"]}
        energy = sum(result["energy"].values()) + sum(result["heater_energy"].values())
        ended = "yes" if result["success"] else f"no: {result['ending']}"
        print(
            f"| {seed} | {result['friction']:.2f} | {ended} | {result['duration']:.0f} s | "
            + " | ".join(f"{speeds[n]:.2f}" if n in speeds else "" for n in names)
            + f" | {1e-3 * energy:.1f} kJ | {max(result['peak_temperature'].values()):.0f} °C"
            + f" | {max(result['peak_tension'].values()):.2f} N |",
            flush=True,
        )
    done = sum(bool(r["success"]) for r in rows)
    print(f"\n{done} of {len(rows)} finished.")
    for name in names:
        speeds = [1e3 * s["speed"] for r in rows for s in r["speeds"] if s["name"] == name]
        if speeds:
            share = 100.0 * np.mean(speeds) / (1e3 * TetrapodCourse.published_speed[name])
            print(f"{name}: {np.mean(speeds):.2f} mm/s, {share:.0f} % of the published speed")


if __name__ == "__main__":
    main()
