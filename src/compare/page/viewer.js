'use strict';
// All panels share one place, zoom, exposure and mode. Pictures are float values, loaded when a scene is shown.
(() => {
  const scenes = window.LUCERNA_SCENES, colors = window.LUCERNA_COLORS;
  const $ = (id) => document.getElementById(id);
  // `image` is A, `other` is B; `layout` is grid, one or slide.
  const state = { scene: 0, image: 1, other: 0, mode: 'image', stops: 0, layout: 'grid', wipe: 0.5, zoom: 1, x: 0, y: 0, pixel: null, place: -1 };
  const pictures = new Map(); // "scene-image" -> { values, flip }
  const MODES = ['image', 'difference', 'relative', 'flip'];
  let panels = [];
  const scene = () => scenes[state.scene];
  const key = (image) => `${state.scene}-${image}`;
  const values = (image) => pictures.get(key(image))?.values;
  const flips = (image) => { const map = pictures.get(key(image))?.flip; return map && map.length ? map : null; };
  const shown = () => panels.filter((_, i) => state.layout === 'grid' || i === state.image);

  function decoded(text) {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return new Float32Array(bytes.buffer);
  }
  window.LUCERNA_PICTURE = (name, text, map) => {
    pictures.set(name, { values: decoded(text), flip: decoded(map) });
    const [number, image] = name.split('-').map(Number);
    if (number !== state.scene) return;
    if (image === 0) repaint(); else paintImage(image);
    draw(); tell();
  };

  function make(tag, text, props) {
    const element = document.createElement(tag);
    if (text !== undefined) element.textContent = text;
    return Object.assign(element, props);
  }

  function openScene(number) {
    state.scene = number;
    $('scene').value = number;
    const { images, places } = scene();
    state.image = Math.min(state.image, images.length - 1);
    state.other = Math.min(state.other, images.length - 1);
    Object.assign(state, { pixel: null, place: -1 });
    $('tabs').replaceChildren(...images.map((name, i) => make('button', `${i} ${name}`, { type: 'button', onclick: () => choose(i) })));
    for (const id of ['a', 'b']) $(id).replaceChildren(...images.map((name, i) => new Option(name, i)));
    $('places').replaceChildren(...places.map((_, i) => make('button', `Place ${i + 1}`, { type: 'button', onclick: () => goTo(i) })));
    panels = images.map((name, i) => {
      const element = make('div', undefined, { className: 'panel' }), canvas = make('canvas'), label = make('b', name), right = make('b', '', { className: 'right' });
      element.append(canvas, label, right);
      listen(element);
      const own = make('canvas');
      [own.width, own.height] = scene().size;
      return { element, canvas, own, label, right, image: i };
    });
    $('panels').replaceChildren(...panels.map((p) => p.element));
    images.forEach((_, i) => {
      if (values(i)) return;
      const script = make('script', undefined, { src: `data/${key(i)}.js` });
      script.onerror = () => { panels[i].label.textContent += ' (cannot be loaded)'; };
      document.head.append(script);
    });
    arrange(); fit(); repaint(); tell();
  }

  function arrange() {
    const grid = state.layout === 'grid', slide = state.layout === 'slide';
    $('compared').hidden = !slide;
    const count = panels.length, box = $('panels').getBoundingClientRect(), [w, h] = scene().size;
    let columns = 1;
    if (grid) {
      // The number of columns that shows the pictures largest.
      let best = 0;
      for (let c = 1; c <= count; c++) {
        const scale = Math.min(box.width / c / w, box.height / Math.ceil(count / c) / h);
        if (scale > best) { best = scale; columns = c; }
      }
    }
    $('panels').style.gridTemplateColumns = `repeat(${columns}, 1fr)`;
    $('panels').style.gridTemplateRows = `repeat(${grid ? Math.ceil(count / columns) : 1}, 1fr)`;
    const visible = shown();
    panels.forEach((p) => {
      p.element.style.display = visible.includes(p) ? '' : 'none';
      p.right.textContent = slide ? scene().images[state.other] : '';
    });
    [...$('tabs').children].forEach((tab, i) => tab.setAttribute('aria-pressed', String(i === state.image)));
    for (const id of ['grid', 'one', 'slide']) $(id).setAttribute('aria-pressed', String(state.layout === id));
    $('a').value = state.image; $('b').value = state.other; $('wipe').value = state.wipe;
  }

  // What a map shows of pixel p of a picture: the mean difference, the relative squared error, FLIP.
  function measure(mode, image, p) {
    const v = values(image), r = values(0);
    if (image === 0 || !v || !r) return null;
    if (mode === 'flip') return flips(image) ? flips(image)[p] : null;
    let d = 0, e = 0;
    for (let c = 3 * p; c < 3 * p + 3; c++) {
      const x = v[c] - r[c];
      d += x / 3;
      e += x * x / (r[c] * r[c] + 0.01) / 3;
    }
    return mode === 'difference' ? d : e;
  }

  function paintImage(image) {
    const v = values(image), panel = panels[image];
    if (!v || !panel) return;
    const [w, h] = scene().size, context = panel.own.getContext('2d'), data = context.createImageData(w, h), out = data.data;
    const stops = 2 ** state.stops, gain = scene().exposure * stops, { mode } = state, maps = image > 0 && mode !== 'image' && values(0);
    for (let p = 0, o = 0; p < w * h; p++, o += 4) {
      out[o + 3] = 255;
      if (!maps) for (let c = 0; c < 3; c++) out[o + c] = colors.srgb(v[3 * p + c] * gain);
      else if (mode === 'difference') colors.signed(measure(mode, image, p) * gain * 4, out, o);
      else if (mode === 'relative') colors.ramp(Math.sqrt(measure(mode, image, p)) * stops, out, o);
      else colors.ramp(measure(mode, image, p) * stops, out, o);
    }
    context.putImageData(data, 0, 0);
  }
  const legends = {
    difference: ['less', 'more', 'Difference to the reference: orange is brighter, blue darker, black equal.'],
    relative: ['0', '1', 'Square root of each pixel’s relative squared error.'],
    flip: ['0', '1', 'HDR-FLIP: how different a pixel looks, flipping between picture and reference.'],
  };
  function repaint() {
    panels.forEach((_, i) => paintImage(i));
    const legend = legends[state.mode];
    $('legend').hidden = !legend;
    if (legend) {
      const side = (x) => { const c = [0, 0, 0]; colors.signed(x, c, 0); return `rgb(${c.map(Math.round)})`; };
      const steps = [...Array(17).keys()].map((i) => (state.mode === 'difference' ? side(i / 8 - 1) : colors.css(i / 16)));
      $('scale').style.background = `linear-gradient(to right, ${steps.join(', ')})`;
      const end = state.mode === 'difference' ? 0.25 / scene().exposure : 1, most = (end / 2 ** state.stops).toPrecision(2);
      $('meaning').textContent = `${state.mode === 'difference' ? `−${most}` : 0} … ${most}. ${legend[2]}`;
    }
    draw();
  }

  function draw() {
    for (const panel of shown()) {
      const box = panel.element.getBoundingClientRect();
      if (!box.width) continue;
      const scale = window.devicePixelRatio || 1, { canvas } = panel;
      const width = Math.round(box.width * scale), height = Math.round(box.height * scale);
      if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
      const context = canvas.getContext('2d'), [w, h] = scene().size, zoom = state.zoom * scale;
      const put = (own) => context.drawImage(own, width / 2 - state.x * zoom, height / 2 - state.y * zoom, w * zoom, h * zoom);
      context.clearRect(0, 0, width, height);
      context.imageSmoothingEnabled = zoom < 1;
      put(panel.own);
      if (state.layout === 'slide') {
        const at = Math.round(state.wipe * width);
        context.save();
        context.beginPath(); context.rect(at, 0, width - at, height); context.clip();
        context.clearRect(at, 0, width - at, height);
        put(panels[state.other].own);
        context.restore();
        context.fillStyle = '#fff'; context.fillRect(at - scale, 0, 2 * scale, height);
        context.beginPath(); context.arc(at, height / 2, 9 * scale, 0, 7); context.fill();
      }
      if (state.pixel) {
        const [px, py] = state.pixel;
        context.strokeStyle = '#ffd34d'; context.lineWidth = 1.5 * scale;
        context.strokeRect(width / 2 + (px - state.x) * zoom - 1, height / 2 + (py - state.y) * zoom - 1, zoom + 2, zoom + 2);
      }
    }
  }

  function show([left, top, w, h]) {
    const box = shown()[0].element.getBoundingClientRect();
    Object.assign(state, { x: left + w / 2, y: top + h / 2, zoom: Math.max(0.02, 0.98 * Math.min(box.width / w, box.height / h)) });
    draw();
  }
  function fit() { state.place = -1; show([0, 0, ...scene().size]); }
  function goTo(place) {
    const { places } = scene();
    if (!places.length) return;
    state.place = place % places.length;
    const [x, y, edge] = places[state.place];
    show([x, y, edge, edge]);
  }
  function zoomBy(factor, at) {
    const zoom = Math.min(200, Math.max(0.02, state.zoom * factor));
    if (at) { state.x += at[0] / state.zoom - at[0] / zoom; state.y += at[1] / state.zoom - at[1] / zoom; }
    state.zoom = zoom;
    draw();
  }
  function choose(image) {
    const chosen = (image + panels.length) % panels.length;
    if (chosen !== state.image) [state.image, state.other] = [chosen, state.image];
    arrange(); draw();
  }
  function chooseOther(image) { state.other = image; arrange(); draw(); }
  function setMode(mode) { state.mode = mode; $('mode').value = mode; repaint(); tell(); }
  function setStops(stops) {
    state.stops = Math.min(10, Math.max(-10, stops));
    $('exposure').value = state.stops;
    $('stops').textContent = (state.stops > 0 ? '+' : '') + state.stops;
    repaint();
  }
  function setWipe(wipe) { state.wipe = Math.min(1, Math.max(0, wipe)); $('wipe').value = state.wipe; draw(); }
  function setLayout(layout) { state.layout = layout; arrange(); fit(); }
  function setPixel(x, y) {
    const [w, h] = scene().size;
    state.pixel = [Math.min(w - 1, Math.max(0, x)), Math.min(h - 1, Math.max(0, y))];
    tell(); draw();
  }

  // Nine digits tell a float apart from all others.
  const digits = (v) => String(Number(v.toPrecision(9)));
  const short = (v) => (v === null || Number.isNaN(v) ? '' : v.toPrecision(3).replace('-', '−'));
  function tell() {
    const body = $('values').tBodies[0], head = $('values').tHead;
    if (!state.pixel) { body.replaceChildren(); head.replaceChildren(); return; }
    const [x, y] = state.pixel, p = y * scene().size[0] + x;
    $('where').textContent = `Pixel ${x}, ${y}`;
    const row = (cells, tag) => { const line = make('tr'); line.append(...cells.map((text, i) => make(i === 0 ? 'th' : tag, text))); return line; };
    head.replaceChildren(row(['', 'R', 'G', 'B', 'difference', 'relMSE', 'FLIP'], 'th'));
    body.replaceChildren(...scene().images.map((name, image) => {
      const v = values(image), maps = MODES.slice(1).map((mode) => measure(mode, image, p));
      if (maps[0] > 0) maps[0] = `+${short(maps[0])}`;
      return row([name, ...[0, 1, 2].map((c) => (v ? digits(v[3 * p + c]) : '…')), ...maps.map((m) => (typeof m === 'string' ? m : short(m)))], 'td');
    }));
  }

  function listen(element) {
    const place = (event) => {
      const box = element.getBoundingClientRect();
      return [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
    };
    const fingers = new Map();
    let sliding = false;
    element.addEventListener('wheel', (event) => { event.preventDefault(); zoomBy(Math.exp(-event.deltaY * 0.0015), place(event)); }, { passive: false });
    element.addEventListener('pointerdown', (event) => {
      try { element.setPointerCapture(event.pointerId); } catch { /* It was lifted meanwhile. */ }
      const at = place(event);
      fingers.set(event.pointerId, at);
      sliding = state.layout === 'slide' && Math.abs(at[0] - (state.wipe - 0.5) * element.clientWidth) < 14;
      $('panels').focus({ preventScroll: true });
    });
    element.addEventListener('pointermove', (event) => {
      const at = place(event), before = fingers.get(event.pointerId);
      if (before && sliding) setWipe(at[0] / element.clientWidth + 0.5);
      else if (before) {
        const other = [...fingers].find(([id]) => id !== event.pointerId);
        if (other) {
          const length = (a) => Math.hypot(a[0] - other[1][0], a[1] - other[1][1]);
          zoomBy(length(at) / Math.max(1, length(before)), other[1]);
        } else { state.x -= (at[0] - before[0]) / state.zoom; state.y -= (at[1] - before[1]) / state.zoom; draw(); }
      }
      if (before) fingers.set(event.pointerId, at);
      const [w, h] = scene().size, x = Math.floor(state.x + at[0] / state.zoom), y = Math.floor(state.y + at[1] / state.zoom);
      if (x >= 0 && y >= 0 && x < w && y < h) setPixel(x, y);
    });
    for (const end of ['pointerup', 'pointercancel']) element.addEventListener(end, (event) => { fingers.delete(event.pointerId); sliding = false; });
    element.addEventListener('dblclick', fit);
  }

  const step = (dx, dy) => { const [w, h] = scene().size, [x, y] = state.pixel || [w >> 1, h >> 1]; setPixel(x + dx, y + dy); };
  const move = (dx, dy) => { state.x += dx * 40 / state.zoom; state.y += dy * 40 / state.zoom; draw(); };
  const keys = {
    ArrowLeft: (s) => (s ? move(-1, 0) : choose(state.image - 1)), ArrowRight: (s) => (s ? move(1, 0) : choose(state.image + 1)),
    ArrowUp: (s) => s && move(0, -1), ArrowDown: (s) => s && move(0, 1),
    g: () => setLayout('grid'), o: () => setLayout('one'), b: () => setLayout('slide'), x: () => choose(state.other),
    '[': () => setWipe(state.wipe - 0.05), ']': () => setWipe(state.wipe + 0.05),
    f: fit, c: () => goTo(state.place + 1), '+': () => zoomBy(1.25), '=': () => zoomBy(1.25), '-': () => zoomBy(0.8),
    m: () => setMode(MODES[(MODES.indexOf(state.mode) + 1) % MODES.length]),
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
  const on = (id, type, act) => $(id).addEventListener(type, (event) => act(event.target.value));
  on('scene', 'change', (v) => openScene(Number(v)));
  on('mode', 'change', setMode);
  on('exposure', 'input', (v) => setStops(Number(v)));
  on('wipe', 'input', (v) => setWipe(Number(v)));
  on('a', 'change', (v) => { state.image = Number(v); arrange(); draw(); });
  on('b', 'change', (v) => chooseOther(Number(v)));
  on('swap', 'click', () => choose(state.other));
  for (const layout of ['grid', 'one', 'slide']) on(layout, 'click', () => setLayout(layout));
  on('fit', 'click', fit);
  on('closer', 'click', () => zoomBy(1.25));
  on('farther', 'click', () => zoomBy(0.8));
  window.addEventListener('resize', () => { arrange(); if (state.place < 0) fit(); else goTo(state.place); });
  const wanted = new URLSearchParams(location.hash.slice(1));
  openScene(Math.min(scenes.length - 1, Math.max(0, Number(wanted.get('scene')) || 0)));
  if (['grid', 'one', 'slide'].includes(wanted.get('layout'))) setLayout(wanted.get('layout'));
  if (wanted.get('place')) goTo(Number(wanted.get('place')));
  if (wanted.get('pixel')) setPixel(...wanted.get('pixel').split(',').map(Number));
  if (MODES.includes(wanted.get('mode'))) setMode(wanted.get('mode'));
})();
