/** A small chart over the last half minute; its last number stands beside it as text. */
import uPlot from '../../vendor/uplot.js';
import { html, useEffect, useRef } from '../../vendor/preact.js';
import { colours } from '../shell/theme.js';

/** @typedef {{label: string, colour: string, dash?: number[]}} Line */

/**
 * @param {{title: string, unit: string, lines: Line[], read: () => number[][], span?: number,
 *   least?: number, sync?: string}} props
 *   `read` gives times [s] and one list of values for each line; `least` is the smallest top
 */
export function Chart({ title, unit, lines, read, span = 30, least = 100, sync }) {
  const box = useRef(/** @type {HTMLElement | null} */ (null));
  const palette = colours.value;
  const look = lines.map((line) => line.label + line.colour).join() + palette.page;
  useEffect(() => {
    const element = box.current;
    if (!element) return undefined;
    const plot = new uPlot(
      { ...sizeOf(element), ...options({ lines, palette, span, least, sync }) },
      /** @type {any} */ (read()),
      element,
    );
    const sizes = new ResizeObserver(() => plot.setSize(sizeOf(element)));
    sizes.observe(element);
    const timer = window.setInterval(() => {
      if (!document.hidden) plot.setData(/** @type {any} */ (read()));
    }, 250);
    return () => {
      window.clearInterval(timer);
      sizes.disconnect();
      plot.destroy();
    };
  }, [look]);
  return html`<div class="chart"><h3>${title} <span class="unit">${unit}</span></h3>
    <div class="plot" ref=${box} aria-hidden="true"></div></div>`;
}

/** @param {HTMLElement} element */
const sizeOf = (element) => ({ width: element.clientWidth, height: element.clientHeight });

/** @param {any} o */
function options({ lines, palette, span, least, sync }) {
  const axis = {
    stroke: palette.soft,
    grid: { stroke: palette.line, width: 1 },
    ticks: { show: false },
    font: '11px system-ui, sans-serif',
  };
  return {
    legend: { show: false },
    cursor: sync ? { sync: { key: sync }, y: false, points: { show: false } } : { show: false },
    padding: [6, 14, 0, 0],
    scales: {
      x: {
        time: false,
        range: (/** @type {any} */ _, /** @type {number} */ __, /** @type {number} */ to) => [to - span, to],
      },
      y: {
        range: (/** @type {any} */ _, /** @type {number} */ __, /** @type {number} */ to) => [0, Math.max(least, 1.1 * (to || 0))],
      },
    },
    axes: [
      { ...axis, size: 20, splits: (/** @type {any} */ u) => [1, 0.5, 0].map((n) => u.scales.x.max - n * span), values: (/** @type {any} */ u, /** @type {number[]} */ at) => at.map((t) => ago(t - u.scales.x.max)) },
      { ...axis, size: 44 },
    ],
    series: [
      {},
      ...lines.map((/** @type {Line} */ line) => ({
        label: line.label,
        stroke: palette[line.colour] ?? palette.ink,
        width: 1.75,
        dash: line.dash,
        points: { show: false },
        spanGaps: false,
      })),
    ],
  };
}

/** @param {number} seconds */
const ago = (seconds) => (Math.abs(seconds) < 0.5 ? 'now' : `${Math.round(seconds)} s`);
