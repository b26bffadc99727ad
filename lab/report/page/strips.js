// What was on when, how often, and tables.

/** What fills a span of this class: a colour of the style sheet, or for the modalities one for each. */
function spanColour(name) {
  const modalities = {KILV: 'var(--c2)', KIL: 'var(--c0)', KI: 'var(--c1)', LIV: 'var(--c3)', LI: 'var(--c5)', COAST: 'var(--bad)'};
  return modalities[name.toUpperCase()] || (['left', 'right', 'truth'].includes(name) ? colour(name) : 'var(--c4)');
}

/** kind `strip`: returns how many spans are drawn. */
function drawStrip(figure, parent) {
  const rowHeight = 22, gap = 6, height = figure.rows.length * (rowHeight + gap) + 26;
  const legend = el('div', {class: 'legend'}), canvas = svg('svg', {height});
  parent.append(legend, canvas);
  let box = null, toX = null, cursor = null;
  const spanAt = (row, t) => row.spans.find(([begin, end]) => begin <= t && t < end);
  const draw = () => {
    let drawn = 0;
    canvas.replaceChildren();
    box = {left, right: Math.max(left + 60, parent.clientWidth - right), top: 2, bottom: height - 22};
    toX = drawXAxis(canvas, box, timeView.domain, 's');
    figure.rows.forEach((row, index) => {
      const y = box.top + 2 + index * (rowHeight + gap);
      canvas.append(svg('text', {x: box.left - 6, y: y + 15, 'text-anchor': 'end'}, row.label));
      for (const [begin, end, name] of row.spans) {
        const from = Math.max(toX(begin), box.left), to = Math.min(toX(end), box.right);
        if (to <= box.left || from >= box.right) continue;
        canvas.append(svg('rect', {x: from.toFixed(2), y, width: Math.max(to - from, 0.5).toFixed(2), height: rowHeight, rx: figure.named ? 3 : 0,
                                   style: `fill: ${spanColour(name)}`}));
        ++drawn;
        if (figure.named && to - from > 34) canvas.append(svg('text', {class: 'inside', x: from + 7, y: y + 15}, name));
      }
    });
    canvas.append(cursor = svg('line', {class: 'cursor', y1: box.top, y2: box.bottom, visibility: 'hidden'}));
    return drawn;
  };
  const move = (t) => {
    const inside = t !== null && t >= timeView.domain[0] && t <= timeView.domain[1];
    cursor.setAttribute('visibility', inside ? 'visible' : 'hidden');
    if (inside) for (const end of ['x1', 'x2']) cursor.setAttribute(end, toX(t).toFixed(1));
    legend.textContent = !inside ? '' : `${show(t)} s   ` + figure.rows.map((row) => {
      const span = spanAt(row, t);
      return figure.named ? (span ? span[3] : '–') : `${row.label} ${span ? 'down' : 'up'}`;
    }).join(', ');
  };
  const drawn = draw();
  followTime(canvas, () => ({box, toX}));
  timeView.redraws.push(draw);
  timeView.moves.push(move);
  return drawn;
}

/** kind `bars`: a histogram, its groups over each other. Returns how many bars are drawn. */
function drawBars(figure, parent) {
  const height = 210, legend = el('div', {class: 'legend'}), read = el('span', {class: 'read'}), canvas = svg('svg', {height});
  for (const group of figure.groups) {
    legend.append(el('span', {}, el('span', {class: 'key', style: `border-color: ${colour(group.role)}`}), group.name));
  }
  legend.append(read);
  parent.append(legend, canvas);
  const place = (x) => (figure.log ? Math.log10(x) : x), edges = figure.edges.map(place);
  const most = Math.max(1, ...figure.groups.map((group) => Math.max(...group.counts)));
  let toX;
  const draw = () => {
    let drawn = 0;
    canvas.replaceChildren();
    const box = {left, right: Math.max(left + 60, parent.clientWidth - right), top: 6, bottom: height - 22};
    toX = scale([edges[0], edges[edges.length - 1]], [box.left, box.right]);
    if (figure.log) drawLogAxis(canvas, box, toX, figure.x_label); else drawXAxis(canvas, box, [edges[0], edges[edges.length - 1]], figure.x_label);
    const toY = drawYAxis(canvas, box, [0, most * 1.05]);
    for (const group of figure.groups) {
      group.counts.forEach((count, i) => {
        if (!count) return;
        canvas.append(svg('rect', {x: toX(edges[i]).toFixed(1), width: Math.max(toX(edges[i + 1]) - toX(edges[i]) - 0.5, 0.5).toFixed(1),
                                   y: toY(count).toFixed(1), height: (box.bottom - toY(count)).toFixed(1), style: `fill: ${colour(group.role)}; opacity: .6`}));
        ++drawn;
      });
    }
    return drawn;
  };
  canvas.addEventListener('pointermove', (event) => {
    const x = toX.invert(event.clientX - canvas.getBoundingClientRect().left), bin = edges.findIndex((edge, i) => edge <= x && x < edges[i + 1]);
    read.textContent = bin < 0 ? '' : `${show(figure.edges[bin])} to ${show(figure.edges[bin + 1])} ${figure.x_label}: ` +
        figure.groups.map((group) => `${group.name} ${group.counts[bin]}`).join(', ');
  });
  canvas.addEventListener('pointerleave', () => { read.textContent = ''; });
  timeView.redraws.push(draw);
  return draw();
}

/** Grid and labels at 1, 2 and 5 times the powers of ten. `toX` takes logarithms. */
function drawLogAxis(parent, box, toX, label) {
  const wide = (box.right - box.left) / (toX.invert(box.right) - toX.invert(box.left)) < 120;  // pixels for a power of ten
  for (let power = -1; power <= 7; ++power) {
    for (const m of wide ? [1] : [1, 2, 5]) {
      const x = toX(Math.log10(m * 10 ** power));
      if (x < box.left || x > box.right) continue;
      parent.append(svg('line', {class: 'grid', x1: x, x2: x, y1: box.top, y2: box.bottom}));
      if (x < box.right - 14 - 6 * label.length) parent.append(svg('text', {x, y: box.bottom + 15, 'text-anchor': 'middle'}, tickLabel(m * 10 ** power, 10 ** power)));
    }
  }
  parent.append(svg('line', {class: 'axis', x1: box.left, x2: box.right, y1: box.bottom, y2: box.bottom}));
  parent.append(svg('text', {x: box.right, y: box.bottom + 15, 'text-anchor': 'end'}, label));
}

/** kind `table`: returns how many cells have something in them. */
function drawTable(figure, parent) {
  const table = el('table', figure.plain ? {class: 'plain'} : {});
  const isNumber = (column) => figure.rows.every((row) => typeof row[column] !== 'string' || row[column] === 'unknown');
  const kind = figure.columns.map((_, column) => (!figure.plain && isNumber(column) ? {class: 'number'} : {}));
  if (figure.columns.some((name) => name !== '')) table.append(el('thead', {}, el('tr', {}, ...figure.columns.map((name, i) => el('th', kind[i], name)))));
  let cells = 0;
  const body = el('tbody');
  for (const row of figure.rows) {
    body.append(el('tr', {}, ...row.map((value, i) => {
      cells += value === null || value === '' ? 0 : 1;
      return el('td', kind[i], typeof value === 'number' ? String(value).replace('-', '\u2212') : value === null ? '–' : String(value));
    })));
  }
  table.append(body);
  const scroll = el('div', {class: 'scroll'}, table);
  parent.append(figure.folded ? el('details', {}, el('summary', {}, `${figure.rows.length} settings`), scroll) : scroll);
  return cells;
}
