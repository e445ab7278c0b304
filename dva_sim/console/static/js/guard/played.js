/** Guards that people can play. */
import { computed } from '../../vendor/preact.js';
import { scene } from '../store.js';

/** Guards that people can play. */
export const playedGuards = computed(() => scene.value?.things.filter((thing) => thing.person) ?? []);
export const hasPlayedGuards = computed(() => playedGuards.value.length > 0);

export const NO_PLAYED_GUARD = 'Nobody can play a guard in this run.';
