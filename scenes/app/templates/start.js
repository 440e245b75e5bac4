// What the scripts of the page share; `words.js` fills it.
const cfs = {};
