"""The map and its twin, the lists: one selection, everything that moves, crowds."""

from helpers.console.changed_lines import HOSTILE, renamed, sockets_of
from helpers.processes.patience import becomes
from playwright.sync_api import Page, expect

MANY = [f"--set={key}={value}" for key, value in (("robot.count", 200), ("bystander.count", 100))]
INK = """([x, y, w, h]) => { const c = document.querySelectorAll('.map-canvas')[2];
  const d = c.getContext('2d').getImageData(x, y, w, h).data; let sum = 0;
  for (let i = 3; i < d.length; i += 4) sum += d[i] > 0; return sum; }"""


def test_robots_people_and_hazards_are_drawn_and_move(console, shared):
    page = shared(console().drive)
    canvas = page.locator(".map-canvas").nth(2)

    def picture() -> str:
        return str(canvas.evaluate("c => c.toDataURL()"))

    assert becomes(lambda: page.evaluate(INK.replace("[2]", "[0]"), [0, 0, 800, 700]) > 100_000)
    assert becomes(lambda: page.evaluate(INK, [0, 0, 800, 700]) > 500)
    first = picture()
    assert becomes(lambda: picture() != first)


def test_what_moves_is_drawn_every_second_frame(console, visit):
    page = visit.open(console().drive)
    page.clock.install()
    page.clock.pause_at("2030-01-01")
    page.evaluate(
        """async () => { const {Live} = await import('/static/js/map/live.js');
        const {draw} = Live.prototype; window.drawn = 0;
        Live.prototype.isMoving = () => true;
        Live.prototype.draw = function (...about) {
          window.drawn += 1; draw.apply(this, about); };
        const ask = window.requestAnimationFrame; window.asked = 0;
        window.requestAnimationFrame = (next) => { window.asked += 1; return ask(next); }; }"""
    )

    def asks_this_clock() -> bool:
        page.clock.run_for(16)  # the frame before may still wait for the browser's own clock
        return page.evaluate("window.asked") > 0

    assert becomes(asks_this_clock)
    page.evaluate("window.drawn = 0")
    page.clock.run_for(800)  # 50 frames

    assert 16 <= page.evaluate("window.drawn") <= 40  # some more for what is told meanwhile


def test_all_words_on_the_map_have_the_scale_of_a_zoomed_screen(console, visits):
    visit = visits(960, 600, device_scale_factor=1.5)
    visit.context.add_init_script(
        """window.words = {}; const write = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, ...at) {
          (window.words[text] ??= new Set()).add(this.getTransform().a);
          return write.call(this, text, ...at); };"""
    )
    page = visit.open(console().drive)

    def scales() -> dict[str, list[float]]:
        lines = "Object.entries(window.words).map(([text, scales]) => [text, [...scales]])"
        return dict(page.evaluate(lines))

    assert becomes(lambda: {"robot-1", "Lobby"} <= scales().keys())
    assert {text: found for text, found in scales().items() if found != [1.5]} == {}


def test_list_and_map_share_one_selection(console, shared):
    page = shared(console().drive)
    row = page.get_by_role("region", name="Robots").get_by_role("button", name="robot-2")
    row.click()

    expect(row).to_have_attribute("aria-pressed", "true")
    card = page.get_by_role("complementary", name="What is chosen")
    expect(card.get_by_role("heading", name="robot-2")).to_be_visible()
    card.get_by_role("button", name="Close").click()
    expect(row).to_have_attribute("aria-pressed", "false")


def test_a_robot_in_the_middle_is_hit_by_a_click(console, shared):
    page = shared(console().drive)
    button = page.get_by_role("region", name="Robots").get_by_role("button", name="robot-1")
    button.click()
    page.get_by_role("button", name="Follow robot-1").click()  # now it is in the middle
    page.wait_for_timeout(500)
    box = page.locator(".map-ground").bounding_box()
    assert box
    button.click()
    expect(button).to_have_attribute("aria-pressed", "false")
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)

    expect(page.get_by_role("complementary", name="What is chosen")).to_be_visible()


def test_keys_pan_and_zoom_the_map_and_fit_brings_all_back(console, shared):
    page = shared(console().drive)
    bar = page.locator(".scale-bar")
    fitted = bar.inner_text()
    page.get_by_role("application").focus()
    for _ in range(4):
        page.keyboard.press("+")
    assert becomes(lambda: bar.inner_text() != fitted)

    page.get_by_role("button", name="Fit the whole site").click()
    assert becomes(lambda: bar.inner_text() == fitted)


def test_events_tell_state_age_and_who_is_sent(console, shared):
    page = shared(console().drive)
    event = page.get_by_role("region", name="Events").get_by_role("button").first

    expect(event).to_contain_text("Fire")
    expect(event).to_contain_text("low")
    expect(event).to_contain_text("guard-6")
    event.click()
    expect(page.get_by_role("complementary")).to_contain_text("min ago")


def test_the_age_of_an_event_goes_on_while_nothing_is_told_of_it(console, shared):
    page = shared(console().drive)
    event = page.get_by_role("region", name="Events").get_by_role("button").first
    ages: dict[str, set[int]] = {}  # by state: a new one would be told

    def goes_on() -> bool:
        state, age = event.locator(".state").inner_text().split()[:2]
        minutes, seconds = map(int, age.split(":"))
        seen = ages.setdefault(state, set())
        seen.add(60 * minutes + seconds)
        return any({n, n + 1, n + 2} <= seen for n in seen)

    assert becomes(goes_on)


def test_the_legend_tells_what_the_fullest_tint_means(console, shared):
    page = shared(console().drive)
    page.get_by_text("Legend").click()

    expect(page.locator(".legend")).to_contain_text("robot: teleoperation")
    expect(page.locator(".legend")).not_to_contain_text("undefined")


def test_the_legend_is_closed_again_on_a_small_screen(console, shared):
    for name in ("map", "drive"):
        page = shared(console().drive, name, width=360, height=640)
        summary = page.get_by_text("Legend")

        summary.click()
        expect(page.get_by_text("robot: teleoperation")).to_be_visible()
        page.get_by_role("button", name="Zoom in").click()  # the legend covers no button
        summary.click()
        expect(page.get_by_text("robot: teleoperation")).to_be_hidden()


def crowd(page: Page) -> int:
    """Frames in a second of watching."""
    return int(
        page.evaluate(
            """() => new Promise(done => { let n = 0; const end = performance.now() + 1000;
            const tick = now => { n += 1; now < end ? requestAnimationFrame(tick) : done(n); };
            requestAnimationFrame(tick); })"""
        )
    )


def test_200_robots_and_100_people_are_shown_and_listed(console, visit):
    page = visit.open(console(*MANY).drive)

    expect(page.get_by_role("region", name="Robots").get_by_role("button")).to_have_count(200)
    assert becomes(lambda: page.evaluate(INK.replace("[2]", "[0]"), [0, 0, 800, 700]) > 100_000)
    assert crowd(page) > 3  # what a machine that does much else still draws


def test_a_hostile_label_is_shown_as_text(console, visit):
    sockets_of(visit.context, "state", renamed("robot-2"))
    page = visit.open(console().drive)
    for name in ("Map", "Drive", "Network", "Robots", "Devices"):
        page.get_by_role("link", name=name).click()
        expect(page.get_by_text(HOSTILE).first).to_be_attached()
        assert page.locator("img[src=x]").count() == 0
    page.close()
    visit.errors.clear()  # the console has no pictures of a robot of that name
