"""Recordings, pictures and plots: what is read back is what was simulated."""

import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import rerun
from rerun.chunk import RrdReader

from tca_mj.modules.bending import bending_module
from tca_mj.record import QUANTITIES, Recorder, coils, plots, render
from tca_mj.record import film as film_module
from tca_mj.record.coils import _helix
from tca_mj.record.shapes import body_paths
from tca_mj.robots.tetrapod import tetrapod
from tca_mj.sim import Simulation

HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


def chain(links: int = 4, tcas: int = 2) -> mujoco.MjModel:
    """A chain of hinged links with a geom of every kind and TCAs along it, above a plane."""
    spec, kind = mujoco.MjSpec(), mujoco.mjtGeom
    spec.add_material(name="wood", rgba=[0.75, 0.5, 0.25, 1.0])
    spec.add_mesh(name="wedge", uservert=[0, 0, 0, 0.03, 0, 0, 0, 0.03, 0, 0, 0, 0.03])
    world = spec.worldbody
    world.add_light(pos=[0.0, 0.0, 2.0])
    world.add_geom(type=kind.mjGEOM_PLANE, size=[0, 0, 0.1], rgba=[0.8, 0.8, 0.85, 1.0])
    half = [0.05, 0.05, 0.01]
    world.add_geom(type=kind.mjGEOM_BOX, size=half, pos=[0.2, 0, 0.01], material="wood")
    base = world.add_body(name="arm", pos=[0, 0, 0.1 + 0.03 * links], quat=[0, 1, 0, 0])
    base.add_geom(type=kind.mjGEOM_CYLINDER, size=[0.02, 0.01, 0.0])
    base.add_geom(type=kind.mjGEOM_BOX, size=[1.0, 1.0, 1.0], group=3, mass=0.0, contype=0)
    tendons = [spec.add_tendon(name=f"arm.tca{k}", width=0.0008) for k in range(tcas)]
    body, shapes = base, [kind.mjGEOM_BOX, kind.mjGEOM_CAPSULE, kind.mjGEOM_ELLIPSOID]
    for i in range(links):
        body = body.add_body(name=f"arm.link{i}", pos=[0.0, 0.0, 0.03])
        body.add_joint(type=HINGE, axis=[0, 1, 0], stiffness=[0.05, 0, 0], damping=[5e-4, 0, 0])
        body.add_geom(
            type=shapes[i % 3], size=[0.006, 0.008, 0.005], mass=0.003, rgba=[0.3, 0.6, 0.6, 1.0]
        )
        for k in range(tcas):
            angle = 2.0 * np.pi * k / tcas
            place = [0.012 * np.cos(angle), 0.012 * np.sin(angle), 0.0]
            body.add_site(name=f"site{k}.{i}", pos=place)
            tendons[k].wrap_site(f"site{k}.{i}")
    body.add_body(name="frame").add_joint(type=HINGE)  # nothing to show
    spec.body("frame").mass, spec.body("frame").inertia = 1e-3, [1e-6] * 3
    spec.body("frame").explicitinertial = True
    ball = world.add_body(name="ball", pos=[0.2, 0.0, 0.1])
    ball.add_freejoint()
    ball.add_geom(type=kind.mjGEOM_SPHERE, size=[0.01, 0, 0], mass=0.01)
    ball.add_geom(type=kind.mjGEOM_MESH, meshname="wedge", mass=0.01, rgba=[0.9, 0.7, 0.2, 1.0])
    for k in range(tcas):
        spec.add_actuator(
            name=f"pull{k}", trntype=mujoco.mjtTrn.mjTRN_TENDON, target=f"arm.tca{k}",
            gear=[-1.0, 0, 0, 0, 0, 0],
        )
    return spec.compile()


class Chain:
    """The attributes of ``tca_mj.sim.Simulation`` that are recorded, with made-up actuators."""

    def __init__(self, links: int = 4, tcas: int = 2) -> None:
        self.model = chain(links, tcas)
        self.data = mujoco.MjData(self.model)
        self.tca_names = tuple(f"arm.tca{k}" for k in range(tcas))
        self.tendon = np.arange(tcas)
        self.reset()

    def reset(self) -> None:
        mujoco.mj_resetData(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        self.power = np.zeros(len(self.tendon))
        self.temperature = np.full(len(self.tendon), 25.0)

    @property
    def time(self) -> float:
        return float(self.data.time)

    @property
    def tension(self) -> np.ndarray:
        return (self.temperature - 25.0) / 200.0

    @property
    def length(self) -> np.ndarray:
        return self.data.ten_length[self.tendon].copy()

    @property
    def resistance(self) -> np.ndarray:
        return 5.0 + 0.01 * (self.temperature - 25.0)

    def step(self, power: np.ndarray, duration: float) -> None:
        self.power = np.asarray(power, dtype=np.float64)
        self.temperature = self.temperature + duration * 10.0 * self.power
        self.data.ctrl[:] = self.tension
        mujoco.mj_step(self.model, self.data, round(duration / self.model.opt.timestep))


@pytest.fixture(scope="module")
def simulation() -> Chain:
    return Chain()


def rrd(command: str, path: Path, *more: str) -> subprocess.CompletedProcess[str]:
    """Runs ``rerun rrd`` beside this Python."""
    beside = Path(sys.executable).parent / "rerun"
    program = [str(beside)] if beside.exists() else [sys.executable, "-m", "rerun"]
    environment = dict(os.environ, RERUN_ANALYTICS="0")
    return subprocess.run(
        [*program, "rrd", command, str(path), *more], capture_output=True, text=True,
        env=environment, timeout=60, check=False,
    )


def read(path: Path) -> dict[str, dict[str, list[Any]]]:
    """Columns of a recording by entity and component, timelines among them, in order of arrival."""
    columns: dict[str, dict[str, list[Any]]] = defaultdict(lambda: defaultdict(list))
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            if name == "sim_time":
                nanoseconds = np.array(column).astype("timedelta64[ns]").astype(np.int64)
                columns[chunk.entity_path][name] += (nanoseconds * 1e-9).tolist()
            else:
                columns[chunk.entity_path][name] += column.to_pylist()
    return columns


def test_a_recording_holds_what_was_simulated(tmp_path: Path, simulation: Chain) -> None:
    simulation.reset()
    times, temperature, position, rotation, strip = [], [], [], [], []
    link = simulation.model.body("arm.link3").id
    with Recorder(simulation, tmp_path / "new" / "a.rrd", chunk=7) as recorder:
        for k in range(30):
            simulation.step(np.array([2.0, 0.5]), 0.02)
            if k in (3, 20):
                recorder.event(f"event {k}")
            recorder.frame({"progress": 0.1 * k, "heat": -1.0})
            times.append(simulation.time)
            temperature.append(simulation.temperature)
            position.append(simulation.data.xpos[link].copy())
            rotation.append(simulation.data.xquat[link][[1, 2, 3, 0]])
            adr = simulation.data.ten_wrapadr[1]
            count = simulation.data.ten_wrapnum[1]
            strip.append(simulation.data.wrap_xpos.reshape(-1, 3)[adr : adr + count].copy())
    back = read(recorder.path)

    curve = back["/actuators/arm.tca1/temperature"]
    np.testing.assert_allclose(curve["sim_time"], times, atol=1e-9)
    assert curve["step"] == list(range(30))
    values = [v[0] for v in curve["Scalars:scalars"] if v]
    np.testing.assert_array_equal(values, np.array(temperature)[:, 1])
    curves = {p.split("/")[-1] for p in back if p.startswith("/actuators/arm.tca0/")}
    assert curves == set(QUANTITIES)

    pose = back["/world/arm/link3"]
    got = np.array(pose["Transform3D:translation"]).reshape(-1, 3)
    np.testing.assert_allclose(got, position, atol=1e-6)
    got = np.array(pose["Transform3D:quaternion"]).reshape(-1, 4)
    np.testing.assert_allclose(got, rotation, atol=1e-6)
    assert np.ptp(np.array(rotation), axis=0).max() > 0.01  # it did move

    line = back["/world/tca/arm.tca1"]
    drawn = [strips[0] for strips in line["LineStrips3D:strips"] if strips]
    np.testing.assert_allclose(np.array(drawn), strip, atol=1e-6)
    first = plots.temperature_colour(temperature[0][1])
    packed = next(c for c in line["LineStrips3D:colors"] if c)[0]
    assert [packed >> 24 & 255, packed >> 16 & 255, packed >> 8 & 255] == pytest.approx(
        255.0 * first, abs=0.5
    )

    events = back["/events"]
    assert np.ravel(events["TextLog:text"]).tolist() == ["event 3", "event 20"]
    np.testing.assert_allclose(events["sim_time"], [times[3], times[20]], atol=1e-9)
    assert events["step"] == [3, 20]
    progress = [v[0] for v in back["/reward/progress"]["Scalars:scalars"] if v]
    np.testing.assert_allclose(progress, 0.1 * np.arange(30))
    for command in ("verify", "stats"):
        done = rrd(command, recorder.path)
        assert done.returncode == 0, done.stderr


def test_the_heaters_of_spines_are_recorded(tmp_path: Path, simulation: Chain) -> None:
    sim = Simulation(tetrapod(), timestep=5e-3)
    voltage = np.array([[25.0, 9.5, 0.0], [0.0, 0.0, 3.0]])
    temperature = []
    with Recorder(sim, tmp_path / "a.rrd") as recorder:
        recorder.frame()
        for each in voltage:
            sim.step(np.zeros(sim.n), 0.1, voltage=each)
            recorder.frame()
            temperature.append(sim.spines.temperature)
    back = read(recorder.path)
    for i, name in enumerate(sim.spines.names):
        got = [v[0] for v in back[f"/heaters/{name}/voltage"]["Scalars:scalars"] if v]
        assert got == [0.0, *voltage[:, i]]
        got = [v[0] for v in back[f"/heaters/{name}/temperature"]["Scalars:scalars"] if v]
        np.testing.assert_array_equal(got, [25.0, *np.array(temperature)[:, i]])
    assert got[-1] > 25.0
    assert rrd("verify", recorder.path).returncode == 0
    with Recorder(simulation, tmp_path / "b.rrd") as recorder:
        recorder.frame()
    assert not any(path.startswith("/heaters") for path in read(recorder.path))


def test_what_a_tca_lies_in_and_when_it_is_too_hot_is_recorded(tmp_path: Path) -> None:
    sim = Simulation(bending_module(), timestep=5e-3)
    powers = ([1.0, 0.0, 0.0], [4.5, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    bodies, beyond = [sim.body_temperature.copy()], []
    with Recorder(sim, tmp_path / "a.rrd") as recorder:
        recorder.frame()
        for power in powers:
            sim.step(power, 1.0)
            recorder.frame()
            bodies.append(sim.body_temperature.copy())
            beyond.append(bool(sim.extrapolated[0]))
    back = read(recorder.path)
    for i, name in enumerate(sim.tca_names):
        values = back[f"/actuators/{name}/body_temperature"]["Scalars:scalars"]
        np.testing.assert_array_equal([v[0] for v in values if v], np.array(bodies)[:, i])
    assert bodies[-1][0] > 30.0
    assert beyond == [False, True, False, False]  # 4.5 W for a second: beyond 160 °C
    told = [v[0] for v in back["/events"]["TextLog:text"] if v]
    assert told == [f"tca0: {how} the measured temperatures" for how in ("beyond", "within")]
    assert [round(t, 6) for t in back["/events"]["sim_time"]] == [2.0, 3.0]
    assert rrd("verify", recorder.path).returncode == 0


def test_geometry_is_written_once_and_only_what_moves_has_poses(
    tmp_path: Path, simulation: Chain
) -> None:
    simulation.reset()
    with Recorder(simulation, tmp_path / "a.rrd", chunk=4) as recorder:
        for _ in range(9):
            recorder.frame()
    back = read(recorder.path)
    shapes = {p: c for p, c in back.items() if any("half_sizes" in n or "lengths" in n for n in c)}
    assert {p.rsplit("/", 1)[1] for p in shapes} == {
        "planes", "boxes", "capsules", "cylinders", "spheres", "ellipsoids"
    }
    mesh = next(p for p in back if p.startswith("/world/ball/mesh"))
    assert all("sim_time" not in back[p] for p in (*shapes, mesh, "/world/arm/_body"))
    assert len(back["/world/arm/_body"]["Transform3D:translation"]) == 1
    assert len(back["/world/ball"]["Transform3D:translation"]) == 9
    assert not any("frame" in p for p in back)  # a body without geoms
    assert "/world/arm/_body/boxes" not in back  # a geom of a hidden group
    # A colour of its own, and the material's where it has none.
    assert back["/world/scene/boxes"]["Boxes3D:colors"][0] == [0xBF8040FF]
    # Mesh corners: in the body's frame, as MuJoCo places them.
    corners = np.array(back[mesh]["Mesh3D:vertex_positions"]).reshape(-1, 3)
    assert corners.min(axis=0) == pytest.approx(np.zeros(3), abs=1e-6)
    assert corners.max(axis=0) == pytest.approx(np.full(3, 0.03), abs=1e-6)
    normals = np.array(back[mesh]["Mesh3D:vertex_normals"]).reshape(-1, 3, 3)
    a, b, c = np.moveaxis(corners.reshape(-1, 3, 3), 1, 0)
    flat = np.cross(b - a, c - a)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    assert np.einsum("fci,fi->fc", normals, flat).min() > 0.49  # outward, as the triangles turn


def test_capsules_stand_where_mujoco_has_them(tmp_path: Path, simulation: Chain) -> None:
    """Rerun's capsule runs from its position along +z for its length; MuJoCo's is centred."""
    with Recorder(simulation, tmp_path / "a.rrd") as recorder:
        pass
    capsule = read(recorder.path)["/world/arm/link1/capsules"]
    assert np.ravel(capsule["Capsules3D:translations"]) == pytest.approx([0.0, 0.0, -0.008])
    assert np.ravel(capsule["Capsules3D:lengths"]) == pytest.approx([0.016])


def test_paths_of_bodies_are_never_nested(simulation: Chain) -> None:
    """A pose applies to everything below its entity, and poses are in the world's frame."""
    paths = list(body_paths(simulation.model).values())
    assert "/world/arm/_body" in paths and "/world/arm/link0" in paths
    assert not any(b.startswith(a + "/") for a in paths for b in paths)
    assert len(set(paths)) == len(paths)


def test_recording_does_not_touch_the_simulation(tmp_path: Path) -> None:
    plain, recorded = Chain(), Chain()
    with Recorder(recorded, tmp_path / "a.rrd", chunk=3) as recorder:
        for _ in range(10):
            for each in (plain, recorded):
                each.step(np.array([1.0, 0.0]), 0.02)
            recorder.event("here")
            recorder.frame()
    np.testing.assert_array_equal(plain.data.qpos, recorded.data.qpos)
    np.testing.assert_array_equal(plain.data.xpos, recorded.data.xpos)
    np.testing.assert_array_equal(plain.data.qfrc_constraint, recorded.data.qfrc_constraint)


def test_every_other_frame_and_a_reset_that_does_not_turn_back_time(
    tmp_path: Path, simulation: Chain
) -> None:
    simulation.reset()
    with Recorder(simulation, tmp_path / "a.rrd", every=2) as recorder:
        for _ in range(2):
            for _ in range(4):
                simulation.step(np.zeros(2), 0.02)
                recorder.frame()
            simulation.reset()
    back = read(recorder.path)
    assert back["/world/ball"]["step"] == [0, 2, 4, 6]
    np.testing.assert_allclose(back["/world/ball"]["sim_time"], [0.02, 0.06, 0.1, 0.14])
    assert np.ravel(back["/events"]["TextLog:text"]).tolist() == ["reset"]


def test_an_event_before_the_first_frame_takes_that_frame(
    tmp_path: Path, simulation: Chain
) -> None:
    with Recorder(simulation, tmp_path / "a.rrd") as recorder:
        recorder.event("start")
    assert len(read(recorder.path)["/world/ball"]["step"]) == 1


def test_an_exception_and_a_second_close_leave_a_whole_file(
    tmp_path: Path, simulation: Chain
) -> None:
    with pytest.raises(KeyboardInterrupt), Recorder(simulation, tmp_path / "a.rrd") as recorder:
        for _ in range(5):
            recorder.frame()
        raise KeyboardInterrupt
    recorder.close()
    assert len(read(recorder.path)["/world/ball"]["step"]) == 5
    assert rrd("verify", recorder.path).returncode == 0
    for late in (recorder.frame, lambda: recorder.event("late")):
        with pytest.raises(RuntimeError, match="closed"):
            late()


def test_ctrl_c_while_writing_loses_nothing(
    tmp_path: Path, simulation: Chain, monkeypatch: pytest.MonkeyPatch
) -> None:
    send, calls = Recorder._send, []

    def interrupted(self: Recorder, *arguments: Any) -> None:
        calls.append(None)
        if len(calls) == 4:
            raise KeyboardInterrupt
        send(self, *arguments)

    monkeypatch.setattr(Recorder, "_send", interrupted)
    with pytest.raises(KeyboardInterrupt), Recorder(simulation, tmp_path / "a.rrd", chunk=5) as r:
        for k in range(10):
            r.frame({"progress": float(k)})
    back = read(r.path)
    for entity in ("/world/ball", "/world/tca/arm.tca1", "/reward/progress"):
        assert sorted(set(back[entity]["step"])) == list(range(5))


KILLED = """
import sys, time
sys.path.insert(0, {tests!r})
from test_record import Chain, Recorder
simulation = Chain()
recorder = Recorder(simulation, {path!r}, chunk=10)
for k in range(25):
    simulation.step([1.0, 1.0], 0.02)
    recorder.frame()
    recorder.event("event " + str(k))
print("written", flush=True)
time.sleep(60)
"""


def test_a_killed_process_leaves_the_full_chunks(tmp_path: Path) -> None:
    """The file lacks its footer then: readable, yet not verified before it is merged anew."""
    path = tmp_path / "cut.rrd"
    script = KILLED.format(tests=str(Path(__file__).parent), path=str(path))
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline() == b"written\n"
        process.send_signal(signal.SIGKILL)
    with pytest.warns(rerun.error_utils.RerunWarning, match="no footer"):
        back = read(path)
    assert back["/world/ball"]["step"] == list(range(20))
    assert len(back["/events"]["TextLog:text"]) == 19  # the last waited for the next frame
    assert rrd("stats", path).returncode == 0
    assert rrd("verify", path).returncode != 0
    whole = tmp_path / "whole.rrd"
    assert rrd("merge", path, "-o", str(whole)).returncode == 0
    assert rrd("verify", whole).returncode == 0
    assert read(whole)["/world/ball"]["step"] == list(range(20))


def test_no_global_recording_is_made(tmp_path: Path, simulation: Chain) -> None:
    with Recorder(simulation, tmp_path / "a.rrd"), Recorder(simulation, tmp_path / "b.rrd") as b:
        assert rerun.get_global_data_recording() is None
        assert rerun.get_thread_local_data_recording() is None
        b.frame()
    assert "/world/ball" in read(tmp_path / "b.rrd")
    assert "sim_time" not in read(tmp_path / "a.rrd")["/world/ball"]


def test_the_file_brings_its_layout(tmp_path: Path, simulation: Chain) -> None:
    with Recorder(simulation, tmp_path / "a.rrd") as recorder:
        recorder.frame()
    reader = RrdReader(recorder.path)
    (blueprint,) = reader.blueprints()
    text = str([
        column.to_pylist()
        for chunk in reader.stream(store=blueprint).to_chunks()
        for column in chunk.to_record_batch().columns
        if str(column.type).startswith("list")
    ])
    for name in ("Robot", "Reward", "Events", "/actuators/arm.tca1/tension", *QUANTITIES.values()):
        assert name in text


@pytest.mark.parametrize(
    "wrong",
    [
        {"every": 0}, {"every": 1.5}, {"chunk": 0}, {"chunk": 2.5}, {"tca_radius": 0.0},
        {"tca_radius": float("inf")},
    ],
)
def test_wrong_numbers_are_refused(tmp_path: Path, simulation: Chain, wrong: Any) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Recorder(simulation, tmp_path / "a.rrd", **wrong)


def test_cost_of_a_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Prints it; the time itself depends on the machine."""
    simulation = Chain(links=48, tcas=5)
    frames = 500
    with Recorder(simulation, tmp_path / "a.rrd") as recorder:
        start = time.perf_counter()
        for _ in range(frames):
            recorder.frame({"progress": 0.0})
        cost = (time.perf_counter() - start) / frames
    with capsys.disabled():
        print(
            f"\nrecording costs {1e3 * cost:.3f} ms and "
            f"{recorder.path.stat().st_size / frames / 1e3:.1f} kB per frame "
            f"({len(body_paths(simulation.model))} bodies, 5 TCAs)"
        )


def test_temperatures_grow_brighter_and_redder_from_dark_blue() -> None:
    colour = plots.temperature_colour(np.linspace(25.0, 180.0, 200))
    linear = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    assert np.all(np.diff(linear @ [0.2126, 0.7152, 0.0722]) > 0.0)  # luminance of sRGB
    assert colour[0].argmax() == 2 and colour[-1].argmax() == 0
    assert np.abs(np.diff(colour, axis=0)).max() < 0.03  # no visible bands
    np.testing.assert_array_equal(plots.temperature_colour([-10.0, 999.0]), colour[[0, -1]])


def test_tendons_take_the_colours_of_their_temperatures(simulation: Chain) -> None:
    render.colour_tendons(simulation.model, simulation.tendon, [25.0, 180.0])
    expected = plots.temperature_colour([25.0, 180.0])
    np.testing.assert_allclose(simulation.model.tendon_rgba[:, :3], expected, atol=1e-7)


@pytest.fixture(scope="module")
def opengl() -> None:
    try:
        render.gl_backend()
    except render.RenderingUnavailable as error:
        pytest.skip(str(error))


def looking() -> mujoco.MjvCamera:
    """A camera that has the whole chain in its picture."""
    camera = mujoco.MjvCamera()
    camera.lookat[:] = [0.0, 0.0, 0.12]
    camera.distance, camera.azimuth, camera.elevation = 0.25, 90.0, -10.0
    return camera


@pytest.mark.usefixtures("opengl")
def test_a_picture_shows_the_temperature(simulation: Chain) -> None:
    simulation.reset()
    camera = looking()
    pictures = []
    with render.Offscreen(simulation.model, width=320, height=240, camera=camera) as view:
        for temperature in (np.full(2, 25.0), np.full(2, 180.0)):
            render.colour_tendons(simulation.model, simulation.tendon, temperature)
            pictures.append(view.draw(simulation.data))
    cold, hot = pictures
    assert cold.shape == (240, 320, 3)
    changed = (cold != hot).any(axis=2)
    assert 20 < changed.sum() < 0.1 * changed.size
    assert (hot[changed].astype(int) - cold[changed])[:, 0].mean() > 20.0  # redder


def test_a_coil_runs_round_its_path() -> None:
    """A half circle of 40 mm: at its radius all along, with all its turns."""
    turn = np.linspace(0.0, np.pi, 400)
    path = 0.04 * np.array([np.cos(turn), 0.0 * turn, np.sin(turn)]).T
    coil, out = _helix(np.repeat(path, 2, axis=0), turns=30, radius=5e-4)  # sites may coincide
    off = np.hypot(np.hypot(coil[:, 0], coil[:, 2]) - 0.04, coil[:, 1])
    np.testing.assert_allclose(off, 5e-4, rtol=0.02)
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 1.0)
    across = coil[:, 1] > 0.0
    assert np.sum(across[1:] != across[:-1]) == pytest.approx(60, abs=1)


@pytest.mark.usefixtures("opengl")
def test_a_picture_has_coils_and_a_caption(simulation: Chain) -> None:
    simulation.reset()
    camera = looking()
    with render.Offscreen(
        simulation.model, width=320, height=240, camera=camera, coils=simulation.tendon
    ) as view:
        plain = view.draw(simulation.data)
        told = view.draw(simulation.data, "1.0 s")
        drawn = view._scene.ngeom
    changed = (plain != told).any(axis=2)
    assert changed[200:].any() and not changed[:180].any()  # at the lower edge alone
    length = simulation.model.tendon_length0 / simulation.model.tendon_width / coils._PITCH
    assert drawn > coils._SIDES * np.round(length).sum()
    with pytest.raises(ValueError, match="coils must be ids below"):
        render.Offscreen(simulation.model, coils=[99])


@pytest.mark.usefixtures("opengl")
def test_a_film_runs_at_the_speed_of_the_simulation(tmp_path: Path, simulation: Chain) -> None:
    reader = pytest.importorskip("imageio_ffmpeg")
    simulation.reset()
    path = tmp_path / "film.mp4"
    with film_module.Film(simulation, path, fps=20.0, speed=2.0, width=160, height=112) as film:
        for _ in range(50):
            film.frame()
            simulation.step(np.zeros(2), 0.04)
    frames, seconds = reader.count_frames_and_secs(str(path))
    assert frames == 20 and seconds == pytest.approx(1.0, abs=0.05)  # 2 s at twice the speed
    header = next(reader.read_frames(str(path)))
    assert (header["codec"], header["size"]) == ("h264", (160, 112))
    assert header["pix_fmt"].startswith("yuv420p")


def test_without_opengl_one_clear_error_and_a_quiet_exit(tmp_path: Path) -> None:
    script = """
import mujoco
from tca_mj.record import render
try:
    render.Offscreen(mujoco.MjModel.from_xml_string("<mujoco/>"))
except render.RenderingUnavailable as error:
    print(error)
"""
    for backend, said in (("off", "switched off"), ("nonsense", "libegl1")):
        environment = dict(os.environ, MUJOCO_GL=backend)
        if backend == "nonsense":
            # MuJoCo itself refuses the name when it is imported: name it afterwards.
            environment["MUJOCO_GL"] = ""
            change = "import os; os.environ['MUJOCO_GL'] = 'nonsense'\nfrom tca_mj"
            script = script.replace("from tca_mj", change)
        done = subprocess.run(
            [sys.executable, "-c", script], env=environment, capture_output=True, text=True,
            timeout=60, check=False,
        )
        assert done.returncode == 0 and said in done.stdout, done
        assert done.stderr == ""


@pytest.mark.usefixtures("opengl")
def test_a_camera_left_open_is_quiet_at_exit() -> None:
    script = """
import mujoco
from tca_mj.record import render
model = mujoco.MjModel.from_xml_string("<mujoco/>")
left = render.Offscreen(model, width=64, height=48)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
print(left.draw(data).shape)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "(48, 64, 3)\n", "")


@pytest.mark.parametrize(
    ("time", "speed", "said"),
    [(12.34, 1.0, "12.3 s"), (12.34, 23.0, "12.3 s, 23 times as fast"),
     (0.0512, 0.1, "0.05 s, 10 times as slow")],
)  # fmt: skip
def test_a_clock_tells_time_and_pace(time: float, speed: float, said: str) -> None:
    assert film_module.clock(time, speed) == said


def test_wrong_films_are_refused(tmp_path: Path, simulation: Chain) -> None:
    pytest.importorskip("imageio_ffmpeg")
    with pytest.raises(ValueError, match="mp4"):
        film_module.Film(simulation, tmp_path / "a.avi")
    for wrong in ({"fps": 0.0}, {"speed": np.inf}, {"height": 0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            film_module.Film(simulation, tmp_path / "a.mp4", **wrong)
    with pytest.raises(ValueError, match="multiples of 16"):
        film_module.Film(simulation, tmp_path / "a.mp4", width=100)


def test_event_labels_neither_overlap_nor_stand_on_lines() -> None:
    rng = np.random.default_rng(0)
    start = np.sort(rng.uniform(0.0, 10.0, 12)).tolist()
    width = rng.uniform(0.5, 2.0, 12).tolist()
    rows = plots.event_rows(width, start)
    for i in range(12):
        for j in range(i + 1, 12):
            if start[j] < start[i] + width[i]:
                assert rows[i] > rows[j]  # the line to label j ends below label i


def test_a_rollout_plot_is_drawn_without_global_state(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    clock = np.linspace(0.0, 10.0, 50)
    curves = np.outer(clock, [1.0, 2.0])
    arguments = (clock, curves, 25.0 + curves, 0.01 * curves, clock, ["tca0", "tca1"])
    plots.rollout_plot(tmp_path / "b" / "a.png", *arguments, [(9.9, "open"), (1.0, "close")])
    assert (tmp_path / "b" / "a.png").read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(ValueError, match="tension"):
        plots.rollout_plot(
            tmp_path / "a.png", clock, curves, curves, curves[:, :1], clock, ["tca0", "tca1"]
        )
