/** Screens with a map, loaded with their styles when they are first shown: the pages stay light. */
import { html, useEffect, useState } from '../../vendor/preact.js';

const STYLES = ['/static/css/map.css', '/static/vendor/leaflet.css'];
let styled = false;

function addStyles() {
  if (styled) return;
  styled = true;
  for (const href of STYLES) document.head.append(Object.assign(document.createElement('link'), { rel: 'stylesheet', href }));
}

/**
 * Screen that is loaded when it is first shown.
 * @param {() => Promise<any>} load
 */
export function lazy(load) {
  return function Lazy() {
    const [Screen, show] = useState(/** @type {any} */ (null));
    useEffect(() => {
      let over = false;
      addStyles();
      load().then((loaded) => over || show(() => loaded));
      return () => {
        over = true;
      };
    }, []);
    return Screen ? html`<${Screen} />` : html`<p class="soft">Loading …</p>`;
  };
}
