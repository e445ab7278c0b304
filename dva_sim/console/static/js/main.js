/** Entry point of the console page. */
import { connect, keepDriveSocket } from './net/sockets.js';
import { keepSampling } from './network/samples.js';
import { showApp } from './shell/app.js';
import { listenForKeys } from './shell/keys.js';

showApp(/** @type {HTMLElement} */ (document.getElementById('app')));
listenForKeys();
connect();
keepDriveSocket();
keepSampling();
