/** Values that change with time alone. */
import { useEffect, useState } from '../../vendor/preact.js';

/**
 * Render again periodically while the page is visible.
 * @param {number} ms
 */
export function useEvery(ms) {
  const [, tick] = useState(0);
  useEffect(() => {
    const timer = window.setInterval(() => {
      if (!document.hidden) tick((n) => n + 1);
    }, ms);
    return () => window.clearInterval(timer);
  }, [ms]);
}
