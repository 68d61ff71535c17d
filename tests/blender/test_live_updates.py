"""Updates while moving: the light follows once the user rests, gives way when the user goes on, and ends by itself."""

import bpy
import numpy as np
import pytest
from detp import detp_addon
from detp.detp_addon.panel import live_updates, session
from small_scenes import colours, cube, grid, lamp

PLACE = (0.0, 0.0, 0.2)


@pytest.fixture(scope="module")
def baked():
    """A box on a floor, baked and kept."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    detp_addon.register()
    grid("Floor")
    cube("Box", PLACE, 0.4)
    lamp()
    assert bpy.ops.detp.bake(quality="DRAFT", keep=True) == {"FINISHED"}
    yield
    detp_addon.unregister()


@pytest.fixture(autouse=True)
def clock(baked, monkeypatch):
    """The light follows; and a clock that stands until it is moved."""
    bpy.context.window_manager.detp_live_updates = True
    now = [0.0]
    monkeypatch.setattr(live_updates.time, "perf_counter", lambda: now[0])
    bpy.data.objects["Lamp"].location = (1, 0.5, 3)
    move(PLACE)
    settle(now)
    yield now
    bpy.context.window_manager.detp_live_updates = False


def settle(now, ticks=10_000):
    """Let the clock go on and the light follow until nothing is left to do."""
    now[0] += live_updates.QUIET + 0.1
    for _ in range(ticks):
        if live_updates._tick() != live_updates.PAUSE:
            return
    raise AssertionError("the light never came to rest")


def begin(now):
    """Move the box and let the update begin."""
    move()
    now[0] += live_updates.QUIET + 0.1
    assert live_updates._tick() == live_updates.PAUSE
    return session.running()


def move(to=(1.0, 0.5, 0.2)):
    bpy.data.objects["Box"].location = to
    bpy.context.view_layer.update()


def test_the_light_follows_what_was_moved_and_back(clock):
    first = colours("Floor")
    move()
    assert live_updates._tick() == live_updates.TICK and session.running() is None
    settle(clock)
    assert session.latest().outcome.report.updated
    assert not np.array_equal(colours("Floor"), first)
    move(PLACE)
    settle(clock)
    assert np.array_equal(colours("Floor"), first)


def test_what_it_writes_itself_is_no_change_and_neither_is_a_selection(clock):
    begin(clock)
    settle(clock)
    done = session.latest()
    bpy.data.objects["Box"].select_set(False)
    bpy.context.view_layer.update()
    settle(clock)
    assert session.latest() is done


def test_a_user_who_goes_on_moving_is_not_waited_for(clock):
    first = colours("Floor")
    bake = begin(clock)
    move((-1.0, 0.5, 0.2))
    assert bake.outcome.status == session.CANCELLED
    assert np.array_equal(colours("Floor"), first)
    settle(clock)
    assert session.latest().outcome.status == session.DONE and session.latest() is not bake


def test_a_whole_bake_is_left_to_the_user_and_that_is_said(clock):
    first = colours("Floor")
    bpy.data.objects["Lamp"].location.x += 0.1
    bpy.context.view_layer.update()
    settle(clock)
    assert session.latest().outcome.status == session.FAILED and "lights" in session.latest().outcome.message
    assert np.array_equal(colours("Floor"), first)
    done = session.latest()
    settle(clock)
    assert session.latest() is done


def test_it_waits_for_the_end_of_edit_mode(clock):
    bpy.context.view_layer.objects.active = bpy.data.objects["Floor"]
    bpy.ops.object.mode_set(mode="EDIT")
    done = session.latest()
    bpy.context.view_layer.update()
    live_updates.follower.see_change()
    settle(clock)
    assert session.latest() is done
    bpy.ops.object.mode_set(mode="OBJECT")
    settle(clock)
    assert session.latest() is not done


def test_it_ends_by_itself_where_the_window_stands_still(clock, monkeypatch):
    monkeypatch.setattr(live_updates, "LONGEST", -1.0)
    begin(clock)
    settle(clock, 1000)
    manager = bpy.context.window_manager
    assert not manager.detp_live_updates and "stood still" in manager.detp_live_note
    assert live_updates._tick() is None


def test_another_file_ends_it(clock):
    begin(clock)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert not bpy.context.window_manager.detp_live_updates and session.running() is None
