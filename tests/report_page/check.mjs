// Opens the report of a run in headless Chromium: node check.mjs PROGRAM CONFIG FOLDER [CHROMIUM]
// No error on the console, charts drawn, the slider moves the mesh, another rule another picture. The screenshot stays
// in FOLDER. Exit status 77: skipped, where there is no Chromium or the program has no interactive report.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

const [program, config, folder, chromium = "/usr/bin/chromium"] = process.argv.slice(2);
const skip = (reason) => {
  console.log(`skipped: ${reason}`);
  process.exit(77);
};
if (!existsSync(chromium)) skip(`no ${chromium}`);
mkdirSync(folder, { recursive: true });
execFileSync(program, ["run", config, "--reduced", "--quiet", "--out", folder]);
const page = readFileSync(join(folder, "report.html"), "utf8");
if (!page.includes("halfgrad-data")) skip("the program was built without npm");

// Runs in the page, around its own script: first what listens for errors, last what tries the controls.
const listen = `<script>
window.pageErrors = [];
addEventListener("error", (event) => pageErrors.push(String(event.message)));
for (const kind of ["error", "warn"]) {
  const original = console[kind];
  console[kind] = (...words) => { pageErrors.push(words.join(" ")); original(...words); };
}
</script>`;
const probe = `<script>
addEventListener("load", () => {
  const found = { errors: pageErrors, ready: document.body.dataset.ready };
  try {
    found.rows = document.querySelectorAll("tbody tr").length;
    found.best = document.querySelectorAll("td.best").length;
    found.charts = [...document.querySelectorAll("figure.chart")].map((chart) => ({
      title: chart.querySelector("figcaption").textContent,
      marks: chart.querySelectorAll("svg circle, svg g[aria-label=dot] path, svg g[aria-label=line] path").length,
    }));
    const viewer = halfgradViewer, slider = document.getElementById("frame");
    const go = (time) => { slider.value = time; slider.dispatchEvent(new Event("input")); };
    const copy = (side) => [Array.from(viewer.sides[side].positions), Array.from(viewer.sides[side].geometry.attributes.color.array)];
    const distance = (a, b) => a.reduce((most, value, i) => Math.max(most, Math.abs(value - b[i])), 0);
    const colorsSeen = () => {
      viewer.draw();
      const gl = viewer.renderer.getContext(), w = gl.drawingBufferWidth, h = gl.drawingBufferHeight, pixels = new Uint8Array(4 * w * h);
      gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      const seen = new Set();
      for (let i = 0; i < pixels.length; i += 4 * 7) seen.add(pixels[i] << 16 | pixels[i + 1] << 8 | pixels[i + 2]);
      return seen.size;
    };
    go(slider.max);
    const [last, lastColors] = copy(0), [lastRight] = copy(1);
    found.colors = colorsSeen();
    go(0);
    const [rest] = copy(0), [restRight] = copy(1);
    found.moved = distance(last, rest);
    found.sidesAtRest = distance(rest, restRight);
    found.sidesAtLast = distance(last, lastRight);
    go(slider.max);
    const choice = document.getElementById("left");
    choice.value = "truth";
    choice.dispatchEvent(new Event("change"));
    found.recolored = distance(copy(0)[1], lastColors);
    choice.value = "0";
    choice.dispatchEvent(new Event("change"));
    for (const id of ["flat", "fine", "wires", "logarithmic"]) {
      const box = document.getElementById(id);
      for (let twice = 0; twice < 2; ++twice) { box.checked = !box.checked; box.dispatchEvent(new Event("change")); }
    }
    document.querySelector(".chip").click();
    document.querySelector(".chip").click();
    document.querySelector("thead th:nth-child(2)").click();
    document.querySelector("thead th:first-child").click();
  } catch (error) {
    found.errors.push(String(error.stack));
  }
  const out = document.createElement("script");
  out.type = "application/json";
  out.id = "probe";
  out.textContent = JSON.stringify(found);
  document.body.append(out);
});
</script>`;
const tried = join(folder, "tried.html");
writeFileSync(tried, page.replace("<head>", () => `<head>${listen}`).replace("</body>", () => `${probe}</body>`));

const profile = mkdtempSync(join(tmpdir(), "report_page_"));
const browse = (...options) =>
  execFileSync(chromium, [
    "--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    `--user-data-dir=${profile}`, "--hide-scrollbars", "--window-size=1360,2700", "--virtual-time-budget=8000",
    ...options, `file://${resolve(tried)}`,
  ], { encoding: "utf8", maxBuffer: 1 << 28, timeout: 120000, stdio: ["ignore", "pipe", "pipe"] });
let found;
try {
  const dom = browse("--dump-dom");
  found = JSON.parse(dom.match(/<script type="application\/json" id="probe">(.*?)<\/script>/s)[1]);
  browse(`--screenshot=${resolve(join(folder, "report.png"))}`);
} finally {
  rmSync(profile, { recursive: true, force: true });
  rmSync(tried);
}
console.log(JSON.stringify(found, null, 1));

const failures = [];
const expect = (holds, claim) => holds || failures.push(claim);
expect(found.errors.length === 0, "no error on the console");
expect(found.ready === "yes", "the page was built");
expect(found.rows > 3 && found.best > 3, "a table with the best marked");
expect(found.charts?.length >= 3, "three charts at least");
for (const chart of found.charts ?? []) expect(chart.marks > 0, `marks in "${chart.title}"`);
expect(found.colors > 50, "shading in the 3D view");
expect(found.moved > 1e-2, "the slider moves the mesh");
expect(found.sidesAtRest === 0, "both sides agree at rest");
expect(found.sidesAtLast > 1e-4, "rules differ in the last frame");
expect(found.recolored > 1e-2, "the truth has no error to colour");
for (const failure of failures) console.error(`does not hold: ${failure}`);
process.exit(failures.length ? 1 : 0);
