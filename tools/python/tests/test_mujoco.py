"""The client of MuJoCo: its free bodies on the board, everything else on MuJoCo's own solver."""

import importlib.util
import pathlib

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
CLIENT = pathlib.Path(__file__).parents[2] / "clients/mujoco/board_solver.py"


@pytest.fixture(scope="module")
def client():
    spec = importlib.util.spec_from_file_location("board_solver", CLIENT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def world(inside):
    return mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.005"/><worldbody><geom type="plane" size="20 20 .1" friction="0.01"/>'
        f"{inside}</worldbody></mujoco>")


def box(x, z, friction=0.6, more=""):
    return (f'<body pos="{x} 0 {z}"><freejoint/><geom type="box" size="0.2 0.2 0.2" mass="1" friction="{friction}" '
            f'condim="3"/>{more}</body>')


def test_a_pile_falls_as_on_mujocos_solver(client):
    model = mujoco.MjModel.from_xml_string(client.scene())
    own, board = mujoco.MjData(model), mujoco.MjData(model)
    solver = client.BoardSolver(model)
    for _ in range(400):
        mujoco.mj_step(model, own)
        solver.step(board)
    (height, energy, depth), (ours, our_energy, our_depth) = (client.figures(model, data) for data in (own, board))
    assert abs(ours - height) < 0.1 * height and our_depth < depth + 2
    assert our_energy < 1.2 * energy and solver.on_board == model.nbody - 2 and solver.cycles > 1000


def test_bodies_that_touch_a_jointed_one_stay_with_mujoco_to_the_bit(client):
    arm = '<body pos="0 0 0.1"><joint axis="0 1 0"/><geom type="box" size="0.5 0.3 0.1" mass="3"/></body>'
    model = world(arm + box(0, 0.395) + box(0, 0.79) + box(3, 0.195))
    own, board = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_step(model, own)
    solver = client.BoardSolver(model)
    solver.step(board)
    assert solver.on_board == 1 and list(solver.free) == [2, 3, 4]
    assert np.array_equal(board.qvel[:13], own.qvel[:13]) and not np.array_equal(board.qvel[13:], own.qvel[13:])
    assert np.array_equal(board.qpos[:15], own.qpos[:15])


def test_each_pair_has_its_own_friction(client):
    frictions = (0.1, 0.3, 0.5)
    model = world("".join(box(3 * place, 0.2, friction) for place, friction in enumerate(frictions)))
    data, solver = mujoco.MjData(model), client.BoardSolver(model)
    speed = data.qvel.reshape(3, 6)
    speed[:, 1] = 3
    for _ in range(40):
        solver.step(data)
    assert np.allclose(3 - speed[:, 1], np.array(frictions) * 9.81 * 0.2, rtol=0.1)


def test_a_centre_of_mass_off_the_frame_and_forces_equal_mujoco(client):
    heavy = '<geom type="sphere" size="0.1" pos="0.4 0.1 0" mass="5"/>'
    model = world(box(0, 3, more=heavy))
    own, board = mujoco.MjData(model), mujoco.MjData(model)
    for data in (own, board):
        data.qvel[:] = 1, 2, 3, 4, -3, 2
        data.xfrc_applied[1] = 3, 0, 0, 0, 2, 0
    solver = client.BoardSolver(model)
    for _ in range(60):
        mujoco.mj_step(model, own)
        solver.step(board)
    assert solver.on_board == 1
    assert np.allclose(board.qpos, own.qpos, atol=1e-3) and np.allclose(board.qvel, own.qvel, atol=2e-3)


def test_a_body_of_an_equality_or_a_tendon_or_with_another_on_it_is_mujocos(client):
    ball = '<body pos="0 0 0.5"><joint axis="1 0 0"/><geom type="sphere" size="0.1"/></body>'
    more = {"a": "", "b": "", "c": ball, "d": "", "e": '<site name="e"/>', "f": '<site name="f"/>'}
    bodies = "".join(f'<body name="{name}" pos="{place} 0 5"><freejoint/><geom size="0.1"/>{inside}</body>'
                     for place, (name, inside) in enumerate(more.items()))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody>{bodies}</worldbody>'
        '<equality><connect body1="a" body2="b" anchor="0.5 0 0"/></equality>'
        '<tendon><spatial limited="true" range="0 1"><site site="e"/><site site="f"/></spatial></tendon></mujoco>')
    assert [model.body(body).name for body in client.BoardSolver(model).free] == ["d"]
