/** Leaflet is used by its global name, behind `js/map/view.js` alone. */
export {};
