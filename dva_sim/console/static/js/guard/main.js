/** Entry point of the guard page. */
import { connect, keepDriveSocket } from '../net/sockets.js';
import { guard } from '../store.js';
import { vibrateFor } from '../shell/unseen.js';
import { showGuard } from './guard_page.js';

showGuard(/** @type {HTMLElement} */ (document.getElementById('app')));
connect();
keepDriveSocket();
vibrateFor(() => guard.peek() !== null, () => guard.value?.order?.event);
