'use strict';
// Colours of maps that are told apart by all kinds of sight and in grey: each rises in lightness.
window.LUCERNA_COLORS = (() => {
  // Every eighth of the way from black over violet and orange to pale yellow.
  const stops = [[0, 0, 4], [28, 16, 68], [79, 18, 123], [129, 37, 129], [181, 54, 122], [229, 80, 100], [251, 135, 97], [254, 194, 135], [252, 253, 191]];
  const ramp = (t, out, o) => {
    const x = Math.min(1, Math.max(0, t)) * 8, i = Math.min(7, Math.floor(x)), f = x - i;
    for (let c = 0; c < 3; c++) out[o + c] = stops[i][c] + f * (stops[i + 1][c] - stops[i][c]);
  };
  // Orange for more, blue for less, black for the same.
  const signed = (d, out, o) => {
    const x = Math.min(1, Math.abs(d)) ** 0.7, end = d > 0 ? [255, 150, 20] : [60, 150, 255];
    for (let c = 0; c < 3; c++) out[o + c] = x * end[c];
  };
  const srgb = (v) => { const x = Math.min(1, Math.max(0, v)); return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055); };
  const css = (t) => { const c = [0, 0, 0]; ramp(t, c, 0); return `rgb(${c.map(Math.round)})`; };
  return { ramp, signed, srgb, css };
})();
