"""A TCA from measurements: what is read, what the fit finds, and what it says that it does not."""

import json
import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize_scalar

import tca_mj
from tca_mj import BendingSpec
from tca_mj.cli import main
from tca_mj.tca import (
    CATALOGUE,
    MATERIALS,
    Heating,
    Load,
    LoadedTcas,
    Source,
    hanging_length,
    read_tca,
    tension,
    write_tca,
)
from tca_mj.tca.dynamics.loads import GRAVITY
from tca_mj.tca.identify import (
    CONSTANTS,
    Data,
    constants_of,
    identify,
    read_data,
    report,
    simulated_bench,
    sources,
    stated_errors,
    with_constants,
    write_data,
    write_identification,
)
from tca_mj.tca.identify import fit as fit_of
from tca_mj.tca.identify.latent import weighed
from tca_mj.tca.identify.loops import direction
from tca_mj.tca.identify.predict import Muscle, predict

THREAD = CATALOGUE["free-stroke"]
KNOWN = replace(THREAD, fibre=replace(THREAD.fibre, load_softening=(0.0, 0.0, 1.0)))
TRUE = {"young": 1.6e9, "shear": 0.3e9, "growth_50": 0.02, "growth_100": 0.06, "heat_loss": 0.1,
        "rest_length": 0.05}  # fmt: skip
TCA = with_constants(KNOWN, TRUE)


@pytest.fixture
def said(tmp_path):
    """Reads what a file says."""

    def read(text, tca=KNOWN):
        path = tmp_path / "bench.csv"
        path.write_text(text, encoding="utf-8")
        return read_data(path, tca)

    return read


def rows(head, *columns):
    return "\n".join([head, *(",".join(map(str, row)) for row in zip(*columns, strict=True))])


WARM, LONG = np.linspace(25.0, 120.0, 20), np.linspace(0.05, 0.035, 20)


# Reading.


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (rows("25.0,0.05", WARM, LONG), r"bench.csv, row 1 must be a header with units.*'25.0'"),
        (rows("temperature,length", WARM, LONG), "row 1 must be a header with units"),
        (rows("temperature [degC],length [m]", WARM, 1e3 * LONG), r"length.*did you mean \[mm\]"),
        (rows("temperature [degC],length [mm]", WARM, LONG), r"length.*did you mean \[m\]"),
        (rows("temperature [degC],length [m]", WARM + 273.15, LONG), r"did you mean \[K\]"),
        (rows("temperature [K],length [m]", WARM, LONG), r"temperature.*did you mean \[degC\]"),
        (rows("temperature [degC],length [m]", LONG, WARM), "length and temperature swapped"),
        (rows("temperature [F],length [m]", WARM, LONG), "unit of temperature must be one of"),
        (rows("length [m],force [N]", LONG, 30.0 + LONG), r"force must be.*did you mean \[mN\]"),
        (rows("length [m],length [mm]", LONG, LONG), "every quantity once"),
        ("temperature [degC],length [m]\n25,0.05\n", "at least 3 good rows"),
        ("time [s]\n", "must have a header and"),
        (rows("length [m],force [N]", LONG, ["x"] * 20), "at least half of its rows"),
        ("# load [g]: heavy\nlength [m],force [N]\n1,2\n", "load must be a number, got 'heavy'"),
        ("# ends: loose\nlength [m],force [N]\n1,2\n", "ends must be one of"),
    ],
)
def test_what_cannot_be_is_refused(said, text, match):
    with pytest.raises(ValueError, match=match):
        said(text)


def test_a_file_is_mended_with_a_line_that_says_what_and_where(said):
    time = [0.0, 0.2, 0.1, 0.3, 0.3, 0.4, 3.0, 3.1, 3.2, 3.3, 3.4, 3.5]
    hot = ["298.15", *["300"] * 4, "nan", *["300"] * 5, "1e9"]
    lines = rows("time [s];voltage [V];temperature [K];length [mm];mood [1]".replace(";", ","),
                 time, [3.0] * 12, hot, [48.0] * 12, [0] * 12)  # fmt: skip
    data = said(f"# load [g]: 30\n# ends: free\n{lines}")
    assert data.ends == "free" and data.fixed == {"load": pytest.approx(0.03 * GRAVITY)}
    assert data.columns["temperature"][0] == pytest.approx(25.0)
    assert data.columns["length"].tolist() == [pytest.approx(0.048)] * 9
    assert (np.diff(data.columns["time"]) > 0.0).all()
    notes = "\n".join(data.notes)
    for line in (
        "bench.csv, row 1: load is converted from g to N",
        "bench.csv, row 3: temperature is converted from K to degC",
        "bench.csv, row 9, column 'temperature [K]': 'nan' is no number: row left out",
        "column 'mood [1]' is not used",
        "row 15, column temperature: 1e+09 degC cannot be",
        "rows are sorted by time", "1 row(s) repeat a time", "1 gap(s) in time, the first of 2.7 s",
    ):  # fmt: skip
        assert line in notes, notes


def test_decimal_commas_are_understood_with_semicolons(said):
    data = said("temperature [°C];length [mm]\n25,5;48,5\n30;47\n40;46,5\n")
    assert data.columns["length"].tolist() == pytest.approx([0.0485, 0.047, 0.0465])


def test_what_is_written_is_read_to_the_last_bit(tmp_path):
    for data in simulated_bench(TCA, rows=12, seed=3):
        again = read_data(write_data(data, tmp_path / data.name), TCA)
        assert (again.name, again.fixed, again.ends, again.notes) == (
            data.name, data.fixed, data.ends, ()
        )  # fmt: skip
        for name, values in data.columns.items():
            assert again.columns[name].tolist() == values.tolist()


# Predicting.


def test_constants_go_in_and_come_out():
    again = with_constants(TCA, constants_of(TCA))
    assert constants_of(again) == pytest.approx(constants_of(TCA), rel=1e-12)
    assert with_constants(TCA, {}) == TCA
    assert with_constants(TCA, {"rest_length": 0.06}).coils == pytest.approx(TCA.coils)
    with pytest.raises(ValueError, match="growth"):
        with_constants(TCA, {"growths": 1.0})


@pytest.mark.parametrize("drive", ["voltage", "current", "power"])
def test_a_course_is_the_quasistatic_motion(drive):
    """Of ``LoadedTcas``, whose step is of second order as this one's: 0.05 s of 6 s."""
    time, load = 0.05 * np.arange(120), 0.3
    value = np.where(time < 3.0, {"voltage": 3.0, "current": 0.8, "power": 2.0}[drive], 0.0)
    data = Data(
        name="step.csv", fixed={"load": load},
        columns={"time": time, drive: value, "temperature": time, "length": time},
    )  # fmt: skip
    found = predict(data, Muscle(TCA, "rod", {}), "free").T

    def law(length, temperature):
        return tension(TCA, length, temperature, spin="free")

    tcas = LoadedTcas([TCA], Load(force=load), law=law)
    course = tcas.simulate(tcas.rest(), lambda t: Heating(
        source=drive, value=float(np.interp(t + 1e-9, time, value) if t < 2.98 else 0.0)
    ), 0.05, 119, "quasistatic")  # fmt: skip
    assert np.abs(found[0] - course.temperature[:, 0]).max() < 0.05  # of 60 K
    assert np.abs(found[1] - course.length[:, 0]).max() < 1e-5  # of 20 mm


def test_the_effective_variance_is_that_of_linear_errors():
    length = np.linspace(0.055, 0.08, 7)
    force, slope = tension(TCA, length, 25.0)
    off = 1e-3 * np.array([1.0, -1.0, 0.5, 0.3, -0.2, 0.1, 0.8])
    data = Data(name="x", columns={"length": length, "force": force + off}, fixed={})
    noise = {"length": 1e-5, "force": 2e-4}
    model, residual, error = weighed(data, Muscle(TCA, "rod", {}), "locked", noise)
    assert model[:, 0] == pytest.approx(force)
    assert error[:, 0] == pytest.approx(np.hypot(2e-4, 1e-5 * slope), rel=1e-3)
    assert residual[:, 0] == pytest.approx(off / error[:, 0], rel=1e-3)


def test_two_outcomes_of_one_temperature_are_not_independent():
    """A row's residuals are made so: whitened by V, their sum of squares is r V^-1 r."""
    data = Data(name="x", fixed={"load": 0.2}, columns={
        "temperature": np.linspace(40.0, 90.0, 4), "length": np.full(4, 0.05),
        "resistance": np.full(4, 3.5),
    })  # fmt: skip
    noise = {"temperature": 0.5, "length": 5e-5, "resistance": 1e-3}
    muscle = Muscle(TCA, "rod", {})
    off = np.array([[1e-4, 1e-3], [-5e-5, 2e-3], [3e-5, -1e-3], [0.0, 5e-4]])
    shown = predict(data, muscle, "free") + off
    data = replace(data, columns={**data.columns, "length": shown[:, 0], "resistance": shown[:, 1]})
    model, residual, _ = weighed(data, muscle, "free", noise)
    warm, cool = (
        replace(data, columns={**data.columns, "temperature": np.linspace(40.0 + x, 90.0 + x, 4)})
        for x in (0.5, -0.5)
    )
    slope = 0.5 * (predict(warm, muscle, "free") - predict(cool, muscle, "free"))
    for k in range(4):
        variance = np.diag([25e-10, 1e-6]) + np.outer(slope[k], slope[k])
        expected = off[k] @ np.linalg.solve(variance, off[k])
        assert residual[k] @ residual[k] == pytest.approx(expected, rel=0.02)  # the law bends
    assert abs(slope[0, 0] * slope[0, 1]) > 0.1 * 5e-5 * 1e-3  # or nothing was tried


def test_true_givens_are_those_that_are_nearest():
    """Against SciPy's orthogonal distance regression of the same row: its least sum of squares
    over all true lengths; what is put right for the bend is 0 as the errors are small."""
    length = np.linspace(0.056, 0.08, 5)
    random = np.random.default_rng(4)
    noise = {"length": 2e-4, "force": 3e-3}
    force, _ = tension(TCA, length, 25.0, spin="locked")
    data = Data(name="x", fixed={}, columns={
        "length": length + 2e-4 * random.standard_normal(5),
        "force": force + 3e-3 * random.standard_normal(5),
    })  # fmt: skip
    _, residual, _ = weighed(data, Muscle(TCA, "rod", {}), "locked", noise)
    for k in range(5):
        def away(true, k=k):
            pull, _ = tension(TCA, true, 25.0, spin="locked")
            return (((data.columns["length"][k] - true) / 2e-4) ** 2
                    + ((data.columns["force"][k] - pull) / 3e-3) ** 2)  # fmt: skip

        least = minimize_scalar(away, bounds=(length[k] - 2e-3, length[k] + 2e-3),
                                options={"xatol": 1e-9}).fun  # fmt: skip
        assert residual[k, 0] ** 2 == pytest.approx(least, rel=0.02, abs=1e-4)


# Fitting.


def test_errors_in_what_is_given_do_not_flatten_a_slope():
    """With weights that do not move, a straight line's slope would be that of ordinary least
    squares, too small by the variance of the errors over that of all: 12 %, over 12 errors."""
    random = np.random.default_rng(0)
    true = np.linspace(0.052, 0.09, 3000)
    data = Data(name="stretch.csv", fixed={}, ends="locked", columns={
        "length": true + 4e-3 * random.standard_normal(3000),
        "force": 25.0 * (true - 0.03) + 0.01 * random.standard_normal(3000),
    })  # fmt: skip
    noise = {"length": 4e-3, "force": 0.01}
    result = identify([data], TCA, free=[], law="linear", noise=noise, compare=False)
    found = {each.name: each for each in result.found}["linear_stiffness"]
    assert abs(found.value - 25.0) < 3.0 * found.error and found.error < 0.01 * 25.0
    flat = np.polyfit(*data.columns.values(), 1)[0]
    assert flat == pytest.approx(25.0 / (1.0 + 16e-6 / np.var(true)), rel=0.02)


def test_a_law_that_bends_leaves_nothing_in_the_mean():
    """2 mm on 38 mm, where the effective variance alone leaves 0.9 % in the shear modulus."""
    random = np.random.default_rng(0)
    true = np.linspace(0.052, 0.09, 24_000)
    force, _ = tension(TCA, true, 25.0, spin="locked")
    data = Data(name="stretch.csv", fixed={}, ends="locked", columns={
        "length": true + 2e-3 * random.standard_normal(true.size),
        "force": force + 0.002 * random.standard_normal(true.size),
    })  # fmt: skip
    noise = {"length": 2e-3, "force": 0.002}
    result = identify([data], TCA, free=["shear"], noise=noise, compare=False)
    (found,) = result.found
    assert found.value == pytest.approx(0.3e9, rel=2e-3)


@pytest.fixture(scope="module")
def bench():
    return simulated_bench(TCA, rows=60, seed=1)


@pytest.fixture(scope="module")
def found(bench):
    """From a bench that does not say its ends; what a ruler says is off."""
    open_ended = [replace(each, ends=None) for each in bench[:-1]]
    start = with_constants(KNOWN, {"rest_length": 0.048, "ambient": 22.0})
    return identify([*open_ended, bench[-1]], start)


def test_a_fit_finds_what_made_the_data(found):
    truth = constants_of(TCA)
    good = {each.name: each for each in found.found if each.state == "identified"}
    assert {"young", "shear", "growth_50", "growth_100", "rest_length", "heat_loss"} <= set(good)
    for name, each in good.items():
        low, high = each.interval
        wide = 2.0 * (high - low)  # 95 % widened to 8 errors: 1e-4 for all of them
        assert low - 0.5 * wide < truth[name] < high + 0.5 * wide, each
        assert low < each.value < high
        assert high - low == pytest.approx(4.0 * each.error, rel=0.3)
    assert found.fit.scales == pytest.approx(np.ones(5), abs=0.4)


@pytest.mark.parametrize("name", ["shear", "growth_100", "heat_loss"])
def test_intervals_end_where_the_least_sum_of_squares_has_risen(found, name):
    """With all other numbers fitted anew by SciPy, but for the contact that is not there."""
    fit, problem = found.fit, found.fit.problem
    j = problem.names.index(name)
    rest = [n not in (name, "minimum_length") for n in problem.names]
    before = np.sum(problem.residuals(fit.x, fit.factors) ** 2)
    for end in fit.interval(name):
        point = fit.x + fit.covariance[:, j] / fit.covariance[j, j] * (end - fit.x[j])
        point[problem.names.index("minimum_length")] = fit.x[problem.names.index("minimum_length")]

        def risen(inner, point=point):
            point[rest] = inner
            return problem.residuals(point, fit.factors)

        least = least_squares(risen, point[rest], x_scale=fit.deviations[rest], xtol=1e-8).cost
        assert 2.0 * least - before == pytest.approx(fit.quantile**2, rel=0.02)


def test_a_kink_by_chance_is_no_contact(monkeypatch):
    """The least favourable of the study's coils that do not touch: at the square of Student's
    quantile it would have a least length, 80 % too long, and a narrow error of it."""
    study = runpy.run_path(str(Path(__file__).parent.parent / "scripts" / "identify_study.py"))
    tca, start = study["drawn"](78)
    bench = [d for d in simulated_bench(tca, 100, 78) if d.name != "resistance.csv"]
    states = []
    for clear in (fit_of.CLEAR, 3.8):
        monkeypatch.setattr(fit_of, "CLEAR", clear)
        result = identify(bench, start, compare=False)
        states.append({each.name: each for each in result.found}["minimum_length"])
    assert states[0].state == "not identified" and states[0].interval is None
    assert states[1].state == "identified" and states[1].interval[0] > 1.5 * tca.minimum_length


def test_what_is_fitted_without_contact_has_none():
    """Held by contact a coil is longer than it would be: without it, it gets shorter than it was
    ever seen, and must not touch there either, or the fit stops beside the least."""
    study = runpy.run_path(str(Path(__file__).parent.parent / "scripts" / "identify_study.py"))
    tca, start = study["drawn"](5078)
    fit = identify(simulated_bench(tca, 100, 5078), start, compare=False).fit
    size, j = fit.problem.size, fit.problem.names.index("minimum_length")
    assert not fit.slopes[:size, j].any()
    held = fit.slopes.T @ fit.problem.residuals(fit.x, fit.factors)
    held[j] = 0.0
    assert held @ fit.covariance @ held < 0.1  # of the sum of squares is still to be gained


def test_the_data_tell_ends_and_models_apart(found):
    first, *others = found.compared
    assert (first.law, first.ends) == ("rod", "usual") == (found.law, found.ends)
    behind = {(each.law, each.ends): each.criterion for each in others}
    assert behind["linear", "usual"] > 100.0 and behind["rod", "free"] > 10.0
    assert "The data support rod, ends free where it hangs" in found.words[-1]


def test_a_held_out_set_is_predicted_within_its_interval(found):
    random = simulated_bench(TCA, rows=200, seed=9)[0]
    (prediction,) = found.predict(replace(random, name="later.csv"))
    assert 0.9 < prediction.inside <= 1.0
    noise = 0.01 * random.columns["length"].max()
    # Else anything would be inside; but where the coils touch, which 60 rows hardly tell.
    assert np.mean(prediction.error < 1.5 * noise) > 0.9


def test_a_tca_goes_through_file_robot_and_task_and_back(found, tmp_path):
    path = write_tca(tmp_path / "tca.json", found.tca, sources(found))
    kept = read_tca(path)
    assert kept.spec == found.tca
    task = tca_mj.make("TCA/BendReach-v0", module_spec=BendingSpec(tca=kept.spec)).unwrapped
    for spec in task.sim.bank.specs:  # cut to the module's length, in its silicone
        same = {name: getattr(spec, name) for name in ("fibre", "coil_radius", "pitch_angle",
                                                       "minimum_pitch_angle")}  # fmt: skip
        assert same == {name: getattr(found.tca, name) for name in same}
    back = write_tca(tmp_path / "back.json", replace(spec, body=None).of_length(
        found.tca.rest_length
    ))  # fmt: skip
    assert read_tca(back).spec.fibre == found.tca.fibre
    shear = next(each for each in found.found if each.name == "shear")
    source = kept.provenance["fibre.shear"]
    assert source.kind == "fitted" and source.error == pytest.approx(shear.error, rel=1e-3)
    assert len(kept.provenance["fibre.expansion"].error) == 3
    assert "fibre.radius" not in kept.provenance


def test_what_data_cannot_identify_is_named_and_has_no_error(bench):
    """Free length tells the growths, by their product with the twist, and no modulus."""
    hot = bench[0].columns["load"] == 0.0
    columns = {name: values[hot] for name, values in bench[0].columns.items() if name != "load"}
    free = replace(bench[0], columns=columns)
    found = identify([free], KNOWN, compare=False)
    states = {each.name: each for each in found.found}
    assert states["growth_100"].state == "identified"
    for name in ("young", "shear", "softening_rate"):
        assert states[name].state == "not identified"
        assert states[name].error is states[name].interval is None
        assert any(f"do not identify {name};" in each for each in found.words)
        assert sources(found)[f"fibre.{name.removesuffix('_rate')}"].error is None
    assert any("No data concern heat_loss" in each for each in found.words)
    assert "no load is said" in found.data[0].notes[0]


def test_two_constants_of_one_product_are_both_not_identified(bench):
    """Coil radius and moduli: lengths and forces know their product alone."""
    free = ["young", "shear", "coil_radius"]
    found = identify([bench[1]], TCA, free=free, compare=False)
    states = {each.name: each.state for each in found.found}
    assert states["shear"] == states["coil_radius"] == "not identified"
    assert any("is identified, to" in each and "coil_radius" in each for each in found.words)


def test_an_error_of_the_ruler_is_one_of_the_modulus(bench):
    sharp = identify([bench[1]], TCA, free=["young", "shear"], compare=False)
    error = 0.03 * TCA.coil_radius
    blunt = identify([bench[1]], TCA, free=["young", "shear"], errors={"coil_radius": error},
                     compare=False)  # fmt: skip
    before, after = (next(f for f in each.found if f.name == "shear") for each in (sharp, blunt))
    # The force goes as GJ/r^2: 3 % are 6 %.
    assert after.error / after.value == pytest.approx(
        math.hypot(0.06, before.error / before.value), rel=0.2
    )
    assert next(f for f in blunt.found if f.name == "coil_radius").state == "stated"


def test_another_material_is_found_from_the_numbers_of_sewing_thread():
    """A published coil of nylon monofilament, three times as stiff; it does not soften."""
    fibre = MATERIALS["nylon monofilament"].measured
    length = math.hypot(2.0 * math.pi * 18.3 * 0.816e-3, 25e-3)
    coil = replace(
        KNOWN, fibre=fibre, fibre_length=length, coil_radius=0.816e-3, breaking_force=None,
        pitch_angle=math.asin(25e-3 / length), minimum_pitch_angle=0.14,
    )  # fmt: skip
    thread = MATERIALS["silver-coated nylon sewing thread"].fibre(
        radius=fibre.radius, inserted_twist=fibre.inserted_twist, line_density=fibre.line_density
    )
    found = identify(simulated_bench(coil, rows=40, seed=1)[:3], replace(coil, fibre=thread),
                     compare=False)  # fmt: skip
    shear = next(each for each in found.found if each.name == "shear")
    assert thread.shear < 0.4 * fibre.shear
    assert abs(shear.value - fibre.shear) < 4.0 * shear.error < 0.2 * fibre.shear


def test_errors_of_ruler_and_scale_are_those_of_the_file():
    by_ruler = Source(kind="measured", error=5e-4)
    assert stated_errors({
        "fibre_length": by_ruler, "fibre.line_density": Source(kind="weighed", error=2e-6),
        "coil_radius": Source(kind="measured"), "fibre.young": by_ruler,
    }) == {"fibre_length": 5e-4, "line_density": 2e-6}  # fmt: skip


def test_a_wrong_model_is_not_exact(bench):
    """The linear model's residuals follow one another, which widens its errors and is said."""
    found = identify([bench[0]], KNOWN, law="linear", compare=False)
    assert found.fit.scales[0] > 1.3 and found.fit.factors[0] > 1.2 * found.fit.scales[0]
    assert any("follow one another" in each for each in found.words)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"free": ["youngs"]}, "free must be of .*did you mean 'young'"),
        ({"errors": {"young": -1.0}}, "errors.*above 0"),
        ({"noise": {"colour": 1.0}}, "quantity of noise must be one of"),
        ({"law": "beam"}, "law must be one of"),
        ({"free": ["heat_loss"]}, "free must name constants that the data concern"),
    ],
)
def test_arguments_are_checked(bench, change, match):
    with pytest.raises(ValueError, match=match):
        identify([bench[1]], TCA, **change)


def test_sets_that_say_too_little_are_refused():
    warm = np.linspace(25.0, 100.0, 5)
    for columns, match in (
        ({"temperature": warm}, "must have what the TCA does"),
        ({"temperature": warm, "force": warm / 1e3}, "must say the length"),
        ({"temperature": warm, "length": warm * math.nan}, "length must be finite"),
    ):
        with pytest.raises(ValueError, match=match):
            identify([Data(name="x.csv", columns=columns, fixed={})], TCA)


# Report and command.


def test_the_report_says_what_was_found(found, bench, tmp_path):
    held = replace(simulated_bench(TCA, rows=40, seed=5)[0], name="held.csv")
    write_identification(found, tmp_path, [held])
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert text.strip() == report(found, [held])
    for part in ("## Constants", "| `shear` |", "## Models", "## Held out", "| held.csv | 40 |"):
        assert part in text
    data = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert [each["name"] for each in data["constants"]] == [each.name for each in found.found]
    correlation = np.array(data["correlation"])
    assert np.diag(correlation) == pytest.approx(1.0) and (np.abs(correlation) < 1.0 + 1e-9).all()
    assert read_tca(tmp_path / "tca.json").spec == found.tca


def test_the_command_writes_a_tca(bench, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    path = write_data(bench[1], tmp_path / "stretch.csv")
    known = write_tca(tmp_path / "known.json", KNOWN)
    out = tmp_path / "out"
    assert main(["identify", str(path), "--tca", str(known), "--no-compare", "--error",
                 "coil_radius=1e-5", "--out", str(out)]) == 0  # fmt: skip
    assert "These data identify" in capsys.readouterr().out
    assert sorted(each.name for each in out.iterdir()) == [
        "report.json", "report.md", "stretch.png", "tca.json"
    ]  # fmt: skip
    assert read_tca(out / "tca.json").spec.fibre.shear == pytest.approx(0.3e9, rel=0.1)


def test_the_command_refuses_wrong_units(tmp_path, capsys):
    path = tmp_path / "stretch.csv"
    path.write_text(rows("length [m],force [N]", 1e3 * LONG, LONG), encoding="utf-8")
    assert main(["identify", str(path), "--tca", "free-stroke", "--no-pictures", "--out",
                 str(tmp_path / "out")]) == 2  # fmt: skip
    assert "did you mean [mm]?" in capsys.readouterr().err


def test_hanging_and_pulling_are_the_laws():
    """The tables of what is given and what comes out, in one row of each."""
    hot = np.array([70.0, 80.0, 90.0])
    hung = Data(name="a", columns={"temperature": hot, "length": hot}, fixed={"load": 0.2})
    muscle = Muscle(TCA, "rod", {})
    length = hanging_length(TCA, hot, 0.2)
    assert predict(hung, muscle, "free")[:, 0] == pytest.approx(length)
    moved = replace(hung, columns={"temperature": hot, "displacement": hot},
                    fixed={"load": 0.2, "length": 0.06})  # fmt: skip
    assert predict(moved, muscle, "free")[:, 0] == pytest.approx(0.06 - length)
    held = Data(name="b", columns={"temperature": hot, "force": hot}, fixed={"length": 0.055})
    assert predict(held, muscle, "locked")[:, 0] == pytest.approx(tension(TCA, 0.055, hot)[0])


def test_every_constant_says_what_would_identify_it():
    assert all(each.unit and each.meaning and each.measurement for each in CONSTANTS.values())
    assert list(constants_of(TCA)) == [name for name in CONSTANTS if not name.startswith("body")]


# Loops.

LAG = 6.0  # between heating and cooling [K]


def looped(width, rows=120, cooling=True, time=False):
    """Length under 0.2 N against temperature, of a TCA whose cooling lags."""
    random, half = np.random.default_rng(5), rows // 2
    warm = np.linspace(25.0, 130.0, half if cooling else rows)
    warm = np.concatenate([warm, warm[::-1]]) if cooling else warm
    way = np.where(cooling & (np.arange(rows) >= half), -1.0, 1.0)
    length = hanging_length(TCA, np.maximum(warm - 0.5 * width * way, 20.0), 0.2, spin="free")
    columns = {"temperature": warm + 0.5 * random.standard_normal(rows),
               "length": length + 0.01 * length.max() * random.standard_normal(rows)}  # fmt: skip
    columns |= {"time": 10.0 * np.arange(rows)} if time else {}
    return Data(name="loop.csv", fixed={"load": 0.2}, ends="free", columns=columns)


def test_a_loop_is_told_with_its_size_and_what_it_does(bench, tmp_path):
    result = identify([*bench, looped(LAG, time=True)], KNOWN, compare=False)
    (loop,) = result.loops
    assert loop.name == "loop.csv" and loop.outcome == "length"
    assert abs(loop.width - LAG) < 3.0 * loop.error and loop.error < 1.0
    truth = hanging_length(TCA, np.linspace(25.0, 130.0, 50)[None] + np.array([[3.0], [-3.0]]), 0.2,
                           spin="free")  # fmt: skip
    expected = np.abs(truth[1] - truth[0]).max() / truth.max()
    assert loop.share == pytest.approx(expected, rel=0.3)
    # 105 K up and 105 K down in 1190 s, so half of the loop is 17 s.
    assert loop.lag == pytest.approx(0.5 * loop.width * 1190.0 / 210.0, rel=0.05)
    assert all(abs(each) < 0.5 for each in loop.moved.values())  # heating and cooling are even
    said = "\n".join(result.words)
    assert "loop.csv: heating and cooling differ by" in said
    assert "of the full scale of length, as if the TCA, or its thermometer, lagged" in said
    assert "moves no constant by half of its error" in said
    assert "had it only been heated, they would be off by:" in said
    write_identification(result, tmp_path)
    assert json.loads((tmp_path / "report.json").read_text())["loops"][0]["width"] == loop.width


def test_what_a_bench_that_only_heats_makes_of_a_loop_is_foretold(bench):
    """It tells no loop, and its constants are off as ``heated`` of both branches says."""
    both = identify([*bench, looped(LAG)], KNOWN, compare=False)
    heated = identify([*bench, looped(LAG, cooling=False)], KNOWN, compare=False)
    straight = identify([*bench, looped(0.0, cooling=False)], KNOWN, compare=False)
    assert not heated.loops and not straight.loops
    (loop,) = both.loops
    names = heated.fit.problem.names
    apart = (heated.fit.x - straight.fit.x) / straight.fit.deviations
    off = dict(zip(names, apart, strict=True))
    for name, least in (("growth_50", 1.0), ("growth_100", 2.0)):
        assert abs(off[name]) > least
        assert off[name] == pytest.approx(loop.heated[name], rel=0.35)


def test_without_a_loop_none_is_told(bench, found):
    assert found.loops == ()
    plain = identify([*bench, looped(0.0)], KNOWN, compare=False)
    assert plain.loops == () and "heating and cooling" not in " ".join(plain.words)


def test_a_course_that_lags_has_a_loop(bench):
    """Of a step of voltage: the length follows a thermometer that is 1 s behind."""
    course = simulated_bench(TCA, rows=400, seed=2)[3]
    assert course.name == "step.csv"
    time, warm = course.columns["time"], course.columns["temperature"]
    model = predict(course, Muscle(TCA, "rod", {}), "free")
    late = np.interp(time - 0.05 * time[-1], time, model[:, 1])
    random = np.random.default_rng(6)
    length = late + 0.01 * late.max() * random.standard_normal(time.size)
    lagged = replace(course, columns={**course.columns, "temperature": warm, "length": length})
    others = [each for each in bench if each.name != course.name]
    (loop,) = identify([*others, lagged], KNOWN, compare=False).loops
    assert loop.width > 0.0 and loop.lag == pytest.approx(0.05 * time[-1], rel=0.6)


@pytest.mark.parametrize(
    ("temperature", "ways"),
    [
        ([25, 40, 60, 80, 60, 40], [1, 1, 1, 1, -1, -1]),
        ([80, 60, 40, 60, 80], [-1, -1, -1, 1, 1]),
        ([25, 30, 29, 40, 39, 60, 61], [1] * 7),  # no more than noise
        ([25, 60, 90, 30, 60, 90, 30], [1, 1, 1, -1, 1, 1, -1]),
    ],
)
def test_branches_are_found_in_the_order_of_rows(temperature, ways):
    assert direction(np.array(temperature, float), 3.0).tolist() == ways
