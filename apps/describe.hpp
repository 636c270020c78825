// The command line described for other readers than people at a terminal: shells, man, the documentation.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace halfgrad::app {

/// An option or argument of a command.
struct OptionFacts {
  std::string name;  ///< "--rest"; of an argument without dashes its name
  std::string description, fallback;
  std::string value;               ///< what its argument is: FILE, WORD, NUMBER, KEY=VALUE; empty for flags
  std::vector<std::string> words;  ///< what a WORD can be
  bool required = false;

  bool positional() const { return name.front() != '-'; }
};

/// A command, or the program itself with the options that all commands share.
struct CommandFacts {
  std::string name, description, example;
  std::vector<OptionFacts> options;
};

/// What the words of a program mean.
struct ProgramFacts {
  CommandFacts shared;
  std::vector<CommandFacts> commands;
};

/// The words that the argument of an option can be; empty where there is no list.
std::vector<std::string> known_words(std::string_view command, std::string_view option);

/// Formats for describe.
std::vector<std::string_view> description_formats();

/// Completion for bash, zsh or fish, the manual page (man) or the command reference (markdown). Throws Error on another
/// format.
std::string describe(const ProgramFacts& program, std::string_view format);

}  // namespace halfgrad::app
