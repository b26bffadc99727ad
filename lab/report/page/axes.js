// Scales with round ticks, their grid and labels.

/** About `count` round numbers within [low, high]. */
function ticks(low, high, count) {
  const raw = (high - low) / Math.max(1, count), power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5, 10].find((m) => m * power >= raw * 0.999) || 10);
  const values = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) values.push(k * step);
  return {values, step};
}

/** Least and greatest with some air around; never empty. */
function padded(low, high, share = 0.06) {
  if (!isFinite(low) || !isFinite(high)) return [0, 1];
  const size = high - low || Math.max(Math.abs(high) * 0.1, 1e-3);
  return [low - share * size, high + share * size];
}

function scale(domain, range) {
  const factor = (range[1] - range[0]) / (domain[1] - domain[0]);
  const to = (x) => range[0] + (x - domain[0]) * factor;
  to.invert = (pixel) => domain[0] + (pixel - range[0]) / factor;
  return to;
}

/** Horizontal grid lines with labels at the left of `box` {left, right, top, bottom}. */
function drawYAxis(parent, box, domain) {
  const toY = scale(domain, [box.bottom, box.top]);
  const {values, step} = ticks(domain[0], domain[1], Math.max(3, (box.bottom - box.top) / 24));
  for (const value of values) {
    const y = toY(value).toFixed(1);
    const zero = Math.abs(value) < step * 1e-6 && domain[0] < 0;
    parent.append(svg('line', {class: zero ? 'zero' : 'grid', x1: box.left, x2: box.right, y1: y, y2: y}));
    parent.append(svg('text', {x: box.left - 6, y: Number(y) + 4, 'text-anchor': 'end'}, tickLabel(value, step)));
  }
  return toY;
}

/** Vertical grid lines; labels below `box` unless `label` is null. `label` stands at the right end, after the last number. */
function drawXAxis(parent, box, domain, label) {
  const toX = scale(domain, [box.left, box.right]);
  const {values, step} = ticks(domain[0], domain[1], Math.max(2, (box.right - box.left) / 90));
  for (const value of values) {
    const x = toX(value).toFixed(1);
    parent.append(svg('line', {class: 'grid', x1: x, x2: x, y1: box.top, y2: box.bottom}));
    if (label !== null && toX(value) < box.right - 14 - 6 * label.length) {
      parent.append(svg('text', {x, y: box.bottom + 15, 'text-anchor': 'middle'}, tickLabel(value, step)));
    }
  }
  parent.append(svg('line', {class: 'axis', x1: box.left, x2: box.right, y1: box.bottom, y2: box.bottom}));
  if (label !== null) parent.append(svg('text', {x: box.right, y: box.bottom + 15, 'text-anchor': 'end'}, label));
  return toX;
}

/** Lets a pointer move the cursor of time over `target`, and a mouse drag choose part of it. `box` and `toX` are asked for when needed. */
function followTime(target, geometry) {
  let from = null, selection = null;
  const at = (event) => {
    const {box, toX} = geometry(), pixel = event.clientX - target.getBoundingClientRect().left;
    return {pixel: Math.min(box.right, Math.max(box.left, pixel)), t: toX.invert(Math.min(box.right, Math.max(box.left, pixel)))};
  };
  const drop = () => { if (selection) selection.remove(); selection = null; from = null; };
  target.addEventListener('pointerdown', (event) => {
    timeView.setCursor(at(event).t);
    if (event.pointerType !== 'mouse' || event.button !== 0) return;
    from = at(event);
    target.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  target.addEventListener('pointermove', (event) => {
    const here = at(event);
    timeView.setCursor(here.t);
    if (!from || Math.abs(here.pixel - from.pixel) < 6) return;
    const {box} = geometry();
    if (!selection) target.append(selection = svg('rect', {class: 'selection', y: box.top, height: box.bottom - box.top}));
    selection.setAttribute('x', Math.min(from.pixel, here.pixel));
    selection.setAttribute('width', Math.abs(from.pixel - here.pixel));
  });
  target.addEventListener('pointerup', (event) => {
    const start = from, chosen = selection !== null, end = at(event);
    drop();
    if (start && chosen) timeView.setDomain([Math.min(start.t, end.t), Math.max(start.t, end.t)]);
  });
  target.addEventListener('pointercancel', drop);
  target.addEventListener('pointerleave', () => { if (!from) timeView.setCursor(null); });
  target.addEventListener('dblclick', () => timeView.setDomain(null));
}
