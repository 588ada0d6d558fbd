"""How fast a load the observer can follow: its error of the force, and the bound, over bandwidth.

    python scripts/load_bandwidth.py           prints the table
    python scripts/load_bandwidth.py --page    writes it into docs/bench.md; a minute or two

A load of 20 g that wanders by a quarter of itself (standard deviation), and comes back within
1/(2 pi f): noise of first order of the bandwidth f, an Ornstein-Uhlenbeck process. The bound is
that of Cramer and Rao for who knows f and by how much it wanders, but not about which weight: the
inverse of Fisher's information of the system linearised about its true course, as
``TcaObserver.bound``, whose load wanders freely, with the load and its mean as states. The observer
is told what the load wanders by in a short time, and nothing else.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import norm

from tca_mj.checks import Array
from tca_mj.files import write_whole
from tca_mj.pages import table
from tca_mj.tca import HeatStep, ObserverSpec, TcaBank, TcaObserver
from tca_mj.validation.sensors import SENSED
from tca_mj.validation.strokes import weight

PAGE = Path(__file__).resolve().parent.parent / "docs" / "bench.md"
MARK, END = "<!-- scripts/load_bandwidth.py -->", "<!-- end -->"
WEIGHT, SHARE = weight(20), 0.25
BANDWIDTHS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # [Hz]
DT, LATE, SECONDS, RUNS = 0.01, 6.0, 12.0, 40  # as 100 readings per second
_KELVIN, _NEWTON, _RATIO = 0.2, 1e-3, 1e-3  # of differences
_T, _R, _F, _M = range(4)


def powers(swing: float) -> Array:
    """Power that keeps the TCA 50 K warm on average, and changes by a share every 2 s [W]."""
    time = DT * np.arange(round(SECONDS / DT))
    return 50.0 * float(SENSED.heat.loss) * (1.0 + swing * np.where(time % 4.0 < 2.0, 1.0, -1.0))


def followed(bandwidth: float, loss_error: float, swing: float) -> tuple[float, float]:
    """Error of the force from 6 s on and its bound, over 20 g.

    Args:
        bandwidth: Of the load [Hz].
        loss_error: How well the heat loss is known [1].
        swing: By which share the power changes [1].
    """
    random, deviation = np.random.default_rng(3), SHARE * WEIGHT
    rate = 2.0 * np.pi * bandwidth
    spec = ObserverSpec(loss_error=loss_error, tension_rate=deviation * np.sqrt(2.0 * rate))
    observer = TcaObserver(TcaBank([SENSED], law="surface"), spec)
    heat, stays = observer.bank.heat, float(np.exp(-rate * DT))
    stirred = deviation * np.sqrt(1.0 - stays**2)

    def heated(ratio: Array, warm: Array, power: float) -> Array:
        step = HeatStep.of(replace(heat, loss=heat.loss / ratio), DT)
        return step.advance(warm, np.full_like(warm, 25.0), power + 0.0 * warm)[0]

    def read(warm: Array, load: Array) -> Array:
        length = observer.under_load(warm, load)
        mean = np.stack([warm, np.full_like(warm, 25.0), length, np.ones_like(warm)])
        return observer.expected(replace(blank, mean=mean))

    # Forty losses, one from each fortieth of their distribution: chance would add a tenth.
    ratio = 1.0 + loss_error * norm.ppf((random.permutation(RUNS)[:, None] + 0.5) / RUNS)
    course = powers(swing)
    first = float(course.mean() / heat.loss[0])
    warm = 25.0 + first * ratio
    load = WEIGHT + deviation * random.standard_normal((RUNS, 1))
    blank = observer.begin(np.full((RUNS, 1), 7.0))
    noisy = read(warm, load) + spec.resistance_noise * random.standard_normal((RUNS, 1))
    # The observer begins as ``bench_page.informed``: T and r are off together.
    estimate = observer.begin(noisy, np.full((RUNS, 1), 25.0 + first))
    tied = estimate.covariance.copy()
    tied[0, 0] = (loss_error * first) ** 2 + spec.start_error**2
    tied[0, 3] = tied[3, 0] = loss_error**2 * first
    estimate = replace(estimate, covariance=tied)
    # The bound's states: T, r, load, and the mean about which that wanders, not known at all.
    known = np.zeros((RUNS, 4, 4))
    known[:, _T, _T], known[:, _R, _R] = tied[0, 0, :, 0], loss_error**2
    known[:, _T, _R] = known[:, _R, _T] = loss_error**2 * first
    known[:, _M, _M] = known[:, _M, _F] = known[:, _F, _M] = WEIGHT**2
    known[:, _F, _F] = WEIGHT**2 + deviation**2

    def informed(known: Array) -> Array:
        """What a reading leaves."""
        slope = np.zeros((RUNS, 4))
        slope[:, _T] = ((read(warm + _KELVIN, load) - read(warm - _KELVIN, load))
                        / (2.0 * _KELVIN))[:, 0]  # fmt: skip
        slope[:, _F] = ((read(warm, load + _NEWTON) - read(warm, load - _NEWTON))
                        / (2.0 * _NEWTON))[:, 0]  # fmt: skip
        shared = np.einsum("kij,kj->ki", known, slope)
        spread = np.einsum("ki,ki->k", slope, shared) + spec.resistance_noise**2
        return known - shared[:, :, None] * shared[:, None, :] / spread[:, None, None]

    known, off, low = informed(known), [], []
    for power in course:
        moves = np.zeros((RUNS, 4, 4))
        after = heated(ratio, warm, power)
        moves[:, _T, _T] = (heated(ratio, warm + 1.0, power) - after)[:, 0]
        moves[:, _T, _R] = ((heated(ratio + _RATIO, warm, power) - after) / _RATIO)[:, 0]
        moves[:, _R, _R] = moves[:, _M, _M] = 1.0
        moves[:, _F, _F], moves[:, _F, _M] = stays, 1.0 - stays
        known = moves @ known @ moves.swapaxes(1, 2)
        known[:, _T, _T] += spec.temperature_rate**2 * DT
        known[:, _F, _F] += stirred**2
        warm = after + spec.temperature_rate * np.sqrt(DT) * random.standard_normal((RUNS, 1))
        load = WEIGHT + stays * (load - WEIGHT) + stirred * random.standard_normal((RUNS, 1))
        known = informed(known)
        noisy = read(warm, load) + spec.resistance_noise * random.standard_normal((RUNS, 1))
        estimate = observer.corrected(observer.predicted(estimate, power, DT), noisy)
        off.append(observer.tension(estimate).tension - load)
        low.append(np.sqrt(known[:, _F, _F]))
    late = slice(round(LATE / DT), None)
    return tuple(float(np.sqrt(np.mean(np.square(each[late])))) / WEIGHT
                 for each in (off, low))  # type: ignore[return-value]  # fmt: skip


CASES = {
    "heat loss nominal": (0.0, 0.0),
    "known to 20 %, constant power": (0.2, 0.0),
    "known to 20 %, power ± 50 %, 4 s": (0.2, 0.5),
}


def cell(bandwidth: float, case: str) -> str:
    """Bound and error in per cent of 20 g, and their ratio."""
    error, bound = followed(bandwidth, *CASES[case])
    return f"{100 * bound:.2g}, {100 * error:.2g} ({error / bound:.2f})"


def bandwidth_table() -> list[str]:
    """That of each bandwidth in each case."""
    rows = [[f"{each:g}", *(cell(each, case) for case in CASES)] for each in BANDWIDTHS]
    return table(["bandwidth of the load [Hz]", *CASES], rows)


def main() -> None:
    """Prints the table, or writes it into the page, between its marks."""
    lines = bandwidth_table()
    print("\n".join(lines))
    if "--page" in sys.argv[1:]:
        before, _, rest = PAGE.read_text(encoding="utf-8").partition(MARK)
        _, _, after = rest.partition(END)
        write_whole(PAGE, "\n".join([f"{before}{MARK}", "", *lines, "", f"{END}{after}"]).encode())


if __name__ == "__main__":
    main()
