// Charts of a run; chips above them choose the rules that all of them show.
import * as Plot from "@observablehq/plot";
import { decode, decodePositions, element, frameSeconds, greatest, palette, regionTitle, rms, short } from "./data.js";

/** The colour and symbol of a rule as a small <svg>. */
export function marker(rule) {
  const hidden = { axis: null, domain: [-1, 1] };
  const dot = Plot.dot([0], { x: 0, y: 0, symbol: rule.symbol, fill: rule.color, stroke: rule.color, r: 4 });
  const svg = Plot.plot({ width: 13, height: 13, margin: 6.5, x: hidden, y: hidden, symbol: { type: "identity" }, marks: [dot] });
  svg.classList.add("marker");
  return svg;
}

const width = 580, height = 380;
const axisFormat = (value) => {
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(0).replace("e+", "e") : String(Number(value.toPrecision(3)));
};

/** Ticks of a logarithmic axis: powers of ten, with multiples where there are few of them. */
function logTicks(values) {
  const shown = values.filter((value) => value > 0 && Number.isFinite(value));
  if (!shown.length) return [];
  const low = Math.min(...shown), high = Math.max(...shown), decades = Math.log10(high / low);
  const factors = decades < 0.8 ? [1, 1.5, 2, 3, 4, 5, 6, 8] : decades < 2.2 ? [1, 2, 5] : [1];
  const step = Math.max(1, Math.ceil(decades / 9));
  const ticks = [];
  for (let power = Math.floor(Math.log10(low)) - 1; power <= Math.ceil(Math.log10(high)); power += step)
    for (const factor of factors) ticks.push(factor * 10 ** power);
  return ticks.filter((tick) => tick >= low / 1.3 && tick <= high * 1.3);
}

const axis = (label, values, type = "log") => ({ label, type, grid: true, labelOffset: label.startsWith("↑") ? undefined : 40, tickFormat: axisFormat, ...(type === "log" ? { ticks: logTicks(values) } : {}) });

function figure(title, note, plot) {
  return element("figure", { className: "chart" }, element("figcaption", {}, title, element("span", { textContent: note ? `  ${note}` : "" })), plot);
}

const common = { width, height, marginLeft: 62, marginBottom: 48, marginRight: 18, marginTop: 14, style: { fontSize: "12px" }, symbol: { type: "identity" } };

/** Lines and symbols of `points` ({x, y, rule, text}), by rule. */
function rulesPlot(run, points, x, y, { lines = true, before = [], after = [], inset = 12 } = {}) {
  const logarithmic = (axisOptions) => axisOptions.type === "log";
  const shown = points.filter((point) => Number.isFinite(point.x) && Number.isFinite(point.y) && (!logarithmic(x) || point.x > 0) && (!logarithmic(y) || point.y > 0));
  const color = (point) => run.rules[point.rule].color;
  return Plot.plot({
    ...common, inset, x, y,
    marks: [
      ...before,
      lines ? Plot.line(shown, { x: "x", y: "y", z: "rule", stroke: color, strokeWidth: 1.6 }) : null,
      Plot.dot(shown, { x: "x", y: "y", stroke: color, fill: color, symbol: (point) => run.rules[point.rule].symbol, r: 4 }),
      ...after,
      Plot.tip(shown, Plot.pointer({ x: "x", y: "y", title: "text", maxRadius: 30 })),
    ],
  });
}

// Dashed lines of slope 2, 3, 4 through the upper right of the data.
function guides(points) {
  const low = Math.min(...points.map((point) => point.x)), high = Math.max(...points.map((point) => point.x));
  const top = Math.max(...points.map((point) => point.y)), bottom = Math.min(...points.map((point) => point.y));
  return [2, 3, 4].flatMap((slope) => {
    // A guide ends where the data end, so that it does not stretch the chart.
    const start = Math.max(low, high * (bottom / top) ** (1 / slope));
    const line = [{ x: high, y: top }, { x: start, y: top * (start / high) ** slope }];
    return [
      Plot.line(line, { x: "x", y: "y", stroke: "#9aa4ae", strokeDasharray: "3 4" }),
      Plot.text([line[1]], { x: "x", y: "y", text: () => `h${"⁰¹²³⁴"[slope]}`, fill: "#7a848e", dx: -4, dy: -8 }),
    ];
  });
}

function convergence(run, shown, region) {
  const points = run.rows
    .filter((row) => row.frame === run.lastFrame && shown.has(row.rule))
    .map((row) => ({ x: row.h, y: rms(row, region), rule: row.rule, text: `${run.rules[row.rule].name}\nh ${short(row.h)}, rms ${short(rms(row, region))}\nslope ${run.order(row.rule, region).toFixed(2)}` }))
    .filter((point) => point.y > 0);
  if (!points.length) return null;
  const x = axis("mean edge length h →", points.map((point) => point.x)), y = axis("↑ rms error", points.map((point) => point.y));
  return figure(`Convergence ${regionTitle[region]}`, "dashed: h², h³, h⁴; a point tells its slope", rulesPlot(run, points, x, y, { before: guides(points) }));
}

function pareto(run, shown) {
  const points = run.rows
    .filter((row) => row.frame === run.lastFrame && shown.has(row.rule))
    .map((row) => ({ x: 1e3 * frameSeconds(row), y: rms(row, "all"), rule: row.rule, text: `${run.rules[row.rule].name}\n${short(1e3 * frameSeconds(row))} ms a frame\nrms ${short(rms(row, "all"))}${run.levels > 1 ? `\nlevel ${row.level}` : ""}` }))
    .filter((point) => point.x > 0 && point.y > 0);
  if (!points.length) return null;
  const contest = points.filter((point) => !run.rules[point.rule].isBound).sort((a, b) => a.x - b.x);
  const front = [];
  for (const point of contest) if (!front.length || point.y < front[front.length - 1].y) front.push(point);
  const before = [Plot.line(front, { x: "x", y: "y", curve: "step-after", stroke: "#333", strokeWidth: 1.2, strokeOpacity: 0.65 })];
  const x = axis("ms a frame: gradients and points →", points.map((point) => point.x)), y = axis("↑ rms error", points.map((point) => point.y));
  return figure("Run time against error", `every rule${run.levels > 1 ? " and level" : ""}; line: nothing is better in both`, rulesPlot(run, points, x, y, { lines: false, before }));
}

function overFrames(run, shown) {
  const points = run.rows
    .filter((row) => row.level === run.lastLevel && shown.has(row.rule))
    .map((row) => ({ x: row.frame, y: rms(row, "all"), rule: row.rule, text: `${run.rules[row.rule].name}\nframe ${row.frame}, rms ${short(rms(row, "all"))}` }));
  return figure("Error a frame", "finest level", rulesPlot(run, points, axis("frame →", [], "linear"), axis("↑ rms error", points.map((point) => point.y).filter((y) => y > 0))));
}

/** Options of a reconstructor that take at least four values: ε of the paper's weights, k of knn, … */
function sweeps(run) {
  const found = [];
  for (const reconstructor of new Set(run.finest.map((row) => row.reconstructor).filter(Boolean)))
    for (const interpolant of new Set(run.finest.map((row) => row.interpolant))) {
      const rows = run.finest.filter((row) => row.reconstructor === reconstructor && row.interpolant === interpolant);
      for (const key of Object.keys(rows[0]?.options ?? {})) {
        const swept = rows.filter((row) => typeof row.options[key] === "number");
        if (new Set(swept.map((row) => row.options[key])).size >= 4) found.push({ reconstructor, interpolant, key, rows: [...swept].sort((a, b) => a.options[key] - b.options[key]) });
      }
    }
  return found;
}

function sweepCharts({ reconstructor, interpolant, key, rows }) {
  const logarithmic = rows.every((row) => row.options[key] > 0);
  const label = key === "epsilon" ? "ε →" : `${key} →`;
  const chart = (title, kinds, yLabel) => {
    const points = kinds.flatMap(({ name, value, color }) => rows.map((row) => ({ x: row.options[key], y: value(row), name, color })).filter((point) => point.y > 0));
    if (!points.length) return null;
    const x = axis(label, points.map((point) => point.x), logarithmic ? "log" : "linear"), y = axis(yLabel, points.map((point) => point.y));
    return figure(title, `${interpolant} + ${reconstructor}, finest level`, Plot.plot({
      ...common, inset: 12, x, y, marginRight: 70,
      marks: [
        Plot.line(points, { x: "x", y: "y", z: "name", stroke: "color", strokeWidth: 1.8 }),
        Plot.dot(points, { x: "x", y: "y", fill: "color", r: 3.5 }),
        ...kinds.map(({ name, dy = 0 }) => Plot.text(points.filter((point) => point.name === name), Plot.selectLast({ x: "x", y: "y", text: "name", fill: "color", textAnchor: "start", dx: 8, dy }))),
        Plot.tip(points, Plot.pointer({ x: "x", y: "y", title: (point) => `${point.name}\n${key} ${short(point.x)}: ${short(point.y)}` })),
      ],
    }));
  };
  const errors = [
    { name: "max", color: "#d55e00", value: (row) => greatest(row, "all") },
    { name: "rms", color: "#0072b2", dy: -7, value: (row) => rms(row, "all") },
  ];
  if (rows[0].error.all.mean !== undefined) errors.push({ name: "mean", color: "#009e73", dy: 7, value: (row) => row.error.all.mean });
  return [
    chart(`Error against ${key}`, errors, "↑ error"),
    chart(`Deviation σ of the weights against ${key}`, [{ name: "σ", color: "#8a5fbf", value: (row) => row.weights.sigma ?? NaN }], "↑ σ"),
  ].filter(Boolean);
}

function histogram(run, shown) {
  const scene = run.scene;
  if (!scene || scene.omitted) return null;
  const bins = 60;
  const errors = run.rules.map((rule) => shown.has(rule.index) ? decode(scene.rules[rule.index].errors.at(-1)) : []);
  // From the least per cent of some rule: points on vertices have no error but round-off's.
  let low = Infinity, high = 0;
  for (const list of errors) {
    const sorted = Float32Array.from(list).filter((error) => error > 0).sort();
    if (!sorted.length) continue;
    low = Math.min(low, sorted[Math.floor(sorted.length / 100)]);
    high = Math.max(high, sorted.at(-1));
  }
  if (!(high > low)) return null;
  low = Math.max(low, high * 1e-6);
  const start = Math.log10(low), step = (Math.log10(high) - start) / bins;
  const points = [];
  errors.forEach((list, rule) => {
    if (!list.length) return;
    const counts = new Array(bins).fill(0);
    for (const error of list) if (error >= low) counts[Math.min(bins - 1, Math.floor((Math.log10(error) - start) / step))] += 1;
    counts.forEach((count, bin) => points.push({ x: 10 ** (start + (bin + 0.5) * step), y: (100 * count) / list.length, rule, text: `${run.rules[rule].name}\n${((100 * count) / list.length).toFixed(1)} % of points near ${short(10 ** (start + (bin + 0.5) * step))}` }));
  });
  const x = axis("error of a point →", [low, high]), y = { ...axis("↑ % of points a bin", [], "linear"), zero: true };
  return figure("Histogram of errors", "finest level, last frame; left is better", Plot.plot({
    ...common, inset: 6, x, y,
    marks: [
      Plot.areaY(points, { x: "x", y1: 0, y2: "y", z: "rule", fill: (point) => run.rules[point.rule].color, fillOpacity: 0.06, curve: "step" }),
      Plot.line(points, { x: "x", y: "y", z: "rule", stroke: (point) => run.rules[point.rule].color, strokeWidth: 1.5, curve: "step" }),
      Plot.tip(points, Plot.pointer({ x: "x", y: "y", title: "text" })),
    ],
  }));
}

/** In one dimension the signed error along the axis shows everything: James 2020, Fig. 7. */
function profile(run, shown) {
  const scene = run.scene;
  if (!scene || scene.omitted || scene.columns !== 1) return null;
  const rest = decodePositions(scene.rest.points, 1), truth = decodePositions(scene.frames.at(-1).truth, 1);
  const order = [...Array(rest.length / 3).keys()].sort((a, b) => rest[3 * a] - rest[3 * b]);
  const points = run.rules.filter((rule) => shown.has(rule.index)).flatMap((rule) => {
    const size = decode(scene.rules[rule.index].errors.at(-1));
    const value = decodePositions(scene.rules[rule.index].positions.at(-1), 1);
    return order.map((p) => ({ x: rest[3 * p], y: Math.sign(value[3 * p] - truth[3 * p]) * size[p], rule: rule.index, text: `${rule.name}\nX ${short(rest[3 * p])}: ${short(size[p])}` }));
  });
  // Lines of one reconstructor differ here: a colour for each rule.
  const color = (point) => (run.rules[point.rule].reconstructor ? palette[point.rule % palette.length] : run.rules[point.rule].color);
  return figure("Signed error along the axis", "finest level", Plot.plot({
    ...common, inset: 6, x: axis("X →", [], "linear"), y: axis("↑ interpolated − true", [], "linear"),
    marks: [
      Plot.ruleY([0], { stroke: "#9aa4ae" }),
      Plot.line(points, { x: "x", y: "y", z: "rule", stroke: color, strokeWidth: 1.6 }),
      Plot.tip(points, Plot.pointer({ x: "x", y: "y", title: "text" })),
    ],
  }));
}

/** All charts of a run, with chips that hide and show rules. */
export function chartSection(run) {
  const section = element("div", {}, element("h2", { textContent: "Charts" }));
  const swept = sweeps(run);
  const inSweep = new Set(swept.flatMap(({ rows }) => rows.map((row) => row.rule)));
  // A sweep has charts of its own; of its rules the others show the one nearest to the paper's parameter.
  const shown = new Set(run.rules.map((rule) => rule.index).filter((rule) => !inSweep.has(rule) || swept.some(({ rows, key }) => rows.reduce((a, b) => (Math.abs(Math.log(b.options[key])) < Math.abs(Math.log(a.options[key])) ? b : a)).rule === rule)));
  const place = element("div", { className: "charts" });
  const draw = () => {
    const charts = [];
    if (run.levels > 1) charts.push(convergence(run, shown, "interior"), convergence(run, shown, "boundary"));
    charts.push(profile(run, shown), pareto(run, shown), histogram(run, shown));
    if (run.frames > 1) charts.push(overFrames(run, shown));
    place.replaceChildren(...swept.flatMap(sweepCharts), ...charts.filter(Boolean));
  };
  const chips = element("div", { className: "chips" }, ...run.rules.map((rule) => {
    const chip = element("button", { className: shown.has(rule.index) ? "chip" : "chip off", title: `${rule.full}: hide or show` }, marker(rule), rule.name);
    chip.onclick = () => {
      if (!shown.delete(rule.index)) shown.add(rule.index);
      chip.classList.toggle("off", !shown.has(rule.index));
      draw();
    };
    return chip;
  }));
  section.append(chips, place);
  draw();
  return section;
}
