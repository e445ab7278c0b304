/** Screens that are loaded with their styles when they are first shown: the pages stay light. */
import { html, useEffect, useState } from '../../vendor/preact.js';

/** @param {string} href */
function addStyle(href) {
  if (document.querySelector(`link[href="${href}"]`)) return;
  document.head.append(Object.assign(document.createElement('link'), { rel: 'stylesheet', href }));
}

/**
 * Screen that is loaded when it is first shown.
 * @param {() => Promise<any>} load
 * @param {string[]} [styles]
 */
export function lazy(load, styles = []) {
  return function Lazy() {
    const [Screen, show] = useState(/** @type {any} */ (null));
    useEffect(() => {
      let over = false;
      styles.forEach(addStyle);
      load().then((loaded) => over || show(() => loaded));
      return () => {
        over = true;
      };
    }, []);
    return Screen ? html`<${Screen} />` : html`<p class="soft">Loading …</p>`;
  };
}
