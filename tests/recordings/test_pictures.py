import math
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.wording import unnamed
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text
from PIL import Image, ImageColor

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import TrackPoint
from dva_sim.recordings.pictures import Wanted, colours, style
from dva_sim.recordings.pictures.bodies import DrawnBody
from dva_sim.recordings.pictures.film import Film
from dva_sim.recordings.pictures.film_files import write_film
from dva_sim.recordings.pictures.moments import Moments
from dva_sim.recordings.pictures.name_labels import Box, Names
from dva_sim.recordings.pictures.run_endings import verdicts
from dva_sim.recordings.pictures.scene import Scene
from dva_sim.recordings.pictures.stills import still, time_of_still
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Ending, simulate

pytestmark = pytest.mark.system


def run_of(name="drive-to-event", seed=1, **changes):
    return simulate(scenarios.build(scenarios.load(name), changes), seed, keep_traffic=True)


def new_figure(size):
    figure = Figure(figsize=size, dpi=100)
    FigureCanvasAgg(figure)
    return figure


@pytest.fixture(scope="module")
def drive():
    """Half a minute of a drive with half a second of delay each way."""
    return run_of(**{"horizon_s": 30, "link.delay_s": 0.5})


@pytest.fixture(scope="module")
def film():
    """A second of the same."""
    return Film([run_of(**{"horizon_s": 1, "link.delay_s": 0.5})])


@pytest.fixture(scope="module")
def drill():
    """Two robots, two guards, a fire and a gas leak."""
    return run_of("fire-drill", horizon_s=120)


def ffmpeg_that(tmp_path, monkeypatch, script):
    """Another program in the place of ffmpeg."""
    fake = tmp_path / "ffmpeg"
    fake.write_text(f"#!/bin/sh\n{script}\n")
    fake.chmod(0o755)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(fake))


# --- films ---------------------------------------------------------------------------------


def test_an_mp4_has_every_frame_at_the_size_of_the_film(film, tmp_path):
    import imageio_ffmpeg

    path = tmp_path / "film.mp4"
    write_film(film, path)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert frames == len(film) == 32
    assert seconds == pytest.approx(frames / 8)
    reader = imageio_ffmpeg.read_frames(str(path))
    meta, first = next(reader), next(reader)
    reader.close()
    height, width = film.at(0.0).shape[:2]
    assert meta["size"] == (width + width % 2, height + height % 2)
    picture = np.frombuffer(first, np.uint8).reshape(meta["size"][1], meta["size"][0], 3)
    assert np.abs(picture[:height, :width].astype(int) - film.at(0.0)).mean() < 5
    assert [p.name for p in tmp_path.iterdir()] == ["film.mp4"]


def test_a_gif_has_every_frame_and_moves(film, tmp_path):
    path = tmp_path / "film.gif"
    write_film(film, path)
    with Image.open(path) as gif:
        assert gif.n_frames == pytest.approx(len(film), abs=25)  # the same twice is one
        first = gif.convert("RGB").tobytes()
        gif.seek(gif.n_frames - 1)
        assert gif.convert("RGB").tobytes() != first


@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("echo 'Unknown encoder' >&2; exit 3", "ffmpeg .*: Unknown encoder"),
        ("head -c 100000 >/dev/null; kill -9 $$", "ended with -9"),
        ("cat >/dev/null; echo part > $(eval echo \\${$#}); exit 1", "ended with 1"),
    ],
)
def test_an_ffmpeg_that_fails_is_one_line_and_no_half_film(
    film, tmp_path, monkeypatch, script, expected
):
    ffmpeg_that(tmp_path, monkeypatch, script)
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "old.mp4").write_bytes(b"old")
    for name in ("film.mp4", "old.mp4"):
        with pytest.raises(ConfigError, match=expected) as error:
            write_film(film, folder / name)
        assert len(str(error.value).splitlines()) == 1
    assert [(path.name, path.read_bytes()) for path in folder.iterdir()] == [("old.mp4", b"old")]


def test_without_any_ffmpeg_one_is_told_what_to_install_before_the_run(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ConfigError, match=r"'\.\[video\]', or .* ffmpeg"):
        Wanted(video=tmp_path / "film.mp4")


# --- how a film ends -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def race():
    """Two runs of which one ends after 12 s and the other, with its robot on the way, after 20."""
    return [run_of(**{"horizon_s": 20 - 8 * number, "link.delay_s": 0.1}) for number in (0, 1)]


@pytest.fixture(scope="module")
def films(race):
    """Both in a film, without and with the pictures of their cameras."""
    return {inset: Film(race, inset) for inset in (False, True)}


@pytest.fixture(scope="module")
def film_of_drill(drill):
    return Film([drill])


def halves(picture):
    half = picture.shape[1] // 2
    return picture[:, :half], picture[:, half:]


def pixels_of(picture, colour):
    wanted = np.array(ImageColor.getrgb(colour))
    return int((np.abs(picture.astype(int) - wanted).max(axis=2) < 10).sum())


@pytest.mark.parametrize("inset", [False, True])
def test_a_side_that_has_ended_stays_as_it_was_at_its_end_with_its_robot_there(films, inset):
    film = films[inset]
    (goes_on, ended), (last, still_ended) = halves(film.at(13.0)), halves(film.at(20.0))
    assert np.array_equal(ended, still_ended)
    assert not np.array_equal(goes_on, last)
    for side in (last, still_ended):
        assert pixels_of(side, colours.ROBOT_MODES["Teleoperation"]) > 40


def test_a_film_stands_long_enough_at_its_end_to_be_read(film):
    frames = list(film.frames())
    assert all(np.array_equal(frame, frames[-1]) for frame in frames[-24:])


def test_below_each_map_stands_how_its_run_ended_from_then_on_and_not_before(films):
    film = films[False]
    reports = [scene_lines(ax) for ax in film.figure.axes[:2]]
    film.at(11.9)
    assert [ended.get_text()[-4:] for _, ended in reports] == ["20 s", "12 s"]
    before, after = film.at(11.9), film.at(12.0)
    assert pixels_of(halves(before)[1], style.FAILED) == 0
    assert pixels_of(halves(after)[1], style.FAILED) > 1000
    assert pixels_of(halves(after)[0], style.FAILED) == 0


def scene_lines(ax):
    """The two lines below a map: what happened last, and how it ended."""
    return [child for child in ax.get_children() if isinstance(child, Annotation)]


@pytest.mark.parametrize("inset", [False, True])
def test_every_word_of_a_film_is_legible_at_the_width_of_a_page(films, inset):
    figure = films[inset].figure
    assert figure.bbox.width == 840
    words = [t for t in figure.findobj(Text) if t.get_text().strip() and t.get_visible()]
    assert len(words) > 40
    assert min(word.get_fontsize() for word in words) * figure.dpi / 72 >= 9


@pytest.mark.parametrize(("name", "inset"), [("race", False), ("race", True), ("drill", True)])
def test_lines_above_and_below_the_maps_do_not_meet(race, drill, name, inset):
    figure = Film(race if name == "race" else [drill], inset).figure
    lines = [figure.legends[0], *figure.texts]
    for ax in figure.axes:
        lines += [t for t in (ax.title, ax._left_title, ax._right_title) if t.get_text()]
        lines += [t for t in scene_lines(ax) if t.get_text().strip()]
        lines += [*ax.get_xticklabels(), *ax.get_yticklabels()] if ax.axison else []
    boxes = boxes_of(lines, figure.axes[0])
    page = Box(0, 0, *figure.bbox.size)
    for number, box in enumerate(boxes):
        assert box.beyond(page) < 3, lines[number]
        assert not any(box.overlap(other) > 2 for other in boxes[number + 1 :]), lines[number]


# --- what a picture shows ------------------------------------------------------------------


def test_between_two_samples_a_body_is_between_two_places():
    track = [
        TrackPoint(0.0, 0.0, 0.0, math.radians(170), "Idle"),
        TrackPoint(2.0, 4.0, 2.0, math.radians(-170), "Mission"),
    ]
    recorder = SimpleNamespace(tracks={"robot-1": track})
    nothing = SimpleNamespace(site=None, incidents=[], contained={}, recorder=recorder)
    moments = Moments(nothing)
    here = moments.at("robot-1", 0.5)
    assert (here.x, here.y, here.mode) == (1.0, 0.5, "Idle")
    assert math.degrees(here.heading) == pytest.approx(175)
    assert moments.at("robot-1", 9.0)[1:3] == (4.0, 2.0)
    assert moments.at("robot-1", -1.0)[1:3] == (0.0, 0.0)


def test_fire_darkens_its_room_with_smoke_and_gas_tints_its_own(drill, film_of_drill):
    film = film_of_drill
    before, after = film.at(1.0).astype(int), film.at(120.0).astype(int)
    axes = film.figure.axes[0]
    fire = next(i for i in drill.incidents if i.kind == "fire")
    gas = next(i for i in drill.incidents if i.kind == "gas_leak")
    changes = {}
    for incident in (fire, gas):
        room = drill.site.room(incident.room).polygon
        x, y = axes.transData.transform(room).astype(int).T
        rows = slice(before.shape[0] - y.max() + 3, before.shape[0] - y.min() - 3)
        block = rows, slice(x.min() + 3, x.max() - 3)
        changes[incident.kind] = (after[block] - before[block]).reshape(-1, 3).mean(axis=0)
    assert changes["fire"].max() < -10  # darker in all colours
    assert changes["gas_leak"][2] < changes["gas_leak"][0] - 4  # yellow: blue is lost


def test_the_key_names_what_occurs_and_nothing_else(drill):
    labels = [str(handle.get_label()) for handle in style.legend([Moments(drill)])]
    assert {"robot: idle", "guard: waiting", "fire", "gas leak", "smoke"} <= set(labels)
    assert "water" not in labels
    assert "flood" not in labels
    assert len(labels) == len(set(labels))


def test_trails_fade_with_time(drive):
    ax = new_figure((6, 4)).add_subplot()
    ax.set(xlim=(0, 40), ylim=(0, 24))
    trail = DrawnBody(ax, Moments(drive), "robot-1").show(30.0)[0]
    cover = np.array(trail.get_colors())[:, 3]
    assert cover[0] < cover[-1] < 0.9
    assert np.all(np.diff(cover) > 0)


def test_who_has_left_the_site_is_not_drawn_but_left_a_trail():
    run = run_of("drive-to-event", horizon_s=20)
    run.recorder.tracks["bystander-1"] = [
        TrackPoint(float(t), 5.0 + t, 12.0, 0.0, "evacuating") for t in range(8)
    ]
    moments, ax = Moments(run), new_figure((6, 4)).add_subplot()
    ax.set(xlim=(0, 40), ylim=(0, 24))
    body = DrawnBody(ax, moments, "bystander-1")
    assert [len(body.show(time)) for time in (3.0, 7.5, 12.0)] == [2, 2, 1]
    assert len(body.show(12.0)[0].get_segments()) == 7
    assert moments.eye("robot-1", 3.0).shape == moments.eye("robot-1", 12.0).shape


@pytest.mark.parametrize(("metres", "true_to_scale"), [(10, True), (300, False)])
def test_a_robot_is_true_to_scale_but_never_too_small_to_see(drive, metres, true_to_scale):
    ax = new_figure((6, 6)).add_subplot()
    ax.set(xlim=(0, metres), ylim=(0, metres), aspect="equal")
    ax.figure.draw_without_rendering()
    size = DrawnBody(ax, Moments(drive), "robot-1").size()
    assert (size > style.SMALLEST["robot"]) == true_to_scale
    assert size >= 8.5


class Fixed:
    """A body that stands somewhere."""

    kind = "robot"

    def __init__(self, name, x, y):
        self.name, self._place = name, (x, y)

    def size(self):
        return 9.0

    def place(self, time):
        return self._place

    def is_there(self, time):
        return True


def boxes_of(texts, ax):
    renderer = ax.figure.canvas.get_renderer()
    return [Box(*text.get_window_extent(renderer).extents) for text in texts]


def test_names_of_a_crowd_neither_meet_each_other_nor_leave_the_map():
    ax = new_figure((6, 4)).add_subplot()
    ax.set(xlim=(0, 30), ylim=(0, 20))
    room = ax.text(12, 10, "Control room", fontsize=7)
    ax.figure.draw_without_rendering()
    places = [(0.2, 0.2), (29.8, 19.8), (0.1, 19.9), (12, 10.8), (13, 9.5), (15, 10), (15.5, 10.5)]
    crowd = [Fixed(f"robot-{n}", *place) for n, place in enumerate(places, 1)]
    boxes = boxes_of([*Names(ax, crowd).show(0.0, [(14, 11)]), room], ax)
    frame = Box(*ax.get_window_extent().extents)
    for number, box in enumerate(boxes):
        assert box.beyond(frame) < 1
        assert all(box.overlap(other) < 1 for other in boxes[number + 1 :])


def test_a_name_stays_on_its_side_while_nothing_is_in_its_way():
    ax = new_figure((6, 4)).add_subplot()
    ax.set(xlim=(0, 30), ylim=(0, 20))
    ax.figure.draw_without_rendering()
    body = Fixed("robot-1", 15, 10)
    names = Names(ax, [body])
    first = names.show(0.0, [])[0].get_position()
    names.show(1.0, [(15, 10.8)])  # something above makes it move ...
    assert names.show(1.0, [(15, 10.8)])[0].get_position() != first
    moved = names.show(2.0, [])[0].get_position()
    assert moved != first  # ... and it does not jump back


def test_the_operator_is_shown_a_picture_as_old_as_the_link_makes_it(drive):
    moments = Moments(drive)
    glance = next(g for t in range(30) if (g := moments.glance(float(t))) is not None)
    driven = drive.recorder.drives[0]
    time = driven.started + 5.0
    glance = moments.glance(time)
    assert (glance.operator, glance.robot) == ("operator-1", "robot-1")
    assert 0.5 <= time - glance.captured < 0.8
    assert moments.eye("robot-1", glance.captured).shape == (240, 320, 3)


def test_the_picture_a_camera_takes_changes_as_the_robot_moves(drive):
    moments, started = Moments(drive), drive.recorder.drives[0].started
    first, later = moments.eye("robot-1", started), moments.eye("robot-1", started + 8)
    assert np.abs(first.astype(int) - later).mean() > 5
    with pytest.raises(ConfigError, match=r"'robot-9' .*: robot-1"):
        moments.eye("robot-9", 1.0)


# --- stills -------------------------------------------------------------------------------


def test_a_still_has_its_clock_and_a_key(drive):
    figure = still([drive], 10.0)
    assert [ax.get_title(loc="right") for ax in figure.axes] == ["10.0 s"]
    assert len(figure.legends) == 1


def test_a_still_of_two_runs_shows_the_moment_when_the_first_one_is_done(race):
    late, early = (replace(run, endings=[]) for run in race)
    assert time_of_still([late, early], None) == 20.0  # nobody is
    late.endings, early.endings = [Ending("confirmed", 19.5)], [Ending("confirmed", 11.25)]
    assert time_of_still([late, early], None) == 11.25
    assert time_of_still([late], None) == 20.0
    figure = still([late, early], time_of_still([late, early], None))
    reports = [
        line.get_text() for ax in figure.axes for line in scene_lines(ax) if line.get_visible()
    ]
    assert unnamed(reports[0], "still under way", "19.5 s") == []
    assert unnamed(reports[1], "11.2 s", "8.2 s ahead") == []
    assert [ax.get_title(loc="right") for ax in figure.axes] == ["11.2 s", "11.2 s"]


def test_everything_wanted_is_written_and_named(drive, tmp_path):
    wanted = Wanted(still=tmp_path / "eye.png", at=20.0, camera="robot-1")
    assert list(wanted.write([drive])) == [f"Still: {tmp_path / 'eye.png'}"]
    with Image.open(tmp_path / "eye.png") as eye:
        assert eye.size == (640, 480)
    list(Wanted(still=tmp_path / "still.pdf").write([drive]))
    assert (tmp_path / "still.pdf").read_bytes().startswith(b"%PDF")


def test_a_moment_after_the_end_is_refused(drive, tmp_path):
    wanted = Wanted(still=tmp_path / "a.png", at=99.0)
    with pytest.raises(ConfigError, match=r"--at 99 .*30 s"):
        list(wanted.write([drive]))


def test_a_scene_fixed_at_a_moment_keeps_only_what_is_there_then(drill):
    figure = new_figure((8, 6))
    scene = Scene(figure.add_subplot(), Moments(drill), *verdicts([drill]))
    figure.draw_without_rendering()
    scene.fix(1.0)
    children = figure.axes[0].get_children()
    assert not any(child.get_animated() for child in children)
    assert sum(not child.get_visible() for child in children) >= 3  # the hazards to come


def test_what_is_told_below_a_map_is_no_wider_than_the_map(race):
    run = replace(
        race[0], endings=[Ending("confirmed", 19.0)] * 12, incidents=race[0].incidents * 12
    )
    other = replace(race[1], endings=[Ending("open", math.inf)] * 12, incidents=run.incidents)
    run.recorder.tell(5.0, "operator-1", "tells at great length " * 5)
    try:
        for moment in (5.0, 20.0):
            figure = still([run, other], moment)
            lines = [t for ax in figure.axes[:2] for t in scene_lines(ax) if t.get_visible()]
            assert len(lines) == 2
            for box in boxes_of(lines, figure.axes[0]):
                assert box.x1 - box.x0 < figure.axes[0].bbox.width * 1.02
    finally:
        run.recorder.timeline.pop()
