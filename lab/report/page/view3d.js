// Points to turn. Drawn by the processor into pixels with a depth of each, so that it works where there is no graphics card, too.

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** Coordinates in metres: x, y, z of each point behind each other. */
function unpackPoints(figure) {
  const bytes = bytesOf(figure.xyz), points = new Float32Array(figure.n * 3);
  for (let i = 0; i < points.length; ++i) {
    const k = i % 3;
    points[i] = figure.low[k] + (bytes[2 * i] + 256 * bytes[2 * i + 1]) / 65535 * (figure.high[k] - figure.low[k]);
  }
  return points;
}

/** A share of 0 to 1 as a colour from deep blue over green to yellow, 0xAABBGGRR as pixels want it. */
function rampColour(share) {
  const stops = [[52, 74, 150], [38, 130, 160], [60, 170, 130], [150, 205, 90], [250, 225, 90]];
  const place = Math.min(0.9999, Math.max(0, share)) * (stops.length - 1), i = Math.floor(place), part = place - i;
  const [r, g, b] = stops[i].map((value, k) => Math.round(value + part * (stops[i + 1][k] - value)));
  return (255 << 24 | b << 16 | g << 8 | r) >>> 0;
}

/** One colour for each point, by `mode`: height, intensity, colour. */
function pointColours(figure, points, mode) {
  const colours = new Uint32Array(figure.n);
  const heights = Array.from({length: figure.n}, (_, i) => points[3 * i + 2]).sort((a, b) => a - b);
  const low = heights[Math.floor(figure.n * 0.01)], size = Math.max(heights[Math.floor((figure.n - 1) * 0.99)] - low, 0.1);
  const bytes = mode === 'intensity' ? bytesOf(figure.intensity) : mode === 'colour' ? bytesOf(figure.rgb) : null;
  for (let i = 0; i < figure.n; ++i) {
    if (mode === 'colour') colours[i] = (255 << 24 | bytes[3 * i + 2] << 16 | bytes[3 * i + 1] << 8 | bytes[3 * i]) >>> 0;
    else colours[i] = rampColour(mode === 'intensity' ? bytes[i] / 255 : (points[3 * i + 2] - low) / size);
  }
  return colours;
}

/** How far apart the points are: the median distance to the nearest other one, of some of them. */
function spacingOf(points) {
  const n = points.length / 3, samples = Math.min(120, n), distances = [];
  for (let s = 0; s < samples; ++s) {
    const i = 3 * Math.floor((s + 0.5) * n / samples);
    let nearest = Infinity;
    for (let k = 0; k < points.length; k += 3) {
      const d = (points[k] - points[i]) ** 2 + (points[k + 1] - points[i + 1]) ** 2 + (points[k + 2] - points[i + 2]) ** 2;
      if (d < nearest && k !== i) nearest = d;
    }
    distances.push(Math.sqrt(nearest));
  }
  return distances.sort((a, b) => a - b)[samples >> 1] || 0.05;
}

/** Where the eye is: around `target` at `distance`, `yaw` and `pitch` in rad. */
function makeCamera(figure, walked) {
  const middle = (k) => walked ? (Math.min(...walked[k]) + Math.max(...walked[k])) / 2 : null;
  const size = [0, 1, 2].map((k) => figure.high[k] - figure.low[k]);
  return {
    target: ['x', 'y', 'z'].map((name, k) => walked ? middle(name) : figure.low[k] + size[k] / 2),
    distance: Math.min(1.15 * Math.hypot(size[0], size[1]) + 1, walked ? 15 + 1.5 * Math.hypot(...['x', 'y'].map((k) => Math.max(...walked[k]) - Math.min(...walked[k]))) : 1e9),
    yaw: -0.9, pitch: 0.75,
    /** Rows: right, up, towards the eye. */
    axes() {
      const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
      return [[-sy, cy, 0], [-sp * cy, -sp * sy, cp], [cp * cy, cp * sy, sp]];
    },
  };
}

class PointView {
  constructor(figure, canvas) {
    this.figure = figure;
    this.canvas = canvas;
    this.context = canvas.getContext('2d', {willReadFrequently: true});  // pixels are put, not drawn: keep them with the processor
    this.points = unpackPoints(figure);
    this.spacing = spacingOf(this.points);
    this.walked = figure.lines.find((line) => line.role === 'estimate');
    this.camera = makeCamera(figure, this.walked);
    this.cut = Infinity;
    this.cursor = null;
    this.pending = false;
  }

  colourBy(mode) { this.colours = pointColours(this.figure, this.points, mode); }

  /** Draws before the next frame, once however often it is asked. */
  redraw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => { this.pending = false; this.draw(); });
  }

  project() {
    const [r, u, f] = this.camera.axes(), c = this.camera, [tx, ty, tz] = c.target, w = this.canvas.width, h = this.canvas.height;
    const focal = 0.9 * Math.max(w, h);
    return (x, y, z) => {
      const dx = x - tx, dy = y - ty, dz = z - tz, depth = c.distance - (f[0] * dx + f[1] * dy + f[2] * dz);
      return [w / 2 + focal * (r[0] * dx + r[1] * dy) / depth, h / 2 - focal * (u[0] * dx + u[1] * dy + u[2] * dz) / depth, depth];
    };
  }

  /** Returns how many points are in sight. */
  draw() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), canvas = this.canvas;
    const w = canvas.width = Math.max(2, Math.round(canvas.clientWidth * ratio)), h = canvas.height = Math.max(2, Math.round(canvas.clientHeight * ratio));
    const image = this.context.createImageData(w, h), pixels = new Uint32Array(image.data.buffer), depths = new Float32Array(w * h).fill(Infinity);
    pixels.fill(0xff1b1510);
    const seen = this.splat(pixels, depths, w, h);
    this.context.putImageData(image, 0, 0);
    for (const line of this.figure.lines) this.stroke(line, ratio);
    if (this.cursor !== null && this.figure.robot) this.robot(ratio);
    else if (this.cursor !== null && this.walked) this.dot(ratio);
    return seen;
  }

  splat(pixels, depths, w, h) {
    const {points, colours, cut} = this, [r, u, f] = this.camera.axes(), [tx, ty, tz] = this.camera.target, distance = this.camera.distance;
    const focal = 0.9 * Math.max(w, h), spacing = 1.7 * this.spacing * focal;
    let seen = 0;
    for (let i = 0, k = 0; i < colours.length; ++i, k += 3) {
      if (points[k + 2] > cut) continue;
      const dx = points[k] - tx, dy = points[k + 1] - ty, dz = points[k + 2] - tz;
      const depth = distance - (f[0] * dx + f[1] * dy + f[2] * dz);
      if (depth < 0.2) continue;
      const px = (w / 2 + focal * (r[0] * dx + r[1] * dy) / depth) | 0, py = (h / 2 - focal * (u[0] * dx + u[1] * dy + u[2] * dz) / depth) | 0;
      const size = Math.max(1, Math.min(8, Math.round(spacing / depth)));
      if (px < 0 || py < 0 || px + size > w || py + size > h) continue;
      ++seen;
      for (let y = py; y < py + size; ++y) {
        for (let x = px, at = y * w + px; x < px + size; ++x, ++at) {
          if (depth < depths[at]) { depths[at] = depth; pixels[at] = colours[i]; }
        }
      }
    }
    return seen;
  }

  stroke(line, ratio) {
    const to = this.project(), context = this.context;
    context.beginPath();
    let pen = false;
    for (let i = 0; i < line.x.length; ++i) {
      const [x, y, depth] = to(line.x[i], line.y[i], line.z[i]);
      if (depth < 0.2) { pen = false; continue; }
      if (pen) context.lineTo(x, y); else context.moveTo(x, y);
      pen = true;
    }
    context.lineWidth = (line.role === 'truth' ? 3.5 : 2) * ratio;
    context.strokeStyle = line.role === 'truth' ? '#ffffffa0' : '#ff4d5e';
    context.stroke();
  }

  /** Both legs at the cursor's time, the feet coloured while they stand. */
  robot(ratio) {
    const {t, joints, p, on} = this.figure.robot, frame = nearestIndex(t, this.cursor), to = this.project(), context = this.context;
    context.lineWidth = 3.5 * ratio;
    context.lineCap = context.lineJoin = 'round';
    for (const side of [0, 1]) {
      context.beginPath();
      let foot = null;
      for (let i = 0; i < joints; ++i) {
        const [x, y, depth] = to(...p[frame].slice(3 * (side * joints + i), 3 * (side * joints + i) + 3).map((cm) => cm / 100));
        if (depth < 0.2) continue;
        if (foot) context.lineTo(x, y); else context.moveTo(x, y);
        foot = [x, y];
      }
      context.strokeStyle = '#ffffff';
      context.stroke();
      if (!foot) continue;
      context.beginPath();
      context.arc(foot[0], foot[1], 6.5 * ratio, 0, 2 * Math.PI);
      context.fillStyle = on[frame] >> side & 1 ? '#37d67a' : '#ff9d4d';
      context.fill();
    }
    this.shown = frame;
  }

  dot(ratio) {
    const i = nearestIndex(this.walked.t, this.cursor), [x, y, depth] = this.project()(this.walked.x[i], this.walked.y[i], this.walked.z[i]);
    if (depth < 0.2) return;
    this.context.beginPath();
    this.context.arc(x, y, 6 * ratio, 0, 2 * Math.PI);
    this.context.fillStyle = '#fff';
    this.context.fill();
  }
}

/** Turning, moving and coming closer by mouse, pen and fingers. */
function steer(view) {
  const canvas = view.canvas, camera = view.camera, fingers = new Map();
  const turn = (dx, dy) => {
    camera.yaw -= dx * 0.006;
    camera.pitch = Math.max(-1.5, Math.min(1.55, camera.pitch + dy * 0.006));
  };
  const move = (dx, dy) => {
    const [r, u] = camera.axes(), metres = camera.distance / (0.9 * Math.max(canvas.clientWidth, canvas.clientHeight));
    for (let k = 0; k < 3; ++k) camera.target[k] -= metres * (dx * r[k] - dy * u[k]);
  };
  const closer = (factor) => { camera.distance = Math.max(0.5, Math.min(2000, camera.distance * factor)); };
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before[0], dy = event.clientY - before[1];
    const other = [...fingers].find(([id]) => id !== event.pointerId);
    if (other) {
      const [ox, oy] = other[1];
      closer(Math.max(1, Math.hypot(before[0] - ox, before[1] - oy)) / Math.max(1, Math.hypot(event.clientX - ox, event.clientY - oy)));
      move(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 6) {
      move(dx, dy);
    } else {
      turn(dx, dy);
    }
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    view.redraw();
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    closer(Math.exp(Math.max(-1, Math.min(1, event.deltaY * 0.0015))));
    view.redraw();
  }, {passive: false});
}

/** Moves the cursor of time along, as fast as the robot was times the chosen speed. */
function playback(view) {
  const t = view.figure.robot ? view.figure.robot.t : view.walked.t, end = t[t.length - 1];
  const button = el('button', {type: 'button', class: 'play'}, 'Play'), place = el('input', {type: 'range', min: 0, max: 1000, value: 0, class: 'place', 'aria-label': 'time'});
  const speed = el('select', {'aria-label': 'speed'}, ...['1', '2', '5', '10'].map((x) => el('option', {value: x}, `${x} x`))), reading = el('span', {class: 'reading'});
  let last = null, now = t[0];
  const show = (time) => {
    now = Math.min(end, Math.max(t[0], time));
    place.value = Math.round(1000 * (now - t[0]) / Math.max(1e-9, end - t[0]));
    reading.textContent = `${now.toFixed(1)} s`;
    timeView.setCursor(now);
  };
  const step = (stamp) => {
    if (last === null) return;
    const seconds = Math.min(0.2, Math.max(0, (stamp - last) / 1000));
    last = stamp;
    show(now + seconds * Number(speed.value));
    if (now >= end) stop(); else requestAnimationFrame(step);
  };
  const stop = () => { last = null; button.textContent = 'Play'; };
  button.addEventListener('click', () => {
    if (last !== null) return stop();
    if (now >= end) now = t[0];
    last = performance.now();
    button.textContent = 'Pause';
    requestAnimationFrame(step);
  });
  place.addEventListener('input', () => { stop(); show(t[0] + Number(place.value) / 1000 * (end - t[0])); });
  reading.textContent = `${t[0].toFixed(1)} s`;
  return el('div', {class: 'tools'}, button, place, reading, el('label', {}, 'speed', speed));
}

/** kind `cloud`: returns how many points are in sight at first. */
function drawCloud(figure, parent) {
  const canvas = el('canvas', {role: 'img', 'aria-label': 'map of points'});
  const modes = [...(figure.rgb ? ['colour'] : []), 'height', ...(figure.intensity ? ['intensity'] : [])];
  const choice = el('select', {'aria-label': 'colour of the points'}, ...modes.map((mode) => el('option', {}, mode)));
  const slider = el('input', {type: 'range', min: 0, max: 1000, 'aria-label': 'cut off above'}), reading = el('span');
  const again = el('button', {type: 'button'}, 'Reset view');
  parent.append(el('div', {class: 'view'}, canvas),
                el('div', {class: 'tools'}, el('label', {}, 'coloured by', choice), el('label', {}, 'cut off above', slider, reading), again));
  const view = new PointView(figure, canvas);
  if (view.walked && view.walked.t.length > 1) parent.append(playback(view));
  const cutAt = () => {
    const share = Number(slider.value) / 1000;
    view.cut = share >= 1 ? Infinity : figure.low[2] + share * (figure.high[2] - figure.low[2]);
    reading.textContent = share >= 1 ? 'nothing' : `${(figure.low[2] + share * (figure.high[2] - figure.low[2])).toFixed(1)} m`;
  };
  // A ceiling would hide everything: cut below it at first, half a metre over the highest the robot has been.
  const top = view.walked ? Math.max(...view.walked.z) + 0.5 : Infinity;
  slider.value = Math.round(1000 * Math.min(1, Math.max(0, (top - figure.low[2]) / Math.max(1e-6, figure.high[2] - figure.low[2]))));
  cutAt();
  view.colourBy(modes[0]);
  choice.addEventListener('change', () => { view.colourBy(choice.value); view.redraw(); });
  slider.addEventListener('input', () => { cutAt(); view.redraw(); });
  again.addEventListener('click', () => { Object.assign(view.camera, makeCamera(figure, view.walked)); view.redraw(); });
  steer(view);
  timeView.redraws.push(() => view.redraw());
  timeView.moves.push((t) => { view.cursor = t; view.redraw(); });
  return view.draw();
}
