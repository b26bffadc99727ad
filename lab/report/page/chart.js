// Curves: over time in panels below each other, and in a plane.

const left = 64, right = 10;  // pixels beside every figure, so that times lie above each other

/** Where the visible part of sorted times begins and ends (exclusive), with one point more on each side. */
function visible(xs, domain) {
  let begin = 0, end = xs.length;
  while (begin + 1 < end && xs[begin + 1] < domain[0]) ++begin;
  while (end - 1 > begin && xs[end - 2] > domain[1]) --end;
  return [begin, end];
}

function yDomain(panel, domain) {
  let low = Infinity, high = -Infinity;
  const take = (y) => { if (y !== null) { low = Math.min(low, y); high = Math.max(high, y); } };
  for (const line of panel.lines) for (let [i, end] = visible(line.x, domain); i < end; ++i) take(line.y[i]);
  for (const band of panel.bands) {
    // Its 98th percentile: one wide moment must not flatten the rest.
    const widths = band.y.slice(...visible(band.x, domain)).filter((y) => y !== null).sort((a, b) => a - b);
    if (widths.length) { take(widths[Math.floor((widths.length - 1) * 0.98)]); take(-widths[Math.floor((widths.length - 1) * 0.98)]); }
  }
  if (panel.from_zero) take(0);
  return padded(low, high);
}

/** How far apart two times are when nothing is known in between: much more than usual, and a second. */
function holeIn(times) {
  const steps = times.slice(1).map((t, i) => t - times[i]).sort((a, b) => a - b);
  return Math.max(1, 8 * (steps[steps.length >> 1] || 0));
}

/** Indices of the values that are known, in runs without a hole. */
function knownRuns(xs, ys) {
  const hole = holeIn(xs), runs = [];
  ys.forEach((y, i) => {
    if (y === null) return;
    if (i === 0 || ys[i - 1] === null || xs[i] - xs[i - 1] > hole) runs.push([]);
    runs[runs.length - 1].push(i);
  });
  return runs;
}

function drawLines(parent, panel, toX, toY, domain) {
  let points = 0;
  const part = (line) => { const [begin, end] = visible(line.x, domain); return [line.x.slice(begin, end), line.y.slice(begin, end)]; };
  for (const band of panel.bands) {
    const [x, y] = part(band);
    for (const run of knownRuns(x, y)) {
      const outline = run.map((i) => [x[i], y[i]]).concat(run.reverse().map((i) => [x[i], -y[i]]));
      const {text} = pathOf(outline.map((p) => p[0]), outline.map((p) => p[1]), toX, toY);
      parent.append(svg('path', {class: 'band', d: text + 'Z', style: `fill: ${colour(band.role)}`}));
    }
  }
  for (const line of panel.lines) {
    const path = pathOf(...part(line), toX, toY, isFinite(domain[0]) ? holeIn(line.x) : Infinity);
    points += path.points;
    parent.append(svg('path', {class: line.role === 'truth' ? 'line truth' : 'line', d: path.text, style: `stroke: ${colour(line.role)}`}));
  }
  return points;
}

/** Title of a panel and a key for each curve, with the value under the cursor. */
function legendOf(panel) {
  const legend = el('div', {class: 'legend'});
  legend.append(el('b', {}, panel.label), ` ${panel.unit}`);
  const reads = [...panel.lines, ...panel.bands].map((line) => {
    const read = el('span', {class: 'read'});
    const isBand = panel.bands.includes(line);
    legend.append(el('span', {}, el('span', {class: isBand ? 'key band' : 'key', style: `border-color: ${colour(line.role)}`}), `${line.name} `, read));
    return {line, read, sign: isBand ? '±' : ''};
  });
  const update = (t) => {
    for (const {line, read, sign} of reads) {
      const outside = t === null || !line.x.length || t < line.x[0] - 1 || t > line.x[line.x.length - 1] + 1;
      read.textContent = outside ? '' : sign + show(line.y[nearestIndex(line.x, t)]);
    }
  };
  return {legend, update};
}

/** kind `lines`: returns how many points are drawn. */
function drawTimeChart(figure, parent) {
  let points = 0;
  figure.panels.forEach((panel, index) => {
    const last = index === figure.panels.length - 1, height = (figure.panels.length > 2 ? 118 : 176) + (last ? 20 : 6);
    const {legend, update} = legendOf(panel);
    const canvas = svg('svg', {height});
    parent.append(legend, canvas);
    let box = null, toX = null, cursor = null;
    const move = (t) => {
      const inside = t !== null && t >= timeView.domain[0] && t <= timeView.domain[1];
      cursor.setAttribute('visibility', inside ? 'visible' : 'hidden');
      if (inside) for (const end of ['x1', 'x2']) cursor.setAttribute(end, toX(t).toFixed(1));
      update(t);
    };
    const draw = () => {
      canvas.replaceChildren();
      box = {left, right: Math.max(left + 60, parent.clientWidth - right), top: 6, bottom: height - (last ? 20 : 6)};
      toX = drawXAxis(canvas, box, timeView.domain, last ? 's' : null);
      const toY = drawYAxis(canvas, box, yDomain(panel, timeView.domain));
      const clip = `clip-${figure.id}-${index}`;
      const inside = svg('g', {'clip-path': `url(#${clip})`});
      const window = svg('clipPath', {id: clip});
      window.append(svg('rect', {x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top}));
      canvas.append(window, inside);
      const drawn = drawLines(inside, panel, toX, toY, timeView.domain);
      canvas.append(cursor = svg('line', {class: 'cursor', y1: box.top, y2: box.bottom, visibility: 'hidden'}));
      return drawn;
    };
    points += draw();
    followTime(canvas, () => ({box, toX}));
    timeView.redraws.push(draw);
    timeView.moves.push(move);
  });
  return points;
}

/** Scales of a plane: the same for both axes when `equal`, with the curves in the middle. */
function planeScales(figure, width) {
  const all = (axis) => figure.lines.flatMap((line) => line[axis]);
  const least = (values) => values.reduce((a, b) => Math.min(a, b), Infinity), most = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);
  const xs = all('x'), ys = all('y');
  let x = padded(least(xs), most(xs)), y = padded(least(ys), most(ys));
  const inner = width - left - right;
  let height = 260;
  if (figure.equal) {
    height = Math.min(Math.max(inner * (y[1] - y[0]) / (x[1] - x[0]), 160), Math.max(260, Math.min(460, inner)));
    const metres = Math.max((x[1] - x[0]) / inner, (y[1] - y[0]) / height);
    const widen = ([low, high], pixels) => [(low + high - metres * pixels) / 2, (low + high + metres * pixels) / 2];
    [x, y] = [widen(x, inner), widen(y, height)];
  } else if (y[1] - y[0] < 0.1) {
    y = [(y[0] + y[1]) / 2 - 0.05, (y[0] + y[1]) / 2 + 0.05];  // a flat floor is a flat line
  }
  return {x, y, height};
}

/** kind `plane`: returns how many points are drawn. */
function drawPlane(figure, parent) {
  const legend = el('div', {class: 'legend'}), canvas = svg('svg');
  const read = el('span', {class: 'read'});
  for (const line of [...figure.lines].reverse()) {
    legend.append(el('span', {}, el('span', {class: 'key', style: `border-color: ${colour(line.role)}`}), line.name));
  }
  legend.append(read);
  parent.append(legend, canvas);
  const walked = figure.lines.find((line) => line.role === 'estimate') || figure.lines[0];
  let toX, toY, dot;
  const mark = (index) => {
    dot.setAttribute('visibility', index === null ? 'hidden' : 'visible');
    if (index === null) { read.textContent = ''; return; }
    dot.setAttribute('cx', toX(walked.x[index]));
    dot.setAttribute('cy', toY(walked.y[index]));
    read.textContent = `${show(walked.t[index])} s: ${figure.x_label} ${show(walked.x[index])}, ${figure.y_label} ${show(walked.y[index])} m`;
  };
  const draw = () => {
    const width = Math.max(120, parent.clientWidth), plan = planeScales(figure, width);
    const box = {left, right: width - right, top: 6, bottom: 6 + plan.height};
    canvas.replaceChildren();
    canvas.setAttribute('height', plan.height + 28);
    toX = drawXAxis(canvas, box, plan.x, `${figure.x_label}, m`);
    toY = drawYAxis(canvas, box, plan.y);
    canvas.append(svg('text', {x: left + 6, y: 16}, `${figure.y_label}, m`));
    const points = drawLines(canvas, {lines: figure.lines, bands: []}, toX, toY, [-Infinity, Infinity]);
    const end = walked.x.length - 1;
    canvas.append(svg('circle', {cx: toX(walked.x[0]), cy: toY(walked.y[0]), r: 4, style: 'fill: var(--good)'}));
    canvas.append(svg('text', {x: toX(walked.x[0]) + 7, y: toY(walked.y[0]) + 12}, 'start'));
    canvas.append(svg('rect', {x: toX(walked.x[end]) - 4, y: toY(walked.y[end]) - 4, width: 8, height: 8, style: 'fill: var(--bad)'}));
    canvas.append(svg('text', {x: toX(walked.x[end]) + 7, y: toY(walked.y[end]) - 5}, 'end'));
    canvas.append(dot = svg('circle', {r: 4.5, style: 'fill: var(--estimate)', visibility: 'hidden'}));
    return points;
  };
  canvas.addEventListener('pointermove', (event) => {
    const area = canvas.getBoundingClientRect(), px = event.clientX - area.left, py = event.clientY - area.top;
    let best = 0, nearest = Infinity;
    walked.x.forEach((x, i) => {
      const d = (toX(x) - px) ** 2 + (toY(walked.y[i]) - py) ** 2;
      if (d < nearest) { nearest = d; best = i; }
    });
    timeView.setCursor(walked.t[best]);
  });
  canvas.addEventListener('pointerleave', () => timeView.setCursor(null));
  timeView.moves.push((t) => mark(t === null ? null : nearestIndex(walked.t, t)));
  timeView.redraws.push(draw);
  return draw();
}
