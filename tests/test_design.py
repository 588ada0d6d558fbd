"""Designed TCAs: what they are said to do, by closed forms and by steps; the front of the best."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tca_mj.tca import (
    CATALOGUE,
    FREE_STROKE_CREPT,
    CreepBank,
    CreepSpec,
    hanging_length,
    read_tca,
    with_tca,
)
from tca_mj.tca.design import Design, NoDesign, Space, Winding, Wish, designed, find_designs, lifted
from tca_mj.tca.design.candidates import BOUNDS, Figures, judged, tightest

THREAD = CATALOGUE["free-stroke"]
WISH = Wish(stroke=8e-3, load=0.2, time=5.0, voltage=4.0)


def alone(wish, tca):
    """Figures of one TCA, and the limits that it breaks."""
    found, broken = judged(wish, Space(spring_index=(1.01, 10.0)), [tca])
    over = {name for name, each in zip(BOUNDS, broken[:, 0], strict=True) if each > 0.0}
    return Figures(*(float(each[0]) for each in found)), over


def test_the_published_coil_comes_out_of_its_own_mandrel():
    """Annealed at 200 °C a coil keeps all of its mandrel's pitch: the catalogue's as it was made,
    with the resistance of the thread that is in it, and stress as at its breaking force."""
    made = CATALOGUE["free-stroke-made"]
    how = Winding(
        thread="free-stroke", core_diameter=2.0 * (made.coil_radius - made.fibre.radius),
        groove_pitch_angle=made.pitch_angle, fibre_length=made.fibre_length, strands=1,
    )  # fmt: skip
    tca = designed(THREAD, how, 200.0)
    assert tca.coil_radius == pytest.approx(made.coil_radius, rel=1e-12)
    assert tca.pitch_angle == pytest.approx(made.pitch_angle, rel=1e-12)
    # Where turns touch is their distance along the mandrel, and that is the thread's.
    turn = 2.0 * math.pi * THREAD.coil_radius * math.sin(THREAD.minimum_pitch_angle)
    touching = 2.0 * math.pi * tca.coil_radius * math.sin(tca.minimum_pitch_angle)
    assert touching == pytest.approx(turn, rel=1e-12)
    ohms = tca.resistance_per_length * tca.rest_length
    assert ohms == pytest.approx(THREAD.resistance_per_length * THREAD.rest_length, rel=1e-12)
    moments = [t.breaking_force * t.coil_radius * math.cos(t.pitch_angle) for t in (THREAD, tca)]
    assert moments[0] == pytest.approx(moments[1], rel=1e-12)


@pytest.mark.parametrize("creep", [None, CreepSpec()], ids=["new", "crept"])
def test_lengths_and_the_temperature_are_those_of_the_law_of_a_hanging_coil(creep):
    wish = replace(WISH, creep=creep)
    figures, over = alone(wish, THREAD)
    tca = THREAD
    if creep is not None:
        bank = CreepBank([THREAD], creep)
        state = bank.rest()
        for _ in range(3):  # long enough for anything
            state = bank.step(state, [wish.load], [150.0], 1e4)
        (tca,) = bank.crept(state)
    cold, hot = hanging_length(tca, [25.0, figures.temperature], wish.load, spin="locked")
    assert over == set()
    assert figures.length == pytest.approx(cold, rel=1e-10)
    assert cold - hot == pytest.approx(wish.stroke, rel=1e-8)


def test_creep_under_the_load_is_the_published_one():
    """30 g, by which the constants of creep were fitted: 20 degrees."""
    figures, _ = alone(replace(WISH, load=0.030 * 9.81), THREAD)
    crept = hanging_length(FREE_STROKE_CREPT["30 g"], 25.0, 0.030 * 9.81, spin="locked")
    assert figures.length == pytest.approx(crept, rel=0.02)


def test_time_energy_and_return_are_exponentials_where_the_resistance_is_constant():
    tca = replace(THREAD, stretch_resistance=0.0, contraction_resistance=0.0)
    figures, _ = alone(WISH, tca)
    power = WISH.voltage**2 / (tca.resistance_per_length * tca.rest_length)
    share = (figures.temperature - tca.ambient) * tca.heat.loss / power
    time = -tca.heat.time_constant * math.log1p(-share)
    assert figures.time == pytest.approx(time, rel=1e-10)
    assert figures.energy == pytest.approx(power * time, rel=1e-10)
    assert figures.power == pytest.approx(power, rel=1e-12)
    assert figures.current == pytest.approx(power / WISH.voltage, rel=1e-12)


@pytest.mark.parametrize("current", [math.inf, 0.8], ids=["voltage", "current"])
def test_the_integrals_are_what_steps_through_time_give(current):
    wish = replace(WISH, current=current)
    figures, _ = alone(wish, THREAD)
    how = Winding(thread="", core_diameter=1e-3, groove_pitch_angle=0.3, fibre_length=0.1,
                  strands=1)  # fmt: skip
    lift = lifted(wish, Design(winding=how, tca=THREAD, figures=figures), dt=figures.time / 2000)
    top = int(lift.contraction.argmax())
    assert lift.time[top] == pytest.approx(figures.time, rel=1e-3)
    assert lift.temperature[top] == pytest.approx(figures.temperature, abs=0.1)
    given_back = np.flatnonzero(lift.contraction[top:] < 0.1 * wish.stroke)[0] * lift.time[1]
    assert given_back == pytest.approx(figures.return_time, rel=2e-3)
    if current < math.inf:
        assert figures.current == current


def test_strands_share_load_and_current():
    one, _ = alone(WISH, designed(THREAD, winding(strands=1), 200.0))
    three, _ = alone(
        replace(WISH, load=3.0 * WISH.load), designed(THREAD, winding(strands=3), 200.0)
    )
    for name in ("temperature", "time", "return_time", "length", "stress_share", "torsion"):
        assert getattr(three, name) == pytest.approx(getattr(one, name), rel=1e-9), name
    for name in ("energy", "power", "current", "mass"):
        assert getattr(three, name) == pytest.approx(3.0 * getattr(one, name), rel=1e-9), name


def winding(**changed):
    how = {"thread": "free-stroke", "core_diameter": 0.4e-3, "groove_pitch_angle": 0.35,
           "fibre_length": 0.2, "strands": 1}  # fmt: skip
    return Winding(**{**how, **changed})


@pytest.mark.parametrize(
    ("changed", "broken"),
    [
        ({"stroke": 30e-3}, "stroke"),  # more than until the coils touch
        ({"load": 50.0}, "carried"),
        ({"time": 0.1}, "time"),
        ({"voltage": 0.5}, "time"),  # never hot enough
        ({"return_time": 0.5}, "return_time"),
        ({"current": 0.1}, "time"),
        ({"length": 40e-3}, "length"),
        ({"diameter": 1e-3}, "diameter"),
        ({"temperature": 60.0}, "stroke"),
        ({"load": 0.6, "stroke": 2e-3}, "stress_share"),
    ],
)
def test_each_limit_is_noticed(changed, broken):
    _, over = alone(WISH, THREAD)
    assert over == set()
    _, over = alone(replace(WISH, **changed), THREAD)
    assert broken in over


@pytest.fixture(scope="module")
def found():
    pytest.importorskip("pymoo")
    return find_designs(WISH, population=60, generations=25, seed=3)


def test_every_design_of_the_front_keeps_all_limits(found):
    for each in found.front:
        tca = designed(THREAD, each.winding, found.space.annealing_temperature)
        assert tca == each.tca
        figures, broken = judged(found.wish, found.space, [tca])
        assert (broken == 0.0).all()
        for name in Figures._fields:
            assert getattr(figures, name)[0] == pytest.approx(getattr(each.figures, name), rel=1e-9)


def test_no_winding_drawn_by_chance_beats_the_front_by_much(found):
    """Of those that keep the limits. The front of so short a search may be 5 % off."""
    generator, space = np.random.default_rng(1), found.space
    tcas = []
    while len(tcas) < 3000:
        core = math.exp(generator.uniform(*np.log(space.core_diameter)))
        groove = generator.uniform(*space.groove_pitch_angle)
        if groove > tightest(THREAD, core):
            how = winding(
                core_diameter=core, groove_pitch_angle=groove,
                fibre_length=math.exp(generator.uniform(*np.log(space.fibre_length))),
                strands=int(generator.integers(1, 5)),
            )  # fmt: skip
            tcas.append(designed(THREAD, how, space.annealing_temperature))
    figures, broken = judged(found.wish, space, tcas)
    kept = (broken == 0.0).all(axis=0)
    assert kept.sum() > 30
    drawn = np.array([getattr(figures, name)[kept] for name in found.aims]).T
    front = np.array([found.values(name) for name in found.aims]).T
    beaten = (1.05 * drawn[:, None] < front).all(axis=-1).any(axis=1)
    assert not beaten.any()
    assert (front.min(axis=0) < 1.05 * drawn.min(axis=0)).all()  # the best in one aim alone


def test_none_of_the_front_is_beaten_and_the_spread_lies_apart(found):
    front = np.array([found.values(name) for name in found.aims]).T
    beaten = ((front[:, None] <= front).all(-1) & (front[:, None] < front).any(-1)).any(axis=0)
    assert not beaten.any()
    shown = found.spread(5)
    assert shown[0] == found.chosen and len(set(shown)) == 5
    assert set(front.argmin(axis=0)) <= set(shown)


def test_the_same_seed_finds_the_same(found):
    np.random.seed(5)  # nothing of that
    again = find_designs(WISH, population=60, generations=25, seed=3)
    assert [each.winding for each in again.front] == [each.winding for each in found.front]
    other = find_designs(WISH, population=60, generations=25, seed=4)
    assert [each.winding for each in other.front] != [each.winding for each in found.front]


def test_threads_compete(found):
    """One that has half the twist, and so untwists less, is never taken."""
    lazy = replace(THREAD, fibre=replace(THREAD.fibre, inserted_twist=2355.0))
    space = Space(threads={"lazy": lazy, "free-stroke": THREAD})
    both = find_designs(WISH, space, population=60, generations=25)
    assert {each.winding.thread for each in both.front} == {"free-stroke"}


def test_what_cannot_be_is_said_with_what_stands_in_the_way():
    pytest.importorskip("pymoo")
    with pytest.raises(NoDesign, match="stress_share by"):
        find_designs(replace(WISH, load=8.0), population=20, generations=10)
    with pytest.raises(ValueError, match="aims must be of .*did you mean 'energy'"):
        find_designs(WISH, aims=("enrgy", "mass"))
    with pytest.raises(ValueError, match="aims must be two to four"):
        find_designs(WISH, aims=("mass",))
    with pytest.raises(ValueError, match=r"stroke must be at most 1 m .* did you mean 0.02 m"):
        replace(WISH, stroke=20.0)
    with pytest.raises(ValueError, match=r"strands\[1\] must be at least 3"):
        Space(strands=(3, 2))
    with pytest.raises(ValueError, match="threads must hold"):
        Space(threads={})
    with pytest.raises(ValueError, match="annealing_temperature"):
        Space(annealing_temperature=120.0)


def test_the_command_writes_tcas_that_robots_take(tmp_path, capsys):
    pytest.importorskip("pymoo")
    import tca_mj.cli
    from tca_mj.modules import BendingSpec, bending_module

    asked = ["design", "--stroke", "0.008", "--load", "0.2", "--time", "5", "--voltage", "4",
             "--strands", "1", "1", "--population", "30", "--generations", "12", "--keep", "3",
             "--no-picture", "--out", str(tmp_path)]  # fmt: skip
    assert tca_mj.cli.main(asked) == 0
    said = capsys.readouterr().out
    assert "How to wind" in said and (tmp_path / "report.json").exists()
    assert (tmp_path / "tca-3.json").exists() and not (tmp_path / "tca-4.json").exists()
    file = read_tca(tmp_path / "tca.json")
    assert file.provenance["pitch_angle"].kind == "estimate"
    bending_module(with_tca(BendingSpec(), tmp_path / "tca.json"))
    asked[asked.index("0.2")] = "20"
    assert tca_mj.cli.main(asked) == 2
    assert "no TCA of this space" in capsys.readouterr().err
