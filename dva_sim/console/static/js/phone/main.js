/** Entry point of the phone pages. */
import { connect, keepDriveSocket } from '../net/sockets.js';
import { showPhone } from './app.js';
import { seat } from '../store.js';
import { vibrateFor } from '../shell/unseen.js';
import { isKnown, keepDriveInHand } from './drive.js';
import { keepSampling } from './samples.js';

showPhone(/** @type {HTMLElement} */ (document.getElementById('app')));
connect();
keepDriveSocket();
keepDriveInHand();
keepSampling();
vibrateFor(() => isKnown.peek(), () => seat.value?.order?.event);
