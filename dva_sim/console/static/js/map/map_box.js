/** The map as a component: the plan, the moving parts, and the buttons. */
import { html, useEffect, useRef, useState } from '../../vendor/preact.js';
import { effect } from '../../vendor/preact.js';
import { events, guard, hazards, rows, scene, selection, thingAt, tracks } from '../store.js';
import { isStale, pageAge } from '../net/world_time.js';
import { colours } from '../shell/theme.js';
import { Icon } from '../ui/icon.js';
import { useEvery } from '../ui/every.js';
import { Fields } from './fields.js';
import { Legend } from './legend.js';
import { Live } from './live.js';
import { Plan } from './plan.js';
import { MapView } from './view.js';

const TAP_PX = 5;

/**
 * @param {{cones: () => number[], follows?: () => number | null, keyboard?: boolean,
 *   legend?: boolean, goals?: () => import('../types.js').Goal[], ways?: () => number[][][],
 *   under?: import('./live.js').Draw, onPlace?: (x: number, y: number) => void}} props `under` draws
 *   below all that moves, `onPlace` gets the tapped position [m]
 */
export function MapBox(props) {
  const { cones, follows, keyboard = true, legend = true, goals = () => [], ways = () => [], under = () => {} } = props;
  const onPlace = useRef(props.onPlace);
  onPlace.current = props.onPlace;
  const box = useRef(/** @type {HTMLElement | null} */ (null));
  const view = useRef(/** @type {MapView | null} */ (null));
  const [following, follow] = useState(false);
  const plan = scene.value;
  useEffect(() => {
    if (!plan || !box.current) return undefined;
    const options = { cones, keyboard, goals, ways, under, onPlace };
    return show(box.current, plan, options, view, () => follow(false));
  }, [plan]);
  useEffect(() => {
    if (view.current) view.current.follow = following ? placeOf(follows) : null;
  }, [following, plan]);
  const name = `Plan of ${plan?.site.name ?? 'the site'}: arrow keys pan, plus and minus zoom`;
  return html`<div class="map-box">
    <div class="map-ground" ref=${box} role="application" aria-label=${name}></div>
    <${Stale} />
    <${Buttons} view=${view} following=${following} follow=${follow} />
    ${legend && html`<${Legend} />`}
    <${ScaleBar} view=${view} />
  </div>`;
}

/**
 * @param {HTMLElement} element
 * @param {import('../lines.js').Scene} plan
 * @param {{cones: () => number[], keyboard: boolean,
 *   goals: () => import('../types.js').Goal[], ways: () => number[][][],
 *   under: import('./live.js').Draw, onPlace: {current: ((x: number, y: number) => void) | undefined}}} options
 * @param {{current: MapView | null}} view
 * @param {() => void} letGo
 */
function show(element, plan, options, view, letGo) {
  const ground = new Plan(plan.site);
  const fields = new Fields();
  const live = new Live(ground, options);
  const paper = {
    draw: (/** @type {any} */ ctx, /** @type {any} */ affine) =>
      ground.draw(ctx, affine, colours.peek()),
    isMoving: () => false,
  };
  const map = new MapView(element, plan.site.extent_m, [paper, fields, live], options);
  view.current = map;
  map.map.on('dragstart', letGo);
  const stops = [
    effect(() => void [colours.value, map.refresh(0)]),
    effect(() => {
      fields.update(hazards.value.fields, colours.value);
      map.refresh(1);
    }),
    effect(() => {
      void [colours.value, hazards.value, events.value, rows.value, selection.value, guard.value];
      map.refresh(2);
    }),
  ];
  const stopPointing = pointing(element, map, live, options.onPlace);
  return () => {
    for (const stop of stops) stop();
    stopPointing();
    map.remove();
    view.current = null;
  };
}

/**
 * Select what is clicked or tapped; ignore drags.
 * @param {HTMLElement} element
 * @param {MapView} map
 * @param {Live} live
 * @param {{current: ((x: number, y: number) => void) | undefined}} onPlace
 */
function pointing(element, map, live, onPlace) {
  let [x, y] = [0, 0];
  const down = (/** @type {PointerEvent} */ event) => ([x, y] = [event.clientX, event.clientY]);
  const click = (/** @type {MouseEvent} */ event) => {
    if (Math.hypot(event.clientX - x, event.clientY - y) > TAP_PX) return;
    const [left, top] = map.place(event);
    if (onPlace.current) onPlace.current(...map.affine.metres(left, top));
    else selection.value = live.hit(left, top, map.affine);
  };
  const move = (/** @type {PointerEvent} */ event) => {
    if (event.buttons) return;
    const [left, top] = map.place(event);
    element.classList.toggle('over-something', live.hit(left, top, map.affine) !== null);
  };
  element.addEventListener('pointerdown', down);
  element.addEventListener('click', click);
  element.addEventListener('pointermove', move);
  return () => {
    element.removeEventListener('pointerdown', down);
    element.removeEventListener('click', click);
    element.removeEventListener('pointermove', move);
  };
}

/**
 * Return a function that gives the position to follow: the selection, else the thing the page names.
 * @param {(() => number | null) | undefined} follows
 */
function placeOf(follows) {
  return () => {
    const chosen = selection.peek();
    const i = chosen?.kind === 'thing' ? chosen.key : (follows?.() ?? null);
    const place = i === null ? null : tracks.place(i, performance.now());
    return place && /** @type {[number, number]} */ ([place.x, place.y]);
  };
}

/** @param {{view: {current: MapView | null}, following: boolean, follow: (on: boolean) => void}} props */
function Buttons({ view, following, follow }) {
  const chosen = selection.value;
  const whom = chosen?.kind === 'thing' ? thingAt(chosen.key)?.label : '';
  const fit = () => {
    follow(false);
    view.current?.fit();
  };
  return html`<div class="map-buttons" role="group" aria-label="View">
    <button type="button" title="Fit the whole site" aria-label="Fit the whole site"
      onClick=${fit}><${Icon} name="maximize" /></button>
    <button type="button" aria-pressed=${following} aria-label=${`Follow ${whom || 'the robot'}`}
      title=${`Follow ${whom || 'the robot'}`} onClick=${() => follow(!following)}>
      <${Icon} name="locate-fixed" /></button>
    <button type="button" title="Zoom in" aria-label="Zoom in"
      onClick=${() => view.current?.zoom(0.5)}><${Icon} name="plus" /></button>
    <button type="button" title="Zoom out" aria-label="Zoom out"
      onClick=${() => view.current?.zoom(-0.5)}><${Icon} name="minus" /></button>
  </div>`;
}

/** Note over a map whose data is outdated. */
function Stale() {
  if (!isStale.value) return null;
  return html`<div class="stale"><span>as of ${Math.round(pageAge())} s ago</span></div>`;
}

const LENGTHS = [1, 2, 5, 10, 20, 50, 100, 200, 500];
const BAR_PX = 110;

/** @param {{view: {current: MapView | null}}} props */
function ScaleBar({ view }) {
  useEvery(300);
  const scale = view.current?.affine.scale ?? 0;
  const length = LENGTHS.filter((metres) => metres * scale <= BAR_PX).at(-1) ?? LENGTHS[0];
  if (!scale) return null;
  return html`<div class="scale-bar" aria-hidden="true">
    <span class="bar" style=${{ width: `${length * scale}px` }}></span><span>${length} m</span>
    <span class="north">N ↑</span></div>`;
}
