'use strict';
// Asks for the state, takes new pictures, draws. The picture is kept as floats; the canvas shows them under the exposure.
(() => {
  const $ = (id) => document.getElementById(id);
  const PERIOD = 500;
  const view = { stops: 0, zoom: null, pixel: null, axis: 'seconds' };
  let state = null, values = null, size = [1, 1], number = 0, shownSpp = 0, over = false;

  // ---- numbers
  const brief = (v) => (v === null || v === undefined ? '–' : v === 0 ? '0' : v >= 0.01 && v < 1e4 ? String(Number(v.toPrecision(3))) : v.toExponential(2));
  const count = (v) => String(Math.round(v)).replace(/\B(?=(\d{3})+$)/g, '\u202f');
  const time = (s) => {
    if (s === null || s === undefined) return '–';
    if (s < 60) return `${s.toFixed(1)} s`;
    const whole = Math.round(s), pad = (v) => String(v).padStart(2, '0');
    const h = Math.floor(whole / 3600), m = Math.floor(whole / 60) % 60;
    return h > 0 ? `${h}:${pad(m)}:${pad(whole % 60)}` : `${m}:${pad(whole % 60)}`;
  };
  // Nine digits tell a float apart from all others.
  const digits = (v) => String(Number(v.toPrecision(9)));

  // ---- picture
  const curve = new Uint8ClampedArray(4097);
  for (let i = 0; i <= 4096; i++) {
    // The table is finer where it is dark.
    const x = (i / 4096) ** 2;
    curve[i] = 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  }
  function paint() {
    if (!values) return;
    const [w, h] = size, canvas = $('canvas'), gain = 2 ** view.stops;
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const context = canvas.getContext('2d'), image = context.createImageData(w, h), out = image.data;
    for (let i = 0, o = 0; o < out.length; i += 3, o += 4) {
      for (let c = 0; c < 3; c++) {
        const x = values[i + c] * gain;
        out[o + c] = curve[x > 0 ? (x < 1 ? Math.round(Math.sqrt(x) * 4096) : 4096) : 0];
      }
      out[o + 3] = 255;
    }
    context.putImageData(image, 0, 0);
    place();
  }
  function fitting() {
    // With the room of scroll bars, which go when all fits.
    const box = $('view');
    return Math.min(box.offsetWidth / size[0], box.offsetHeight / size[1]);
  }
  function place() {
    if (!values) return;
    const zoom = view.zoom || fitting(), canvas = $('canvas');
    canvas.style.width = `${size[0] * zoom}px`;
    canvas.style.height = `${size[1] * zoom}px`;
    // Smaller than it is, a picture is smoothed.
    canvas.style.imageRendering = zoom < 1 ? 'auto' : 'pixelated';
    $('zoom').textContent = `${Math.round(zoom * 100)} %`;
    $('fit').setAttribute('aria-pressed', String(view.zoom === null));
    const mark = $('mark');
    mark.hidden = !view.pixel;
    if (view.pixel) {
      const edge = Math.max(5, zoom);
      Object.assign(mark.style, { width: `${edge}px`, height: `${edge}px`,
        left: `${(view.pixel[0] + 0.5) * zoom - edge / 2}px`, top: `${(view.pixel[1] + 0.5) * zoom - edge / 2}px` });
    }
  }
  function tell() {
    if (!view.pixel || !values) return;
    const [x, y] = view.pixel, at = 3 * (y * size[0] + x);
    const part = (name, text) => {
      const span = document.createElement('span'), b = document.createElement('b');
      b.textContent = name;
      span.append(b, text);
      return span;
    };
    $('pixel').replaceChildren(part('Pixel', `${x}, ${y}`), ...['R', 'G', 'B'].map((name, c) => part(name, digits(values[at + c]))));
  }
  function choose(x, y) {
    if (!values) return;
    view.pixel = [Math.min(size[0] - 1, Math.max(0, x)), Math.min(size[1] - 1, Math.max(0, y))];
    place(); tell();
  }
  function expose(stops) {
    view.stops = Math.min(10, Math.max(-10, stops));
    $('exposure').value = view.stops;
    $('stops').textContent = (view.stops > 0 ? '+' : '') + view.stops;
    paint();
  }
  function zoomBy(factor) {
    if (!values) return;
    const box = $('view'), from = view.zoom || fitting(), to = Math.min(64, Math.max(0.05, from * factor));
    // What is in the middle stays there.
    const middle = [box.scrollLeft + box.clientWidth / 2, box.scrollTop + box.clientHeight / 2];
    view.zoom = to;
    place();
    box.scrollLeft = middle[0] * to / from - box.clientWidth / 2;
    box.scrollTop = middle[1] * to / from - box.clientHeight / 2;
  }
  function fit() { view.zoom = null; place(); }

  // ---- numbers beside it
  function tellFacts() {
    const last = [...state.points].reverse().find((p) => p.rel_mse !== null);
    const facts = [
      ['Samples per pixel', count(state.spp)],
      ['Rate', `${brief(state.rate / 1e6)} million samples/s`],
      ['Time', time(state.seconds)],
      ['Left', state.ended ? 'none' : state.left === null ? 'not known yet' : `about ${time(state.left)}`],
      ['Estimated relMSE', state.estimate === null ? (state.spp < 16 ? 'from 16 samples on' : '–') : brief(state.estimate)],
    ];
    if (state.target !== null) facts.push(['Ends at relMSE', brief(state.target)]);
    if (state.reference) facts.push([last ? `relMSE at ${count(last.spp)} spp` : 'relMSE', last ? brief(last.rel_mse) : '–']);
    facts.push(['Size', `${state.size[0]} × ${state.size[1]}`], ['Integrator', state.integrator], ['Picture shown', `${count(shownSpp)} spp`]);
    $('facts').replaceChildren(...facts.flatMap(([name, text]) => {
      const dt = document.createElement('dt'), dd = document.createElement('dd');
      dt.textContent = name; dd.textContent = text;
      return [dt, dd];
    }));
    $('head').replaceChildren(row('th', ['spp', 'seconds', 'estimated relMSE', ...(state.reference ? ['relMSE', 'MSE'] : [])]));
    $('rows').replaceChildren(...state.points.map((p) =>
      row('td', [count(p.spp), p.seconds.toFixed(2), brief(p.estimate), ...(state.reference ? [brief(p.rel_mse), brief(p.mse)] : [])])));
  }
  function row(tag, texts) {
    const tr = document.createElement('tr');
    tr.append(...texts.map((text) => { const cell = document.createElement(tag); cell.textContent = text; return cell; }));
    return tr;
  }

  // ---- curve
  function node(tag, attributes, text) {
    const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    if (text !== undefined) element.textContent = text;
    return element;
  }
  const powers = '⁰¹²³⁴⁵⁶⁷⁸⁹';
  const power = (e) => (e === 0 ? '1' : e === 1 ? '10' : `10${e < 0 ? '⁻' : ''}${[...String(Math.abs(e))].map((d) => powers[d]).join('')}`);
  // Where lines of the grid are: powers of ten, and 2 and 5 times these if there are few.
  function ticks(low, high) {
    const list = [], fine = high - low < 2.2;
    for (let e = Math.floor(low) - 1; e <= high; e++) {
      for (const f of fine ? [1, 2, 5] : [1]) {
        const at = e + Math.log10(f);
        if (at >= low - 1e-9 && at <= high + 1e-9) list.push([at, fine ? brief(f * 10 ** e) : power(e)]);
      }
    }
    return list;
  }
  function plot() {
    const x = view.axis, points = state.points.filter((p) => p[x] > 0);
    const lines = ['rel_mse', 'estimate'].map((y) => points.filter((p) => p[y] > 0).map((p) => [Math.log10(p[x]), Math.log10(p[y])]));
    const all = lines.flat();
    $('caption').textContent = x === 'seconds' ? 'Error over seconds' : 'Error over samples per pixel';
    $('axis').textContent = x === 'seconds' ? 'Over samples' : 'Over time';
    $('legend').textContent = state.reference ? `Squares: relMSE against ${state.reference}. Circles: estimated from how the picture changed.`
      : 'relMSE, estimated from how the picture changed when its samples doubled.';
    const width = Math.max(220, $('plot').clientWidth), height = Math.round(Math.min(420, Math.max(190, width * 0.6)));
    const svg = node('svg', { viewBox: `0 0 ${width} ${height}`, height, role: 'img', 'aria-label': $('caption').textContent });
    if (all.length === 0) {
      svg.append(node('text', { x: width / 2, y: height / 2, 'text-anchor': 'middle' }, state.ended ? 'too few samples for a curve' : 'from 16 samples per pixel on'));
      $('plot').replaceChildren(svg);
      return;
    }
    if (state.target) all.push([all[0][0], Math.log10(state.target)]);
    const range = (i) => {
      const v = all.map((p) => p[i]), low = Math.min(...v), high = Math.max(...v), pad = Math.max(0.12, 0.06 * (high - low));
      return [low - pad, high + pad];
    };
    const [x0, x1] = range(0), [y0, y1] = range(1), box = { l: 58, r: width - 14, t: 10, b: height - 26 };
    const px = (v) => box.l + (v - x0) / (x1 - x0) * (box.r - box.l), py = (v) => box.b - (v - y0) / (y1 - y0) * (box.b - box.t);
    // Texts keep their distance.
    let free = -Infinity;
    for (const [at, text] of ticks(x0, x1)) {
      svg.append(node('line', { class: 'grid', x1: px(at), x2: px(at), y1: box.t, y2: box.b }));
      if (px(at) - free > 44) { svg.append(node('text', { x: px(at), y: box.b + 17, 'text-anchor': 'middle' }, text)); free = px(at); }
    }
    free = Infinity;
    for (const [at, text] of ticks(y0, y1)) {
      svg.append(node('line', { class: 'grid', x1: box.l, x2: box.r, y1: py(at), y2: py(at) }));
      if (free - py(at) > 16) { svg.append(node('text', { x: box.l - 7, y: py(at) + 4, 'text-anchor': 'end' }, text)); free = py(at); }
    }
    if (state.target) {
      const y = py(Math.log10(state.target));
      svg.append(node('line', { class: 'goal', x1: box.l, x2: box.r, y1: y, y2: y }), node('text', { x: box.r, y: y - 5, 'text-anchor': 'end' }, 'target'));
    }
    lines.forEach((line, i) => {
      const name = ['known', 'guess'][i];
      if (line.length > 1) svg.append(node('path', { class: name, d: line.map(([a, b], k) => `${k ? 'L' : 'M'}${px(a).toFixed(1)} ${py(b).toFixed(1)}`).join('') }));
      for (const [a, b] of line) {
        svg.append(i === 0 ? node('rect', { class: name, x: px(a) - 3.5, y: py(b) - 3.5, width: 7, height: 7 }) : node('circle', { class: name, cx: px(a), cy: py(b), r: 3.6 }));
      }
    });
    $('plot').replaceChildren(svg);
  }

  // ---- the conversation
  async function get(path) {
    const answer = await fetch(path);
    if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
    return answer;
  }
  async function takePicture() {
    const bytes = await (await get('picture')).arrayBuffer(), head = new DataView(bytes);
    const [n, spp, w, h] = [0, 4, 8, 12].map((at) => head.getUint32(at, true));
    const first = size[0] !== w || size[1] !== h;
    [number, shownSpp, size] = [n, spp, [w, h]];
    values = new Float32Array(w * h * 3);
    for (let i = 0; i < values.length; i++) values[i] = head.getFloat32(16 + 4 * i, true);
    if (first) view.pixel = view.pixel && [Math.min(w - 1, view.pixel[0]), Math.min(h - 1, view.pixel[1])];
    paint(); tell();
  }
  function say(text, isOver) {
    // A status that is read aloud changes only when there is news.
    if ($('status').textContent !== text) $('status').textContent = text;
    $('status').classList.toggle('over', isOver);
  }
  function show() {
    $('scene').textContent = state.scene;
    const part = state.fraction;
    document.title = state.ended ? `Done: ${state.scene}` : part === null ? state.scene : `${Math.floor(part * 100)} %: ${state.scene}`;
    $('bar').firstElementChild.style.width = `${100 * (part || 0)}%`;
    if (part === null) $('bar').removeAttribute('aria-valuenow'); else $('bar').setAttribute('aria-valuenow', String(Math.floor(part * 100)));
    if (state.ended) say(`The render is over. ${state.ended}`, true);
    else say(state.spp > 0 ? `Rendering to ${state.output}` : 'Waiting for the first pass…', false);
    tellFacts(); plot();
  }
  async function ask() {
    try {
      state = await (await get('state')).json();
      if (state.picture > number) await takePicture();
      show();
      over = state.ended !== null && number >= state.picture;
    } catch {
      over = true;
      say(values ? `The program is gone. This is the picture at ${count(shownSpp)} samples per pixel.` : 'The program is gone.', true);
    }
    document.documentElement.dataset.over = String(over);
    if (!over) setTimeout(ask, PERIOD);
  }

  // ---- hands
  const step = (dx, dy) => { const [x, y] = view.pixel || [size[0] >> 1, size[1] >> 1]; choose(x + dx, y + dy); };
  const turn = () => { view.axis = view.axis === 'seconds' ? 'spp' : 'seconds'; if (state) plot(); };
  const keys = {
    w: (n) => step(0, -n), s: (n) => step(0, n), a: (n) => step(-n, 0), d: (n) => step(n, 0),
    f: fit, '+': () => zoomBy(Math.SQRT2), '=': () => zoomBy(Math.SQRT2), '-': () => zoomBy(Math.SQRT1_2), x: turn,
  };
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === 'INPUT') return;
    if (event.key === 'e' || event.key === 'E') expose(view.stops + (event.key === 'e' ? 0.5 : -0.5));
    else if (keys[event.key.toLowerCase()]) keys[event.key.toLowerCase()](event.shiftKey ? 10 : 1);
    else return;
    event.preventDefault();
  });
  $('canvas').addEventListener('pointermove', (event) => {
    const box = $('canvas').getBoundingClientRect();
    choose(Math.floor((event.clientX - box.left) / box.width * size[0]), Math.floor((event.clientY - box.top) / box.height * size[1]));
  });
  $('exposure').addEventListener('input', (event) => expose(Number(event.target.value)));
  $('fit').addEventListener('click', fit);
  $('closer').addEventListener('click', () => zoomBy(Math.SQRT2));
  $('farther').addEventListener('click', () => zoomBy(Math.SQRT1_2));
  $('axis').addEventListener('click', turn);
  window.addEventListener('resize', () => { place(); if (state) plot(); });
  ask();
})();
