/** Shapes that identify things without colour: size 1, centred on zero, y down. */

/** @param {number} corners @param {number} [turn] */
function polygon(corners, turn = 0) {
  const path = new Path2D();
  for (let n = 0; n < corners; n += 1) {
    const angle = turn + (2 * Math.PI * n) / corners;
    path.lineTo(0.5 * Math.sin(angle), -0.5 * Math.cos(angle));
  }
  path.closePath();
  return path;
}

/** @param {string} data */
const path = (data) => new Path2D(data);

const circle = new Path2D();
circle.arc(0, 0, 0.44, 0, 2 * Math.PI);

/** @type {Record<string, Path2D>} */
export const SEVERITIES = {
  critical: polygon(8, Math.PI / 8),
  high: path('M0 -.52L.54 .42H-.54Z'),
  medium: path('M-.46 -.46H.46V.46H-.46Z'),
  low: circle,
};

/** Glyph of each mode, drawn into the robot's box, bow to the right. */
export const MODES = /** @type {Record<string, Path2D>} */ ({
  Mission: path('M-.24 -.24L.06 0L-.24 .24'),
  Teleoperation: path('M.14 0A.2 .2 0 1 1 -.26 0A.2 .2 0 1 1 .14 0'),
  Manual: path('M-.3 0H.2'),
  Emergency: path('M-.26 -.2L.14 .2M.14 -.2L-.26 .2'),
  Lost: path('M-.24 -.12A.2 .16 0 1 1 -.02 .06L-.02 .1M-.02 .26V.28'),
});

export const ROBOT = path('M.8 0L.32 .48L-.5 .48L-.5 -.48L.32 -.48Z');

/** Person: a disc with a beak. */
export const PERSON = (() => {
  const body = new Path2D();
  body.moveTo(0.82, 0);
  body.arc(0, 0, 0.5, 0.84, 2 * Math.PI - 0.84);
  body.closePath();
  return body;
})();

/** Shapes of hazard sources, by their marks in films. */
export const SOURCE_SHAPES = /** @type {Record<string, string>} */ ({
  '*': 'M0 -.6L.15 -.2L.57 -.19L.24 .08L.35 .49L0 .25L-.35 .49L-.24 .08L-.57 -.19L-.15 -.2Z',
  v: 'M0 .5L.5 -.4H-.5Z',
  D: 'M0 -.5L.5 0L0 .5L-.5 0Z',
  X: 'M-.4 -.4L.4 .4M.4 -.4L-.4 .4',
});
export const SOURCES = Object.fromEntries(
  Object.entries(SOURCE_SHAPES).map(([mark, shape]) => [mark, path(shape)]),
);

/** Glyph of each event state, in a box of 24 by 24. */
export const STATES = /** @type {Record<string, string>} */ ({
  pending: 'M12 4a8 8 0 1 0 .01 0',
  assigned: 'M4 12H19M13 6l6 6-6 6',
  'on scene': 'M12 8a4 4 0 1 0 .01 0',
  confirmed: 'M5 13l5 5L19 7',
  contained: 'M12 3l7 3v6c0 5-4 8-7 9-3-1-7-4-7-9V6z',
  refuted: 'M4 12H20M7 6h10M7 18h10',
  escalated: 'M6 12l6-6 6 6M6 19l6-6 6 6',
  expired: 'M7 4h10l-5 8 5 8H7l5-8z',
});

/** @param {string} state */
export const stateColour = (state) => `state-${state.replace(/\s+/g, '-')}`;
