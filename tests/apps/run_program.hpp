// The program as a user starts it.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace halfgrad {

/// What a run of the program left.
struct Outcome {
  int status;          ///< exit status; −1 where a signal ended it
  std::string output;  ///< stdout and stderr
};

inline Outcome run_command(const std::string& command) {
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  Outcome outcome{-1, ""};
  std::array<char, 4096> buffer;
  while (const std::size_t got = std::fread(buffer.data(), 1, buffer.size(), pipe))
    outcome.output.append(buffer.data(), got);
  const int status = pclose(pipe);
  outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

inline Outcome run_program(const std::string& arguments) {
  return run_command(std::string(HALFGRAD_PROGRAM) + " " + arguments);
}

}  // namespace halfgrad
