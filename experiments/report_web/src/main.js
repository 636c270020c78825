// Builds the page from the data that halfgrad wrote into it.
import css from "./style.css";
import { chartSection } from "./charts.js";
import { Run, element, nameAcross, short } from "./data.js";
import { overviewTable, ruleTable } from "./table.js";
import { Viewer } from "./viewer.js";

function facts(run) {
  const last = run.finest[0];
  const { machine, version } = run.results;
  const parts = [
    `${last.vertices} vertices, ${last.cells} cells (${last.element}), h ${short(last.h)}`,
    `${last.points} points`,
    run.frames > 1 ? `frame ${last.frame}, the last of ${run.frames}` : "",
    `halfgrad ${version} on ${machine.processor ?? "an unknown processor"}`,
  ];
  return element("p", { className: "facts", textContent: parts.filter(Boolean).join(" · ") });
}

/** What an expectation selects, in words. */
function selected(expect) {
  const words = Object.entries(expect).filter(([key]) => !/_at_(least|most)$/.test(key)).map(([key, value]) =>
    key === "interpolant" || key === "reconstructor" || key === "region" || key === "norm" ? value
      : key === "options" ? Object.entries(value).map(([option, setting]) => `${option} ${setting}`).join(" ")
      : `${key} ${value}`);
  return words.join(", ") || "all rules";
}

function expectations(run) {
  const list = run.results.expect.map((expected) =>
    element("li", {},
      element("span", { className: expected.holds ? "holds" : "fails", textContent: expected.holds ? "holds" : "does not hold" }),
      ` ${selected(expected.expect)}: `, element("code", { textContent: `${expected.bound.replace("_at_least", " ≥").replace("_at_most", " ≤")} ${short(expected.limit)}` }), `, measured ${short(expected.measured)}`),
  );
  const held = run.results.expect.filter((expected) => expected.holds).length;
  return [element("h2", { textContent: `Expectations: ${held} of ${list.length} hold` }), element("ul", {}, ...list)];
}

function runSection(run) {
  const section = element("section");
  const description = run.results.config?.description;
  if (description) section.append(element("p", { textContent: description }));
  section.append(facts(run));
  const { recommendation } = run.results;
  if (recommendation) {
    const name = recommendation.interpolant + (recommendation.reconstructor ? ` + ${recommendation.reconstructor}` : "");
    section.append(element("p", { className: "recommended" }, "For this mesh and motion ", element("b", { textContent: name, title: JSON.stringify(recommendation.options) }), `: ${recommendation.reason}.`));
  }
  section.append(element("h2", { textContent: "Rules" }));
  section.append(element("p", { className: "note", textContent:
    "The finest level" + (run.frames > 1 ? " and last frame" : "") +
    ". The best of each column is marked. Gain: rms error of linear interpolation over the rule's. " +
    (run.rules.some((rule) => rule.isBound) ? "exact takes the field's own derivatives: a bound, not a choice. " : "") +
    "A click on a title sorts." }));
  section.append(ruleTable(run));
  let viewer = null;
  // A line needs no view: a chart shows it.
  if (run.scene && run.scene.columns !== 1) {
    section.append(element("h2", { textContent: "Side by side" }));
    const place = element("div");
    section.append(place);
    if (run.scene.omitted) place.append(element("p", { className: "note", textContent: run.scene.omitted }));
    else viewer = new Viewer(run, place);
  }
  section.append(chartSection(run));
  if (run.results.expect.length) section.append(...expectations(run));
  section.append(element("h2", { textContent: "Configuration" }),
    element("details", {}, element("summary", { textContent: "with every default" }), element("pre", { textContent: JSON.stringify(run.results.config, null, 1) })));
  return { section, viewer };
}

function main() {
  const data = JSON.parse(document.getElementById("halfgrad-data").textContent);
  const runs = data.runs.map((run) => new Run(run));
  document.head.append(element("style", { textContent: css }));
  const page = element("main");
  document.body.append(page);
  page.append(element("h1", { textContent: runs.length === 1 ? runs[0].name : data.title }));
  const place = element("div");
  let shown = null;
  const show = (run) => {
    shown?.viewer?.dispose();
    place.replaceChildren();
    shown = runSection(run);
    place.append(shown.section);
    shown.viewer?.start();
    window.halfgradViewer = shown.viewer;
  };
  if (runs.length > 1) {
    nameAcross(runs);
    const choice = element("select", { id: "run" }, ...runs.map((run, i) => element("option", { value: i, textContent: run.name })));
    choice.onchange = () => show(runs[choice.value]);
    page.append(overviewTable(runs), element("div", { className: "bar", style: "margin-top:1.6em" }, element("label", {}, "Run", choice)));
  }
  page.append(place);
  show(runs[0]);
  document.body.dataset.ready = "yes";
}

main();
