'use strict';
// All panels share one place, zoom, exposure and mode. Pictures are float values, loaded when a scene is shown.
(() => {
  const scenes = window.LUCERNA_SCENES;
  const $ = (id) => document.getElementById(id);
  const state = { scene: 0, image: 1, mode: 'image', stops: 0, grid: true, zoom: 1, x: 0, y: 0, pixel: null };
  const pictures = new Map(); // "scene-image" -> Float32Array
  let panels = [];
  const scene = () => scenes[state.scene];
  const key = (image) => `${state.scene}-${image}`;
  const values = (image) => pictures.get(key(image));

  window.LUCERNA_PICTURE = (name, text) => {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    pictures.set(name, new Float32Array(bytes.buffer));
    if (name.startsWith(`${state.scene}-`)) { if (Number(name.split('-')[1]) === 0) repaint(); else paintImage(Number(name.split('-')[1])); draw(); tell(); }
  };

  function openScene(number) {
    state.scene = number;
    $('scene').value = number;
    state.image = Math.min(state.image, scene().images.length - 1);
    state.pixel = null;
    $('tabs').replaceChildren(...scene().images.map((name, i) => {
      const tab = document.createElement('button');
      tab.type = 'button';
      tab.textContent = `${i} ${name}`;
      tab.addEventListener('click', () => choose(i));
      return tab;
    }));
    panels = scene().images.map((name, i) => {
      const element = document.createElement('div'), canvas = document.createElement('canvas'), label = document.createElement('b');
      element.className = 'panel';
      label.textContent = name;
      element.append(canvas, label);
      listen(element);
      const own = document.createElement('canvas');
      [own.width, own.height] = scene().size;
      return { element, canvas, own, image: i };
    });
    $('panels').replaceChildren(...panels.map((p) => p.element));
    scene().images.forEach((_, i) => {
      if (values(i)) return;
      const script = document.createElement('script');
      script.src = `data/${key(i)}.js`;
      script.onerror = () => { panels[i].element.querySelector('b').textContent += ' (cannot be loaded)'; };
      document.head.append(script);
    });
    arrange(); fit(); repaint(); tell();
  }

  function arrange() {
    const count = panels.length, box = $('panels').getBoundingClientRect(), [w, h] = scene().size;
    let columns = 1;
    if (state.grid) {
      // The number of columns that shows the pictures largest.
      let best = 0;
      for (let c = 1; c <= count; c++) {
        const scale = Math.min(box.width / c / w, box.height / Math.ceil(count / c) / h);
        if (scale > best) { best = scale; columns = c; }
      }
    }
    const rows = state.grid ? Math.ceil(count / columns) : 1;
    $('panels').style.gridTemplateColumns = `repeat(${columns}, 1fr)`;
    $('panels').style.gridTemplateRows = `repeat(${rows}, 1fr)`;
    panels.forEach((p, i) => { p.element.style.display = state.grid || i === state.image ? '' : 'none'; });
    [...$('tabs').children].forEach((tab, i) => tab.setAttribute('aria-pressed', String(i === state.image)));
    $('layout').textContent = state.grid ? 'One at a time' : 'All';
  }

  // Blue where darker than the reference, orange where brighter, black where equal: told apart by all kinds of sight.
  function color(image, i, gain, out, o) {
    const v = values(image), r = values(0);
    if (state.mode === 'image' || !r) {
      for (let c = 0; c < 3; c++) {
        const x = Math.min(1, Math.max(0, v[i + c] * gain));
        out[o + c] = 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
      }
      return;
    }
    let d = 0, e = 0;
    for (let c = 0; c < 3; c++) {
      const x = v[i + c] - r[i + c];
      d += x / 3;
      e += x * x / (r[i + c] * r[i + c] + 0.01) / 3;
    }
    if (state.mode === 'difference') {
      const x = Math.min(1, Math.abs(d) * gain * 4) ** 0.7;
      const end = d > 0 ? [255, 150, 20] : [60, 150, 255];
      for (let c = 0; c < 3; c++) out[o + c] = x * end[c];
    } else {
      const x = Math.min(1, Math.sqrt(e) * gain);
      out[o] = 255 * Math.min(1, 1.6 * x); out[o + 1] = 255 * Math.max(0, 1.5 * x - 0.35) * 0.9; out[o + 2] = 255 * (x < 0.5 ? 0.9 * x : Math.max(0.15, 0.9 - 0.9 * x));
    }
  }

  function paintImage(image) {
    const v = values(image), panel = panels[image];
    if (!v || !panel) return;
    const [w, h] = scene().size, context = panel.own.getContext('2d'), data = context.createImageData(w, h);
    const gain = scene().exposure * 2 ** state.stops;
    for (let p = 0; p < w * h; p++) { color(image, 3 * p, gain, data.data, 4 * p); data.data[4 * p + 3] = 255; }
    context.putImageData(data, 0, 0);
  }
  const legends = {
    image: '',
    difference: 'Difference to the reference: orange is brighter, blue darker, black equal.',
    relative: 'Relative squared error of each pixel: black is none, violet some, yellow much.',
  };
  function repaint() { panels.forEach((_, i) => paintImage(i)); $('legend').textContent = legends[state.mode]; draw(); }

  function draw() {
    for (const panel of panels) {
      const box = panel.element.getBoundingClientRect();
      if (!box.width) continue;
      const scale = window.devicePixelRatio || 1, { canvas } = panel;
      const width = Math.round(box.width * scale), height = Math.round(box.height * scale);
      if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
      const context = canvas.getContext('2d'), [w, h] = scene().size, zoom = state.zoom * scale;
      context.clearRect(0, 0, width, height);
      context.imageSmoothingEnabled = zoom < 1;
      context.drawImage(panel.own, width / 2 - state.x * zoom, height / 2 - state.y * zoom, w * zoom, h * zoom);
      if (state.pixel) {
        const [px, py] = state.pixel;
        context.strokeStyle = '#ffd34d'; context.lineWidth = 1.5 * scale;
        context.strokeRect(width / 2 + (px - state.x) * zoom - 1, height / 2 + (py - state.y) * zoom - 1, zoom + 2, zoom + 2);
      }
    }
  }

  function fit() {
    const shown = panels.find((p) => p.element.style.display !== 'none').element.getBoundingClientRect(), [w, h] = scene().size;
    Object.assign(state, { x: w / 2, y: h / 2, zoom: Math.max(0.02, 0.98 * Math.min(shown.width / w, shown.height / h)) });
    draw();
  }
  function zoomBy(factor, at) {
    const zoom = Math.min(200, Math.max(0.02, state.zoom * factor));
    if (at) { state.x += at[0] / state.zoom - at[0] / zoom; state.y += at[1] / state.zoom - at[1] / zoom; }
    state.zoom = zoom;
    draw();
  }
  function choose(image) {
    state.image = (image + panels.length) % panels.length;
    arrange(); draw();
  }
  function setMode(mode) { state.mode = mode; $('mode').value = mode; repaint(); }
  function setStops(stops) {
    state.stops = Math.min(10, Math.max(-10, stops));
    $('exposure').value = state.stops;
    $('stops').textContent = (state.stops > 0 ? '+' : '') + state.stops;
    repaint();
  }
  function setGrid(grid) { state.grid = grid; arrange(); fit(); }
  function setPixel(x, y) {
    const [w, h] = scene().size;
    state.pixel = [Math.min(w - 1, Math.max(0, x)), Math.min(h - 1, Math.max(0, y))];
    tell(); draw();
  }

  // Nine digits tell a float apart from all others.
  const digits = (v) => String(Number(v.toPrecision(9)));
  function tell() {
    const body = $('values').tBodies[0];
    if (!state.pixel) { body.replaceChildren(); return; }
    const [x, y] = state.pixel, at = 3 * (y * scene().size[0] + x), r = values(0);
    $('where').textContent = `Pixel ${x}, ${y}: R G B, and the mean difference to the reference`;
    body.replaceChildren(...scene().images.map((name, image) => {
      const row = document.createElement('tr'), v = values(image);
      const cell = (tag, text) => { const c = document.createElement(tag); c.textContent = text; row.append(c); };
      cell('th', name);
      for (let c = 0; c < 3; c++) cell('td', v ? digits(v[at + c]) : '…');
      const d = v && r ? (v[at] + v[at + 1] + v[at + 2] - r[at] - r[at + 1] - r[at + 2]) / 3 : null;
      cell('td', d === null || image === 0 ? '' : (d >= 0 ? '+' : '−') + Math.abs(d).toPrecision(3));
      return row;
    }));
  }

  function listen(element) {
    const place = (event) => {
      const box = element.getBoundingClientRect();
      return [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
    };
    const fingers = new Map();
    element.addEventListener('wheel', (event) => { event.preventDefault(); zoomBy(Math.exp(-event.deltaY * 0.0015), place(event)); }, { passive: false });
    element.addEventListener('pointerdown', (event) => { element.setPointerCapture(event.pointerId); fingers.set(event.pointerId, place(event)); $('panels').focus({ preventScroll: true }); });
    element.addEventListener('pointermove', (event) => {
      const at = place(event), before = fingers.get(event.pointerId);
      if (before) {
        const other = [...fingers].find(([id]) => id !== event.pointerId);
        if (other) {
          const length = (a) => Math.hypot(a[0] - other[1][0], a[1] - other[1][1]);
          zoomBy(length(at) / Math.max(1, length(before)), other[1]);
        } else { state.x -= (at[0] - before[0]) / state.zoom; state.y -= (at[1] - before[1]) / state.zoom; draw(); }
        fingers.set(event.pointerId, at);
      }
      const [w, h] = scene().size, x = Math.floor(state.x + at[0] / state.zoom), y = Math.floor(state.y + at[1] / state.zoom);
      if (x >= 0 && y >= 0 && x < w && y < h) setPixel(x, y);
    });
    for (const end of ['pointerup', 'pointercancel']) element.addEventListener(end, (event) => fingers.delete(event.pointerId));
    element.addEventListener('dblclick', fit);
  }

  const step = (dx, dy) => { const [w, h] = scene().size, [x, y] = state.pixel || [w >> 1, h >> 1]; setPixel(x + dx, y + dy); };
  const move = (dx, dy) => { state.x += dx * 40 / state.zoom; state.y += dy * 40 / state.zoom; draw(); };
  const keys = {
    ArrowLeft: (s) => (s ? move(-1, 0) : choose(state.image - 1)), ArrowRight: (s) => (s ? move(1, 0) : choose(state.image + 1)),
    ArrowUp: (s) => s && move(0, -1), ArrowDown: (s) => s && move(0, 1),
    g: () => setGrid(!state.grid), f: fit, '+': () => zoomBy(1.25), '=': () => zoomBy(1.25), '-': () => zoomBy(0.8),
    m: () => setMode({ image: 'difference', difference: 'relative', relative: 'image' }[state.mode]),
    e: () => setStops(state.stops + 0.5), E: () => setStops(state.stops - 0.5),
    w: () => step(0, -1), s: () => step(0, 1), a: () => step(-1, 0), d: () => step(1, 0),
  };
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || ['SELECT', 'INPUT'].includes(event.target.tagName)) return;
    if (/^[0-9]$/.test(event.key) && Number(event.key) < panels.length) choose(Number(event.key));
    else if (keys[event.key]) keys[event.key](event.shiftKey);
    else return;
    event.preventDefault();
  });

  $('scene').replaceChildren(...scenes.map((s, i) => new Option(s.name, i)));
  $('scene').addEventListener('change', (event) => openScene(Number(event.target.value)));
  $('mode').addEventListener('change', (event) => setMode(event.target.value));
  $('exposure').addEventListener('input', (event) => setStops(Number(event.target.value)));
  $('layout').addEventListener('click', () => setGrid(!state.grid));
  $('fit').addEventListener('click', fit);
  $('closer').addEventListener('click', () => zoomBy(1.25));
  $('farther').addEventListener('click', () => zoomBy(0.8));
  window.addEventListener('resize', () => { arrange(); fit(); });
  const wanted = new URLSearchParams(location.hash.slice(1));
  openScene(Math.min(scenes.length - 1, Math.max(0, Number(wanted.get('scene')) || 0)));
  if (wanted.get('pixel')) setPixel(...wanted.get('pixel').split(',').map(Number));
  if (legends[wanted.get('mode')] !== undefined) setMode(wanted.get('mode'));
})();
