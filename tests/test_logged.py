"""Logs of a bench, run through the model: what made them comes out, and what is off is said."""

import csv

import numpy as np
import pytest

from tca_mj.cli import main
from tca_mj.tca import CATALOGUE, Heating, Load, LoadedTcas, write_tca
from tca_mj.tca.identify import follow_log, read_data

TCA = CATALOGUE["free-stroke"]
DT = 0.05


def bench(volts, grams=20.0, ohms=0.0, seed=0):
    """Rows of a bench: time, voltage, current, temperature, length; noise of the resistance."""
    tcas, rows = LoadedTcas([TCA], Load.weight(1e-3 * grams)), []
    state, random = tcas.rest(), np.random.default_rng(seed)
    for k, volt in enumerate(volts):
        now = tcas.resistance(state)[0] + ohms * random.standard_normal()
        rows.append((k * DT, volt, volt / now, state.temperature[0], state.length[0]))
        heating = Heating(source="voltage", value=float(volt))
        state = tcas.step(state, heating, DT, "quasistatic")
    return np.array(rows)


def written(path, heads, columns, *above):
    with path.open("w", newline="") as file:
        file.write("".join(f"{line}\n" for line in above))
        writer = csv.writer(file)
        writer.writerow(heads)
        writer.writerows(np.transpose(columns).tolist())
    return path


HEADS = ["time [s]", "voltage [V]", "current [A]", "temperature [degC]", "length [mm]"]


@pytest.fixture(scope="module")
def course():
    """8 s of a bench with a weight of 20 g, warm and cold by turns."""
    volts = np.where(DT * np.arange(160) % 4.0 < 2.0, 2.8, 0.5)
    return bench(volts, ohms=5e-3) * [1.0, 1.0, 1.0, 1.0, 1e3]


def test_a_log_that_the_model_made_is_what_the_model_shows(tmp_path, course):
    """By the voltage alone: the quasi-static motion of ``LoadedTcas``, which steps otherwise."""
    path = written(tmp_path / "log.csv", HEADS[:2] + HEADS[3:], course[:, [0, 1, 3, 4]].T,
                   "# load [g]: 20")  # fmt: skip
    found = follow_log(read_data(path, TCA), TCA)
    assert set(found.compared) == {"temperature", "length"}
    assert found.model["temperature"] == pytest.approx(course[:, 3], abs=0.5)
    assert 1e3 * found.model["length"] == pytest.approx(course[:, 4], abs=0.2)
    assert not found.observed  # nothing tells a resistance


def test_the_observer_is_told_nothing_but_voltage_and_current(tmp_path, course):
    """A log that says another weight than hung there: the model is off, the observer is not."""
    path = written(tmp_path / "log.csv", HEADS, course.T, "# load [g]: 10")
    found = follow_log(read_data(path, TCA), TCA)
    both = found.model, found.observed
    model, observed = (1e3 * each["length"] - course[:, 4] for each in both)
    assert np.abs(model[-40:]).max() > 3.0  # a weight of 10 g stretches it less
    assert np.sqrt(np.mean(observed[20:] ** 2)) < 0.6
    assert found.observed["force"][-40:].mean() == pytest.approx(0.02 * 9.81, rel=0.05)
    words = found.words()
    assert any(line.startswith("observer, length: off by 0.000") for line in words)
    assert any("model, length: off by" in line and "below" in line for line in words)


def test_pulses_heat_as_the_steady_voltage_of_the_same_mean_square(tmp_path, course):
    time, volts, _, temperature, _ = course.T
    path = written(tmp_path / "log.csv", ["time [s]", "voltage [V]", "duty [%]", HEADS[3]],
                   [time, np.full_like(time, 6.0), 100.0 * (volts / 6.0) ** 2, temperature],
                   "# load [g]: 20")  # fmt: skip
    found = follow_log(read_data(path, TCA), TCA)
    assert found.model["temperature"] == pytest.approx(temperature, abs=0.5)


def test_displacement_counts_from_the_start_and_a_held_length_gives_a_force(tmp_path, course):
    time, volts, _, _, length = course.T
    path = written(tmp_path / "log.csv", [*HEADS[:2], "displacement [mm]"],
                   [time, volts, 3.0 + length[0] - length], "# load [g]: 20")  # fmt: skip
    found = follow_log(read_data(path, TCA), TCA)
    moved = 1e3 * found.model["displacement"]
    assert moved == pytest.approx(3.0 + length[0] - length, abs=0.2)
    path = written(tmp_path / "held.csv", HEADS[:2], [time, volts], "# length [mm]: 50")
    held = follow_log(read_data(path, TCA), TCA)
    assert set(held.model) == {"temperature", "force", "resistance"}
    assert held.words()[0].startswith("nothing was measured")
    assert np.ptp(held.model["force"]) > 0.05


def test_the_command_says_how_far_it_is_off_and_writes_what_it_was(tmp_path, course, capsys):
    path = written(tmp_path / "log.csv", HEADS, course.T, "# load [g]: 20")
    spec = tmp_path / "mine.json"
    write_tca(spec, TCA)
    out = tmp_path / "out"
    assert main(["replay", str(path), "--tca", str(spec), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "model, temperature: off by" in said and "observer, length: off by" in said
    assert {f.name for f in out.iterdir()} == {"replay.csv", "replay.txt", "replay.png"}
    again = read_data(out / "replay.csv", TCA)
    assert set(again.columns) == {"time", "temperature", "length", "resistance"}


def test_what_is_no_log_is_refused(tmp_path, course):
    path = written(tmp_path / "log.csv", HEADS[3:], course[:, 3:].T)
    with pytest.raises(ValueError, match="data must be a course: time, and a power, voltage or"):
        follow_log(read_data(path, TCA), TCA)
