/** Map on a phone, loaded with its styles when it is first shown: the pages stay light without it. */
import { html, useEffect, useState } from '../../vendor/preact.js';

const STYLES = ['/static/css/map.css', '/static/vendor/leaflet.css'];
let loading = /** @type {Promise<any> | null} */ (null);

async function load() {
  for (const href of STYLES) document.head.append(Object.assign(document.createElement('link'), { rel: 'stylesheet', href }));
  return (await import('../map/map_box.js')).MapBox;
}

/** @param {Record<string, unknown>} props of the map */
export function LazyMap(props) {
  const [Box, show] = useState(/** @type {any} */ (null));
  useEffect(() => {
    let over = false;
    loading ??= load();
    loading.then((box) => over || show(() => box));
    return () => {
      over = true;
    };
  }, []);
  return Box ? html`<${Box} ...${props} />` : html`<p class="soft">Loading the map …</p>`;
}
