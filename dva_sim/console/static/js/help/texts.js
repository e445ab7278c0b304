/** Help texts: the purpose of each page, and the keys. */

/** @type {{title: string, lines: string[]}[]} */
export const TEXTS = [
  {
    title: 'Map',
    lines: [
      'Shows the site in metres, north up: robots, people, hazards, and who has been sent where.',
      'Click a robot, a person or an event to select it, on the map or in the lists beside it.',
      'Arrow keys pan, plus and minus zoom. “Follow” keeps the selected robot or person in view.',
    ],
  },
  {
    title: 'Main',
    lines: [
      'Lists the requests that the DVA has received, and its replies. Click one to see its header, its XML and the reply.',
      'Renewals, the registrations that every device repeats, are left out until you tick them.',
      'Start and stop the server on a port, as in the simulator of the dissertation.',
    ],
  },
  {
    title: 'Devices',
    lines: [
      'All devices that the DVA knows: type, address, what each does, how long ago it was heard, and who holds it.',
      'Add a fake device to try how a client lists it; it hears nothing. “Revoke” takes a robot from its holder.',
    ],
  },
  {
    title: 'Robots',
    lines: [
      'A card for each robot: picture, place, task and holder. “Lost” means that the DVA hears nothing of it.',
      'Click a name for the windows of the robot itself: its motors, sensors, messages, manual control and faults.',
    ],
  },
  {
    title: 'Drive',
    lines: [
      'Take control, then Start, then hold an arrow key (or W, A, D), the stick, a slider, or a shoulder button of a gamepad. Letting go stops. There is no reverse.',
      'Any interruption (another window, a lost connection) stops the robot. Hold again to go on.',
      'A robot stops by itself when no command arrives before its watchdog runs out.',
      'The picture shows its age. If it is hatched, it is too old to drive by.',
      'With a second robot beside the first, both get the same input, each through its own messaging pattern.',
    ],
  },
  {
    title: 'Events',
    lines: [
      'Left: what is open, the worst first; a red edge means that nobody has acknowledged it as grave as it is; severity never falls. Middle: its place, and what the robot that is sent or could go sees. Right: what you can do.',
      'The blue button sends whom it names: by an order of the DVA, on a mission without a driver, or driven by you.',
      'A robot that you send by itself is yours: say what is there with “Confirm” or “Refute”. “Shift” shows who is there and what happened, and hands over to a colleague.',
      'Alarms sound once you click the loudspeaker in the bar. The title of the page counts what nobody has acknowledged.',
    ],
  },
  {
    title: 'Network',
    lines: [
      'The link between the console and the robots is simulated, as in a study: delay, jitter, loss and bandwidth affect every message and picture. A striped edge marks a simulated link.',
      'The delay is one-way. A round trip takes twice as long, plus the robot’s processing time.',
      'REQ/REP sends the next command only after the last one was answered. Latest-wins keeps sending, and the robot drops commands for which it has a newer one.',
    ],
  },
  {
    title: 'Audit',
    lines: [
      'Who did what, when and why: acts of people, and decisions of the DVA with whom it would have sent itself.',
      'Each row is chained to the one before by its hash: a change afterwards is found out.',
    ],
  },
];

/** @type {[string, string][]} */
export const KEYS = [
  ['Shift + Esc', 'Emergency stop of all robots'],
  ['↑ or W', 'forward, while held'],
  ['← → or A D', 'turn, while held'],
  ['Shift', 'slowly, while held'],
  ['Arrows, + −', 'pan and zoom the map, when it has focus'],
  ['E', 'open the worst alarm that nobody has acknowledged'],
  ['J K', 'next and previous event of the list, on the page Events'],
  ['1 … 9', 'choose whom to send'],
  ['A', 'acknowledge the event in hand'],
  ['Shift + S', 'send whom the panel names'],
  ['Shift + T', 'take over the robot that is sent'],
  ['R', 'write a reason or note'],
  ['?', 'this page'],
];
