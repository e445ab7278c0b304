/** Latency panel: ages of commands, replies and pictures of each driven robot. */
import { html, useEffect, useMemo } from '../../vendor/preact.js';
import { driveOf, floorMs, isAttached, isModelled, rowOf } from '../store.js';
import { isStale, worldNow } from '../net/world_time.js';
import { Chart } from '../charts/chart.js';
import { History } from '../charts/history.js';
import { useEvery } from '../ui/every.js';
import { msText } from '../ui/words.js';
import { pictureAge } from './drawn.js';

const SAMPLE_MS = 200;
const DASHES = [undefined, [6, 3]];

/** @typedef {import('../lines.js').Thing} Thing */

/** Patterns under which a robot does not reply to commands. */
const UNANSWERED = ['pub-sub', 'latest-wins'];

/**
 * @typedef {{title: string, hint: string, isFromReplies?: boolean, none: (i: number) => string,
 *   read: (i: number) => number | null}} Kind
 */

const KINDS = /** @type {Kind[]} */ ([
  {
    title: 'Command age',
    none: () => 'no command yet',
    hint: 'how old the command in force was when the robot applied it',
    read: (i) => driveOf(i)?.command_age_ms ?? null,
  },
  {
    title: 'Round trip',
    isFromReplies: true, // which a robot elsewhere sends as well
    none: (i) => (UNANSWERED.includes(rowOf(i)?.pattern ?? '') ? 'this pattern has no answers' : 'no answer yet'),
    hint: 'from a command sent to its answer',
    read: (i) => driveOf(i)?.round_trip_ms ?? null,
  },
  {
    title: 'Picture age',
    none: () => 'no picture',
    hint: 'since the picture in sight was taken',
    read: (i) => {
      const age = pictureAge(i);
      return Number.isFinite(age) ? age : null;
    },
  },
]);

/** @param {{robots: Thing[]}} props */
export function Latency({ robots }) {
  const key = robots.map((robot) => robot.i).join();
  const kinds = isAttached.value ? KINDS.filter((kind) => kind.isFromReplies) : KINDS;
  const histories = useMemo(() => kinds.map(() => new History(robots.length)), [key, kinds.length]);
  useEffect(() => {
    const timer = window.setInterval(() => sample(kinds, histories, robots), SAMPLE_MS);
    return () => window.clearInterval(timer);
  }, [histories]);
  const lines = robots.map((robot, n) => ({
    label: robot.label,
    colour: `pattern-${rowOf(robot.i)?.pattern}`,
    dash: DASHES[n],
  }));
  const drives = robots.some((robot) => driveOf(robot.i));
  return html`<section class="panel" aria-label="Latency"><details class="latency" open=${drives}>
    <summary><h2>Latency ${!isAttached.value && html`<${Floor} />`}</h2></summary>
    <div class="charts reported">${kinds.map(
      (kind, n) => html`<div title=${kind.hint}>
        <${Chart} title=${kind.title} unit="ms" lines=${lines} least=${100}
          read=${() => histories[n].read()} />
        <${Figures} history=${histories[n]} robots=${robots} none=${kind.none} />
      </div>`,
    )}</div>
  </details></section>`;
}

/** @param {Kind[]} kinds @param {History[]} histories @param {Thing[]} robots */
function sample(kinds, histories, robots) {
  if (document.hidden || isStale.peek()) return;
  const time = worldNow() / 1000;
  kinds.forEach((kind, n) => histories[n].add(time, robots.map((robot) => kind.read(robot.i))));
}

/** Lower bound on the latency of a command, whatever the pattern. */
function Floor() {
  const how = isModelled.value ? 'takes' : 'is processed for';
  return html`<span class="count reported">a command ${how} at least ${msText(floorMs.value)}</span>`;
}

/**
 * @param {History} history
 * @param {number} n
 * @param {string} none text shown when there is no value
 */
function value(history, n, none) {
  const last = history.last(n);
  if (last === null) return html`<span class="soft">${none}</span>`;
  return html`<b>${msText(last)}</b> <span class="soft p95">p95 ${msText(history.p95(n))}</span>`;
}

/** @param {{history: History, robots: Thing[], none: (i: number) => string}} props */
function Figures({ history, robots, none }) {
  useEvery(500);
  return html`<p class="figures">${robots.map(
    (robot, n) => html`<span><i class=${`line line-${n} pattern-${rowOf(robot.i)?.pattern}`}></i>
      ${robot.label} ${value(history, n, none(robot.i))}</span>`,
  )}</p>`;
}
