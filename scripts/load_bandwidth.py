"""How fast a load the observer can follow: its error of the force, and the bound, over bandwidth.

    python scripts/load_bandwidth.py           prints the table
    python scripts/load_bandwidth.py --page    writes it into docs/bench.md; a minute or two
    python scripts/load_bandwidth.py --others  other seeds, and an observer that is told too little
                                               or too much

A load of 20 g that wanders by a quarter of itself (standard deviation), and comes back within
1/(2 pi f): noise of first order of the bandwidth f, an Ornstein-Uhlenbeck process. The observer is
told f and by how much it wanders, but not about which weight. The bound is that of Cramer and Rao
for who knows the same: ``TcaObserver.bound``.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import norm

from tca_mj.checks import Array
from tca_mj.pages import command_line, table, write_between
from tca_mj.tca import HeatStep, ObserverSpec, TcaBank, TcaObserver
from tca_mj.validation.sensors import SENSED
from tca_mj.validation.strokes import weight

PAGE = Path(__file__).resolve().parent.parent / "docs" / "bench.md"
MARK = "scripts/load_bandwidth.py"
WEIGHT, SHARE = weight(20), 0.25
BANDWIDTHS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # [Hz]
DT, LATE, SECONDS, RUNS = 0.01, 6.0, 12.0, 200  # as 100 readings per second


def powers(swing: float) -> Array:
    """Power that keeps the TCA 50 K warm on average, and changes by a share every 2 s [W]."""
    time = DT * np.arange(round(SECONDS / DT))
    return 50.0 * float(SENSED.heat.loss) * (1.0 + swing * np.where(time % 4.0 < 2.0, 1.0, -1.0))


def followed(
    bandwidth: float, loss_error: float, swing: float, *, seed: int = 3, told: float = 1.0
) -> tuple[float, float]:
    """Error of the force from 6 s on and its bound, over 20 g.

    Args:
        bandwidth: Of the load [Hz].
        loss_error: How well the heat loss is known [1].
        swing: By which share the power changes [1].
        seed: Of loads and noise.
        told: The bandwidth that the observer is told, over the true one [1].
    """
    random, deviation = np.random.default_rng(seed), SHARE * WEIGHT
    rate = 2.0 * np.pi * bandwidth
    spec = ObserverSpec(
        loss_error=loss_error, tension_rate=deviation * np.sqrt(2.0 * rate),
        load_bandwidth=bandwidth,
    )  # fmt: skip
    knows = TcaObserver(TcaBank([SENSED], law="surface"), spec)
    observer = TcaObserver(knows.bank, replace(
        spec, tension_rate=spec.tension_rate * np.sqrt(told), load_bandwidth=told * bandwidth,
    ))  # fmt: skip
    heat, stays = observer.bank.heat, float(np.exp(-rate * DT))
    stirred = deviation * np.sqrt(1.0 - stays**2)

    def heated(ratio: Array, warm: Array, power: float) -> Array:
        step = HeatStep.of(replace(heat, loss=heat.loss / ratio), DT)
        return step.advance(warm, np.full_like(warm, 25.0), power + 0.0 * warm)[0]

    def state(warm: Array, load: Array) -> Array:
        length, air = observer.under_load(warm, load), np.full_like(warm, 25.0)
        return np.stack([warm, air, length, ratio, np.full_like(warm, WEIGHT)])

    def read(warm: Array, load: Array) -> Array:
        return observer.expected(replace(blank, mean=state(warm, load)))

    # Losses, one from each part of their distribution that is as likely: chance would add to it.
    ratio = 1.0 + loss_error * norm.ppf((random.permutation(RUNS)[:, None] + 0.5) / RUNS)
    course = powers(swing)
    first = float(course.mean() / heat.loss[0])
    warm = 25.0 + first * ratio
    load = WEIGHT + deviation * random.standard_normal((RUNS, 1))
    blank = observer.begin(np.full((RUNS, 1), 7.0))
    noisy = read(warm, load) + spec.resistance_noise * random.standard_normal((RUNS, 1))
    estimate = observer.begin(noisy, steady_power=float(course.mean()))  # T and r are off together
    truth, off = [state(warm, load)], []
    for power in course:
        warm = heated(ratio, warm, power)
        warm = warm + spec.temperature_rate * np.sqrt(DT) * random.standard_normal((RUNS, 1))
        load = WEIGHT + stays * (load - WEIGHT) + stirred * random.standard_normal((RUNS, 1))
        truth.append(state(warm, load))
        noisy = read(warm, load) + spec.resistance_noise * random.standard_normal((RUNS, 1))
        estimate = observer.corrected(observer.predicted(estimate, power, DT), noisy)
        off.append(observer.tension(estimate).tension - load)
    all_powers = np.broadcast_to(course[:, None, None], (len(course), RUNS, 1))
    low = knows.bound(np.array(truth), all_powers, DT, steady_power=float(course.mean()))[2]
    late = slice(round(LATE / DT), None)
    return tuple(float(np.sqrt(np.mean(np.square(each[late])))) / WEIGHT
                 for each in (off, low))  # type: ignore[return-value]  # fmt: skip


CASES = {
    "heat loss nominal": (0.0, 0.0),
    "known to 20 %, constant power": (0.2, 0.0),
    "known to 20 %, power ± 50 %, 4 s": (0.2, 0.5),
}


def cell(bandwidth: float, case: str, **other: float) -> str:
    """Bound and error in per cent of 20 g, and their ratio."""
    error, bound = followed(bandwidth, *CASES[case], **other)  # type: ignore[arg-type]
    return f"{100 * bound:.2g}, {100 * error:.2g} ({error / bound:.2f})"


def bandwidth_table() -> list[str]:
    """That of each bandwidth in each case."""
    rows = [[f"{each:g}", *(cell(each, case) for case in CASES)] for each in BANDWIDTHS]
    return table(["bandwidth of the load [Hz]", *CASES], rows)


def main() -> None:
    """Prints the table, or writes it into the page, between its marks."""
    parser = command_line(__doc__)
    parser.add_argument("--page", action="store_true", help="write the table into docs/bench.md")
    parser.add_argument("--others", action="store_true", help="other seeds, other bandwidths told")
    asked = parser.parse_args()
    if asked.others:
        case = list(CASES)[-1]
        others: list[dict[str, float]] = [{"seed": 11}, {"seed": 12}, {"seed": 13}, {"told": 0.3},
                                          {"told": 3.0}]  # fmt: skip
        for other in others:
            print(other, *(cell(each, case, **other) for each in BANDWIDTHS), sep="; ", flush=True)
        return
    lines = bandwidth_table()
    print("\n".join(lines))
    if asked.page:
        write_between(PAGE, MARK, lines)


if __name__ == "__main__":
    main()
