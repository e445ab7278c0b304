/** Entry point of the console page. */
import { connect, keepDriveSocket } from './net/sockets.js';
import { keepSampling } from './network/samples.js';
import { showApp } from './shell/app.js';
import { openWorst } from './shell/calling.js';
import { listenForKeys } from './shell/keys.js';

showApp(/** @type {HTMLElement} */ (document.getElementById('app')));
listenForKeys({ e: openWorst });
connect();
keepDriveSocket();
keepSampling();
