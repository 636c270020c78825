// Tables: the rules of a run with the best of each column marked, and several runs beside each other.
import { element, frameSeconds, greatest, rms, short } from "./data.js";
import { marker } from "./charts.js";

function columnsOf(run) {
  const error = (title, value) => ({ title, value, best: Math.min, show: short });
  const gain = (title, region) => ({ title, value: (row) => row.gain_over_linear[region] ?? NaN, best: Math.max, show: short });
  const columns = [
    error("rms inside", (row) => rms(row, "interior")),
    error("max inside", (row) => greatest(row, "interior")),
    gain("gain inside", "interior"),
    error("rms boundary", (row) => rms(row, "boundary")),
    error("max boundary", (row) => greatest(row, "boundary")),
    gain("gain boundary", "boundary"),
  ];
  if (run.results.orders.length)
    for (const [title, region] of [["order inside", "interior"], ["order boundary", "boundary"]])
      columns.push({ title, value: (row) => run.order(row.rule, region), best: Math.max, show: (value) => (Number.isFinite(value) ? value.toFixed(2) : "–") });
  columns.push(error("ms a frame", (row) => 1e3 * frameSeconds(row)), error("ms to bind", (row) => 1e3 * (row.seconds.locate + row.seconds.reconstruct)));
  if (run.finest.some((row) => row.weights.sigma !== null))
    columns.push({ title: "σ of weights", value: (row) => row.weights.sigma ?? NaN, show: short });
  return columns.filter((column) => run.finest.some((row) => Number.isFinite(column.value(row))));
}

const bestOf = (column, rows) => {
  const values = rows.map(column.value).filter(Number.isFinite);
  return column.best && values.length > 1 ? column.best(...values) : NaN;
};

/** The finest level and last frame, a line a rule; a click on a title sorts. */
export function ruleTable(run) {
  const columns = columnsOf(run);
  const contest = run.finest.filter((row) => !run.rules[row.rule].isBound); // exact gradients are a bound, not a choice
  const body = element("tbody");
  const rows = run.finest.map((row) => {
    const rule = run.rules[row.rule];
    const cells = columns.map((column) => {
      const value = column.value(row);
      return element("td", { textContent: column.show(value), className: !rule.isBound && value === bestOf(column, contest) ? "best" : "" });
    });
    return element("tr", { className: rule.isBound ? "bound" : "" }, element("td", { title: rule.full }, marker(rule), rule.name), ...cells);
  });
  body.append(...rows);
  let sorted = null, up = true;
  const heads = [{ title: "rule", value: (row) => row.rule }, ...columns].map((column) => {
    const head = element("th", { textContent: column.title, title: "sort" });
    head.onclick = () => {
      up = sorted === column ? !up : column.best !== Math.max;
      sorted = column;
      const order = [...run.finest].sort((a, b) => {
        const [x, y] = [column.value(a), column.value(b)].map((value) => (Number.isFinite(value) ? value : up ? Infinity : -Infinity));
        return up ? x - y : y - x;
      });
      body.append(...order.map((row) => rows[row.rule]));
      for (const other of heads) other.className = other === head ? (up ? "sorted up" : "sorted") : "";
    };
    return head;
  });
  return element("div", { className: "scroll" }, element("table", {}, element("thead", {}, element("tr", {}, ...heads)), body));
}

/** Gain over linear, a line a rule and a column a run. */
export function overviewTable(runs) {
  const names = [...new Set(runs.flatMap((run) => run.rules.map((rule) => rule.sharedName)))];
  const gain = (run, name) => {
    const rule = run.rules.find((other) => other.sharedName === name);
    return rule ? run.finest[rule.index].gain_over_linear.all ?? NaN : NaN;
  };
  const best = runs.map((run) => Math.max(...run.rules.filter((rule) => !rule.isBound).map((rule) => gain(run, rule.sharedName)).filter(Number.isFinite)));
  const lines = names.map((name) =>
    element("tr", { className: name.includes(" + exact") ? "bound" : "" }, element("td", { textContent: name }), ...runs.map((run, i) => {
      const value = gain(run, name);
      return element("td", { textContent: short(value), className: value === best[i] ? "best" : "" });
    })),
  );
  const head = element("tr", {}, element("th", { textContent: "gain over linear (rms, all points)" }), ...runs.map((run) => element("th", { textContent: run.name })));
  return element("div", { className: "scroll" }, element("table", {}, element("thead", {}, head), element("tbody", {}, ...lines)));
}
