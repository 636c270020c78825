// The halfgrad program.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <memory>

#include "apps/deform.hpp"
#include "apps/describe.hpp"
#include "apps/export.hpp"
#include "apps/listings.hpp"
#include "experiments/experiment.hpp"
#include "experiments/merged_report.hpp"
#include "experiments/stress.hpp"
#include "framework/error.hpp"
#include "framework/json_reader.hpp"
#include "framework/version.hpp"

namespace {

using namespace halfgrad;
using namespace halfgrad::app;

enum ExitStatus { all_well = 0, internal_failure = 1, bad_input = 2, expectation_failed = 3 };

constexpr const char* first_words =
    "halfgrad carries detailed points through the deformation of a coarse mesh.\n"
    "\n"
    "  halfgrad deform --rest mesh.msh --frames frames.npy --points surface.obj --out out.npy\n"
    "      carry points through a sequence\n"
    "  halfgrad export --rest mesh.msh --points surface.obj --out map.npz\n"
    "      write the map itself, for SciPy, a game engine or a shader to apply\n"
    "  halfgrad run configs/quickstart.json --out out/quickstart\n"
    "      run an experiment: errors, orders and run times of interpolants and reconstructors\n"
    "\n"
    "halfgrad info mesh.msh shows what is in a mesh; halfgrad --help lists all commands, halfgrad COMMAND --help\n"
    "explains one with an example.\n";

struct RunCommand {
  std::filesystem::path config, out = "results";
  std::vector<std::string> overrides;
  bool reduced = false, check_only = false;
};

int run(const RunCommand& command, ProgressMode mode, bool quiet) {
  std::unique_ptr<Progress> line;
  constexpr std::int64_t steps = 1000;
  RunOptions options;
  options.out_directory = command.check_only ? std::filesystem::path() : command.out;
  options.overrides = command.overrides;
  options.reduced = command.reduced;
  options.check_only = command.check_only;
  line = std::make_unique<Progress>(quiet ? ProgressMode::never : mode, "run", steps, "steps of a thousand");
  options.progress = [&](std::string_view, double fraction) {
    line->advance(static_cast<std::int64_t>(fraction * steps));
  };
  const ExperimentResult result = run_experiment(command.config, options);
  line.reset();
  if (command.check_only) {
    if (!quiet) fmt::print("{}: a valid configuration ({})\n", command.config.string(), result.name);
    return all_well;
  }
  if (!quiet) {
    fmt::print("{}", summary_table(result));
    for (const std::string& file : result.files) fmt::print("written: {}\n", file);
  }
  if (result.all_expectations_hold()) return all_well;
  fmt::print(stderr, "halfgrad: an expectation of {} does not hold\n", command.config.string());
  return expectation_failed;
}

int stress(StressOptions options, const std::filesystem::path& out, ProgressMode mode, bool quiet) {
  constexpr std::int64_t steps = 1000;
  StressResult result;
  {
    Progress line(quiet ? ProgressMode::never : mode, "stress", steps, "steps of a thousand");
    options.progress = [&](double fraction) { line.advance(static_cast<std::int64_t>(fraction * steps)); };
    result = run_stress(options);
  }
  const std::vector<std::string> files = out.empty() ? std::vector<std::string>() : write_stress_report(result, out);
  if (!quiet) {
    fmt::print("{}", stress_summary(result));
    for (const std::string& file : files) fmt::print("written: {}\n", file);
  }
  if (result.passed()) return all_well;
  fmt::print(stderr, "halfgrad: {} properties failed under stress\n", result.num_failures);
  return expectation_failed;
}

CommandFacts facts_of(const CLI::App& app) {
  CommandFacts facts{app.get_name(), app.get_description(), app.get_footer(), {}};
  if (facts.example.starts_with("Example: ")) facts.example.erase(0, 9);
  for (const CLI::Option* option : app.get_options()) {
    OptionFacts entry;
    entry.name = option->get_positional() ? option->get_name(true) : "--" + option->get_lnames().front();
    // Every command has --help; the program's own stands for all.
    if (entry.name == "--help" && app.get_parent() != nullptr) continue;
    entry.description = option->get_description();
    entry.fallback = option->get_default_str();
    entry.required = option->get_required();
    entry.words = known_words(facts.name, entry.name);
    const std::string type = option->get_type_name();
    if (option->get_items_expected_max() > 0)
      entry.value = type.starts_with("INT") || type.starts_with("FLOAT") ? "NUMBER" : type;
    facts.options.push_back(std::move(entry));
  }
  return facts;
}

ProgramFacts facts_of_program(const CLI::App& program) {
  ProgramFacts facts{facts_of(program), {}};
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
    facts.commands.push_back(facts_of(*command));
  return facts;
}

// What --help shows as an option's argument; CLI11 calls both file names and words TEXT.
void name_arguments(CLI::App& app) {
  for (CLI::Option* option : app.get_options())
    if (option->get_items_expected_max() > 0 && option->get_type_name() == "TEXT")
      option->type_name(known_words(app.get_name(), option->get_name(option->get_positional())).empty() ? "FILE"
                                                                                                        : "WORD");
}

// Says what was wrong with the command line and what to type next.
[[noreturn]] void refuse_usage(const CLI::App& program, const CLI::ParseError& error) {
  const std::vector<CLI::App*> parsed = program.get_subcommands();
  const ProgramFacts facts = facts_of_program(program);
  const CommandFacts command = parsed.empty() ? facts.shared : facts_of(*parsed.front());
  const std::string name = parsed.empty() ? "halfgrad" : "halfgrad " + command.name;
  const std::string more = fmt::format("see {} --help", name) +
                           (command.example.empty() ? "" : fmt::format(", or for example: {}", command.example));

  const std::vector<std::string> unknown = program.remaining(true);
  if (unknown.empty())
    raise("{}{}; {}", error.what(), error.get_name() == "ConversionError" ? ", expected a number" : "", more);
  const std::string& word = unknown.front();
  if (!parsed.empty() && word.front() != '-') raise("{}: expected an option before it; {}", word, more);
  std::vector<std::string> names, owners;
  const auto has = [&](const CommandFacts& any) {
    return std::any_of(any.options.begin(), any.options.end(), [&](const OptionFacts& o) { return o.name == word; });
  };
  if (parsed.empty())
    for (const CommandFacts& known : facts.commands) {
      names.push_back(known.name);
      if (has(known)) owners.push_back("halfgrad " + known.name);
    }
  if (!owners.empty()) raise("{} belongs behind a command: {}; {}", word, fmt::join(owners, ", "), more);
  if (std::error_code ignored; parsed.empty() && std::filesystem::exists(word, ignored))
    raise("{} is a file, expected a command before it, such as halfgrad info {}; {}", word, word, more);
  if (!parsed.empty())
    for (const OptionFacts& option : command.options)
      if (!option.positional()) names.push_back(option.name);
  for (const OptionFacts& option : facts.shared.options) names.push_back(option.name);
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string nearest = nearest_name(word, known);
  raise("{} is no {} of {}; {}; {}", word, parsed.empty() ? "command" : "option", name,
        nearest.empty() ? fmt::format("known: {}", join_names(known)) : fmt::format("did you mean {}?", nearest), more);
}

int dispatch(int argc, char** argv) {
  CLI::App program("Carries detailed points through the deformation of a coarse mesh.", "halfgrad");
  program.set_version_flag("--version", std::string("halfgrad ") + version);
  program.require_subcommand(0, 1);
  program.fallthrough();
  int threads = 0;
  bool quiet = false, progress = false;
  program.add_option("--threads", threads, "Number of threads (default: all cores)")->check(CLI::Range(1, 4096));
  program.add_flag("--quiet", quiet, "Print errors only");
  program.add_flag("--progress", progress, "Show progress even where stderr is no terminal");

  RunCommand command;
  CLI::App* run_app = program.add_subcommand("run", "Run an experiment and write results.json");
  run_app->add_option("config", command.config, "Configuration, JSON")->required();
  run_app->add_option("--out", command.out, "Folder for the results")->capture_default_str();
  run_app->add_option("--set", command.overrides, "Override a key, /json/pointer=VALUE")
      ->take_all()
      ->type_name("KEY=VALUE");
  run_app->add_flag("--reduced", command.reduced, "Apply the configuration's \"reduced\" object: the quick version");
  run_app->footer("Example: halfgrad run configs/quickstart.json --out out/quickstart --set /seed=3");

  CLI::App* check_app = program.add_subcommand("check", "Validate a configuration only");
  check_app->add_option("config", command.config, "Configuration, JSON")->required();
  check_app->add_option("--set", command.overrides, "Override a key, /json/pointer=VALUE")
      ->take_all()
      ->type_name("KEY=VALUE");
  check_app->footer("Example: halfgrad check configs/quickstart.json");

  const auto add_limits = [](CLI::App* app, std::vector<std::string>& limits) {
    app->add_option("--limit", limits, fmt::format("Refuse more of a fault than this: {}", join_names(fault_names())))
        ->take_all()
        ->type_name("NAME=NUMBER");
  };
  const auto add_bind_options = [&](CLI::App* app, BindOptions& bind, const std::string& preferred) {
    app->add_option("--rest", bind.rest,
                    "Rest mesh, grid or surface: .msh .vtk .vtu .mesh .node/.ele .vti .vtr .obj .ply");
    app->add_option("--points", bind.points, "Points at rest: .obj .ply .stl .vtk .vtp .vtu .npy");
    app->add_option("--interpolant", bind.interpolant,
                    "A name, or JSON with options; see halfgrad list interpolants (default: phong)");
    app->add_option("--alpha", bind.alpha, "Blend of vertex_blend: 0 linear, 0.5 phong, 1 vertex models");
    app->add_option(
        "--reconstructor", bind.reconstructor,
        "A name, or JSON such as '{\"kriging\": {\"drift\": \"cubic\"}}'; see halfgrad list reconstructors (default: " +
            preferred + "; for dual_taylor kriging with cubic drift)");
    app->add_option("--outside", bind.outside, "Points outside the mesh: error, nearest or mark (default: error)");
    add_limits(app, bind.limits);
  };
  DeformOptions options;
  CLI::App* deform_app = program.add_subcommand("deform", "Carry points through a sequence");
  add_bind_options(deform_app, options.bind, "adaptive");
  deform_app->add_option("--binding", options.bind.binding,
                         "In place of --rest and --points: what halfgrad bind wrote");
  deform_app
      ->add_option("--frames", options.frames,
                   "Deformed vertices: .npy .pc2 .pvd, or a pattern of files (x.%04d.vtu, frames/*.vtu)")
      ->required();
  deform_app
      ->add_option("--out", options.out,
                   "Output: .npy .pc2 .obj .pvd; name.%04d.obj or name.%04d.npy for one file a frame")
      ->required();
  deform_app
      ->add_option("--tolerance", options.tolerance,
                   "Length: simplices that differ from linear by less are evaluated linearly")
      ->capture_default_str();
  deform_app
      ->add_option("--normals", options.normals,
                   "Also carry the surface's normals: gradient (of the map, default) or smooth (across cells)")
      ->expected(0, 1)
      ->default_str("gradient");
  deform_app->add_flag("--tangents", options.tangents,
                       "Also carry tangents with handedness, of the surface or from its texture coordinates, by the "
                       "gradients of --normals");
  deform_app->add_flag("--gradients", options.gradients, "Also write deformation gradients at the points");
  deform_app->add_flag("--stretch", options.stretch, "Also write principal stretches at the points");
  deform_app
      ->add_option("--field", options.fields,
                   "Also carry a field of the vertices: NAME of point data in the frame files or the rest mesh, or "
                   "NAME=FILE.npy")
      ->take_all()
      ->type_name("NAME");
  deform_app->add_option("--precision", options.precision, "float or double")->capture_default_str();
  deform_app->add_option("--first", options.first, "First frame, from 0")->capture_default_str();
  deform_app->add_option("--last", options.last, "Last frame (default: the last one)")->check(CLI::NonNegativeNumber);
  deform_app->add_option("--step", options.step, "Take every step-th frame")->capture_default_str();
  deform_app->add_flag("--resume", options.resume, "Go on behind the frames that the same command left");
  deform_app->add_option("--report", options.report, "Write times, counts and points outside as JSON");
  deform_app->footer(
      "Example: halfgrad deform --rest cage.msh --frames sim.npy --points render.obj --out render.pc2 --precision "
      "float");

  BindOptions bind;
  std::filesystem::path binding, bind_report;
  CLI::App* bind_app = program.add_subcommand("bind", "Locate points once and save that for many runs of deform");
  add_bind_options(bind_app, bind, "adaptive");
  bind_app->add_option("--out", binding, "Output: .hgb")->required();
  bind_app->add_option("--report", bind_report, "Write faults, rules of vertices and points outside as JSON");
  bind_app->footer(
      "Example: halfgrad bind --rest cage.msh --points render.obj --out render.hgb\n"
      "         halfgrad deform --binding render.hgb --frames shot12.npy --out shot12.pc2");

  std::vector<std::filesystem::path> result_folders;
  std::filesystem::path report_file = "report.html";
  CLI::App* report_app = program.add_subcommand("report", "Show the results of several runs in one page");
  report_app->add_option("folders", result_folders, "Folders that halfgrad run wrote")->required();
  report_app->add_option("--out", report_file, "The page, HTML")->capture_default_str();
  report_app->footer("Example: halfgrad report out/lattice out/jittered --out out/both.html");

  StressOptions stress_options;
  std::filesystem::path stress_out;
  CLI::App* stress_app = program.add_subcommand("stress", "Try what is promised on random bad meshes");
  stress_app->add_option("--seed", stress_options.seed, "Seed of the first case")->capture_default_str();
  stress_app->add_option("--cases", stress_options.num_cases, "Cases an element")->capture_default_str();
  stress_app->add_option("--minutes", stress_options.minutes, "Stop after so many minutes (default: no limit)");
  stress_app->add_option("--element", stress_options.elements, "These elements only")->take_all();
  stress_app->add_option("--out", stress_out, "Folder for stress.json and stress.html (default: none)");
  stress_app->footer("Example: halfgrad stress --cases 1000 --out out/stress");

  ExportOptions map;
  CLI::App* export_app = program.add_subcommand("export", "Write the map from vertices to points for other programs");
  add_bind_options(export_app, map.bind, "kriging");
  export_app->add_option("--binding", map.bind.binding, "In place of --rest and --points: what halfgrad bind wrote");
  export_app
      ->add_option("--out", map.out, "Output: .npz (SciPy, or stencils) .mtx (Matrix Market) .json (affine bones)")
      ->required();
  export_app->add_option("--as", map.as, "matrix, stencils or bones (default: .json holds bones, others a matrix)");
  export_app->add_option("--precision", map.precision, "float or double")->capture_default_str();
  export_app->add_flag("--transpose", map.transpose, "Write the matrix's transpose, which carries forces");
  export_app->add_option("--frames", map.frames, "Deformed vertices, for the transforms of bones");
  export_app->add_option("--first", map.first, "First frame, from 0")->capture_default_str();
  export_app->add_option("--last", map.last, "Last frame (default: the last one)")->check(CLI::NonNegativeNumber);
  export_app->add_option("--step", map.step, "Take every step-th frame")->capture_default_str();
  export_app->footer("Example: halfgrad export --rest cage.msh --points render.obj --out map.npz");

  std::string what;
  bool as_json = false;
  CLI::App* list_app = program.add_subcommand("list", "List elements, reconstructors, interpolants, fields");
  list_app->add_option("what", what, "elements, reconstructors, interpolants or fields (default: all)");
  list_app->add_flag("--json", as_json, "Print JSON");
  list_app->footer("Example: halfgrad list reconstructors");

  std::filesystem::path mesh;
  CLI::App* info_app = program.add_subcommand("info", "Counts, bounds, quality and faults of a mesh");
  info_app->add_option("mesh", mesh, "Mesh file")->required();
  info_app->add_flag("--json", as_json, "Print JSON");
  std::vector<std::string> info_limits;
  add_limits(info_app, info_limits);
  info_app->footer("Example: halfgrad info cage.msh");

  std::string format;
  CLI::App* describe_app =
      program.add_subcommand("describe", "Print shell completion, the manual page or the command reference");
  describe_app->add_option("format", format, "bash, zsh, fish, man or markdown")->required();
  describe_app->footer("Example: halfgrad describe bash > ~/.local/share/bash-completion/completions/halfgrad");

  name_arguments(program);
  for (CLI::App* command_app : program.get_subcommands([](CLI::App*) { return true; })) name_arguments(*command_app);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) refuse_usage(program, error);
    return program.exit(error);
  }
  std::unique_ptr<tbb::global_control> limit;
  if (threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(threads));
  const ProgressMode mode = progress ? ProgressMode::always : ProgressMode::terminal;
  if (run_app->parsed()) return run(command, mode, quiet);
  if (check_app->parsed()) {
    command.check_only = true;
    return run(command, mode, quiet);
  }
  if (deform_app->parsed()) {
    options.progress = mode;
    options.quiet = quiet;
    deform(options);
    return all_well;
  }
  if (report_app->parsed()) {
    write_merged_report(result_folders, report_file);
    if (!quiet) fmt::print("written: {}\n", report_file.string());
    return all_well;
  }
  if (stress_app->parsed()) return stress(stress_options, stress_out, mode, quiet);
  if (bind_app->parsed()) {
    save_binding(bind, binding, bind_report, quiet);
    return all_well;
  }
  if (export_app->parsed()) {
    map.progress = mode;
    map.quiet = quiet;
    export_map(map);
    return all_well;
  }
  if (list_app->parsed()) {
    list(what, as_json);
    return all_well;
  }
  if (info_app->parsed()) {
    info(mesh, info_limits, as_json);
    return all_well;
  }
  if (describe_app->parsed()) {
    fmt::print("{}", describe(facts_of_program(program), format));
    return all_well;
  }
  fmt::print("{}", first_words);
  return all_well;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return dispatch(argc, argv);
  } catch (const halfgrad::Error& error) {
    fmt::print(stderr, "halfgrad: {}\n", error.what());
    return bad_input;
  } catch (const halfgrad::app::Interrupted& interrupted) {
    fmt::print(stderr, "halfgrad: {}\n", interrupted.what());
    // Ends as the signal would have, so that shells and queues see it.
    std::signal(interrupted.signal, SIG_DFL);
    std::raise(interrupted.signal);
    return internal_failure;
  } catch (const std::exception& error) {
    fmt::print(stderr, "halfgrad: internal failure: {}\n", error.what());
    return internal_failure;
  }
}
