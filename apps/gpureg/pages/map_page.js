// SPDX-License-Identifier: BSD-3-Clause
'use strict';
// The page of a map: figures, a WebGL view of points and graph, lists that highlight. No network.
const data = JSON.parse(document.getElementById('data').textContent);
const element = (id) => document.getElementById(id);
const state = {island: 0, colour: 'confidence', yaw: 0.7, pitch: 0.95, distance: 5, target: [0, 0, 0],
  chosen: null, upAxis: 0};
const kLow = [0.84, 0.27, 0.24], kMiddle = [0.93, 0.72, 0.2], kHigh = [0.36, 0.74, 0.55];

// ---- small linear algebra: column-major 4x4, as WebGL wants it
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const sum = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const unit = (a) => scaled(a, 1 / (Math.hypot(...a) || 1));
function product(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}
const kIdentity = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
function perspective(fov, aspect, near, far) {
  const f = 1 / Math.tan(fov / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1,
    0, 0, 2 * far * near / (near - far), 0]);
}
function lookAt(eye, right, up, back) {
  return new Float32Array([right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2],
    back[2], 0, -dot(right, eye), -dot(up, eye), -dot(back, eye), 1]);
}

// ---- colours
function ramp(value) {
  const t = Math.max(0, Math.min(1, value)) * 2, a = t < 1 ? kLow : kMiddle, b = t < 1 ? kMiddle : kHigh;
  return a.map((v, k) => v + (b[k] - v) * (t < 1 ? t : t - 1));
}
// Confidences crowd near 1: .5, .9 and .99 shall differ.
const confidenceColour = (c) => ramp(c < 0.5 ? 0 : 0.25 * Math.log2(1 / Math.max(1 - c, 1 / 32)) - 0.25);
function scanColour(k) {
  const hue = (k * 0.61803398875) % 1, f = (n) => {
    const x = (n + hue * 12) % 12;
    return 0.62 - 0.3 * Math.max(-1, Math.min(x - 3, 9 - x, 1));
  };
  return [f(0), f(8), f(4)];
}
const css = (c) => `rgb(${c.map((v) => Math.round(255 * v)).join()})`;

// ---- points: 3 x uint16 position within the island's box, 3 x int8 normal
const bytes = Uint8Array.from(atob(data.points), (c) => c.charCodeAt(0));
const kStride = 10;
const view16 = new DataView(bytes.buffer);
function pointAt(k, box) {
  return [0, 1, 2].map((a) => box.low[a] + box.size * view16.getUint16(kStride * k + 2 * a, true) / 65535);
}
const normalAt = (k) => [0, 1, 2].map((a) => view16.getInt8(kStride * k + 6 + a) / 127);

// The axes of floors, ceilings and walls: the dominant direction of the normals, twice more across.
// Buildings are flat, so "up" is the axis with the smallest extent, and floors outweigh ceilings.
function upAxes(island) {
  const points = [], normals = [];
  for (const s of data.scans) {
    if (s.island !== island) continue;
    for (let k = s.first; k < s.first + s.count; k += 7) {
      points.push(pointAt(k, data.islands[island]));
      normals.push(normalAt(k));
    }
  }
  const axes = [];
  for (let round = 0; round < 3 && normals.length > 0; ++round) {
    let best = null;
    for (let start = 0; start < normals.length; start += Math.max(1, Math.floor(normals.length / 60))) {
      let axis = unit(normals[start]), weight = 0;
      if (axes.some((a) => Math.abs(dot(a, axis)) > 0.3) || dot(axis, axis) < 0.5) continue;
      for (let step = 0; step < 3; ++step) {
        let mean = [0, 0, 0];
        weight = 0;
        for (const n of normals) {
          const d = dot(n, axis);
          if (Math.abs(d) < 0.9) continue;
          mean = sum(mean, scaled(n, Math.sign(d)));
          ++weight;
        }
        if (weight > 0) axis = unit(mean);
      }
      if (!best || weight > best.weight) best = {axis, weight};
    }
    if (best) axes.push(best.axis);
  }
  if (axes.length === 0) axes.push([0, 0, 1]);
  const extent = (axis) => {
    const d = points.map((p) => dot(p, axis)).sort((a, b) => a - b);
    return d.length ? d[Math.floor(0.97 * d.length)] - d[Math.floor(0.03 * d.length)] : 0;
  };
  const order = axes.map((axis) => ({axis, extent: extent(axis)})).sort((a, b) => a.extent - b.extent);
  const out = [];
  for (const {axis} of order) {
    let up = 0;
    for (const n of normals) if (Math.abs(dot(n, axis)) > 0.9) up += Math.sign(dot(n, axis));
    out.push(scaled(axis, up < 0 ? -1 : 1));
  }
  return out.concat(out.map((a) => scaled(a, -1)));
}

// ---- WebGL
const canvas = element('canvas');
const gl = canvas.getContext('webgl', {antialias: true, preserveDrawingBuffer: true});
function program(vertex, fragment) {
  const out = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(out, shader);
  }
  gl.linkProgram(out);
  return {
    program: out, uniform: (name) => gl.getUniformLocation(out, name),
    attribute: (name) => gl.getAttribLocation(out, name)
  };
}
const kPointVertex = `
attribute vec3 position; attribute vec3 normal;
uniform mat4 camera, move; uniform vec3 low, eye, colour, up; uniform float size, pixels, spacing, through, byHeight, bottom, height;
varying vec3 shade;
vec3 rainbow(float t) { return clamp(vec3(1.5 - abs(4.0 * t - 3.0), 1.5 - abs(4.0 * t - 2.0), 1.5 - abs(4.0 * t - 1.0)), 0.12, 1.0); }
void main() {
  vec3 p = (move * vec4(low + size * position, 1.0)).xyz;
  vec3 n = mat3(move) * normal, toEye = eye - p;
  float facing = dot(n, toEye) / (length(n) * length(toEye) + 1e-6);
  gl_Position = camera * vec4(p, 1.0);
  gl_PointSize = clamp(pixels * spacing / gl_Position.w, 1.5, 14.0);
  bool known = dot(normal, normal) > 0.1;
  if (through > 0.5 && known && facing < -0.05) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  float light = known ? 0.42 + 0.58 * abs(facing) : 0.8;
  vec3 base = byHeight > 0.5 ? rainbow(clamp((dot(p, up) - bottom) / height, 0.0, 1.0)) : colour;
  shade = base * light;
}`;
const kPointFragment = 'precision mediump float; varying vec3 shade; void main() { gl_FragColor = vec4(shade, 1.0); }';
const kLineVertex = `attribute vec3 position; attribute vec3 tint; uniform mat4 camera; uniform float dots; varying vec3 shade;
void main() { gl_Position = camera * vec4(position, 1.0); gl_PointSize = dots; shade = tint; }`;
const kLineFragment = `precision mediump float; varying vec3 shade; uniform float round, opacity;
void main() { if (round > 0.5 && length(gl_PointCoord - 0.5) > 0.5) discard; gl_FragColor = vec4(shade, opacity); }`;

let points, lines, pointBuffer, lineBuffer;
const up = () => state.ups[state.upAxis % state.ups.length];
function basis() {
  const z = up(), x = unit(cross(Math.abs(z[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0], z)), y = cross(z, x);
  const level = sum(scaled(x, Math.cos(state.yaw)), scaled(y, Math.sin(state.yaw)));
  const back = sum(scaled(level, Math.cos(state.pitch)), scaled(z, Math.sin(state.pitch)));
  const right = unit(cross(z, level));
  return {right, up: cross(back, right), back};
}
function highlighted() {
  const c = state.chosen;
  if (!c) return null;
  return c.kind === 'scan' ? [c.scan] : c.kind === 'scans' ? c.scans : [c.edge.i, c.edge.j];
}
function colourOf(k, chosen) {
  if (chosen) {
    const at = chosen.indexOf(k);
    if (at < 0) return [0.3, 0.31, 0.33];
    return state.chosen.kind === 'edge' ? [[0.35, 0.65, 1], [1, 0.8, 0.25]][at] : [1, 0.8, 0.25];
  }
  return state.colour === 'confidence' ? confidenceColour(data.scans[k].confidence) : scanColour(k);
}
function drawPoints(camera, eye, box) {
  gl.useProgram(points.program);
  gl.bindBuffer(gl.ARRAY_BUFFER, pointBuffer);
  const position = points.attribute('position'), normal = points.attribute('normal');
  gl.enableVertexAttribArray(position);
  gl.enableVertexAttribArray(normal);
  gl.vertexAttribPointer(position, 3, gl.UNSIGNED_SHORT, true, kStride, 0);
  gl.vertexAttribPointer(normal, 3, gl.BYTE, true, kStride, 6);
  gl.uniformMatrix4fv(points.uniform('camera'), false, camera);
  gl.uniform3fv(points.uniform('low'), box.low);
  gl.uniform3fv(points.uniform('eye'), eye);
  gl.uniform3fv(points.uniform('up'), up());
  gl.uniform1f(points.uniform('size'), box.size);
  gl.uniform1f(points.uniform('pixels'), canvas.height);
  gl.uniform1f(points.uniform('through'), element('through').checked ? 1 : 0);
  const [bottom, height] = state.heights[state.upAxis % state.ups.length];
  gl.uniform1f(points.uniform('bottom'), bottom);
  gl.uniform1f(points.uniform('height'), height);
  const chosen = highlighted();
  const draw = (k, move, colour) => {
    gl.uniformMatrix4fv(points.uniform('move'), false, move);
    gl.uniform3fv(points.uniform('colour'), colour);
    gl.uniform1f(points.uniform('byHeight'), state.colour === 'height' && !chosen ? 1 : 0);
    gl.uniform1f(points.uniform('spacing'), 1.3 * data.scans[k].spacing);
    gl.drawArrays(gl.POINTS, data.scans[k].first, data.scans[k].count);
  };
  data.scans.forEach((s, k) => {
    if (s.island === state.island) draw(k, kIdentity, colourOf(k, chosen));
  });
  const edge = state.chosen && state.chosen.edge;
  if (edge && edge.moved) draw(edge.j, new Float32Array(edge.moved), [0.95, 0.3, 0.28]);
}
function drawGraph(camera) {
  const segments = [], knots = [], chosen = state.chosen;
  const place = (k) => data.scans[k].position;
  const add = (list, p, c) => list.push(...p, ...c);
  for (const e of data.edges) {
    const here = data.scans[e.i].island === state.island && data.scans[e.j].island === state.island;
    const mine = chosen && (chosen.edge === e || (chosen.kind === 'scan' && (e.i === chosen.scan || e.j === chosen.scan)));
    if (!here || (chosen ? !mine : !(e.accepted && element('graph').checked))) continue;
    const c = e.accepted ? confidenceColour(e.confidence) : [1, 0.25, 0.25];
    add(segments, place(e.i), c);
    add(segments, place(e.j), c);
  }
  if (element('graph').checked)
    data.scans.forEach((s, k) => {
      if (s.island === state.island) add(knots, place(k), chosen && !highlighted().includes(k) ? [0.5, 0.5, 0.5] : [1, 1, 1]);
    });
  gl.useProgram(lines.program);
  gl.bindBuffer(gl.ARRAY_BUFFER, lineBuffer);
  const position = lines.attribute('position'), tint = lines.attribute('tint');
  gl.enableVertexAttribArray(position);
  gl.enableVertexAttribArray(tint);
  gl.uniformMatrix4fv(lines.uniform('camera'), false, camera);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  for (const [list, mode, dots] of [[segments, gl.LINES, 1], [knots, gl.POINTS, 8]]) {
    gl.uniform1f(lines.uniform('opacity'), mode === gl.LINES && !chosen ? 0.55 : 1);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(list), gl.DYNAMIC_DRAW);
    gl.vertexAttribPointer(position, 3, gl.FLOAT, false, 24, 0);
    gl.vertexAttribPointer(tint, 3, gl.FLOAT, false, 24, 12);
    gl.uniform1f(lines.uniform('dots'), dots * devicePixelRatio);
    gl.uniform1f(lines.uniform('round'), mode === gl.POINTS ? 1 : 0);
    gl.drawArrays(mode, 0, list.length / 6);
  }
  gl.disable(gl.BLEND);
}
function draw() {
  if (!gl || data.islands.length === 0) return;
  const width = Math.round(canvas.clientWidth * devicePixelRatio), height = Math.round(canvas.clientHeight * devicePixelRatio);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
  gl.viewport(0, 0, width, height);
  gl.clearColor(0.114, 0.125, 0.141, 1);
  gl.enable(gl.DEPTH_TEST);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  const b = basis(), eye = sum(state.target, scaled(b.back, state.distance));
  const camera = product(perspective(0.7, width / Math.max(1, height), state.distance / 100, state.distance * 20),
    lookAt(eye, b.right, b.up, b.back));
  drawPoints(camera, eye, data.islands[state.island]);
  gl.disable(gl.DEPTH_TEST);
  drawGraph(camera);
}
let asked = false;
function redraw() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => { asked = false; draw(); });
}
// Target and distance that show the whole island.
function fit() {
  const box = data.islands[state.island], b = basis();
  const corners = [];
  for (const s of data.scans)
    if (s.island === state.island)
      for (let k = s.first; k < s.first + s.count; k += 31) corners.push(pointAt(k, box));
  const middle = (axis) => {
    const d = corners.map((p) => dot(p, axis)).sort((a, c) => a - c);
    return ((d[Math.floor(0.005 * d.length)] || 0) + (d[Math.floor(0.995 * (d.length - 1))] || 0)) / 2;
  };
  const axes = [b.right, b.up, b.back];
  const aspect = canvas.clientWidth / Math.max(1, canvas.clientHeight), slope = Math.tan(0.35) * 0.9;
  state.target = axes.reduce((at, axis) => sum(at, scaled(axis, middle(axis))), [0, 0, 0]);
  // Twice: the near side takes more of the picture than the far side, so the middle moves.
  for (let round = 0; round < 2; ++round) {
    const seen = corners.map((p) => axes.map((axis) => dot(sub(p, state.target), axis)));
    const needed = seen.map(([x, y, z]) => Math.max(Math.abs(x) / aspect, Math.abs(y)) / slope + z).sort((p, q) => p - q);
    state.distance = needed[Math.floor(0.999 * (needed.length - 1))] || 1;
    if (round > 0) break;
    for (const k of [0, 1]) {
      const shares = seen.map((p) => p[k] / (state.distance - p[2])).sort((p, q) => p - q);
      const shift = (shares[Math.floor(0.005 * shares.length)] + shares[Math.floor(0.995 * (shares.length - 1))]) / 2 || 0;
      state.target = sum(state.target, scaled(axes[k], shift * state.distance));
    }
  }
  redraw();
}
function chooseIsland(k) {
  state.island = k;
  state.upAxis = 0;
  state.ups = upAxes(k);
  state.heights = state.ups.map((axis) => {
    const d = [];
    for (const s of data.scans)
      if (s.island === k)
        for (let n = s.first; n < s.first + s.count; n += 31) d.push(dot(pointAt(n, data.islands[k]), axis));
    d.sort((a, b) => a - b);
    const low = d[Math.floor(0.01 * d.length)] || 0, high = d[Math.floor(0.99 * (d.length - 1))] || 1;
    return [low, Math.max(high - low, 1e-6)];
  });
  element('island').value = String(k);
  fit();
}

// ---- figures and lists
const fixed = (v, digits) => v.toFixed(digits);
const probability = (v) => v >= 0.9995 ? '> 0.999' : fixed(v, 3);
const grade = (c) => c >= 0.99 ? 'good' : c >= 0.9 ? 'fair' : 'bad';
function showFigures() {
  const f = data.figures, verdict = element('verdict');
  verdict.textContent = f.sentence;
  verdict.className = f.grade;
  const add = (value, label, grade) => {
    const box = document.createElement('div'), b = document.createElement('b'), text = document.createElement('span');
    b.textContent = value;
    if (grade) b.className = grade;
    text.textContent = label;
    box.append(b, text);
    element('figures').append(box);
  };
  add(`${f.placed} / ${f.scans}`, 'scans placed', f.placed === f.scans ? 'good' : f.placed === 0 ? 'bad' : 'fair');
  add(f.islands, f.islands === 1 ? 'island' : 'islands', f.islands === 1 ? 'good' : f.islands === 0 ? 'bad' : 'fair');
  add(f.accepted, 'edges accepted');
  add(f.rejected, 'edges rejected');
  if (f.weakest !== null) add(probability(f.weakest), 'confidence of the weakest connection', grade(f.weakest));
  if (f.rms !== null) add(`${fixed(1000 * f.rms, 1)} mm`, 'RMS distance of surfaces');
  if (f.points_shown < f.points) add(f.points_shown.toLocaleString('en'), `of ${f.points.toLocaleString('en')} points shown, evenly thinned`);
}
function list(title, entries, none, folded) {
  const aside = element('lists'), h = document.createElement('h2');
  h.textContent = `${title} (${entries.length})`;
  aside.append(h);
  if (entries.length === 0) {
    const p = document.createElement('p');
    p.className = 'none';
    p.textContent = none;
    aside.append(p);
    return;
  }
  const ul = document.createElement('ul');
  for (const e of entries) {
    const li = document.createElement('li');
    for (const [tag, text] of [['b', e.name], ['span', e.text], ['em', e.value]]) {
      const part = document.createElement(tag);
      part.textContent = text;
      if (tag === 'b') part.title = text;
      if (tag === 'em') part.style.color = e.colour || '';
      li.append(part);
    }
    li.onclick = () => choose(e, li);
    ul.append(li);
  }
  if (!folded) return aside.append(ul);
  const details = document.createElement('details'), summary = document.createElement('summary');
  summary.textContent = 'show';
  details.append(summary, ul);
  aside.append(details);
}
function choose(entry, li) {
  const again = li.classList.contains('on');
  document.querySelectorAll('li.on').forEach((other) => other.classList.remove('on'));
  state.chosen = null;
  if (!again) {
    li.classList.add('on');
    state.chosen = entry.choice;
    const shown = highlighted().map((k) => data.scans[k].island).find((island) => island !== null);
    if (shown !== undefined && shown !== state.island) chooseIsland(shown);
  }
  element('tip').textContent = again ? '' : entry.tip || '';
  redraw();
}
function showLists() {
  const name = (k) => data.scans[k].name;
  const value = (c) => ({value: probability(c), colour: css(confidenceColour(c).map((v) => 0.8 * v))});
  list('Scans left out', data.scans.flatMap((s, k) => s.island === null ? [{name: s.name, text: s.reason,
    value: '', choice: {kind: 'scan', scan: k}, tip: `scan ${s.name}: ${s.reason}`}] : []), 'None.');
  const noted = data.scans.flatMap((s, k) => s.island !== null && s.reason ? [{name: s.name, text: s.reason,
    value: '', choice: {kind: 'scan', scan: k}, tip: s.reason}] : []);
  if (noted.length) list('Scans without confirmation', noted);
  list('Weakest connections', data.links.map((l) => ({name: l.scans.length > 4 ? `${l.scans.slice(0, 2).map(name).join(', ')} and ${l.scans.length - 2} more` : l.scans.map(name).join(', '),
    text: `${l.accepted} edge${l.accepted === 1 ? '' : 's'}` + (l.rejected ? `, ${l.rejected} rejected` : ''), ...value(l.confidence), choice: {kind: 'scans', scans: l.scans},
    tip: 'yellow: the part that this connection holds'})), 'None.');
  const edges = (accepted) => data.edges.filter((e) => e.accepted === accepted).sort((a, b) => accepted ? a.confidence - b.confidence : b.confidence - a.confidence)
    .map((e) => ({name: `${name(e.i)} \u2013 ${name(e.j)}`, text: e.reason, ...value(e.confidence), choice: {kind: 'edge', edge: e},
      tip: `blue: scan ${name(e.i)}, yellow: scan ${name(e.j)}` + (e.moved ? ', red: the scan where this edge puts it' : '')}));
  list('Rejected edges', edges(false), 'None.');
  list('Accepted edges, the least confident first', edges(true), 'None.', true);
  list('Scans', data.scans.flatMap((s, k) => s.island === null ? [] : [{name: s.name, text: '', ...value(s.confidence),
    choice: {kind: 'scan', scan: k}, tip: `scan ${s.name} and its edges`}]), 'None.', true);
}
function showLegend() {
  const legend = element('legend');
  const scale = (colours, low, high) => {
    legend.innerHTML = '';
    const bar = document.createElement('i');
    bar.style.background = `linear-gradient(90deg, ${colours.map(css).join()})`;
    legend.append(low, bar, high);
  };
  const edges = [0.5, 0.75, 0.9, 0.97].map(confidenceColour);
  if (state.colour === 'height') scale([[0.12, 0.12, 1], [0.12, 1, 0.5], [1, 0.5, 0.12]], 'low', 'high');
  else scale(edges, `confidence of ${state.colour === 'confidence' ? 'scans and ' : ''}edges: 0.5`, '0.97 and above');
}

// ---- mouse, wheel, fingers
function listen() {
  const pointers = new Map();
  canvas.onpointerdown = (e) => { canvas.setPointerCapture(e.pointerId); pointers.set(e.pointerId, e); };
  canvas.onpointerup = canvas.onpointercancel = (e) => pointers.delete(e.pointerId);
  canvas.oncontextmenu = (e) => e.preventDefault();
  canvas.onpointermove = (e) => {
    const before = pointers.get(e.pointerId);
    if (!before) return;
    const dx = e.clientX - before.clientX, dy = e.clientY - before.clientY;
    const other = [...pointers.values()].find((p) => p.pointerId !== e.pointerId);
    pointers.set(e.pointerId, e);
    if (other) {
      const gap = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
      state.distance *= gap(before) / gap(e);
    }
    if (other || e.shiftKey || e.buttons & 6) {
      const b = basis(), metres = state.distance * 0.73 / canvas.clientHeight * (other ? 0.5 : 1);
      state.target = sum(state.target, sum(scaled(b.right, -dx * metres), scaled(b.up, dy * metres)));
    } else {
      state.yaw -= dx * 0.008;
      state.pitch = Math.max(-1.57, Math.min(1.57, state.pitch + dy * 0.008));
    }
    redraw();
  };
  canvas.addEventListener('wheel', (e) => {
    e.preventDefault();
    state.distance *= Math.exp(0.0012 * e.deltaY);
    redraw();
  }, {passive: false});
  canvas.ondblclick = fit;
  element('island').onchange = (e) => chooseIsland(Number(e.target.value));
  element('colour').onchange = (e) => { state.colour = e.target.value; showLegend(); redraw(); };
  element('through').onchange = element('graph').onchange = redraw;
  element('top').onclick = () => { state.pitch = 1.57; fit(); };
  element('side').onclick = () => { state.pitch = 0.25; fit(); };
  element('up').onclick = () => { ++state.upAxis; fit(); };
  addEventListener('resize', redraw);
}

showFigures();
showLists();
showLegend();
data.islands.forEach((island, k) => {
  const option = document.createElement('option');
  option.value = String(k);
  option.textContent = `island ${k + 1}: ${island.scans} scans`;
  element('island').append(option);
});
element('island').style.display = data.islands.length > 1 ? '' : 'none';
if (gl && data.islands.length > 0) {
  points = program(kPointVertex, kPointFragment);
  lines = program(kLineVertex, kLineFragment);
  pointBuffer = gl.createBuffer();
  lineBuffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, pointBuffer);
  gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.STATIC_DRAW);
  // For links: map.html#colour=height&pitch=0.3&island=1
  const wanted = new URLSearchParams(location.hash.slice(1));
  for (const key of ['yaw', 'pitch']) if (wanted.has(key)) state[key] = Number(wanted.get(key));
  if (wanted.has('colour')) element('colour').value = state.colour = wanted.get('colour');
  listen();
  showLegend();
  chooseIsland(Math.min(Number(wanted.get('island') || 0), data.islands.length - 1));
} else {
  const text = document.createElement('p');
  text.id = 'failed';
  text.textContent = gl ? 'No scan could be placed.' : 'This browser shows no WebGL; the figures and lists are complete.';
  element('view').replaceChildren(text);
}
