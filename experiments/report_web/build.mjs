// Bundles the page's script and style into one C++ source: node build.mjs SOURCE_FOLDER OUTPUT.cpp
// CMake copies this file into the build folder, so that the packages stand beside it and not in the source tree.
import { build } from "esbuild";
import { writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const [source, output] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const result = await build({
  entryPoints: [join(source, "main.js")],
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  charset: "ascii",
  target: "es2020",
  // The licences of the packages go with their code into every page.
  legalComments: "eof",
  loader: { ".css": "text" },
  nodePaths: [join(here, "node_modules")],
});
const script = result.outputFiles[0].text;

// Pieces: compilers limit the length of one literal.
const pieces = [];
for (let at = 0; at < script.length; at += 8000) pieces.push(JSON.stringify(script.slice(at, at + 8000)));
writeFileSync(
  output,
  `// Generated from experiments/report_web.
#include "experiments/interactive_report.hpp"

namespace halfgrad {

std::string_view report_script() {
  static constexpr char script[] =
      ${pieces.map((piece) => piece.replace(/\?\?/g, "?\\?")).join("\n      ")};
  return {script, sizeof script - 1};
}

}  // namespace halfgrad
`,
);
