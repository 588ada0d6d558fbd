"""Recordings read back: what was recorded, to the last bit, with its times and units."""

import csv
import math

import numpy as np
import pytest

from tca_mj import cli
from tca_mj.modules.bending import bending_module
from tca_mj.record import Recorder
from tca_mj.record.reader import read, write_csv
from tca_mj.sim import Simulation


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("recorded") / "module.rrd"
    sim, seen = Simulation(bending_module()), []
    with Recorder(sim, path, chunk=3) as recorder:
        for number in range(7):
            sim.step([1.0, 0.2, 0.0], 0.1)
            recorder.frame({"progress": float(number)} if number > 3 else None)
            seen.append((sim.time, sim.tension.copy(), sim.temperature.copy(), sim.power.copy()))
        recorder.event("end")
    return path, sim, seen


def test_curves_come_back_to_the_last_bit(recorded):
    path, sim, seen = recorded
    recording = read(path)
    for i, name in enumerate(sim.tca_names):
        for column, (quantity, unit) in enumerate(
            (("tension", "N"), ("temperature", "°C"), ("power", "W")), start=1
        ):
            curve = recording.curves[f"actuators/{name}/{quantity}"]
            assert curve.unit == unit
            assert np.array_equal(curve.values, [row[column][i] for row in seen])
            assert curve.time == pytest.approx([row[0] for row in seen], abs=1e-9)
    assert recording.curves["reward/progress"].values.tolist() == [4.0, 5.0, 6.0]
    assert recording.events == ((pytest.approx(0.7), "end"),)


def test_a_table_has_a_row_for_every_time(recorded, tmp_path):
    path, sim, seen = recorded
    recording = read(path)
    write_csv(recording, tmp_path / "module.csv")
    with (tmp_path / "module.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(seen)
    name = f"actuators/{sim.tca_names[0]}/tension [N]"
    assert [float(row[name]) for row in rows] == [row[1][0] for row in seen]
    assert [row["reward/progress [-]"] for row in rows[:4]] == [""] * 4
    assert math.isclose(float(rows[-1]["time [s]"]), 0.7)


def test_what_is_no_recording_is_said(tmp_path):
    with pytest.raises(FileNotFoundError, match="no recording"):
        read(tmp_path / "nothing.rrd")
    (tmp_path / "bad.rrd").write_bytes(b"nothing of the kind")
    with pytest.raises(ValueError, match="path must be a whole recording"):
        read(tmp_path / "bad.rrd")


def test_of_a_recording_that_was_cut_within_a_chunk_it_is_said_how_to_mend_it(recorded, tmp_path):
    path, _, _ = recorded
    whole = path.read_bytes()
    (tmp_path / "cut.rrd").write_bytes(whole[: round(0.8 * len(whole))])
    with pytest.raises(ValueError, match="rerun rrd merge"):
        read(tmp_path / "cut.rrd")


def test_the_command_writes_the_table_beside_the_recording(recorded, tmp_path, capsys):
    path, sim, seen = recorded
    (tmp_path / "copy.rrd").write_bytes(path.read_bytes())
    assert cli.main(["export", str(tmp_path / "copy.rrd")]) == 0
    assert f"{tmp_path / 'copy.csv'}: " in capsys.readouterr().out
    assert len((tmp_path / "copy.csv").read_text(encoding="utf-8").splitlines()) == len(seen) + 1
    assert cli.main(["export", str(tmp_path / "nothing.rrd")]) == 2
    assert "there is no recording" in capsys.readouterr().err
