// The page's data: what halfgrad wrote, with rules numbered and named.

const typed = { f4: Float32Array, u2: Uint16Array, u4: Uint32Array, u1: Uint8Array };

/** {type, data} with base64 data, as scene_json writes it. */
export function decode(array) {
  const text = atob(array.data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return new typed[array.type](bytes.buffer);
}

/** Positions #points × 3 from 16-bit steps in a box; the greatest step marks a point that was not found. */
export function decodePositions(array, columns) {
  const steps = decode(array);
  const count = steps.length / columns;
  const positions = new Float32Array(3 * count);
  for (let p = 0; p < count; ++p)
    for (let c = 0; c < columns; ++c) {
      const step = steps[p * columns + c];
      positions[3 * p + c] = step === 65535 ? NaN : array.low[c] + step * array.step[c];
    }
  return positions;
}

export const regions = ["all", "interior", "boundary"];
export const regionTitle = { all: "all points", interior: "inside", boundary: "at the boundary" };

export const palette = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a5fbf", "#a0522d", "#5b7f00", "#c2185b"];
const symbols = { linear: "circle", phong: "square", hermite: "triangle", dual_taylor: "diamond2", vertex_blend: "cross", quadratic10: "wye", attribute_transfer: "times", moving_least_squares: "star" };

const text = (value) => (typeof value === "string" ? value : JSON.stringify(value));

/** The reconstructor, with the options that tell it from others of its name among `rows`. */
function variantName(row, rows) {
  const same = rows.filter((other) => other.reconstructor === row.reconstructor && (row.reconstructor || other.interpolant === row.interpolant));
  const told = Object.entries(row.options).filter(([key, value]) => same.some((other) => text(other.options[key]) !== text(value)));
  const words = told.map(([key, value]) => (typeof value === "string" ? value : `${key} ${typeof value === "number" ? short(value) : text(value)}`));
  return (row.reconstructor ? ` + ${row.reconstructor}` : "") + (words.length ? ` (${words.join(", ")})` : "");
}

/** Gives every rule of several runs a name that means the same in all of them. */
export function nameAcross(runs) {
  const rows = runs.flatMap((run) => run.finest);
  for (const run of runs)
    for (const rule of run.rules) {
      const row = run.finest[rule.index];
      const blend = row.interpolant === "vertex_blend" && row.alpha !== 1 ? ` ${row.alpha}` : "";
      rule.sharedName = row.interpolant + blend + variantName(row, rows);
    }
}

/** One run: its rules, its rows grouped, its finest level and last frame. */
export class Run {
  constructor({ results, scene }) {
    this.results = results;
    this.scene = scene;
    this.name = results.name;
    this.rows = results.rows;
    const groups = new Map();
    for (const row of this.rows) {
      const key = `${row.level}/${row.frame}`;
      if (!groups.has(key)) groups.set(key, []);
      row.rule = groups.get(key).length; // all levels and frames have the same rules in the same order
      groups.get(key).push(row);
    }
    this.lastLevel = Math.max(...this.rows.map((row) => row.level));
    this.lastFrame = Math.max(...this.rows.map((row) => row.frame));
    this.finest = groups.get(`${this.lastLevel}/${this.lastFrame}`);
    this.levels = new Set(this.rows.map((row) => row.level)).size;
    this.frames = new Set(this.rows.map((row) => row.frame)).size;
    this.rules = this.finest.map((row, index) => this.#describe(row, index));
  }

  #describe(row, index) {
    const variant = variantName(row, this.finest);
    const blends = this.finest.filter(
      (other) => other.interpolant === row.interpolant && other.reconstructor === row.reconstructor && text(other.options) === text(row.options),
    );
    const interpolant = row.interpolant + (blends.length > 1 && row.alpha !== null ? ` ${row.alpha}` : "");
    // A colour for each reconstructor or baseline, a symbol for each interpolant.
    const variantOf = (other) => (other.reconstructor ?? other.interpolant) + text(other.options);
    const isColored = (other) => other.reconstructor !== "exact" && (other.reconstructor || Object.keys(other.options).length > 0);
    const variants = [...new Set(this.finest.filter(isColored).map(variantOf))];
    const number = isColored(row) ? variants.indexOf(variantOf(row)) : -1;
    return {
      index,
      interpolant: row.interpolant,
      reconstructor: row.reconstructor,
      isBound: row.reconstructor === "exact",
      name: interpolant + variant,
      full: interpolant + (row.reconstructor ? ` + ${row.reconstructor}` : "") + (Object.keys(row.options).length ? ` ${text(row.options)}` : ""),
      color: number >= 0 ? palette[number % palette.length] : row.reconstructor === "exact" ? "#999999" : "#222222",
      symbol: symbols[row.interpolant] ?? "star",
    };
  }

  order(rule, region, norm = "rms") {
    const row = this.finest[rule];
    const found = this.results.orders.find(
      (order) =>
        order.interpolant === row.interpolant && order.reconstructor === row.reconstructor && order.region === region &&
        order.norm === norm && text(order.options) === text(row.options),
    );
    return found?.slope ?? NaN;
  }
}

export const rms = (row, region) => (row.error[region].points > 0 ? row.error[region].rms : NaN);
export const greatest = (row, region) => (row.error[region].points > 0 ? row.error[region].max : NaN);
export const frameSeconds = (row) => row.seconds.gradients + row.seconds.evaluate;

/** "1.23e-4", "12.3": three digits. */
export function short(value) {
  if (value === null || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-2 || size >= 1e5)) return value.toExponential(2).replace(/\.?0+e/, "e").replace("e+", "e");
  return String(Number(value.toPrecision(3)));
}

/** An element with properties and children. */
export function element(tag, properties = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(properties))
    if (key === "style" || key.startsWith("aria-") || key === "for") node.setAttribute(key, value);
    else node[key] = value;
  node.append(...children);
  return node;
}
