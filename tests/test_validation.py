"""The validation report: verdicts follow from numbers, and the page says what the code says."""

import json
import math
import re
import tomllib
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from tca_mj import cli
from tca_mj.tca import CATALOGUE, Load, LoadedTcas
from tca_mj.tca.catalogue import MODULE_TCAS
from tca_mj.tca.sensing.wire import SensingSpec
from tca_mj.tca.thermal import step_temperature
from tca_mj.validation import (
    creeping,
    drag,
    heat,
    lifting,
    modules,
    race,
    report,
    sensors,
    strokes,
    theories,
    threads,
)
from tca_mj.validation.facts import (
    Finding,
    check,
    finding,
    not_covered,
    reasons,
    table,
    tally,
    trend,
    words,
)

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted((ROOT / "docs").glob("validation*.md"))


@pytest.fixture(scope="module")
def cheap():
    """The findings that take some seconds: no scans, control, cone or timing."""
    return [
        *strokes.free_strokes(), *strokes.contact_stops(), *strokes.loaded_contractions(),
        *strokes.loaded_stroke(), *strokes.overlap(), *drag.findings(), *race.fastest(),
        *creeping.findings(), *heat.findings(), *sensors.findings(), *theories.moduli(),
        *theories.spread(), *theories.dynamics(dt=0.05), *modules.findings(full=False),
    ]  # fmt: skip


def verdicts(findings):
    return {row.fact: row.verdict for row in findings}


def text_of_the_pages():
    return "".join(page.read_text(encoding="utf-8") for page in PAGES)


def rows_of_the_page():
    rows = {}
    for line in text_of_the_pages().splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        if len(cells) == 6 and cells[0] not in ("source", "---"):
            rows[cells[1]] = cells[4], cells[5].strip("*")
    return rows


def test_the_page_is_what_the_models_give(cheap):
    """After a change: python scripts/validation_page.py."""
    page = rows_of_the_page()
    for row in cheap:
        model, verdict = page[row.fact]
        assert verdict == row.verdict, row.fact
        assert model == row.model.replace("|", "/"), row.fact


def test_the_page_tells_of_every_fact_and_of_what_is_missed(cheap):
    page = rows_of_the_page()
    text = text_of_the_pages()
    assert len(page) == len(set(page)) > len(cheap)
    counted = re.search(r"(\d+) facts: (\d+) held, (\d+) missed, (\d+) trend held", text)
    found = [verdict for _, verdict in page.values()]
    assert counted is not None
    assert [int(n) for n in counted.groups()] == [
        len(page), found.count("held"), found.count("missed"), found.count("trend held"),
    ]  # fmt: skip
    for fact, (_, verdict) in page.items():
        if "missed" in verdict or verdict in ("fitted", "not covered"):
            assert f"*{fact}* ({verdict})" in text
    for subject in ("conical", "times faster", "blown air", "feels 20 or 40 g", "finger of 40 mm"):
        assert any(subject in fact + model for fact, (model, _) in page.items()), subject


def test_a_check_is_its_band():
    def verdict(value, low=1.0, high=2.0):
        return check("s", "f", "p", value, low, high, "mm", reason="far off").verdict

    assert [verdict(v) for v in (0.999, 1.0, 1.5, 2.0, 2.001)] == [
        "missed", "held", "held", "held", "missed",
    ]  # fmt: skip
    assert verdict(math.nan) == "missed"
    assert check("s", "f", "p", 5.0, -math.inf, 7.0, "%").band == "at most 7.0 %"
    assert check("s", "f", "p", 5.0, 2.0, math.inf, "%").band == "at least 2.0 %"
    for low, high in ((2.0, 1.0), (1.0, 1.0), (-math.inf, math.inf), (math.nan, 1.0)):
        with pytest.raises(ValueError, match="band"):
            check("s", "f", "p", 1.5, low, high, "mm")


def test_what_is_missed_needs_a_reason():
    good = asdict(check("s", "f", "p", 1.5, 1.0, 2.0, "mm"))
    with pytest.raises(ValueError, match="reason"):
        Finding(**good | {"verdict": "missed"})
    assert check("s", "f", "p", 3.0, 1.0, 2.0, "mm").reason == "No reason is known."
    assert trend("s", "f", "p", "rises", "falls", False).reason == "No reason is known."
    with pytest.raises(ValueError, match="reason"):
        not_covered("s", "f", "p", "")
    with pytest.raises(ValueError, match="verdict"):
        Finding(source="s", fact="f", published="p", band="", model="", verdict="fine")  # type: ignore[arg-type]
    assert trend("s", "f", "p", "o", "m", True, strict=True).verdict == "held"
    assert trend("s", "f", "p", "o", "m", False, reason="r").verdict == "trend missed"


def test_every_fact_of_the_file_is_judged_somewhere():
    """No table or text that no code names, and no name without one."""
    folder = ROOT / "tca_mj" / "validation"
    tables = tomllib.loads((folder / "facts.toml").read_text(encoding="utf-8"))
    texts = tables.pop("words")
    code = "".join(path.read_text(encoding="utf-8") for path in folder.glob("*.py"))
    named = set(re.findall(r'\bfinding\(\s*"([a-z0-9-]+)"', code))
    chosen = {"free-stroke", "free-stroke-of-type-0"}  # by the name of the type
    assert named | chosen == set(tables)
    assert set(re.findall(r"\bwords\(\s*['\"]([a-z0-9-]+)", code)) == set(texts)


def test_a_fact_of_the_file_is_of_the_kind_that_its_keys_say():
    assert finding("contact-length", 70.0).band == "69.5 to 70.5 mm"
    assert finding("contact-length", 71.0).verdict == "missed"
    assert finding("pull", 0.5, name="A", low=0.4).band == "at least 0.40 N"
    assert finding("creep-cold", 12.3).model == "12 % done in 20 h"
    assert finding("creep-cold", 12.3).verdict == "fitted"
    assert finding("feels", held=True, right=3, runs=4).verdict == "trend held"
    assert finding("feels", held=False, right=3, runs=4).verdict == "trend missed"
    assert finding("free-stroke-of-type-0-from-mandrel", name="A").verdict == "not covered"
    assert words("arm-leaves", time=2.0) == "From 2 s on it leaves its plane."
    for key in ("nothing", "pull"):  # no table; a field that is not given
        with pytest.raises(KeyError):
            finding(key, 1.0)
    for key, wanted in (("contact-length", "value must"), ("feels", "held must")):
        with pytest.raises(ValueError, match=wanted):
            finding(key, right=3, runs=4)
    with pytest.raises(ValueError, match="band"):  # neither the file nor the code has one
        finding("pull", 0.5, name="A")


def test_the_table_and_the_list_of_reasons():
    rows = [check("s", "a", "p", 3.0, 1.0, 2.0, "mm", reason="heavy"),
            check("s", "b", "p", 3.0, 1.0, 2.0, "mm", reason="heavy"),
            check("s", "c", "p", 1.5, 1.0, 2.0, "mm", reason="never said")]  # fmt: skip
    assert "| s | a | p | 1.0 to 2.0 mm | 3.0 mm | **missed** |" in table(rows)
    assert reasons(rows) == "* *a* (missed); *b* (missed): heavy"
    assert tally(rows)["missed"] == 2 and tally(rows)["held"] == 1


def test_known_misses_are_not_hidden(cheap):
    found = verdicts(cheap)
    assert {fact for fact, verdict in found.items() if "missed" in verdict} >= {
        "type-0-180, 40 g, to 150 °C", "type-1-180, 40 g, to 150 °C",
        "type-2-200 drags 0.4 N", "20 g at 12 V: acceleration", "error of the cubic D(R), 40 g",
    }  # fmt: skip


def test_a_wrong_contact_length_is_seen(monkeypatch):
    """Coils that touch 7 % later: free strokes and the contractions without load are missed."""
    wrong = {
        name: replace(tca, minimum_pitch_angle=math.asin(0.93 * math.sin(tca.minimum_pitch_angle)))
        for name, tca in CATALOGUE.items()
    }
    monkeypatch.setattr(strokes, "CATALOGUE", wrong)
    found = verdicts([*strokes.free_strokes()[:6], *strokes.contact_stops()])
    assert found["free stroke of type-2-180, catalogue"] == "missed"
    assert found["type-1-180, no load, to 150 °C"] == "missed"


def test_no_untwist_is_seen(monkeypatch):
    still = {name: replace(tca, fibre=replace(tca.fibre, untwist_scale=0.0))
             for name, tca in CATALOGUE.items()}  # fmt: skip
    monkeypatch.setattr(strokes, "CATALOGUE", still)
    assert set(verdicts(strokes.contact_stops()).values()) == {"missed"}
    assert "missed" in verdicts(strokes.loaded_contractions()).values()


def test_exchanged_models_are_seen(monkeypatch):
    """Love and Castigliano the wrong way round: their order and their sizes are missed."""
    cst, love = theories.CST, theories.LOVE
    monkeypatch.setattr(theories, "CST", love._replace(name=cst.name))
    monkeypatch.setattr(theories, "LOVE", cst._replace(name=love.name))
    found = verdicts(theories.spread())
    assert found["free-stroke-made, 2/30/60 g, 25 to 160 °C: order of the models"] == "missed"
    assert found["free-stroke-made, 60 g, 160 °C: Love over the rod"] == "missed"


def test_a_cone_upside_down_is_seen():
    found = theories.cone(step=15.0)
    good = verdicts(theories.conical(found))
    assert set(good.values()) == {"held"}
    upside_down = replace(found, rises=found.rises[:, ::-1])
    assert verdicts(theories.conical(upside_down))[
        "conical TCA: big coils pass small ones"] == "missed"  # fmt: skip
    flat = replace(found, highest=found.lowest + 0.1)
    assert verdicts(theories.conical(flat))["conical TCA: never all in one plane"] == "missed"
    # The rises of whole turns add up to what is between the first and the last bound.
    assert found.rises[0] == pytest.approx(10.6 * np.ones(5), abs=1e-2)


def test_lengths_of_the_scan_are_those_of_the_catalogue():
    """The set that the catalogue uses gives the contractions of the report; the best is first."""
    choice = strokes.Choice(strokes.CATALOGUE["type-1-180"].fibre.radius, "cold", "free",
                            "natural", True)  # fmt: skip
    values = choice.contractions()
    for value, (name, grams) in zip(values, strokes.CONTRACTIONS, strict=True):
        assert value == pytest.approx(strokes.contraction(CATALOGUE[name], grams, 150.0), rel=1e-9)
    scan = strokes.Scan.of([choice, choice._replace(radius=0.17e-3)])
    assert scan.errors[0] < scan.errors[1] and scan.choices[0] == choice
    printed = np.array([4.0, 20.0, 24.0, 44.0])
    assert scan.errors[0] == pytest.approx(np.abs(values - printed).max(), rel=1e-12)


def test_the_four_lengths_hold_in_the_running_experiment():
    """The plateaus of the figure are the lengths that are judged."""
    found = creeping.experiment()
    l1, l2, l3, l4 = creeping.four_lengths(CATALOGUE["type-1-180"], "locked")
    begins = [time for time, _ in found.events]
    for length, time in ((l1, begins[0]), (l2, begins[1]), (l3, begins[4] - 1.0), (l4, begins[4])):
        at = int(np.searchsorted(found.time, time + 1e-6, side="right")) - 1
        assert found.length[at] == pytest.approx(length, abs=0.6)


def test_the_loop_settles_where_power_and_heat_balance():
    """Without integral: duty = K_P e/FULL, duty V^2/R = loss (T - T_amb), displacement of T."""
    found = lifting.lift(20, lifting.controller([10.0], [0.0]), duration=9.0)
    tca = lifting.crept(20)
    tcas = LoadedTcas([tca], Load.weight(0.020))
    start = float(tcas.rest().length[0])

    def displacement(temperature):
        return 1e3 * (start - float(tcas.equilibrium([temperature])[0]))

    def excess(temperature):
        moved = displacement(temperature)
        ohms = float(lifting.WIRE.rest_resistance[0]) * (
            1.0 + 0.20 / 0.357 * 1e-3 * moved / 0.110 - SensingSpec().load * lifting.weight(20))
        duty = 10.0 * (lifting.GOAL - moved) / lifting.FULL
        return duty * lifting.SUPPLY**2 / ohms - float(tca.heat.loss) * (temperature - 25.0)

    settled = displacement(brentq(excess, 30.0, 240.0))
    assert found.steady[0] == pytest.approx(settled, abs=0.25)


def test_swings_are_counted():
    time = np.linspace(0.0, 10.0, 1001)
    wave = lifting.GOAL + np.stack([3.0 * np.sin(math.pi * time), 0.5 * np.sin(time)], axis=1)
    found = lifting.Response(time, wave, wave, wave)
    assert found.swings.tolist() == [9, 0]
    ramp = lifting.Response(time, 10.0 * time[:, None], wave, wave)
    assert ramp.rise()[0] == pytest.approx(3.2, abs=1e-9)


def test_a_weight_is_recognised_by_the_fall_of_the_resistance():
    assert [lifting.recognised(lifting.felt(lifting.hung(grams))) for grams in (20, 40)] == [20, 40]
    assert lifting.recognised(np.full(400, float(lifting.WIRE.rest_resistance[0]))) == 0


def test_dry_friction_against_a_spring():
    """k x = f ends the stretch: from x it slides to 2 f/k - x, and stays if f holds it there."""
    stiffness, friction, mass = 20.0, 0.4, 0.3
    stretched = 0.030  # of 20 mm that friction holds

    def pull(length, _):
        return stiffness * (length - 0.1)

    end = 2.0 * friction / stiffness - stretched  # on the other side, within what friction holds
    found = drag.drag(pull, 0.1 + stretched, np.full(20_000, 25.0), mass=mass, friction=friction,
                      dt=1e-4)  # fmt: skip
    assert found.moved[-1] == pytest.approx(stretched - end, abs=2e-5)
    assert found.speed[-1] == 0.0
    period = math.pi * math.sqrt(mass / stiffness)  # a half swing of the free spring
    assert found.time[np.argmax(found.moved >= found.moved[-1])] == pytest.approx(period, abs=2e-3)
    # What the spring gives, friction takes.
    given = 0.5 * stiffness * (stretched**2 - end**2)
    assert found.work[-1] == pytest.approx(given, rel=1e-3)
    assert found.rubbed[-1] == pytest.approx(friction * found.moved[-1], rel=1e-3)
    held = drag.drag(pull, 0.1 + 0.0199, np.full(100, 25.0), mass=mass, friction=friction)
    assert np.all(held.moved == 0.0) and np.all(held.speed == 0.0)
    with pytest.raises(ValueError, match="friction"):
        drag.drag(pull, 0.1, np.full(2, 25.0), mass=mass, friction=-0.1)


@pytest.mark.long
def test_a_tca_drags_until_its_pull_is_the_friction():
    """Slow heating is static; energy balances at any time; five with five times as much are one."""
    one, five = drag.study(190.0), drag.study(190.0, 5)
    slow = drag.study(190.0, rate=1.0)
    at_once = [drag.drag(drag.pull_of(CATALOGUE[drag.NAME]), 0.134, np.full(3000, 190.0), mass=m,
                         friction=drag.FRICTION).moved[-1] for m in (0.2, 0.8)]  # fmt: skip
    assert at_once[0] == pytest.approx(at_once[1], rel=5e-3)
    assert slow.moved[-1] < one.moved[-1] < at_once[0]
    tca, pull = CATALOGUE[drag.NAME], drag.pull_of(CATALOGUE[drag.NAME])
    static = tca.rest_length - brentq(
        lambda length: pull(length, 190.0) - drag.FRICTION, 0.080, tca.rest_length)  # fmt: skip
    assert slow.moved[-1] == pytest.approx(static, rel=0.05)
    np.testing.assert_allclose(five.moved, one.moved, atol=1e-9)
    np.testing.assert_allclose(five.work, 5.0 * one.work, rtol=1e-9)
    kinetic = 0.5 * 0.4 * one.speed**2
    np.testing.assert_allclose(one.work, kinetic + one.rubbed, atol=1e-6 + 1e-3 * one.work[-1])
    sliding = one.speed > 1e-6
    taken = drag.FRICTION * one.moved
    assert one.rubbed[sliding] == pytest.approx(taken[sliding], abs=1e-3 * taken[-1])


def test_heat_of_a_candidate_is_what_its_constants_give():
    """Warming, race and pulse of one candidate, in closed form."""
    found = heat.heated(heat.Candidate(True, "64 mW/K", "80 mA", "6 %"))
    assert found.current == pytest.approx(80.0, rel=0.01)
    assert found.warming == pytest.approx(0.064 / 0.064, rel=0.01)
    assert found.mass == pytest.approx(32.0, rel=1e-9)
    steady = heat.bounds(160.0)
    assert steady["outer cylinder"] < heat.LOSSES["0.21"] < steady["single thread"]
    assert heat.bounds(27.0)["single thread"] < heat.LOSSES["32 mW/K"]
    tca = CATALOGUE["free-stroke"].of_length(0.100)
    end = float(step_temperature(25.0, 1.5**2 * 6.7, tca.heat, 0.8))
    assert heat.pulse(tca, 1.5, 0.8) == pytest.approx(end, rel=1e-9)
    assert heat.pulse(tca, 25.0, 0.8) is None


def test_the_catalogue_is_the_candidate_that_is_in_use():
    for candidate, name, made in ((heat.IN_USE, "type-2-180", 0.1335),
                                  (heat.DEFAULTS, "free-stroke", 0.06675)):  # fmt: skip
        tca = CATALOGUE[name]
        same = candidate.tca(tca, made)
        assert same.heat.loss == pytest.approx(tca.heat.loss, rel=1e-9)
        assert same.heat.capacity == tca.heat.capacity
        assert same.resistance_per_length == pytest.approx(tca.resistance_per_length, rel=1e-9)
        assert same.contraction_resistance == tca.contraction_resistance
    in_use = threads.THREADS["one thread (in use)"]
    assert in_use.tca("type-1-180") == CATALOGUE["type-1-180"]


def test_one_thread_holds_more_than_two():
    names = "one thread (in use)", "two threads (before)"
    one, two = (sum(threads.facts(threads.THREADS[name]).held) for name in names)
    assert one == 8 and two == 4


def test_a_slower_type_is_not_called_ahead():
    time = np.linspace(0.0, 2.0, 201)
    found = race.Race(time, {name: rate * time for name, rate in (
        ("type-1-180", 10.0), ("type-2-180", 9.0), ("type-1-200", 11.0), ("type-2-200", 8.0)
    )}, 100.0)  # fmt: skip
    found_verdicts = verdicts(race.fastest(found))
    assert found_verdicts["20 g, 1 A: annealed at 180 °C against 200 °C"] == "trend missed"
    assert race.ahead(found, "type-2-180", "type-2-200") == (True, 2.0)


def test_tcas_of_the_modules():
    assert MODULE_TCAS["sensing"].rest_length == pytest.approx(0.110, rel=1e-12)
    assert MODULE_TCAS["sensing"].fibre_length == 0.350
    assert MODULE_TCAS["sensing"].coils == pytest.approx(CATALOGUE["type-2-180"].coils, rel=1e-12)
    for name, length in (("gripper", 70.0), ("bending", 45.0), ("finger", 45.0)):
        assert 1e3 * MODULE_TCAS[name].rest_length == pytest.approx(length, rel=1e-12)
    twisting = pytest.importorskip("tca_mj.modules.twisting")
    single = twisting.twisting_module(twisting.TwistingSpec(double=False, nodes=16)).tcas[0].spec
    assert MODULE_TCAS["twisting"].rest_length == pytest.approx(single.rest_length, rel=1e-3)
    with pytest.raises(TypeError):
        MODULE_TCAS["new"] = CATALOGUE["self-coiled"]  # type: ignore[index]


@pytest.fixture
def quick(monkeypatch, cheap):
    """A report without its long runs: the same writing, some of the facts."""
    chapters = dict.fromkeys(report._CHAPTERS, cheap[:2])
    monkeypatch.setattr(report, "all_findings", lambda: chapters)
    monkeypatch.setattr(report, "all_tables", lambda: {"Heat and resistance": "| a table |"})
    monkeypatch.setattr(report, "draw_figures", lambda out: (out / "drawn").touch())


def test_the_command_prints_and_writes(quick, tmp_path, capsys):
    out = tmp_path / "deep" / "folder"
    assert cli.main(["validate", "tca", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "## Strokes (Chapter 2)" in said and "| verdict |" in said and str(out) in said
    assert "![" not in said
    written = (out / "report.md").read_text(encoding="utf-8")
    assert "](validation_strokes.png)" in written
    result = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert sum(result["tally"].values()) == 2 * len(report._CHAPTERS)
    assert "| a table |" in written
    row = result["chapters"]["Strokes (Chapter 2)"][0]
    assert asdict(Finding(**row)) == row
    assert (out / "drawn").exists()
    with pytest.raises(SystemExit) as error:
        cli.main(["validate", "gripper"])
    assert error.value.code == 2


def test_without_matplotlib_it_says_so_at_once(monkeypatch, tmp_path, capsys):
    from tca_mj.validation import figures

    monkeypatch.setattr(figures, "find_spec", lambda name: None)
    assert cli.main(["validate", "tca", "--out", str(tmp_path)]) == 2
    assert "pip install" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_figure_has_labels_with_units_and_curves(tmp_path):
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    from tca_mj.validation import figures

    figure = Figure()
    figures.fibre_figure(figure)
    for axis in figure.axes:
        assert axis.get_xlabel().endswith("[°C]") and axis.get_ylabel().endswith("]")
        assert axis.get_lines()
    figures.draw(tmp_path / "fibre.png", 9.5, 3.8, figures.fibre_figure)
    assert (tmp_path / "fibre.png").stat().st_size > 10_000
