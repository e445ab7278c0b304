/** What a robot's camera showed: to who drove it, as late as it came; else as it was taken. */
import { html, useEffect, useState } from '../../vendor/preact.js';
import { replay, robots } from '../store.js';
import { CameraPicture } from '../drive/camera.js';
import { watch } from '../net/sockets.js';
import { Choice } from '../ui/fields.js';

/** The page. */
export function CameraPage() {
  const all = robots.value;
  const [label, choose] = useState(all[0]?.label ?? '');
  const robot = all.find((one) => one.label === label) ?? all[0];
  useEffect(() => {
    watch(robot ? [robot.i] : []);
    return () => watch([]);
  }, [robot?.i, replay.value?.name]);
  if (!robot) return html`<main class="page camera-page" id="main"><p>No robot took part.</p></main>`;
  const options = all.map((one) => /** @type {[string, string]} */ ([one.label, one.label]));
  return html`<main class="page camera-page" id="main" tabindex="-1">
    <h1>Camera</h1>
    <${Choice} name="Robot" value=${robot.label} options=${options} onInput=${choose} />
    <section aria-label="Camera"><${CameraPicture} key=${robot.i} robot=${robot} /></section>
    <p class="soft">While somebody drove the robot, this is the picture on that person's screen, with
      its age. Otherwise it is what the camera would have shown. It is drawn again from where everybody was.</p>
  </main>`;
}
