#include "apps/describe.hpp"

#include <algorithm>
#include <array>

#include "experiments/stress_mesh.hpp"
#include "framework/error.hpp"
#include "framework/interpolation_rule.hpp"
#include "framework/json_reader.hpp"
#include "framework/scattered_transfer.hpp"
#include "framework/version.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad::app {

namespace {

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

// For single quotes of a shell.
std::string quoted(const std::string& text) { return "'" + replaced(text, "'", "'\\''") + "'"; }

std::vector<OptionFacts> with_shared(const ProgramFacts& program, const CommandFacts& command) {
  std::vector<OptionFacts> options = command.options;
  for (const OptionFacts& shared : program.shared.options)
    if (std::none_of(options.begin(), options.end(), [&](const OptionFacts& o) { return o.name == shared.name; }))
      options.push_back(shared);
  return options;
}

std::string bash(const ProgramFacts& program) {
  std::vector<std::string> commands;
  std::string options, values, places;
  for (const CommandFacts& command : program.commands) {
    commands.push_back(command.name);
    std::vector<std::string> names;
    for (const OptionFacts& option : with_shared(program, command)) {
      const std::string words = fmt::format("{}", fmt::join(option.words, " "));
      if (option.positional()) {
        if (!words.empty()) places += fmt::format("    {}) words=\"{}\" ;;\n", command.name, words);
        continue;
      }
      names.push_back(option.name);
      if (!option.value.empty())
        values += fmt::format("    {}.{}) words=\"{}\" ;;\n", command.name, option.name, words);
    }
    options += fmt::format("    {}) options=\"{}\" ;;\n", command.name, fmt::join(names, " "));
  }
  std::vector<std::string> shared;
  for (const OptionFacts& option : program.shared.options) shared.push_back(option.name);
  // Where COMPREPLY stays empty, "-o default" completes file names.
  return fmt::format(
      "# bash completion for halfgrad\n"
      "_halfgrad() {{\n"
      "  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}}\n"
      "  local command= word words= options=\"{}\"\n"
      "  for word in \"${{COMP_WORDS[@]:1:COMP_CWORD-1}}\"; do\n"
      "    case $word in {}) command=$word; break ;; esac\n"
      "  done\n"
      "  COMPREPLY=()\n"
      "  case $command in\n"
      "{}"
      "    *) words=\"{}\" ;;\n"
      "  esac\n"
      "  case $command in\n"
      "{}"
      "  esac\n"
      "  case $command.$previous in\n"
      "{}"
      "  esac\n"
      "  if [[ $current == -* ]]; then words=$options; fi\n"
      "  if [[ -n $words ]]; then COMPREPLY=($(compgen -W \"$words\" -- \"$current\")); fi\n"
      "}}\n"
      "complete -o default -F _halfgrad halfgrad\n",
      fmt::join(shared, " "), fmt::join(commands, "|"), options, fmt::join(commands, " "), places, values);
}

std::string zsh_action(const OptionFacts& option) {
  if (!option.words.empty()) return fmt::format("({})", fmt::join(option.words, " "));
  return option.value == "FILE" ? "_files" : "";
}

std::string zsh(const ProgramFacts& program) {
  const auto escaped = [](std::string text) {
    for (const char* special : {"[", "]", ":"}) text = replaced(text, special, std::string("\\") + special);
    return text;
  };
  std::string commands, cases;
  for (const CommandFacts& command : program.commands) {
    commands += "    " + quoted(command.name + ":" + command.description) + "\n";
    cases += fmt::format("    {})\n      _arguments", command.name);
    int place = 0;
    for (const OptionFacts& option : with_shared(program, command)) {
      std::string spec;
      if (option.positional())
        spec = fmt::format("{}:{}:{}", ++place, escaped(option.name), zsh_action(option));
      else if (option.value.empty())
        spec = fmt::format("{}[{}]", option.name, escaped(option.description));
      else
        spec = fmt::format("{}[{}]:{}:{}", option.name, escaped(option.description), option.value, zsh_action(option));
      cases += " \\\n        " + quoted(spec);
    }
    cases += "\n      ;;\n";
  }
  return "#compdef halfgrad\n"
         "_halfgrad() {\n"
         "  local state line\n"
         "  local -a commands=(\n" +
         commands +
         "  )\n"
         "  _arguments -C '1:command:->command' '*::argument:->argument'\n"
         "  if [[ $state == command ]]; then _describe command commands; return; fi\n"
         "  case $line[1] in\n" +
         cases +
         "  esac\n"
         "}\n"
         "if [[ $funcstack[1] == _halfgrad ]]; then _halfgrad \"$@\"; else compdef _halfgrad halfgrad; fi\n";
}

std::string fish(const ProgramFacts& program) {
  std::string text = "# fish completion for halfgrad\ncomplete -c halfgrad -f\n";
  for (const CommandFacts& command : program.commands)
    text += fmt::format("complete -c halfgrad -n __fish_use_subcommand -a {} -d {}\n", command.name,
                        quoted(command.description));
  for (const CommandFacts& command : program.commands) {
    const std::string start = fmt::format("complete -c halfgrad -n '__fish_seen_subcommand_from {}'", command.name);
    for (const OptionFacts& option : with_shared(program, command)) {
      const std::string words = option.words.empty() ? "" : fmt::format(" -a '{}'", fmt::join(option.words, " "));
      if (option.positional())
        text += start + (words.empty() ? " -F" : words) + "\n";
      else
        text += fmt::format("{} -l {}{}{} -d {}\n", start, option.name.substr(2),
                            option.value.empty()     ? ""
                            : option.value == "FILE" ? " -r -F"
                                                     : " -x",
                            words, quoted(option.description));
    }
  }
  return text;
}

// One option in words: "--rest FILE", with what it is unless given.
std::string heading(const OptionFacts& option) {
  return option.positional() || option.value.empty() ? option.name : option.name + " " + option.value;
}

std::string explanation(const OptionFacts& option) {
  std::string text = option.description;
  if (!option.words.empty() && option.words.size() <= 5 && text.find(option.words.front()) == std::string::npos)
    text += fmt::format(" ({})", fmt::join(option.words, ", "));
  if (option.required) text += "; required";
  if (!option.fallback.empty()) text += "; default " + option.fallback;
  return text;
}

std::string synopsis(const CommandFacts& command) {
  std::string text = "halfgrad " + command.name;
  for (const OptionFacts& option : command.options)
    if (option.positional()) text += option.required ? " " + option.name : " [" + option.name + "]";
  for (const OptionFacts& option : command.options)
    if (!option.positional() && option.required) text += " " + heading(option);
  return text + " [options]";
}

constexpr std::array exit_statuses = {"0: all went well, and every expect of a configuration held",
                                      "1: an internal failure",
                                      "2: bad input or usage; the message says what was found, expected and where",
                                      "3: an expect of a configuration did not hold"};

std::string man(const ProgramFacts& program) {
  const auto escaped = [](std::string text) {
    text = replaced(replaced(std::move(text), "\\", "\\e"), "-", "\\-");
    return text.starts_with('.') || text.starts_with('\'') ? "\\&" + text : text;
  };
  const auto list = [&](const std::vector<OptionFacts>& options) {
    std::string text;
    for (const OptionFacts& option : options)
      text += fmt::format(".TP\n.B {}\n{}\n", escaped(heading(option)), escaped(explanation(option)));
    return text;
  };
  std::string text = fmt::format(
      ".TH HALFGRAD 1 \"\" \"halfgrad {}\" \"User commands\"\n.SH NAME\nhalfgrad \\- {}\n"
      ".SH SYNOPSIS\n",
      version, escaped(program.shared.description));
  for (const CommandFacts& command : program.commands) text += ".B " + escaped(synopsis(command)) + "\n.br\n";
  text += ".SH OPTIONS OF ALL COMMANDS\n" + list(program.shared.options);
  for (const CommandFacts& command : program.commands) {
    text += fmt::format(".SH {}\n.B {}\n.PP\n{}\n", escaped(command.name), escaped(synopsis(command)),
                        escaped(command.description) + ".");
    text += list(command.options);
    if (!command.example.empty()) text += fmt::format(".PP\n.EX\n{}\n.EE\n", escaped(command.example));
  }
  text += ".SH EXIT STATUS\n";
  for (const char* status : exit_statuses) text += std::string(status) + "\n.br\n";
  return text;
}

std::string markdown(const ProgramFacts& program) {
  const auto cell = [](const std::string& text) { return replaced(text, "|", "\\|"); };
  const auto table = [&](const std::vector<OptionFacts>& options) {
    std::string text = "| option | meaning |\n|---|---|\n";
    for (const OptionFacts& option : options)
      text += fmt::format("| `{}` | {} |\n", heading(option), cell(explanation(option)));
    return text + "\n";
  };
  std::string text =
      "# Command reference\n\nWritten by `halfgrad describe markdown`; `halfgrad COMMAND --help` says the "
      "same.\n\n";
  for (const CommandFacts& command : program.commands) {
    text += fmt::format("## halfgrad {}\n\n{}.\n\n    {}\n\n", command.name, command.description, synopsis(command));
    if (!command.options.empty()) text += table(command.options);
    if (!command.example.empty()) text += "Example:\n\n    " + command.example + "\n\n";
  }
  text += "## Options of all commands\n\n" + table(program.shared.options) + "## Exit status\n\n";
  for (const char* status : exit_statuses) text += fmt::format("- {}\n", status);
  return text;
}

struct DescriptionFormat {
  std::string_view name;
  std::string (*write)(const ProgramFacts&);
};
constexpr std::array formats = {DescriptionFormat{"bash", bash}, DescriptionFormat{"zsh", zsh},
                                DescriptionFormat{"fish", fish}, DescriptionFormat{"man", man},
                                DescriptionFormat{"markdown", markdown}};

}  // namespace

std::vector<std::string> known_words(std::string_view command, std::string_view option) {
  std::vector<std::string> words;
  if (option == "--interpolant") {
    for (const NamedRule& rule : named_rules()) words.emplace_back(rule.name);
    // Baselines carry displacements, which are no map to export.
    if (command != "export")
      for (const NamedScatteredRule& rule : scattered_rules()) words.emplace_back(rule.name);
  } else if (option == "--reconstructor") {
    for (const ReconstructorEntry& entry : reconstructor_registry()) words.emplace_back(entry.name);
  } else if (option == "--normals") {
    words = {"gradient", "smooth"};
  } else if (option == "--outside") {
    words = {"error", "nearest", "mark"};
  } else if (option == "--precision") {
    words = {"float", "double"};
  } else if (option == "--as") {
    words = {"matrix", "stencils", "bones"};
  } else if (option == "--element") {
    for (const std::string_view name : stress_elements()) words.emplace_back(name);
  } else if (command == "list" && option == "what") {
    words = {"elements", "reconstructors", "interpolants", "fields"};
  } else if (command == "describe" && option == "format") {
    for (std::string_view format : description_formats()) words.emplace_back(format);
  }
  return words;
}

std::vector<std::string_view> description_formats() {
  std::vector<std::string_view> names;
  for (const DescriptionFormat& format : formats) names.push_back(format.name);
  return names;
}

std::string describe(const ProgramFacts& program, std::string_view name) {
  for (const DescriptionFormat& format : formats)
    if (format.name == name) return format.write(program);
  raise("describe {}: expected one of {}", name, join_names(description_formats()));
}

}  // namespace halfgrad::app
