// Small things that all figures use: elements, numbers as text, colours of roles.

/** An HTML element; text always goes in as text, never as markup. */
function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  for (const child of children) node.append(child);
  return node;
}

/** An SVG element. */
function svg(tag, attributes = {}, text = null) {
  const node = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== null) node.textContent = text;
  return node;
}

/** A number with about four significant digits and no needless zeros; thin spaces between thousands. */
function show(x) {
  if (x === null || x === undefined || !isFinite(x)) return '–';
  const size = Math.abs(x);
  const digits = size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : size >= 0.1 || size === 0 ? 3 : 5;
  const text = x.toFixed(digits);
  return (digits === 0 ? text.replace(/\B(?=(\d{3})+$)/g, '\u2009') : text).replace('-', '\u2212');
}

/** The label of a tick: as many decimals as the step needs. */
function tickLabel(x, step) {
  const digits = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  return Number(x.toFixed(digits)).toLocaleString('en', {maximumFractionDigits: digits}).replace('-', '\u2212').replace(/,/g, '\u2009');
}

function colour(role) {
  return /^\d+$/.test(role) ? `var(--c${Number(role) % 6})` : `var(--${role.replace(/[^a-z]/g, '')})`;
}

/** The index of the value nearest to `x` in sorted numbers. */
function nearestIndex(sorted, x) {
  let low = 0, high = sorted.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < x) low = middle; else high = middle;
  }
  return Math.abs(sorted[low] - x) <= Math.abs(sorted[high] - x) ? low : high;
}

/** Part of the time and a cursor in it, the same for all figures over time. */
const timeView = {
  whole: [0, 1], domain: [0, 1], cursor: null, redraws: [], moves: [],
  setDomain(domain) {
    this.domain = domain || this.whole;
    document.getElementById('all').hidden = !domain;
    for (const redraw of this.redraws) redraw();
  },
  setCursor(t) {
    this.cursor = t;
    for (const move of this.moves) move(t);
  },
};

/** Line segments as a path; null, and a step of x over `hole`, starts a new one. Returns the text and how many points it has. */
function pathOf(xs, ys, toX, toY, hole = Infinity) {
  let text = '', pen = false, points = 0;
  for (let i = 0; i < xs.length; ++i) {
    if (xs[i] === null || ys[i] === null) { pen = false; continue; }
    if (i > 0 && xs[i] - xs[i - 1] > hole) pen = false;
    text += `${pen ? 'L' : 'M'}${toX(xs[i]).toFixed(1)} ${toY(ys[i]).toFixed(1)}`;
    pen = true;
    ++points;
  }
  return {text, points};
}
