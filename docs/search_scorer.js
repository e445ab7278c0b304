/* What a search of the pages puts first: a guide before a reference, and the page of measures for a column. */
const ROOMS = {'how-to/': 6, 'tutorials/': 6, 'explanation/': 3, 'results/': -4};
const COLUMN = /^[a-z0-9]+(_[a-z0-9]+)+$/; // the name of a column of a table, as in drive_time_s
const asked = new URLSearchParams(window.location.search).get('q') ?? '';

var Scorer = {
  score: ([page, , , , score]) => {
    if (COLUMN.test(asked.trim()) && page === 'reference/measures') return score + 50;
    const room = Object.keys(ROOMS).find((folder) => page.startsWith(folder));
    return score + (room ? ROOMS[room] : 0);
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: {0: 15, 1: 5, 2: -5},
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
