// Puts the page together.

const sections = {way: 'Where it went', error: 'How far off', state: 'What it felt', feet: 'Feet', senses: 'Senses', time: 'Time it took', all: 'Everything'};
const kinds = {lines: drawTimeChart, plane: drawPlane, strip: drawStrip, bars: drawBars, cloud: drawCloud, table: drawTable};
const halves = ['path_top', 'path_side', 'transitions', 'contact_table', 'messages', 'rates', 'stage_histogram', 'stage_table'];

function wholeTime(figures) {
  let low = Infinity, high = -Infinity;
  const take = (t) => { low = Math.min(low, t); high = Math.max(high, t); };
  for (const figure of figures) {
    if (figure.kind === 'lines') for (const panel of figure.panels) for (const line of panel.lines) if (line.x.length) { take(line.x[0]); take(line.x[line.x.length - 1]); }
    if (figure.kind === 'strip') for (const row of figure.rows) for (const [begin, end] of row.spans) { take(begin); take(end); }
  }
  return isFinite(low) && high > low ? [low, high] : [0, 1];
}

function drawHead(data) {
  document.title = `KILVO: ${data.name}`;
  document.getElementById('name').textContent = data.name;
  const parts = [`results in ${data.folder}`, data.input && `of ${data.input}`, data.version && `KILVO ${data.version}`,
                 data.has_truth ? `compared with the truth at each ${data.of_sweeps ? 'sweep' : 'output'}` : 'no truth was given, so there are no errors to show'];
  document.getElementById('about').textContent = parts.filter(Boolean).join(' · ');
  const main = document.getElementById('main');
  if (data.distrust.length) main.append(el('p', {class: 'distrust', role: 'alert'}, el('b', {}, 'Do not trust this run: '), data.distrust.join('; ')));
  if (data.headlines.length) {
    main.append(el('div', {class: 'headlines'}, ...data.headlines.map((h) => el('div', {class: h.bad ? 'headline bad' : 'headline'},
        el('div', {class: 'label'}, h.label), el('div', {class: 'value'}, h.value, el('span', {class: 'unit'}, h.unit)), el('div', {class: 'note'}, h.note)))));
  }
  if (data.warnings.length) main.append(el('ul', {class: 'warnings'}, ...data.warnings.map((text) => el('li', {}, text))));
  return main;
}

/** What has been drawn, for whoever checks the page: {figures: {id: number of things drawn}, errors: [text], width, window: pixels}. */
function drawReport() {
  const data = JSON.parse(document.getElementById('data').textContent), drawn = {figures: {}, errors: []};
  const main = drawHead(data);
  timeView.domain = timeView.whole = wholeTime(data.figures);
  for (const [section, title] of Object.entries(sections)) {
    const figures = data.figures.filter((figure) => figure.section === section);
    if (!figures.length) continue;
    const grid = el('div', {class: 'figures'});
    main.append(el('section', {}, el('h2', {}, title), grid));
    for (const figure of figures) {
      const frame = el('figure', {id: `figure-${figure.id}`, class: halves.includes(figure.id) ? 'half' : 'wide'}, el('h3', {}, figure.title));
      if (figure.note) frame.append(el('p', {class: 'note'}, figure.note));
      const inside = el('div');
      frame.append(inside);
      grid.append(frame);
      try {
        drawn.figures[figure.id] = kinds[figure.kind](figure, inside);
      } catch (error) {
        inside.append(el('p', {class: 'note'}, 'This figure could not be drawn.'));
        drawn.errors.push(`${figure.id}: ${error.message}`);
        console.error(error);
      }
    }
  }
  drawn.width = document.documentElement.scrollWidth;
  drawn.window = window.innerWidth;
  document.body.append(el('footer', {}, data.missing.length ? `Not in the folder, so not shown: ${data.missing.join(', ')}. ` : '',
                          'Times count from the first output. Drag over a figure with the mouse to see a part of the time in all of them.'),
                       el('script', {type: 'application/json', id: 'drawn'}, JSON.stringify(drawn)));
}

drawReport();
document.getElementById('all').addEventListener('click', () => timeView.setDomain(null));
let resizing = 0;
window.addEventListener('resize', () => {
  cancelAnimationFrame(resizing);
  resizing = requestAnimationFrame(() => { for (const redraw of timeView.redraws) redraw(); });
});
