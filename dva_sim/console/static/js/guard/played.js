/** Guards that people can play, and the setting that allows it. */
import { computed } from '../../vendor/preact.js';
import { scene } from '../store.js';

/** Guards that people can play. */
export const playedGuards = computed(() => scene.value?.things.filter((thing) => thing.person) ?? []);
export const hasPlayedGuards = computed(() => playedGuards.value.length > 0);

export const NO_PLAYED_GUARD =
  'No guard of this scenario can be played by a person. Start the console with --set guard.kind=person.';
