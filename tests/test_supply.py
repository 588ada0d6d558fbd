"""What a command of TCAs means: power, voltage, current, their limits, and held temperatures."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tca_mj.batch import SimulationBatch
from tca_mj.drive import Drive
from tca_mj.modules.bending import bending_module
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE, HeatSpec, Supply, TcaBank, Thermostat, pulse_power
from tca_mj.tca.spec import heat_of

SPECS = [CATALOGUE["free-stroke"], CATALOGUE["type-2-180"], CATALOGUE["self-coiled"]]
DT = 0.02  # [s]


def driven(supply, command, *, warm=60.0, stretch=1.2):
    """Resistances, and the power that a supply puts into warm, stretched TCAs in a step [W]."""
    bank = TcaBank(SPECS)
    state = bank.steady(np.full(bank.n, warm))[0]
    length = stretch * bank.rest_length
    ohms = bank.resistance(state, length)
    bank.supply = supply
    later, _ = bank.advance(state, command, length, DT)
    plain = TcaBank(SPECS)
    power = later.energy_in / DT
    same, _ = plain.advance(state, power, length, DT)  # however it is commanded, power heats
    assert later.temperature == pytest.approx(same.temperature, rel=1e-12)
    return ohms, power


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_voltage_and_a_current_heat_by_ohms_law(sign):
    volts, amps = sign * np.array([1.0, 2.0, 3.0]), sign * np.array([0.1, 0.2, 0.3])
    ohms, power = driven(Supply(quantity="voltage"), volts)
    assert power == pytest.approx(volts**2 / ohms, rel=1e-12)
    ohms, power = driven(Supply(quantity="current"), amps)
    assert power == pytest.approx(amps**2 * ohms, rel=1e-12)


def test_the_resistance_is_that_of_the_stretched_wire():
    """Its turns part when it is stretched, and conduct in other ways: the power follows."""
    volts = np.full(3, 2.0)
    ohms, power = driven(Supply(quantity="voltage"), volts)
    more, other = driven(Supply(quantity="voltage"), volts, stretch=1.0)
    assert (np.abs(more / ohms - 1.0) > 1e-3).all()
    assert other * more == pytest.approx(power * ohms, rel=1e-12)


def test_pulses_heat_for_the_share_that_they_are_on():
    """The mean of U²/R over on and off, not (duty U)²/R; a limit of current is one of the pulse."""
    duty = np.array([0.0, 0.3, 1.0])
    ohms, power = driven(Supply(quantity="duty", max_voltage=3.0), duty)
    on = np.arange(1000) < np.array([[0.0], [300.0], [1000.0]])
    assert power == pytest.approx(np.mean(on * 9.0, axis=1) / ohms, rel=1e-12)
    assert power == pytest.approx(pulse_power(3.0, duty, ohms), rel=1e-12)
    weak = Supply(quantity="duty", max_voltage=3.0, max_current=0.2, max_power=0.05)
    ohms, power = driven(weak, duty)
    assert power == pytest.approx(np.minimum(duty * 0.04 * ohms, 0.05), rel=1e-12)
    with pytest.raises(ValueError, match="duty must be finite and at least 0 and at most 1, got"):
        weak.checked([0.0, 1.2, 0.0], 3)
    with pytest.raises(ValueError, match="max_voltage, of the pulses, must be finite, got inf"):
        Supply(quantity="duty")


@pytest.mark.parametrize("quantity", ["power", "voltage", "current"])
def test_each_limit_holds_whatever_is_commanded(quantity):
    """P <= P_max, U_max^2 / R and I_max^2 R; what is below all of them is not touched."""
    ohms, _ = driven(Supply(), np.zeros(3))
    wanted = np.array([0.5, 1.0, 2.0])  # [W]
    command = {"power": wanted, "voltage": np.sqrt(wanted * ohms),
               "current": np.sqrt(wanted / ohms)}[quantity]  # fmt: skip
    _, power = driven(Supply(quantity=quantity, max_power=0.8), command)
    assert power == pytest.approx(np.minimum(wanted, 0.8), rel=1e-12)
    volts = 0.9 * math.sqrt(ohms[1])  # 0.81 W in the second
    _, power = driven(Supply(quantity=quantity, max_voltage=volts), command)
    assert power == pytest.approx(np.minimum(wanted, volts**2 / ohms), rel=1e-12)
    amps = 0.9 / math.sqrt(ohms[1])
    _, power = driven(Supply(quantity=quantity, max_current=amps), command)
    assert power == pytest.approx(np.minimum(wanted, amps**2 * ohms), rel=1e-12)
    loose = {"max_power": 9.0, "max_voltage": 99.0, "max_current": 9.0}
    _, power = driven(Supply(quantity=quantity, **loose), command)
    assert power == pytest.approx(wanted, rel=1e-12)


def held(**change):
    thermostat = Thermostat(heat=heat_of(SPECS), max_power=20.0)
    return Supply(quantity="temperature", thermostat=thermostat, **change)


def test_a_thermostat_brings_there_and_keeps():
    bank = TcaBank(SPECS)
    bank.supply = held()
    goal, state = np.array([80.0, 120.0, 25.0]), bank.rest()
    for _ in range(int(8.0 / DT)):  # 20 times the response
        state, _ = bank.advance(state, goal, bank.rest_length, DT)
    assert state.temperature == pytest.approx(goal, abs=0.01)
    before = state.energy_in
    state, _ = bank.advance(state, goal, bank.rest_length, DT)
    power = (state.energy_in - before) / DT
    assert power == pytest.approx(np.asarray(bank.heat.loss) * (goal - 25.0), rel=1e-3, abs=1e-9)


@pytest.mark.parametrize("share", [1.0, 0.5, 0.1])
def test_a_thermostat_lets_go_above_its_limit(share):
    """Its feedback alone would be off by (1 - share) loss (T - T_amb) response / capacity."""
    bank, nominal = TcaBank(SPECS), heat_of(SPECS)
    limit, response = 150.0, 4.0
    thermostat = Thermostat(
        heat=nominal, max_power=20.0, max_temperature=limit, response=response
    )  # fmt: skip
    bank.supply = Supply(quantity="temperature", thermostat=thermostat)
    loss, capacity = np.asarray(nominal.loss), np.asarray(nominal.capacity)
    off = (1.0 - share) * loss * (limit - 25.0) * response / capacity
    bank.heat = replace(nominal, loss=share * loss)
    state = bank.rest()
    for _ in range(int(60.0 / DT)):
        state, _ = bank.advance(state, np.full(3, limit), bank.rest_length, DT)
    assert state.temperature.max() < limit + 5.0
    if share == 1.0:
        assert state.temperature == pytest.approx(np.full(3, limit), abs=1e-6)
    elif share == 0.1:
        assert (off > 10.0).all() and (state.temperature > limit + 1.0).all()
    hot = limit + np.array([0.9, 3.0, 5.0])
    full = loss * (limit - 25.0) - capacity * (hot - limit) / response
    power = thermostat.power(hot, np.full(3, limit), np.full(3, limit))
    assert power == pytest.approx(np.maximum(full, 0.0) * [1.0, 0.5, 0.0], rel=1e-12)


def test_cold_is_off_and_too_hot_is_cut():
    bank = TcaBank(SPECS)
    bank.supply = held(max_voltage=1.0)
    hot = bank.steady(np.full(3, 100.0))[0]
    state, _ = bank.advance(hot, np.array([25.0, -40.0, 0.0]), bank.rest_length, DT)
    assert (state.energy_in == 0.0).all() and (state.temperature < 100.0).all()
    state, _ = bank.advance(bank.rest(), np.full(3, 150.0), bank.rest_length, DT)
    ohms = bank.resistance(bank.rest(), bank.rest_length)
    assert state.energy_in / DT == pytest.approx(1.0 / ohms, rel=1e-12)  # 1 V, and no more
    bank.supply = held()
    state = bank.rest()
    for _ in range(500):
        state, _ = bank.advance(state, np.full(3, 400.0), bank.rest_length, DT)
    assert state.temperature == pytest.approx(175.0, abs=0.01)  # of the thermostat


def test_a_simulation_takes_volts_and_a_batch_does_the_same():
    """U^2/R at the lengths and temperatures that the TCAs had, added up over the updates."""
    supply = Supply(quantity="voltage", max_power=1.5)
    sims = [Simulation(bending_module(), supply=supply) for _ in range(3)]
    drives = [Drive(command=np.array(volts)) for volts in ([1.0, 2.0, 0.0], [0.0, 9.0, 1.0])]
    batch, joules = SimulationBatch(sims[:2]), np.zeros(3)
    for _ in range(5):
        batch.step(drives, 0.02)
        power = np.minimum(drives[0].command ** 2 / sims[2].resistance, 1.5)
        joules += 0.02 * power
        sims[2].step(drives[0].command, 0.02)
        assert sims[2].power == pytest.approx(power, rel=1e-3)  # measured where it began
    assert sims[2].energy == pytest.approx(joules, rel=1e-3)
    assert (sims[0].energy == sims[2].energy).all() and (sims[0].power == sims[2].power).all()
    assert sims[1].power[1] == pytest.approx(1.5)
    with pytest.raises(ValueError, match="voltage must be finite"):
        sims[2].step([1.0, math.nan, 1.0], 0.02)
    with pytest.raises(ValueError, match="voltage must"):
        sims[2].step([1.0, 1.0], 0.02)


def test_simulations_with_other_supplies_are_no_batch():
    one, other = Simulation(bending_module()), Simulation(bending_module())
    other.bank.supply = Supply(max_power=2.0)
    with pytest.raises(ValueError, match="sims"):
        SimulationBatch([one, other])
    one.bank.supply = Supply(max_power=2.0)
    SimulationBatch([one, other])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"quantity": "charge"}, "quantity must be one of"),
        ({"max_power": 0.0}, "max_power must be above 0"),
        ({"max_voltage": -1.0}, "max_voltage must be above 0"),
        ({"max_current": math.nan}, "max_current must be above 0"),
        ({"quantity": "temperature"}, "thermostat must be given"),
        ({"thermostat": held().thermostat}, "thermostat must be given"),
    ],
)
def test_impossible_supplies_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        Supply(**change)
    with pytest.raises(ValueError, match=message):
        replace(Supply(), **change)


def test_supplies_are_alike_number_by_number():
    """Also in the last digit of a thermostat's constants."""
    def made(loss):
        heat = HeatSpec(capacity=np.full(3, 0.2), loss=np.array([0.1, 0.1, loss]))
        return Supply(quantity="temperature", max_power=2.0,
                      thermostat=Thermostat(heat=heat, max_power=2.0))  # fmt: skip

    assert made(0.1).like(made(0.1))
    assert not made(0.1).like(made(0.1 + 1e-15))
    assert Supply().like(Supply()) and not Supply().like(Supply(max_power=1.0))
    assert not Supply().like(Supply(quantity="voltage"))


def test_a_thermostat_of_one_tca_is_to_the_bit_one_of_many():
    """Below and above its limits; what is no number stays none."""
    heat, rng = heat_of([SPECS[0]]), np.random.default_rng(0)
    thermostat = Thermostat(heat=heat, max_power=np.array([4.0]))
    now, body = rng.uniform(0.0, 190.0, (2, 200, 1))
    target = rng.uniform(0.0, 250.0, (200, 1))
    now[3] = math.nan
    each = [thermostat._power(*one) for one in zip(now, target, body, strict=True)]
    assert np.array(each).tobytes() == thermostat._power(now, target, body).tobytes()
