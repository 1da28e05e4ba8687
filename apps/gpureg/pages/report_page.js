// SPDX-License-Identifier: BSD-3-Clause
'use strict';
// The page of batches: numbers, plots and pictures of each result, and a comparison of several. No network.
const results = JSON.parse(document.getElementById('data').textContent);
const kGreen = '#2f9e5b', kRed = '#d6453d', kBlue = '#268be6', kAmber = '#e39a12';
const kColours = [kBlue, kAmber, kGreen, kRed, '#7d5bbe', '#17a2a2', '#c24f94', '#8a6d3b', '#6b7785', '#9aa51b'];
// Longer tables start folded: a scene of the benchmark has more than a thousand pairs.
const kMaxUnfoldedRows = 100;

const isObject = (v) => v !== null && typeof v === 'object' && !Array.isArray(v);
const textOf = (v) => v === undefined ? '' : typeof v === 'string' ? v : JSON.stringify(v);
const fixed = (v, digits) => typeof v === 'number' ? v.toFixed(digits) : '';
const significant = (v) => String(Number(v.toPrecision(3)));
const percent = (v) => fixed(100 * v, 1);
const counted = (n, one) => `${n} ${one}${n === 1 ? '' : 's'}`;
const mean = (values) => values.length ? values.reduce((a, b) => a + b, 0) / values.length : 0;

// ---- elements
function make(tag, attributes, ...children) {
  const out = document.createElementNS((kSvgTags.has(tag) ? document.getElementById('none') : document.body).namespaceURI, tag);
  for (const [name, value] of Object.entries(attributes)) if (value !== '') out.setAttribute(name, String(value));
  out.append(...children.map((child) => typeof child === 'number' ? String(child) : child));
  return out;
}
const kSvgTags = new Set(['svg', 'line', 'rect', 'text', 'polyline', 'circle']);
const add = (...elements) => document.body.append(...elements.filter((e) => e !== null));
const title = (text) => make('h2', {}, text);
const note = (text) => make('p', {class: 'sub'}, text);
const row = (cells, tag = 'td', style = '') => make('tr', {class: style}, ...cells.map((cell) => make(tag, {}, cell)));
const table = (heads, rows, style = '') => make('table', {class: style}, row(heads, 'th'), ...rows);
const figure = (caption, content) => make('figure', {}, make('figcaption', {}, caption), content);
const wide = (content) => make('div', {class: 'wide'}, content);
const beside = (...figures) => make('div', {class: 'row'}, ...figures);
function folded(summary, open, ...content) {
  return make('details', open ? {open: 'open'} : {}, make('summary', {}, summary), ...content);
}

// ---- plots: size and margins around the axes, in pixels
const kWidth = 460, kHeight = 320, kLeft = 52, kTop = 14, kSpanX = kWidth - kLeft - 14, kSpanY = kHeight - kTop - 46;
const kTicks = [0, 0.2, 0.4, 0.6, 0.8, 1];
const within = (v) => Math.max(0, Math.min(1, v));
const px = (x) => kLeft + kSpanX * within(x), py = (y) => kTop + kSpanY * (1 - within(y));
const drawing = (width, height) => make('svg', {viewBox: `0 0 ${width} ${height}`, width, height, role: 'img'});
const line = (x1, y1, x2, y2, style = {stroke: '#e4e4de'}) => make('line', {x1, y1, x2, y2, ...style});
const box = (x, y, width, height, fill) => make('rect', {x, y, width, height, fill});
const label = (x, y, anchor, text, more = {}) => make('text', {x, y, 'text-anchor': anchor, ...more}, text);
const legend = (x, y, colour, name) => [box(x, y - 9, 11, 11, colour), label(x + 17, y, 'start', name)];
function axes(svg, xTitle, yTitle) {
  const middle = kTop + kSpanY / 2;
  svg.append(label(kLeft + kSpanX / 2, kHeight - 8, 'middle', xTitle),
    label(14, middle, 'middle', yTitle, {transform: `rotate(-90 14 ${middle})`}));
  return svg;
}
// Curves of [recall, precision]; the dot is the run itself.
function curvePlot(curves) {
  const svg = drawing(kWidth, kHeight);
  for (const at of kTicks)
    svg.append(line(px(at), py(0), px(at), py(1)), line(px(0), py(at), px(1), py(at)),
      label(px(at), py(0) + 17, 'middle', fixed(100 * at, 0)), label(px(0) - 7, py(at) + 4, 'end', fixed(100 * at, 0)));
  curves.forEach(({name, colour, scores}, k) => svg.append(
    make('polyline', {fill: 'none', 'stroke-width': 2, stroke: colour, points: scores.curve.map(([x, y]) => `${px(x)},${py(y)}`).join(' ')}),
    make('circle', {r: 4.5, cx: px(scores.recall), cy: py(scores.precision), fill: colour}),
    ...legend(px(0) + 12, py(0) - 12 - 18 * (curves.length - 1 - k), colour, name)));
  return axes(svg, 'recall in %', 'precision in %');
}
// Stacked histograms of values in [0, 1]; other values count in the first or last bin.
function histogram(populations, threshold) {
  const kBins = 25, svg = drawing(kWidth, kHeight), sums = new Array(kBins).fill(0);
  const counts = populations.map(({values}) => {
    const count = new Array(kBins).fill(0);
    for (const value of values) {
      const bin = Math.floor(Math.max(0, Math.min(kBins - 1, value * kBins)));
      ++count[bin];
      ++sums[bin];
    }
    return count;
  });
  const most = Math.max(1, ...sums), highest = 1.3 * most;  // space for the legend and the threshold's label
  for (const at of kTicks) svg.append(label(px(at), py(0) + 17, 'middle', fixed(at, 1)));
  // About four ticks, at integers: the axis counts pairs.
  for (let count = 0; count <= most; count += Math.max(1, Math.ceil(most / 4)))
    svg.append(line(px(0), py(count / highest), px(1), py(count / highest)), label(px(0) - 7, py(count / highest) + 4, 'end', fixed(count, 0)));
  for (let bin = 0; bin < kBins; ++bin) {
    let below = 0;
    populations.forEach(({colour}, k) => {
      const top = below + counts[k][bin];
      if (top > below) svg.append(box(px(bin / kBins) + 0.5, py(top / highest), kSpanX / kBins - 1, py(below / highest) - py(top / highest), colour));
      below = top;
    });
  }
  if (typeof threshold === 'number')
    svg.append(line(px(threshold), py(0), px(threshold), py(1), {stroke: '#555', 'stroke-dasharray': '4 3'}),
      label(px(threshold) + 5, py(1) + 10, 'start', 'reporting threshold'));
  populations.forEach(({name, colour, values}, k) => svg.append(...legend(px(1) - 130, py(1) + 28 + 18 * k, colour, `${name} (${values.length})`)));
  return axes(svg, 'confidence', 'pairs');
}
// Mean milliseconds of each stage, in the order of their first appearance. Programs have stages of their own; "total" is none.
function stageBars(objects, colour) {
  const kRow = 24, kName = 150, kValue = 80, kLeastShown = 0.01, sums = new Map();
  for (const ms of objects)
    for (const [name, value] of Object.entries(ms))
      if (name !== 'total' && typeof value === 'number') sums.set(name, (sums.get(name) || 0) + value / objects.length);
  const longest = Math.max(1e-12, ...sums.values()), svg = drawing(kWidth, kRow * sums.size + 8);
  [...sums].forEach(([name, value], k) => {
    const y = 4 + kRow * k, length = (kWidth - kName - kValue) * Math.max(0, value) / longest;
    svg.append(label(kName - 8, y + 16, 'end', name), box(kName, y + 3, Math.max(length, 1), kRow - 6, colour),
      label(kName + length + 6, y + 16, 'start', `${value < kLeastShown ? '< 0.01' : significant(value)} ms`));
  });
  return svg;
}

// ---- one result
function facts(r) {
  const o = r.options || {}, e = r.environment || {}, effort = o.method === 'quadruples' ? textOf(o.quadruples) : textOf(o.quality);
  const fact = (before, value, after = '') => textOf(value) === '' ? '' : before + textOf(value) + after;
  return [fact('gpureg ', e.version) + fact(' on ', e.description), fact('voxel size ', o.voxel_size),
    effort === '' ? '' : o.method === 'quadruples' ? `${effort} hypotheses per pair` : `quality ${effort}`,
    fact('random seed ', o.seed)].filter((text) => text !== '').join(' \u00b7 ');
}
const aligned = (r) => r.pairs.filter((pair) => pair.aligned);
const pairTime = (r) => mean(r.pairs.map((pair) => pair.milliseconds));
const fragmentTime = (r) => mean(r.fragments.map((ms) => ms.total || 0));
function summary(r) {
  const reported = aligned(r).length, reasons = new Map();
  for (const pair of r.pairs) if (!pair.aligned) reasons.set(pair.reason, (reasons.get(pair.reason) || 0) + 1);
  const others = [...reasons].sort((a, b) => b[1] - a[1]).map(([reason, n]) => `${n} ${reason}`).join(', ');
  return `${counted(r.pairs.length, 'pair')} of ${r.fragment_count} fragments were tried, ${reported} reported as aligned. ` +
    (others ? `${r.pairs.length - reported} are not: ${others}. ` : '') +
    `A pair took ${significant(pairTime(r))} ms on average, the preparation of a fragment ${significant(fragmentTime(r))} ms` +
    (typeof r.peak_memory_mib === 'number' ? `; peak memory ${fixed(r.peak_memory_mib, 0)} MiB.` : '.');
}
const rules = (r) => ['strict', 'geometric'].filter((rule) => r.evaluation && r.evaluation[rule]);
function scoreTable(r) {
  const heads = ['rule', 'correct', 'true pairs', 'reported', 'recall, %', 'precision, %', 'raw recall, %', 'R@P50, %',
    'R@P80, %', 'R@P95, %', 'R@P99, %', 'AP, %'];
  return [title('Recall and precision'), wide(table(heads, rules(r).map((rule) => {
    const s = r.evaluation[rule], at = s.recall_at_precision;
    return row([rule, s.good, s.ground_truth, s.reported, percent(s.recall), percent(s.precision),
      ...(at ? [s.raw_recall, at[50], at[80], at[95], at[99], s.average_precision].map(percent) : [])]);
  }))), note('Redwood\'s protocol, pairs with j \u2212 i > 1. A pose is correct within 0.2 m of the ground truth. The strict rule counts a ' +
    'pair that overlaps by less than 30 % as false; the geometric rule counts it by its pose. Raw recall: recall when every best ' +
    'candidate is reported. R@P80: recall at 80 % precision. AP: average precision.')];
}
function confidencePlot(r, evaluated) {
  const candidates = r.pairs.filter((pair) => pair.has_pose && (!evaluated || 'correct' in pair));
  const confidences = (wanted) => candidates.filter(wanted).map((pair) => pair.confidence);
  return figure('Confidence of the best candidates', histogram(evaluated ? [
    {name: 'correct', colour: kGreen, values: confidences((pair) => pair.correct)},
    {name: 'false', colour: kRed, values: confidences((pair) => !pair.correct)}] : [
    {name: 'reported', colour: kBlue, values: confidences((pair) => pair.aligned)},
    {name: 'not reported', colour: kAmber, values: confidences((pair) => !pair.aligned)}], r.options && r.options.min_confidence));
}
// Of pairs that the protocol evaluates; empty for those that were not reported and are not listed in gt.log.
const outcome = (pair) => pair.aligned ? pair.correct ? 'correct' : 'false positive' : pair.in_truth ? 'missed' : '';
function pairTable(r, unfolded) {
  const evaluated = r.pairs.some((pair) => 'correct' in pair);
  const count = (pair, name) => {
    const value = isObject(pair.statistics) ? pair.statistics[name] : undefined;
    return typeof value === 'number' ? value.toLocaleString('en') : textOf(value);
  };
  const rows = [...r.pairs].sort((a, b) => b.confidence - a.confidence).map((pair) => {
    const how = 'correct' in pair ? outcome(pair) : '';
    return row([pair.i, pair.j, pair.status, pair.aligned ? '' : pair.reason, fixed(pair.confidence, 3), fixed(pair.inlier_rmse, 4),
      ...['correspondences', 'survivors', 'scored', 'inliers'].map((name) => count(pair, name)), fixed(pair.milliseconds, 1),
      ...(evaluated ? [how] : [])], 'td', how);
  });
  const heads = ['target i', 'source j', 'status', 'reason', 'confidence', 'rmse', 'matches', 'survivors', 'scored', 'inliers', 'ms',
    ...(evaluated ? ['evaluation'] : [])];
  return [title('Every pair'), folded(`${r.pairs.length} pairs`, unfolded && r.pairs.length <= kMaxUnfoldedRows, table(heads, rows),
    ...(evaluated ? [note('Correct: the reported pose is within 0.2 m of the ground truth. False positive: the reported pose is farther ' +
      'away, or the pair does not overlap. Missed: the pair overlaps by 30 % or more and was not reported. Neighbours ' +
      '(j \u2212 i = 1) are not evaluated.')] : []))];
}
function optionsTable(options, unfolded) {
  if (!isObject(options)) return [];
  const rows = (stage, values) => Object.entries(values).map(([name, value]) => row([stage, name, textOf(value)]));
  const entries = Object.entries(options), stages = entries.filter(([, value]) => isObject(value));
  return [title('Options'), folded('Every option of this run', unfolded, table(['stage', 'option', 'value'],
    [...rows('general', Object.fromEntries(entries.filter(([, value]) => !isObject(value)))),
      ...stages.flatMap(([stage, values]) => rows(stage, values))], 'options'),
    note('Lengths in the unit of the clouds, angles in degrees.'))];
}
function showResult(r, unfolded) {
  const about = facts(r), kClasses = {Correct: 'correct', Aligned: 'correct', 'False positive': 'false', Missed: 'missed', 'Not aligned': 'missed'};
  add(about ? note(about) : null, make('p', {}, summary(r)));
  if (r.evaluation)
    add(...scoreTable(r), beside(figure('Recall and precision by least confidence; dot: this run', curvePlot(
      rules(r).reverse().map((rule) => ({name: rule, colour: rule === 'strict' ? kAmber : kBlue, scores: r.evaluation[rule]})))),
      confidencePlot(r, true)));
  else add(confidencePlot(r, false));
  add(title('Time'), beside(figure('Preparation, mean per fragment', stageBars(r.fragments, kAmber)),
    figure('Alignment, mean per pair', stageBars(r.pairs.map((pair) => pair.ms || {}), kBlue))));
  if (r.pictures.length) add(title('Pictures of pairs'));
  for (const p of r.pictures)
    add(make('figure', {}, make('figcaption', {}, make('b', {class: kClasses[p.heading] || ''}, p.heading), ` \u00b7 ${p.caption}`),
      make('img', {alt: 'source and target before and after alignment', src: `data:image/png;base64,${p.png}`})));
  add(...pairTable(r, unfolded), ...optionsTable(r.options, unfolded));
}

// ---- several results
function comparison() {
  const evaluated = results.some((r) => r.evaluation), scenes = [...new Set(results.map((r) => r.scene))];
  const span = (columns, text) => make('th', {colspan: columns}, text), columns = evaluated ? 14 : 6;
  const ruleCells = (s) => s ? [percent(s.recall), s.reported > 0 ? percent(s.precision) : 'n/a',
    s.recall_at_precision ? percent(s.recall_at_precision[95]) : '', percent(s.average_precision ?? NaN).replace('NaN', '')] : ['', '', '', ''];
  const rows = scenes.flatMap((scene) => [
    ...(scenes.length > 1 ? [make('tr', {class: 'scene'}, make('td', {colspan: columns}, scene))] : []),
    ...results.flatMap((r, k) => r.scene !== scene ? [] : [row([make('a', {href: `#result-${k + 1}`}, r.name), r.pairs.length, aligned(r).length,
      ...(evaluated ? [...ruleCells((r.evaluation || {}).strict), ...ruleCells((r.evaluation || {}).geometric)] : []),
      fixed(pairTime(r), 1), fixed(fragmentTime(r), 1), fixed(r.peak_memory_mib, 0)])])]);
  const rule = ['recall', 'precision', 'R@P95', 'AP'];
  const out = table(['result', 'pairs', 'reported', ...(evaluated ? [...rule, ...rule] : []), 'ms per pair', 'ms per fragment', 'peak MiB'], rows);
  if (evaluated) out.prepend(make('tr', {}, span(3, ''), span(4, 'strict, %'), span(4, 'geometric, %'), span(3, '')));
  add(make('h1', {}, `gpureg: ${results.length} results`), title('Comparison'), wide(out));
  if (evaluated)
    add(note('Redwood\'s protocol. Strict: a pair that overlaps by less than 30 % counts as false; geometric: every pair counts by its pose. ' +
      'R@P95: recall at 95 % precision. AP: average precision.'));
  for (const scene of scenes) {
    const figures = ['strict', 'geometric'].flatMap((rule) => {
      const curves = results.filter((r) => r.scene === scene && rules(r).includes(rule))
        .map((r, k) => ({name: r.name, colour: kColours[k % kColours.length], scores: r.evaluation[rule]}));
      return curves.length ? [figure(`${scene}, ${rule} rule`, curvePlot(curves))] : [];
    });
    if (figures.length) add(beside(...figures));
  }
}

if (results.length === 1) {
  add(make('h1', {}, `gpureg: ${results[0].scene}`));
  showResult(results[0], true);
} else {
  comparison();
  results.forEach((r, k) => {
    add(make('h1', {class: 'result', id: `result-${k + 1}`}, r.name));
    showResult(r, false);
  });
}
