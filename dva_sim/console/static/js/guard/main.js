/** Entry point of the guard page. */
import { connect, keepDriveSocket } from '../net/sockets.js';
import { showGuard } from './guard_page.js';

showGuard(/** @type {HTMLElement} */ (document.getElementById('app')));
connect();
keepDriveSocket();
