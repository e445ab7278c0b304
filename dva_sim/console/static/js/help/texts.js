/** What the pages are for, in words. */

/** @type {{title: string, lines: string[]}[]} */
export const TEXTS = [
  {
    title: 'Map',
    lines: [
      'Shows the plan in metres, north up, with everything that moves, what burns or leaks, and who is sent where.',
      'A click chooses a robot, a person or an event; so does its line in the lists beside the map.',
      'Arrow keys pan, plus and minus zoom. “Follow” goes along with whoever is chosen.',
    ],
  },
  {
    title: 'Drive',
    lines: [
      'Take control, then Start, then hold an arrow key (or W, A, D), the stick, a slider, or a shoulder button of a gamepad. Letting go stops. There is no reverse.',
      'Whatever interrupts you (another window, a lost connection) stops the robot; it moves again only when you take hold anew.',
      'A robot that hears nothing for the time of its watchdog stops by itself.',
      'The picture tells how old it is. Hatched means: too old to drive by.',
      'With a second robot beside the first, both get the same input, each under its own pattern.',
    ],
  },
  {
    title: 'Network',
    lines: [
      'The link between the console and the robots is modelled, as in a study: its delay, jitter, loss and bandwidth act on every message and on the pictures. The striped edge says so.',
      'Delay is one way; a round trip takes twice as long and the robot’s processing time on top.',
      'REQ/REP sends the next command only after the last was answered. Latest-wins sends on and drops what a newer command has overtaken.',
    ],
  },
];

/** @type {[string, string][]} */
export const KEYS = [
  ['Shift + Esc', 'Emergency stop of all robots'],
  ['↑ or W', 'forward, while held'],
  ['← → or A D', 'turn, while held'],
  ['Shift', 'slowly, while held'],
  ['Arrows, + −', 'pan and zoom the map, when it has the focus'],
  ['?', 'this page'],
];
